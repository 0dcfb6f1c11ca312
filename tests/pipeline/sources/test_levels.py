import numpy as np
import pytest
import trimesh

from pipeline.rejection import Reason, Rejection
from pipeline.sources.storeys.levels import FoundLevel, find_levels
from tests.builders.level_meshes import HOUSE, INNER, SHELL, WALLS, found
from tests.builders.meshes import joined, one_level, sheet, slab, storey, table, two_levels, walls_alone


def roof(eaves: float, ridge: float) -> list[trimesh.Trimesh]:
    """Two slopes with their ridge along x, and a gable of two faces at each end."""
    gables = [
        trimesh.Trimesh([(x, 0, eaves), (x, 6, eaves), (x, 3, ridge)], [[0, 1, 2]], process=False)
        for x in (0.0, 0.2, 7.8, 8.0)
    ]
    corners = [(0, 0, eaves), (8, 0, eaves), (8, 3, ridge), (0, 3, ridge), (0, 6, eaves), (8, 6, eaves)]
    return [*gables, trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3], [4, 5, 2], [4, 2, 3]], process=False)]


def lowest(level: FoundLevel) -> float:
    return float(level.walls.vertices[:, 2].min())


def test_slab_and_table_are_one_level():
    (level,) = find_levels(one_level())
    assert (level.floor_z, level.ceiling_m) == pytest.approx((0.0, 2.5))
    assert level.floor is not None
    assert level.floor.area == pytest.approx(39.0, abs=0.01)
    assert lowest(level) == pytest.approx(-0.2)


def test_walls_alone_stand_on_their_feet():
    (level,) = find_levels(walls_alone())
    assert (level.floor_z, level.ceiling_m, level.floor) == (0.0, pytest.approx(2.5), None)


def test_each_level_has_its_own_walls():
    ground, upper = find_levels(two_levels())
    assert (ground.floor_z, upper.floor_z) == pytest.approx((0.0, 2.8))
    assert ground.walls.vertices[:, 2].max() == pytest.approx(2.5)
    assert lowest(upper) == pytest.approx(-0.3)
    assert upper.ceiling_m == pytest.approx(2.45)


def test_furniture_is_no_level():
    tables = [table(0.5 + 2.5 * i, 1.0 + 2.0 * j, 0.0) for i in range(3) for j in range(2)]
    assert found(storey(0.0, 3.0, WALLS), slab(-0.2, 0.0, [HOUSE]), tables) == [(0.0, 3.0)]


def test_table_tops_in_a_house_without_floor_are_none():
    tables = [table(0.5 + 2.5 * i, 1.0, 0.0) for i in range(2)]
    assert found(storey(0.0, 3.0, WALLS), tables) == [(0.0, 3.0)]


def test_a_covering_lifts_the_floor():
    covered = slab(0.0, 0.02, [(0.2, 0.2, 4.0, 5.8), (4.2, 0.2, 7.8, 5.8)])
    assert found(storey(0.0, 2.5, WALLS), slab(-0.2, 0.0, [HOUSE]), covered) == [(0.02, 2.48)]


def test_a_foundation_is_no_level():
    below = (*slab(-1.5, -1.2, [HOUSE]), *storey(-1.2, -0.3, WALLS))
    assert found(list(below), slab(-0.3, 0.0, [HOUSE]), storey(0.0, 2.5, WALLS)) == [(0.0, 2.5)]


def test_a_cellar_is_a_level():
    below = [*slab(-2.9, -2.6, [HOUSE]), *storey(-2.6, -0.3, WALLS)]
    assert found(below, slab(-0.3, 0.0, [HOUSE]), storey(0.0, 2.5, WALLS)) == [(-2.6, 2.25), (0.0, 2.5)]


def test_ground_around_the_house_is_no_level():
    site = slab(-0.5, -0.3, [(-30.0, -30.0, 40.0, 40.0)])
    assert found(site, slab(-0.3, 0.0, [HOUSE]), storey(0.0, 2.5, WALLS)) == [(0.0, 2.5)]


@pytest.mark.parametrize("knee", [0.0, 1.2])
def test_an_attic_without_tall_walls_is_no_level(knee):
    house = [*slab(-0.3, 0.0, [HOUSE]), *storey(0.0, 2.5, WALLS), *slab(2.5, 2.8, [HOUSE])]
    walls = storey(2.8, 2.8 + knee, SHELL) if knee else []
    assert found(house, walls, roof(2.8 + knee, 5.8 + knee)) == [(0.0, 2.45)]


def test_an_attic_with_tall_walls_is_a_level():
    house = [*slab(-0.3, 0.0, [HOUSE]), *storey(0.0, 2.5, WALLS), *slab(2.5, 2.8, [HOUSE])]
    levels = found(house, storey(2.8, 5.0, SHELL), roof(5.0, 7.0))
    assert [floor for floor, _ in levels] == [0.0, 2.8]


