"""Walls of a section whose area can be written down: solids, sheets, both, and tops under sloped roofs."""

import numpy as np
import pytest
import shapely
import trimesh
from shapely import box as area

from pipeline.geometry.areas import EMPTY
from pipeline.geometry.mesh_slicing import MeshSlicer, winding_number
from pipeline.geometry.wall_sections import (
    WallSection,
    close_cracks,
    ends_at_sloped_roof,
    find_overhangs,
    find_pieces_below_wall_tops,
    section_from_segments,
    thicken_lines,
)
from pipeline.values import Mesh
from tests.builders.houses import sheet_wall, shell, wall, window
from tests.builders.meshes import L_WALLS, box, joined, storey

# six boxes round two rooms, each running through the corners: they overlap there
OVERLAPPING = [
    box(r, 0.0, 2.5)
    for r in ((0, 0, 8, 0.2), (0, 5.8, 8, 6), (0, 0, 0.2, 6), (7.8, 0, 8, 6), (4, 0, 4.2, 6), (0, 3, 4.2, 3.2))
]
UNION = 8 * 6 - (3.8 * 2.8 + 3.8 * 2.6 + 3.6 * 5.6)


def cut(parts: list[trimesh.Trimesh] | Mesh, height: float = 1.0) -> WallSection:
    mesh = parts if isinstance(parts, Mesh) else joined(parts)
    return section_from_segments(MeshSlicer(mesh).cut(height), sheet_m=0.05, solid_m=0.7)


def soup(mesh: Mesh) -> Mesh:
    return Mesh(mesh.vertices[mesh.faces].reshape(-1, 3), np.arange(3 * len(mesh.faces)).reshape(-1, 3))


def test_overlapping_solids_count_once() -> None:
    assert cut(OVERLAPPING).walls.area == pytest.approx(UNION, abs=1e-3)


def test_solids_that_share_corners_count_once() -> None:
    walls = cut(storey(0.0, 2.5)).walls
    assert walls.area == pytest.approx(shapely.union_all([shapely.box(*r) for r in L_WALLS]).area, abs=1e-3)


def test_a_soup_of_triangles_is_the_same_house() -> None:
    assert cut(soup(joined(OVERLAPPING))).walls.area == pytest.approx(UNION, abs=1e-3)


@pytest.mark.parametrize("turned", [[0], [4], [0, 1, 2, 3, 4, 5]])
def test_boxes_turned_inside_out_are_walls_all_the_same(turned: list[int]) -> None:
    parts = [part.copy() for part in OVERLAPPING]
    for k in turned:
        parts[k].invert()
    assert cut(parts).walls.area == pytest.approx(UNION, abs=1e-3)


def test_one_body_with_a_hole_is_walls_and_not_the_room() -> None:
    ring = shapely.box(0, 0, 5, 4).difference(shapely.box(0.2, 0.2, 4.8, 3.8))
    whole = trimesh.creation.extrude_polygon(ring, 2.5)
    assert cut([whole]).walls.area == pytest.approx(ring.area, abs=1e-3)


@pytest.mark.parametrize("parts", [[], OVERLAPPING[:1]])
def test_a_thick_body_is_solid_but_no_wall(parts: list[trimesh.Trimesh]) -> None:
    found = cut([*parts, box((10, 0, 11.5, 1.5), 0, 2.5), *shell((20.0, 0.0, 23.0, 3.0))])
    assert found.solids.area == pytest.approx(2.25, abs=1e-3)
    assert not found.walls.intersects(shapely.box(10.1, 0.1, 11.4, 1.4))


def test_a_closed_cladding_around_the_walls_fills_no_room() -> None:
    cladding = box((-0.02, -0.02, 8.02, 6.02), -0.1, 2.6)
    doorway = [box((4, 0, 4.2, 1), 0.0, 2.5), box((4, 2, 4.2, 6), 0.0, 2.5)]
    found = cut([cladding, *OVERLAPPING[:4], *doorway])
    assert found.solids.is_empty
    assert found.walls.area == pytest.approx(8.04 * 6.04 - 7.6 * 5.6 + 0.2 * 4.6, abs=1e-2)


