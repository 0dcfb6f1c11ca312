"""Write a data set (docs/format.md) from outcomes and stored plans: unique ids, no duplicates, index and manifest."""

from __future__ import annotations

import hashlib
import io
import logging
import os
import signal
import threading
import zipfile
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from importlib.metadata import entry_points, version
from itertools import chain, count
from pathlib import Path
from typing import Any, Final, Protocol

import msgspec
import numpy as np

from houseexpo.analysis.copies import Duplicate, choose_duplicates, find_copies
from houseexpo.analysis.similarity import SYMMETRIES, PairSearchResult, SimilarPair
from houseexpo.corrections import Override
from houseexpo.dataset.index import index_row, index_table
from houseexpo.dataset.splits import find_split_lists
from houseexpo.files import encode_json, sha256_of, sync_folder, write_atomically
from houseexpo.floorplan import FloorPlan, decode
from houseexpo.plan.json_codec import FORMAT, encode
from houseexpo.processes import count_cores
from pipeline.batch import disk
from pipeline.batch.data_set_folder import MANIFEST, PARTS, DataSetFolder, FinishedBuild, WrittenFile
from pipeline.batch.entry import Entry, PlanRecord, StoredRejection
from pipeline.batch.plan_store import PlanStore
from pipeline.batch.recipe import library_versions, modules_digest
from pipeline.config import DedupeConfig
from pipeline.config_file import BuildConfig
from pipeline.rejection import Reason
from pipeline.sources import is_path
from pipeline.values import MADE

_BESIDE = ("duplicates.jsonl", "index.parquet", "rejected.jsonl", "stats.json")


@dataclass(frozen=True)
class BuildResult:
    """What a finished build came to: its statistics, the ids of its plans, and what a person should know of it.

    ``not_done`` counts the inputs that a transient fault kept from being done; ``unchanged``: it stood so before;
    ``entries`` say what came of each input, ``ignored`` counts the files of its folders that are no houses, by suffix;
    ``links`` are the links, pipes and devices in its folders that are not read; ``passed_over`` says which sources hold
    no house; ``overrides`` are the corrections, under the ids of its inputs, and ``idle_keeps`` the plans that a person
    keeps and that nothing would have left out, if they were looked for;
    ``duplicates`` are the plans that it left out, each with the one that it repeats;
    ``licences`` are those that its sources state, "" among them where one states none; ``sources`` are those of this
    build, without others that it was added to.
    """

    root: Path
    stats: Mapping[str, Any]
    ids: tuple[str, ...]
    refused: tuple[StoredRejection, ...]
    not_done: int = 0
    unchanged: bool = False
    entries: tuple[Entry, ...] = ()
    ignored: Mapping[str, int] = field(default_factory=dict)
    links: tuple[str, ...] = ()
    passed_over: tuple[str, ...] = ()
    licences: tuple[str, ...] = ()
    sources: tuple[str, ...] = ()
    duplicates: tuple[Duplicate, ...] = ()
    idle_keeps: frozenset[str] = frozenset()
    overrides: Mapping[str, Override] = field(default_factory=dict)

    @property
    def is_fruitless(self) -> bool:
        """Whether no input of this build, other than dropped ones, became a plan or a duplicate."""
        own = [entry for entry in self.entries if not self.sources or entry.source in self.sources]
        refused = [each for entry in own for each in entry.refused if each.reason != Reason.DROPPED_BY_HAND]
        return bool(refused) and not any(entry.plans for entry in own)


@dataclass(frozen=True)
class AssemblyParts:
    """What a data set is put together from: sorted entries, plans, and the rights on which the sources agree."""

    folder: DataSetFolder
    plans: PlanStore
    entries: Sequence[Entry]
    sources: Sequence[str]
    config: BuildConfig
    overrides: Mapping[str, Override]
    rights: Rights

    def state(self) -> str:
        """Return a hash of all that the data set depends on."""
        outcomes = [(entry.plans, entry.refused, entry.versions, entry.transient) for entry in self.entries]
        words = {name: asdict(override) for name, override in self.overrides.items()}
        lists = [
            (str(file.relative_to(self.folder.root)), file.read_bytes()) for file in find_split_files(self.folder.root)
        ]
        sources = (names_without_folders(self.sources), self.rights)
        how = (_parameters(self.config), self.config.build.keep_stages)
        parts = (outcomes, sources, how, words, sorted(lists), modules_digest(__name__))
        return hashlib.sha256(msgspec.json.encode(parts, order="deterministic")).hexdigest()


