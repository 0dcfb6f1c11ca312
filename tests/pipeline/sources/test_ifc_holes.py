"""Doors and openings of tiny IFC storeys: each rule with a wall that needs it and one that it leaves alone."""

from pathlib import Path

import numpy as np
import pytest
import shapely

from pipeline.geometry.cutting import Cutter
from pipeline.geometry.walls import section

pytest.importorskip("ifcopenshell")

from pipeline.sources import ifc
from pipeline.values import Level
from tests.builders.houses import kinds, plan_of
from tests.builders.ifc import TinyBuilding

ROOM = (0, 0, 0, 8, 6, 2.5)


class Flat:
    """Outer walls and one inner wall, x from 4.0 to 4.2, on one storey."""

    def __init__(self) -> None:
        self.house = TinyBuilding()
        self.storey = self.house.storey("EG", 0.0)
        self.outer = self.house.walls_around(self.storey, ROOM)
        self.inner = self.house.element("IfcWall", self.storey, (4, 0.2, 0, 4.2, 5.8, 2.5), "inner")

    def levels(self, folder: Path) -> list[Level]:
        return [level for item in ifc.find(str(self.house.write(folder / "flat.ifc"))) for level in ifc.read(item)]

    def bounds(self, folder: Path) -> list[tuple[float, float, float, float, bool]]:
        """Bounds of the openings of the one level, to the centimetre, and whether each has a door."""
        (level,) = self.levels(folder)
        found = [(*np.round(each.polygon.bounds, 2).tolist(), each.has_door) for each in level.openings]
        return sorted(found)


@pytest.fixture
def flat():
    return Flat()


@pytest.mark.parametrize("depth", [0.0, 0.05, 0.8])
def test_an_opening_runs_through_the_wall_and_no_farther(flat, tmp_path, depth):
    flat.house.opening(flat.inner, (4 - depth, 2, 0, 4.2 + depth, 2.9, 2.1), "IfcDoor")
    assert flat.bounds(tmp_path) == [(4.0, 2.0, 4.2, 2.9, True)]


def test_beside_a_full_height_door_the_wall_tells_the_depth(flat, tmp_path):
    flat.house.element("IfcWall", flat.storey, (4.2, 1.8, 0, 7.8, 1.95, 2.5), "meets the jamb")
    flat.house.opening(flat.inner, (3.9, 2, 0, 4.3, 2.9, 2.5), "IfcDoor")
    assert flat.bounds(tmp_path) == [(4.0, 2.0, 4.2, 2.9, True)]


def test_a_hole_in_each_leaf_of_a_wall_is_one_opening(flat, tmp_path):
    lining = flat.house.element("IfcWall", flat.storey, (4.25, 0.2, 0, 4.35, 5.8, 2.5), "lining")
    flat.house.opening(flat.inner, (4, 2, 0, 4.2, 2.9, 2.1), "IfcDoor")
    flat.house.opening(lining, (4.25, 2, 0, 4.35, 2.9, 2.1), None)
    assert flat.bounds(tmp_path) == [(4.0, 2.0, 4.35, 2.9, True)]


def test_two_doors_side_by_side_stay_two(flat, tmp_path):
    flat.house.opening(flat.inner, (4, 2, 0, 4.2, 2.9, 2.1), "IfcDoor")
    flat.house.opening(flat.inner, (4, 3, 0, 4.2, 3.9, 2.1), "IfcDoor")
    assert len(flat.bounds(tmp_path)) == 2


def test_niches_hatches_ducts_and_windows_are_no_openings(flat, tmp_path):
    flat.house.opening(flat.inner, (4, 1, 0, 4.1, 2, 2.1), None)  # a niche
    flat.house.opening(flat.inner, (4, 2.5, 0.9, 4.2, 3.2, 2.1), None)  # a hatch
    flat.house.opening(flat.inner, (4, 3.4, 0, 4.2, 3.6, 2.1), None)  # a duct
    flat.house.opening(flat.outer[0], (1, 0, 0, 3, 0.2, 2.3), "IfcWindow")  # full-height glazing
    flat.house.opening(flat.inner, (4, 4, 0, 4.2, 4.9, 2.1), None)
    assert flat.bounds(tmp_path) == [(4.0, 4.0, 4.2, 4.9, False)]


