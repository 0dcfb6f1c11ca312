"""Walls of IFC files that are not drawn as walls, are damaged, or are in another unit than the file says."""

from pathlib import Path

import ifcopenshell.guid
import pytest

pytest.importorskip("ifcopenshell")

from pipeline.rejection import Reason, Rejection
from pipeline.values import Level
from tests.builders.formats.ifc import Box, TinyBuilding
from tests.builders.houses import levels_of, plan_of

DOORWAY: Box = (4, 2, 2.1, 4.2, 2.9, 2.6)
WALLS: list[Box] = [
    (0, 0, 0, 8, 0.2, 2.6),
    (7.8, 0.2, 0, 8, 6, 2.6),
    (0, 5.8, 0, 7.8, 6, 2.6),
    (0, 0.2, 0, 0.2, 5.8, 2.6),
    (4, 0.2, 0, 4.2, 2, 2.6),
    (4, 2.9, 0, 4.2, 5.8, 2.6),
    DOORWAY,
]
"""Two rooms with a doorway between them."""


class House:
    """The two rooms, to be built."""

    def __init__(self, folder: Path) -> None:
        self.file = TinyBuilding()
        self.storey = self.file.storey("EG", 0.0)
        self._path = folder / "house.ifc"

    def build(self, kind: str, name: str = "", factor: float = 1.0) -> list[object]:
        """Add all walls as elements of a class."""
        boxes = [tuple(length * factor for length in box) for box in WALLS]
        return [self.file.element(kind, self.storey, box, name) for box in boxes]

    def levels(self) -> list[Level]:
        """Write the file and read it."""
        return levels_of(self.file.write(self._path))

    def check(self) -> Level:
        """Assert that the file gives the two rooms and the doorway; return the level."""
        (level,) = self.levels()
        plan = plan_of(level)
        assert (len(plan.rooms), len(plan.doors)) == (2, 1)
        assert sum(room.area for room in plan.rooms) == pytest.approx(3.8 * 5.6 + 3.6 * 5.6, rel=0.02)
        return level


@pytest.fixture
def house(tmp_path):
    return House(tmp_path)


def test_proxies_are_the_walls_beside_a_garden_wall(house):
    house.build("IfcBuildingElementProxy")
    house.file.element("IfcWall", house.storey, (-5, -5, -0.5, 15, -4.8, 0.8), "garden")
    house.check()


def test_proxies_are_the_walls_where_one_part_of_them_is_a_wall(house):
    house.build("IfcBuildingElementProxy")
    house.file.element("IfcWall", house.storey, DOORWAY)
    house.check()


def test_logs_are_the_walls_where_there_are_no_others(house):
    for x1, y1, z1, x2, y2, z2 in WALLS:
        for course in range(round(z1 / 0.2), round(z2 / 0.2)):
            low = max(0.2 * course, z1)
            house.file.element("IfcBeam", house.storey, (x1, y1, low, x2, y2, 0.2 * course + 0.2))
    house.check()


@pytest.mark.parametrize("kind", ["IfcSlab", "IfcBeam", "IfcCovering", "IfcFooting", "IfcFurnishingElement"])
def test_what_is_called_a_wall_is_one_in_a_file_without_walls(house, kind):
    house.build(kind, "Wall 200 mm")
    house.check()


def test_a_wall_with_an_axis_and_no_body_is_its_parts(house):
    model = house.file.model
    for box in WALLS:
        wall = house.file.element("IfcWall", house.storey, None)
        line = model.createIfcPolyline([model.createIfcCartesianPoint((x, 0.0)) for x in (0.0, 1.0)])
        axis = model.createIfcShapeRepresentation(house.file.context, "Axis", "Curve2D", [line])
        wall.Representation = model.createIfcProductDefinitionShape(None, None, [axis])
        house.file.part_of(wall, house.file.element("IfcBuildingElementPart", None, box))
    house.check()


def test_a_damaged_opening_costs_no_wall(house):
    for wall in house.build("IfcWall"):
        opening = house.file.model.create_entity("IfcOpeningElement", GlobalId=ifcopenshell.guid.new())
        opening.ObjectPlacement = house.file.model.createIfcLocalPlacement(None, None)
        house.file.model.createIfcRelVoidsElement(ifcopenshell.guid.new(), None, None, None, wall, opening)
    house.check()


def test_piles_do_not_move_the_floor(house):
    house.build("IfcWall")
    for k in range(30):
        house.file.element("IfcColumn", house.storey, (0.25 * k, 0, -3, 0.25 * k + 0.2, 0.2, 0))
    assert house.check().frame.floor == pytest.approx(0.0)