def assemble(parts: AssemblyParts, progress: Callable[[str, int, int], None]) -> BuildResult:
    """Write everything but the pictures, the manifest last; nothing if the same data set is already written.

    Raises
    ------
    DamagedPlanError
        Where a plan is not in the store as it was kept.
    """
    folder = parts.folder
    state, before = parts.state(), folder.last_finished()
    if before is not None and before.state == state and _is_unchanged(folder, before):
        return _as_it_was(parts, before)
    progress("assembling", 0, 1)
    plans, refused = _settle_ids(parts.entries)
    kept = _store_renamed(parts, plans)
    dropped, idle_keeps = _find_copies(parts, kept)
    for duplicate in dropped:
        del kept[duplicate.id]
    files = plan_file_hashes(kept, pictured=parts.config.build.keep_stages)
    folder.announce(files)
    published = write_plans(folder, parts.plans, kept, files, before)
    remove_old_files(folder, published.written)
    stats = {"outcomes": {**_outcomes(parts, len(kept), dropped, refused), **published.counts}, **published.summaries}
    beside = {
        "index.parquet": index_table(_with_copies(published.rows, dropped)),
        "rejected.jsonl": _lines(r.line() for r in refused),
        "duplicates.jsonl": _lines(d._asdict() for d in dropped),
        "stats.json": encode_json(stats),
    }
    for name, data in beside.items():
        write_atomically(folder.root / name, data, durable=True)
    os.sync()  # the plans, whose names the manifest is about to vouch for
    write_atomically(folder.root / MANIFEST, encode_json(_manifest(parts, files, stats)), durable=True)
    sync_folder(folder.root)
    others = {name: folder.describe(name, sha256_of(folder.root / name)) for name in (*_BESIDE, MANIFEST)}
    folder.finish(FinishedBuild(parts.state(), {**published.written, **others}))
    progress("assembling", 1, 1)
    not_done = stats["outcomes"]["not_done"]
    return BuildResult(
        folder.root,
        stats,
        tuple(kept),
        tuple(refused),
        not_done,
        entries=tuple(parts.entries),
        duplicates=tuple(dropped),
        idle_keeps=idle_keeps,
    )


_SOON_S = 0.5
"""What is planned by then after the libraries are there is most often one plan."""


def load_while_workers_start(planned: threading.Event, several: bool) -> None:
    """Begin to load, in a thread, what ``assemble`` needs: libraries, and the kernels that compare plans.

    That takes a second, about as long as the workers take to start. Without ``several`` inputs, and if all is
    ``planned`` soon, the kernels are left out: a single plan needs no comparison.
    """
    threading.Thread(target=_load_for_assembling, args=(planned, several), daemon=True).start()


def _load_for_assembling(planned: threading.Event, several: bool) -> None:
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # Ctrl-C is the main thread's business
    with suppress(Exception):  # what is wrong shows where it is needed
        new_summaries()
        index_table([])
        if several or not planned.wait(_SOON_S):
            square = np.ones((4, 4), bool)
            find_copies(lambda _: square, 2)


def _is_unchanged(folder: DataSetFolder, finished: FinishedBuild) -> bool:
    """Tell whether every file looks as it was written, and no other plan lies beside them."""
    own = {name for name in finished.files if name.partition("/")[0] in PARTS}
    return folder.names() == own and all(folder.stands(name, written) for name, written in finished.files.items())


def _as_it_was(parts: AssemblyParts, finished: FinishedBuild) -> BuildResult:
    stats = msgspec.json.decode((parts.folder.root / "stats.json").read_bytes())
    _, refused = _settle_ids(parts.entries)
    ids = sorted(Path(name).stem for name in finished.files if name.startswith("json/"))
    not_done = stats["outcomes"]["not_done"]
    lines = (parts.folder.root / "duplicates.jsonl").read_bytes().splitlines()
    return BuildResult(
        parts.folder.root,
        stats,
        tuple(ids),
        tuple(refused),
        not_done,
        unchanged=True,
        entries=tuple(parts.entries),
        duplicates=tuple(Duplicate(**msgspec.json.decode(line)) for line in lines),
    )


