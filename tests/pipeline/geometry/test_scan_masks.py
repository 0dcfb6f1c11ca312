"""A scan's walls and doorways: two rooms of 3 x 3 m, seen from inside, a wall of 0.2 m between them."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
import trimesh
from shapely import Polygon, box
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.scan_columns import Raster, columns_of_mesh, is_scan
from pipeline.geometry.scan_walls import WallMasks, add_unseen_corners, find_wall_masks, mask_to_area
from pipeline.values import Mesh

HEIGHT_M, HEAD_M = 2.6, 2.0
Sheet = tuple[tuple[float, float], tuple[float, float], float, float]
ROOMS = [((0.0, 0.0), (3.0, 3.0)), ((3.2, 0.0), (6.2, 3.0))]
JAMBS = (1.0, 1.9)


def sheets() -> list[Sheet]:
    """The upright faces of the two rooms with a doorway between them: two ends in plan, and from where to where."""
    made: list[Sheet] = []
    for (x1, y1), (x2, y2) in ROOMS:
        made += [((x1, y), (x2, y), 0.0, HEIGHT_M) for y in (y1, y2)]
    made += [((x, 0.0), (x, 3.0), 0.0, HEIGHT_M) for x in (0.0, 6.2)]
    for x in (3.0, 3.2):
        made += [((x, 0.0), (x, JAMBS[0]), 0.0, HEIGHT_M), ((x, JAMBS[1]), (x, 3.0), 0.0, HEIGHT_M)]
        made += [((x, JAMBS[0]), (x, JAMBS[1]), HEAD_M, HEIGHT_M)]
    return made + [((3.0, y), (3.2, y), 0.0, HEAD_M) for y in JAMBS]


def surface(upright: list[Sheet], missing: list[tuple[float, float, float, float]] = ()) -> Mesh:  # type: ignore[assignment]
    """Faces of at most 0.1 m; without those of which the middle lies within (x, y, z, radius)."""
    parts = []
    for (x1, y1), (x2, y2), low, high in upright:
        corners = [(x1, y1, low), (x2, y2, low), (x2, y2, high), (x1, y1, high)]
        parts.append(trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], process=False))
    for (x1, y1), (x2, y2) in [*ROOMS, ((3.0, JAMBS[0]), (3.2, JAMBS[1]))]:
        corners = [(x1, y1, 0), (x2, y1, 0), (x2, y2, 0), (x1, y2, 0)]
        parts.append(trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], process=False))
    whole = trimesh.util.concatenate(parts).subdivide_to_size(0.1)
    middles = whole.triangles_center
    kept = np.ones(len(middles), bool)
    for *centre, radius in missing:
        kept &= np.linalg.norm(middles - np.array(centre), axis=1) > radius
    return Mesh(np.asarray(whole.vertices, float), np.asarray(whole.faces[kept], np.int64))


def judged(mesh: Mesh) -> tuple[BaseGeometry, list[Polygon], WallMasks]:
    masks = find_wall_masks(columns_of_mesh(mesh, 0.15, HEIGHT_M, 0.025))
    doorways = [Polygon(masks.raster.level_points(corners)) for corners in masks.doorways]
    return mask_to_area(masks.walls, masks.raster), doorways, masks


def rooms_of(walls: BaseGeometry) -> list[Polygon]:
    inside = [Polygon(ring) for part in shapely.get_parts(walls) for ring in part.interiors]
    return sorted(inside, key=lambda room: room.bounds)


def assert_is_the_house(mesh: Mesh) -> None:
    walls, doorways, _ = judged(mesh)
    found = rooms_of(walls)
    assert len(found) == 2
    for room, ((x1, y1), (x2, y2)) in zip(found, ROOMS, strict=True):
        assert room.symmetric_difference(box(x1, y1, x2, y2)).area < 0.6
    assert len(doorways) == 1
    assert np.allclose(shapely.get_coordinates(doorways[0].centroid)[0], (3.1, 1.45), atol=0.06)


def test_the_rooms_and_the_doorway_of_a_whole_scan() -> None:
    assert_is_the_house(surface(sheets()))


@pytest.mark.parametrize("angle", [0.3, 0.7, 1.2])
def test_a_turned_scan_has_the_same_walls(angle: float) -> None:  # columns R1
    mesh = surface(sheets())
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1.0]])
    walls, doorways, _ = judged(Mesh(mesh.vertices @ turn, mesh.faces))
    back = shapely.affinity.rotate(walls, -angle, origin=(0, 0), use_radians=True)
    assert len(doorways) == 1
    truth = [box(*first, *second) for first, second in ROOMS]
    assert [min(room.symmetric_difference(other).area for other in truth) < 0.6 for room in rooms_of(back)] == [
        True
    ] * 2


def test_what_ends_below_the_top_is_no_wall() -> None:  # R1
    cupboard: list[Sheet] = [((0.6, 0.0), (0.6, 1.2), 0.0, 2.1), ((0.0, 1.2), (0.6, 1.2), 0.0, 2.1)]
    leaf: list[Sheet] = [((3.2, y), (4.1, y), 0.0, HEAD_M) for y in (1.86, 1.9)]
    assert_is_the_house(surface(sheets() + cupboard + leaf))


@pytest.mark.parametrize("hole", [(1.5, 0.0, 2.4, 0.45), (6.2, 3.0, 2.4, 0.45), (3.1, 0.2, 2.4, 0.45)])
def test_a_hole_at_the_top_is_closed(hole: tuple[float, float, float, float]) -> None:  # R2
    """In the middle of a wall, at a corner, and where a wall meets another."""
    assert_is_the_house(surface(sheets(), [hole]))


@pytest.mark.parametrize("corner", [(0.0, 0.0), (0.0, 3.0), (6.2, 3.0)])
def test_a_corner_that_was_not_seen_is_where_its_walls_meet(corner: tuple[float, float]) -> None:  # R2, holes R4
    walls, doorways, _ = judged(surface(sheets(), [(*corner, z, 0.55) for z in np.arange(0.0, HEIGHT_M + 0.1, 0.1)]))
    rooms = rooms_of(walls)
    assert [len(rooms), len(doorways)] == [2, 1]
    for room, ((x1, y1), (x2, y2)) in zip(rooms, ROOMS, strict=True):
        assert room.symmetric_difference(box(x1, y1, x2, y2)).buffer(-0.05).is_empty


def test_walls_are_not_continued_over_ground() -> None:  # holes R4
    raster, walls = Raster(np.zeros(2), 0.025, (120, 120), np.array([1.0, 0.0])), np.zeros((120, 120), bool)
    walls[10:13, 32:110] = walls[32:110, 10:13] = True  # both end half a metre before their corner
    nothing = np.zeros_like(walls)
    assert np.array_equal(add_unseen_corners(walls, nothing, raster), walls)
    met = add_unseen_corners(walls, ~nothing, raster)
    assert met[10:13, 10:110].all()
    assert met[10:110, 10:13].all()
    assert not (met & ~walls)[15:, 15:].any()


def test_a_wall_that_ends_in_a_room_is_left_as_it_is() -> None:  # R2 must leave alone
    stub: list[Sheet] = [((1.5, 0.0), (1.5, 0.8), 0.0, HEIGHT_M)]
    walls, _, _ = judged(surface(sheets() + stub))
    assert len(rooms_of(walls)) == 2
    assert not walls.contains(shapely.Point(1.5, 1.6))


LAVATORY: list[Sheet] = [
    *[((x1, y), (x2, y), 0.0, HEIGHT_M) for y in (1.4, 1.5) for x1, x2 in ((0.0, 0.5), (1.2, 1.8))],
    *[((0.5, y), (1.2, y), HEAD_M, HEIGHT_M) for y in (1.4, 1.5)],
    *[((x, 1.4), (x, 1.5), 0.0, HEAD_M) for x in (0.5, 1.2)],
    *[((x, 0.0), (x, 1.5), 0.0, HEIGHT_M) for x in (1.8, 1.9)],
    ((1.8, 1.5), (1.9, 1.5), 0.0, HEIGHT_M),
]
"""A wall between two of the left room's, 1.8 m from end to end, a doorway of 0.7 m in it."""


