"""``houseexpo split``: write lists of ids that split a data set for learning, with no house in two of them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from houseexpo.commands.arguments import DataSetArgument, Processes, ReplaceOption
from houseexpo.errors import ConfigError


def split(
    dataset: DataSetArgument,
    train: Annotated[float | None, typer.Option(help="Share of the plans.", show_default="0.7, or the rest")] = None,
    val: Annotated[float | None, typer.Option(help="Share of the plans.", show_default="0.1, or the rest")] = None,
    test: Annotated[float | None, typer.Option(help="Share of the plans.", show_default="0.2, or the rest")] = None,
    paper: Annotated[bool, typer.Option("--paper", help="The paper's 70/30, without validation plans.")] = False,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the random choice.")] = 0,
    out: Annotated[Path | None, typer.Option(help="Folder for splits/; the data set's own by default.")] = None,
    workers: Processes = None,
    replace: ReplaceOption = False,
) -> None:
    """Split a data set: levels and copies of a house stay together, and all parts have similar kinds of houses."""
    from houseexpo.commands.printing import make_console, new_table
    from houseexpo.dataset import open_dataset
    from houseexpo.dataset.splits import PAPER, write_split
    from houseexpo.dataset.splits import split_plans as run_split
    from houseexpo.dataset.store import files_at
    from houseexpo.outputs import check_not_in_inputs
    from houseexpo.processes import count_cores
    from houseexpo.words import count_noun

    if out is None and not files_at(dataset, "split without --out").is_dir():
        raise ConfigError(
            f"{dataset}: expected the folder of a data set to write lists into; name another folder with --out"
        )
    if paper and any(share is not None for share in (train, val, test)):
        raise ConfigError("--paper: the shares are 0.7 and 0.3; leave out --train, --val and --test")
    if out is not None and not (out.exists() and dataset.exists() and out.samefile(dataset)):
        check_not_in_inputs(out, [dataset])
    plans = open_dataset(dataset)
    shares = PAPER if paper else _shares({"train": train, "test": test, "val": val})
    found = run_split(plans, shares, seed, workers or count_cores())
    files = write_split(found, dataset if out is None else out, replace=replace)
    record = found.record()
    table = new_table()
    for heading in ("list", "ids", "share", "SHA-256"):
        table.add_column(heading, justify="right" if heading in ("ids", "share") else "left")
    for name, said in record["lists"].items():
        table.add_row(name, str(said["ids"]), f"{said['ids'] / max(len(plans), 1):.3f}", said["sha256"][:16])
    printed = make_console()
    printed.print(table)
    kept = count_noun(record["groups"], "group") if record["groups"] else "none"
    said = f"{count_noun(len(plans), 'plan')}; levels and copies of a house that stay together: {kept}"
    printed.print(said, highlight=False, soft_wrap=True)
    for file in files:
        printed.print(f"written {file}", highlight=False, soft_wrap=True)


def _shares(given: dict[str, float | None]) -> dict[str, float]:
    """Return the shares of the splits: the given ones; the first of the others gets the rest, if there is any.

    If none is given, they are 0.7 train, 0.1 val, 0.2 test.
    """
    known = {name: share for name, share in given.items() if share is not None}
    if not known:
        return {"train": 0.7, "val": 0.1, "test": 0.2}
    rest = round(1.0 - sum(known.values()), 9)
    heir = next((name for name, share in given.items() if share is None), None)
    found = {**known, heir: rest} if heir is not None and rest > 0 else known
    return {name: found[name] for name in ("train", "val", "test") if name in found}
