"""Check a data set: every plan against the schema and the rules of the format, and a folder against its manifest.

A rule is a function ``_check_<rule>`` that yields a plan's violations; the first line of its docstring describes it.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain, islice
from math import dist
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Final

import msgspec
import numpy as np

from houseexpo.dataset.store import files_at
from houseexpo.dataset.store.catalogue import plans_beside_index, require_finished
from houseexpo.dataset.store.stored_plans import StoredPlan, read_stored_plans
from houseexpo.errors import DatasetError, PlanError
from houseexpo.files import decode_json, read_json, sha256_of
from houseexpo.floorplan import FloorPlan
from houseexpo.plan.parts import RADII_M, Door, Ring, signed_area
from houseexpo.plan.room_labels import LABELS
from houseexpo.processes import map_in_processes, split_into_chunks
from houseexpo.progress import show_progress
from houseexpo.tolerances import GRID_M, ROUNDED_M2, SAME_M, TILE_M2

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

Broken = tuple[str, str]
"""A violation: the key, and what was expected and found."""

_CORNER: Final = (0.1, 0.1)
_PUBLISHED_ID: Final = re.compile(r"[0-9a-f]{32}")
_RADII: Final = frozenset(f"{radius:.2f}" for radius in RADII_M)
_PLANS_PER_CHUNK: Final = 256
_FEW_PLANS: Final = 1024  # for fewer plans, starting a second process takes longer than the check


def _rings(plan: FloorPlan) -> Iterator[tuple[str, Ring, bool]]:
    """Yield every ring of a plan: its key, its vertices, and whether it runs clockwise (holes do not)."""
    yield "verts", plan.verts, True
    yield from ((f"holes[{i}]", hole, False) for i, hole in enumerate(plan.holes))


def _check_grid(plan: FloorPlan) -> Iterator[Broken]:
    """Coordinates of every ring lie on the 1 cm grid."""
    parts = [(f"rooms[{i}].polygon", room.ring) for i, room in enumerate(plan.rooms)]
    parts += [(f"rooms[{i}].holes[{k}]", h) for i, room in enumerate(plan.rooms) for k, h in enumerate(room.holes)]
    parts += [(f"doors[{i}].polygon", door.ring) for i, door in enumerate(plan.doors)]
    parts += [(f"objects[{i}].polygon", thing.ring) for i, thing in enumerate(plan.objects)]
    parts += [(f"windows[{i}].polygon", window.ring) for i, window in enumerate(plan.windows)]
    for key, ring in [*((key, ring) for key, ring, _ in _rings(plan)), *parts]:
        cells = ring * 100
        off = np.abs(cells - np.round(cells)).max(axis=1) > SAME_M
        if off.any():
            row = int(off.argmax())
            yield f"{key}[{row}]", f"expected whole centimetres, found {ring[row].tolist()}"


def _check_origin(plan: FloorPlan) -> Iterator[Broken]:
    """``min(verts)`` is (0.1, 0.1)."""
    low = plan.bbox[:2]
    if max(abs(low[0] - _CORNER[0]), abs(low[1] - _CORNER[1])) > SAME_M:
        yield "verts", f"expected the least x and y to be {_CORNER}, found {low}"


def _check_direction(plan: FloorPlan) -> Iterator[Broken]:
    """``verts`` runs clockwise, holes counter-clockwise (x right, y up)."""
    for key, ring, clockwise in _rings(plan):
        area = signed_area(ring)
        if (area < 0) is not clockwise:
            yield (
                key,
                f"expected {'clockwise' if clockwise else 'counter-clockwise'}, found a signed area of {area:.2f}",
            )


def _check_directions(plan: FloorPlan) -> Iterator[Broken]:
    """Edges of a published ring are axis-parallel or at 45 degrees."""
    across, up = np.abs(_edges(plan.verts)).T
    odd = (across > SAME_M) & (up > SAME_M) & (np.abs(across - up) > SAME_M)
    if odd.any():
        row = int(odd.argmax())
        yield f"verts[{row}]", f"expected edges along an axis or at 45 degrees, found ({across[row]:g}, {up[row]:g})"


def _check_repeated(plan: FloorPlan) -> Iterator[Broken]:
    """No vertex is repeated by the next one."""
    for key, ring, _ in _rings(plan):
        same = (np.abs(_edges(ring)) < SAME_M).all(axis=1)
        if same.any():
            yield f"{key}[{int(same.argmax())}]", "expected vertices that differ from the next, found the same twice"


def _check_collinear(plan: FloorPlan) -> Iterator[Broken]:
    """No vertex of a plan of ours lies on the line between its neighbours."""
    for key, ring, _ in _rings(plan):
        after = _edges(ring)
        before = np.roll(after, 1, axis=0)
        straight = np.abs(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]) < SAME_M
        if straight.any():
            yield f"{key}[{int(straight.argmax())}]", "expected a corner, found a vertex between two others in line"


def _check_identity(plan: FloorPlan) -> Iterator[Broken]:
    """A published id has 32 hex digits."""
    if not _PUBLISHED_ID.fullmatch(plan.id):
        yield "id", f"expected 32 hex digits, found {plan.id!r}"


def _check_count(plan: FloorPlan) -> Iterator[Broken]:
    """``room_num`` is 1 or more, and a published ring has 4 vertices or more."""
    if plan.room_num < 1:
        yield "room_num", f"expected 1 or more, found {plan.room_num}"
    if len(plan.verts) < 4 and not plan.rooms:
        yield "verts", f"expected 4 vertices or more, found {len(plan.verts)}"


def _check_labels(plan: FloorPlan) -> Iterator[Broken]:
    """Labels of boxes are among the 25."""
    for label in plan.room_category:
        if label not in LABELS:
            yield f"room_category.{label}", "expected one of the 25 labels, found another word"


def _check_boxes(plan: FloorPlan) -> Iterator[Broken]:
    """A box runs from its least to its greatest corner."""
    for label, found in plan.room_category.items():
        for i, (x1, y1, x2, y2) in enumerate(found):
            if not (x1 < x2 and y1 < y2):
                yield f"room_category.{label}[{i}]", f"expected x1 < x2 and y1 < y2, found {[x1, y1, x2, y2]}"


def _check_rooms(plan: FloorPlan) -> Iterator[Broken]:
    """Rooms are valid, lie in the free space, do not overlap, and with the doors cover it (to 0.05 m2, and slits)."""
    import shapely

    shapes = [room.polygon for room in plan.rooms]
    for i, shape in enumerate(shapes):
        if not shape.is_valid:
            yield f"rooms[{i}].polygon", f"expected a simple ring, found {shapely.is_valid_reason(shape)}"
            return
    doors = [door.polygon for door in plan.doors if door.kind != "entrance" and door.polygon.is_valid]
    together = shapely.union_all([*shapes, *doors])
    overlap = sum(shape.area for shape in shapes) - shapely.union_all(shapes).area
    if overlap > ROUNDED_M2:
        yield "rooms", f"expected rooms that do not overlap, found {overlap:.3f} m² in two of them"
    outside = _wider_than_slits(shapely.union_all(shapes).difference(plan.free_space), ROUNDED_M2)
    if outside > ROUNDED_M2:
        yield "rooms", f"expected rooms inside the free space, found {outside:.3f} m² outside"
    gap = _wider_than_slits(plan.free_space.symmetric_difference(together), TILE_M2)
    if gap > TILE_M2:
        yield "rooms", f"expected rooms and doors to tile the free space to {TILE_M2} m², found {gap:.3f} m² off"


def _wider_than_slits(shape: BaseGeometry, most_m2: float) -> float:
    """Return the area of a shape without slits and what rounding moved, m², 0 if all of it is within ``most_m2``."""
    return float(shape.buffer(-GRID_M).buffer(GRID_M).area) if shape.area > most_m2 else 0.0


def _check_doors(plan: FloorPlan) -> Iterator[Broken]:
    """A door's width is the length of its segment, and its segment crosses its polygon.

    An opening may have any width: the pipeline finds gaps of up to 1.5 m, but the source may state a wider opening.
    """
    yield from _faults_of_holes("doors", plan.doors)


def _faults_of_holes(key: str, holes: Sequence[Door]) -> Iterator[Broken]:
    import shapely

    for i, hole in enumerate(holes):
        if not hole.polygon.is_valid:
            yield f"{key}[{i}].polygon", f"expected a simple ring, found {shapely.is_valid_reason(hole.polygon)}"
            continue
        length = dist(*hole.segment)
        if abs(length - hole.width) > 2 * GRID_M:
            yield f"{key}[{i}].width", f"expected the segment's length, {length:.2f} m, found {hole.width:.2f} m"
        if shapely.LineString(hole.segment).interpolate(0.5, normalized=True).distance(hole.polygon) > 2 * GRID_M:
            yield f"{key}[{i}].segment", f"expected it to run through the {key[:-1]}'s polygon, found it elsewhere"


def _check_windows(plan: FloorPlan) -> Iterator[Broken]:
    """A window has a length, lies in a wall at the edge of its room, and its segment crosses its polygon."""
    yield from _faults_of_holes("windows", plan.windows)
    floor = plan.floor if plan.windows else None
    for i, window in enumerate(plan.windows):
        if window.width < GRID_M:
            yield f"windows[{i}].width", f"expected a length, found {window.width:g} m"
        elif window.polygon.is_valid and floor is not None:
            inside = window.polygon.intersection(floor).area
            if inside > ROUNDED_M2 + GRID_M * window.polygon.length:
                yield f"windows[{i}].polygon", f"expected a place in a wall, found {inside:.3f} m² of a room in it"
            if window.polygon.distance(floor) > 2 * GRID_M:
                yield f"windows[{i}].polygon", "expected the edge of a room beside it, found none"


def _check_objects(plan: FloorPlan) -> Iterator[Broken]:
    """An object's footprint is a simple ring outside the free space, apart from rounding along its edge."""
    import shapely

    for i, thing in enumerate(plan.objects):
        if not thing.polygon.is_valid:
            yield f"objects[{i}].polygon", f"expected a simple ring, found {shapely.is_valid_reason(thing.polygon)}"
            continue
        free = thing.polygon.intersection(plan.free_space).area
        if free > ROUNDED_M2 + GRID_M * thing.polygon.length:
            yield f"objects[{i}].polygon", f"expected an obstacle, found {free:.3f} m² of free space in it"