def test_a_door_without_an_opening_is_one(flat, tmp_path):
    door = flat.house.element("IfcDoor", flat.storey, (0, 0, 0, 0.9, 0.05, 2.1), "door", OverallWidth=0.9)
    flat.house.turned(door, (4.05, 2.0, 0.0), (0.0, 1.0))
    (level,) = flat.levels(tmp_path)
    assert not level.named_openings  # openings without a door have no element in such a file
    assert flat.bounds(tmp_path) == [(4.0, 2.0, 4.2, 2.9, True)]


def test_a_door_without_a_body_has_its_placement_and_size(flat, tmp_path):
    door = flat.house.element("IfcDoor", flat.storey, None, "door", OverallWidth=0.8, OverallHeight=2.0)
    flat.house.turned(door, (4.15, 2.0, 0.0), (0.0, 1.0))
    assert flat.bounds(tmp_path) == [(4.0, 2.0, 4.2, 2.8, True)]


def test_a_door_in_a_curtain_wall_is_one(flat, tmp_path):
    curtain = flat.house.element("IfcCurtainWall", flat.storey, None, "curtain")
    plates = [(4.2, 3, 0, 6, 3.06, 2.5), (6.9, 3, 0, 7.8, 3.06, 2.5), (6, 3, 2.1, 6.9, 3.06, 2.5)]
    parts = [flat.house.element("IfcPlate", None, plate) for plate in plates]
    door = flat.house.element("IfcDoor", None, (6, 3.01, 0, 6.9, 3.05, 2.1), "door")
    flat.house.part_of(curtain, *parts, door)
    (found,) = flat.bounds(tmp_path)
    assert found[0::2] == (6.0, 6.9, True)
    assert found[1] <= 3.0
    assert found[3] >= 3.06


def test_a_door_in_a_part_of_a_wall_is_one(flat, tmp_path):
    whole = flat.house.element("IfcWall", flat.storey, None, "whole")
    part = flat.house.element("IfcBuildingElementPart", None, (4.2, 3, 0, 7.8, 3.2, 2.5), "part")
    flat.house.part_of(whole, part)
    flat.house.opening(part, (5, 3, 0, 5.9, 3.2, 2.1), "IfcDoor")
    assert flat.bounds(tmp_path) == [(5.0, 3.0, 5.9, 3.2, True)]


def test_a_hatch_in_a_floor_and_a_low_flap_are_no_doors(flat, tmp_path):
    flat.house.element("IfcDoor", flat.storey, (1, 1, -0.1, 2, 2, 0.0), "hatch")
    flat.house.element("IfcDoor", flat.storey, (4.05, 2, 0, 4.1, 2.6, 0.6), "flap")
    assert flat.bounds(tmp_path) == []


def test_a_door_belongs_to_the_level_that_it_is_entered_from(flat, tmp_path):
    house = flat.house
    upper = house.storey("OG", 2.8)
    walls = house.walls_around(upper, (0, 0, 2.8, 8, 6, 5.3))
    house.opening(walls[0], (1, 0, 2.8, 2, 0.2, 4.9), "IfcDoor")
    house.element("IfcDoor", upper, (4.05, 2, 0, 4.1, 2.9, 2.1), "of the ground floor", OverallWidth=0.9)
    house.opening(flat.outer[2], (5, 5.8, 0.9, 6, 6, 2.5), "IfcDoor")  # half a storey up
    ground, first = flat.levels(tmp_path)
    assert [len(level.openings) for level in (ground, first)] == [2, 1]
    assert [len(level.leaves) for level in (ground, first)] == [2, 1]
    assert [leaf.words for leaf in ground.leaves] == [("of the ground floor", "IfcDoor"), ("leaf", "IfcDoor")]


def test_a_leaf_drawn_open_does_not_widen_its_door(flat, tmp_path):
    flat.house.element("IfcDoor", flat.storey, (4.05, 2, 0, 4.1, 3.2, 2.1), "door and swing", OverallWidth=0.9)
    assert flat.bounds(tmp_path) == [(4.0, 2.15, 4.2, 3.05, True)]