@pytest.mark.parametrize("factor", [1000.0, 100.0, 0.001, 1 / 0.0254])
def test_an_absurd_unit_is_corrected_and_counts_as_a_guess(house, factor):
    house.build("IfcWall", factor=factor)
    level = house.check()
    assert level.guesses == ("units",)
    assert level.provenance["units"] == f"the file's, times {1 / factor:g}"


def test_a_rejection_says_which_walls_were_found(house):
    house.file.element("IfcWall", house.storey, (0, 0, 0, 8, 0.2, 1.0))
    house.file.element("IfcWall", house.storey, (0, 1, 0, 8, 1.2, 0.9))
    with pytest.raises(Rejection, match=r"its 2 walls stand between .*, and the highest is 1\.00 m high") as caught:
        house.levels()
    assert caught.value.reason is Reason.NO_LEVEL


def test_a_plan_drawn_with_walls_of_a_metre_gets_walls_as_high_as_a_storey_and_that_is_a_guess(house):
    for x1, y1, _, x2, y2, _ in WALLS[:-1]:
        house.file.element("IfcWall", house.storey, (x1, y1, 0.0, x2, y2, 1.0))
    house.file.element("IfcSpace", house.storey, (0.2, 0.2, 2.0, 4.0, 5.8, 4.5), "Kitchen")
    (level,) = house.levels()
    assert level.guesses == ("heights",)
    assert level.walls.vertices[:, 2].min() == pytest.approx(0.0)
    assert level.ceiling_m > 2.0
    assert plan_of(level).rooms


def test_low_walls_around_high_spaces_are_raised_too(house):
    for x1, y1, _, x2, y2, _ in WALLS[:4]:
        house.file.element("IfcWall", house.storey, (x1, y1, 0.0, x2, y2, 0.35))
    house.file.element("IfcWall", house.storey, (4.08, 0.2, 0.0, 4.12, 4.8, 0.35))  # no screen below a ceiling
    house.file.element("IfcSpace", house.storey, (0.2, 0.2, 0.0, 4.0, 5.8, 4.0), "Room")
    house.file.element("IfcSpace", house.storey, (4.2, 0.2, 0.0, 7.8, 5.8, 4.0), "Room")
    (level,) = house.levels()
    assert level.guesses == ("heights",)
    assert not level.furniture
    assert sorted(round(room.area, 1) for room in plan_of(level).rooms) == pytest.approx([20.6, 21.7], abs=0.2)


def test_walls_that_stand_in_the_slab_over_a_storey_part_no_room_of_it(house):
    upper = house.file.storey("OG", 3.0)
    around: list[Box] = [(0, 0, 0, 10, 0.2, 3), (9.8, 0, 0, 10, 8, 3), (0, 8, 0, 10, 8.2, 3), (-0.2, 0, 0, 0, 8, 3)]
    for z, storey in ((0.0, house.storey), (3.0, upper)):
        house.file.element("IfcSlab", storey, (0, 0, z, 10, 8, z + 0.2))
        for x1, y1, _, x2, y2, _ in around:
            house.file.element("IfcWall", storey, (x1, y1, z, x2, y2, z + 3.0))
    house.file.element("IfcWall", house.storey, (0, 5, 0, 10, 5.15, 3))
    for x1, y1, x2, y2 in ((3.2, 0, 3.35, 8), (6.5, 0, 6.65, 8), (2.35, 6, 2.5, 8), (0, 6, 2.5, 6.15)):
        house.file.element("IfcWall", upper, (x1, y1, 3, x2, y2, 6))
    ground, above = house.levels()
    assert sorted(round(room.area) for room in plan_of(ground).rooms) == [28, 47]
    assert sorted(round(room.area) for room in plan_of(above).rooms) == [4, 20, 25, 25]


def test_a_hole_that_a_wall_is_drawn_with_is_an_opening_beside_doors_that_are_named(house):
    walls = house.build("IfcWall")
    house.file.opening(walls[0], (1, 0, 0, 1.9, 0.2, 2.1), "IfcDoor")
    (level,) = house.levels()
    assert level.named_openings
    found = plan_of(level)
    assert [(door.kind, door.width) for door in found.doors] == [
        ("opening", pytest.approx(0.9, abs=0.02)),
        ("entrance", pytest.approx(0.9, abs=0.02)),
    ]
    assert len(found.rooms) == 2
