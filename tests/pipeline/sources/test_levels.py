"""Find the levels of a house: heights, floors, ceilings, split levels."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import trimesh
from shapely import Polygon

from pipeline.rejection import Reason, Rejection
from pipeline.sources import mesh_file
from pipeline.sources.storeys.levels import FoundLevel, find_levels, other_floors
from pipeline.values import Input, Level
from tests.builders.meshes import (
    HOUSE,
    INNER,
    L_FLOOR,
    SHELL,
    WALLS,
    Rectangle,
    as_trimesh,
    box,
    found,
    joined,
    one_level,
    sheet,
    slab,
    storey,
    table,
    two_levels,
    walls_alone,
)


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


def test_a_floor_that_was_not_taken_may_be_one_if_walls_stand_on_it():
    assert other_floors(two_levels(), [0.0, 2.8]) == []
    assert other_floors(two_levels(), [0.0]) == [2.8]
    assert other_floors(one_level(), [0.0]) == []  # neither the table nor the ceiling


def test_a_flat_roof_beside_a_higher_building_is_no_floor():
    hall = [(12, 0, 32, 0.2), (12, 10, 32, 10.2), (12, 0, 12.2, 10), (32, 0, 32.2, 10)]
    low = [*slab(-0.3, 0.0), *storey(0.0, 2.5), *slab(2.5, 2.8)]
    assert other_floors(joined([*low, *storey(0.0, 6.0, hall)]), [0.0]) == []


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


@pytest.mark.parametrize("rise", [0.95, 1.4])
def test_split_levels_are_two(rise: float) -> None:
    top = rise + 2.8
    left = [*slab(-0.3, 0.0, [(0, 0, 4, 6)]), *storey(0, 2.8, ((0, 0, 4, 0.2), (0, 0, 0.2, 6), (0, 5.8, 4, 6)))]
    far = ((4, 0, 8, 0.2), (7.8, 0, 8, 6), (4, 5.8, 8, 6))
    right = [*slab(rise - 0.3, rise, [(4, 0, 8, 6)]), *storey(rise, top, far)]
    ceilings = [*slab(2.8, 3.1, [(0, 0, 4, 6)]), *slab(top, top + 0.3, [(4, 0, 8, 6)])]
    levels = found(left, right, storey(0.0, top, [INNER]), ceilings)
    assert [floor for floor, _ in levels] == [0.0, rise]
    assert levels[1][1] == pytest.approx(2.75)


@pytest.mark.parametrize(("rise", "start", "floors"), [(0.95, 5.0, [0.0]), (0.95, 3.0, [0.95]), (1.4, 5.0, [0.0, 1.4])])
def test_a_raised_part_of_a_hall_is_no_level_of_its_own(rise: float, start: float, floors: list[float]) -> None:
    """It lies under the hall's ceiling, and one cut through the walls shows both parts; the larger gives the height."""
    hall = [*slab(-0.3, 0.0, [HOUSE]), *slab(0.0, rise, [(start, 0, 8, 6)]), *storey(0.0, 3.6, SHELL)]
    levels = find_levels(joined([*hall, *slab(3.6, 3.9, [HOUSE])]))
    assert [level.floor_z for level in levels] == pytest.approx(floors)
    if len(floors) == 1:
        assert levels[0].floor is not None
        assert levels[0].floor.area == pytest.approx(48.0, abs=0.5)


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


# What is a floor of a level, and what only looks like one.


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


def test_a_floor_in_two_steps_over_a_foundation_is_one():
    halves = [*slab(-0.2, 0.0, [(0, 0, 3, 6)]), *slab(0.0, 0.25, [(5, 0, 8, 6)])]
    ((floor, _),) = found(storey(-0.7, 2.7, WALLS), halves)
    assert floor in (0.0, 0.25)


