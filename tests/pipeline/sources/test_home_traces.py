"""What the search for stairs and courtyards in published plans would find, had they any."""

from __future__ import annotations

import numpy as np

from houseexpo.floorplan import FloorPlan
from research.home_traces import has_hole, longest_stair

STAIR = [(0.3 * ((i + 1) // 2), 0.18 * (i // 2)) for i in range(12)]


def plan(verts: list[tuple[float, float]], holes: tuple[list[tuple[float, float]], ...] = ()) -> FloorPlan:
    return FloorPlan("one", np.array(verts), room_num=1, room_category={}, holes=tuple(np.array(h) for h in holes))


def test_a_stair_in_an_outline_is_seen() -> None:
    assert longest_stair(plan([*STAIR, (5.0, 0.9), (5.0, 4.0), (0.0, 4.0)])) >= 9
    assert longest_stair(plan([(0, 0), (5, 0), (5, 4), (0, 4)])) == 0


def test_a_courtyard_is_seen() -> None:
    outer = [(0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0)]
    assert not has_hole(plan(outer))
    assert has_hole(plan(outer, ([(3.0, 3.0), (5.0, 3.0), (5.0, 5.0), (3.0, 5.0)],)))
