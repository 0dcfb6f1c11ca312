"""Made homes: their rooms, doors and wishes."""

from __future__ import annotations

import json

import networkx as nx
import numpy as np
import pytest
import shapely

from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan
from houseexpo.plan.room_labels import LABELS
from pipeline.algorithm import plan_level
from pipeline.config import PipelineConfig
from pipeline.sources import find, made_count, reader
from pipeline.sources.homes.corners import CornerWishes, add_corners, draw_front_doors
from pipeline.sources.homes.home import home_id, make_home
from pipeline.sources.homes.level import home_digest, level_from_home
from pipeline.sources.homes.shaping import DoorWishes, bend_rooms, join_spaces_by_doors, join_to_one_space
from pipeline.sources.homes.slicing import WantedRectangles, is_connected, shared_borders, slice_box
from pipeline.sources.homes.values import Home, HomeDoor, HomeWish, snap_wall_line
from pipeline.sources.homes.wishes import (
    COUNTED,
    NUMBERS,
    STRATA,
    TABLE,
    draw_home_wish,
    draw_house_profile,
    stratum_index,
)

SEED, COUNT = 11, 40


@pytest.fixture(scope="module")
def homes() -> list[Home]:
    return [make_home(index, SEED) for index in range(COUNT)]


def free(home: Home) -> shapely.Geometry:
    return shapely.union_all([*home.spaces, *(shapely.box(*door.rect) for door in home.doors)], grid_size=1e-4)


def test_the_same_seed_and_index_give_the_same_home_whatever_others_are_made(homes: list[Home]) -> None:
    assert home_digest(make_home(7, SEED)) == home_digest(homes[7])
    assert len({home_digest(home) for home in homes}) == COUNT
    assert home_digest(make_home(7, SEED + 1)) != home_digest(homes[7])


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
    entrances, nooks = 0, 0  # behind a narrow place of a space the pipeline sees a room
    for home in homes[:6]:
        (plan,) = plan_level(level_from_home(home), PipelineConfig(), np.random.default_rng(0))
        assert isinstance(plan, FloorPlan)
        assert plan.area == pytest.approx(free(home).area, rel=0.01)
        nooks += len(plan.rooms) - len(home.spaces)
        assert len([door for door in plan.doors if door.kind == "door"]) >= len(home.doors)
        assert plan.room_num == home.room_count
        entrances += sum(door.kind == "entrance" for door in plan.doors)
        assert plan.navigability["0.20"].components == 1
    assert entrances >= 5
    assert 0 <= nooks <= 1


def test_the_source_says_which_style() -> None:
    homes = list(find("procedural:3?style=published", seed="5"))
    assert [item.id for item in homes] == [home_id(index, 5) for index in range(3)]
    assert list(find("procedural:3?style=home", seed="5")) == homes  # its name in older manifests
    assert made_count("procedural:3?style=home") == 3
    (level,) = reader(homes[0].reader).read(homes[0])
    assert level.id == homes[0].id


@pytest.mark.parametrize(
    "source", ["procedural:0?style=home", "procedural:99999999999", "procedural:3?style=castle", "procedural:3?home"]
)
def test_an_unknown_style_is_refused(source: str) -> None:
    with pytest.raises(ConfigError, match=r"expected procedural:COUNT .*a STYLE of sound, published"):
        list(find(source))


@pytest.mark.parametrize("style", ["test", "plain"])
def test_test_houses_are_no_longer_made(style: str) -> None:
    with pytest.raises(ConfigError, match=rf"{style}': test houses are no longer made; .* sound, published; plans"):
        list(find(f"procedural:3?style={style}"))


def test_rectangles_fill_the_box_that_is_asked_for() -> None:
    rects = slice_box(WantedRectangles(8.0, 6.0, (20.0, 16.0, 8.0, 4.0)), 0.9, 40, np.random.default_rng(3))
    assert rects is not None
    assert sum((x2 - x1) * (y2 - y1) for x1, y1, x2, y2 in rects) == pytest.approx(48.0)
    assert shapely.total_bounds(shapely.box(*np.array(rects).T)).tolist() == pytest.approx([0.0, 0.0, 8.0, 6.0])


def test_what_is_not_house_lies_at_the_edge() -> None:
    for seed in range(5):
        rects = slice_box(WantedRectangles(10.0, 10.0, (20.0, 20.0, 12.0, 8.0)), 0.9, 40, np.random.default_rng(seed))
        assert rects is not None
        whole = shapely.union_all(shapely.box(*np.array(rects).T), grid_size=1e-6)
        assert not shapely.get_num_interior_rings(whole)
        assert whole.area == pytest.approx(60.0, rel=0.2)
        assert shapely.bounds(whole).tolist() == pytest.approx([0.0, 0.0, 10.0, 10.0])


def test_a_box_that_is_nearly_full_has_no_recess_of_centimetres() -> None:
    rects = slice_box(WantedRectangles(8.0, 6.0, (20.0, 16.0, 8.0, 3.5)), 0.9, 40, np.random.default_rng(3))
    assert rects is not None
    assert sum((x2 - x1) * (y2 - y1) for x1, y1, x2, y2 in rects) == pytest.approx(48.0)


