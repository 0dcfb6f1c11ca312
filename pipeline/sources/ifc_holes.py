"""A level's openings: each a rectangle along its wall, through the whole wall.

R1  An opening's body may be shallower or much deeper than the wall: its rectangle runs through all that stands there as
    one wall (leaves of a cavity wall, linings), and no farther.
R2  A hole without a door that does not reach through its wall is a niche; one that starts above the knee or ends below
    the head is a hatch; a narrow one is a duct. None of them is an opening.
R3  A door belongs to the highest level that it can be reached from, a step or half a storey up, whichever storey holds
    it; one that lies (a hatch in a floor) to none.
R4  Holes that overlap (one in each leaf of a wall) are one opening, with a door if one of them has it.
R5  A hole that a window fills, or that starts above the knee and is no niche, is closed in a plan: it is wall.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from pipeline.sources.ifc_directions import Axis, along_wall
from pipeline.sources.ifc_file import Hole
from pipeline.sources.ifc_shapes import are_one, block, shadow
from pipeline.values import Mesh, SourceOpening

Span = tuple[float, float]

KNEE_M = 0.5
HEAD_M = 1.75
DOOR_M = 1.2  # lower doors are hatches
HALF_STOREY_M = 1.5
REACH_M = 0.6  # how far beyond a hole its wall may go on
CAVITY_M = 0.08  # leaves farther apart are two walls
SKIN_M = 0.002  # the rectangle reaches beyond the wall's faces, so that a cut leaves no film
MIN_DEPTH_M = 0.1
JAMB_M = 0.12
NICHE_M = 0.03  # what is left of a wall behind a niche
SAME = 0.5  # intersection over union of two holes that are one
NARROW_M = 0.4  # what has no door and is narrower lets pipes through
SWUNG_M = 0.1  # a door's body wider than the door by so much has its leaf drawn open


@dataclass(frozen=True)
class _Place:
    """Where a hole lies: the wall's direction, and the hole's spans along it and across it."""

    axis: Axis
    along: Span
    across: Span


class StandingWalls:
    """The walls' plan shadows, made where a hole asks for them."""

    def __init__(self, meshes: Sequence[Mesh]) -> None:
        self._meshes = meshes
        corners = [(*mesh.vertices.min(axis=0), *mesh.vertices.max(axis=0)) for mesh in meshes]
        self._boxes = np.array(corners, np.float64).reshape(-1, 6)
        self._shadows: dict[int, BaseGeometry] = {}

    def near(self, mesh: Mesh) -> BaseGeometry:
        """What stands about a body, as one plan shape."""
        low, high = mesh.vertices.min(axis=0) - REACH_M, mesh.vertices.max(axis=0) + REACH_M
        touching = (self._boxes[:, :3] <= high).all(axis=1) & (self._boxes[:, 3:] >= low).all(axis=1)
        found = [int(k) for k in np.flatnonzero(touching)]
        for k in found:
            if k not in self._shadows:
                self._shadows[k] = shadow(self._meshes[k])
        return shapely.union_all([self._shadows[k] for k in found])


def openings_of(
    holes: Sequence[Hole], walls: StandingWalls, floor: float, floors: Sequence[float]
) -> tuple[SourceOpening, ...]:
    """Return the openings of the level at ``floor`` (one of ``floors``), in project axes."""
    here = [hole for hole in holes if _is_of(hole, floor, floors)]
    return tuple(_merged([found for hole in here if (found := _opening(hole, walls, NARROW_M)) is not None]))


def closed_holes(
    windows: Sequence[Hole], holes: Sequence[Hole], walls: StandingWalls, low: float, high: float
) -> Iterator[Mesh]:
    """R5: for each such hole of a storey, from its floor at ``low`` up to ``high``, a body as deep as the wall."""
    unfilled = [hole for hole in holes if not hole.has_door and hole.bottom >= low + KNEE_M]
    for hole in (*windows, *unfilled):
        if hole.bottom < high and hole.top > low + KNEE_M:
            found = _opening(hole, walls, MIN_DEPTH_M, skin_m=0.0)
            if found is not None:
                yield block(found.polygon, hole.bottom, hole.top)


