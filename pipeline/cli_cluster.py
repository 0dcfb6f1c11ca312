"""The commands for builds on many machines: ``assemble``, and ``slurm``, which writes the scripts for one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

import typer

from pipeline.cli_parts import NOT_DONE, ended_cleanly, show_outcomes

_NAMED = 8
"""How many houses are named that a shard has not done."""


def assemble(
    dataset: Annotated[str, typer.Argument(metavar="DATASET", help="Where the shards were built: a path or a URL.")],
    partial: Annotated[
        bool, typer.Option("--partial", help="Leave out what is not done, instead of saying so only.")
    ] = False,
) -> None:
    """Put a data set together from the plans of its shards: duplicates, index, statistics, manifest.

    Where houses are not done yet it says which, and ends with 3.
    """
    with ended_cleanly() as check:
        not_done = assemble_all(dataset, check, partial=partial)
    if not_done:
        raise typer.Exit(NOT_DONE)


def assemble_all(out: str, check: Callable[[], None], *, partial: bool) -> int:
    """Assemble where nothing is left to do; return how many inputs are not done."""
    from rich.console import Console

    from pipeline.batch.shard_build import assembled, begun_at, left_of
    from pipeline.display import Display
    from pipeline.report_page import write_report

    begun = begun_at(out)
    left = left_of(begun, out)
    for number, ids in left.items():
        named = ", ".join(ids[:_NAMED]) + (", ..." if len(ids) > _NAMED else "")
        typer.secho(f"shard {number}/{begun.shards}: {len(ids)} houses are not done: {named}", fg=typer.colors.YELLOW)
    count = sum(map(len, left.values()))
    if count and not partial:
        typer.echo(f"{count} houses of {len(left)} shards are not done; run those shards, or --partial leaves them out")
        return count
    with Display(Console(stderr=True), check) as display, assembled(begun, out, display.progress) as data_set:
        if not data_set.unchanged:
            write_report(data_set, display.progress)
    show_outcomes(data_set, out)
    return data_set.not_done
