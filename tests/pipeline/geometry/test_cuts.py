import numpy as np
import pytest
import shapely

from pipeline.geometry.bridges import Bridge
from pipeline.geometry.cuts import CutRules, cuts_on_lines
from pipeline.geometry.spaces import standing_pieces

LEFT, RIGHT = shapely.box(0, 0, 4, 3), shapely.box(4.2, 0, 7.2, 3)
FLOOR = shapely.union_all([LEFT, RIGHT])
WALLS = shapely.box(-0.2, -0.2, 7.4, 3.2).difference(FLOOR)
RULES = CutRules(width_m=0.8, deepest_m=1.5, only_walls=True)


def cuts(
    line: object, floor: shapely.Geometry = FLOOR, walls: shapely.Geometry = WALLS, rules: CutRules = RULES
) -> list[Bridge]:
    return [cut for _, cut in cuts_on_lines(np.array([line], float), standing_pieces(floor, 0.2), floor, walls, rules)]


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
    found = list(cuts_on_lines(lines, standing_pieces(FLOOR, 0.2), FLOOR, WALLS, RULES))
    assert [line[0].tolist() for line, _ in found] == [
        [2.0, 0.5],
        [2.0, 2.5],
    ]  # the third meets the wall where the second does


def test_open_air_is_cut_only_where_that_is_asked_for() -> None:
    away = shapely.affinity.translate(RIGHT, 1.0)
    floor, walls = LEFT.union(away), LEFT.buffer(0.1).union(away.buffer(0.1)).difference(LEFT.union(away))
    assert cuts([(2, 1), (7, 1)], floor, walls) == []
    (cut,) = cuts([(2, 1), (7, 1)], floor, walls, CutRules(0.8, 12.0, only_walls=False))
    assert cut.depth == pytest.approx(1.2)


def test_a_wall_too_thick_is_not_cut() -> None:
    assert cuts([(2, 1), (6, 1)], rules=CutRules(0.8, 0.1, only_walls=True)) == []


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