def test_pillars_in_a_plinth_make_no_room_of_it() -> None:
    pillars = [box((x, 1, x + 0.3, 1.3), 0.0, 2.5) for x in (1, 3)]
    found = cut([box((0, 0, 5, 4), 0.0, 1.5), *pillars])
    assert found.solids.area == pytest.approx(20.0, abs=0.2)


def test_sheets_get_half_a_thickness_on_each_side() -> None:
    room = [
        *sheet_wall((0, 0), (5, 0)),
        *sheet_wall((5, 0), (5, 4)),
        *sheet_wall((5, 4), (0, 4)),
        *sheet_wall((0, 4), (0, 0)),
    ]
    found = cut(room)
    ring = shapely.box(-0.025, -0.025, 5.025, 4.025).difference(shapely.box(0.025, 0.025, 4.975, 3.975))
    assert found.walls.symmetric_difference(ring).area < 1e-3
    assert found.solids.is_empty


def test_a_sheet_that_stands_free_has_flat_ends() -> None:
    found = cut(sheet_wall((1.0, 1.0), (3.0, 1.0)))
    assert found.walls.symmetric_difference(shapely.box(1.0, 0.975, 3.0, 1.025)).area < 1e-3


def test_a_window_of_a_sheet_is_open_at_its_height_only() -> None:
    parts = sheet_wall((0, 0), (5, 0), window(1.0, 2.0))
    assert cut(parts, 0.2).walls.area == pytest.approx(0.25, abs=1e-3)
    assert cut(parts, 1.5).walls.area == pytest.approx(0.20, abs=1e-3)


def test_solids_and_sheets_in_one_file() -> None:
    parts = [*shell((0.0, 0.0, 6.0, 4.0)), *sheet_wall((3.0, 0.0), (3.0, 4.0)), *sheet_wall((3.0, 2.0), (5.0, 2.0))]
    walls = cut(parts).walls
    outer = shapely.box(-0.2, -0.2, 6.2, 4.2).difference(shapely.box(0, 0, 6, 4))
    inner = shapely.union_all([shapely.box(2.975, 0, 3.025, 4), shapely.box(3, 1.975, 5, 2.025)])
    assert walls.symmetric_difference(outer.union(inner)).area < 2e-3


def test_a_wall_of_two_sheets_is_filled_between_them() -> None:
    """A modeller who draws only the faces of a wall that can be seen."""
    parts = [
        *sheet_wall((0, 0), (4, 0)),
        *sheet_wall((0, 0.15), (4, 0.15)),
        *sheet_wall((0, 0), (0, 0.15)),
        *sheet_wall((4, 0), (4, 0.15)),
    ]
    # it gets a sheet's half on its ends and sides at most
    assert shapely.box(0, 0, 4, 0.15).difference(cut(parts).walls).area < 1e-3
    assert cut(parts).walls.area < 4.1 * 0.2


def test_a_wall_of_a_centimetre_is_thick_enough_for_the_grid() -> None:
    found = cut([*shell((0.0, 0.0, 5.0, 4.0)), *wall((2.5, 0.0, 2.51, 4.0))]).walls
    inside = found.intersection(shapely.box(0.5, 0.5, 4.5, 3.5))
    assert inside.area == pytest.approx(3.0 * 0.05, rel=0.05)
    assert inside.centroid.x == pytest.approx(2.505, abs=1e-3)


@pytest.mark.parametrize("crack", [0.001, 0.01])
def test_a_crack_between_two_walls_is_closed(crack: float) -> None:
    parts = [*wall((0.0, 0.0, 2.0, 0.2)), *wall((2.0 + crack, 0.0, 4.0, 0.2))]
    walls = cut(parts).walls
    assert walls.geom_type == "Polygon"
    assert walls.area == pytest.approx(0.8, abs=1e-3)


def test_a_gap_wider_than_a_crack_stays_open() -> None:
    left, right = shapely.box(0, 0, 2, 0.2), shapely.box(2.05, 0, 4, 0.2)
    assert close_cracks(shapely.union_all([left, right])).area == pytest.approx(0.79)


def test_an_empty_cut_has_no_walls() -> None:
    found = cut(OVERLAPPING, 9.0)
    assert found.walls.is_empty
    assert found.solids.is_empty


