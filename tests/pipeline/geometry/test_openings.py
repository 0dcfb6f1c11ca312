"""Passages: between which rooms they lead, how they fit them, where somebody can stand, and cuts."""

import numpy as np
import pytest
import shapely

from pipeline.geometry.areas import OUTSIDE, enclosed_pieces
from pipeline.geometry.openings import (
    Opening,
    distance_in_row,
    end_at_walls,
    find_strips,
    free_intervals,
    join_in_rows,
    strips_before,
    strips_of,
)
from pipeline.geometry.rooms_and_passages import (
    erode_floor,
    fit_to_rooms,
    nearest_piece,
    polygons_between_rooms,
    sample_points,
    walkable_floor,
)
from pipeline.stages.connectivity import CutRules, cut_walls_along_lines
from pipeline.values import Spaces

SHELL = shapely.box(-0.2, -0.2, 7.4, 3.2).difference(shapely.box(0, 0, 7.2, 3))
UPPER, LOWER = shapely.box(4.0, 1.9, 4.2, 3.0), shapely.box(4.0, 0.0, 4.2, 1.0)
DOOR = shapely.union_all([SHELL, UPPER, LOWER])
LINTEL = shapely.box(4.0, 1.0, 4.2, 1.9)


def found(piece: shapely.Polygon, door: shapely.Geometry = DOOR) -> list[Opening]:
    plane, rooms = enclosed_pieces(shapely.union_all([door, piece]))
    return find_strips([piece], rooms, plane, door)[0]


def test_a_lintel_is_an_opening_from_face_to_face() -> None:
    (opening,) = found(LINTEL)
    assert opening.centre == pytest.approx([4.1, 1.45])
    assert (opening.width, opening.depth) == (pytest.approx(0.9), pytest.approx(0.2))
    assert set(opening.sides) == {0, 1}
    assert opening.strip().symmetric_difference(LINTEL).area < 1e-9
    assert sorted(opening.segment[:, 1].tolist()) == pytest.approx([1.0, 1.9])
    assert opening.has_jamb(DOOR)
    assert opening.has_two_jambs(DOOR)
    assert not opening.has_two_jambs(DOOR.difference(LOWER))


def test_a_film_that_rounding_left_shuts_nothing() -> None:
    lapping = LINTEL.buffer(0.002, join_style="mitre")  # so that the film joins what it has of both jambs
    (opening,) = found(lapping, shapely.union_all([DOOR, shapely.box(4.0, 1.0, 4.0 + 1e-9, 1.9)]))
    assert opening.width == pytest.approx(0.9, abs=0.01)
    assert found(lapping, shapely.union_all([DOOR, shapely.box(4.0, 1.0, 4.1, 1.9)])) == []


def test_across_points_from_the_first_side_to_the_second() -> None:
    (opening,) = found(LINTEL)
    rooms = enclosed_pieces(DOOR.union(LINTEL))[1]
    for side, sign in zip(opening.sides, (-1, 1), strict=True):
        assert rooms[side].contains(shapely.Point(opening.centre + sign * 0.2 * opening.across))


def test_a_lintel_in_an_outer_wall_leads_outside() -> None:
    hole = shapely.box(1, -0.2, 2, 0)
    (opening,) = found(hole, DOOR.union(LINTEL).difference(hole))
    assert OUTSIDE in opening.sides


@pytest.mark.parametrize("step", [(4.2, 1.0, 5.0, 1.2), (4.2, 1.3, 5.0, 1.5), (4.2, 1.7, 5.0, 1.9)])
def test_a_step_that_hangs_before_a_lintel_is_no_part_of_the_wall(step: tuple[float, float, float, float]) -> None:
    (opening,) = found(LINTEL.union(shapely.box(*step)))
    assert opening.strip().symmetric_difference(LINTEL).area < 1e-3


def test_a_lintel_thicker_for_a_part_of_it_is_as_deep_as_that() -> None:
    (opening,) = found(LINTEL.union(shapely.box(4.2, 1.6, 4.3, 1.9)))
    assert (opening.width, opening.depth) == (pytest.approx(0.9), pytest.approx(0.3))


def test_a_shelf_in_a_room_is_none() -> None:
    assert found(shapely.box(0, 0, 0.3, 2)) == []