def _find_copies(parts: AssemblyParts, kept: Mapping[str, PlanRecord]) -> tuple[list[Duplicate], frozenset[str]]:
    """Return the plans that repeat others, and those that a person keeps although nothing would leave them out."""
    keep = {name for name, plan in kept.items() if plan.by_hand or _override(name, plan, parts.overrides).keep}
    alone = {name for name in keep if not kept[name].kept_from}
    if parts.config.stages.dedupe.off:
        return [], frozenset(alone)
    pairs = find_duplicate_pairs(
        parts.folder.build / "copies.npz", parts.plans, list(kept.values()), parts.config.stages.dedupe
    )
    found = choose_duplicates(list(kept), pairs, keep)
    without = {each.id for each in choose_duplicates(list(kept), pairs, set())} if alone else set()
    return found, frozenset(alone - without)


def _with_copies(rows: list[dict[str, Any]], dropped: Iterable[Duplicate]) -> list[dict[str, Any]]:
    """Return the rows of the index, each with the plans that it stands for: storeys of its house, or repeats."""
    copies: dict[str, list[str]] = {}
    for duplicate in dropped:
        copies.setdefault(duplicate.kept_id, []).append(duplicate.id)
    return [{**row, "copies": copies.get(row["id"], [])} for row in rows]


def _settle_ids(entries: Sequence[Entry]) -> tuple[list[tuple[str, PlanRecord]], list[StoredRejection]]:
    """Return the plans with their final ids, sorted, and what was refused; no two inputs share an id."""
    plans = [(number, kept) for number, entry in enumerate(entries) for kept in entry.plans]
    own = {(number, kept.id) for number, kept in plans}
    others = {
        (number, refused.id): refused.content or _content(entry)
        for number, entry in enumerate(entries)
        for refused in entry.refused
        if (number, refused.id) not in own
    }
    ids = [kept.id for _, kept in plans] + [name for _, name in others]
    names = make_unique_ids(ids, [kept.content for _, kept in plans] + list(others.values()))
    of_plans, of_others = names[: len(plans)], names[len(plans) :]
    named = {(number, kept.id): name for (number, kept), name in zip(plans, of_plans, strict=True)}
    named |= dict(zip(others, of_others, strict=True))
    refused = [
        msgspec.structs.replace(each, id=named[number, each.id])
        for number, entry in enumerate(entries)
        for each in entry.refused
    ]
    refused.sort(key=lambda each: (each.id, each.stage, each.reason, each.detail))
    return sorted(zip(of_plans, (kept for _, kept in plans), strict=True), key=lambda pair: pair[0]), refused


def _store_renamed(parts: AssemblyParts, plans: Iterable[tuple[str, PlanRecord]]) -> dict[str, PlanRecord]:
    """Return the plans by final id; one whose id had to change is kept again."""
    found = {}
    for name, kept in plans:
        found[name] = kept
        if name != kept.id:
            renamed = parts.plans.put(
                name, kept.content, encode(replace(decode(parts.plans.get(kept)), id=name)) + b"\n"
            )
            found[name] = msgspec.structs.replace(
                renamed, stages=kept.stages, by_hand=kept.by_hand, kept_from=kept.kept_from
            )
    return found


def _content(entry: Entry) -> str:
    """Return a hash of what an input held, by which it can be told from another of the same id."""
    held = [(file.name, file.sha256) for file in entry.files] or [("", entry.input)]
    return hashlib.sha256(msgspec.json.encode(held)).hexdigest()


def _override(name: str, kept: PlanRecord, overrides: Mapping[str, Override]) -> Override:
    return overrides.get(name) or overrides.get(kept.id) or Override()


def _outcomes(
    parts: AssemblyParts, plans: int, dropped: list[Duplicate], refused: list[StoredRejection]
) -> dict[str, Any]:
    not_done = sum(entry.transient for entry in parts.entries)
    reasons = Counter(r.reason for r in refused)
    return {
        "inputs": len(parts.entries),
        "plans": plans,
        "duplicates": len(dropped),
        "rejected": len(refused) - not_done,
        "not_done": not_done,
        "reasons": dict(sorted(reasons.items(), key=lambda pair: (-pair[1], pair[0]))),
    }


def _lines(values: Iterable[dict[str, Any]]) -> bytes:
    return b"".join(msgspec.json.encode(value) + b"\n" for value in values)