def test_in_a_turned_building_openings_run_along_their_walls(flat, tmp_path):
    house, turn = flat.house, np.radians(30.0)
    wall = house.element("IfcWall", flat.storey, (0, 0, 0, 3, 0.2, 2.5), "turned")
    direction = (float(np.cos(turn)), float(np.sin(turn)))
    house.turned(wall, (4.5, 1.0, 0.0), direction)
    house.opening(wall, (1, -0.5, 0, 1.9, 0.7, 2.1), "IfcDoor")
    for element in (*house.model.by_type("IfcOpeningElement"), *house.model.by_type("IfcDoor")):
        house.turned(element, (4.5, 1.0, 0.0), direction)
    (level,) = flat.levels(tmp_path)
    corners = np.asarray(level.openings[0].polygon.exterior.coords)
    sides = np.sort(np.hypot(*np.diff(corners[:3], axis=0).T))
    assert sides == pytest.approx((0.2, 0.9), abs=0.01)
    assert level.openings[0].polygon.centroid.coords[0] == pytest.approx(
        (4.5 + 1.45 * direction[0] - 0.1 * direction[1], 1.0 + 1.45 * direction[1] + 0.1 * direction[0]), abs=0.01
    )


WINDOW = (1, 0.0, 0.9, 2, 0.2, 2.5)
"""A window up to the top of the southern wall."""


def standing(level: Level, plan: tuple[float, float, float, float], height: float) -> float:
    """Which share of a rectangle stands at a height."""
    walls = section(Cutter(level.walls).cut(height), sheet_m=0.05, solid_m=0.7).walls
    return float(walls.intersection(shapely.box(*plan)).area / shapely.box(*plan).area)


@pytest.mark.parametrize("deeper", [0.0, 0.3])
@pytest.mark.parametrize("filling", ["IfcWindow", None])
def test_a_window_up_to_the_ceiling_is_wall_as_deep_as_its_wall(flat, tmp_path, filling, deeper):
    x1, y1, z1, x2, y2, z2 = WINDOW
    flat.house.opening(flat.outer[0], (x1, y1 - deeper, z1, x2, y2 + deeper, z2), filling)
    (level,) = flat.levels(tmp_path)
    assert standing(level, (1, 0, 2, 0.2), 2.0) == pytest.approx(1.0, abs=0.01)
    assert standing(level, (1, 0.21, 2, 0.7), 2.0) == 0.0
    assert not level.openings


def test_a_way_through_a_wall_is_not_closed(flat, tmp_path):
    flat.house.opening(flat.inner, (4, 2, 0, 4.2, 2.9, 2.5), None)
    (level,) = flat.levels(tmp_path)
    assert standing(level, (4, 2.01, 4.2, 2.89), 2.0) == 0.0


def test_a_niche_over_a_table_is_not_closed(flat, tmp_path):
    flat.house.opening(flat.inner, (4, 2, 0.9, 4.1, 2.9, 2.5), None)
    (level,) = flat.levels(tmp_path)
    assert standing(level, (4, 2.01, 4.09, 2.89), 2.0) == 0.0


def test_a_window_of_the_storey_below_closes_nothing_above(flat, tmp_path):
    upper = flat.house.storey("OG", 2.8)
    wall, *_ = flat.house.walls_around(upper, (0, 0, 2.8, 8, 6, 5.3))
    flat.house.opening(wall, (1, 0, 2.8, 2, 0.2, 4.9), "IfcDoor")
    flat.house.opening(flat.outer[0], WINDOW, "IfcWindow")
    flat.house.opening(flat.inner, (4, 2, 0, 4.2, 2.9, 2.1), "IfcDoor")
    _, above = flat.levels(tmp_path)
    assert standing(above, (1.01, 0, 1.99, 0.2), 1.5) == 0.0


@pytest.mark.parametrize("sill", [0.05, 0.25])
def test_a_window_that_reaches_down_to_the_floor_is_no_door(tmp_path, sill):
    house = TinyBuilding()
    storey = house.storey("EG", 0.0)
    walls = [
        house.element("IfcWall", storey, box, "thin")
        for box in ((0, 0, 0, 8, 0.1, 3), (0, 5.9, 0, 8, 6, 3), (0, 0.1, 0, 0.1, 5.9, 3), (7.9, 0.1, 0, 8, 5.9, 3))
    ]
    house.opening(walls[0], (1, -0.1, 0, 1.9, 0.2, 2.1), "IfcDoor")
    for left in (3, 5):
        house.opening(walls[0], (left, -0.1, sill, left + 1, 0.2, 2.55), "IfcWindow")
        house.element("IfcWindow", storey, (left, -0.07, sill, left + 1, 0.17, 2.55), "its frame, proud of the wall")
    (level,) = [level for item in ifc.find(str(house.write(tmp_path / "thin.ifc"))) for level in ifc.read(item)]
    assert kinds(plan_of(level)) == ["entrance"]
