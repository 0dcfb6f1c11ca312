"""Straighten the outlines of rooms, so that walls are straight, and fit the passages anew (Algorithm 1, line 21).

R1  Spurs of millimetres go, and stair-steps become straight edges, axis-parallel where the house is, oblique where it
    is (``geometry.straighten``).
R2  Passages are fitted anew between the straightened faces.
R3  Rooms that meet without a wall still meet: a gap that opens between them goes to the first room.
R4  If all rooms are as the source draws them, and straight, they stay exactly as they are.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import shapely
from shapely import Polygon

from pipeline.config import RefineConfig
from pipeline.geometry.areas import drop_thin_parts_of_each, polygons_of, subtract, unite
from pipeline.geometry.rooms_and_passages import fit_to_rooms
from pipeline.geometry.straighten import are_straight, straighten_outlines
from pipeline.geometry.wall_sections import close_cracks
from pipeline.tolerances import CRACK_M, SLIVER_M
from pipeline.values import Spaces


def straighten_rooms(spaces: Spaces, config: RefineConfig, drawn: Iterable[Polygon | None] = ()) -> Spaces:
    """Straighten the rooms and fit the passages; ``drawn`` are the rooms as the source draws them."""
    rooms = list(spaces.rooms)
    as_drawn = {id(room) for room in rooms} <= {id(room) for room in drawn}
    if not (as_drawn and are_straight(rooms, max(config.offset_m, CRACK_M))):  # R1, R4
        whole = _without_spurs(rooms)
        straight = straighten_outlines(whole, offset_m=config.offset_m, angle_deg=config.angle_deg)
        rooms = _make_disjoint(straight, rooms)
    for a, b in spaces.open_pairs:  # R3
        rooms[a] = _meeting(rooms[a], rooms[b])
    passages = fit_to_rooms(spaces.passages, rooms)  # R2
    return replace(spaces, rooms=tuple(rooms), passages=tuple(passages))


def _without_spurs(rooms: Sequence[Polygon]) -> list[Polygon]:
    parts = [polygons_of(each) for each in drop_thin_parts_of_each(rooms, CRACK_M)]
    return [found[0] if found else room for room, found in zip(rooms, parts, strict=True)]


def _meeting(room: Polygon, other: Polygon) -> Polygon:
    both = unite([room, other])
    between = subtract(close_cracks(both, SLIVER_M), both)
    return polygons_of(unite([room, between]))[0]


def _make_disjoint(straight: list[Polygon], before: list[Polygon]) -> list[Polygon]:
    """Return rooms that do not overlap. Where straightened rooms overlap, the larger one keeps the strip."""
    result = list(straight)
    for k, other in shapely.STRtree(straight).query(straight, predicate="overlaps").T.tolist():
        if other > k:
            rest = polygons_of(subtract(result[other], result[k]))
            result[other] = rest[0] if rest else before[other]
    return result