def rooms_without_the_top(walls: list[Sheet], y: float) -> tuple[int, int]:
    """How many rooms and doorways there are, seen as if all above 2.05 m were missing from the wall along ``y``."""
    mesh = surface(sheets() + walls)
    middles = mesh.vertices[mesh.faces].mean(axis=1)
    x, beside, z = middles.T
    gone = (z > 1.95) & (np.abs(beside - y) < 0.08) & (x > 0.02) & (x < 1.78)
    found, doorways, _ = judged(Mesh(mesh.vertices, mesh.faces[~gone]))
    return len(rooms_of(found)), len(doorways)


def test_a_short_wall_shows_by_its_jambs_where_all_of_its_top_is_missing() -> None:  # holes, R3
    assert rooms_without_the_top(LAVATORY, 1.45) == (3, 2)


def test_the_fronts_of_two_cupboards_are_no_wall() -> None:  # holes, R3 must leave alone
    fronts: list[Sheet] = [((0.0, 0.6), (0.6, 0.6), 0.0, 2.0), ((1.2, 0.6), (1.8, 0.6), 0.0, 2.0)]
    sides: list[Sheet] = [((x, 0.0), (x, 0.6), 0.0, 2.0) for x in (0.6, 1.2)]
    corner: list[Sheet] = [((x, 0.0), (x, 0.9), 0.0, HEIGHT_M) for x in (1.8, 1.9)]
    corner.append(((1.8, 0.9), (1.9, 0.9), 0.0, HEIGHT_M))
    assert rooms_without_the_top([*fronts, *sides, *corner], 0.6) == (2, 1)