def level_of_door(sill: float, floors: Sequence[float]) -> float | None:
    """R3: the height of the level from which a door that starts at ``sill`` is entered, or None if there is none."""
    below = [floor for floor in floors if floor <= sill + KNEE_M and sill - floor <= HALF_STOREY_M]
    return max(below, default=None)


def _is_of(hole: Hole, floor: float, floors: Sequence[float]) -> bool:
    """R2, R3."""
    if hole.has_door:
        return hole.top - hole.bottom >= DOOR_M and level_of_door(hole.bottom, floors) == floor
    return hole.bottom < floor + KNEE_M and hole.top > floor + HEAD_M


def _opening(hole: Hole, walls: StandingWalls, least_m: float, skin_m: float = SKIN_M) -> SourceOpening | None:
    """R1; None for a niche, and for what is narrower than ``least_m`` and no door (R2)."""
    standing = walls.near(hole.mesh)
    axis = along_wall(hole, standing)
    points = hole.mesh.vertices[:, :2]
    along, across = axis.span(points), axis.turned().span(points)
    if hole.host is None and hole.width_m and along[1] - along[0] > hole.width_m + SWUNG_M:
        middle = (along[0] + along[1]) / 2
        along = middle - hole.width_m / 2, middle + hole.width_m / 2
    if along[1] - along[0] < (MIN_DEPTH_M if hole.has_door else least_m):
        return None
    place = _Place(axis, along, across)
    host = standing if hole.host is None else shadow(hole.host)
    if not hole.has_door and _is_niche(place, host):
        return None
    depth = _over(place, standing) or _beside(place, host) or across
    thin = max((MIN_DEPTH_M - (depth[1] - depth[0])) / 2, skin_m)
    return SourceOpening(axis.box(along, (depth[0] - thin, depth[1] + thin)), hole.has_door)


def _is_niche(place: _Place, wall: BaseGeometry) -> bool:
    """R2."""
    depth = _over(place, wall) or _beside(place, wall) or place.across
    return depth[0] < place.across[0] - NICHE_M or depth[1] > place.across[1] + NICHE_M


def _over(place: _Place, standing: BaseGeometry) -> Span | None:
    """From where to where something stands over or under a hole; None under the open sky."""
    tenth = (place.along[1] - place.along[0]) / 10
    return _standing_at(place, (place.along[0] + tenth, place.along[1] - tenth), standing)


def _beside(place: _Place, standing: BaseGeometry) -> Span | None:
    """From where to where the wall stands on both sides of a hole: what meets it there on one side is another wall."""
    low, high = place.along
    strips = ((low - JAMB_M, low - JAMB_M / 4), (high + JAMB_M / 4, high + JAMB_M))
    found = [span for strip in strips if (span := _standing_at(place, strip, standing))]
    common = max((span[0] for span in found), default=0.0), min((span[1] for span in found), default=0.0)
    if common[0] < common[1]:
        return common
    return min(found, key=lambda span: span[1] - span[0], default=None)


def _standing_at(place: _Place, strip: Span, standing: BaseGeometry) -> Span | None:
    """Spans of what stands in a strip across the wall that touch the hole, as one, with the leaves right behind."""
    across = place.across
    reach = across[0] - REACH_M, across[1] + REACH_M
    pieces = shapely.get_parts(standing.intersection(place.axis.box(strip, reach)))
    turned = place.axis.turned()
    spans = sorted(turned.span(shapely.get_coordinates(piece)) for piece in pieces if piece.area > 0)
    touching = [span for span in spans if span[0] < across[1] and span[1] > across[0]]
    if not touching:
        return None
    low, high = min(span[0] for span in touching), max(span[1] for span in touching)
    for span in spans:
        if span[0] <= high + CAVITY_M:
            high = max(high, span[1]) if span[1] > low else high
    for span in reversed(spans):
        if span[1] >= low - CAVITY_M and span[0] < high:
            low = min(low, span[0])
    return low, high


def _merged(found: list[SourceOpening]) -> Iterator[SourceOpening]:
    """R4."""
    kept: list[SourceOpening] = []
    for each in found:
        at = next((k for k, other in enumerate(kept) if are_one(each.polygon, other.polygon, SAME)), None)
        if at is None:
            kept.append(each)
        else:
            both = shapely.oriented_envelope(each.polygon.union(kept[at].polygon))
            kept[at] = SourceOpening(both, each.has_door or kept[at].has_door)
    yield from kept
