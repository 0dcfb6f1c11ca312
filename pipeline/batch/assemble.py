"""Put a data set together from outcomes: which plans stay, and the files beside them (docs/format.md)."""

from __future__ import annotations

import hashlib
import os
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import msgspec

from houseexpo.analysis.similarity import Duplicate, drop_duplicates
from houseexpo.dataset.index import index_table
from houseexpo.files import as_json, sha256_of, sync_folder, write_whole
from houseexpo.floorplan import FloorPlan, decode
from houseexpo.plan.json_codec import FORMAT, encode
from pipeline.batch import disk
from pipeline.batch.copies import copies
from pipeline.batch.entry import Entry, Kept, Refused
from pipeline.batch.folder import MANIFEST, PARTS, Finished, Folder
from pipeline.batch.ids import settle
from pipeline.batch.lists import list_files
from pipeline.batch.plans import Plans
from pipeline.batch.publish import files_of, publish, remove_others
from pipeline.batch.recipe import digest_of, versions
from pipeline.batch.rights import Rights
from pipeline.config_file import BuildConfig
from pipeline.overrides import Override
from pipeline.rejection import Reason
from pipeline.sources import is_path

_BESIDE = ("duplicates.jsonl", "index.parquet", "rejected.jsonl", "stats.json")


@dataclass(frozen=True)
class DataSet:
    """What a finished build came to: its statistics, the ids of its plans, and what a person should know of it.

    ``not_done`` counts the inputs that a transient fault kept from being done; ``unchanged``: it stood so before;
    ``entries`` say what came of each input, ``ignored`` counts the files of its folders that are no houses, by suffix;
    ``passed_over`` says which sources hold no house;
    ``licences`` are those that its sources state, "" among them where one states none; ``sources`` are those of this
    build, without others that it was added to.
    """

    root: Path
    stats: Mapping[str, Any]
    ids: tuple[str, ...]
    refused: tuple[Refused, ...]
    not_done: int = 0
    unchanged: bool = False
    entries: tuple[Entry, ...] = ()
    ignored: Mapping[str, int] = field(default_factory=dict)
    passed_over: tuple[str, ...] = ()
    licences: tuple[str, ...] = ()
    sources: tuple[str, ...] = ()

    @property
    def is_fruitless(self) -> bool:
        """Whether none of this build's own inputs became a plan or a duplicate; what a person dropped is left aside."""
        own = [entry for entry in self.entries if not self.sources or entry.source in self.sources]
        refused = [each for entry in own for each in entry.refused if each.reason != Reason.DROPPED_BY_HAND]
        return bool(refused) and not any(entry.plans for entry in own)


@dataclass(frozen=True)
class Parts:
    """What a data set is put together from; ``entries`` are ``entry.ordered``, ``rights`` what the sources agree on."""

    folder: Folder
    plans: Plans
    entries: Sequence[Entry]
    sources: Sequence[str]
    config: BuildConfig
    overrides: Mapping[str, Override]
    rights: Rights

    def state(self) -> str:
        """Return a hash of all that the data set depends on."""
        outcomes = [(entry.plans, entry.refused, entry.versions, entry.transient) for entry in self.entries]
        words = {name: asdict(override) for name, override in self.overrides.items()}
        lists = [(str(file.relative_to(self.folder.root)), file.read_bytes()) for file in list_files(self.folder.root)]
        sources = (public_names(self.sources), self.rights)
        how = (self.config.parameters(), self.config.build.keep_stages)
        parts = (outcomes, sources, how, words, sorted(lists), digest_of(__name__))
        return hashlib.sha256(msgspec.json.encode(parts, order="deterministic")).hexdigest()


def assemble(parts: Parts, progress: Callable[[str, int, int], None]) -> DataSet:
    """Write everything but the pictures, the manifest last, or nothing if it stands already as it would be written.

    Raises
    ------
    DamagedPlanError
        Where a plan is not in the store as it was kept.
    """
    folder = parts.folder
    state, before = parts.state(), folder.finished()
    if before is not None and before.state == state and _stands(folder, before):
        return _as_it_was(parts, before)
    progress("putting together", 0, 1)
    plans, refused = _settled(parts.entries)
    kept = _stored(parts, plans)
    dropped = _dropped(parts, kept)
    for duplicate in dropped:
        del kept[duplicate.id]
    files = files_of(kept, pictured=parts.config.build.keep_stages)
    folder.announce(files)
    published = publish(folder, parts.plans, kept, files, before)
    remove_others(folder, published.written)
    stats = {"outcomes": {**_outcomes(parts, len(kept), dropped, refused), **published.counts}, **published.summaries}
    beside = {
        "index.parquet": index_table(published.rows),
        "rejected.jsonl": _lines(r.line() for r in refused),
        "duplicates.jsonl": _lines(d._asdict() for d in dropped),
        "stats.json": as_json(stats),
    }
    for name, data in beside.items():
        write_whole(folder.root / name, data, durable=True)
    os.sync()  # the plans, whose names the manifest is about to vouch for
    write_whole(folder.root / MANIFEST, as_json(_manifest(parts, files, stats)), durable=True)
    sync_folder(folder.root)
    others = {name: folder.described(name, sha256_of(folder.root / name)) for name in (*_BESIDE, MANIFEST)}
    folder.finish(Finished(parts.state(), {**published.written, **others}))
    progress("putting together", 1, 1)
    not_done = stats["outcomes"]["not_done"]
    return DataSet(folder.root, stats, tuple(kept), tuple(refused), not_done, False, tuple(parts.entries))