def test_a_corridor_between_the_ends_of_walls_stays_open() -> None:  # holes, R2 must leave alone
    walls: list[Sheet] = [((x, y), (x + 1.0, y), 0.0, HEIGHT_M) for x in (0.0, 2.0) for y in (1.4, 1.6)]
    walls += [((x, y1), (x, y2), 0.0, HEIGHT_M) for x in (1.0, 2.0) for y1, y2 in ((0.0, 1.4), (1.6, 3.0))]
    walls += [((x, 1.4), (x, 1.6), 0.0, HEIGHT_M) for x in (1.0, 2.0)]
    holes = [(x, y, 2.4, 0.3) for x in (0.7, 2.3) for y in (1.4, 1.6)]
    found, _, _ = judged(surface(sheets() + walls, holes))
    assert not found.intersects(box(1.3, 0.2, 1.7, 2.8))


def test_a_region_without_ground_is_filled() -> None:  # R5
    shaft: list[Sheet] = [((2.0, 2.0), (3.0, 2.0), 0.0, HEIGHT_M), ((2.0, 2.0), (2.0, 3.0), 0.0, HEIGHT_M)]
    mesh = surface(sheets() + shaft)
    walls, _, _ = judged(_without_ground(mesh, box(2.0, 2.0, 3.0, 3.0)))
    assert walls.contains(shapely.Point(2.5, 2.5))
    walls, _, _ = judged(mesh)
    assert not walls.intersects(shapely.Point(2.5, 2.5))


def _without_ground(mesh: Mesh, area: Polygon) -> Mesh:
    corners = mesh.vertices[mesh.faces]
    lying = np.ptp(corners[:, :, 2], axis=1) == 0
    gone = lying & shapely.contains_xy(area, *corners.mean(axis=1)[:, :2].T)
    return Mesh(mesh.vertices, mesh.faces[~gone])


def test_the_place_of_a_window_is_no_doorway() -> None:  # R6
    niche: list[Sheet] = [((-0.1, 1.0), (-0.1, 2.0), 0.0, 2.1)]
    niche += [((-0.1, y), (0.0, y), 0.0, 2.1) for y in (1.0, 2.0)]
    niche += [((0.0, 0.0), (0.0, 1.0), 0.0, HEIGHT_M), ((0.0, 2.0), (0.0, 3.0), 0.0, HEIGHT_M)]
    niche += [((0.0, 1.0), (0.0, 2.0), 2.1, HEIGHT_M)]
    others = [sheet for sheet in sheets() if sheet[:2] != ((0.0, 0.0), (0.0, 3.0))]
    assert_is_the_house(surface(others + niche))


def test_only_a_mesh_of_small_upright_faces_is_a_scan() -> None:
    assert is_scan(surface(sheets()))
    drawn = trimesh.util.concatenate([trimesh.creation.box((6, 0.2, 2.6)), trimesh.creation.icosphere(5, 0.3)])
    assert len(drawn.faces) > 3000
    assert not is_scan(Mesh(np.asarray(drawn.vertices, float), np.asarray(drawn.faces, np.int64)))
