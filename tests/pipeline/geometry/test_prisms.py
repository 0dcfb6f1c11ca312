"""Upright walls: their sections are those of their triangles, which are made only when somebody asks for them."""

import pytest
import shapely
from shapely import box

from pipeline.geometry.mesh_slicing import MeshSlicer
from pipeline.geometry.meshes import Mesh
from pipeline.geometry.prisms import Prism, Prisms
from pipeline.geometry.wall_sections import WallSections

SHEET_M, SOLID_M, FOOT_M = 0.05, 0.7, 0.1
OUTLINE = box(0, 0, 8, 6).difference(shapely.union_all([box(0.3, 0.3, 4, 5.7), box(4.2, 0.3, 7.7, 5.7)]))
DOOR = box(4, 2, 4.2, 3)
AROUND = OUTLINE.difference(DOOR)


def sections(walls: Prisms | MeshSlicer) -> WallSections:
    return WallSections(walls, SHEET_M, SOLID_M, FOOT_M)


def same(one: shapely.Geometry, other: shapely.Geometry) -> bool:
    """Whether two areas differ by less than the grid on which corners of a mesh are one."""
    return bool(one.symmetric_difference(other).buffer(-2e-4).is_empty)


HOUSES = {
    "a door": [Prism(AROUND, 0.0, 2.6), Prism(OUTLINE.intersection(DOOR), 2.1, 2.6)],
    "a parapet": [Prism(AROUND, 0.0, 2.6), Prism(box(2, 0.3, 2.1, 5.7), 0.0, 0.9)],
    "a shaft that nobody enters": [Prism(OUTLINE, 0.0, 2.6), Prism(box(7.2, 0.3, 7.3, 5.7), 0.0, 2.6)],
    "a closet, thinner than a wall is thick": [Prism(OUTLINE, 0.0, 2.6), Prism(box(7.0, 0.3, 7.1, 5.7), 0.0, 2.6)],
    "a wall like a sheet": [Prism(OUTLINE, 0.0, 2.6), Prism(box(2, 0.3, 2.02, 5.7), 0.0, 2.6)],
    "a chimney in a room": [Prism(OUTLINE, 0.0, 2.6), Prism(box(1.5, 2, 2.5, 3), 0.0, 2.6)],
    "a chimney that hangs": [Prism(OUTLINE, 0.0, 2.6), Prism(box(1.5, 2, 2.5, 3), 1.8, 2.6)],
    "a court with a pavilion": [
        Prism(OUTLINE, 0.0, 2.6),
        Prism(box(1, 1, 3, 3).difference(box(1.2, 1.2, 2.8, 2.8)), 0, 2),
    ],
    "walls that only touch": [Prism(box(0, 0, 4, 0.2), 0.0, 2.6), Prism(box(4, 0, 8, 0.2), 0.0, 2.4)],
    "nothing": [],
}


@pytest.mark.parametrize("house", HOUSES)
@pytest.mark.parametrize("height", [0.2, 0.5, 1.2, 1.9, 2.3, 2.5, 3.0])
def test_sections_are_those_of_the_triangles(house: str, height: float) -> None:
    walls = Prisms(HOUSES[house])
    drawn, cut = sections(walls), sections(MeshSlicer(walls))
    assert same(drawn.at(height), cut.at(height))
    assert same(drawn.foot, cut.foot)
    assert same(drawn.closets, cut.closets)


def test_heights_between_which_nothing_begins_or_ends_have_one_section() -> None:
    found = sections(Prisms(HOUSES["a door"]))
    assert found.at(0.2) is found.at(1.9)
    assert found.at(0.2) is not found.at(2.3)
    assert len(found._layers) == 2


def test_what_is_upright_between_two_heights() -> None:
    walls = Prisms(HOUSES["a door"])
    cutter = MeshSlicer(Mesh(walls.vertices, walls.faces))
    for low, high in ((0.1, 2.0), (0.1, 2.2), (2.2, 2.5), (2.2, 2.6), (-0.1, 0.1)):
        assert walls.is_upright_between(low, high) == cutter.is_upright_between(low, high)


def test_a_lintel_begins_and_nothing_ends_over_a_door() -> None:
    walls = Prisms(HOUSES["a door"])
    assert not walls.is_upright_between(0.5, 2.4)
    assert not walls.may_end_between(0.5, 2.4)
    assert Prisms([*walls.bodies, Prism(box(1, 1, 2, 2), 0.0, 1.0)]).may_end_between(0.5, 2.4)


def test_what_has_no_height_or_no_area_is_no_body() -> None:
    walls = Prisms([Prism(OUTLINE, 1.0, 1.0), Prism(shapely.Polygon(), 0.0, 1.0), Prism(box(0, 0, 1e-4, 1e-4), 0, 1)])
    assert walls.is_empty
    assert not walls.is_cloud
    assert not len(walls.faces)