def _stands(folder: Folder, finished: Finished) -> bool:
    """Tell whether every file looks as it was written, and no other plan lies beside them."""
    own = {name for name in finished.files if name.partition("/")[0] in PARTS}
    return folder.names() == own and all(folder.stands(name, written) for name, written in finished.files.items())


def _as_it_was(parts: Parts, finished: Finished) -> DataSet:
    stats = msgspec.json.decode((parts.folder.root / "stats.json").read_bytes())
    _, refused = _settled(parts.entries)
    ids = sorted(Path(name).stem for name in finished.files if name.startswith("json/"))
    not_done = stats["outcomes"]["not_done"]
    return DataSet(parts.folder.root, stats, tuple(ids), tuple(refused), not_done, True, tuple(parts.entries))


def _dropped(parts: Parts, kept: Mapping[str, Kept]) -> list[Duplicate]:
    pairs = copies(parts.folder.build / "copies.npz", parts.plans, list(kept.values()), parts.config.stages.dedupe)
    keep = {name for name, plan in kept.items() if plan.by_hand or _override(name, plan, parts.overrides).keep}
    return drop_duplicates(list(kept), pairs, keep)


def _settled(entries: Sequence[Entry]) -> tuple[list[tuple[str, Kept]], list[Refused]]:
    """Return the plans with their final ids, sorted, and what was refused; no two inputs share an id."""
    plans = [(number, kept) for number, entry in enumerate(entries) for kept in entry.plans]
    own = {(number, kept.id) for number, kept in plans}
    others = {
        (number, refused.id): _content(entry)
        for number, entry in enumerate(entries)
        for refused in entry.refused
        if (number, refused.id) not in own
    }
    ids = [kept.id for _, kept in plans] + [name for _, name in others]
    names = settle(ids, [kept.content for _, kept in plans] + list(others.values()))
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


def _stored(parts: Parts, plans: Iterable[tuple[str, Kept]]) -> dict[str, Kept]:
    """Return the plans by final id; one whose id had to change is kept again."""
    found = {}
    for name, kept in plans:
        found[name] = kept
        if name != kept.id:
            renamed = parts.plans.put(name, kept.content, encode(replace(_load(parts, kept), id=name)) + b"\n")
            found[name] = msgspec.structs.replace(renamed, stages=kept.stages, by_hand=kept.by_hand)
    return found


def _content(entry: Entry) -> str:
    """Return a hash of what an input held, by which it can be told from another of the same id."""
    held = [(file.name, file.sha256) for file in entry.files] or [("", entry.input)]
    return hashlib.sha256(msgspec.json.encode(held)).hexdigest()


def _load(parts: Parts, kept: Kept) -> FloorPlan:
    return decode(parts.plans.get(kept))


def _override(name: str, kept: Kept, overrides: Mapping[str, Override]) -> Override:
    return overrides.get(name) or overrides.get(kept.id) or Override()


def _outcomes(parts: Parts, plans: int, dropped: list[Duplicate], refused: list[Refused]) -> dict[str, Any]:
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


def _manifest(parts: Parts, own: Mapping[str, str], stats: Mapping[str, Any]) -> dict[str, Any]:
    root = parts.folder.root
    lists = sorted(path.relative_to(root).as_posix() for path in list_files(root))
    files = {name: sha256_of(root / name) for name in (*_BESIDE, *lists)}
    others = {entry.input: entry.versions for entry in parts.entries if entry.plans and entry.versions != versions()}
    made_otherwise = {
        plan.id: entry.versions for entry in parts.entries if entry.input in others for plan in entry.plans
    }
    return {
        "format": FORMAT,
        "generator": {"name": "houseexpo", "version": version("houseexpo")},
        "sources": public_names(parts.sources),
        **msgspec.to_builtins(parts.rights),
        "parameters": parts.config.parameters(),
        "parameters_sha256": parts.config.digest(),
        "overrides": {name: asdict(override) for name, override in parts.overrides.items()},
        "versions": versions(),
        **({"versions_of": dict(sorted(made_otherwise.items()))} if made_otherwise else {}),
        "counts": stats["outcomes"],
        "files": dict(sorted((files | dict(own)).items())),
    }


def public_names(sources: Iterable[str]) -> list[str]:
    """Return the sources' own names: where they lie on this machine is nobody else's business."""
    return sorted(disk.printable(Path(source).name) if is_path(source) else source for source in sources)