def test_a_platform_beside_a_floor_that_is_wound_downwards_does_not_replace_it():
    corners = [(0, 0, 0), (8, 0, 0), (8, 6, 0), (0, 6, 0)]
    down = trimesh.Trimesh(corners, [[0, 2, 1], [0, 3, 2]], process=False)
    top = [(8.2, 0, 0.15), (11, 0, 0.15), (11, 6, 0.15), (8.2, 6, 0.15)]
    platform = trimesh.Trimesh(top, [[0, 1, 2], [0, 2, 3]], process=False)
    wing = ((8.2, 0, 11, 0.2), (8.2, 5.8, 11, 6), (10.8, 0, 11, 6))
    (level,) = find_levels(joined([*storey(0.0, 2.7, [*WALLS, *wing]), down, platform]))
    assert level.floor_z == pytest.approx(0.0)
    assert level.floor is not None
    assert level.floor.area == pytest.approx(48.0 + 16.8, abs=0.5)


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


def test_furniture_on_the_lower_floor_does_not_hide_the_level_below():
    cupboards = box((5.0, 4.9, 8.0, 5.8), 0.0, 1.4)
    gallery = slab(2.5, 2.8, [(0.0, 0.0, 5.0, 6.0)])
    _, upper = find_levels(joined([*LOWER, cupboards, *gallery, *storey(2.8, 5.3, WALLS)]))
    assert upper.below is not None
    assert upper.below.contains(Polygon.from_bounds(5.2, 0.4, 7.6, 5.6))


def test_under_a_hole_in_the_lowest_floor_no_level_shows():
    (level,) = find_levels(joined(UPPER))
    assert level.below is None


DATA = Path(__file__).resolve().parents[4] / "shared" / "data"
CASES = [
    path for path in sorted((DATA / "cases").glob("*.json")) if '.ifc",' not in path.read_text().split('"mesh"')[1][:80]
]
INCHES = {"osrf_cafe"}  # its truth counts in the file's inches
COVERED = {"smiley_west_0", "smiley_west_0_leaves"}  # the truth counts from the storey, the floor lies 0.18 m above it
FLOORS = {truth["mesh"]: truth["floor_z"] for truth in (json.loads(path.read_text()) for path in CASES)}
ONE_LEVEL = ("ifc/*/*.ply", "sweethome3d/*/*.ply", "procthor/*/*.ply", "gazebo/*/*.ply")
MESHES = sorted(path for pattern in ONE_LEVEL for path in DATA.glob(pattern))


def levels_of(path: Path) -> list[Level]:
    return list(mesh_file.read(Input("case", "mesh_file", str(path))))


@pytest.mark.skipif(not CASES, reason="needs the development data beside the repository")
@pytest.mark.parametrize("case", CASES, ids=lambda path: path.stem)
def test_a_level_lies_at_the_cases_floor(case):
    truth = json.loads(case.read_text())
    levels = levels_of(DATA / truth["mesh"])
    floor = truth["floor_z"] * (0.0254 if case.stem in INCHES else 1.0)
    assert min(abs(level.frame.floor - floor) for level in levels) < (0.2 if case.stem in COVERED else 0.05)


