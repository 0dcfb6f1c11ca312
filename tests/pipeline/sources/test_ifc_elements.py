"""What stands as wall in tiny IFC storeys, and what is told apart: each rule with an element that it leaves alone."""

import numpy as np
import pytest
import shapely

pytest.importorskip("ifcopenshell")

from pipeline.sources import ifc
from pipeline.sources.storeys.surfaces import Surfaces, cut_at_height
from pipeline.values import Level
from tests.builders.ifc import TinyBuilding

LOOSE = ("IfcPlate", "IfcMember", "IfcBuildingElementProxy")
HERE = (2, 2, 0, 3, 2.1, 2.4)
"""A thin upright box in the middle of the room."""


class Room:
    def __init__(self) -> None:
        self.house = TinyBuilding()
        self.storey = self.house.storey("EG", 0.0)
        self.outer = self.house.walls_around(self.storey, (0, 0, 0, 8, 6, 2.5))

    def level(self, folder) -> Level:
        (level,) = [x for item in ifc.find(str(self.house.write(folder / "room.ifc"))) for x in ifc.read(item)]
        return level

    def stands(self, folder, box=(1, 1, 7, 5), height=1.0) -> bool:
        """Whether a wall stands in a part of the plan at a height."""
        walls = Surfaces.of(self.level(folder).walls)
        lines = shapely.union_all(shapely.linestrings(cut_at_height(walls, walls.walls(), height)))
        return bool(lines.intersects(shapely.box(*box)))


@pytest.fixture
def room():
    return Room()


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