def test_borders_of_rectangles() -> None:
    rects = [(0.0, 0.0, 2.0, 2.0), (2.0, 1.0, 4.0, 3.0), (0.0, 2.0, 2.0, 3.0)]
    assert shared_borders(rects) == {
        (0, 1): (2.0, 1.0, 2.0, True),
        (0, 2): (2.0, 0.0, 2.0, False),
        (1, 2): (2.0, 2.0, 3.0, True),
    }
    assert is_connected(3, shared_borders(rects))
    assert not is_connected(4, shared_borders(rects))


def test_a_room_goes_round_a_smaller_one_and_keeps_its_area() -> None:
    rects = [(0.0, 0.0, 2.0, 5.0), (2.0, 0.0, 8.0, 5.0)]
    found = next(
        f for seed in range(60) if len((f := bend_rooms(rects, 3, 0.1, np.random.default_rng(seed))).rects) == 3
    )
    areas = [
        sum(shapely.box(*r).area for r, k in zip(found.rects, found.space_of, strict=True) if k == s) for s in (0, 1)
    ]
    assert areas == pytest.approx([10.0, 30.0], rel=0.01)  # walls stand on the grid
    assert found.space_of == [0, 1, 1]
    assert len(found.gaps) == 1


def test_a_room_without_corners_to_spare_stays_as_it_is() -> None:
    rects = [(0.0, 0.0, 2.0, 5.0), (2.0, 0.0, 8.0, 5.0)]
    assert bend_rooms(rects, 0, 0.1, np.random.default_rng(0)).rects == rects


def test_no_wall_reaches_into_a_small_room() -> None:
    assert bend_rooms([(0.0, 0.0, 3.0, 2.9)], 8, 0.1, np.random.default_rng(0)).gaps == []


DOORWAYS = DoorWishes((0.8,), 0, 0.1)


def test_rooms_that_share_too_little_wall_are_not_joined() -> None:
    rng = np.random.default_rng(0)
    assert (
        join_spaces_by_doors([(0.0, 0.0, 4.0, 4.0), (4.0, 3.5, 8.0, 8.0)], [0, 1], [None, None], DOORWAYS, rng) is None
    )
    found = join_spaces_by_doors([(0.0, 0.0, 4.0, 4.0), (4.0, 2.0, 8.0, 8.0)], [0, 1], [None, None], DOORWAYS, rng)
    assert found is not None
    (door,) = found
    assert 2.05 <= door.gap[1] < door.gap[3] <= 3.95
    assert door.gap[3] - door.gap[1] == pytest.approx(0.8)


def test_a_side_wall_runs_on_past_a_door_where_fewer_corners_are_asked_for() -> None:
    rects = [(0.0, 0.0, 4.0, 4.0), (4.0, 0.0, 8.0, 4.0)]
    asked = DoorWishes(DOORWAYS.widths, 4, 0.1)
    found = join_spaces_by_doors(rects, [0, 1], [None, None], asked, np.random.default_rng(0))
    assert found is not None
    (_, low, _, high) = found[0].gap
    assert min(low - 0.05, 3.95 - high) == pytest.approx(0.0)


def test_where_no_door_fits_another_of_the_home_does_or_a_narrower_one() -> None:
    rects = [(0.0, 0.0, 4.0, 4.0), (4.0, 3.0, 8.0, 8.0), (8.0, 3.0, 12.0, 8.0)]  # the first border takes 0.78 m
    for widths, expected in (((0.74, 1.84), [0.74, 1.84]), ((1.2, 1.84), [0.78, 1.84])):
        found = join_spaces_by_doors(rects, [0, 1, 2], [None] * 3, DoorWishes(widths, 0, 0.1), np.random.default_rng(0))
        assert found is not None
        assert sorted(joint.gap[3] - joint.gap[1] for joint in found) == pytest.approx(expected)


def test_a_house_of_one_room_is_joined_by_whole_borders() -> None:
    found = join_to_one_space([(0.0, 0.0, 4.0, 8.0), (4.0, 0.0, 9.0, 4.0)], 0.1)
    assert found.space_of == [0, 0]
    assert [gap.gap[1::2] for gap in found.gaps] == [pytest.approx((0.05, 3.95))]


def test_details_give_the_corners_that_are_asked_for() -> None:
    room = shapely.box(0.0, 0.0, 9.0, 7.0)
    for corners in (0, 4, 7, 12):
        found = []
        for seed in range(8):
            ((space,),) = (add_corners([room], (), CornerWishes(corners, 0.0, 0.1), np.random.default_rng(seed)),)
            found.append(shapely.get_num_coordinates(shapely.simplify(space, 0.03)) - 5)
        assert np.median(found) == pytest.approx(corners, abs=0.5)


