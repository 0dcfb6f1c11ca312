import numpy as np
import pytest
import shapely

from pipeline.geometry.closing import gap_at, gaps, wall_ends


def walls(*rectangles: tuple[float, float, float, float]) -> shapely.Geometry:
    return shapely.union_all([shapely.box(*r) for r in rectangles])


def test_a_wall_ends_where_it_is_short_and_square() -> None:
    ends = list(wall_ends(walls((0, 0, 3, 0.2))))
    assert sorted(tuple(np.round(end.out, 6).tolist()) for end in ends) == [(-1.0, 0.0), (1.0, 0.0)]
    assert not list(wall_ends(walls((0, 0, 0.3, 0.3))))  # a pillar
    assert not list(wall_ends(walls((0, 0, 3, 0.9))))  # too thick for a wall


def test_a_wall_that_meets_another_ends_once() -> None:
    tee = walls((0, 0, 3, 0.2), (-0.2, -2, 0, 2))
    assert len([end for end in wall_ends(tee) if abs(end.out[0]) > 0.5]) == 1


def test_the_gap_reaches_into_the_wall_it_points_at() -> None:
    two = walls((0, 0, 2, 0.2), (3, 0, 5, 0.2))
    end = next(e for e in wall_ends(two) if e.out[0] > 0.9 and e.a[0] < 2.5)
    gap = gap_at(end, two, 1.5)
    assert gap is not None
    assert gap.intersection(shapely.box(2, 0, 3, 0.2)).area == pytest.approx(0.2)
    assert gap.intersection(two).area > 0
    assert gap_at(end, two, 0.9) is None


@pytest.mark.parametrize(("width", "found"), [(0.025, 1), (0.9, 1), (1.2, 1), (1.6, 0)])
def test_a_gap_in_a_wall_is_one_up_to_its_widest(width: float, found: int) -> None:
    two = walls((0, 0, 2, 0.2), (2 + width, 0, 6, 0.2))
    assert len(gaps(two, [two], 1.5)) == found


@pytest.mark.parametrize(("width", "found"), [(0.9, 1), (1.4, 0)])
def test_a_gap_beside_a_crossing_wall_is_as_wide_as_a_door_at_most(width: float, found: int) -> None:
    crossing = walls((0, 0, 2, 0.2), (2 + width, -3, 2.2 + width, 3))
    assert len(gaps(crossing, [crossing], 1.5)) == found


def test_a_gap_that_a_lintel_fills_is_none() -> None:
    two = walls((0, 0, 2, 0.2), (3, 0, 5, 0.2))
    assert gaps(two, [two, shapely.box(2, 0, 3, 0.2)], 1.5) == []


def test_walls_of_two_thicknesses_share_one_gap() -> None:
    two = walls((0, 0, 2, 0.2), (3, 0.05, 5, 0.15))
    assert len(gaps(two, [two], 1.5)) == 1


def test_gaps_come_shortest_first() -> None:
    three = walls((0, 0, 2, 0.2), (3.2, 0, 5, 0.2), (5.8, 0, 8, 0.2))
    assert [round(g.bounds[0], 1) for g in gaps(three, [three], 1.5)] == [5.0, 2.0]


def test_a_wall_may_end_close_to_a_corner() -> None:
    hook = walls((0, 0, 3, 0.15), (3, 0, 3.15, 4), (3.15, 0, 3.3, 0.15), (4.2, 0, 6, 0.15))  # a stub of 0.15 m
    assert [round(g.bounds[0], 1) for g in gaps(hook, [hook], 1.5)] == [3.3]


def test_a_nib_faces_the_end_of_its_wall() -> None:
    nib = walls((0, -3, 0.15, 3), (0.15, 0, 0.3, 0.15), (1.7, 0, 5, 0.15))
    assert len(gaps(nib, [nib], 1.5)) == 1


def test_two_nibs_face_each_other() -> None:
    nibs = walls((0, -3, 0.15, 3), (0.15, 0, 0.3, 0.15), (1.3, 0, 1.45, 0.15), (1.45, -3, 1.6, 3))
    assert len(gaps(nibs, [nibs], 1.5)) == 1


def test_a_pilaster_parts_no_corridor() -> None:
    pilaster = walls((0, -3, 0.15, 3), (0.15, 0, 0.3, 0.15), (1.3, -3, 1.45, 3))
    assert gaps(pilaster, [pilaster], 1.5) == []


def test_pillars_in_a_row_are_no_wall() -> None:
    row = walls(*((x, 0, x + 0.3, 0.3) for x in range(4)))
    assert gaps(row, [row], 1.5) == []


def test_a_nib_and_an_end_out_of_line_leave_no_gap() -> None:
    aside = walls((0, -3, 0.15, 3), (0.15, 0, 0.3, 0.15), (1.7, 0.1, 5, 0.25))
    assert gaps(aside, [aside], 1.5) == []
