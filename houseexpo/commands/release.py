"""``houseexpo release``: a folder that can be uploaded as it is."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def release(
    dataset: Annotated[Path, typer.Argument(help="Data set folder that houseexpo build wrote.", show_default=False)],
    out: Annotated[Path, typer.Option(help="Folder: new, empty, or a former release.", show_default=False)],
    title: Annotated[str, typer.Option(help="Title of the data set.", show_default="says what there is")] = "",
    creator: Annotated[
        list[str] | None, typer.Option(help="Creator; may be repeated.", show_default="HouseExpo contributors")
    ] = None,
    release_version: Annotated[str, typer.Option(help="Version of the data set.")] = "1.0.0",
    date: Annotated[str, typer.Option(help="Date of publication, such as 2026-05-01.", show_default="none")] = "",
    url: Annotated[str, typer.Option(help="Where the data set will be.", show_default="none")] = "",
    doi: Annotated[str, typer.Option(help="DOI, where one is reserved.", show_default="none")] = "",
    workers: Annotated[int | None, typer.Option(min=1, help="Processes.", show_default="one a core")] = None,
) -> None:
    """Release a data set: Parquet tables, JSON archive, splits, Croissant, data card, licence, citation, checksums.

    Plans of houses that the project makes, or of sources whose licence the manifest states. The same data set in a
    folder of the same name gives the same bytes.
    """
    from rich.table import Table

    from houseexpo.commands.printing import console
    from houseexpo.release import About
    from houseexpo.release import release as run_release
    from houseexpo.release.about import CREATORS
    from houseexpo.workers import cores

    about = About(title, tuple(creator or CREATORS), release_version, date, url, doi)
    done = run_release(dataset, out, about, workers=workers or cores())
    table = Table(title=f"{done.licence.title} ({done.licence.spdx}), {done.size / 1e6:,.1f} MB")
    table.add_column("table")
    parts = next(iter(done.rows.values()))
    for part in parts:
        table.add_column(part, justify="right")
    for name, rows in done.rows.items():
        table.add_row(name, *(f"{count:,}" for count in rows.values()))
    printed = console()
    printed.print(table)
    printed.print(str(done.folder), style="dim", highlight=False, soft_wrap=True)
