"""Leaves of doors that the source shows: ajar, in partitions as thin as their frames."""

import numpy as np
import pytest
import shapely
import trimesh

from pipeline.geometry.areas import EMPTY
from pipeline.geometry.doorways import JudgedLeaves, doorway_around_leaf, find_known_doorways, leaves_in_recesses
from pipeline.geometry.leaves import find_leaves, may_hold_leaves
from pipeline.geometry.meshes import Bodies, Box, Mesh
from pipeline.geometry.prisms import Prism, Prisms
from pipeline.values import SourceObject
from tests.builders.houses import CEILING, HEAD, Hole, Parts, gap, kinds, level, plan_of, shell, two_rooms, wall
from tests.builders.meshes import box, joined

HINGE = np.array([4.0, 1.05])
WIDTH, THICK = 0.88, 0.04


def leaf(degrees: float) -> trimesh.Trimesh:
    """A leaf that hangs at the left face of the wall between the rooms, in its hole from y = 1 to 1.9."""
    body = trimesh.creation.box(bounds=[[0.0, 0.0, 0.005], [THICK, WIDTH, 2.09]])
    body.apply_transform(trimesh.transformations.rotation_matrix(np.radians(degrees), (0, 0, 1)))
    body.apply_translation((*HINGE, 0.0))
    return body


def house() -> Parts:
    """Two rooms, the left one parted by a wall that meets the inner wall beside its door; it has one of its own."""
    return [*two_rooms(Hole(1.0, 1.9)), *wall((0.0, 2.0, 4.0, 2.1), Hole(1.0, 1.9))]


@pytest.mark.parametrize("named", [False, True])
@pytest.mark.parametrize("degrees", [0.0, 9.0, 15.0, 40.0])
def test_the_door_is_where_its_lintel_is(degrees: float, named: bool) -> None:
    leaves = (SourceObject(("door",), joined([leaf(degrees)])),) if named else ()
    made = house() if named else [*house(), leaf(degrees)]
    plan = plan_of(level(joined(made), leaves=leaves))
    assert kinds(plan) == ["door", "door"]
    assert len(plan.rooms) == 3
    matrix = np.asarray(plan.frame.matrix)
    middles = [np.mean(door.segment, axis=0) @ matrix[:, :2].T + matrix[:, 2] for door in plan.doors]
    assert min(np.hypot(*(middle - (4.1, 1.45))) for middle in middles) < 0.05
    rooms = shapely.union_all([shapely.Polygon(room.polygon) for room in plan.rooms])
    assert rooms.area == pytest.approx(20.6, abs=0.1)


def test_leaves_of_two_doors_that_meet_open_are_leaves_of_their_own() -> None:
    """One stands at right angles to its wall, one ajar in a frame parallel to that leaf, and they touch."""
    frame = [box((1.0, 1.99, 1.03, 2.11), 0.0, 2.1), box((1.87, 1.99, 1.9, 2.11), 0.0, 2.1)]
    frame.append(box((1.0, 1.99, 1.9, 2.11), 2.06, 2.1))
    framed = trimesh.boolean.union(frame, engine="manifold")
    ajar = trimesh.creation.box(bounds=[[-0.8, 0.0, 0.005], [0.0, THICK, 2.05]])
    ajar.apply_transform(trimesh.transformations.rotation_matrix(np.radians(35), (0, 0, 1)))
    ajar.apply_translation((1.86, 1.94, 0.0))
    tip = ajar.vertices[:, :2].min(axis=0)
    other = box((tip[0] - 0.02, tip[1] - 0.06, tip[0] + 0.86, tip[1] - 0.02), 0.005, 2.05)
    bodies = Bodies.of(joined([framed, ajar, other]))
    assert sorted(len(leaf.bodies) for leaf in find_leaves(bodies, 2.5)) == [1, 1, 1]


@pytest.mark.parametrize(("tops", "expected"), [((CEILING,), False), ((1.2, CEILING), False), ((2.1, CEILING), True)])
def test_walls_below_windows_hold_no_leaves_where_nothing_ends_higher_below_the_ceiling(
    tops: tuple[float, ...], *, expected: bool
) -> None:
    walls = Prisms(Prism(shapely.box(x, 0.0, x + 0.9, 0.025), 0.0, top) for x, top in enumerate(tops))
    assert may_hold_leaves(walls, CEILING) is expected


