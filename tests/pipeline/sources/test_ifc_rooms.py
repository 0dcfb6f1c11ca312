"""Rooms from the spaces of tiny IFC storeys: each rule with spaces that it must leave alone."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("ifcopenshell")

from pipeline.sources import ifc
from pipeline.sources.ifc_spaces import floor_of
from pipeline.values import Mesh, SourceRoom
from tests.builders.ifc import TinyBuilding

LEFT, RIGHT = (0.2, 0.2, 0, 4, 5.8, 2.5), (4.2, 0.2, 0, 7.8, 5.8, 2.5)


class Flat:
    def __init__(self) -> None:
        self.house = TinyBuilding()
        self.storey = self.house.storey("EG", 0.0)
        self.house.walls_around(self.storey, (0, 0, 0, 8, 6, 2.5))
        self.house.element("IfcWall", self.storey, (4, 0.2, 0, 4.2, 5.8, 2.5), "inner")

    def rooms(self, folder: Path) -> tuple[SourceRoom, ...]:
        (level,) = [x for item in ifc.find(str(self.house.write(folder / "flat.ifc"))) for x in ifc.read(item)]
        return level.rooms

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
    assert floor_of(leaning(inwards)).bounds == pytest.approx((0.0, 0.0, 4.0, 3.0), abs=1e-6)
    assert floor_of(leaning(inwards)).area == pytest.approx(12.0, abs=1e-4)


def test_a_room_of_many_slivers_is_one_piece():
    xs = np.cumsum(np.full(40, 0.1)) + np.tile([0.0, 1e-7], 20)
    vertices = np.array([(x, y, z) for x in xs for y in (0.0, 3.0) for z in (0.0, 2.5)])
    floor = [(4 * i, 4 * i + 4, 4 * i + 2) for i in range(39)] + [(4 * i + 2, 4 * i + 4, 4 * i + 6) for i in range(39)]
    shape = floor_of(Mesh(vertices, np.array(floor, np.int64)))
    assert shape.area == pytest.approx(3.9 * 3.0, abs=1e-3)
