"""What closes a wall's gaps: outlines, boundaries, closing candidates."""

import numpy as np
import pytest
import shapely

from pipeline.geometry import wall_gaps
from pipeline.geometry.areas import enclosed_area, enclosed_pieces, trace_outlines, unite
from pipeline.geometry.openings import close_plane, split_into_strips
from pipeline.geometry.wall_gaps import contact_fillings, crack_fillings, gap_beyond_wall_end, gap_fillings, wall_ends
from pipeline.stages.closings import (
    are_rooms_half_of_house,
    bands_at_floor_edge,
    bands_at_open_fronts,
    closings_between_wall_ends,
    makes_a_ring,
)
from pipeline.stages.separation import minimal_separators
from pipeline.values import Opening

FLOOR = shapely.box(0, 0, 5, 4)


def u_shape(thickness: float) -> shapely.Geometry:
    """Three walls round the floor, open below."""
    t = thickness
    return unite([shapely.box(-t, 0, 0, 4 + t), shapely.box(-t, 4, 5 + t, 4 + t), shapely.box(5, 0, 5 + t, 4 + t)])


@pytest.mark.parametrize("thickness", [0.05, 0.1, 0.2, 0.4])
def test_wall_ends_of_any_thickness_are_closed_across_an_open_front(thickness: float) -> None:
    walls = u_shape(thickness)
    assert enclosed_area(walls) == 0
    bands = closings_between_wall_ends(walls, walls, 2.0)
    assert enclosed_area(close_plane(walls, bands)) == pytest.approx(20.0, rel=0.02)


def test_a_closed_house_gets_nothing() -> None:
    walls = unite([u_shape(0.2), shapely.box(-0.2, -0.2, 5.2, 0)])
    assert closings_between_wall_ends(walls, walls, 2.0) == []
    assert are_rooms_half_of_house([FLOOR], walls)


def test_what_meets_a_wall_once_or_two_walls_makes_no_ring() -> None:
    walls = np.array([u_shape(0.2), shapely.box(10, 0, 10.2, 4)])
    assert makes_a_ring(shapely.box(-0.1, 0.1, 5.1, 0.2), walls)
    assert not makes_a_ring(shapely.box(5.1, 0.1, 10.1, 0.2), walls)
    assert not makes_a_ring(shapely.box(5.1, 0.1, 7, 0.2), walls)
    assert not makes_a_ring(shapely.box(7, 0.1, 8, 0.2), walls)
    in_a_corner = np.array([shapely.box(0, 0, 1, 1), shapely.box(1, 1, 2, 2)])
    assert makes_a_ring(shapely.box(0.9, 0, 2, 1.5).difference(shapely.box(1, 0.5, 1.5, 1.5)), in_a_corner)


def closings(*walls: shapely.Geometry, least_m2: float = 2.0) -> list[bytes]:
    plane = unite(walls)
    return [each.polygon.normalize().wkb for each in closings_between_wall_ends(plane, plane, least_m2)]


def test_a_front_closes_alike_beside_another_house_and_around_one() -> None:
    bands = closings(u_shape(0.2))
    beside = shapely.transform(u_shape(0.2), lambda points: np.add(points, (20, 0)))
    assert len(closings(u_shape(0.2), beside)) == 2 * len(bands)
    hut = shapely.box(1, 1, 4, 3).difference(shapely.box(1.2, 1.2, 3.8, 2.8))
    assert closings(u_shape(0.2), hut) == bands
    filled = shapely.box(0.3, 0.3, 4.7, 3.7)  # leaves 5 of the 20 m2
    assert closings(u_shape(0.2), filled, least_m2=4.5) == bands
    assert closings(u_shape(0.2), filled, least_m2=5.2) == []


def test_walls_far_apart_are_no_house() -> None:
    far = unite([shapely.box(0, 0, 0.2, 4), shapely.box(30, 0, 30.2, 4)])
    assert closings_between_wall_ends(far, far, 2.0) == []
    assert not are_rooms_half_of_house([], far)


def test_the_edge_of_the_floor_closes_a_front_and_leaves_the_floor_free() -> None:
    walls = u_shape(0.2)
    bands = bands_at_floor_edge(FLOOR, walls, 2.0)
    assert enclosed_area(close_plane(walls, bands)) == pytest.approx(20.0, rel=0.01)
    assert unite(band.polygon for band in bands).intersection(FLOOR).area < 0.01


def test_a_slab_in_a_garden_is_no_room() -> None:
    walls = shapely.box(-0.2, -0.2, 0, 4)  # one wall along it
    assert bands_at_floor_edge(FLOOR, walls, 2.0) == []