LEAF = Box(np.array([2.0, 0.0]), np.array([1.0, 0.0]), 0.9, 0.04, 0.0, 2.0)


def test_a_leaf_between_two_jambs_stands_in_a_doorway_as_deep_as_the_wall() -> None:
    walls = shapely.union_all([shapely.box(0, -0.1, 1.5, 0.1), shapely.box(2.5, -0.1, 4, 0.1)])
    found = doorway_around_leaf(LEAF, walls)
    assert found is not None
    assert (found.width, found.thickness) == (pytest.approx(1.0), pytest.approx(0.2))


def test_a_leaf_between_two_posts_thinner_than_it_looks_into_them_stands_in_none() -> None:
    posts = shapely.union_all([shapely.box(1.47, -0.1, 1.5, 0.1), shapely.box(2.5, -0.1, 2.53, 0.1)])
    assert doorway_around_leaf(LEAF, posts) is None


@pytest.mark.parametrize("hole", [True, False])
def test_a_sheet_at_the_face_of_a_wall_is_a_door_where_it_shuts_a_hole(hole: bool) -> None:
    """R3: the wall has a recess of 1 m with a thin back, or runs on behind the sheet; rounding parts the two."""
    whole = shapely.box(0, -0.1, 4, 0.1)
    walls = whole - shapely.box(1.5, -0.05, 2.5, 0.2) if hole else whole
    found = doorway_around_leaf(Box(np.array([2.0, 0.1001]), np.array([1.0, 0.0]), 1.0, 0.0, 0.0, 2.0), walls)
    assert (found is not None) is hole
    if found is not None:
        assert (found.width, found.thickness) == (pytest.approx(1.0), pytest.approx(0.2))


def _askew(degrees: float, beside_m: float = 0.0) -> shapely.Geometry:
    """Two pieces of wall about a gap of 0.9 m, turned about the leaf's middle; the second is moved across."""
    pieces = shapely.union_all([shapely.box(0, -0.1, 1.55, 0.1), shapely.box(2.45, -0.1 + beside_m, 4, 0.1 + beside_m)])
    return shapely.affinity.rotate(pieces, degrees, origin=(2.0, 0.0))


def test_a_doorway_lies_along_the_wall_that_its_leaf_is_askew_to() -> None:  # R1
    found = doorway_around_leaf(LEAF, _askew(8.0))
    assert found is not None
    assert np.rad2deg(np.arctan2(*found.along[::-1])) == pytest.approx(8.0, abs=0.2)
    assert found.centre == pytest.approx([2.0, 0.0], abs=0.01)
    assert (found.width, found.thickness) == (pytest.approx(0.9, abs=0.03), pytest.approx(0.2, abs=0.01))


def test_a_doorway_between_two_walls_side_by_side_is_not_turned() -> None:  # R2
    found = doorway_around_leaf(LEAF, _askew(0.0, beside_m=0.08))
    assert found is not None
    assert found.along == pytest.approx([1.0, 0.0])
    assert found.thickness == pytest.approx(0.2)


@pytest.mark.parametrize(("jambs", "found"), [(True, 1), (False, 0)])
def test_a_leaf_that_is_one_body_with_its_wall_stands_in_a_recess_between_jambs(jambs: bool, found: int) -> None:
    """A wall of 20 cm with a leaf of 4 cm under a lintel; or a wall of 4 cm, before which boards hang."""
    leaf, lintel = shapely.box(2.0, 0.0, 2.9, 0.04), shapely.box(2.0, 0.04, 2.9, 0.2)
    thick = 0.2 if jambs else 0.04
    walls = shapely.union_all([shapely.box(0.0, 0.0, 2.0, thick), leaf, shapely.box(2.9, 0.0, 5.0, thick)])
    assert len(leaves_in_recesses(lintel, walls)) == found


PARTITION = 0.05
X1, X2 = 4.0, 4.0 + PARTITION


def partition() -> Parts:
    """Rooms with a thin partition between, an open gap of it at one end, a hole for a door at the other."""
    return [*two_rooms(gap(0.0, 1.0), Hole(1.8, 2.7), thickness=PARTITION)]