@pytest.mark.skipif(not CASES, reason="needs the development data beside the repository")
@pytest.mark.parametrize("path", MESHES, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_each_mesh_is_one_level_as_high_as_a_storey(path):
    (level,) = levels_of(path)
    raised = 0.2 if "smiley" in path.parent.name else 0.05
    assert abs(level.frame.floor - FLOORS.get(path.relative_to(DATA).as_posix(), 0.0)) < raised
    assert 2.3 < level.ceiling_m < 5.1
    assert (level.provenance["units"], level.frame.up) == ("m", "z")


# A split level: the halves of a house have floors of their own, half a storey apart, none of which covers the plan.


SLAB_M, CLEAR_M, HALF_M = 0.2, 2.7, 1.45
LEFT: Rectangle = (0.0, 0.0, 5.0, 8.0)
RIGHT: Rectangle = (5.0, 0.0, 10.0, 8.0)


def half(plan: Rectangle, low: float, storeys: int) -> list:
    x1, y1, x2, y2 = plan
    rim = ((x1, y1, x2, y1 + 0.2), (x1, y2 - 0.2, x2, y2), (x1, y1, x1 + 0.2, y2), (x2 - 0.2, y1, x2, y2))
    floors = [low + k * (CLEAR_M + SLAB_M) for k in range(storeys)]
    walls = [box(wall, floor, floor + CLEAR_M) for floor in floors for wall in rim]
    return walls + [box(plan, floor - SLAB_M, floor) for floor in [*floors, floors[-1] + CLEAR_M + SLAB_M]]


def levels_of_split(parts: list, path: Path) -> list[Level]:
    mesh = as_trimesh(joined(parts))
    mesh.apply_transform(np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1.0]]))
    mesh.export(path)
    return list(mesh_file.read(next(mesh_file.find(str(path)))))


def test_a_split_level_stands_upright_in_metres(tmp_path: Path) -> None:
    found = levels_of_split(half(LEFT, 0.0, 2) + half(RIGHT, HALF_M, 2), tmp_path / "split.glb")
    assert {level.provenance["units"] for level in found} == {"m"}
    assert [level.frame.floor for level in found] == pytest.approx([0.0, 1.45, 2.9, 4.35], abs=1e-3)
    assert not any(level.guesses for level in found)


def test_a_low_wing_leaves_the_storeys_of_the_house_alone(tmp_path: Path) -> None:
    found = levels_of_split(half(LEFT, 0.0, 2) + half(RIGHT, 0.0, 1), tmp_path / "wing.glb")
    assert {level.provenance["units"] for level in found} == {"m"}
    assert [level.frame.floor for level in found] == pytest.approx([0.0, 2.9], abs=1e-3)


# Where a level ends that has more than a slab over it.


EAVES = [(-0.5, -0.5, 8.5, -0.4), (-0.5, 6.4, 8.5, 6.5), (-0.5, -0.4, -0.4, 6.4), (8.4, -0.4, 8.5, 6.4)]


def test_a_slab_on_which_a_roofs_edge_stands_closes_the_level() -> None:
    """The edge is higher than a slab's tolerance and lower than an attic's walls."""
    edge = [box(side, 2.8, 3.2) for side in EAVES]
    (level,) = find_levels(joined([*slab(-0.2, 0.0), *storey(0.0, 2.5), *slab(2.5, 2.8), *edge]))
    assert level.ceiling_m == pytest.approx(2.45)


def test_a_hung_ceiling_through_which_the_walls_run_closes_nothing() -> None:
    tiles = slab(2.3, 2.32, L_FLOOR)
    (level,) = find_levels(joined([*slab(-0.2, 0.0), *storey(0.0, 2.7), *tiles]))
    assert level.ceiling_m == pytest.approx(2.7, abs=0.06)


def test_the_low_ceilings_of_some_rooms_close_no_level() -> None:
    """Rooms of sheets 2.3 m high, and one of 2.7 m that stands beside them."""
    low, high = (0.0, 0.0, 10.0, 6.0), (10.0, 0.0, 12.5, 4.0)
    rooms = [sheet((x, 0.0), (x, 6.0), 0.0, 2.3) for x in (3.0, 6.0)]
    for (x1, y1, x2, y2), top in ((low, 2.3), (high, 2.7)):
        corners = [(x1, y1), (x2, y1), (x2, y2), (x1, y2), (x1, y1)]
        rooms += [sheet(a, b, 0.0, top) for a, b in pairwise(corners)] + [box((x1, y1, x2, y2), top, top + 0.01)]
    (level,) = find_levels(joined([*slab(-0.2, 0.0, [low, high]), *rooms]))
    assert level.ceiling_m == pytest.approx(2.7, abs=0.06)
