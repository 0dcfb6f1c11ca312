"""Which storeys of tiny IFC buildings are levels, at which height: each rule with a house that it leaves alone."""

import pytest

pytest.importorskip("ifcopenshell")

from pipeline.rejection import Reason, Rejection
from pipeline.sources import ifc
from tests.builders.ifc import TinyBuilding


class Tower:
    """A ground floor with a room and a door; what the tests put on it."""

    def __init__(self) -> None:
        self.house = TinyBuilding()
        self.ground = self.house.storey("EG", 0.0)
        self.walls = self.house.walls_around(self.ground, (0, 0, 0, 8, 6, 2.5))
        self.room = self.house.space(self.ground, (0.2, 0.2, 0, 7.8, 5.8, 2.5), "1", "Wohnen")
        self.house.opening(self.walls[0], (1, 0, 0, 2, 0.2, 2.1), "IfcDoor")

    def floors(self, folder):
        path = self.house.write(folder / "tower.ifc")
        levels = [level for item in ifc.find(str(path)) for level in ifc.read(item)]
        return [round(level.frame.floor, 2) for level in levels]


@pytest.fixture
def tower():
    return Tower()


def test_a_roof_terrace_without_a_door_is_no_level(tower, tmp_path):
    roof = tower.house.storey("Dach", 2.8)
    tower.house.walls_around(roof, (0, 0, 2.8, 8, 6, 4.8))
    assert tower.floors(tmp_path) == [0.0]


def test_a_storey_that_a_door_leads_to_is_one(tower, tmp_path):
    upper = tower.house.storey("OG", 2.8)
    walls = tower.house.walls_around(upper, (0, 0, 2.8, 8, 6, 5.3))
    tower.house.opening(walls[0], (1, 0, 2.8, 2, 0.2, 4.9), "IfcDoor")
    assert tower.floors(tmp_path) == [0.0, 2.8]


def test_where_nothing_names_rooms_or_doors_walls_make_the_level(tmp_path):
    house = TinyBuilding()
    for name, z in (("EG", 0.0), ("OG", 2.8)):
        house.walls_around(house.storey(name, z), (0, 0, z, 8, 6, z + 2.5))
    levels = list(ifc.read(next(ifc.find(str(house.write(tmp_path / "walls.ifc"))))))
    assert [level.frame.floor for level in levels] == [0.0, 2.8]


@pytest.mark.parametrize(("height", "size", "floors"), [(2.5, 8, [0.0, 2.8]), (2.0, 8, [0.0]), (2.5, 3, [0.0])])
def test_a_storey_is_one_whose_rooms_are_not_drawn_yet(tmp_path, height, size, floors):
    """Of a file without doors; a terrace behind screens of 2 m, and the head of a lift, are none."""
    house = TinyBuilding()
    ground, upper = house.storey("EG", 0.0), house.storey("OG", 2.8)
    house.walls_around(ground, (0, 0, 0, 8, 6, 2.5))
    house.space(ground, (0.2, 0.2, 0, 7.8, 5.8, 2.5), "1", "Wohnen")
    house.walls_around(upper, (0, 0, 2.8, size, size * 0.75, 2.8 + height))
    levels = ifc.read(next(ifc.find(str(house.write(tmp_path / "begun.ifc")))))
    assert [level.frame.floor for level in levels] == floors


def test_an_attic_with_a_room_is_a_level_although_its_walls_stop_early(tower, tmp_path):
    attic = tower.house.storey("DG", 2.8)
    tower.house.walls_around(attic, (0, 0, 2.8, 8, 6, 3.8))
    tower.house.space(attic, (0.2, 0.2, 2.8, 7.8, 5.8, 5.2), "2", "Studio")
    assert tower.floors(tmp_path) == [0.0, 2.8]


def test_a_void_under_the_roof_is_none_although_it_has_a_space(tower, tmp_path):
    attic = tower.house.storey("Spitzboden", 2.8)
    tower.house.walls_around(attic, (0, 0, 2.8, 8, 6, 3.8))
    tower.house.space(attic, (0.2, 0.2, 2.8, 7.8, 5.8, 4.2), "2", "Spitzboden")
    assert tower.floors(tmp_path) == [0.0]


@pytest.mark.parametrize("kind", ["EXTERNAL", "GFA"])
def test_a_space_that_is_outside_or_an_area_makes_no_level(tower, tmp_path, kind):
    roof = tower.house.storey("Dach", 2.8)
    tower.house.walls_around(roof, (0, 0, 2.8, 8, 6, 4.8))
    tower.house.space(roof, (0.2, 0.2, 2.8, 7.8, 5.8, 4.8), "2", "Fläche", PredefinedType=kind)
    assert tower.floors(tmp_path) == [0.0]


def test_the_floor_is_where_doors_and_rooms_are_not_the_raw_slab(tower, tmp_path):
    upper = tower.house.storey("OG", 2.8)
    walls = tower.house.walls_around(upper, (0, 0, 2.8, 8, 6, 5.5))
    tower.house.opening(walls[0], (1, 0, 3.0, 2, 0.2, 5.1), "IfcDoor")
    tower.house.space(upper, (0.2, 0.2, 3.0, 7.8, 5.8, 5.5), "2", "Schlafen")
    assert tower.floors(tmp_path) == [0.0, 3.0]


