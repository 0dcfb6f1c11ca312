"""Plans of the kit of kinds agree with the truth of their houses."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import shapely
import trimesh

from houseexpo.floorplan import FloorPlan
from pipeline.config import EvidenceConfig
from pipeline.geometry.leaves import find_leaves
from pipeline.geometry.meshes import Bodies
from pipeline.sources.meshes.formats import FrameConvention
from pipeline.sources.storeys.axis_and_unit import SizeOptions, find_axis_and_unit
from pipeline.stages.evidence import gather_evidence
from pipeline.values import Mesh
from tests.builders.houses import (
    CEILING,
    HEAD,
    Hole,
    Parts,
    gap,
    kinds,
    level,
    plan_of,
    sheet_wall,
    shell,
    two_rooms,
    wall,
    window,
)
from tests.builders.meshes import box, joined, turned

DOOR = Hole(1.0, 1.9)


def in_courses(
    solids: shapely.Geometry, doorways: shapely.Geometry, bands: tuple[float, ...] = (0.0, HEAD, CEILING)
) -> Parts:
    """Extrude a plan course by course, as one body each: the doorways are open in all but the last."""
    parts: Parts = []
    for low, high in pairwise(bands):
        shape = solids.difference(doorways) if high < CEILING else solids
        for piece in shapely.get_parts(shape):
            body = trimesh.creation.extrude_polygon(piece, high - low)
            body.apply_translation((0.0, 0.0, low))
            parts.append(body)
    return parts


def flat(inner_m: float = 0.2, outer_m: float = 0.2) -> tuple[shapely.Geometry, shapely.Geometry]:
    """Two rooms of 4 x 3 and 3 x 3 m as one plan of walls, and the doorway between them (y from 1 to 1.9)."""
    right = 4.0 + inner_m
    whole = shapely.box(-outer_m, -outer_m, right + 3.0 + outer_m, 3.0 + outer_m)
    rooms = [shapely.box(0, 0, 4, 3), shapely.box(right, 0, right + 3, 3)]
    return whole.difference(shapely.union_all(rooms)), shapely.box(4, 1, right, 1.9)


def areas(plan: FloorPlan) -> list[float]:
    return sorted(room.area for room in plan.rooms)


@pytest.mark.parametrize("side", [0.5, 0.8, 1.2])
def test_a_chimney_is_one_body_with_the_walls_and_doors_close_all_the_same(side: float) -> None:
    walls, doorway = flat()
    chimney = shapely.box(0, 0, side, side)
    plan = plan_of(in_courses(walls.union(chimney), doorway))
    assert areas(plan) == pytest.approx([9.0, 12.0 - side * side], abs=0.02)
    assert kinds(plan) == ["door"]


@pytest.mark.parametrize(("inner", "outer"), [(0.8, 0.2), (0.3, 1.0), (0.9, 0.9)])
def test_a_lintel_closes_a_door_in_a_wall_as_thick_as_a_chimney(inner: float, outer: float) -> None:
    walls, doorway = flat(inner, outer)
    plan = plan_of(in_courses(walls, doorway))
    assert areas(plan) == pytest.approx([9.0, 12.0], abs=0.02)
    assert kinds(plan) == ["door"]
    assert plan.doors[0].width == pytest.approx(0.9, abs=0.02)


def test_a_slab_over_the_rooms_is_no_lintel() -> None:
    walls, doorway = flat()
    slab = trimesh.creation.box(bounds=[[-0.5, -0.5, 2.25], [7.7, 3.5, 2.4]])
    plan = plan_of([*in_courses(walls, doorway), slab])
    assert areas(plan) == pytest.approx([9.0, 12.0], abs=0.02)


def test_faces_inside_walls_of_many_courses_do_not_make_a_storey_low() -> None:
    walls, doorway = flat(0.3, 0.3)
    mesh = joined(in_courses(walls, doorway, (0.0, 0.9, 1.2, 1.4, HEAD, CEILING)))
    found = find_axis_and_unit(mesh, FrameConvention("z", None), SizeOptions(), "house.ply")
    assert (found.up, found.metres) == ("z", 1.0)


@pytest.mark.parametrize("degrees", [0, 17, 45, 90, 133])
def test_rooms_that_meet_under_a_wide_lintel_meet_in_a_turned_house_too(degrees: float) -> None:
    house = turned(joined(two_rooms(Hole(0.2, 2.9))), degrees)
    plan = plan_of(level(house))
    assert kinds(plan) == []
    assert areas(plan) == pytest.approx([9.27, 12.27], abs=0.05)
    assert plan.navigability["0.20"].components == 1


def test_no_wall_end_is_no_crash() -> None:
    """All around as thick as a chimney: nothing ends anywhere, and there is nothing to close."""
    plan = plan_of([*shell((0, 0, 4, 3), thickness=0.9), *wall((1.5, 1.2, 2.1, 1.8))])
    assert len(plan.rooms) == 1
    assert np.isclose(plan.area, 12.0 - 0.36, atol=0.02)


# Houses of sheets: one or two a wall, faces that look anywhere, turned so that coincident ones no longer coincide.


SHEET_DOOR = Hole(0.05, 1.09, 0.0, 2.1)
WIDE = Hole(0.8, 2.74, 0.0, 2.1)


def flipped(parts: Parts) -> Parts:
    return [trimesh.Trimesh(part.vertices, part.faces[:, ::-1], process=False) for part in parts]


def three_rooms(double: bool, look: str) -> Parts:
    """3 x 4 m and 2 x 4 m side by side, 5 x 2 m over both; a room's sheets run counter-clockwise around it."""
    left = [((0, 0), (3, 0)), ((3, 0), (3, 4)), ((3, 4), (0, 4)), ((0, 4), (0, 0))]
    right = [((3, 0), (5, 0)), ((5, 0), (5, 4)), ((5, 4), (3, 4)), ((3, 4), (3, 0))]
    upper = [((0, 4), (3, 4)), ((3, 4), (5, 4)), ((5, 4), (5, 6)), ((5, 6), (0, 6)), ((0, 6), (0, 4))]
    holes = {frozenset([(3, 0), (3, 4)]): SHEET_DOOR, frozenset([(0, 4), (3, 4)]): WIDE}
    parts: Parts = []
    seen: set[frozenset[tuple[int, int]]] = set()
    for k, (a, b) in enumerate([*left, *right, *upper]):
        key = frozenset([a, b])
        if key in seen and not double:
            continue
        seen.add(key)
        hole = holes.get(key)
        if hole and a > b:  # holes are measured from a wall's start
            length = float(np.hypot(a[0] - b[0], a[1] - b[1]))
            hole = Hole(length - hole.end, length - hole.start, hole.low, hole.high)
        sheets = sheet_wall(a, b, *([hole] if hole else []))
        parts += flipped(sheets) if look == "in" or (look == "mixed" and k % 2) else sheets
    return parts


