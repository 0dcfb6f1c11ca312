"""Do the work of ``houseexpo build`` and ``houseexpo.build``: build, run a shard, or check hashes; show the outcome."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from houseexpo.errors import ANSWER_IS_NO, NOT_DONE
from houseexpo.progress import is_quiet
from houseexpo.words import count_noun
from pipeline.cli_common import load_build_config, show_outcomes

if TYPE_CHECKING:
    from houseexpo.dataset.build_record import BuildRecord
    from pipeline.batch.assemble import BuildResult
    from pipeline.executors.local import Executor


@dataclass(frozen=True)
class BuildRequest:
    """The request for a build; ``given`` holds the options that override the manifest's."""

    config: Path | None
    given: Mapping[str, Any]
    overrides: Path | None
    out: str
    workers: int | None
    executor: str
    address: str | None
    rehash: bool

    def record(self, *, add: bool) -> BuildRecord:
        """Return the command that repeats this build from any folder."""
        from houseexpo.dataset.build_record import BuildCommand, BuildRecord
        from houseexpo.dataset.manifest import is_bundled_manifest
        from pipeline.batch.listing import absolute_source
        from pipeline.config_file import absolute_folders

        options = {name: value for name, value in self.given.items() if name != "sources" and value is not None}
        if "model_path" in options:
            options["model_path"] = absolute_folders(options["model_path"], Path())
        if "weights" in options:
            options["weights"] = str(Path(options["weights"]).absolute())
        for name, path in (("config", self.config), ("overrides", self.overrides)):
            if path is not None:
                options[name] = path.stem if name == "config" and is_bundled_manifest(path) else str(path.absolute())
        if add:
            options["add"] = True
        sources = tuple(absolute_source(source) for source in self.given["sources"])
        return BuildRecord(BuildCommand(sources, {name: str(value) for name, value in sorted(options.items())}))

    def load_ahead(self) -> None:
        """Begin to load what the workers need, if files are named and no earlier build may have done all of it."""
        is_new = not Path(self.out, ".build").exists()
        if self.executor == "local" and is_new and any(Path(source).exists() for source in self.given["sources"]):
            from pipeline.batch import WORKER_MODULES
            from pipeline.executors import local

            local.load_ahead(WORKER_MODULES)

    def execute(self) -> Executor:
        """Return the executor."""
        from functools import partial

        from houseexpo.processes import count_cores
        from pipeline.executors import local, ray

        if self.executor == "ray":
            return partial(ray.run, address=self.address)
        return partial(local.run, workers=self.workers or count_cores())


def build_and_show(work: BuildRequest, others: str, check: Callable[[], None]) -> int:
    """Build, show the outcome, and return the exit code."""
    data_set = build_data_set(work, others, check)
    from pipeline.terminal_report import read_index_rows  # not before the workers have begun to load

    return show_outcomes(data_set, read_index_rows(data_set.root), work.out)


def write_source_record(work: BuildRequest, name: str) -> None:
    """Write what a person is shown of an input while they correct it to standard output; nothing is built.

    A line that comes in asks for it again, with what is said then; the end of the input ends it.
    """
    from houseexpo.dataset.source_records import encode_source_record
    from pipeline.overrides import load_overrides
    from pipeline.source_record import SourceReader

    found = SourceReader(load_build_config(work.config, work.given), name)
    while True:
        overrides = load_overrides(work.config, work.overrides, Path(work.out))
        sys.stdout.buffer.write(encode_source_record(found.record(overrides)) + b"\n")
        sys.stdout.buffer.flush()
        if not sys.stdin.readline():
            return


def from_python(
    sources: Sequence[str],
    out: str,
    *,
    config: Path | None,
    overrides: Path | None,
    workers: int | None,
    others: str,
    **given: Any,
) -> int:
    """Build for ``houseexpo.build``; return the number of inputs that a transient fault left undone."""
    from pipeline.config_file import find_manifest

    options = {**given, "sources": tuple(sources)}
    chosen = None if config is None else find_manifest(config)
    return build_data_set(
        BuildRequest(chosen, options, overrides, out, workers, "local", None, rehash=False), others, lambda: None
    ).not_done


