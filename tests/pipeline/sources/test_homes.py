"""Homes: what is asked of them is what they are, and the pipeline reads them as they were made."""

from __future__ import annotations

import json

import networkx as nx
import numpy as np
import pytest
import shapely

from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan
from houseexpo.plan.categories import LABELS
from pipeline.algorithm import plan_level
from pipeline.config import PipelineConfig
from pipeline.sources import find, made_count, reader
from pipeline.sources.homes.details import Details, detailed
from pipeline.sources.homes.fronts import front_doors
from pipeline.sources.homes.house import home_id, make_home
from pipeline.sources.homes.joints import Doorways, doors
from pipeline.sources.homes.level import digest, level_of
from pipeline.sources.homes.shaping import one_space, shaped
from pipeline.sources.homes.slicing import Asked, borders, joined, lay_out
from pipeline.sources.homes.values import Door, DoorWish, Home
from pipeline.sources.homes.widths import door_widths
from pipeline.sources.homes.wishes import NUMBERS, STRATA, TABLE, draw_labels, draw_wish, stratum_of

SEED, COUNT = 11, 40


@pytest.fixture(scope="module")
def homes() -> list[Home]:
    return [make_home(index, SEED) for index in range(COUNT)]


def free(home: Home) -> shapely.Geometry:
    return shapely.union_all([*home.spaces, *(shapely.box(*door.rect) for door in home.doors)], grid_size=1e-4)


def test_the_same_seed_and_index_give_the_same_home_whatever_others_are_made(homes: list[Home]) -> None:
    assert digest(make_home(7, SEED)) == digest(homes[7])
    assert len({digest(home) for home in homes}) == COUNT
    assert digest(make_home(7, SEED + 1)) != digest(homes[7])


def test_a_home_is_one_piece_without_a_ring(homes: list[Home]) -> None:
    for home in homes:
        parts = shapely.get_parts(free(home))
        assert len(parts) == 1, home.id
        assert not parts[0].interiors, home.id
        graph = nx.Graph()
        graph.add_nodes_from(range(len(home.spaces)))
        graph.add_edges_from(door.spaces for door in home.doors)
        assert nx.is_tree(graph)
        assert len(home.doors) == len(home.spaces) - 1


def test_spaces_lie_a_wall_apart(homes: list[Home]) -> None:
    for home in homes:
        tree = shapely.STRtree(home.spaces)
        one, other = tree.query(home.spaces, predicate="dwithin", distance=0.6 * home.wall_m)
        assert (one == other).all(), home.id


def test_a_robot_of_a_fifth_of_a_metre_gets_everywhere(homes: list[Home]) -> None:
    for home in homes:
        widths = [max(door.rect[2] - door.rect[0], door.rect[3] - door.rect[1]) for door in home.doors]
        assert min(widths, default=1.0) >= 0.5


def test_labels_are_those_of_the_data_set(homes: list[Home]) -> None:
    assert {box.label for home in homes for box in home.boxes} <= set(LABELS)


def test_the_pipeline_reads_what_was_made(homes: list[Home]) -> None:
    entrances = 0
    for home in homes[:4]:
        (plan,) = plan_level(level_of(home), PipelineConfig(), np.random.default_rng(0))
        assert isinstance(plan, FloorPlan)
        assert plan.area == pytest.approx(free(home).area, rel=0.01)
        assert len(plan.rooms) == len(home.spaces)
        assert plan.room_num == home.room_count
        entrances += sum(door.kind == "entrance" for door in plan.doors)
        assert plan.navigability["0.20"].components == 1
    assert entrances >= 3


def test_the_source_says_which_style() -> None:
    plain, homes = (list(find(f"procedural:3{style}", seed="5")) for style in ("", "?style=home"))
    assert [item.id for item in homes] == [home_id(index, 5) for index in range(3)]
    assert not {item.id for item in homes} & {item.id for item in plain}
    assert [item.id for item in find("procedural:3?style=plain", seed="5")] == [item.id for item in plain]
    assert made_count("procedural:3?style=home") == 3
    (level,) = reader(homes[0].reader).read(homes[0])
    assert level.id == homes[0].id


