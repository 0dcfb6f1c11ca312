"""Define the commands for builds in shards: ``assemble`` makes the data set, ``slurm`` writes the jobs' scripts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated

import typer

from houseexpo.errors import NOT_DONE, HouseExpoError
from houseexpo.words import count_noun
from pipeline.cli_common import end_cleanly, load_build_config, resolve_manifest, show_outcomes
from pipeline.display import LISTED


def assemble(
    dataset: Annotated[
        str, typer.Argument(metavar="DATASET", help="Folder in which the shards were built: a path or a URL.")
    ],
    partial: Annotated[
        bool,
        typer.Option("--partial", help="Leave out houses that are not done, instead of ending without a data set."),
    ] = False,
) -> None:
    """Assemble a data set from the plans of its shards: drop duplicates, write index, statistics and manifest.

    Ends with 3 if houses are not done yet, and says which; with 4 if nothing became a plan.
    """
    with end_cleanly() as check:
        code = assemble_and_show(dataset, check, partial=partial)
    if code:
        raise typer.Exit(code)


def slurm(
    manifest: Annotated[
        Path, typer.Argument(metavar="MANIFEST", help="Manifest of the build: a TOML file.", callback=resolve_manifest)
    ],
    shards: Annotated[int, typer.Option(min=1, help="Number of shards.")],
    out: Annotated[str, typer.Option(help="Folder of the data set: a path that all nodes share, s3://... or gs://...")],
    partition: Annotated[str | None, typer.Option(help="Partition of the cluster.", show_default=False)] = None,
    time: Annotated[
        str | None, typer.Option(help="Time limit of a task, such as 04:00:00.", show_default=False)
    ] = None,
    memory: Annotated[str | None, typer.Option(help="Memory of a task, such as 8G.", show_default=False)] = None,
    cores: Annotated[int, typer.Option(min=1, help="Number of cores of a task.")] = 1,
    limit: Annotated[
        int | None,
        typer.Option(
            "--array-limit", min=1, help="Largest number of tasks in an array.", show_default="the limit of the cluster"
        ),
    ] = None,
    scripts: Annotated[
        Path | None, typer.Option(help="Folder for scripts and logs.", show_default="OUT/.build/slurm")
    ] = None,
    submit: Annotated[bool, typer.Option("--submit", help="Also submit the jobs.")] = False,
) -> None:
    """Write scripts with which a Slurm cluster builds a data set in shards and assembles it.

    Run again, it takes up only the shards that are not done and not in the queue.
    """
    from pipeline.batch.result_store import is_url
    from pipeline.batch.shard_build import begin_shards, unfinished_inputs
    from pipeline.batch.slurm import (
        ARRAY_LIMIT,
        QueuedShards,
        SlurmScripts,
        TaskResources,
        largest_array,
        program_command,
    )
    from pipeline.overrides import load_overrides

    resources = TaskResources(partition, time, memory, cores)
    with end_cleanly():
        overrides = load_overrides(manifest, None, None if is_url(out) else Path(out))
        begun = begin_shards(load_build_config(manifest, {}), out, shards, overrides)
        place = out if is_url(out) else str(Path(out).absolute())
        command = [
            *program_command(),
            "build",
            "--config",
            str(manifest.absolute()),
            "--out",
            place,
            "--workers",
            str(cores),
        ]
        folder = scripts or Path("houseexpo-slurm" if is_url(out) else Path(out) / ".build" / "slurm")
        written = SlurmScripts(folder.absolute(), place, command, shards, resources)
        try:
            queue, at_most = written.queue(), limit or largest_array()
        except HouseExpoError as error:
            if submit:
                raise
            typer.secho(f"{error}; the scripts are for all shards that are not done", fg=typer.colors.YELLOW, err=True)
            queue, at_most = QueuedShards(), limit or ARRAY_LIMIT
        count = written.write(unfinished_inputs(begun, out), at_most, queue)
        waiting = f", {len(queue.shards)} are in the queue" if queue.shards else ""
        typer.echo(f"{count} of {count_noun(shards, 'shard')} to submit{waiting}: sh {written.folder / 'submit.sh'}")
        if submit:
            typer.echo(written.submit())


def assemble_and_show(out: str, check: Callable[[], None], *, partial: bool) -> int:
    """Assemble the data set if all shards are done; return the exit code."""
    from pipeline.batch.shard_build import (
        DamagedShardsError,
        assemble_shards,
        require_common_settings,
        unfinished_inputs,
    )
    from pipeline.display import make_display
    from pipeline.html_report import write_report
    from pipeline.terminal_report import outcomes_by_id, read_index_rows

    begun = require_common_settings(out)
    left = unfinished_inputs(begun, out)
    _show_left(left, begun.shards, "not done")
    if left and not partial:
        return NOT_DONE
    try:
        with (
            make_display(check) as display,
            assemble_shards(begun, out, display.progress, partial=partial) as data_set,
        ):
            if not data_set.unchanged:
                write_report(data_set, display.progress, list(outcomes_by_id(data_set)))
            rows = read_index_rows(data_set.root)  # the root of one in an object store is gone after this
    except DamagedShardsError as damaged:
        _show_left(damaged.left, begun.shards, "damaged")
        return NOT_DONE
    return show_outcomes(data_set, rows, out)


def _show_left(left: Mapping[int, Sequence[str]], shards: int, what: str) -> None:
    """Name on standard error what the shards have not done, and what to do about it, also with -q."""
    for number, ids in left.items():
        named = ", ".join(ids[:LISTED]) + (", ..." if len(ids) > LISTED else "")
        said = f"shard {number}/{shards}: {what}: {count_noun(len(ids), 'house')}: {named}"
        typer.secho(said, fg=typer.colors.YELLOW, err=True)
    count = sum(map(len, left.values()))
    if count:
        typer.echo(
            f"{what}: {count_noun(count, 'house')} of {count_noun(len(left), 'shard')}; run these shards again, "
            "or leave the houses out with --partial",
            err=True,
        )