def as_stored(mesh: Mesh) -> Mesh:
    """Vertices as a file of single precision holds them."""
    return Mesh(mesh.vertices.astype(np.float32).astype(np.float64), mesh.faces)


@pytest.mark.parametrize("double", [False, True])
@pytest.mark.parametrize("look", ["out", "in", "mixed"])
@pytest.mark.parametrize("degrees", [0, 17, 45])
def test_sheets_make_rooms_and_doors_whichever_way_they_look(double: bool, look: str, degrees: float) -> None:
    plan = plan_of(level(as_stored(turned(joined(three_rooms(double, look)), degrees, (0.3, 0.7, 0.0)))))
    assert sorted(room.area for room in plan.rooms) == pytest.approx([8.0, 10.0, 12.0], rel=0.04)
    assert kinds(plan) == ["door", "door"]
    assert sorted(door.width for door in plan.doors) == pytest.approx([1.04, 1.94], abs=0.02)


def test_two_sheets_with_a_slit_between_them_are_one_wall() -> None:
    house = joined(three_rooms(double=False, look="out"))
    moved = house.vertices + np.array([0.003, 0.002, 0.0])
    mesh = Mesh(np.concatenate([house.vertices, moved]), np.concatenate([house.faces, house.faces + len(moved)]))
    plan = plan_of(level(mesh))
    assert len(plan.rooms) == 3
    assert kinds(plan) == ["door", "door"]