def _check_reach(plan: FloorPlan) -> Iterator[Broken]:
    """Navigability is given for the six radii, and shares lie between 0 and 1."""
    if plan.navigability and set(plan.navigability) != _RADII:
        yield "navigability", f"expected the radii {', '.join(sorted(_RADII))}, found {', '.join(plan.navigability)}"
    for radius, found in plan.navigability.items():
        if not 0 <= found.largest_share <= 1:
            yield f"navigability.{radius}.largest_share", f"expected 0 to 1, found {found.largest_share}"


def _edges(ring: Ring) -> Ring:
    edges: Ring = np.roll(ring, -1, axis=0) - ring
    return edges


Rule = Callable[[FloorPlan], Iterator[Broken]]

BOTH: Final[dict[str, Rule]] = {
    "grid": _check_grid,
    "origin": _check_origin,
    "direction": _check_direction,
    "repeated": _check_repeated,
    "count": _check_count,
    "labels": _check_labels,
    "boxes": _check_boxes,
}
PUBLISHED: Final[dict[str, Rule]] = {"identity": _check_identity, "directions": _check_directions}
OURS: Final[dict[str, Rule]] = {
    "collinear": _check_collinear,
    "rooms": _check_rooms,
    "doors": _check_doors,
    "objects": _check_objects,
    "windows": _check_windows,
    "navigability": _check_reach,
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
    "index": "The index of a data set folder has one row for each plan, and no other rows.",
}
"""Every rule with its description."""