def test_what_stands_in_a_room_leaves_the_way_to_its_door() -> None:
    room, door = shapely.box(0.0, 0.0, 2.4, 2.0), HomeDoor((1.0, -0.1, 1.75, 0.0), (0, 1))
    for seed in range(12):
        ((space,),) = (add_corners([room], (door,), CornerWishes(12, 0.0, 0.1), np.random.default_rng(seed)),)
        place = shapely.buffer(space, -0.22)
        assert isinstance(place, shapely.Polygon)
        assert place.distance(shapely.box(*door.rect)) == pytest.approx(0.22, abs=0.01)


def test_front_doors_lead_outside_and_not_through_a_wall_that_ends_in_the_room() -> None:
    room = shapely.box(0.0, 0.0, 9.0, 7.0).difference(shapely.box(4.0, -1.0, 4.1, 5.0))
    for seed in range(12):
        for front in draw_front_doors([room], (("Hall",),), 0.1, np.random.default_rng(seed)):
            assert not shapely.box(*front.rect).within(shapely.box(0.1, 0.1, 8.9, 6.9))


def test_faces_of_walls_lie_on_the_grid_of_plans(homes: list[Home]) -> None:
    assert snap_wall_line(3.0, 0.11) - 0.055 == pytest.approx(round(snap_wall_line(3.0, 0.11) - 0.055, 2))
    for home in homes:
        jambs = np.array(
            [door.rect[1::2] if door.rect[3] - door.rect[1] > 0.45 else door.rect[::2] for door in home.doors]
        )
        assert np.allclose(np.diff(jambs), np.diff(jambs).round(2), atol=1e-6)


def test_a_robot_finds_a_place_in_each_space(homes: list[Home]) -> None:
    assert all(shapely.buffer(space, -0.22).area > 0 for home in homes for space in home.spaces)


# What is asked of a home: it follows the published statistics, and what goes together there goes together here.


@pytest.mark.slow
def test_a_wish_is_drawn_from_the_published_statistics() -> None:
    rng = np.random.default_rng(1)
    wishes = [draw_home_wish(rng) for _ in range(400)]
    assert np.median([wish.area_m2 for wish in wishes]) == pytest.approx(113, rel=0.15)
    assert np.median([wish.rooms for wish in wishes]) == pytest.approx(7, abs=1)
    assert all(wish.short_m <= wish.long_m for wish in wishes)
    assert all(sum(wish.areas_m2) == pytest.approx(wish.area_m2) for wish in wishes)


@pytest.fixture(scope="module")
def wishes() -> list[HomeWish]:
    rng = np.random.default_rng(3)
    return [draw_home_wish(rng) for _ in range(1000)]


@pytest.mark.slow
def test_a_wish_has_one_door_less_than_spaces_and_no_more_names_than_labels(wishes: list[HomeWish]) -> None:
    for wish in wishes:
        assert len(wish.doors) == wish.spaces - 1
        assert len(wish.names) == len(wish.areas_m2) == wish.spaces
        assert list(wish.doors) == sorted(wish.doors)
        assert min(wish.doors, default=1.0) >= 0.5
        assert min(wish.areas_m2) > 0.9


@pytest.mark.slow
def test_doors_of_a_home_are_of_few_makes(wishes: list[HomeWish]) -> None:
    five = [wish.doors for wish in wishes if len(wish.doors) == 5]
    assert 2.0 < np.mean([len(set(doors)) for doors in five]) < 3.4
    every = np.array([width for wish in wishes for width in wish.doors])
    assert np.isin(every, (0.74, 1.0, 0.98, 1.2, 1.84)).mean() == pytest.approx(0.68, abs=0.06)


@pytest.mark.slow
def test_labels_that_go_together_are_drawn_together(wishes: list[HomeWish]) -> None:
    labels = [{label for names in wish.names for label in names} for wish in wishes]
    hallway = [house for house in labels if "Hallway" in house]
    assert len(hallway) > 60
    with_hallway = np.mean(["Child_Room" in house for house in hallway])
    without = np.mean(["Child_Room" in house for house in labels if "Hallway" not in house])
    assert with_hallway > 2 * without


@pytest.mark.slow
def test_as_many_labels_are_drawn_as_go_with_the_spaces() -> None:
    rng = np.random.default_rng(1)
    known = {tuple(row[:-1]) for row in json.loads(TABLE.read_text())["houses"]}
    for _ in range(200):
        house = draw_house_profile(rng)
        assert (house.spaces, house.rooms, len(house.labels), house.nameless) in known


@pytest.mark.slow
def test_strata() -> None:
    assert [stratum_index(n) for n in (0, 1, 2, 7, 8, 9, 11, 12, 70)] == [0, 0, 1, 6, 6, 7, 7, 8, 8]


@pytest.mark.slow
def test_the_table_holds_distributions_and_no_plan() -> None:
    table = json.loads(TABLE.read_text())
    keys = {"plans", "shares", "houses", "strata", "kinds", "door_kinds", "sides_cm", "room_areas", "hubs"}
    assert set(table) == keys
    assert len(table["strata"]) == len(STRATA)
    for stratum in table["strata"]:
        assert set(stratum) == {*COUNTED, *NUMBERS}
        assert all(len(values) == len(table["shares"]) for values in stratum.values())