WINDOW = Hole(0.6, 1.4, 0.9, 2.0)


@pytest.mark.parametrize("degrees", [12.2, 17, 45])
def test_no_crack_beside_a_window_lets_the_outside_in(degrees: float) -> None:
    """Rounding leaves one in a few houses, where wall and window are put together."""
    corners = [(0, 0), (4, 0), (4, 3), (0, 3)]
    around = [sheet_wall(a, b, WINDOW) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]
    house = turned(joined([part for parts in around for part in parts]), degrees, (57.1, 364.2, 0.0))
    assert sum(room.area for room in plan_of(level(as_stored(house))).rooms) == pytest.approx(12.0, rel=0.04)


# Scans: dense meshes whose every vertex is a little off.


@pytest.mark.parametrize("noise_m", [0.0, pytest.param(0.002, marks=pytest.mark.slow), 0.004])
def test_a_noisy_dense_mesh_has_the_rooms_and_doors_of_a_clean_one(noise_m: float) -> None:
    walls, doorway = flat()
    parts = [body.subdivide_to_size(0.12) for body in in_courses(walls, doorway)]
    mesh = joined(parts)
    noise = np.random.default_rng(0).normal(0.0, noise_m, mesh.vertices.shape)
    plan = plan_of(level(type(mesh)(mesh.vertices + noise, mesh.faces)))
    assert sorted(room.area for room in plan.rooms) == pytest.approx([9.0, 12.0], rel=0.02)
    assert kinds(plan) == ["door"]
    assert plan.doors[0].width == pytest.approx(0.9, abs=0.06)


# Furnished houses that nobody named: leaves ajar in frames, curtains, lamps, wardrobes that stand askew.


def leaf(hinge: tuple[float, float], degrees: float, width: float = 0.88, high: float = 2.0) -> trimesh.Trimesh:
    """A leaf 4 cm thick, hung at a point and swung from the x axis by so many degrees."""
    plate = box((0.0, -0.02, width, 0.02), 0.0, high)
    plate.apply_transform(trimesh.transformations.rotation_matrix(np.deg2rad(degrees), [0, 0, 1]))
    plate.apply_translation((*hinge, 0.0))
    return plate


def frame(x1: float, x2: float, y1: float, y2: float) -> Parts:
    """The two posts of a frame, 3 cm, at the jambs of a doorway that runs along y."""
    return [box((x1, y1, x2, y1 + 0.03), 0.0, 2.0), box((x1, y2 - 0.03, x2, y2), 0.0, 2.0)]


@pytest.mark.parametrize("degrees", [72.0, 65.0, 50.0])
def test_a_leaf_ajar_in_its_frame_is_no_wall(degrees: float) -> None:
    """A leaf hung at (4.05, 1.05) stands ajar by 18 to 40 degrees, and touches its frame only."""
    plan = plan_of([*two_rooms(DOOR), *frame(3.98, 4.22, 1.0, 1.9), leaf((3.96, 1.05), 180.0 - degrees)])
    assert kinds(plan) == ["door"]
    assert areas(plan) == pytest.approx([9.0, 12.0], abs=0.15)


def test_leaves_that_touch_at_an_angle_are_leaves_of_their_own() -> None:
    crossing = [leaf((0.0, 0.0), 40.0), leaf((0.7, 0.0), 140.0)]
    assert len(find_leaves(Bodies.of(joined(crossing)))) == 2
    double = [leaf((0.0, 0.0), 0.0), leaf((0.9, 0.0), 0.0)]  # closed: one door
    assert len(find_leaves(Bodies.of(joined(double)))) == 1