def frame(proud: float) -> trimesh.Trimesh:
    """Two jambs and a head as one body."""
    low, high = X1 - proud, X2 + proud
    jambs = [box((low, 1.8, high, 1.84), 0.0, 2.1), box((low, 2.66, high, 2.7), 0.0, 2.1)]
    return trimesh.boolean.union([*jambs, box((low, 1.8, high, 2.7), 2.06, 2.1)], engine="manifold")


@pytest.mark.parametrize("proud", [0.0, 0.005])
def test_a_leaf_in_its_frame_is_a_door_in_the_thinnest_wall(proud: float) -> None:
    leaf = box((X1 + 0.008, 1.845, X1 + 0.038, 2.655), 0.005, 2.055)
    assert kinds(plan_of([*partition(), frame(proud), leaf])) == ["door", "opening"]


@pytest.mark.parametrize(("wall_m", "depth_m"), [(0.1, 0.1), (1.0, 0.9)])
def test_a_leaf_at_the_front_of_a_closet_is_a_thin_doorway(wall_m: float, depth_m: float) -> None:  # R4
    """Two walls of 0.9 m run across the leaf's line, from its front to a wall behind it; or the wall is that thick."""
    sides = [shapely.box(1.5 - wall_m, 0, 1.5, 0.9), shapely.box(2.5, 0, 2.5 + wall_m, 0.9)]
    walls = shapely.union_all([*sides, *([shapely.box(-3, 0.9, 5, 1.0)] if wall_m < 0.5 else [])])
    found = doorway_around_leaf(Box(np.array([2.0, 0.04]), np.array([1.0, 0.0]), 1.0, 0.04, 0.0, 2.0), walls)
    assert found is not None
    assert (found.width, found.thickness) == (pytest.approx(1.0), pytest.approx(depth_m, abs=0.11))


@pytest.mark.parametrize("bulge_m", [1e-7, 0.01, 0.03])
def test_a_named_door_in_a_wall_that_bulges_goes_through_all_of_it(bulge_m: float) -> None:  # R6
    """The wall is flush with the door's frame at its ends, and thicker between them."""
    ring = [(0, 0), (1.5, 0), (1.52, -bulge_m), (2.48, -bulge_m), (2.5, 0), (4, 0), (4, 0.2), (0, 0.2)]
    walls = shapely.Polygon(ring)
    leaf_ = box((1.5, 0.05, 2.5, 0.1), 0.0, 2.0)
    door = Mesh(np.asarray(leaf_.vertices), np.asarray(leaf_.faces))
    doorways, _ = find_known_doorways([], [door], walls, EMPTY, JudgedLeaves((), (), (), EMPTY))
    assert len(doorways) == 1
    left = shapely.difference(walls, doorways[0].polygon)
    assert len(shapely.get_parts(left)) == 2


@pytest.mark.parametrize(("panes", "found"), [(2, 2), (3, 0), (4, 0)])
def test_a_row_of_panes_in_their_frames_is_glazing_from_its_first_to_its_last(panes: int, found: int) -> None:
    """Panes of 1.2 m from the floor up, with 0.1 m of post between them."""
    parts = [box((1.3 * k, 0.0, 1.3 * k + 1.2, 0.05), 0.02, 2.4) for k in range(panes)]
    assert len(find_leaves(Bodies.of(joined(parts)), 2.6)) == found


def knob(y: float, out_m: float = 0.04, size_m: float = 0.04, low: float = 1.0) -> trimesh.Trimesh:
    """A knob at the left face of the wall between the rooms; it juts out from x = 4 by ``out_m``."""
    return box((4.0 - out_m, y - size_m / 2, 4.0 + 0.005, y + size_m / 2), low, low + size_m + 0.02)


@pytest.mark.parametrize(("knobs", "found"), [([1.82], "door"), ([], "cut"), ([1.45], "cut")])
def test_a_block_up_to_the_ceiling_is_a_door_where_a_knob_is_near_its_edge(knobs: list[float], found: str) -> None:
    """R4: a door that is one body with what is above it, as deep as the wall; a knob in its middle is a hook."""
    block = box((4.0, 1.0, 4.2, 1.9), 0.0, CEILING)
    parts = [*two_rooms(gap(1.0, 1.9)), block, *(knob(y) for y in knobs)]
    assert kinds(plan_of(parts)) == [found]