def _manifest(parts: AssemblyParts, own: Mapping[str, str], stats: Mapping[str, Any]) -> dict[str, Any]:
    root = parts.folder.root
    lists = sorted(path.relative_to(root).as_posix() for path in find_split_files(root))
    files = {name: sha256_of(root / name) for name in (*_BESIDE, *lists)}
    others = {
        entry.input: entry.versions for entry in parts.entries if entry.plans and entry.versions != library_versions()
    }
    made_otherwise = {
        plan.id: entry.versions for entry in parts.entries if entry.input in others for plan in entry.plans
    }
    return {
        "format": FORMAT,
        "generator": {"name": "houseexpo", "version": version("houseexpo")},
        "sources": names_without_folders(parts.sources),
        **msgspec.to_builtins(parts.rights),
        "parameters": _parameters(parts.config),
        "parameters_sha256": parts.config.digest(),
        "overrides": {name: asdict(override) for name, override in parts.overrides.items()},
        "versions": library_versions(),
        **({"versions_of": dict(sorted(made_otherwise.items()))} if made_otherwise else {}),
        "counts": stats["outcomes"],
        "files": dict(sorted((files | dict(own)).items())),
    }


def _parameters(config: BuildConfig) -> dict[str, Any]:
    """Return the parameters of the plans, the limits, and that copies were kept if they were."""
    found = {**config.parameters(), "limits": asdict(config.limits)}
    return {**found, "dedupe": {**found["dedupe"], "off": True}} if config.stages.dedupe.off else found


def names_without_folders(sources: Iterable[str]) -> list[str]:
    """Return the names of the sources without the folders of this machine, which a published data set must not show."""
    return sorted(disk.printable(Path(source).name) if is_path(source) else source for source in sources)


# Ids of plans (docs/format.md, "Ids"): readers make them, a build sees to it that no two are equal.


DIGITS = 8


def make_unique_ids(ids: Sequence[str], contents: Sequence[str]) -> list[str]:
    """Return ids of which no two are equal, also where a file system does not tell upper from lower case.

    1. An id that stands alone stays as it is.
    2. Equal ids all get eight digits of their content's hash.
    3. An id that is still taken gets a number as well, the first number that makes it unique.

    Parameters
    ----------
    ids, contents
        The readers' ids, and the SHA-256 of what each was made from (hex digits), in the same order.
    """
    times = Counter(map(str.casefold, ids))
    alone = [times[name.casefold()] == 1 for name in ids]
    taken = {name.casefold() for name, only in zip(ids, alone, strict=True) if only}
    settled = []
    for name, content, only in zip(ids, contents, alone, strict=True):
        if only:
            settled.append(name)  # R1
            continue
        apart = f"{name}_{content[:DIGITS]}"  # R2
        numbered = (f"{apart}_{number}" for number in count(2))  # R3
        free = next(each for each in chain([apart], numbered) if each.casefold() not in taken)
        taken.add(free.casefold())
        settled.append(free)
    return settled


# Which plans of a data set are copies of each other, kept from build to build: only new plans are compared.


_NAMES = tuple(SYMMETRIES)


def find_duplicate_pairs(
    file: Path, plans: PlanStore, kept: Sequence[PlanRecord], config: DedupeConfig
) -> tuple[SimilarPair, ...]:
    """Return all pairs that are copies, by the plans' places in ``kept``, which is sorted by id.

    ``file`` keeps the pairs that were compared; a damaged file is ignored.
    """
    if len(kept) < 2:
        return ()
    rule = {name: value for name, value in asdict(config).items() if name != "off"}
    recipe = hashlib.sha256(msgspec.json.encode((rule, modules_digest("houseexpo.analysis.copies")))).hexdigest()
    known = _read(file, recipe, {plan.plan: i for i, plan in enumerate(kept)})
    found = find_copies(lambda i: decode(plans.get(kept[i])), len(kept), **rule, known=known, threads=count_cores())
    if len(found.fingerprints) != len(known.fingerprints):
        write_atomically(file, _bytes(recipe, kept, found), durable=True)
    return found.pairs


def _bytes(recipe: str, kept: Sequence[PlanRecord], found: PairSearchResult) -> bytes:
    stream = io.BytesIO()
    np.savez(
        stream,
        recipe=np.array(recipe),
        plans=np.frombuffer(bytes.fromhex("".join(plan.plan for plan in kept)), np.uint8).reshape(-1, 32),
        prints=np.array([found.fingerprints[i] for i in range(len(kept))], np.int32),
        pairs=np.array([pair[:2] for pair in found.pairs], np.int32).reshape(-1, 2),
        differences=np.array([pair.difference for pair in found.pairs], np.float64),
        symmetries=np.array([_NAMES.index(pair.symmetry) for pair in found.pairs], np.uint8),
    )
    return stream.getvalue()