@pytest.mark.parametrize("source", ["procedural:0?style=home", "procedural:3?style=castle", "procedural:3?home"])
def test_an_unknown_style_is_refused(source: str) -> None:
    with pytest.raises(ConfigError, match=r"expected procedural:COUNT or procedural:COUNT\?style=home"):
        list(find(source))


def test_rectangles_fill_the_box_that_is_asked_for() -> None:
    rects = lay_out(Asked(8.0, 6.0, (20.0, 16.0, 8.0, 4.0)), 0.9, 40, np.random.default_rng(3))
    assert rects is not None
    assert sum((x2 - x1) * (y2 - y1) for x1, y1, x2, y2 in rects) == pytest.approx(48.0)
    assert shapely.total_bounds(shapely.box(*np.array(rects).T)).tolist() == pytest.approx([0.0, 0.0, 8.0, 6.0])


def test_what_is_not_house_lies_at_the_edge() -> None:
    for seed in range(5):
        rects = lay_out(Asked(10.0, 10.0, (20.0, 20.0, 12.0, 8.0)), 0.9, 40, np.random.default_rng(seed))
        assert rects is not None
        whole = shapely.union_all(shapely.box(*np.array(rects).T), grid_size=1e-6)
        assert not shapely.get_num_interior_rings(whole)
        assert whole.area == pytest.approx(60.0, rel=0.2)
        assert shapely.bounds(whole).tolist() == pytest.approx([0.0, 0.0, 10.0, 10.0])


def test_borders_of_rectangles() -> None:
    rects = [(0.0, 0.0, 2.0, 2.0), (2.0, 1.0, 4.0, 3.0), (0.0, 2.0, 2.0, 3.0)]
    assert borders(rects) == {
        (0, 1): (2.0, 1.0, 2.0, True),
        (0, 2): (2.0, 0.0, 2.0, False),
        (1, 2): (2.0, 2.0, 3.0, True),
    }
    assert joined(3, borders(rects))
    assert not joined(4, borders(rects))


def test_a_room_goes_round_a_smaller_one_and_keeps_its_area() -> None:
    rects = [(0.0, 0.0, 2.0, 5.0), (2.0, 0.0, 8.0, 5.0)]
    found = next(f for seed in range(60) if len((f := shaped(rects, 3, 0.1, np.random.default_rng(seed))).rects) == 3)
    areas = [
        sum(shapely.box(*r).area for r, k in zip(found.rects, found.space_of, strict=True) if k == s) for s in (0, 1)
    ]
    assert areas == pytest.approx([10.0, 30.0])
    assert found.space_of == [0, 1, 1]
    assert len(found.gaps) == 1


def test_a_room_without_corners_to_spare_stays_as_it_is() -> None:
    rects = [(0.0, 0.0, 2.0, 5.0), (2.0, 0.0, 8.0, 5.0)]
    assert shaped(rects, 0, 0.1, np.random.default_rng(0)).rects == rects


def test_no_wall_reaches_into_a_small_room() -> None:
    assert shaped([(0.0, 0.0, 3.0, 2.9)], 8, 0.1, np.random.default_rng(0)).gaps == []


DOORWAYS = Doorways(DoorWish(0.8, 0.0, 0.5), 0, 0.1)


def test_rooms_that_share_too_little_wall_are_not_joined() -> None:
    rng = np.random.default_rng(0)
    assert doors([(0.0, 0.0, 4.0, 4.0), (4.0, 3.5, 8.0, 8.0)], [0, 1], [None, None], DOORWAYS, rng) is None
    found = doors([(0.0, 0.0, 4.0, 4.0), (4.0, 2.0, 8.0, 8.0)], [0, 1], [None, None], DOORWAYS, rng)
    assert found is not None
    (door,) = found
    assert 2.05 <= door.gap[1] < door.gap[3] <= 3.95
    assert door.gap[3] - door.gap[1] == pytest.approx(0.8)


def test_a_side_wall_runs_on_past_a_door_where_fewer_corners_are_asked_for() -> None:
    rects = [(0.0, 0.0, 4.0, 4.0), (4.0, 0.0, 8.0, 4.0)]
    asked = Doorways(DOORWAYS.widths, 4, 0.1)
    found = doors(rects, [0, 1], [None, None], asked, np.random.default_rng(0))
    assert found is not None
    (_, low, _, high) = found[0].gap
    assert min(low - 0.05, 3.95 - high) == pytest.approx(0.0)