def test_one_door_above_a_step_does_not_move_the_floor(tower, tmp_path):
    tower.house.opening(tower.walls[2], (1, 5.8, 0.2, 2, 6, 2.3), "IfcDoor")
    assert tower.floors(tmp_path) == [0.0]


def test_storeys_of_two_buildings_do_not_cut_each_other_short(tower, tmp_path):
    house = tower.house
    other = house.add_building("second")
    lower = house.storey("EG 2", 1.4, other)
    walls = house.walls_around(lower, (20, 0, 1.4, 28, 6, 3.9))
    house.space(lower, (20.2, 0.2, 1.4, 27.8, 5.8, 3.9), "1", "Wohnen")
    house.opening(walls[0], (21, 0, 1.4, 22, 0.2, 3.5), "IfcDoor")
    first, second = ifc.read(next(ifc.find(str(house.write(tmp_path / "two.ifc")))))
    assert (first.frame.floor, second.frame.floor) == (0.0, 1.4)
    assert (first.ceiling_m, second.ceiling_m) == pytest.approx((2.5, 2.5))
    assert first.walls.vertices[:, 0].max() == pytest.approx(8.0)
    assert second.walls.vertices[:, 0].min() == pytest.approx(20.0)


def test_a_building_of_parapets_and_no_room_has_no_level(tmp_path):
    house = TinyBuilding()
    house.walls_around(house.storey("EG", 0.0), (0, 0, 0, 8, 6, 1.1))
    with pytest.raises(Rejection) as caught:
        list(ifc.read(next(ifc.find(str(house.write(tmp_path / "parapets.ifc"))))))
    assert caught.value.reason is Reason.NO_LEVEL


class Unsorted:
    """Two storeys of two rooms, each with a door, whose elements stand in a building or nowhere."""

    def __init__(self, place: str, floor: float = 0.0) -> None:
        self.house = TinyBuilding()
        self.storeys = [self.house.storey("EG", 0.0)] if place == "one storey" else []
        self.place = self.house.building if place == "building" else None
        for k, names in enumerate((("Küche", "Wohnen"), ("Bad", "Schlafen"))):
            self.add_storey(floor + 2.8 * k, names)

    def add_storey(self, z: float, names: tuple[str, str]) -> None:
        walls = self.house.walls_around(self.place, (0, 0, z - 0.2, 8, 6, z + 2.5))
        self.house.opening(walls[0], (1, 0, z, 2, 0.2, z + 2.1), "IfcDoor")
        inner = self.house.element("IfcWall", self.place, (4, 0.2, z, 4.2, 5.8, z + 2.5), "inner")
        self.house.opening(inner, (4, 2, z, 4.2, 2.9, z + 2.1), "IfcDoor")
        self.house.element("IfcSlab", self.place, (0, 0, z - 0.3, 8, 6, z), "slab")
        for x, name in zip((0.2, 4.2), names, strict=True):
            self.house.space(self.place, (x, 0.2, z, x + 3.6, 5.8, z + 2.5), "1", name)


@pytest.mark.parametrize("place", ["building", "nowhere", "one storey"])
def test_what_stands_in_no_storey_gets_those_of_its_heights(tmp_path, place):
    path = Unsorted(place).house.write(tmp_path / "unsorted.ifc")
    levels = list(ifc.read(next(ifc.find(str(path)))))
    assert [level.frame.floor for level in levels] == pytest.approx([0.0, 2.8])
    assert [[room.words[0] for room in level.rooms] for level in levels] == [["Küche", "Wohnen"], ["Bad", "Schlafen"]]
    assert [[opening.has_door for opening in level.openings] for level in levels] == [[True, True]] * 2
    made = [level.provenance["storey"] for level in levels]
    assert made == ["EG" if place == "one storey" else "at 0.00 m", "at 2.80 m"]
    assert [level.guesses for level in levels] == [() if name == "EG" else ("levels",) for name in made]


def test_without_spaces_the_feet_of_walls_give_the_storeys(tmp_path):
    house = TinyBuilding()
    for z in (0.0, 2.8):
        house.walls_around(house.building, (0, 0, z, 8, 6, z + 2.5))
        house.element("IfcSlab", house.building, (0, 0, z - 0.3, 8, 6, z), "slab")
    levels = list(ifc.read(next(ifc.find(str(house.write(tmp_path / "walls.ifc"))))))
    assert [level.frame.floor for level in levels] == pytest.approx([0.0, 2.8])


def test_a_stray_wall_of_a_sorted_house_makes_no_storey(tower, tmp_path):
    tower.house.element("IfcWall", None, (9, 0, -0.3, 9.2, 6, 2.0), "garden wall")
    tower.house.element("IfcWall", None, (0, 0, 2.8, 8, 0.2, 3.8), "parapet")
    assert tower.floors(tmp_path) == [0.0]


def test_two_buildings_without_storeys_keep_their_floors(tmp_path):
    house = TinyBuilding()
    other = house.add_building("Annex")
    for building, x, z in ((house.building, 0.0, 0.0), (other, 20.0, 1.2)):
        house.walls_around(building, (x, 0, z, x + 8, 6, z + 2.5))
        house.space(building, (x + 0.2, 0.2, z, x + 7.8, 5.8, z + 2.5), "1", "Wohnen")
    levels = list(ifc.read(next(ifc.find(str(house.write(tmp_path / "two.ifc"))))))
    assert [level.frame.floor for level in levels] == pytest.approx([0.0, 1.2])
    assert [len(level.rooms) for level in levels] == [1, 1]
