"""What is a floor of a level, and what only looks like one."""

import numpy as np
import pytest
import trimesh
from shapely import Polygon

from pipeline.sources.storeys.levels import find_levels
from tests.builders.level_meshes import HOUSE, SHELL, WALLS, found
from tests.builders.meshes import box, joined, slab, storey


def heads(height: float, count: int) -> list[trimesh.Trimesh]:
    """Tops of door recesses, a metre deep, at one height over a house of walls of 4 m without a floor."""
    return [box((0.5 + 1.6 * i, 2.0, 1.9 + 1.6 * i, 3.0), height - 0.01, height) for i in range(count)]


def test_door_heads_in_a_house_without_a_floor_are_none():
    office = [(0.0, 0.0, 40.0, 0.2), (39.8, 0.0, 40.0, 12.0), (0.0, 11.8, 40.0, 12.0), (0.0, 0.0, 0.2, 12.0)]
    rooms = [(4.0 * i, 0.0, 4.0 * i + 0.1, 12.0) for i in range(1, 10)]
    assert found(storey(0.0, 4.2, [*office, *rooms]), heads(2.13, 9)) == [(0.0, 4.2)]


def test_a_landing_over_a_floor_is_no_storey():
    landing = slab(1.9, 2.0, [(0.2, 0.2, 3.0, 2.5)])
    below = [*slab(-0.2, 0.0, [HOUSE]), *storey(0.0, 5.0, WALLS)]
    assert [floor for floor, _ in found(below, landing)] == [0.0]


def test_what_is_called_ceiling_is_no_floor():
    mesh = joined([*slab(-0.2, 0.0, [HOUSE]), *storey(0.0, 5.3, WALLS), *slab(2.5, 2.8, [HOUSE])])
    upper = mesh.vertices[mesh.faces][:, :, 2].min(axis=1) >= 2.5
    upper &= np.ptp(mesh.vertices[mesh.faces][:, :, 2], axis=1) < 0.31
    none = np.zeros(len(mesh.faces), bool)
    assert [level.floor_z for level in find_levels(mesh, none, none)] == pytest.approx([0.0, 2.8])
    assert [level.floor_z for level in find_levels(mesh, none, upper)] == pytest.approx([0.0])


def test_what_is_called_floor_is_its_area():
    mesh = joined(
        [*slab(-0.2, 0.0, [(0.2, 0.2, 4.0, 5.8)]), *slab(-0.2, 0.0, [(4.2, 0.2, 7.8, 5.8)]), *storey(0.0, 2.5, WALLS)]
    )
    called = np.zeros(len(mesh.faces), bool)
    called[:12] = True
    (level,) = find_levels(mesh, called)
    assert level.floor is not None
    assert level.floor.area == pytest.approx(3.8 * 5.6)


def test_the_underside_of_a_thin_slab_is_no_part_of_the_floor():
    wide = (-1.0, -1.0, 9.0, 7.0)  # under an overhang of a metre
    tops = trimesh.Trimesh([(0, 0, 0.2), (8, 0, 0.2), (8, 6, 0.2), (0, 6, 0.2)], [[0, 1, 2], [0, 2, 3]], process=False)
    under = trimesh.Trimesh([(-1, -1, 0), (9, -1, 0), (9, 7, 0), (-1, 7, 0)], [[0, 2, 1], [0, 3, 2]], process=False)
    porch = storey(0.0, 2.7, [(wide[0], wide[1], wide[2], -0.9), (wide[0], 6.9, wide[2], wide[3])])
    (level,) = find_levels(joined([*storey(0.2, 2.7, WALLS), *porch, tops, under]))
    assert level.floor is not None
    assert level.floor.area == pytest.approx(48.0)


def test_ground_at_the_floors_height_is_no_floor_outside():
    plain = trimesh.Trimesh(
        [(-50, -50, 0), (50, -50, 0), (50, 50, 0), (-50, 50, 0)], [[0, 1, 2], [0, 2, 3]], process=False
    )
    (level,) = find_levels(joined([*storey(0.0, 2.5, WALLS), plain]))
    assert level.floor is not None
    assert level.floor.area < 1.5 * 48.0


def test_tops_of_beds_in_a_house_without_a_floor_are_none():
    beds = [box((0.4 + 4 * i, 0.4, 3.4 + 4 * i, 3.4), 0.2, 0.5) for i in range(2)]
    assert found(storey(0.0, 2.5, WALLS), beds) == [(0.0, 2.5)]


def test_a_floor_over_a_foundation_is_one_even_so():
    assert found(storey(-0.6, 2.5, WALLS), slab(-0.3, 0.0, [HOUSE])) == [(0.0, 2.5)]


def test_ground_under_the_foot_of_the_walls_gives_area_but_no_height():
    corners = [(-3, -3, -0.25), (11, -3, -0.25), (11, 9, -0.25), (-3, 9, -0.25)]
    plain = trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], process=False)
    (level,) = find_levels(joined([*storey(0.0, 2.5, WALLS), plain]))
    assert level.floor_z == pytest.approx(0.0)
    assert level.floor is not None


def test_walls_that_stand_on_the_floor_with_wide_openings_keep_its_height():
    posts = [(x, y, x + 0.3, y + 0.2) for x in (0.0, 2.0, 4.0, 6.0, 7.7) for y in (0.0, 5.8)]
    walls = [*storey(0.0, 2.7, posts), *storey(0.9, 2.7, [SHELL[0], SHELL[2]]), *storey(0.0, 2.7, [SHELL[1], SHELL[3]])]
    assert found(walls, slab(-0.2, 0.0, [HOUSE]))[0][0] == 0.0


LOWER = [*slab(-0.3, 0.0, [HOUSE]), *storey(0.0, 2.5, WALLS)]
WELL = (5.0, 1.0, 7.0, 4.0)
AROUND = [(0.0, 0.0, 5.0, 6.0), (7.0, 0.0, 8.0, 6.0), (5.0, 0.0, 7.0, 1.0), (5.0, 4.0, 7.0, 6.0)]
UPPER = [*slab(2.5, 2.8, AROUND), *storey(2.8, 5.3, WALLS)]


def test_through_a_hole_in_the_floor_the_level_below_shows():
    ground, upper = find_levels(joined([*LOWER, *UPPER]))
    assert ground.below is None
    assert upper.below is not None
    assert upper.below.symmetric_difference(Polygon.from_bounds(*WELL)).area < 1.0


@pytest.mark.parametrize(("bottom", "top"), [(2.2, 2.4), (2.45, 2.5)], ids=["a step down", "the ceiling of the level"])
def test_what_lies_under_a_hole_within_reach_hides_the_level_below(bottom, top):
    _, upper = find_levels(joined([*LOWER, *UPPER, *slab(bottom, top, [WELL])]))
    assert upper.below is None


def test_under_a_hole_in_the_lowest_floor_no_level_shows():
    (level,) = find_levels(joined(UPPER))
    assert level.below is None