@dataclass(frozen=True)
class RuleViolation:
    """A violation of a rule: the plan (its id, or "" if it cannot be read), the place in it, and the fault."""

    place: str
    plan: str
    rule: str
    key: str
    detail: str

    def __str__(self) -> str:
        return f"{self.plan or self.place}: {self.rule}: {self.key}: {self.detail}"


@dataclass(frozen=True)
class ValidationReport:
    """The findings of a check of a data set; ``plans`` is the number of plans that were read."""

    plans: int
    findings: tuple[RuleViolation, ...]

    def by_rule(self) -> dict[str, tuple[int, int]]:
        """Return the number of findings and of plans concerned for every rule, in the rules' order."""
        found = Counter(finding.rule for finding in self.findings)
        plans = Counter(rule for rule, _ in {(finding.rule, finding.place) for finding in self.findings})
        return {rule: (found[rule], plans[rule]) for rule in RULES}


class _Area(msgspec.Struct):
    area: float


class _Areas(msgspec.Struct):
    rooms: list[_Area] = []


def validate_dataset(path: Path, workers: int = 1) -> ValidationReport:
    """Check a data set, also the plans that ``open_dataset`` leaves out.

    Parameters
    ----------
    workers
        Number of processes. With more than one, a script needs ``if __name__ == "__main__"``.

    Raises
    ------
    DatasetError
        The data set is damaged at no place that is known, so that not all of its plans can be read.
    """
    path = files_at(path, "validate")
    require_finished(path)
    count = 0
    findings: list[RuleViolation] = []
    seen: dict[str, str] = {}
    for ids, found in show_progress(_check_chunks(path, workers), f"checking {path.name}"):
        count += len(ids)
        findings += found
        for place, plan in ids:
            if plan and seen.setdefault(plan, place) != place:
                findings.append(
                    RuleViolation(
                        place, plan, "file", "id", f"expected one plan of that id, found another in {seen[plan]}"
                    )
                )
    findings += _against_manifest(path)
    findings += _against_index(path)
    return ValidationReport(count, tuple(findings))


