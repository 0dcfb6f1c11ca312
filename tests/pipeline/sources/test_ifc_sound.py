"""Damaged products are left out before native code follows them; whole ones are not."""

import pytest

pytest.importorskip("ifcopenshell")

from pipeline.sources.ifc_model import Soundness
from tests.builders.ifc import TinyBuilding, tiny_house


@pytest.fixture
def wall():
    house = TinyBuilding()
    return house, house.element("IfcWall", house.storey("EG", 0.0), (0, 0, 0, 4, 0.2, 2.5), "wall")


def test_every_product_of_a_whole_building_is_sound():
    house, sound = tiny_house(), Soundness()
    assert all(sound.of(product) for product in house.model.by_type("IfcElement"))


def test_a_placement_in_a_circle_is_not(wall):
    _, element = wall
    element.ObjectPlacement.PlacementRelTo = element.ObjectPlacement
    assert not Soundness().of(element)


def test_parts_that_hold_each_other_are_not(wall):
    house, element = wall
    other = house.element("IfcWall", None, (0, 0, 0, 4, 0.2, 2.5), "other")
    loose = house.element("IfcWall", None, (0, 0, 0, 4, 0.2, 2.5), "loose")
    house.part_of(other, loose)
    assert Soundness().of(loose)
    house.part_of(loose, other)
    assert not Soundness().of(loose)
    assert Soundness().of(element)


def test_a_wall_with_a_damaged_opening_is_not(wall):
    house, element = wall
    house.opening(element, (1, 0, 0, 2, 0.2, 2.1), None)
    assert Soundness().of(element)
    opening = house.model.by_type("IfcOpeningElement")[0]
    opening.ObjectPlacement.PlacementRelTo = opening.ObjectPlacement
    assert not Soundness().of(element)
