"""Read IFC files: rooms, openings, and elements that are neither walls nor slabs."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely

pytest.importorskip("ifcopenshell")

from houseexpo import FloorPlan, plan
from houseexpo.exports import export
from pipeline.geometry.mesh_slicing import MeshSlicer
from pipeline.geometry.wall_sections import section_from_segments
from pipeline.sources.ifc.rooms_and_openings import standing_area
from pipeline.sources.storeys.surfaces import Surfaces, cut_at_height
from pipeline.values import Level, Mesh, SourceRoom
from tests.builders.formats.ifc import Box, TinyBuilding
from tests.builders.houses import kinds, levels_of, plan_of

LEFT, RIGHT = (0.2, 0.2, 0, 4, 5.8, 2.5), (4.2, 0.2, 0, 7.8, 5.8, 2.5)


class Flat:
    """Outer walls of 8 x 6 m, and one inner wall, x from 4.0 to 4.2, on one storey."""

    def __init__(self, *, inner: bool = True) -> None:
        self.house = TinyBuilding()
        self.storey = self.house.storey("EG", 0.0)
        self.outer = self.house.walls_around(self.storey, (0, 0, 0, 8, 6, 2.5))
        if inner:
            self.inner = self.house.element("IfcWall", self.storey, (4, 0.2, 0, 4.2, 5.8, 2.5), "inner")

    def levels(self, folder: Path) -> list[Level]:
        return levels_of(self.house.write(folder / "flat.ifc"))

    def level(self, folder: Path) -> Level:
        (level,) = self.levels(folder)
        return level

    def bounds(self, folder: Path) -> list[tuple[float, float, float, float, bool]]:
        """Bounds of the openings of the one level, to the centimetre, and whether each has a door."""
        return sorted(
            (*np.round(each.polygon.bounds, 2).tolist(), each.has_door) for each in self.level(folder).openings
        )

    def stands(self, folder: Path, box: tuple[float, ...] = (1, 1, 7, 5), height: float = 1.0) -> bool:
        """Whether a wall stands in a part of the plan at a height."""
        walls = Surfaces.of(self.level(folder).walls)
        lines = shapely.union_all(shapely.linestrings(cut_at_height(walls, walls.walls(), height)))
        return bool(lines.intersects(shapely.box(*box)))

    def flat_space(self, box: Box, name: str) -> None:
        model = self.house.model
        space = self.house.space(self.storey, box, "1", name)
        corners = [(x, y, 0.0) for x, y in ((box[0], box[1]), (box[3], box[1]), (box[3], box[4]), (box[0], box[4]))]
        loop = model.createIfcPolyLoop([model.createIfcCartesianPoint(corner) for corner in corners])
        faces = [model.createIfcFace([model.createIfcFaceOuterBound(loop, True)])]
        surface = model.createIfcFaceBasedSurfaceModel([model.createIfcConnectedFaceSet(faces)])
        shape = model.createIfcShapeRepresentation(self.house.context, "Body", "SurfaceModel", [surface])
        space.Representation = model.createIfcProductDefinitionShape(None, None, [shape])

    def rooms(self, folder: Path) -> tuple[SourceRoom, ...]:
        return self.level(folder).rooms

    def words(self, folder: Path) -> list[str]:
        return [room.words[0] for room in self.rooms(folder)]


@pytest.fixture
def flat():
    flat = Flat()
    flat.house.space(flat.storey, LEFT, "1", "Küche")
    return flat


def test_a_space_twice_is_one_room_with_the_words_of_both(flat, tmp_path):
    flat.house.space(flat.storey, LEFT, "K1", "Kitchen")
    (room,) = flat.rooms(tmp_path)
    assert room.words == ("Küche", "1", "Kitchen", "K1")


def test_a_space_that_others_fill_is_no_room(flat, tmp_path):
    flat.house.space(flat.storey, RIGHT, "2", "Wohnen")
    flat.house.space(flat.storey, (0.2, 0.2, 0, 7.8, 5.8, 2.5), "W", "Wohnung 1")
    assert flat.words(tmp_path) == ["Küche", "Wohnen"]


def test_a_space_within_another_is_cut_out_of_it(flat, tmp_path):
    flat.house.space(flat.storey, (0.2, 0.2, 0, 1.2, 1.2, 2.5), "3", "Abstellraum")
    large, small = flat.rooms(tmp_path)
    assert large.polygon is not None
    assert small.polygon is not None
    assert large.polygon.area == pytest.approx(3.8 * 5.6 - 1.0, abs=0.01)
    assert not large.polygon.intersects(small.polygon.buffer(-0.01))


def test_parts_of_a_space_count_only_where_the_whole_has_no_body(flat, tmp_path):
    whole = flat.house.space(flat.storey, RIGHT, "2", "Wohnen", CompositionType="ELEMENT")
    part = flat.house.space(None, (4.2, 0.2, 0, 7.8, 2, 2.5), "2a", "Essplatz", CompositionType="PARTIAL")
    flat.house.part_of(whole, part)
    assert flat.words(tmp_path) == ["Küche", "Wohnen"]
    whole.Representation = None
    assert flat.words(tmp_path) == ["Küche", "Essplatz"]


def test_a_group_counts_only_where_its_spaces_have_no_body(flat, tmp_path):
    group = flat.house.space(flat.storey, RIGHT, "G", "Gruppe", CompositionType="COMPLEX")
    inner = flat.house.space(None, (4.2, 0.2, 0, 7.8, 2, 2.5), "2", "Bad", CompositionType="ELEMENT")
    flat.house.part_of(group, inner)
    assert flat.words(tmp_path) == ["Küche", "Bad"]
    inner.Representation = None
    assert flat.words(tmp_path) == ["Küche", "Gruppe"]


def test_a_space_without_a_storey_belongs_to_the_level_that_it_stands_on(flat, tmp_path):
    flat.house.space(None, RIGHT, "2", "Wohnen")
    assert flat.words(tmp_path) == ["Küche", "Wohnen"]


def test_a_low_void_is_no_room(flat, tmp_path):
    flat.house.space(flat.storey, (4.2, 0.2, 0, 7.8, 5.8, 1.2), "2", "Installation")
    assert flat.words(tmp_path) == ["Küche"]


@pytest.mark.parametrize("height", [0.0, 0.1])
def test_flat_spaces_are_the_floors_of_rooms_where_none_is_high(flat, tmp_path, height):
    assert len(flat.rooms(tmp_path)) == 1
    house = Flat()
    if height:
        house.house.space(house.storey, (*LEFT[:5], height), "1", "Küche")
    else:
        house.flat_space(LEFT, "Küche")
    (room,) = house.rooms(tmp_path)
    assert room.words[0] == "Küche"
    assert room.polygon.area == pytest.approx(3.8 * 5.6)


@pytest.mark.parametrize("kind", ["IfcPolyline", "IfcIndexedPolyCurve"])
@pytest.mark.parametrize("is_set", [True, False])
def test_a_space_drawn_as_lines_on_the_floor_alone_is_a_room(flat, tmp_path, kind, is_set):
    model = flat.house.model
    space = flat.house.space(flat.storey, RIGHT, "2", "Wohnen")
    corners = [(4.2, 0.2), (7.8, 0.2), (7.8, 5.8), (4.2, 5.8), (4.2, 0.2)]
    if kind == "IfcPolyline":
        line = model.createIfcPolyline([model.createIfcCartesianPoint(corner) for corner in corners])
    else:
        line = model.createIfcIndexedPolyCurve(model.createIfcCartesianPointList2D(corners), None, None)
    items = [model.createIfcGeometricCurveSet([line])] if is_set else [line]
    shape = model.createIfcShapeRepresentation(flat.house.context, "FootPrint", "GeometricCurveSet", items)
    space.Representation = model.createIfcProductDefinitionShape(None, None, [shape])
    _, living = flat.rooms(tmp_path)
    assert living.words[0] == "Wohnen"
    assert living.polygon is not None
    assert living.polygon.bounds == pytest.approx((4.2, 0.2, 7.8, 5.8), abs=0.01)


def test_a_low_space_as_narrow_as_a_beam_is_no_floor_of_a_room(tmp_path):
    house = Flat()
    house.house.space(house.storey, (0.2, 0.2, 0, 4, 0.3, 0.1), "1", "a beam")
    assert house.rooms(tmp_path) == ()


def test_spaces_that_stand_apart_from_the_house_are_no_rooms(flat, tmp_path):
    for left in (30, 33):
        flat.house.space(flat.storey, (left, 0, 0, left + 3, 2, 2.5), str(left), "Typ A")
    assert flat.words(tmp_path) == ["Küche"]


def leaning(inwards: float) -> Mesh:
    """A block 4 x 3 m at its foot, whose head is smaller or larger by so much on each side."""
    foot = np.array([(0, 0, 0), (4, 0, 0), (4, 3, 0), (0, 3, 0)], float)
    head = np.array([(0, 0, 2.5), (4, 0, 2.5), (4, 3, 2.5), (0, 3, 2.5)], float)
    head[:, :2] += inwards * np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)])
    faces = [(0, 2, 1), (0, 3, 2), (4, 5, 6), (4, 6, 7)]
    faces += [triangle for i in range(4) for j in [(i + 1) % 4] for triangle in ((i, j, 4 + j), (i, 4 + j, 4 + i))]
    return Mesh(np.concatenate([foot, head]), np.array(faces, np.int64))


@pytest.mark.parametrize("inwards", [-0.5, 0.0, 0.5])
def test_a_room_is_where_it_stands_on_the_floor(inwards):
    assert standing_area(leaning(inwards)).bounds == pytest.approx((0.0, 0.0, 4.0, 3.0), abs=1e-6)
    assert standing_area(leaning(inwards)).area == pytest.approx(12.0, abs=1e-4)


def test_a_room_of_many_slivers_is_one_piece():
    xs = np.cumsum(np.full(40, 0.1)) + np.tile([0.0, 1e-7], 20)
    vertices = np.array([(x, y, z) for x in xs for y in (0.0, 3.0) for z in (0.0, 2.5)])
    floor = [(4 * i, 4 * i + 4, 4 * i + 2) for i in range(39)] + [(4 * i + 2, 4 * i + 4, 4 * i + 6) for i in range(39)]
    shape = standing_area(Mesh(vertices, np.array(floor, np.int64)))
    assert shape.area == pytest.approx(3.9 * 3.0, abs=1e-3)


# Doors and openings of tiny IFC storeys: each rule with a wall that needs it and one that it leaves alone.


@pytest.fixture
def holed_flat():
    return Flat()


@pytest.mark.parametrize("depth", [0.0, 0.05, 0.8])
def test_an_opening_runs_through_the_wall_and_no_farther(holed_flat, tmp_path, depth):
    holed_flat.house.opening(holed_flat.inner, (4 - depth, 2, 0, 4.2 + depth, 2.9, 2.1), "IfcDoor")
    assert holed_flat.bounds(tmp_path) == [(4.0, 2.0, 4.2, 2.9, True)]


@pytest.mark.parametrize("depth", [1.2, 2.0])
@pytest.mark.parametrize("host", ["inner", "other"])
def test_an_opening_deeper_than_it_is_wide_does_not_carve_the_rooms(holed_flat, tmp_path, depth, host):
    wall = holed_flat.inner if host == "inner" else holed_flat.outer[0]
    holed_flat.house.opening(wall, (4 - depth, 2.5, 0, 4.2 + depth, 3.4, 2.1), "IfcDoor")
    assert holed_flat.bounds(tmp_path) == [(4.0, 2.5, 4.2, 3.4, True)]


def test_beside_a_full_height_door_the_wall_tells_the_depth(holed_flat, tmp_path):
    holed_flat.house.element("IfcWall", holed_flat.storey, (4.2, 1.8, 0, 7.8, 1.95, 2.5), "meets the jamb")
    holed_flat.house.opening(holed_flat.inner, (3.9, 2, 0, 4.3, 2.9, 2.5), "IfcDoor")
    assert holed_flat.bounds(tmp_path) == [(4.0, 2.0, 4.2, 2.9, True)]


def test_a_hole_in_each_leaf_of_a_wall_is_one_opening(holed_flat, tmp_path):
    lining = holed_flat.house.element("IfcWall", holed_flat.storey, (4.25, 0.2, 0, 4.35, 5.8, 2.5), "lining")
    holed_flat.house.opening(holed_flat.inner, (4, 2, 0, 4.2, 2.9, 2.1), "IfcDoor")
    holed_flat.house.opening(lining, (4.25, 2, 0, 4.35, 2.9, 2.1), None)
    assert holed_flat.bounds(tmp_path) == [(4.0, 2.0, 4.35, 2.9, True)]


def test_two_doors_side_by_side_stay_two(holed_flat, tmp_path):
    holed_flat.house.opening(holed_flat.inner, (4, 2, 0, 4.2, 2.9, 2.1), "IfcDoor")
    holed_flat.house.opening(holed_flat.inner, (4, 3, 0, 4.2, 3.9, 2.1), "IfcDoor")
    assert len(holed_flat.bounds(tmp_path)) == 2


def test_a_double_door_of_two_elements_is_one(holed_flat, tmp_path):
    holed_flat.house.opening(holed_flat.inner, (4, 2, 0, 4.2, 2.9, 2.1), "IfcDoor")
    holed_flat.house.opening(holed_flat.inner, (4, 2.9, 0, 4.2, 3.8, 2.1), "IfcDoor")
    assert holed_flat.bounds(tmp_path) == [(4.0, 2.0, 4.2, 3.8, True)]


@pytest.mark.parametrize(("before", "filling"), [(0.2, "IfcDoor"), (-0.2, "IfcDoor"), (0.2, None), (0.6, "IfcDoor")])
def test_a_hole_right_before_its_wall_is_a_door_in_it(holed_flat, tmp_path, before, filling):
    holed_flat.house.opening(holed_flat.inner, (4 + before, 2, 0, 4.2 + before, 2.9, 2.1), filling)
    in_wall = (4.0, 2.0, 4.2, 2.9, True) in holed_flat.bounds(tmp_path)
    assert in_wall == (filling is not None and abs(before) < 0.3)


@pytest.mark.parametrize(("off", "doors"), [(0.0, True), (0.03, True), (0.3, False)])
def test_a_door_without_a_hole_at_the_face_of_a_wall_is_in_it(holed_flat, tmp_path, off, doors):
    holed_flat.house.element("IfcDoor", holed_flat.storey, (1, -0.05 - off, 0, 1.9, -off, 2.1), "at the outer face")
    assert ((1.0, 0.0, 1.9, 0.2, True) in holed_flat.bounds(tmp_path)) == doors


def test_niches_hatches_ducts_and_windows_are_no_openings(holed_flat, tmp_path):
    holed_flat.house.opening(holed_flat.inner, (4, 1, 0, 4.1, 2, 2.1), None)  # a niche
    holed_flat.house.opening(holed_flat.inner, (4, 2.5, 0.9, 4.2, 3.2, 2.1), None)  # a hatch
    holed_flat.house.opening(holed_flat.inner, (4, 3.4, 0, 4.2, 3.6, 2.1), None)  # a duct
    holed_flat.house.opening(holed_flat.outer[0], (1, 0, 0, 3, 0.2, 2.3), "IfcWindow")  # full-height glazing
    holed_flat.house.opening(holed_flat.inner, (4, 4, 0, 4.2, 4.9, 2.1), None)
    assert holed_flat.bounds(tmp_path) == [(4.0, 4.0, 4.2, 4.9, False)]


def rectangle(x1: float, y1: float, x2: float, y2: float) -> np.ndarray:
    return np.array([(x1, y1), (x1, y2), (x2, y2), (x2, y1)])


def test_an_opening_as_wide_as_the_way_is_no_niche(tmp_path):
    """The walls beside it are those along the way, all of them one body."""
    way = rectangle(0, 4, 1.1, 4.25)
    made = FloorPlan(
        id="way",
        verts=rectangle(0, 0, 1.1, 8),
        room_num=2,
        room_category={},
        rooms=(plan.Room(0, "Hallway", rectangle(0, 0, 1.1, 4)), plan.Room(1, "Kitchen", rectangle(0, 4.25, 1.1, 8))),
        doors=(plan.Door(0, "opening", ((0, 4.125), (1.1, 4.125)), 1.1, way, (0, 1)),),
    )
    (file,) = export(made, "ifc", tmp_path)
    (level,) = levels_of(file)
    (opening,) = level.openings
    assert opening.polygon.bounds == pytest.approx((0, 3.75, 1.1, 4), abs=0.01)  # mirrored back


def test_a_door_without_an_opening_is_one(holed_flat, tmp_path):
    door = holed_flat.house.element("IfcDoor", holed_flat.storey, (0, 0, 0, 0.9, 0.05, 2.1), "door", OverallWidth=0.9)
    holed_flat.house.turned(door, (4.05, 2.0, 0.0), (0.0, 1.0))
    level = holed_flat.level(tmp_path)
    assert not level.named_openings  # openings without a door have no element in such a file
    assert holed_flat.bounds(tmp_path) == [(4.0, 2.0, 4.2, 2.9, True)]


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        ("IfcBuildingElementProxy", "Zimmertür 0.9"),
        ("IfcBuildingElementProxy", "Ovi 9x21"),
        ("IfcBuildingElementProxy", "дверь"),
        ("IfcFurniture", "Door"),
        ("IfcMember", "室内ドア"),
    ],
)
def test_what_is_called_a_door_is_one_whatever_its_class(holed_flat, tmp_path, kind, name):
    holed_flat.house.element(kind, holed_flat.storey, (4.05, 2, 0, 4.1, 2.9, 2.1), name)
    level = holed_flat.level(tmp_path)
    assert holed_flat.bounds(tmp_path) == [(4.0, 2.0, 4.2, 2.9, True)]
    assert [leaf.words for leaf in level.leaves] == [(name, kind)]
    assert not level.furniture


def test_what_fills_a_hole_and_is_called_a_door_is_one(holed_flat, tmp_path):
    leaf = holed_flat.house.opening(holed_flat.inner, (4, 2, 0, 4.2, 2.9, 2.1), "IfcBuildingElementProxy")
    leaf.Name = "Porte intérieure"
    assert holed_flat.bounds(tmp_path) == [(4.0, 2.0, 4.2, 2.9, True)]


@pytest.mark.parametrize(
    ("name", "box"),
    [
        ("Door handle", (4.05, 2, 0, 4.1, 2.9, 2.1)),
        ("Door stop", (4.05, 2, 0, 4.1, 2.9, 0.1)),
        ("Cabinet door", (4.05, 2, 0, 4.1, 2.9, 2.1)),
    ],
)
def test_a_part_of_a_door_and_a_door_of_furniture_are_none(holed_flat, tmp_path, name, box):
    holed_flat.house.element("IfcFurniture", holed_flat.storey, box, name)
    assert holed_flat.bounds(tmp_path) == []


def test_in_a_file_without_walls_doors_and_furniture_are_told_from_walls_by_their_names(tmp_path):
    house = TinyBuilding()
    storey = house.storey("EG", 0.0)
    sides = (
        (0, 0, 8, 0.2),
        (7.8, 0.2, 8, 6),
        (0, 5.8, 7.8, 6),
        (0, 0.2, 0.2, 5.8),
        (4, 0.2, 4.2, 2),
        (4, 2.9, 4.2, 5.8),
    )
    for x1, y1, x2, y2 in sides:
        house.element("IfcBuildingElementProxy", storey, (x1, y1, 0, x2, y2, 2.5), "Wall")
    house.element("IfcBuildingElementProxy", storey, (4.05, 2, 0, 4.1, 2.9, 2.1), "Door 1")
    house.element("IfcBuildingElementProxy", storey, (1, 1, 0, 3, 1.6, 2.2), "Wardrobe")
    (level,) = levels_of(house.write(tmp_path / "house.ifc"))
    assert [thing.words[0] for thing in level.furniture] == ["Wardrobe"]
    plan = plan_of(level)
    assert len(plan.rooms) == 2
    assert kinds(plan) == ["door"]


def test_a_door_without_a_body_has_its_placement_and_size(holed_flat, tmp_path):
    door = holed_flat.house.element("IfcDoor", holed_flat.storey, None, "door", OverallWidth=0.8, OverallHeight=2.0)
    holed_flat.house.turned(door, (4.15, 2.0, 0.0), (0.0, 1.0))
    assert holed_flat.bounds(tmp_path) == [(4.0, 2.0, 4.2, 2.8, True)]


def test_a_door_in_a_curtain_wall_is_one(holed_flat, tmp_path):
    curtain = holed_flat.house.element("IfcCurtainWall", holed_flat.storey, None, "curtain")
    plates = [(4.2, 3, 0, 6, 3.06, 2.5), (6.9, 3, 0, 7.8, 3.06, 2.5), (6, 3, 2.1, 6.9, 3.06, 2.5)]
    parts = [holed_flat.house.element("IfcPlate", None, plate) for plate in plates]
    door = holed_flat.house.element("IfcDoor", None, (6, 3.01, 0, 6.9, 3.05, 2.1), "door")
    holed_flat.house.part_of(curtain, *parts, door)
    (found,) = holed_flat.bounds(tmp_path)
    assert found[0::2] == (6.0, 6.9, True)
    assert found[1] <= 3.0
    assert found[3] >= 3.06


def test_a_door_in_a_part_of_a_wall_is_one(holed_flat, tmp_path):
    whole = holed_flat.house.element("IfcWall", holed_flat.storey, None, "whole")
    part = holed_flat.house.element("IfcBuildingElementPart", None, (4.2, 3, 0, 7.8, 3.2, 2.5), "part")
    holed_flat.house.part_of(whole, part)
    holed_flat.house.opening(part, (5, 3, 0, 5.9, 3.2, 2.1), "IfcDoor")
    assert holed_flat.bounds(tmp_path) == [(5.0, 3.0, 5.9, 3.2, True)]


def test_a_hatch_in_a_floor_and_a_low_flap_are_no_doors(holed_flat, tmp_path):
    holed_flat.house.element("IfcDoor", holed_flat.storey, (1, 1, -0.1, 2, 2, 0.0), "hatch")
    holed_flat.house.element("IfcDoor", holed_flat.storey, (4.05, 2, 0, 4.1, 2.6, 0.6), "flap")
    assert holed_flat.bounds(tmp_path) == []


def test_a_door_belongs_to_the_level_that_it_is_entered_from(holed_flat, tmp_path):
    house = holed_flat.house
    upper = house.storey("OG", 2.8)
    walls = house.walls_around(upper, (0, 0, 2.8, 8, 6, 5.3))
    house.opening(walls[0], (1, 0, 2.8, 2, 0.2, 4.9), "IfcDoor")
    house.element("IfcDoor", upper, (4.05, 2, 0, 4.1, 2.9, 2.1), "of the ground floor", OverallWidth=0.9)
    house.opening(holed_flat.outer[2], (5, 5.8, 0.9, 6, 6, 2.5), "IfcDoor")  # half a storey up
    ground, first = holed_flat.levels(tmp_path)
    assert [len(level.openings) for level in (ground, first)] == [2, 1]
    assert [len(level.leaves) for level in (ground, first)] == [2, 1]
    assert [leaf.words for leaf in ground.leaves] == [("of the ground floor", "IfcDoor"), ("leaf", "IfcDoor")]


def test_a_leaf_drawn_open_does_not_widen_its_door(holed_flat, tmp_path):
    holed_flat.house.element(
        "IfcDoor", holed_flat.storey, (4.05, 2, 0, 4.1, 3.2, 2.1), "door and swing", OverallWidth=0.9
    )
    assert holed_flat.bounds(tmp_path) == [(4.0, 2.15, 4.2, 3.05, True)]


def test_in_a_turned_building_openings_run_along_their_walls(holed_flat, tmp_path):
    house, turn = holed_flat.house, np.radians(30.0)
    wall = house.element("IfcWall", holed_flat.storey, (0, 0, 0, 3, 0.2, 2.5), "turned")
    direction = (float(np.cos(turn)), float(np.sin(turn)))
    house.turned(wall, (4.5, 1.0, 0.0), direction)
    house.opening(wall, (1, -0.5, 0, 1.9, 0.7, 2.1), "IfcDoor")
    for element in (*house.model.by_type("IfcOpeningElement"), *house.model.by_type("IfcDoor")):
        house.turned(element, (4.5, 1.0, 0.0), direction)
    level = holed_flat.level(tmp_path)
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
    walls = section_from_segments(MeshSlicer(level.walls).cut(height), sheet_m=0.05, solid_m=0.7).walls
    return float(walls.intersection(shapely.box(*plan)).area / shapely.box(*plan).area)


@pytest.mark.parametrize("deeper", [0.0, 0.3])
@pytest.mark.parametrize("filling", ["IfcWindow", None])
def test_a_window_up_to_the_ceiling_is_wall_as_deep_as_its_wall(holed_flat, tmp_path, filling, deeper):
    x1, y1, z1, x2, y2, z2 = WINDOW
    holed_flat.house.opening(holed_flat.outer[0], (x1, y1 - deeper, z1, x2, y2 + deeper, z2), filling)
    level = holed_flat.level(tmp_path)
    assert standing(level, (1, 0, 2, 0.2), 2.0) == pytest.approx(1.0, abs=0.01)
    assert standing(level, (1, 0.21, 2, 0.7), 2.0) == 0.0
    assert not level.openings


def test_a_way_through_a_wall_is_not_closed(holed_flat, tmp_path):
    holed_flat.house.opening(holed_flat.inner, (4, 2, 0, 4.2, 2.9, 2.5), None)
    level = holed_flat.level(tmp_path)
    assert standing(level, (4, 2.01, 4.2, 2.89), 2.0) == 0.0


def test_a_niche_over_a_table_is_not_closed(holed_flat, tmp_path):
    holed_flat.house.opening(holed_flat.inner, (4, 2, 0.9, 4.1, 2.9, 2.5), None)
    level = holed_flat.level(tmp_path)
    assert standing(level, (4, 2.01, 4.09, 2.89), 2.0) == 0.0


def test_a_window_of_the_storey_below_closes_nothing_above(holed_flat, tmp_path):
    upper = holed_flat.house.storey("OG", 2.8)
    wall, *_ = holed_flat.house.walls_around(upper, (0, 0, 2.8, 8, 6, 5.3))
    holed_flat.house.opening(wall, (1, 0, 2.8, 2, 0.2, 4.9), "IfcDoor")
    holed_flat.house.opening(holed_flat.outer[0], WINDOW, "IfcWindow")
    holed_flat.house.opening(holed_flat.inner, (4, 2, 0, 4.2, 2.9, 2.1), "IfcDoor")
    _, above = holed_flat.levels(tmp_path)
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
    (level,) = levels_of(house.write(tmp_path / "thin.ifc"))
    assert kinds(plan_of(level)) == ["entrance"]


def framed(house: TinyBuilding, storey: Any, box: Box) -> None:
    """Add a window of two posts, two glass plates and a middle post, 0.1 m deep, which stands in a southern wall."""
    x1, y1, z1, x2, y2, z2 = box
    middle, glass = (x1 + x2) / 2, (y1 + y2) / 2
    for low, high in ((x1, x1 + 0.05), (middle - 0.05, middle + 0.05), (x2 - 0.05, x2)):
        house.element("IfcWindow", storey, (low, y1, z1, high, y2, z2), "post")
    for low, high in ((x1 + 0.05, middle - 0.05), (middle + 0.05, x2 - 0.05)):
        house.element("IfcWindow", storey, (low, glass - 0.01, z1, high, glass + 0.01, z2), "glass")


def test_the_frame_of_a_window_is_no_leaf_where_the_file_has_doors(tmp_path):
    house = TinyBuilding()
    storey = house.storey("EG", 0.0)
    walls = house.walls_around(storey, (0, 0, 0, 8, 6, 3))
    house.opening(walls[0], (1, -0.1, 0, 1.9, 0.3, 2.1), "IfcDoor")
    for left in (3, 5.5):
        house.opening(walls[0], (left, -0.1, 0, left + 2, 0.3, 2.5), "IfcWindow")
        framed(house, storey, (left, 0, 0.05, left + 2, 0.1, 2.45))
    (level,) = levels_of(house.write(tmp_path / "tall.ifc"))
    assert kinds(plan_of(level)) == ["entrance"]


@pytest.mark.parametrize("kind", ["IfcDoor", "IfcWindow"])
def test_what_stands_in_a_hole_fills_it_though_the_file_does_not_say_so(holed_flat, tmp_path, kind):
    holed_flat.house.opening(holed_flat.inner, (3.9, 2, 0, 4.3, 2.9, 2.1), None)
    holed_flat.house.element(kind, holed_flat.storey, (4.08, 2, 0, 4.12, 2.9, 2.1), "filling")
    doors = [(4.0, 2.0, 4.2, 2.9, True)] if kind == "IfcDoor" else []
    assert holed_flat.bounds(tmp_path) == doors


@pytest.mark.parametrize(
    ("host", "kind"), [("IfcCovering", "IfcWindow"), ("IfcWall", "IfcWindow"), ("IfcWall", "IfcDoor")]
)
@pytest.mark.parametrize("apart", [0.0, 0.3])
def test_what_fills_the_hole_of_one_leaf_of_a_wall_fills_that_of_the_other(holed_flat, tmp_path, host, kind, apart):
    house, storey = holed_flat.house, holed_flat.storey
    house.opening(holed_flat.outer[0], (1, -0.1, 0, 2.5, 0.3, 2.2), None)
    leaf = house.element(host, storey, (0, -0.2 - apart, 0, 8, -apart, 2.5), "outer leaf")
    house.opening(leaf, (1, -0.3 - apart, 0, 2.5, 0.1 - apart, 2.2), kind)
    holes = [opening for level in holed_flat.levels(tmp_path) for opening in level.openings]
    bare = [each for each in holes if each.polygon.intersects(shapely.box(1.2, 0.05, 2.3, 0.15)) and not each.has_door]
    assert len(bare) == (1 if apart else 0)


def test_a_door_beside_a_notch_does_not_fill_it(holed_flat, tmp_path):
    holed_flat.house.opening(holed_flat.inner, (3.95, 2, 0, 4.25, 2.9, 2.1), None)
    holed_flat.house.element("IfcDoor", holed_flat.storey, (4, 2, 0, 4.2, 2.9, 2.1), "as deep as the wall")
    holed_flat.house.opening(holed_flat.inner, (4, 2.92, 0, 4.2, 3.04, 2.1), None)
    assert holed_flat.bounds(tmp_path) == [(4.0, 2.0, 4.2, 2.9, True)]


def test_a_window_in_the_next_hole_fills_only_that_one(holed_flat, tmp_path):
    holed_flat.house.opening(holed_flat.inner, (3.9, 2, 0, 4.3, 2.9, 2.1), None)
    holed_flat.house.opening(holed_flat.inner, (3.9, 3.5, 0, 4.3, 4.4, 2.1), None)
    holed_flat.house.element("IfcWindow", holed_flat.storey, (4.08, 3.5, 0, 4.12, 4.4, 2.1), "window")
    assert holed_flat.bounds(tmp_path) == [(4.0, 2.0, 4.2, 2.9, False)]


@pytest.mark.parametrize(
    ("name", "height", "doors"),
    [
        ("Porte-fenêtre battante", 2.1, 1),
        ("Porte pleine", 2.1, 1),
        ("Balkontür", 2.1, 1),
        ("Fenster", 2.1, 0),
        ("Balkontür", 1.2, 0),
        ("Fenêtre coulissante triple", 2.1, 1),
        ("Sliding window", 1.2, 0),
    ],
)
def test_a_window_as_high_as_a_door_and_called_so_is_one(holed_flat, tmp_path, name, height, doors):
    window = holed_flat.house.opening(holed_flat.outer[0], (1, 0, 0, 2, 0.2, height), "IfcWindow")
    window.Name = name
    assert [each[-1] for each in holed_flat.bounds(tmp_path)] == [True] * doors
    level = holed_flat.level(tmp_path)
    assert len(level.leaves) == doors


def test_a_corner_window_closes_the_walls_and_not_the_room(holed_flat, tmp_path):
    for wall in (holed_flat.outer[0], holed_flat.outer[3]):
        holed_flat.house.opening(wall, (-0.5, -0.5, 0.4, 3, 2.5, 2.0), "IfcWindow")
    level = holed_flat.level(tmp_path)
    assert standing(level, (0.3, 0.01, 2.9, 0.19), 1.5) == pytest.approx(1.0, abs=0.01)
    assert standing(level, (0.01, 0.3, 0.19, 2.4), 1.5) == pytest.approx(1.0, abs=0.01)
    assert standing(level, (0.3, 0.3, 2.9, 2.4), 1.5) < 0.05  # the window itself, across the corner


# What stands as wall in tiny IFC storeys, and what is told apart: each rule with an element that it leaves alone.


LOOSE = ("IfcPlate", "IfcMember", "IfcBuildingElementProxy")
HERE = (2, 2, 0, 3, 2.1, 2.4)
"""A thin upright box in the middle of the room."""


@pytest.fixture
def room():
    return Flat(inner=False)


@pytest.mark.parametrize(
    "kind", ["IfcColumn", "IfcChimney", "IfcWindow", "IfcPlate", "IfcMember", "IfcBuildingElementProxy"]
)
def test_what_stands_upright_from_the_floor_to_head_height_is_wall(room, tmp_path, kind):
    room.house.element(kind, room.storey, HERE, "thing")
    assert room.stands(tmp_path)


@pytest.mark.parametrize("kind", LOOSE)
@pytest.mark.parametrize("box", [(2, 2, 0, 3, 2.1, 1.2), (2, 2, 0, 4, 4, 2.4), (2, 2, 2.0, 3, 2.1, 2.4)])
def test_what_is_low_or_thick_or_hangs_is_none(room, tmp_path, kind, box):
    room.house.element(kind, room.storey, box, "thing")
    assert not room.stands(tmp_path, height=(box[2] + box[5]) / 2)


@pytest.mark.parametrize("name", ["M_RPC Tree - Deciduous", "Baum", "Model Text", "car"])
def test_plants_texts_and_cars_are_no_walls(room, tmp_path, name):
    room.house.element("IfcBuildingElementProxy", room.storey, HERE, name)
    assert not room.stands(tmp_path)


def test_a_window_closes_its_hole(room, tmp_path):
    room.house.opening(room.outer[0], (2, 0, 0, 5, 0.2, 2.3), "IfcWindow")
    assert room.stands(tmp_path, (3, 0, 4, 0.2))


def test_a_window_in_a_roof_does_not_stand(room, tmp_path):
    roof = room.house.element("IfcSlab", room.storey, (0, 0, 2.5, 8, 6, 2.7), "roof", PredefinedType="ROOF")
    window = room.house.opening(roof, (2, 2, 1.0, 3, 3, 2.7), "IfcWindow")
    assert window.is_a("IfcWindow")
    assert not room.stands(tmp_path, height=1.5)


@pytest.mark.parametrize(("kind", "stands"), [("CLADDING", True), (None, True), ("ROOFING", False)])
def test_a_window_in_the_covering_of_a_wall_stands(room, tmp_path, kind, stands):
    leaf = room.house.element("IfcCovering", room.storey, (2, 2, 0, 5, 2.2, 2.5), "leaf", PredefinedType=kind)
    room.house.opening(leaf, (3, 2, 0.2, 4, 2.2, 2.3), "IfcWindow")
    assert room.stands(tmp_path, (3.2, 2, 3.8, 2.2)) == stands


def test_a_wall_without_a_body_is_its_parts(room, tmp_path):
    whole = room.house.element("IfcWall", room.storey, None, "whole")
    stud = room.house.element("IfcMember", None, (2, 2, 0, 2.1, 2.1, 1.0), "stud")
    room.house.part_of(whole, stud)
    assert room.stands(tmp_path, height=0.5)


def test_parts_of_a_slab_are_no_walls(room, tmp_path):
    slab = room.house.element("IfcSlab", room.storey, None, "slab")
    room.house.part_of(slab, room.house.element("IfcBuildingElementPart", None, HERE, "block"))
    assert not room.stands(tmp_path)


def test_a_curtain_wall_stands_with_its_low_members_too(room, tmp_path):
    curtain = room.house.element("IfcCurtainWall", room.storey, None, "curtain")
    room.house.part_of(curtain, room.house.element("IfcMember", None, (2, 2, 0, 5, 2.1, 0.5), "sill"))
    assert room.stands(tmp_path, height=0.3)


@pytest.mark.parametrize("kind", ["IfcFurniture", "IfcSanitaryTerminal", "IfcStairFlight", "IfcRailing"])
def test_furniture_stairs_and_railings_are_things_with_their_words(room, tmp_path, kind):
    room.house.element(kind, room.storey, HERE, "Thing 7", ObjectType="a thing")
    level = room.level(tmp_path)
    assert not room.stands(tmp_path)
    (thing,) = level.furniture
    assert thing.words == ("Thing 7", "a thing", kind)
    assert np.ptp(thing.mesh.vertices, axis=0) == pytest.approx((1.0, 0.1, 2.4))
    assert level.n_objects == 1


def test_coverings_and_ramps_are_left_out(room, tmp_path):
    for kind in ("IfcCovering", "IfcRamp", "IfcFooting"):
        room.house.element(kind, room.storey, HERE, "thing")
    assert not room.stands(tmp_path)
    assert room.level(tmp_path).furniture == ()


def test_a_leaf_is_no_wall(room, tmp_path):
    room.house.opening(room.outer[0], (2, 0, 0, 3, 0.2, 2.1), "IfcDoor")
    assert not room.stands(tmp_path, (2.1, 0, 2.9, 0.2))
    (leaf,) = room.level(tmp_path).leaves
    assert leaf.words == ("leaf", "IfcDoor")


# Screens of showers, and courts.


@pytest.mark.parametrize(
    ("box", "is_screen"),
    [
        ((5.8, 0.2, 0, 5.82, 5.8, 2.1), True),
        ((5.8, 0.2, 0, 5.82, 5.8, 2.5), False),  # up to the ceiling: a partition
        ((5.8, 0.2, 0, 5.92, 5.8, 2.1), False),  # as thick as a wall
        ((5.8, 0.2, 0.31, 5.82, 5.8, 2.1), False),  # off the floor: a partition of toilets
        ((2.0, 0.2, 0, 2.02, 5.8, 2.1), False),  # in no room of the file
    ],
)
def test_a_low_sheet_in_a_room_is_a_screen_and_no_wall(tmp_path, box, is_screen):
    house = Flat()
    house.house.space(house.storey, RIGHT, "2", "Bad")
    house.house.element("IfcWall", house.storey, box, "screen")
    level = house.level(tmp_path)
    assert ["screen" in thing.words for thing in level.furniture] == [True] * is_screen
    assert len(plan_of(level).rooms) == (2 if is_screen else 3)


class Atrium:
    """A ring of four rooms with doors between them around a place of 6 x 6 m, with a door to it."""

    def __init__(self) -> None:
        self.house = TinyBuilding()
        self.storey = self.house.storey("EG", 0.0)
        self.house.walls_around(self.storey, (0, 0, 0, 10, 10, 2.8))
        south, *_ = self.house.walls_around(self.storey, (1.8, 1.8, 0, 8.2, 8.2, 2.8))
        self.house.opening(south, (4, 1.7, 0, 5, 2.1, 2.1), "IfcDoor")
        for x1, y1, x2, y2 in ((0.2, 1.8, 1.8, 2.0), (8, 0.2, 8.2, 1.8), (8.2, 8, 9.8, 8.2), (1.8, 8.2, 2, 9.8)):
            wall = self.house.element("IfcWall", self.storey, (x1, y1, 0, x2, y2, 2.8), "inner")
            x, y = (x1 + x2) / 2, (y1 + y2) / 2
            self.house.opening(wall, (x - 0.45, y - 0.45, 0, x + 0.45, y + 0.45, 2.1), "IfcDoor")

    def slabs(self, kind: str, bottom: float, top: float) -> None:
        for x1, y1, x2, y2 in ((0, 0, 10, 2), (0, 8, 10, 10), (0, 2, 2, 8), (8, 2, 10, 8)):
            self.house.element(kind, self.storey, (x1, y1, bottom, x2, y2, top), kind)

    def areas(self, folder: Path) -> list[float]:
        (level,) = levels_of(self.house.write(folder / "ring.ifc"))
        return sorted(round(room.area) for room in plan_of(level).rooms)


@pytest.mark.parametrize("roof", ["IfcSlab", "IfcRoof"])
@pytest.mark.parametrize("floored", [True, False])
def test_a_court_under_the_open_sky_is_no_room(tmp_path, roof, floored):
    ring = Atrium()
    ring.slabs(roof, 2.8, 3.0)
    if floored:
        ring.slabs("IfcSlab", -0.2, 0.0)
    assert len(ring.areas(tmp_path)) == 4


@pytest.mark.parametrize("roof", ["IfcSlab", "IfcPlate", None])
def test_a_hall_under_a_roof_of_its_own_is_a_room(tmp_path, roof):
    ring = Atrium()
    ring.slabs("IfcSlab", 2.8, 3.0)
    if roof:
        ring.house.element(roof, ring.storey, (2, 2, 5.0, 8, 8, 5.1), "skylight")
    else:
        ring.house.space(ring.storey, (2, 2, 0, 8, 8, 2.8), "5", "Atrium")
    assert len(ring.areas(tmp_path)) == 5


# Beams over rooms.

UNDER_BEAM, BESIDE = (0.2, 0.2, 0, 2.8, 7.8, 2.6), (3, 0.2, 0, 6.8, 7.8, 2.6)


@pytest.mark.parametrize(
    ("spaces", "rooms"),
    [
        ([UNDER_BEAM, BESIDE], 2),
        ([(0.2, 0.2, 0, 2.8, 4, 2.6), (0.2, 4.2, 0, 2.8, 7.8, 2.6), BESIDE], 3),
        ([], 3),
        ([(0.2, 0.2, 0, 6.8, 7.8, 2.6)], 3),  # the floor of the storey, as meshes name it
    ],
)
@pytest.mark.parametrize("nib_m", [0.2, 1.7])
def test_a_beam_over_one_room_of_the_file_parts_nothing_a_lintel_does(tmp_path, spaces, rooms, nib_m):
    house = TinyBuilding()
    storey = house.storey("EG", 0.0)
    house.walls_around(storey, (0, 0, 0, 3, 8, 2.6))
    house.walls_around(storey, (2.8, 0, 0, 7, 8, 2.6))
    house.element("IfcWall", storey, (0.2, 4, 0, 0.2 + nib_m, 4.2, 2.6), "nib")
    house.element("IfcBeam", storey, (0.2 + nib_m, 4, 2.2, 2.8, 4.2, 2.6), "beam")
    for number, box in enumerate(spaces):
        house.space(storey, box, str(number), "Flur")
    (level,) = levels_of(house.write(tmp_path / "beam.ifc"))
    assert len(plan_of(level).rooms) == (rooms if nib_m < 1 or len(spaces) != 2 else 3)


@pytest.mark.parametrize(("doors", "joists", "entrances"), [(False, True, 0), (False, False, 4), (True, True, 5)])
def test_the_beams_of_a_floor_on_posts_are_no_lintels(tmp_path, doors, joists, entrances):
    """Posts stand along the front of a room, with a beam over them; three beams hang over the room."""
    house = TinyBuilding()
    storey = house.storey("1F", 0.0)
    for x1, y1, x2, y2 in ((0, 0, 0.2, 5.8), (7.8, 0, 8, 5.8), (0, 5.8, 8, 6)):
        wall = house.element("IfcWall", storey, (x1, y1, 0, x2, y2, 2.5), "wall")
    for x in (2, 4, 6):
        house.element("IfcColumn", storey, (x - 0.1, 0, 0, x + 0.1, 0.2, 2.5), "post")
    house.element("IfcBeam", storey, (0.2, 0, 2.2, 7.8, 0.2, 2.5), "beam")
    for x in (2, 4, 6) if joists else ():
        house.element("IfcBeam", storey, (x + 0.9, 0.4, 2.2, x + 1, 5.7, 2.5), "joist")
    if doors:
        house.opening(wall, (6, 5.7, 0, 7, 6.1, 2.1), "IfcDoor")
    house.space(storey, (0.2, 0.2, 0, 7.8, 5.8, 2.5), "1", "Room")
    (level,) = levels_of(house.write(tmp_path / "frame.ifc"))
    found = plan_of(level)
    assert len(found.rooms) == 1
    assert [door.kind for door in found.doors] == ["entrance"] * entrances


@pytest.mark.parametrize("said", ["class", "property", None])
def test_an_external_space_is_outside(flat, tmp_path, said):
    wall = next(each for each in flat.house.model.by_type("IfcWall") if each.Name == "inner")
    flat.house.opening(wall, (3.9, 2, 0, 4.3, 3, 2.1), "IfcDoor")
    terrace = flat.house.space(flat.storey, RIGHT, "2", "Terrasse")
    if said == "class":
        terrace.PredefinedType = "EXTERNAL"
    elif said == "property":
        flat.house.property_of(terrace, "Pset_SpaceCommon", IsExternal=True)
    level = flat.level(tmp_path)
    found = plan_of(level)
    assert len(level.rooms) == len(found.rooms) == (1 if said else 2)
    assert [door.kind for door in found.doors] == ["entrance" if said else "door"]


def test_an_external_space_around_the_house_says_nothing_of_its_rooms(flat, tmp_path):
    flat.house.space(flat.storey, (-5, -5, 0, 15, 15, 9), "0", "Site", PredefinedType="EXTERNAL")
    level = flat.level(tmp_path)
    assert level.outdoors is None
    assert len(plan_of(level).rooms) == 2


def test_a_door_in_a_wall_that_ends_in_the_air_parts_the_two_spaces_that_the_file_draws(tmp_path):
    house = TinyBuilding()
    storey = house.storey("EG", 0.0)
    house.walls_around(storey, (0, 0, 0, 8, 6, 2.5))
    stub = house.element("IfcWall", storey, (4, 0.2, 0, 4.2, 1.5, 2.5), "stub")
    house.opening(stub, (4, 0.4, 0, 4.2, 1.25, 2.1), "IfcDoor")
    house.space(storey, (0.2, 0.2, 0, 4.05, 1.5, 2.4), "1", "Storage")
    house.space(storey, (0.2, 0.2, 0, 7.8, 5.8, 2.4), "2", "Hall")
    (level,) = levels_of(house.write(tmp_path / "stairs.ifc"))
    found = plan_of(level)
    assert sorted(round(room.area) for room in found.rooms) == [5, 37]
    (door,) = found.doors
    assert (door.kind, door.width, sorted(door.rooms)) == ("door", pytest.approx(0.85, abs=0.02), [0, 1])


@pytest.mark.parametrize(("sill", "found"), [(0.0, ["entrance"]), (0.9, [])])
def test_a_window_that_is_called_a_door_is_one_where_one_can_walk_out(tmp_path, sill, found):
    house = TinyBuilding()
    storey = house.storey("EG", 0.0)
    walls = house.walls_around(storey, (0, 0, 0, 8, 6, 3.0))
    house.space(storey, (0.2, 0.2, 0, 7.8, 5.8, 3.0), "1", "Studio")
    house.opening(walls[0], (3, 0, sill, 4, 0.2, sill + 1.95), "IfcWindow").Name = "Fenstertür"
    (level,) = levels_of(house.write(tmp_path / "flat.ifc"))
    assert kinds(plan_of(level)) == found