def test_a_segment_of_no_length_is_nothing() -> None:
    assert thicken_lines(shapely.LineString(), 0.05).is_empty


def test_near_the_floor_a_lone_edge_is_no_wall() -> None:
    cutter = MeshSlicer(joined(sheet_wall((0, 0), (4, 0))))
    assert section_from_segments(cutter.cut(0.01), sheet_m=0.05, solid_m=0.7, sheets=False).walls.is_empty


def test_winding_numbers() -> None:
    corners = np.array([(0, 0), (2, 0), (2, 2), (0, 2)], float)
    ring = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
    points = shapely.points([(1, 1), (3, 1), (-1, 1)])
    assert winding_number(points, ring).tolist() == [1, 0, 0]
    assert winding_number(points, np.concatenate([ring, ring])).tolist() == [2, 0, 0]
    assert winding_number(points, ring[:, ::-1]).tolist() == [-1, 0, 0]


PIECE = area(4.5, 0.0, 5.5, 0.3)


def gable() -> trimesh.Trimesh:
    ring = [(0.0, 0.0), (8.0, 0.0), (8.0, 1.2), (4.0, 4.4), (0.0, 1.2)]
    points = [(x, y, z) for y in (0.0, 0.3) for x, z in ring]
    sides = [face for k in range(5) for face in ((k, (k + 1) % 5, k + 5), ((k + 1) % 5, (k + 1) % 5 + 5, k + 5))]
    caps = [(0, 2, 1), (0, 3, 2), (0, 4, 3), (5, 6, 7), (5, 7, 8), (5, 8, 9)]
    made = trimesh.Trimesh(np.array(points), np.array([*sides, *caps]), process=False)
    if made.volume < 0:
        made.invert()
    return made


def cutter(*parts: trimesh.Trimesh) -> MeshSlicer:
    mesh = joined(list(parts))
    return MeshSlicer(Mesh(np.asarray(mesh.vertices), np.asarray(mesh.faces)))


def test_a_wall_that_ends_at_a_slope_meets_it() -> None:
    assert ends_at_sloped_roof(PIECE, cutter(gable()))


def test_a_window_in_a_gable_does_not_hide_that_the_wall_over_it_meets_the_slope() -> None:
    house = cutter(gable(), box((4.4, 0.1, 5.6, 0.2), 0.9, 2.3))
    assert not ends_at_sloped_roof(PIECE, house)
    assert ends_at_sloped_roof(PIECE, house, stood_m=3.1)


def test_a_cupboard_under_a_slope_does_not_meet_it() -> None:
    roof = gable()
    roof.apply_scale((1.0, 10.0, 1.0))
    roof.apply_translation((0.0, 0.0, 1.0))
    assert not ends_at_sloped_roof(area(4.5, 1.0, 5.5, 2.0), cutter(roof, box((4.5, 1.0, 5.5, 2.0), 0.0, 0.9)))


@pytest.mark.parametrize(("size", "low", "meets"), [(0.6, 0.7, False), (2.0, 0.7, True), (0.6, 2.0, True)])
def test_the_top_of_a_cushion_is_no_roof(size: float, low: float, meets: bool) -> None:
    """A wedge that rises by half its depth; as large as a roof it is one, and over head height a small piece is."""
    wedge = box((0.0, 0.0, size, size), 0.0, low)
    points = np.array(wedge.vertices)
    points[(points[:, 2] == low) & (points[:, 1] > 0), 2] += size / 2
    made = trimesh.Trimesh(points, wedge.faces, process=False)
    assert ends_at_sloped_roof(area(0.1, 0.1, size - 0.1, size - 0.1), cutter(made)) == meets


def test_what_ends_knows_the_last_height_at_which_it_stands() -> None:
    wall, cupboard = area(0, 0, 5, 0.3), area(5, 0, 6, 0.3)
    both = wall.union(cupboard)
    (found,) = find_pieces_below_wall_tops(both, [both, wall], [1.7, 1.9, 2.4])
    assert found.part.symmetric_difference(cupboard).area < 1e-6
    assert found.stood_m == 1.9


def test_where_nothing_stands_above_head_height_nothing_hangs() -> None:
    assert find_overhangs([EMPTY, EMPTY], area(0, 0, 1, 1)).is_empty