def test_a_floor_that_is_closed_already_gets_nothing() -> None:
    walls = unite([u_shape(0.2), shapely.box(-0.2, -0.2, 5.2, 0)])
    assert bands_at_floor_edge(FLOOR, walls, 2.0) == []


@pytest.mark.parametrize(("depth", "fronts"), [(6.0, 1), (2.5, 0)])
def test_what_walls_leave_open_around_a_deep_room_is_its_front_and_around_a_stage_is_not(
    depth: float, fronts: int
) -> None:
    walls = shapely.box(0, 0, depth + 0.2, 4.4).difference(shapely.box(-1, 0.2, depth, 4.2))
    bands = bands_at_open_fronts(walls, 2.0)
    assert len(bands) == fronts
    assert all(band.polygon.distance(shapely.Point(0.0, 2.0)) < 0.2 for band in bands)


def test_a_corner_has_no_front() -> None:
    corner = shapely.box(0, 0, 4, 4).difference(shapely.box(0.2, 0.2, 5, 5))
    assert bands_at_open_fronts(corner, 2.0) == []


SHELL = shapely.box(-0.2, -0.2, 7.4, 3.2).difference(shapely.box(0, 0, 7.2, 3))
INNER = shapely.union_all([shapely.box(4.0, 1.9, 4.2, 3.0), shapely.box(4.0, 0.0, 4.2, 1.0)])
DOOR = SHELL.union(INNER)
LINTEL = shapely.box(4.0, 1.0, 4.2, 1.9)
CORNICE = shapely.box(4.2, 2.8, 7.2, 3.0)


def in_its_plane(door: shapely.Geometry, piece: shapely.Geometry) -> tuple[list[Opening], list[Opening]]:
    return split_into_strips(
        door, [Opening.closing(piece, "lintel")], *enclosed_pieces(shapely.union_all([door, piece]))
    )


def test_a_piece_is_taken_apart_into_its_opening_and_the_rest() -> None:
    console = shapely.box(4.2, 1.3, 5.5, 1.5)  # one body with the lintel
    (strip,), rest = in_its_plane(DOOR, LINTEL.union(console))
    assert strip.is_strip
    assert strip.strip().symmetric_difference(LINTEL).area < 1e-6
    assert shapely.union_all([c.polygon for c in rest]).symmetric_difference(console).area < 0.01


def test_beside_an_oblique_strip_rounding_leaves_nothing() -> None:
    (x1, y1), (x2, y2) = LINTEL.bounds[:2], LINTEL.bounds[2:]
    uneven = shapely.Polygon([(x1, y1), (x2, y1), (x2, y2 + 0.003), (x1, y2)])  # one end is not square
    walls, piece = (shapely.affinity.rotate(shape, 7.0, origin=(0, 0)) for shape in (DOOR, uneven))
    (strip,), rest = in_its_plane(walls, piece)
    assert strip.is_strip
    assert rest == []


def test_a_piece_over_one_room_only_has_no_opening() -> None:
    strips, rest = in_its_plane(DOOR.union(LINTEL), CORNICE)
    assert strips == []
    assert sum(c.polygon.area for c in rest) == pytest.approx(CORNICE.area, abs=1e-3)


def test_only_what_parts_two_spaces_is_needed() -> None:
    lintel, cornice = Opening.closing(LINTEL, "lintel"), Opening.closing(CORNICE, "lintel")
    closed = enclosed_pieces(shapely.union_all([DOOR, LINTEL, CORNICE]))
    assert minimal_separators(DOOR, [], [lintel, cornice], *closed) == [lintel]
    assert minimal_separators(DOOR, [lintel], [cornice], *closed) == []


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
    gap = gap_beyond_wall_end(end, two, 1.5)
    assert gap is not None
    assert gap.intersection(shapely.box(2, 0, 3, 0.2)).area == pytest.approx(0.2)
    assert gap.intersection(two).area > 0
    assert gap_beyond_wall_end(end, two, 0.9) is None


def test_the_gap_ends_at_the_end_of_a_crossing_wall_that_takes_part_of_its_breadth() -> None:
    crossing = walls((0, 0, 2, 0.2), (3, -3, 3.2, 0.12), (8, -3, 8.2, 3))
    end = next(e for e in wall_ends(crossing) if e.out[0] > 0.9)
    gap = gap_beyond_wall_end(end, crossing, 8.0)
    assert gap is not None
    assert gap.bounds[2] == pytest.approx(3.0, abs=0.02)


@pytest.mark.parametrize(("width", "found"), [(0.025, 1), (0.9, 1), (1.2, 1), (1.6, 0)])
def test_a_gap_in_a_wall_is_one_up_to_its_widest(width: float, found: int) -> None:
    two = walls((0, 0, 2, 0.2), (2 + width, 0, 6, 0.2))
    assert len(gap_fillings(two, [two], 1.5)) == found