def check_stored_plans(chunk: list[StoredPlan]) -> tuple[list[tuple[str, str]], list[RuleViolation]]:
    """Check a chunk of files; return the place and id of each, and the findings."""
    ids, findings, whole = [], [], []
    for record in chunk:
        plan, found = _read(record)
        if plan is not None:
            found += _check_plan(record, plan)
            whole.append((record, plan))
        ids.append((record.place, plan.id if plan else ""))
        findings += found
    return ids, findings + list(_not_simple(whole))


def _check_chunks(path: Path, workers: int) -> Iterator[tuple[list[tuple[str, str]], list[RuleViolation]]]:
    waiting = read_stored_plans(path)
    first = list(islice(waiting, _FEW_PLANS))
    chunks = split_into_chunks(chain(first, waiting), _PLANS_PER_CHUNK)
    if workers <= 1 or len(first) < _FEW_PLANS:
        yield from map(check_stored_plans, chunks)
        return
    yield from map_in_processes(check_stored_plans, chunks, workers)


def _read(record: StoredPlan) -> tuple[FloorPlan | None, list[RuleViolation]]:
    try:
        return record.decode(), []
    except PlanError as error:
        return None, [RuleViolation(record.place, error.plan, "schema", error.key, error.problem)]


def _check_plan(record: StoredPlan, plan: FloorPlan) -> Iterator[RuleViolation]:
    made = partial(RuleViolation, record.place, plan.id)
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
        said = decode_json(record.data, _Areas).rooms
        for i, (room, record_) in enumerate(zip(plan.rooms, said, strict=True)):
            if abs(room.area - record_.area) > 0.01:
                yield made("area", f"rooms[{i}].area", f"expected {room.area:.2f} m², found {record_.area:.2f}")


def _not_simple(plans: list[tuple[StoredPlan, FloorPlan]]) -> Iterator[RuleViolation]:
    import shapely

    shapes = np.array([shapely.Polygon(plan.verts, plan.holes) for _, plan in plans], dtype=object)
    for i in np.flatnonzero(~shapely.is_valid(shapes)).tolist():
        record, plan = plans[i]
        yield RuleViolation(record.place, plan.id, "simple", "verts", f"found {shapely.is_valid_reason(shapes[i])}")


class _Manifest(msgspec.Struct):
    files: dict[str, str] = {}


def _against_manifest(path: Path) -> Iterator[RuleViolation]:
    """Compare a folder's files with its manifest, if it has one."""
    file = path / "manifest.json"
    if not path.is_dir() or not file.exists():
        return
    try:
        said = read_json(file, _Manifest).files
    except (OSError, msgspec.DecodeError) as error:
        raise DatasetError(f"{file}: expected the manifest of a data set, found {error}") from None
    for name, digest in sorted(said.items()):
        if ".." in PurePosixPath(name).parts or PurePosixPath(name).is_absolute():
            yield RuleViolation(name, "", "manifest", name, "expected a file of the folder, found a path out of it")
        elif not (path / name).is_file():
            yield RuleViolation(name, "", "manifest", name, "expected this file, found none")
        elif sha256_of(path / name) != digest:
            yield RuleViolation(
                name, "", "manifest", name, "expected the SHA-256 that the manifest gives, found another"
            )


def _against_index(path: Path) -> Iterator[RuleViolation]:
    """Look for plans in a folder that its index does not list, so that none opens them, and for rows without plans."""
    for each in plans_beside_index(path) if path.is_dir() else ():
        yield RuleViolation(each.place, each.place.removesuffix(".json"), "index", "id", each.problem)