def test_the_head_of_a_stair_on_a_roof_is_no_level():
    head = storey(2.8, 5.0, ((0, 0, 2, 0.2), (1.8, 0, 2, 2.5), (0, 2.3, 2, 2.5), (0, 0, 0.2, 2.5)))
    house = [*slab(-0.3, 0.0, [HOUSE]), *storey(0.0, 2.5, WALLS), *slab(2.5, 2.8, [HOUSE])]
    assert found(house, storey(2.8, 3.8, SHELL), head) == [(0.0, 2.45)]


def test_split_levels_are_two():
    left = [*slab(-0.3, 0.0, [(0, 0, 4, 6)]), *storey(0, 2.8, ((0, 0, 4, 0.2), (0, 0, 0.2, 6), (0, 5.8, 4, 6)))]
    right = [*slab(1.1, 1.4, [(4, 0, 8, 6)]), *storey(1.4, 4.2, ((4, 0, 8, 0.2), (7.8, 0, 8, 6), (4, 5.8, 8, 6)))]
    levels = found(left, right, storey(0.0, 4.2, [INNER]))
    assert [floor for floor, _ in levels] == [0.0, 1.4]
    assert levels[1][1] == pytest.approx(2.8)


def test_walls_that_run_through_two_storeys_belong_to_both():
    gallery = slab(2.5, 2.8, [(0.0, 0.0, 4.0, 6.0)])
    mesh = joined([*slab(-0.3, 0.0, [HOUSE]), *storey(0.0, 5.3, WALLS), *gallery, *slab(5.3, 5.6, [HOUSE])])
    ground, upper = find_levels(mesh)
    assert (ground.floor_z, upper.floor_z) == pytest.approx((0.0, 2.8))
    assert upper.floor is not None
    assert upper.floor.area == pytest.approx(24.0)
    for level in (ground, upper):
        assert np.ptp(level.walls.vertices[:, 0]) == pytest.approx(8.0)


def test_a_hung_ceiling_does_not_end_the_walls():
    hung = slab(2.5, 2.52, [(0.2, 0.2, 4.0, 5.8), (4.2, 0.2, 7.8, 5.8)])
    below = [*slab(-0.3, 0.0, [HOUSE]), *storey(0.0, 3.0, WALLS), *hung]
    assert found(below) == [(0.0, 3.0)]
    assert found(below, slab(3.0, 3.3, [HOUSE]), storey(3.3, 6.0, WALLS)) == [(0.0, 2.95), (3.3, 2.7)]


def test_a_ceiling_hung_far_below_the_walls_tops_does_not_end_them():
    hung = slab(2.5, 2.52, [(0.2, 0.2, 4.0, 5.8), (4.2, 0.2, 7.8, 5.8)])
    assert found(slab(-0.3, 0.0, [HOUSE]), storey(0.0, 4.2, WALLS), hung) == [(0.0, 4.2)]


def test_a_slab_between_walls_of_which_the_inner_end_under_it_closes_them():
    ceiling = slab(2.5, 2.7, [(0.2, 0.2, 7.8, 5.8)])
    assert found(slab(-0.3, 0.0, [HOUSE]), storey(0.0, 4.2, SHELL), storey(0.0, 2.5, [INNER]), ceiling) == [(0.0, 2.45)]


def test_an_upper_slab_over_walls_without_a_floor():
    assert found(storey(0.0, 2.5, WALLS), slab(2.5, 2.8, [HOUSE]), storey(2.8, 5.3, WALLS)) == [(0.0, 2.45), (2.8, 2.5)]


@pytest.mark.parametrize("sides", [SHELL[:3], SHELL[:2], SHELL[::2]])
def test_an_open_house_is_a_level(sides):
    assert found(slab(-0.3, 0.0, [HOUSE]), storey(0.0, 2.5, sides)) == [(0.0, 2.5)]


def test_sheets_and_floors_wound_downwards():
    corners = [(0.0, 0.0), (8.0, 0.0), (8.0, 6.0), (0.0, 6.0)]
    walls = [sheet(corners[i - 1], corners[i], 0.1, 2.7) for i in range(4)]
    floor = trimesh.Trimesh([(x, y, 0.1) for x, y in corners], [[0, 2, 1], [0, 3, 2]], process=False)
    assert found(walls, [floor]) == [(0.1, 2.6)]


@pytest.mark.slow
def test_a_finely_divided_house_has_the_same_levels():
    mesh = two_levels()
    vertices, faces = trimesh.remesh.subdivide_to_size(mesh.vertices, mesh.faces, 0.15)
    fine = find_levels(type(mesh)(vertices, faces))
    assert len(faces) > 50_000
    for level, same in zip(fine, find_levels(mesh), strict=True):
        assert (level.floor_z, level.ceiling_m) == pytest.approx((same.floor_z, same.ceiling_m), abs=1e-6)
        assert level.floor is not None
        assert level.floor.area == pytest.approx(39.0, rel=0.05)


def test_no_wall_of_a_persons_height_is_no_level():
    with pytest.raises(Rejection) as caught:
        find_levels(joined([*slab(-0.2, 0.0, [HOUSE]), *storey(0.0, 1.2, WALLS)]))
    assert caught.value.reason is Reason.NO_LEVEL