def test_an_oblique_lintel() -> None:
    turn = [shapely.affinity.rotate(g, 17, origin=(0, 0)) for g in (LINTEL, DOOR)]
    (opening,) = found(*turn)
    assert (opening.width, opening.depth) == (pytest.approx(0.9, abs=1e-6), pytest.approx(0.2, abs=1e-6))
    assert abs(opening.along @ [-np.sin(np.deg2rad(17)), np.cos(np.deg2rad(17))]) == pytest.approx(1)


def test_a_strip_wider_and_deeper() -> None:
    opening = Opening(np.array([1.0, 2.0]), np.array([1.0, 0.0]), 0.8, 0.2, (0, 1))
    assert opening.strip(deeper_m=0.1, wider_m=0.2).bounds == pytest.approx((0.4, 1.8, 1.6, 2.2))
    assert opening.part_between(-0.4, 0.0).strip().bounds == pytest.approx((0.6, 1.9, 1.0, 2.1))


def test_what_stands_in_a_strip_divides_it() -> None:
    opening = Opening(np.array([0.0, 0.0]), np.array([1.0, 0.0]), 2.0, 0.2, (0, 1))
    post = shapely.box(-0.1, -0.1, 0.1, 0.1)
    assert free_intervals(opening, post) == [pytest.approx((-1.0, -0.1)), pytest.approx((0.1, 1.0))]
    assert free_intervals(opening, shapely.Polygon()) == [(-1.0, 1.0)]


@pytest.mark.parametrize(("apart", "sides", "number"), [(0.3, (0, 1), 1), (0.3, (0, 2), 2), (0.8, (0, 1), 2)])
def test_neighbours_in_a_row_are_one_opening(apart: float, sides: tuple[int, int], number: int) -> None:
    first = Opening(np.array([0.0, 0.0]), np.array([1.0, 0.0]), 1.0, 0.2, (0, 1))
    second = Opening(np.array([1.0 + apart, 0.02]), np.array([1.0, 0.0]), 1.0, 0.2, sides)
    result = join_in_rows([first, second], shapely.Polygon())
    assert len(result) == number
    if number == 1:
        assert result[0].width == pytest.approx(2.0 + apart)
        assert result[0].depth == pytest.approx(0.22)


def test_the_distance_in_a_row() -> None:
    first = Opening(np.array([0.0, 0.0]), np.array([1.0, 0.0]), 1.0, 0.2, (0, 1))
    second = Opening(np.array([0.0, 1.5]), np.array([1.0, 0.0]), 1.0, 0.2, (0, 1))
    crossing = Opening(np.array([1.0, 0.0]), np.array([0.0, 1.0]), 1.0, 0.2, (0, 1))
    in_row = Opening(np.array([-2.0, 0.0]), np.array([-1.0, 0.0]), 1.0, 0.2, (1, 0))
    assert distance_in_row(first, second) is None
    assert distance_in_row(first, crossing) is None
    assert distance_in_row(first, in_row) == pytest.approx(1.0)


ROOMS = [shapely.box(0, 0, 4, 3), shapely.box(4.2, 0, 7.2, 3)]


def strip_at(x: float, depth: float, sides: tuple[int, int] = (1, 0)) -> Opening:
    """Across a wall at ``x``, 0.8 m wide; across points left, as along points up."""
    return Opening(np.array([x, 1.5]), np.array([0.0, 1.0]), 0.8, depth, sides)


def test_an_opening_reaches_from_face_to_face() -> None:
    for x, depth in ((4.1, 0.3), (4.08, 0.1), (4.12, 0.22)):
        (found,) = fit_to_rooms([strip_at(x, depth)], ROOMS)
        assert found.centre == pytest.approx([4.1, 1.5])
        assert found.depth == pytest.approx(0.2)


def test_on_the_outside_it_stays_where_it_was() -> None:
    (found,) = fit_to_rooms([strip_at(7.3, 0.14, (OUTSIDE, 1))], ROOMS)
    assert (found.centre[0] - found.depth / 2, found.centre[0] + found.depth / 2) == pytest.approx((7.2, 7.37))


def test_the_opening_lies_between_the_two_faces() -> None:
    (opening,) = polygons_between_rooms([strip_at(4.1, 0.2)], ROOMS)
    assert opening.symmetric_difference(shapely.box(4.0, 1.1, 4.2, 1.9)).area < 1e-6