def _read(file: Path, recipe: str, places: dict[str, int]) -> PairSearchResult:
    """Return what is known of the plans that have a place, by their places."""
    try:
        with np.load(io.BytesIO(file.read_bytes())) as found:
            if str(found["recipe"]) != recipe:
                return PairSearchResult()
            now = [places.get(row.tobytes().hex(), -1) for row in found["plans"]]
            prints = {place: row for place, row in zip(now, found["prints"], strict=True) if place >= 0}
            pairs = [
                SimilarPair(now[first], now[second], float(difference), _NAMES[symmetry])
                for (first, second), difference, symmetry in zip(
                    found["pairs"], found["differences"], found["symmetries"], strict=True
                )
                if now[first] >= 0 and now[second] >= 0
            ]
    except (OSError, ValueError, KeyError, EOFError, IndexError, zipfile.BadZipFile):
        return PairSearchResult()
    return PairSearchResult(prints, tuple(pairs))


# Write the plans of a data set, and the pictures of their stages where the build keeps them.


_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class WrittenPlans:
    """The written files by name, the index's rows, the plans' summaries, and counts."""

    written: dict[str, WrittenFile]
    rows: list[dict[str, Any]]
    summaries: dict[str, Any]
    counts: dict[str, Any]


def plan_file_hashes(kept: Mapping[str, PlanRecord], *, pictured: bool) -> dict[str, str]:
    """Return the files of these plans by name, each with its SHA-256; with those of their pictures if ``pictured``."""
    files = {_plan(name): plan.plan for name, plan in kept.items()}
    pictures = {_picture(name): plan.stages.sha256 for name, plan in kept.items() if plan.stages is not None}
    return {**files, **(pictures if pictured else {})}


def write_plans(
    folder: DataSetFolder,
    plans: PlanStore,
    kept: Mapping[str, PlanRecord],
    files: Mapping[str, str],
    before: FinishedBuild | None,
) -> WrittenPlans:
    """Write those of ``files`` that do not stand as an earlier run wrote them, in one pass.

    Raises
    ------
    DamagedPlanError
        Where a plan, or its picture, is not in the store as it was kept.
    """
    summaries, parts_of = new_summaries(), split_by_plan_id(folder.root, kept)
    rules: Counter[str] = Counter()
    rows, doubtful, unmeasured = [], 0, 0
    written: dict[str, WrittenFile] = {}
    if any(_picture(name) in files for name in kept):
        folder.stages.mkdir(exist_ok=True)
    for name, plan_kept in kept.items():
        data = plans.get(plan_kept)
        plan = decode(data)
        rows.append({**index_row(plan), "split": parts_of.get(name)})
        rules.update(_rules(plan))
        doubtful += plan.quality is not None and plan.quality.is_doubtful
        unmeasured += not _add_to(summaries.values(), plan)
        reads = {_plan(name): partial(bytes, data), _picture(name): partial(plans.picture, plan_kept)}
        for file, read in reads.items():
            if file in files:
                written[file] = _write_file(folder, file, files[file], read, before)
    counts: dict[str, Any] = {"doubtful": doubtful, "rules": dict(sorted(rules.items()))}
    if unmeasured:
        counts["unmeasured"] = unmeasured
    return WrittenPlans(written, rows, {name: summary.report() for name, summary in summaries.items()}, counts)


def _add_to(summaries: Iterable[Summary], plan: FloorPlan) -> bool:
    """Add a plan to the summaries; if it cannot be measured, say so and leave it out."""
    try:
        for summary in summaries:
            summary.add(plan)
    except Exception as error:  # noqa: BLE001 - one plan never ends a build
        _LOG.warning("%s: it is left out of the statistics: %s", plan.id, error)
        return False
    return True


def remove_old_files(folder: DataSetFolder, written: Iterable[str]) -> None:
    """Remove the plans and pictures of an earlier run that are not among what was written."""
    for name in folder.names().difference(written):
        (folder.root / name).unlink()
    if folder.stages.is_dir() and not any(folder.stages.iterdir()):
        folder.stages.rmdir()


def _write_file(
    folder: DataSetFolder, file: str, sha256: str, read: Callable[[], bytes], before: FinishedBuild | None
) -> WrittenFile:
    """Write a file, unless it stands there as an earlier run wrote it."""
    was = before.files.get(file) if before is not None else None
    if was is not None and was.sha256 == sha256 and folder.stands(file, was):
        return was
    write_atomically(folder.root / file, read())
    return folder.describe(file, sha256)


