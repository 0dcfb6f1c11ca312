"""Check a data set: every plan against the schema and the rules of the format, and a folder against its manifest."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import chain, islice
from pathlib import Path, PurePosixPath
from typing import Any, Final

import msgspec

from houseexpo.dataset.store import files_at
from houseexpo.dataset.store.records import Record, records
from houseexpo.errors import DatasetError, PlanError
from houseexpo.files import sha256_of
from houseexpo.floorplan import FloorPlan, decode
from houseexpo.plan.rules import parts, rings
from houseexpo.plan.rules.rings import Broken
from houseexpo.processes import in_chunks, in_processes
from houseexpo.progress import watched

Rule = Callable[[FloorPlan], Iterator[Broken]]

BOTH: Final[dict[str, Rule]] = {
    "grid": rings.grid,
    "origin": rings.origin,
    "direction": rings.direction,
    "repeated": rings.repeated,
    "count": parts.count,
    "labels": parts.labels,
    "boxes": parts.boxes,
}
PUBLISHED: Final[dict[str, Rule]] = {"identity": parts.identity, "directions": rings.directions}
OURS: Final[dict[str, Rule]] = {
    "collinear": rings.collinear,
    "rooms": parts.rooms,
    "doors": parts.doors,
    "objects": parts.objects,
    "navigability": parts.reach,
}
RULES: Final[dict[str, str]] = {
    "schema": "The file is JSON in UTF-8 with the keys and types of the schema, and FloorPlan takes it.",
    "file": "A plan's file is named as its id; no two plans have one id.",
    "simple": "Rings are valid polygons: they neither touch nor cross themselves or each other.",
    **{
        name: (rule.__doc__ or "").partition("\n")[0].replace("``", "")
        for name, rule in chain(BOTH.items(), PUBLISHED.items(), OURS.items())
    },
    "area": "A room's area is its polygon's.",
    "manifest": "The files of a data set folder have the SHA-256 that its manifest gives.",
}
"""Every rule with its description."""

_CHUNK: Final = 256
_FEW: Final = 1024  # for fewer plans, starting a second process takes longer than the check


@dataclass(frozen=True)
class Finding:
    """A violation of a rule: the plan (its id, or "" if it cannot be read), the place in it, and the fault."""

    place: str
    plan: str
    rule: str
    key: str
    detail: str

    def __str__(self) -> str:
        return f"{self.plan or self.place}: {self.rule}: {self.key}: {self.detail}"


@dataclass(frozen=True)
class Report:
    """The findings of a check of a data set; ``plans`` is the number of plans that were read."""

    plans: int
    findings: tuple[Finding, ...]

    def by_rule(self) -> dict[str, tuple[int, int]]:
        """Return the number of findings and of plans concerned for every rule, in the rules' order."""
        found = Counter(finding.rule for finding in self.findings)
        plans = Counter(rule for rule, _ in {(finding.rule, finding.place) for finding in self.findings})
        return {rule: (found[rule], plans[rule]) for rule in RULES}


class _Area(msgspec.Struct):
    area: float


class _Areas(msgspec.Struct):
    rooms: list[_Area] = []


def validate(path: Path, workers: int = 1) -> Report:
    """Check a data set, including one that ``open_dataset`` refuses because of some of its plans.

    Parameters
    ----------
    workers
        Number of processes. With more than one, a script needs ``if __name__ == "__main__"``.

    Raises
    ------
    DatasetError
        The data set itself is truncated or damaged, so that not all of its plans can be read.
    """
    path = files_at(path, "validate")
    count = 0
    findings: list[Finding] = []
    seen: dict[str, str] = {}
    for ids, found in watched(_checked(path, workers), f"checking {path.name}"):
        count += len(ids)
        findings += found
        for place, plan in ids:
            if plan and seen.setdefault(plan, place) != place:
                findings.append(
                    Finding(place, plan, "file", "id", f"expected one plan of that id, found another in {seen[plan]}")
                )
    findings += _against_manifest(path)
    return Report(count, tuple(findings))


def check_records(chunk: list[Record]) -> tuple[list[tuple[str, str]], list[Finding]]:
    """Check a chunk of files; return the place and id of each, and the findings."""
    ids, findings, whole = [], [], []
    for record in chunk:
        plan, found = _read(record)
        if plan is not None:
            found += _judged(record, plan)
            whole.append((record, plan))
        ids.append((record.place, plan.id if plan else ""))
        findings += found
    return ids, findings + list(_not_simple(whole))


def _checked(path: Path, workers: int) -> Iterator[tuple[list[tuple[str, str]], list[Finding]]]:
    waiting = records(path)
    first = list(islice(waiting, _FEW))
    chunks = in_chunks(chain(first, waiting), _CHUNK)
    if workers <= 1 or len(first) < _FEW:
        yield from map(check_records, chunks)
        return
    yield from in_processes(check_records, chunks, workers)


def _read(record: Record) -> tuple[FloorPlan | None, list[Finding]]:
    try:
        return decode(record.data), []
    except PlanError as error:
        return None, [Finding(record.place, error.plan, "schema", error.key, error.problem)]


def _judged(record: Record, plan: FloorPlan) -> Iterator[Finding]:
    made = partial(Finding, record.place, plan.id)
    ours = b'"format"' in record.data
    for name, rule in chain(BOTH.items(), (OURS if ours else PUBLISHED).items()):
        try:
            yield from (made(name, key, detail) for key, detail in rule(plan))
        except PlanError as error:  # an outline without area cannot be checked further
            yield made(name, error.key, error.problem)
    stem = PurePosixPath(record.place).name
    if stem.endswith(".json") and stem != f"{plan.id}.json":
        yield made("file", "id", f"expected the file's name, {stem.removesuffix('.json')!r}, found {plan.id!r}")
    if ours:
        said = msgspec.json.decode(record.data, type=_Areas).rooms
        for i, (room, record_) in enumerate(zip(plan.rooms, said, strict=True)):
            if abs(room.area - record_.area) > 0.01:
                yield made("area", f"rooms[{i}].area", f"expected {room.area:.2f} m2, found {record_.area:.2f}")


def _not_simple(plans: list[tuple[Record, FloorPlan]]) -> Iterator[Finding]:
    import numpy as np
    import shapely

    shapes = np.array([shapely.Polygon(plan.verts, plan.holes) for _, plan in plans], dtype=object)
    for i in np.flatnonzero(~shapely.is_valid(shapes)).tolist():
        record, plan = plans[i]
        yield Finding(record.place, plan.id, "simple", "verts", f"found {shapely.is_valid_reason(shapes[i])}")


def _against_manifest(path: Path) -> Iterator[Finding]:
    """Compare a folder's files with its manifest, if it has one."""
    file = path / "manifest.json"
    if not path.is_dir() or not file.exists():
        return
    try:
        said = msgspec.json.decode(file.read_bytes(), type=dict[str, Any]).get("files", {})
    except msgspec.DecodeError as error:
        raise DatasetError(f"{file}: expected the manifest of a data set, found {error}") from None
    for name, digest in sorted(said.items()):
        if ".." in PurePosixPath(name).parts or PurePosixPath(name).is_absolute():
            yield Finding(name, "", "manifest", name, "expected a file of the folder, found a path out of it")
        elif not (path / name).is_file():
            yield Finding(name, "", "manifest", name, "expected this file, found none")
        elif sha256_of(path / name) != digest:
            yield Finding(name, "", "manifest", name, "expected the SHA-256 that the manifest gives, found another")
