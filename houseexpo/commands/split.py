"""``houseexpo split``: divide a data set for learning."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from houseexpo.errors import ConfigError


def split(
    dataset: Annotated[Path, typer.Argument(help="Folder, archive or JSON lines.", show_default=False)],
    train: Annotated[float, typer.Option(help="Share of the plans.")] = 0.7,
    val: Annotated[float, typer.Option(help="Share of the plans.")] = 0.1,
    test: Annotated[float, typer.Option(help="Share of the plans.")] = 0.2,
    paper: Annotated[bool, typer.Option("--paper", help="The paper's 70/30, without validation plans.")] = False,
    seed: Annotated[int, typer.Option(min=0, help="Decides which plan goes where.")] = 0,
    out: Annotated[Path | None, typer.Option(help="Folder for splits/; the data set's own by default.")] = None,
    workers: Annotated[int | None, typer.Option(min=1, help="Processes; all cores by default.")] = None,
) -> None:
    """Divide a data set: no house and no copy of a house in two parts, the same kinds of houses in all of them."""
    from rich.console import Console
    from rich.table import Table

    from houseexpo.dataset import open_dataset
    from houseexpo.dataset.splits import PAPER, write_split
    from houseexpo.dataset.splits import split as run_split
    from houseexpo.workers import cores

    if out is None and not dataset.is_dir():
        raise ConfigError(f"{dataset}: an archive is not written to; say where with --out")
    plans = open_dataset(dataset)
    shares = PAPER if paper else {"train": train, "val": val, "test": test}
    found = run_split(plans, shares, seed, workers or cores())
    files = write_split(found, dataset if out is None else out)
    record = found.record()
    table = Table(title=f"{len(plans)} plans, {record['groups']} groups of copies and levels stay together")
    for heading in ("list", "ids", "share", "SHA-256"):
        table.add_column(heading, justify="right" if heading in ("ids", "share") else "left")
    for name, said in record["lists"].items():
        table.add_row(name, str(said["ids"]), f"{said['ids'] / max(len(plans), 1):.3f}", said["sha256"][:16])
    console = Console()
    console.print(table)
    for file in files:
        console.print(str(file), style="dim", highlight=False, soft_wrap=True)