def _rules(plan: FloorPlan) -> list[str]:
    """Name the rules that took effect in a plan and replace a judgement by eye in the paper."""
    notes = (plan.provenance or {}).get("notes", {})
    return [f"{name}:{value}" if isinstance(value, str) else name for name, value in notes.items()]


def _plan(name: str) -> str:
    return f"json/{name}.json"


def _picture(name: str) -> str:
    return f"stages/{name}.png"


# Lists of ids that an earlier ``houseexpo split`` left in a data set folder: kept while they speak of its plans. Lists
# of one's own beside them are no part of the data set.


def find_split_files(root: Path) -> list[Path]:
    """Return the lists of ``houseexpo split`` that lie beside the plans, and its record."""
    home = root / "splits"
    return [*find_split_lists(home), *home.glob("splits.json")]


def split_by_plan_id(root: Path, ids: Iterable[str]) -> dict[str, str]:
    """Return the list that each plan stands in, by id.

    Lists of a split that do not name exactly these ids, each once, are of other plans: they are removed, but for those
    that somebody has changed since, and the answer is empty.
    """
    home = root / "splits"
    lists = find_split_lists(home)
    named = [
        (name, file.stem) for file in lists for name in file.read_text(encoding="utf-8", errors="replace").splitlines()
    ]
    if sorted(name for name, _ in named) == sorted(ids):
        return dict(named)
    for file in find_split_files(root):
        if lists.get(file, True):
            file.unlink()
    if home.is_dir() and not any(home.iterdir()):
        home.rmdir()
    return {}


# The licences stated for a data set's sources, one by one, and the licence that all share.
#
# R1  A build states the licence and the credit of its own sources. The licences of sources whose plans it keeps
#     (``--add``) stay as they were stated.
# R2  A data set has a licence if all its sources have that licence. Houses that the project makes (``procedural:``)
#     agree to any licence if none is stated for them. The credits of all sources are listed one after another.
# R3  Older data sets do not state licences by source: there the manifest's licence holds for all sources.


_FILE: Final = "rights.json"


class Rights(msgspec.Struct, frozen=True, omit_defaults=True):
    """The licence of a source, as its manifest spells it, and whom to name, or "" if nothing is stated."""

    licence: str = ""
    credit: str = ""


def rights_by_source(folder: DataSetFolder, own: Mapping[str, Rights], beside: Iterable[str]) -> dict[str, Rights]:
    """Return and store the licences of a build's own sources and of those whose plans it keeps (R1, R3)."""
    file = folder.build / _FILE
    try:
        before = msgspec.json.decode(file.read_bytes(), type=dict[str, Rights])
    except (OSError, msgspec.DecodeError):
        before = {}
    manifest = folder.manifest()
    unknown = Rights(manifest.licence, manifest.credit) if manifest else Rights()
    found = {**own, **{source: before.get(source, unknown) for source in beside}}
    if found != before:
        write_atomically(file, encode_json(msgspec.to_builtins(dict(sorted(found.items())))), durable=True)
    return found


def stated_licences(rights: Mapping[str, Rights]) -> tuple[str, ...]:
    """Return the licences that sources state, each once; with "" if a source that could state one does not."""
    found: dict[str, str] = {}
    for source, each in sorted(rights.items()):
        if each.licence or not source.startswith(f"{MADE}:"):
            found.setdefault(each.licence.casefold(), each.licence)
    return tuple(found.values())


def common_rights(rights: Mapping[str, Rights]) -> Rights:
    """Return the licence and credit shared by all of these sources (R2)."""
    found = stated_licences(rights)
    credit = dict.fromkeys(each.credit for _, each in sorted(rights.items()) if each.credit)
    return Rights(found[0] if len(found) == 1 else "", "; ".join(credit))


GROUP = "houseexpo.summaries"
"""The group of entry points that create an empty summary; their names are the keys of ``stats.json``."""


class Summary(Protocol):
    """Statistics over plans, which are added one at a time; two summaries can be merged."""

    def add(self, plan: FloorPlan) -> None:
        """Add one plan."""

    def merge(self, other: Any) -> None:
        """Add the plans of another summary of the same kind."""

    def report(self) -> dict[str, Any]:
        """Return values that can be written as JSON; they do not depend on the order of the plans."""
        ...


def new_summaries() -> dict[str, Summary]:
    """Return an empty summary from each entry point, by name."""
    return {entry.name: entry.load()() for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.name)}