def test_the_opening_follows_faces_that_are_not_parallel() -> None:
    wedge = shapely.Polygon([(4.2, 0), (7.2, 0), (7.2, 3), (4.3, 3)])
    (opening,) = polygons_between_rooms([strip_at(4.13, 0.25)], [ROOMS[0], wedge])
    assert opening.area == pytest.approx(0.8 * (0.2 + 0.1 * 0.5), rel=0.01)
    assert opening.touches(wedge) or opening.intersection(wedge).area < 1e-6


def test_strips_of_openings_and_the_floor_before_them() -> None:
    between, outer = strip_at(4.1, 0.2), Opening(np.array([6.0, -0.1]), np.array([1.0, 0.0]), 1.0, 0.2, (OUTSIDE, 1))
    strips = strips_of([between, outer], deeper_m=0.1, wider_m=0.2)
    assert strips[0].equals(between.strip(deeper_m=0.1, wider_m=0.2))
    assert strips[1].symmetric_difference(shapely.box(5.3, -0.3, 6.7, 0.1)).area < 1e-9
    left, inner = strips_before([between, outer], [1, 1], 0.6)
    assert left.symmetric_difference(shapely.box(3.4, 1.1, 4.0, 1.9)).area < 1e-9
    assert inner.symmetric_difference(shapely.box(5.5, 0.0, 6.5, 0.6)).area < 1e-9
    assert end_at_walls([between, outer], UPPER.union(shapely.box(4.0, 0.0, 4.2, 1.1))).tolist() == [True, False]
    assert len(strips_of([])) == len(strips_before([], [], 0.6)) == len(end_at_walls([], UPPER)) == 0


def test_a_house_without_passages_needs_no_fitting() -> None:
    assert fit_to_rooms([], ROOMS) == []
    assert polygons_between_rooms([], ROOMS) == []


TWO_ROOMS = (shapely.box(0, 0, 4, 3), shapely.box(4.2, 0, 7.2, 3))


def spaces(width: float, kind: str = "door") -> Spaces:
    sides = (0, OUTSIDE) if kind == "entrance" else (0, 1)
    opening = Opening(np.array([4.1, 1.5]), np.array([0.0, -1.0]), width, 0.2, sides, kind)
    return Spaces(shapely.Polygon(), TWO_ROOMS, (opening,))


@pytest.mark.parametrize(
    ("width", "kind", "pieces"), [(0.8, "door", 1), (0.41, "cut", 1), (0.39, "door", 2), (0.8, "entrance", 2)]
)
def test_a_passage_joins_what_the_disc_gets_through(width: float, kind: str, pieces: int) -> None:
    assert len(erode_floor(walkable_floor(spaces(width, kind)), 0.2)) == pieces


def test_pieces_come_largest_first_without_specks() -> None:
    floor = shapely.union_all([TWO_ROOMS[1], TWO_ROOMS[0], shapely.box(10, 0, 10.42, 0.42)])
    assert [round(p.area, 2) for p in erode_floor(floor, 0.2)] == [9.36, 6.76]


def test_samples_are_uniform_and_every_piece_has_one() -> None:
    pieces = erode_floor(walkable_floor(spaces(0.3)), 0.2)
    points = sample_points(pieces, 1000, np.random.default_rng(3))
    assert points.shape == (1002, 2)
    assert shapely.contains_xy(shapely.union_all(pieces).buffer(1e-9), *points.T).all()
    share = (nearest_piece(points, pieces) == 0).mean()
    assert share == pytest.approx(3.6 / 6.2, abs=0.05)
    assert set(nearest_piece(points[:2], pieces).tolist()) == {0, 1}


LEFT, RIGHT = shapely.box(0, 0, 4, 3), shapely.box(4.2, 0, 7.2, 3)
FLOOR = shapely.union_all([LEFT, RIGHT])
WALLS = shapely.box(-0.2, -0.2, 7.4, 3.2).difference(FLOOR)
RULES = CutRules(width_m=0.8, deepest_m=1.5)


def cuts(
    line: object, floor: shapely.Geometry = FLOOR, walls: shapely.Geometry = WALLS, rules: CutRules = RULES
) -> list[Opening]:
    return [
        cut for _, cut in cut_walls_along_lines(np.array([line], float), erode_floor(floor, 0.2), floor, walls, rules)
    ]