@pytest.mark.parametrize(("size_m", "low"), [(0.2, 1.0), (0.04, 1.5), (0.04, 0.3)])
def test_a_pot_of_plants_at_a_block_its_leaves_and_sockets_are_no_handles(size_m: float, low: float) -> None:
    block = box((4.0, 1.0, 4.2, 1.9), 0.0, CEILING)
    assert kinds(plan_of([*two_rooms(gap(1.0, 1.9)), block, knob(1.75, size_m, size_m, low)])) == ["cut"]


@pytest.mark.parametrize(("out_m", "found"), [(0.04, "door"), (0.005, "cut")])
def test_a_leaf_in_a_row_of_panes_is_a_door_where_it_has_a_handle(out_m: float, found: str) -> None:
    """R4: a glazed front of four panes under a lintel as thin; what is flush with its pane is a sticker."""
    panes = [box((4.0, 0.01 + y, 4.03, y + 0.74), 0.0, HEAD) for y in (0.0, 0.75, 1.5, 2.25)]
    lintel = box((4.0, 0.0, 4.03, 3.0), HEAD, CEILING)
    parts = [*shell((0.0, 0.0, 7.1, 3.0)), lintel, *panes, knob(1.42, out_m)]
    plan = plan_of(parts)
    assert kinds(plan) == [found]
    if found == "door":
        assert plan.doors[0].width == pytest.approx(0.75, abs=0.03)


@pytest.mark.parametrize("holed", [True, False])
def test_a_short_wall_as_high_as_the_walls_that_it_touches_is_no_leaf_that_stands_open(holed: bool) -> None:
    """R4: a niche of 1.4 m, closed by a thin wall with a door in it, or by one that ends. The roof is higher."""
    body = trimesh.boolean.union(wall((3.0, 1.0, 4.4, 1.08), Hole(3.1, 3.9)), engine="manifold")
    short = body if holed else box((3.0, 1.0, 3.6, 1.08), 0.0, CEILING)
    sides = [box((2.9, 1.0, 3.0, 3.0), 0.0, CEILING), box((4.4, 1.0, 4.5, 3.0), 0.0, CEILING)]
    found = plan_of(level([*shell((0.0, -2.0, 7.0, 3.0)), *sides, short], ceiling_m=CEILING + 0.12))
    assert kinds(found) == ["opening"]
    assert len(found.rooms) == 2


def test_a_short_wall_with_a_hole_is_no_frame_of_the_leaf_in_it() -> None:
    """R2: the wall before a niche of 1.2 m, as high as the walls at its ends, with a leaf in it. The roof is higher."""
    short = trimesh.boolean.union(wall((3.0, 1.0, 4.2, 1.12), Hole(3.1, 4.05)), engine="manifold")
    sides = [box((2.9, 1.0, 3.0, 3.0), 0.0, CEILING), box((4.2, 1.0, 4.3, 3.0), 0.0, CEILING)]
    shut = box((3.1, 1.08, 4.05, 1.12), 0.0, HEAD)
    found = plan_of(level([*shell((0.0, -2.0, 7.0, 3.0)), *sides, short, shut], ceiling_m=CEILING + 0.12))
    assert kinds(found) == ["door"]
    assert len(found.rooms) == 2


@pytest.mark.parametrize(
    ("off_m", "hole", "found"),
    [(-0.12, False, 0), (-0.03, False, 1), (0.0, False, 1), (0.13, False, 1), (-0.03, True, 0)],
)
def test_a_named_leaf_at_the_face_of_an_uncut_wall_is_a_door_in_it(off_m: float, hole: bool, found: int) -> None:  # R6
    """The leaf is 6 cm thick, the wall 10 cm; a leaf beside a doorway as wide may be the open one of that."""
    lintel = shapely.box(2.95, 0.1, 3.05, 1.0)
    leaf_ = box((2.0, off_m - 0.03, 2.9, off_m + 0.03), 0.0, 2.0)
    door = Mesh(np.asarray(leaf_.vertices), np.asarray(leaf_.faces))
    nothing = JudgedLeaves((), (), (), EMPTY)
    doorways, _ = find_known_doorways([], [door], shapely.box(0, 0, 5, 0.1), lintel if hole else EMPTY, nothing)
    assert len(doorways) == found
    if found:
        assert doorways[0].polygon.bounds == pytest.approx((2.0, 0.0, 2.9, 0.1), abs=0.01)
