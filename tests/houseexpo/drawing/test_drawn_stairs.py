"""Stairs as they are drawn: their kind follows from the shape and from the side at which one steps on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely

from houseexpo.drawing.scene import lay_out_plan
from houseexpo.drawing.stairs import stair_lines
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import PlanObject, Room


def with_well(wide: float, deep: float, landing: str = "south") -> FloorPlan:
    """A room of 4 m by 4 m, and a well that is open to it in the north of the room, or in the west of the well."""
    verts = [(0.1, 0.1), (0.1, 4.1), (4.1, 4.1), (4.1, 0.1)]
    x, y = (0.5, 4.1) if landing == "south" else (4.1, 0.5)
    ring = np.array([(x, y), (x, y + deep), (x + wide, y + deep), (x + wide, y)])
    plan = FloorPlan("0" * 32, verts, 1, {})
    return replace(plan, objects=(PlanObject(0, "stairs", None, ring, 0.0),))


@pytest.mark.parametrize(
    ("wide", "deep", "landing", "corners"),
    [(1.0, 4.6, "south", 2), (2.1, 3.0, "south", 4), (4.2, 1.0, "west", 2), (1.0, 4.2, "west", 3)],
    ids=["straight", "two flights", "straight from the west", "winders"],
)
def test_a_stair_has_treads_and_an_arrow(wide: float, deep: float, landing: str, corners: int) -> None:
    plan = with_well(wide, deep, landing)
    (well,) = plan.objects
    lines = [shapely.LineString(points) for points in stair_lines(plan)]
    *treads, way, head = lines
    assert 8 <= len(treads) <= 20
    assert all(well.polygon.buffer(1e-6).covers(line) for line in lines)
    assert len(way.coords) == corners
    assert way.coords[-1] == head.coords[1]
    edge = shapely.box(0.1, 0.1, 4.1, 4.1)
    assert shapely.Point(way.coords[0]).distance(edge) < 0.2
    assert any(each.equals(shapely.LineString([(4.1, 1.5), (5.1, 1.5)])) for each in treads) == (corners == 3)


@pytest.mark.parametrize("size", [(4.0, 4.0), (1.0, 9.0), (0.3, 2.0)])
def test_what_is_larger_or_smaller_than_a_stair_has_no_treads(size: tuple[float, float]) -> None:
    assert not list(stair_lines(with_well(*size)))


@pytest.mark.parametrize(("room", "word"), [(None, "down"), (0, "up")])
def test_a_word_at_the_tail_of_the_arrow_says_where_a_stair_leads(room: int | None, word: str) -> None:
    plan = with_well(1.0, 4.6)
    (well,) = plan.objects
    whole = Room(0, "Room", np.array([(0.1, 0.1), (0.1, 4.1), (4.1, 4.1), (4.1, 0.1)]))
    plan = replace(plan, rooms=(whole,), objects=(replace(well, room=room),))
    words = [text for text in lay_out_plan(plan, None, 800).words if text.lines == (word,)]
    assert len(words) == 1
    assert well.polygon.covers(shapely.Point(words[0].x, words[0].y))
    assert not [text for text in lay_out_plan(plan, None, 40).words if text.lines == (word,)]