def test_widths_of_doors_are_those_that_are_asked_for() -> None:
    rng = np.random.default_rng(2)
    assert door_widths(0, DOORWAYS.widths, rng) == []
    assert door_widths(1, DoorWish(0.75, 0.5, 0.5), rng) == [0.75]
    assert door_widths(4, DoorWish(0.75, 0.02, 0.5), rng)[::3] == pytest.approx([0.75, 0.77])
    means = [np.mean(door_widths(9, DoorWish(0.75, 1.1, share), rng)) for share in (0.1, 0.3, 0.6)]
    assert means == sorted(means)
    assert means == pytest.approx([0.86, 1.08, 1.41], abs=0.1)


def test_a_house_of_one_room_is_joined_by_whole_borders() -> None:
    found = one_space([(0.0, 0.0, 4.0, 8.0), (4.0, 0.0, 9.0, 4.0)], 0.1)
    assert found.space_of == [0, 0]
    assert [gap.gap[1::2] for gap in found.gaps] == [pytest.approx((0.05, 3.95))]


def test_details_give_the_corners_that_are_asked_for() -> None:
    room = shapely.box(0.0, 0.0, 9.0, 7.0)
    for corners in (0, 4, 7, 12):
        ((space,),) = (detailed([room], (), Details(corners, 0.0, 0.1), np.random.default_rng(5)),)
        assert shapely.get_num_coordinates(shapely.simplify(space, 0.03)) - 1 == pytest.approx(4 + corners, abs=1)


def test_what_stands_in_a_room_leaves_the_way_to_its_door() -> None:
    room, door = shapely.box(0.0, 0.0, 2.4, 2.0), Door((1.0, -0.1, 1.75, 0.0), (0, 1))
    for seed in range(12):
        ((space,),) = (detailed([room], (door,), Details(12, 0.0, 0.1), np.random.default_rng(seed)),)
        place = shapely.buffer(space, -0.22)
        assert isinstance(place, shapely.Polygon)
        assert place.distance(shapely.box(*door.rect)) == pytest.approx(0.22, abs=0.01)


def test_front_doors_lead_outside_and_not_through_a_wall_that_ends_in_the_room() -> None:
    room = shapely.box(0.0, 0.0, 9.0, 7.0).difference(shapely.box(4.0, -1.0, 4.1, 5.0))
    for seed in range(12):
        for front in front_doors([room], (("Hall",),), 0.1, np.random.default_rng(seed)):
            assert not shapely.box(*front.rect).within(shapely.box(0.1, 0.1, 8.9, 6.9))


def test_a_wish_is_drawn_from_the_published_statistics() -> None:
    rng = np.random.default_rng(1)
    wishes = [draw_wish(rng) for _ in range(400)]
    assert np.median([wish.area_m2 for wish in wishes]) == pytest.approx(113, rel=0.15)
    assert np.median([wish.rooms for wish in wishes]) == pytest.approx(7, abs=1)
    assert all(wish.short_m <= wish.long_m for wish in wishes)
    assert all(sum(wish.areas_m2) == pytest.approx(wish.area_m2) for wish in wishes)


def test_as_many_labels_are_drawn_as_are_asked_for() -> None:
    rng = np.random.default_rng(1)
    assert [len(draw_labels(n, rng)) for n in (0, 1, 5, 20)] == [0, 1, 5, 20]


def test_strata() -> None:
    assert [stratum_of(n) for n in (0, 1, 2, 7, 8, 9, 11, 12, 70)] == [0, 0, 1, 6, 6, 7, 7, 8, 8]


def test_the_table_holds_distributions_and_no_plan() -> None:
    table = json.loads(TABLE.read_text())
    assert set(table) == {"plans", "shares", "spaces", "strata", "labels", "room_areas", "hubs", "door_widths_m"}
    assert len(table["strata"]) == len(STRATA)
    for stratum in table["strata"]:
        assert set(stratum) == {"quantiles", "correlations"}
        assert set(stratum["quantiles"]) == set(NUMBERS)
        assert all(len(values) == len(table["shares"]) for values in stratum["quantiles"].values())