@pytest.mark.parametrize(("width", "found"), [(0.9, 1), (1.4, 0)])
def test_a_gap_beside_a_crossing_wall_is_as_wide_as_a_door_at_most(width: float, found: int) -> None:
    crossing = walls((0, 0, 2, 0.2), (2 + width, -3, 2.2 + width, 3))
    assert len(gap_fillings(crossing, [crossing], 1.5)) == found


def test_a_gap_that_a_lintel_fills_is_none() -> None:
    two = walls((0, 0, 2, 0.2), (3, 0, 5, 0.2))
    assert gap_fillings(two, [two, shapely.box(2, 0, 3, 0.2)], 1.5) == []


def test_walls_of_two_thicknesses_share_one_gap() -> None:
    two = walls((0, 0, 2, 0.2), (3, 0.05, 5, 0.15))
    assert len(gap_fillings(two, [two], 1.5)) == 1


def test_gaps_come_shortest_first() -> None:
    three = walls((0, 0, 2, 0.2), (3.2, 0, 5, 0.2), (5.8, 0, 8, 0.2))
    assert [round(g.bounds[0], 1) for g in gap_fillings(three, [three], 1.5)] == [5.0, 2.0]


def test_a_wall_may_end_close_to_a_corner() -> None:
    hook = walls((0, 0, 3, 0.15), (3, 0, 3.15, 4), (3.15, 0, 3.3, 0.15), (4.2, 0, 6, 0.15))  # a stub of 0.15 m
    assert [round(g.bounds[0], 1) for g in gap_fillings(hook, [hook], 1.5)] == [3.3]


def test_a_nib_faces_the_end_of_its_wall() -> None:
    nib = walls((0, -3, 0.15, 3), (0.15, 0, 0.3, 0.15), (1.7, 0, 5, 0.15))
    assert len(gap_fillings(nib, [nib], 1.5)) == 1


def test_two_nibs_face_each_other() -> None:
    nibs = walls((0, -3, 0.15, 3), (0.15, 0, 0.3, 0.15), (1.3, 0, 1.45, 0.15), (1.45, -3, 1.6, 3))
    assert len(gap_fillings(nibs, [nibs], 1.5)) == 1


def test_a_pilaster_parts_no_corridor() -> None:
    pilaster = walls((0, -3, 0.15, 3), (0.15, 0, 0.3, 0.15), (1.3, -3, 1.45, 3))
    assert gap_fillings(pilaster, [pilaster], 1.5) == []


def test_pillars_in_a_row_are_no_wall() -> None:
    row = walls(*((x, 0, x + 0.3, 0.3) for x in range(4)))
    assert gap_fillings(row, [row], 1.5) == []


def test_a_nib_and_an_end_out_of_line_leave_no_gap() -> None:
    aside = walls((0, -3, 0.15, 3), (0.15, 0, 0.3, 0.15), (1.7, 0.1, 5, 0.25))
    assert gap_fillings(aside, [aside], 1.5) == []


def tee(middle_y: float) -> shapely.Polygon:
    """A wall that juts up from another, whose end has a point in its middle: of all it lies farthest from the other."""
    stem = [(-0.1, 0), (-0.1, 2), (0, middle_y), (0.1, 2), (0.1, 0)]
    return shapely.Polygon([(-4, 0), *stem, (4, 0), (3, -0.2), (-3, -0.2)])


def test_a_point_in_the_middle_of_an_edge_is_no_corner() -> None:
    wall = tee(2.00001)
    assert len(wall.simplify(0.002).exterior.coords) - 1 == 9  # what simplifying alone leaves
    found = trace_outlines([wall], 0.002).points
    assert len(found) == 8
    assert shapely.Polygon(found).symmetric_difference(wall).area < 1e-5
    assert [np.round(end.out, 6).tolist() for end in wall_ends(wall) if end.out[1] > 0.9] == [[0.0, 1.0]]


def test_details_larger_than_asked_for_stay() -> None:
    found = trace_outlines([tee(2.005)], 0.002).points
    assert len(found) == 9
    nib = shapely.union(shapely.box(0, 0, 2, 0.2), shapely.box(1.0, 0.2, 1.5, 0.21))
    assert len(trace_outlines([nib], 0.002).points) == 8


@pytest.mark.parametrize("size_m", [0.001, 0.003, 1.0])
def test_of_a_rectangle_all_corners_stay(size_m: float) -> None:
    found = trace_outlines([shapely.box(0, 0, size_m, size_m)], 0.002).points
    assert len(found) >= 3


