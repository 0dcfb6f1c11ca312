"""Walls of two sheets, in plan: sheets are drawn 0.05 m thick, half on each side of where they stand."""

import pytest
import shapely
import shapely.affinity
from shapely import box

from pipeline.geometry.wall_sections import fill_slits_between_sheets

SHEET_M = 0.05


def sheet(x1, y1, x2, y2):
    return shapely.buffer(shapely.linestrings([(x1, y1), (x2, y2)]), SHEET_M / 2, cap_style="flat")


@pytest.mark.parametrize("thick", [0.08, 0.2, 0.38])
def test_two_sheets_are_one_wall_from_face_to_face(thick):
    found = fill_slits_between_sheets(shapely.union_all([sheet(0, 0, 5, 0), sheet(0, thick, 5, thick)]), SHEET_M)
    assert found.symmetric_difference(box(0, 0, 5, thick)).area < 0.01


def test_a_gap_in_both_sheets_stays_open():
    sheets = [sheet(a, y, b, y) for y in (0, 0.2) for a, b in ((0, 2), (3, 5))]
    found = fill_slits_between_sheets(shapely.union_all(sheets), SHEET_M)
    assert not found.intersects(box(2.01, 0, 2.99, 0.2))
    assert found.area == pytest.approx(2 * 2 * 0.2, abs=0.01)


def test_sheets_as_far_apart_as_a_narrow_door_are_two_walls():
    walls = shapely.union_all([sheet(0, 0, 5, 0), sheet(0, 0.5, 5, 0.5)])
    assert fill_slits_between_sheets(walls, SHEET_M).equals(walls)


def test_a_niche_between_solid_walls_stays():
    walls = shapely.union_all([box(0, 0, 5, 0.15), box(0, 0.45, 5, 0.6)])
    assert fill_slits_between_sheets(walls, SHEET_M).equals(walls)


def test_the_stub_of_a_wall_beside_a_door_in_a_corner_is_filled():
    corner = shapely.union_all([sheet(0, -2, 0, 2), sheet(0, 0, 0.15, 0), sheet(0, 0.2, 0.15, 0.2)])
    assert fill_slits_between_sheets(corner, SHEET_M).covers(box(0, 0.01, 0.14, 0.19))


def test_a_narrow_gap_in_a_sheet_stays_open():
    walls = shapely.union_all([sheet(0, 0, 2, 0), sheet(2.35, 0, 5, 0)])
    assert fill_slits_between_sheets(walls, SHEET_M).equals(walls)


def test_a_partition_stays_joined_to_the_wall_that_it_meets():
    sheets = [sheet(0, 0, 5, 0), sheet(0, 0.2, 5, 0.2), sheet(2, 0.2, 2, 3)]
    found = fill_slits_between_sheets(shapely.union_all(sheets), SHEET_M)
    assert found.geom_type == "Polygon"


@pytest.mark.parametrize("degrees", [0, 24, 66])
def test_a_sheet_that_goes_on_alone_stays_joined_to_the_wall(degrees):
    sheets = [sheet(-3, 0, 5, 0), sheet(0, 0.23, 5, 0.23), sheet(0, 0.23, 0, 3)]
    turned = shapely.affinity.rotate(shapely.union_all(sheets), degrees, origin=(40, 7))
    assert fill_slits_between_sheets(turned, SHEET_M).geom_type == "Polygon"


def test_crumbs_of_rounding_on_thick_walls_are_no_sheets():
    """Two walls that leave a niche, a pane beside them, and on their faces what rounding leaves: 10 cm by 0.05 mm."""
    walls = [box(0, 0, 3, 0.085), box(2, 0.085, 2.085, 2), box(1.5, 0.25, 2, 0.335), sheet(3, 0.04, 5, 0.04)]
    crumbs = [box(1.8, 0.085, 1.9, 0.08505), box(1.8, 0.24995, 1.9, 0.25)]
    corner = shapely.union_all([*walls, *crumbs])
    assert fill_slits_between_sheets(corner, SHEET_M).equals(corner)


def test_a_post_that_stands_against_the_end_of_a_wall_stays_joined_to_it():
    wall = [sheet(0, 0, 2, 0), sheet(0, 0.2, 2, 0.2), sheet(2, 0, 2, 0.2)]
    found = fill_slits_between_sheets(shapely.union_all([*wall, box(1.995, -0.005, 2.045, 0.205)]), SHEET_M)
    assert found.geom_type == "Polygon"
    assert found.covers(box(1.5, 0.01, 2.04, 0.19))


def test_a_solid_wall_a_few_centimetres_away_from_the_end_of_another_stays_apart():
    wall = [sheet(0, 0, 2, 0), sheet(0, 0.2, 2, 0.2), sheet(2, 0, 2, 0.2)]
    found = fill_slits_between_sheets(shapely.union_all([*wall, box(2.06, 0, 4, 0.2)]), SHEET_M)
    assert found.geom_type == "MultiPolygon"
