"""Compute a generated storey's true plan from the generator's parameters, and not by the pipeline that it tests.

Rooms are cells less slabs; missing outer walls count as standing, since a person would draw the outline there. Door
gaps lie between the two faces of a wall. Free space is both together. ``rooms``, ``doors``, ``zones`` and ``floor_z``
are those of the development cases, so that the same tool scores a plan against them.
"""

from __future__ import annotations

from dataclasses import dataclass

import msgspec
import numpy as np
import shapely

from tests.builders.suncg_houses.values import Opening, Storey
from tests.builders.suncg_houses.walls import walls_area

_OVERLAP_M = 5e-5
_FACE_M = 0.2  # a door's strip reaches this far to either side of the wall's centre line

Ring = list[list[float]]


@dataclass(frozen=True)
class TrueArea:
    """A polygon in SUNCG's plan axes (X, Z), metres."""

    polygon: Ring
    holes: list[Ring]


@dataclass(frozen=True)
class TrueRoom:
    """A room that the plan must have; ``label`` is the first of SUNCG's words for it, None without any."""

    label: str | None
    labels: list[str]
    use: str
    polygon: Ring
    holes: list[Ring]


@dataclass(frozen=True)
class TrueDoor:
    """A door or entrance; ``rooms`` are indices into the truth's rooms, None for the outside."""

    centre: list[float]
    width: float
    thickness: float
    direction: list[float]
    interior: bool
    rooms: list[int | None]


@dataclass(frozen=True)
class Truth:
    """One storey as a person would draw it, and what must become of it.

    ``expected`` is "plan", "rejected:<reason>" or "duplicate_of:<id>"; ``filled`` are closed cells, ``erased`` parts
    that stand apart, ``cuts`` how many walls must be cut so that all of it can be reached, ``room_num`` how many rooms
    the scene names on this level.
    """

    id: str
    level: int
    floor_z: float
    expected: str
    difficulties: list[str]
    features: list[str]
    outline: list[TrueArea]
    rooms: list[TrueRoom]
    doors: list[TrueDoor]
    filled: list[TrueArea]
    erased: list[TrueArea]
    cuts: int
    room_num: int
    zones: None = None

    def to_json(self) -> str:
        """Return the truth as JSON, the same text for the same house."""
        return msgspec.json.encode(self).decode()


def storey_truth(storey: Storey, truth_id: str, level: int, floor_z: float) -> Truth:
    """Work out what is true of a storey."""
    if storey.expected.startswith("rejected") or not storey.cells:
        named = len(storey.cells)
        return Truth(
            truth_id,
            level,
            floor_z,
            storey.expected,
            [*storey.difficulties],
            [*storey.features],
            [],
            [],
            [],
            [],
            [],
            0,
            named,
        )
    solid = walls_area(storey.walls)
    pieces = [_pieces(shapely.difference(cell.polygon, solid)) for cell in storey.cells]
    kept = [i for i, cell in enumerate(storey.cells) if cell.use in {"room", "corridor"}]
    number = {cell: room for room, cell in enumerate(kept)}
    inner = {i: pieces[i][0] for i in kept}
    doors, gaps = [], []
    for opening in storey.openings:
        if opening.kind == "window" or opening.cells[0] not in number:
            continue
        gap = _gap(opening, solid)
        doors.append(_door(opening, gap, number))
        if opening.kind == "door":
            gaps.append(gap)
    wide = shapely.buffer(gaps, _OVERLAP_M, join_style="mitre")  # rounding leaves hairlines beside oblique walls
    free = shapely.union_all([*inner.values(), *wide])
    parts = _pieces(free)
    filled = [piece for i in kept for piece in pieces[i][1:]]
    filled += [pieces[i][0] for i, cell in enumerate(storey.cells) if cell.use == "shaft"]
    erased = [pieces[i][0] for i, cell in enumerate(storey.cells) if cell.use == "garage"]
    return Truth(
        id=truth_id,
        level=level,
        floor_z=floor_z,
        expected=storey.expected,
        difficulties=[*storey.difficulties],
        features=[*storey.features, *(["loop"] if any(part.interiors for part in parts) else [])],
        outline=[_area(part) for part in parts],
        rooms=[_room(storey, i, inner[i]) for i in kept],
        doors=doors,
        filled=[_area(piece) for piece in filled],
        erased=[_area(piece) for piece in erased],
        cuts=len(parts) - 1,
        room_num=len(storey.cells),
    )


def _gap(opening: Opening, solid: shapely.Geometry) -> shapely.Polygon:
    """Return the part of the walls that a door frees."""
    centre, along = np.array(opening.centre), np.array(opening.direction) * opening.width / 2
    across = np.array([-opening.direction[1], opening.direction[0]]) * _FACE_M
    strip = shapely.Polygon(
        [centre - along - across, centre + along - across, centre + along + across, centre - along + across]
    )
    return _pieces(shapely.intersection(strip, solid))[0]


def _door(opening: Opening, gap: shapely.Polygon, number: dict[int, int]) -> TrueDoor:
    inside, outside = opening.cells
    return TrueDoor(
        centre=[round(value, 4) for value in opening.centre],
        width=opening.width,
        thickness=round(gap.area / opening.width, 4),
        direction=[round(value, 6) for value in opening.direction],
        interior=opening.kind == "door",
        rooms=[number[inside], None if outside is None else number[outside]],
    )


def _room(storey: Storey, index: int, polygon: shapely.Polygon) -> TrueRoom:
    words, area = [*storey.cells[index].words], _area(polygon)
    return TrueRoom(words[0] if words else None, words, storey.cells[index].use, area.polygon, area.holes)


def _pieces(shape: shapely.Geometry) -> list[shapely.Polygon]:
    """Return the polygons of a shape, largest first, without specks."""
    found = [part for part in shapely.get_parts(shape) if isinstance(part, shapely.Polygon) and part.area > 1e-3]
    return sorted(found, key=lambda part: -part.area)


def _area(polygon: shapely.Polygon) -> TrueArea:
    plain = shapely.simplify(shapely.orient_polygons(polygon), 2 * _OVERLAP_M)
    rings = [shapely.get_coordinates(ring)[:-1].round(4).tolist() for ring in (plain.exterior, *plain.interiors)]
    return TrueArea(rings[0], rings[1:])