def test_each_corner_knows_its_ring_its_area_and_its_neighbours() -> None:
    yard = shapely.box(0, 0, 9, 9).difference(shapely.box(3, 3, 4, 4))
    found = trace_outlines([shapely.box(20, 0, 21, 1), yard], 0.002)
    assert found.ring.tolist() == [0] * 4 + [1] * 4 + [2] * 4
    assert found.area.tolist() == [0] * 4 + [1] * 8
    assert found.after.tolist() == [1, 2, 3, 0, 5, 6, 7, 4, 9, 10, 11, 8]
    assert found.before.tolist() == [3, 0, 1, 2, 7, 4, 5, 6, 11, 8, 9, 10]
    x, y = found.points.T
    turned = x * y[found.after] - x[found.after] * y
    assert (np.bincount(found.ring, turned) / 2).round(9).tolist() == [1.0, 81.0, -1.0]  # a hole runs clockwise


RING = shapely.difference(shapely.box(0, 0, 6, 4), shapely.box(0.2, 0.2, 5.8, 3.8))


@pytest.mark.parametrize(
    ("walls", "cracks"),
    [
        ([RING], 0),
        ([RING, shapely.box(2, 1, 2.3, 1.3)], 0),  # a pillar
        ([RING, shapely.box(2.9, 0.2, 3.1, 3.65)], 1),  # a partition that ends before the outer wall
        ([RING, shapely.box(2.9, 0.35, 3.1, 3.65)], 2),  # one that nearly meets it at both ends
        ([shapely.box(0, 0, 3, 0.2), shapely.box(3.1, 0, 3.3, 3)], 1),  # walls that enclose nothing
        ([shapely.difference(RING, shapely.box(3, 0, 3.05, 0.2))], 1),  # a wall with a slit
        (
            [shapely.difference(RING, shapely.box(3, 0.05, 3.1, 0.15)), shapely.box(2.9, 0.2, 3.1, 3.65)],
            1,
        ),  # and a hole
        ([RING, shapely.box(5.9, 4.05, 6.1, 8)], 1),
        ([], 0),
    ],
)
def test_cracks_are_what_lies_between_walls_that_nearly_meet(walls, cracks, monkeypatch):
    plane = unite(walls)
    found = crack_fillings(plane)
    assert len(found) == cracks
    monkeypatch.setattr(wall_gaps, "_joins_or_parts", lambda *_: True)
    assert [each.wkb for each in crack_fillings(plane)] == [each.wkb for each in found]


@pytest.mark.parametrize("apart", [0.0, 1e-9, 2e-4])
def test_cells_that_touch_corner_to_corner_enclose_a_room(apart: float) -> None:
    side, count = 0.05, 40
    steps = [(k, count - abs(k)) for k in range(-count, count + 1)]
    corners = {(x, sign * y) for x, y in steps for sign in (-1, 1)}
    cells = unite(shapely.box(x * side + apart, y * side, (x + 1) * side - apart, (y + 1) * side) for x, y in corners)
    assert enclosed_area(cells) == 0
    fillings = contact_fillings(cells)
    assert len(fillings) == len(corners)
    assert enclosed_area(unite([cells, *fillings])) == pytest.approx(2 * (count * side) ** 2, rel=0.1)


def test_walls_that_overlap_or_stand_apart_have_no_contact_to_fill() -> None:
    walls = unite([u_shape(0.2), shapely.box(-0.2, -0.2, 5.2, 0.01)])
    assert contact_fillings(walls) == []
    assert contact_fillings(unite([u_shape(0.2), shapely.box(-0.2, -0.2, 5.2, -0.01)])) == []


@pytest.mark.parametrize("short", [0.05, 0.2, 0.3])
def test_walls_that_an_outer_wall_is_missing_from_end_before_the_edge_of_its_slab(short: float) -> None:
    """The slab lies under the outer wall too, and the others met that wall at its inner face."""
    walls = unite([shapely.box(*u_shape(0.2).bounds).difference(shapely.box(0, -0.2, 5, 4)), shapely.box(2, 0, 2.1, 4)])
    walls = walls.difference(shapely.box(-1, -1, 6, short))
    floor = shapely.box(-0.2, 0, 5.2, 4.2)
    whole = close_plane(walls, bands_at_floor_edge(floor, walls, 2.0))
    assert enclosed_area(whole) == pytest.approx(19.6, rel=0.02)
    assert len(enclosed_pieces(whole)[1]) == 2


@pytest.mark.parametrize("short", [0.0, 0.1, 0.3])
def test_an_inner_wall_that_ends_before_an_open_front_leaves_no_gap_in_it(short: float) -> None:
    walls = unite([u_shape(0.2), shapely.box(2, short, 2.3, 3)])
    bands = bands_at_floor_edge(FLOOR, walls, 2.0)
    assert enclosed_area(close_plane(walls, bands)) == pytest.approx(20.0 - 0.3 * (3 - short), rel=0.02)
