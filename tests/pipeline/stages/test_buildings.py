"""Stage buildings: detached houses in one level become plans of their own, houses wall to wall do not."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from houseexpo.corrections import Override
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import source_points_from_plan
from pipeline.algorithm import plan_level
from pipeline.config import PipelineConfig
from pipeline.stages.buildings import with_floor_near
from tests.builders.houses import Hole, level, shell, two_rooms, wall

DOOR = Hole(1.0, 1.9)


def moved(parts: list, x: float) -> list:
    return [part.copy().apply_translation((x, 0.0, 0.0)) for part in parts]


def plans(parts: list, name: str = "row_L1") -> list[FloorPlan]:
    found = plan_level(level(parts, id=name), PipelineConfig(), np.random.default_rng(0))
    return [each for each in found if isinstance(each, FloorPlan)]


def test_detached_houses_become_plans_of_their_own_without_a_cut() -> None:
    found = plans([*moved(two_rooms(DOOR), 15.0), *two_rooms(DOOR)])
    assert [plan.id for plan in found] == ["row_B1_L1", "row_B2_L1"]
    assert [plan.area for plan in found] == pytest.approx([21.18, 21.18], abs=0.01)
    assert [door.kind for plan in found for door in plan.doors] == ["door", "door"]
    assert found[0].frame.matrix[0][2] < found[1].frame.matrix[0][2]  # numbered by place


def test_words_of_one_point_and_of_several_go_to_the_nearest_building_of_a_level() -> None:
    parts = [*moved(two_rooms(DOOR), 15.0), *two_rooms(DOOR)]
    first, second = plans(parts)
    said = []
    for plan, word in ((first, "label"), (second, "one_room")):
        places = [room.polygon.centroid.coords[0] for room in plan.rooms]
        there = source_points_from_plan(plan.frame, places).tolist()
        said.append(Override(**{word: (*there[0], "Gym") if word == "label" else there}))
    corrections = tuple(each for one in said for each in one.corrections)
    whole = level(parts, id="row_L1", corrections=corrections)
    one, other = plan_level(whole, PipelineConfig(), np.random.default_rng(0))
    assert (sorted(room.label for room in one.rooms), len(other.rooms)) == (["Gym", "Unlabelled"], 1)


def test_a_building_has_the_pieces_of_floor_in_the_hull_of_its_outlines() -> None:
    pieces = [shapely.box(0, 0, 4, 4), shapely.box(4.2, 0, 8.2, 4), shapely.box(5, 5, 6, 6), shapely.box(20, 0, 24, 4)]
    whole = level(shell((0, 0, 4, 4)), floor=shapely.multipolygons(pieces))
    found = with_floor_near([shapely.box(-0.2, -0.2, 8.4, 4.2), shapely.box(0, 8, 1, 9)], whole).floor
    assert [each.wkb for each in shapely.get_parts(found)] == [each.wkb for each in pieces[:3]]


def test_houses_wall_to_wall_are_one_building_joined_through_their_wall() -> None:
    (plan,) = plans([*shell((0, 0, 4, 4)), *shell((4.2, 0, 8.2, 4))])
    assert plan.id == "row_L1"
    assert [door.kind for door in plan.doors] == ["cut"]


@pytest.mark.parametrize("front", [[DOOR], []], ids=["a door", "no door"])
@pytest.mark.parametrize(("joint_m", "names"), [(0.1, ["house"]), (0.3, ["house_B1", "house_B2"])])
def test_what_stands_wall_to_wall_is_one_building(joint_m: float, names: list[str], front: list[Hole]) -> None:
    shed = shell((0.0, -2.9 - joint_m, 3.0, -0.4 - joint_m), front=front)
    house = [*shell((0.0, 0.0, 7.2, 3.0), front=[Hole(5.0, 5.9)]), *wall((4.0, 0.0, 4.2, 3.0), DOOR)]
    found = plans([*house, *shed], "house")
    assert [plan.id for plan in found] == names
    assert any(door.kind == "cut" for plan in found for door in plan.doors) == (len(names) == 1)


PAIR = np.random.default_rng(7)
GAPS_M = [0.3, 0.5, 0.8, 1.0, 1.4, 1.9, 2.0, 2.1, 2.5, 3.0, 5.0, 8.0, *PAIR.uniform(0.3, 8.0, 28).round(2).tolist()]


@pytest.mark.parametrize(("number", "gap_m"), list(enumerate(GAPS_M)))
def test_of_a_pair_of_buildings_distance_and_size_decide_and_no_cut_leaves_either(number: int, gap_m: float) -> None:
    rng = np.random.default_rng(number)
    width, depth = rng.uniform(2.0, 4.5, 2)
    x, y = 7.2 + 0.4 + gap_m, rng.uniform(0.0, 5.0 - depth)
    fronts = [[Hole(start, start + 0.9)] if rng.random() < 0.5 else [] for start in (1.0, x + 0.6)]
    house = [*shell((0.0, 0.0, 7.2, 5.0), front=fronts[0]), *wall((4.0, 0.0, 4.2, 5.0), Hole(2.0, 2.9))]
    floors = [
        None,
        shapely.box(-1.0, -1.0, x + width + 1.0, 6.0),
        shapely.union(
            shapely.box(-0.2, -0.2, 7.4, 5.2), shapely.box(x - 0.2, y - 0.2, x + width + 0.2, y + depth + 0.2)
        ),
    ]
    pair = level([*house, *shell((x, y, x + width, y + depth), front=fronts[1])], id="pair", floor=floors[number % 3])
    found = plan_level(pair, PipelineConfig(), np.random.default_rng(0))
    erased = gap_m > 2.0 and width * depth < 0.25 * 35.0
    assert [plan.id for plan in found] == (["pair"] if erased else ["pair_B1", "pair_B2"])
    kept = [plan for plan in found if isinstance(plan, FloorPlan)]
    assert len(kept) == len(found)
    assert not any(door.kind == "cut" for plan in kept for door in plan.doors)
    assert [(plan.provenance or {})["notes"] for plan in kept] == ([{"erased_parts": 1}] if erased else [{}, {}])


@pytest.mark.parametrize("apart_m", [0.3, 1.0, 2.5, 8.0])
def test_equal_cabins_are_all_kept(apart_m: float) -> None:
    cabins = [part for k in range(3) for part in moved(shell((0, 0, 4, 3), front=[DOOR]), k * (4.4 + apart_m))]
    assert [plan.id for plan in plans(cabins, "camp")] == ["camp_B1", "camp_B2", "camp_B3"]
