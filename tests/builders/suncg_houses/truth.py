"""Compute a generated storey's true plan from the generator's parameters, and not by the pipeline that it tests.

Rooms are cells less slabs; missing outer walls count as standing, since a person would draw the outline there. Door
gaps lie between the two faces of a wall. The keys are those of the development cases, so that the same tool scores a
plan against them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from tests.builders.suncg_houses.values import Opening, Storey
from tests.builders.suncg_houses.walls import walls_area

_SNAP_M = 1e-4
_FACE_M = 0.2  # a door's strip reaches this far to either side of the wall's centre line

Ring = list[list[float]]


@dataclass(frozen=True)
class TrueRoom:
    """A room that the plan must have, in SUNCG's plan axes (X, Z), metres; ``label`` is SUNCG's first word for it."""

    label: str | None
    polygon: Ring
    holes: list[Ring]


@dataclass(frozen=True)
class TrueDoor:
    """A door between two rooms (``interior``) or an entrance."""

    centre: list[float]
    width: float
    thickness: float
    direction: list[float]
    interior: bool


@dataclass(frozen=True)
class Truth:
    """One storey as a person would draw it, and the difficulties that are planted in it."""

    id: str
    floor_z: float
    difficulties: list[str]
    rooms: list[TrueRoom]
    doors: list[TrueDoor]


def storey_truth(storey: Storey, truth_id: str, floor_z: float) -> Truth:
    """Work out what is true of a storey; without a floor it has no rooms."""
    if not storey.cells or not storey.has_floor:
        return Truth(truth_id, floor_z, [*storey.difficulties], [], [])
    solid = walls_area(storey.walls)
    inner = {
        i: _largest(shapely.difference(cell.polygon, solid))
        for i, cell in enumerate(storey.cells)
        if cell.use in {"room", "corridor"}
    }
    rooms = [_room(storey.cells[i].words, polygon) for i, polygon in inner.items()]
    openings = [each for each in storey.openings if each.kind != "window" and each.cells[0] in inner]
    return Truth(truth_id, floor_z, [*storey.difficulties], rooms, [_door(each, solid) for each in openings])


def _door(opening: Opening, solid: shapely.Geometry) -> TrueDoor:
    """Return a door; its gap is the part of the walls that it frees."""
    centre, along = np.array(opening.centre), np.array(opening.direction) * opening.width / 2
    across = np.array([-opening.direction[1], opening.direction[0]]) * _FACE_M
    strip = shapely.Polygon(
        [centre - along - across, centre + along - across, centre + along + across, centre - along + across]
    )
    return TrueDoor(
        centre=[round(value, 4) for value in opening.centre],
        width=opening.width,
        thickness=round(_largest(shapely.intersection(strip, solid)).area / opening.width, 4),
        direction=[round(value, 6) for value in opening.direction],
        interior=opening.kind == "door",
    )


def _room(words: tuple[str, ...], polygon: shapely.Polygon) -> TrueRoom:
    plain = shapely.simplify(shapely.orient_polygons(polygon), _SNAP_M)
    rings = [shapely.get_coordinates(ring)[:-1].round(4).tolist() for ring in (plain.exterior, *plain.interiors)]
    return TrueRoom(words[0] if words else None, rings[0], rings[1:])


def _largest(shape: shapely.Geometry) -> shapely.Polygon:
    parts = [part for part in shapely.get_parts(shape) if isinstance(part, shapely.Polygon)]
    return max(parts, key=lambda part: part.area)
