"""Storeys that are drawn whole: their layout is read, not searched for; anything else goes through all stages."""

from dataclasses import replace

import numpy as np
import pytest
import shapely

import pipeline.algorithm
from houseexpo.plan import Frame
from pipeline.algorithm import plan_largest_building
from pipeline.config import LayoutConfig, PipelineConfig
from pipeline.sources.drawn_storeys import Hole, Wall, passage_openings, wall_prisms
from pipeline.stages.layout import read_drawn_layout
from pipeline.values import Level, Opening, SourceRoom

LEFT, RIGHT = shapely.box(0.1, 0.1, 4.1, 3.1), shapely.box(4.3, 0.1, 7.3, 3.1)
OUTER = shapely.box(0.0, 0.0, 7.4, 3.2)
DOOR = Hole(shapely.box(4.1, 1.0, 4.3, 1.9), 0.0, 2.1, has_door=True)
ENTRANCE = Hole(shapely.box(0.0, 1.0, 0.1, 1.9), 0.0, 2.1, has_door=True)
"""A wall that juts into the left room."""


def storey(*, rooms=(LEFT, RIGHT), named=(LEFT, RIGHT), holes=(DOOR, ENTRANCE), more=(), **changes) -> Level:
    walls = [Wall(part, 0.0, 2.5) for part in shapely.get_parts(OUTER.difference(shapely.union_all(rooms)))]
    walls += more
    return replace(
        Level(
            id="drawn",
            walls=wall_prisms(walls, holes),
            ceiling_m=2.5,
            frame=Frame(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), "z", 0.0, 0),
            floor=OUTER,
            named_openings=True,
            only_walls=True,
            rooms=tuple(SourceRoom((), (), room) for room in named),
            room_count=len(named) or None,
            openings=passage_openings(holes),
        ),
        **changes,
    )


def found(level: Level):
    return read_drawn_layout(level, LayoutConfig())


def test_rooms_and_ways_are_those_that_are_drawn() -> None:
    layout = found(storey()).layout
    assert layout.rooms == (LEFT, RIGHT), "openings lap over their walls, but not into rooms"
    door, entrance = (each for each in layout.candidates)
    assert (door.width, door.depth, sorted(door.sides)) == (pytest.approx(0.9), pytest.approx(0.2), [0, 1])
    assert sorted(entrance.sides) == [-1, 0]


@pytest.mark.parametrize(
    "level",
    [
        pytest.param(storey(), id="each room drawn"),
        pytest.param(storey(named=(LEFT, RIGHT, DOOR.shape)), id="the floor of a doorway drawn"),
    ],
)
def test_the_plan_is_that_of_all_stages(level, monkeypatch) -> None:
    assert found(level) is not None
    short = plan_largest_building(level, PipelineConfig(), np.random.default_rng(0))
    monkeypatch.setattr(pipeline.algorithm, "read_drawn_layout", lambda *_: None)
    whole = plan_largest_building(level, PipelineConfig(), np.random.default_rng(0))
    assert short.quality == whole.quality
    assert short.rooms == whole.rooms
    assert [(d.kind, d.rooms, d.segment) for d in short.doors] == [(d.kind, d.rooms, d.segment) for d in whole.doors]
    assert all(a.polygon.equals(b.polygon) for a, b in zip(short.doors, whole.doors, strict=True))
    assert short.outline.equals(whole.outline)


def test_where_something_is_not_drawn_it_is_searched_for() -> None:
    one = LEFT.union(shapely.box(4.0, 0.1, 4.4, 3.1)).union(RIGHT)
    low = Wall(shapely.box(1.0, 2.0, 2.0, 2.1), 0.0, 1.0)
    over = Wall(shapely.box(4.1, 0.1, 4.3, 3.1), 2.1, 2.5)
    in_wall = Opening.named(shapely.box(4.0, 2.2, 4.4, 3.0), has_door=True)
    blind = Hole(shapely.box(0.0, 2.0, 0.05, 2.9), 0.0, 2.1, has_door=True)
    beside = replace(DOOR, shape=shapely.box(4.1, 1.9, 4.3, 2.8))
    assert found(storey(rooms=(one,), more=(over,))) is None, "two rooms in one space"
    assert found(storey(rooms=(LEFT, RIGHT, shapely.box(7.2, 1.0, 7.4, 2.9)))) is None, "a room that lies open"
    assert found(storey(more=(low,))) is None, "a low wall"
    assert found(storey(openings=(*storey().openings, in_wall))) is None, "a door in a wall"
    assert found(storey(holes=(DOOR, blind))) is None, "a door that leads nowhere"
    assert found(storey(holes=(DOOR, beside))) is None, "two doors that meet"
    assert found(storey(holes=())) is None, "no openings"
    assert found(storey(floor=None)) is None, "no floor"
    assert found(storey(named=(LEFT,))) is None, "a space without a drawn room"
    porch = OUTER.union(shapely.box(7.4, 0.0, 9.0, 3.2))
    assert found(storey(floor=porch)) is not None, "a floor that lies open beside drawn rooms"


def test_an_opening_that_a_person_added_is_not_taken_for_a_hole() -> None:
    added = Opening.named(shapely.box(5.0, 0.0, 5.9, 0.1), has_door=True)
    assert found(replace(storey(), openings=(*storey().openings, added))) is None


def test_a_wall_with_a_gap_stands_over_its_passage() -> None:
    walls = [Wall(shapely.box(0.0, 0.0, 2.0, 0.2), 0.0, 2.5), Wall(shapely.box(2.9, 0.0, 5.0, 0.2), 0.0, 2.5)]
    gap = Hole(shapely.box(2.0, 0.0, 2.9, 0.2), 0.0, 2.1, has_door=True)
    made = wall_prisms(walls, [gap], filled_to_m=2.5)
    assert shapely.area(made.standing) == pytest.approx(0.2 * 4.1, abs=1e-3)
    assert [round(each.area.area, 2) for each in made.bodies if each.bottom_m > 2.0] == [0.18]
