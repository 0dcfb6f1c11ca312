"""The command ``stats``: it reads the command line, calls, and shows what came of it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from stats.gather import Gathered


def stats(
    dataset: Annotated[Path, typer.Argument(help="A data set: a folder, .tar.gz, .zip, .jsonl or .jsonl.gz.")],
    out: Annotated[Path | None, typer.Option(help="The report, an HTML file.", show_default=False)] = None,
    json: Annotated[Path | None, typer.Option(help="The same numbers as JSON.", show_default=False)] = None,
    compare: Annotated[Path | None, typer.Option(help="Another data set, side by side.", show_default=False)] = None,
    unusable: Annotated[
        Path | None, typer.Option(help="A list of plans that someone found bad, judged.", show_default=False)
    ] = None,
    geometry: Annotated[
        bool, typer.Option("--geometry", help="Find rooms and doors of plans that have none; some minutes, once.")
    ] = False,
    workers: Annotated[int | None, typer.Option(min=1, help="Processes.", show_default="one a core")] = None,
) -> None:
    """Say what a data set is made of: rooms, labels, areas, doors, what a robot reaches, repeats, splits.

    What is measured is kept in the cache, so that a second run is quick.
    """
    from rich.console import Console

    from houseexpo.dataset import open_dataset
    from houseexpo.errors import ConfigError
    from stats.gather import add_up, gather, records
    from stats.listed import judge, read_list
    from stats.report import Report
    from stats.table import tables
    from stats.write import write_json, write_page

    listed = None if unusable is None else read_list(unusable)
    opened = open_dataset(dataset)
    if not len(opened):
        raise ConfigError(f"{dataset}: expected plans, found none")
    found = records(opened, geometry=geometry, workers=workers)
    other: Gathered | None = None
    if compare is not None:
        other = gather(open_dataset(compare), geometry=geometry, workers=workers)
    verdict = None if listed is None or unusable is None else judge(found, listed, unusable.name)
    report = Report(add_up(opened, found, geometry=geometry), other, verdict)
    console = Console()
    for table in tables(report):
        console.print(table)
    for what, path, write in (("report", out, write_page), ("numbers", json, write_json)):
        if path is not None:
            write(report, opened, path)
            console.print(f"[bold]{what:8}[/]{path}", highlight=False, soft_wrap=True)