def build_data_set(work: BuildRequest, others: str, check: Callable[[], None]) -> BuildResult:
    """Build a data set folder with its report and the record of how it was made."""
    work.load_ahead()
    from houseexpo.dataset.build_record import read_build_record, write_build_record
    from pipeline.batch.build import build as run_build
    from pipeline.batch.data_set_folder import ExistingPlansPolicy
    from pipeline.batch.result_store import FolderStore
    from pipeline.batch.shards import remove_common_settings
    from pipeline.display import make_display
    from pipeline.html_report import write_report
    from pipeline.overrides import load_overrides
    from pipeline.terminal_report import outcomes_by_id

    check()
    root, adds = Path(work.out), others == ExistingPlansPolicy.ADD
    with make_display(check) as display:
        overrides = load_overrides(work.config, work.overrides, root)
        data_set = run_build(
            load_build_config(work.config, work.given),
            root,
            overrides=overrides,
            workers=work.workers or 1,
            progress=display.progress,
            others=ExistingPlansPolicy(others),
            rehash=work.rehash,
            execute=work.execute(),
            ended=display.note_outcome,
        )
        record = work.record(add=adds)
        write_build_record(root, record.with_earlier(read_build_record(root)) if adds else record)
        corrections = list(outcomes_by_id(data_set))
        if not data_set.unchanged:
            remove_common_settings(FolderStore(root))
            write_report(data_set, display.progress, corrections)
    for name, outcome, sentence in corrections:
        if outcome == "none":
            typer.secho(f"correction without effect: {name}: {sentence}", fg="yellow", err=True)
    return data_set


def build_one_shard(work: BuildRequest, shard: str, check: Callable[[], None]) -> int:
    """Run one shard, show its outcome, and return the exit code."""
    from pipeline.batch.shard_build import begin_shards, build_shard
    from pipeline.batch.shards import Shard
    from pipeline.display import make_display
    from pipeline.overrides import load_overrides

    check()
    asked = Shard.of(shard)
    overrides = load_overrides(work.config, work.overrides, None if "://" in work.out else Path(work.out))
    begun = begin_shards(load_build_config(work.config, work.given), work.out, asked.count, overrides)
    write_build_command(out=work.out, record=work.record(add=False))
    with make_display(check) as display:
        done = build_shard(
            begun,
            work.out,
            asked,
            execute=work.execute(),
            progress=display.progress,
            rehash=work.rehash,
            ended=display.note_outcome,
        )
    if not is_quiet():
        typer.echo(f"shard {asked}: {done.inputs - len(done.not_done)} of {count_noun(done.inputs, 'house')} done")
        if not done.not_done:
            typer.echo(f"next, when all shards are done: houseexpo assemble {work.out}")
    for name, why in list(done.not_done.items())[:8]:
        typer.secho(f"{name}: {why}; run the shard again when it has passed", fg=typer.colors.YELLOW)
    return NOT_DONE if done.not_done else 0


def write_build_command(out: str, record: BuildRecord) -> None:
    """Keep the record where shards are built: when they are assembled, the data set says how it can be built again."""
    from houseexpo.dataset.build_record import FILE, encode_build_record, remember_own_build
    from pipeline.batch.result_store import FolderStore, open_store

    store, data = open_store(out), encode_build_record(record)
    if isinstance(store, FolderStore):
        remember_own_build(store.root, record)
    with suppress(FileNotFoundError):
        if store.get(FILE) == data:
            return
    store.put(FILE, data)


def verify_or_exit(places: list[str]) -> None:
    """Check data sets; exit with 1 if something is damaged."""
    from pipeline.batch.result_store import is_url
    from pipeline.batch.verify import find_damaged_files

    if not places:
        raise typer.BadParameter("name the data set", param_hint="--verify")
    if url := next(filter(is_url, places), None):
        raise typer.BadParameter(f"{url}: expected a folder, found a URL; copy it to a folder", param_hint="--verify")
    folders = [Path(place) for place in places]
    wrong = [f"{folder}: {line}" for folder in folders for line in find_damaged_files(folder)]
    for line in wrong:
        typer.secho(line, fg=typer.colors.RED)
    if wrong:
        typer.echo(f"{count_noun(len(wrong), 'file')} changed or gone; the build's own command writes what is missing")
        raise typer.Exit(ANSWER_IS_NO)
    typer.echo("every file is as it was written")