def test_a_cut_is_where_the_line_meets_the_wall_and_at_right_angles_to_it() -> None:
    (cut,) = cuts([(2, 1), (6, 1.4)])
    assert cut.centre == pytest.approx([4.1, 1.2], abs=0.02)
    assert (cut.width, cut.depth) == (0.8, pytest.approx(0.2))
    assert abs(cut.along[0]) < 1e-9
    assert cut.strip().intersection(WALLS).area == pytest.approx(0.16)


def test_a_slanted_line_still_cuts_straight() -> None:
    (cut,) = cuts([(3.5, 0.5), (4.7, 2.5)])
    assert cut.strip().bounds == pytest.approx((4.0, cut.centre[1] - 0.4, 4.2, cut.centre[1] + 0.4))


@pytest.mark.parametrize("y", [0.05, 0.3, 2.9])
def test_a_cut_slides_off_a_corner(y: float) -> None:
    (cut,) = cuts([(2, y), (6, y)])
    assert 0.4 <= cut.centre[1] <= 2.6
    assert abs(cut.centre[1] - y) < 0.5


def test_a_cut_slides_off_a_crossing_wall() -> None:
    across = shapely.box(4.2, 1.4, 7.2, 1.6)
    (cut,) = cuts([(2, 1.5), (6, 1.7)], FLOOR.difference(across), WALLS.union(across))
    assert not 1.0 < cut.centre[1] < 2.0


def test_the_thinnest_wall_of_a_line_comes_first() -> None:
    thin = shapely.box(5.5, 0, 5.55, 3)
    found = cuts([(2, 1.5), (6.5, 1.5)], FLOOR.difference(thin), WALLS.union(thin))
    assert [round(c.depth, 2) for c in found] == [0.05, 0.2]


def test_no_wall_is_cut_that_a_robot_gets_around() -> None:
    stub = shapely.box(6.0, 0, 6.1, 2)
    (cut,) = cuts([(2, 1), (6.8, 1)], FLOOR.difference(stub), WALLS.union(stub))
    assert cut.centre[0] == pytest.approx(4.1)


def test_each_cut_comes_with_its_line() -> None:
    lines = np.array([[(2, 0.5), (6, 0.5)], [(2, 2.5), (6, 2.5)], [(2.1, 2.5), (6, 2.5)]])
    found = list(cut_walls_along_lines(lines, erode_floor(FLOOR, 0.2), FLOOR, WALLS, RULES))
    assert [line[0].tolist() for line, _ in found] == [
        [2.0, 0.5],
        [2.0, 2.5],
    ]  # the third meets the wall where the second does


def test_open_air_is_not_cut() -> None:
    away = shapely.affinity.translate(RIGHT, 1.0)
    floor, walls = LEFT.union(away), LEFT.buffer(0.1).union(away.buffer(0.1)).difference(LEFT.union(away))
    assert cuts([(2, 1), (7, 1)], floor, walls, CutRules(0.8, 12.0)) == []


def test_a_wall_too_thick_is_not_cut() -> None:
    assert cuts([(2, 1), (6, 1)], rules=CutRules(0.8, 0.1)) == []


def test_an_oblique_wall() -> None:
    floor, walls = (shapely.affinity.rotate(g, 30, origin=(4.1, 1.5)) for g in (FLOOR, WALLS))
    (cut,) = cuts([(2.5, 1.5), (5.7, 1.5)], floor, walls)
    assert cut.depth == pytest.approx(0.2, abs=1e-6)
    assert cut.centre == pytest.approx([4.1, 1.5], abs=0.07)  # the line meets the near face aside of the middle


@pytest.mark.parametrize(("depth", "in_niche"), [(0.12, True), (0.04, False)])
def test_a_cut_prefers_a_place_where_the_wall_is_much_thinner(depth: float, in_niche: bool) -> None:
    niche = shapely.box(4.2 - depth, 1.5, 4.2, 2.4)  # a leaf that is one body with the wall leaves one
    (cut,) = cuts([(2, 0.8), (6, 0.8)], FLOOR.union(niche), WALLS.difference(niche))
    assert (cut.depth < 0.1) == in_niche
    assert cut.centre[1] == pytest.approx(1.95 if in_niche else 0.8, abs=0.06)