def test_frames_of_two_doors_that_touch_in_a_corner_belong_to_a_door_each() -> None:
    """One door from x 0.02 to 0.92 in a wall along x, the other from y 0.02 to 0.92 in a wall along y."""
    one = [box((x, -0.04, x + 0.03, 0.05), 0.0, 2.03) for x in (0.02, 0.89)]
    other = [box((-0.04, y, 0.05, y + 0.03), 0.0, 2.03) for y in (0.06, 0.93)]
    closed = [leaf((0.05, 0.0), 0.0, 0.84), leaf((0.0, 0.09), 90.0, 0.84)]
    found = find_leaves(Bodies.of(joined([*one, *other, *closed])))
    assert [len(each.bodies) for each in found] == [3, 3]


@pytest.mark.parametrize(("high", "found"), [(2.0, 1), (CEILING, 0)])
def test_what_reaches_the_ceiling_is_no_leaf(high: float, found: int) -> None:
    plate = joined([leaf((0.0, 0.0), 0.0, high=high)])
    assert len(find_leaves(Bodies.of(plate), CEILING)) == found


def test_a_leaf_that_swings_against_a_cross_wall_stands_open() -> None:
    """The doorway lies in the corner; the leaf's end touches the outer wall, and its lintel hangs beside it."""
    plan = plan_of([*two_rooms(Hole(0.05, 0.85)), leaf((4.0, 0.84), 252.0, 0.88)])
    assert kinds(plan) == ["door"]
    assert plan.doors[0].width == pytest.approx(0.8, abs=0.06)


def lamp(x: float, y: float) -> trimesh.Trimesh:
    return box((x - 0.2, y - 0.2, x + 0.2, y + 0.2), HEAD - 0.15, HEAD + 0.1)


def test_a_lamp_over_a_table_is_no_window_and_a_window_is_wall() -> None:
    table = box((1.0, 1.0, 2.2, 2.0), 0.0, 0.75)
    walls = gather_evidence(level([*two_rooms(window(1.0, 2.0)), table, lamp(1.6, 1.5)]), EvidenceConfig()).walls
    assert not walls.intersects(shapely.box(1.0, 1.0, 2.2, 2.0))
    assert walls.contains(shapely.Point(4.1, 1.5))


@pytest.mark.parametrize("degrees", [0.0, 3.0, 7.0])
def test_a_wardrobe_leaves_no_crease_that_parts_the_floor(degrees: float) -> None:
    wardrobe = box((0.0, 0.0, 2.0, 0.6), 0.0, 1.9)
    wardrobe.apply_transform(trimesh.transformations.rotation_matrix(np.deg2rad(degrees), [0, 0, 1]))
    wardrobe.apply_translation((1.2, 0.1, 0.0))
    found = gather_evidence(level([*two_rooms(DOOR), wardrobe]), EvidenceConfig())
    assert not found.walls.intersects(shapely.box(0.01, 0.01, 3.99, 2.99))
    assert found.furniture.area == pytest.approx(1.2, abs=0.05)


def test_double_leaves_in_a_gap_of_full_height_are_a_door() -> None:
    """The wall ends 1.4 m before one that crosses: too far for a gap; it parts the rooms, and leaves hang there."""
    bare = two_rooms(gap(0.0, 1.4))
    open_leaves = [leaf((4.1, 1.38), 200.0, 0.68), leaf((4.1, 0.02), 160.0, 0.68)]
    assert kinds(plan_of(bare)) == ["opening"]
    plan = plan_of([*bare, *open_leaves])
    assert kinds(plan) == ["door"]
    assert areas(plan) == pytest.approx([9.0, 12.0], abs=0.3)


def curtains(y: float, *spans: tuple[float, float]) -> Parts:
    return [box((a, y, b, y + 0.06), 0.03, 2.3) for a, b in spans]


def test_curtains_before_a_wall_or_a_door_part_nothing() -> None:
    """Between two curtains 6 cm before a wall lies no opening, and one beside a doorway does not close it again."""
    drawn = curtains(0.06, (0.1, 0.5), (1.4, 1.8), (2.7, 3.1))
    plan = plan_of([*two_rooms(DOOR), *drawn])
    assert kinds(plan) == ["door"]
    assert areas(plan) == pytest.approx([9.0, 12.0], abs=0.15)
