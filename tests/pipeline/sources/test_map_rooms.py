"""How a map is divided: pieces of wall, rays through windows and doors, doorways of drawn maps, on maps drawn here."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
import shapely

from pipeline.sources.occupancy_map.clutter import fill_clutter
from pipeline.sources.occupancy_map.enclosure import (
    find_fans,
    unreached_rooms,
    unseen_islands,
    wall_share,
    with_scattered_cells,
    without_fans,
)
from pipeline.sources.occupancy_map.gaps import area_of_cells, find_doorways
from pipeline.sources.occupancy_map.narrow_places import measure_gaps
from pipeline.sources.occupancy_map.rooms import (
    RoomConnection,
    _with_ways_where_rooms_touch,
    count_in_blocks,
    segment_rooms,
)

CELL_M = 0.05


def hall_with_pieces(piece_m: float = 1.5, thick_cells: int = 2) -> np.ndarray:
    """Two halls of 10 m x 4 m; the wall between them is 3 m at both ends, and a piece in the middle of the rest."""
    free = np.zeros((168, 204), bool)
    free[2:166, 2:202] = True
    free[82:84, :62] = free[82:84, 142:] = False
    half = round(piece_m / CELL_M / 2)
    free[83 - thick_cells // 2 : 83 + (thick_cells + 1) // 2, 102 - half : 102 + half] = False
    return free


def test_a_piece_of_wall_between_two_doors_is_no_clutter() -> None:
    free = hall_with_pieces()
    assert (fill_clutter(free, CELL_M) == free).all()


def test_what_is_as_long_but_thick_or_in_no_line_is_clutter() -> None:
    table = hall_with_pieces(thick_cells=12)
    assert fill_clutter(table, CELL_M)[83, 102]
    bench = hall_with_pieces()
    bench[82:84] = True  # no wall beside it
    bench[82:84, 87:117] = False
    assert fill_clutter(bench, CELL_M)[83, 102]


def test_a_piece_of_wall_stays_in_a_turned_map() -> None:
    row, col = np.indices((300, 300))
    x, y = (np.array([[0.8, 0.6], [-0.6, 0.8]]) @ np.stack([col.ravel() - 150, row.ravel() - 150])).reshape(2, 300, 300)
    free = (np.abs(x) < 100) & (np.abs(y) < 80)
    free &= ~((np.abs(y) < 1) & ((np.abs(x) > 40) | (np.abs(x) < 15)))
    assert not fill_clutter(free, CELL_M)[150, 150]


def test_scattered_free_cells_belong_to_the_nearest_room_but_not_through_a_wall() -> None:
    label = np.zeros((60, 60), np.int32)
    label[:30] = 1
    free = label > 0
    free[34, 10] = free[34, 50] = free[56, 10] = True
    occupied = np.zeros_like(free)
    occupied[31, 30:] = True
    found = with_scattered_cells(label, free, occupied, CELL_M)
    assert (found[34, 10], found[34, 50], found[56, 10]) == (1, 0, 0)  # the last is 1.35 m away
    assert (found[:30] == 1).all()
    assert not found[31:34].any()


def test_a_large_piece_of_rays_beside_a_room_is_not_scattered() -> None:
    """As beyond a row of windows: the room would grow by a metre."""
    label = np.zeros((60, 260), np.int32)
    label[:30] = 1
    free = label > 0
    free[34:56, ::2] = free[55] = True  # 7.5 m2 in one piece
    assert (with_scattered_cells(label, free, np.zeros_like(free), CELL_M) == label).all()


def test_a_corridor_is_not_cut_at_a_wide_niche() -> None:
    """Its walls come nearer to each other, to 1.5 m, between two halves of 30 m2."""
    free = np.zeros((50, 640), bool)
    free[2:48, 2:638] = True
    free[2:10, 310:330] = free[40:48, 310:330] = False
    parts = segment_rooms(free, CELL_M)
    assert len(np.unique(parts.label)) == 2


def test_a_map_without_known_walls_keeps_its_rooms() -> None:
    free = hall_with_pieces()
    free[82:84] = False
    free[82:84, 100:118] = True
    plain = segment_rooms(free, CELL_M)
    known = segment_rooms(free, CELL_M, occupied=~free)
    assert (plain.label == known.label).all()
    assert len(known.ways) == 1


def house() -> np.ndarray:
    """A room of 100 x 60 cells."""
    free = np.zeros((64, 104), bool)
    free[2:62, 2:102] = True
    return free


def doorways(free: np.ndarray) -> list[list[tuple[float, float]]]:
    return [sorted(map(tuple, corners.tolist())) for corners in find_doorways(free, CELL_M)]


def test_two_ends_of_a_wall_face_each_other() -> None:
    free = house()
    free[:, 40:44] = False
    free[20:38, 40:44] = True
    assert doorways(free) == [[(40.0, 20.0), (40.0, 38.0), (44.0, 20.0), (44.0, 38.0)]]


def test_an_end_faces_the_wall_that_runs_across() -> None:
    free = house()
    free[:44, 40:44] = False
    assert doorways(free) == [[(40.0, 44.0), (40.0, 62.0), (44.0, 44.0), (44.0, 62.0)]]


def test_a_stub_far_from_the_wall_has_no_doorway() -> None:
    free = house()
    free[:10, 40:44] = False
    assert doorways(free) == []


def test_ends_too_far_apart_and_the_side_of_a_pillar_have_none() -> None:
    free = house()
    free[:, 40:44] = False
    free[2:62, 40:44] = True
    free[30:44, 60:74] = False  # thicker than a wall
    assert doorways(free) == []


def test_something_between_two_ends_closes_the_way() -> None:
    free = house()
    free[:, 40:44] = False
    free[15:50, 40:44] = True
    free[30:32, 2:102] = False
    assert doorways(free) == [
        [(40.0, 15.0), (40.0, 30.0), (44.0, 15.0), (44.0, 30.0)],
        [(40.0, 32.0), (40.0, 50.0), (44.0, 32.0), (44.0, 50.0)],
    ]


def test_pillars_have_no_doorways_between_them() -> None:
    free = house()
    for col in (20, 40, 60):
        free[30:36, col : col + 6] = False
    assert doorways(free) == []


@pytest.mark.parametrize("seed", range(5))
def test_the_area_of_cells_is_that_of_their_squares(seed: int) -> None:
    mask = np.random.default_rng(seed).random((12, 17)) < 0.6
    rows, cols = np.nonzero(mask)
    squares = shapely.union_all(shapely.box(cols, -rows - 1, cols + 1, -rows))
    assert area_of_cells(mask).equals(squares)


def test_no_cells_have_no_area_and_no_doorways() -> None:
    nothing = np.zeros((5, 6), bool)
    assert area_of_cells(nothing).is_empty
    assert len(find_doorways(nothing, CELL_M)) == 0


def ring_corridor(width_m: float = 2.4) -> np.ndarray:
    """A corridor round a block of 16 m x 10 m, with rooms 4 m deep around it, a door of 1 m to each."""
    wide, block = round(width_m / CELL_M), (200, 320)
    free = np.zeros((block[0] + 2 * wide + 170, block[1] + 2 * wide + 170), bool)
    free[85:-85, 85:-85] = True
    free[85 + wide : -85 - wide, 85 + wide : -85 - wide] = False
    for cells in (free, free[::-1]):
        for k in range(4):
            left = 85 + k * 100
            cells[3:83, left : left + 98] = True
            cells[83:85, left + 40 : left + 60] = True
    return free


def test_a_corridor_round_all_its_bends_is_one_room() -> None:
    parts = segment_rooms(ring_corridor(), CELL_M)
    corridor = parts.label[100, 200:500]
    assert len(np.unique(parts.label)) == 1 + 9
    assert (corridor == corridor[0]).all()
    assert parts.label[300, 100] == parts.label[-100, 300] == corridor[0]


def test_both_jambs_of_a_doorway_stand_out_and_one_of_a_bend() -> None:
    free = np.zeros((120, 120), bool)
    free[10:110, 40:80] = True  # a corridor of 2 m,
    free[10:50, 40:110] = True  # which bends to the right,
    free[90:92, 40:50] = free[90:92, 70:80] = False  # and a doorway in it
    sides = np.array([[1, 2], [1, 2]])
    jambs = np.array([[[90.5, 49], [90.5, 70]], [[52, 39], [52, 80]]], float)
    found = measure_gaps(free, sides, jambs, CELL_M)
    assert min(found.stub_m[0], found.least_m[0]) > 0.3
    assert max(abs(found.stub_m[1]), abs(found.least_m[1]), abs(found.turn_m[1])) <= 0.1
    assert found.step_m[1] > 1.0


@pytest.mark.parametrize("left", [100, 101])
@pytest.mark.parametrize("thick", [1, 2])
def test_a_thin_wall_stays_where_a_large_map_is_divided_into_blocks(
    left: int, thick: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two rooms of 5 m x 6 m, and a wall of one or two cells between them, on the edge of blocks and off it."""
    free = np.zeros((140, 204), bool)
    free[10:130, 2:202] = True
    free[:, left : left + thick] = False
    monkeypatch.setattr("pipeline.sources.occupancy_map.rooms.MOST_CELLS", free.size // 4)
    parts = segment_rooms(free, CELL_M)
    assert parts.scale == 2
    assert int(parts.label.max()) == 2


@pytest.mark.parametrize("scale", [2, 3])
def test_blocks_count_their_cells(scale: int) -> None:
    cells = np.random.default_rng(0).random((7, 11)) < 0.5
    rows, cols = 7 // scale, 11 // scale
    expected = [
        [cells[r * scale : (r + 1) * scale, c * scale : (c + 1) * scale].sum() for c in range(cols)]
        for r in range(rows)
    ]
    assert count_in_blocks(cells, scale).tolist() == expected


def test_every_place_where_free_cells_of_two_rooms_touch_is_a_way() -> None:
    """A wall between two rooms has a known way of 1 m, and gaps of 0.9 m and 0.3 m."""
    label = np.ones((120, 60), np.int32)
    label[:, 30:] = 2
    free = np.zeros(label.shape, bool)
    free[:, :29] = free[:, 31:] = True
    for first, last in ((10, 30), (50, 68), (100, 106)):
        free[first:last, 29:31] = True
    known = RoomConnection((1, 2), np.array([(30.0, 10.0), (30.0, 30.0)]), 1.0, 0.1)
    one, other = _with_ways_where_rooms_touch((known,), label, free, CELL_M)
    assert one is known
    assert other.rooms == (1, 2)
    assert np.sort(other.jambs, axis=0) == pytest.approx(np.array([(30.0, 50.0), (30.0, 68.0)]))
    assert other.width_m == pytest.approx(0.9)
    assert _with_ways_where_rooms_touch((), label, free & (label == 1), CELL_M) == ()


def two_rooms_and_a_slit(gap_cells: int, thick_cells: int = 2) -> np.ndarray:
    """Two rooms of 4 m x 4 m; the wall between them has a gap."""
    free = np.zeros((90, 170), bool)
    free[4:84, 4:84] = free[4:84, 84 + thick_cells : 164 + thick_cells] = True
    free[40 : 40 + gap_cells, 84 : 84 + thick_cells] = True
    return free


def test_a_slit_in_a_thin_wall_parts_rooms_and_is_a_way_only_where_nothing_else_joins_them() -> None:
    (way,) = segment_rooms(two_rooms_and_a_slit(2), CELL_M).ways
    assert way.width_m < 0.2
    beside_a_door = two_rooms_and_a_slit(2)
    beside_a_door[60:78, 84:86] = True
    (way,) = segment_rooms(beside_a_door, CELL_M).ways
    assert way.width_m == pytest.approx(0.9, abs=0.1)


def open_room() -> tuple[np.ndarray, np.ndarray]:
    """A room of 4 m x 4 m with a gap of 1 m in the lower wall, and beyond it 3 m of a fan of the same width."""
    clear, occupied = np.zeros((2, 200, 120), bool)
    occupied[8:92, 18:102] = True
    clear[10:90, 20:100] = clear[90:150, 50:70] = True
    return clear, occupied & ~clear


def test_half_of_what_one_sees_from_an_opening_is_wall() -> None:
    clear, occupied = open_room()
    share = wall_share(clear, occupied, CELL_M)
    assert share[50, 60] > 0.9
    assert share[93, 60] == pytest.approx(0.5, abs=0.1)
    assert share[120, 60] < 0.3
    assert not share[~clear].any()
    large = wall_share(clear.repeat(8, 0).repeat(8, 1), occupied.repeat(8, 0).repeat(8, 1), CELL_M / 8)
    assert np.abs(large[4::8, 4::8] - share).mean() < 0.05


def test_a_fan_begins_at_the_opening_and_is_none_where_it_leads_on() -> None:
    clear, occupied = open_room()
    fan = find_fans(clear, occupied, CELL_M)
    assert fan.sum() == pytest.approx(60 * 20, rel=0.15)
    assert not fan[:88].any()
    both = clear | clear[::-1]  # the same room at the other end
    assert not find_fans(both, (occupied | occupied[::-1]) & ~both, CELL_M).any()
    assert not find_fans(clear, np.zeros_like(clear), CELL_M).any()  # a map that shows no walls


def test_a_room_that_is_mostly_a_fan_or_without_walls_is_outside() -> None:
    label = np.zeros((20, 40), np.int32)
    label[2:18] = np.repeat(np.array([0, 1, 2, 3], np.int32), 10)
    fans = np.zeros(label.shape, bool)
    fans[2:18, 16:20] = fans[2:18, 24:30] = True
    walls = np.zeros(label.shape, bool)
    walls[1] = walls[18] = True
    left, beyond = without_fans(label, fans, walls, frozenset(), 0.2)
    assert left is not None
    assert (beyond, np.bincount(left[10]).tolist()) == ({2}, [14, 6, 10, 10])
    assert without_fans(label, label > 0, walls, frozenset(), 0.2) == (None, frozenset())
    walls[:, 30:] = False
    assert without_fans(label, fans, walls, frozenset(), 0.2)[1] == {2, 3}


def room_with_a_hanging_wall(gap_cells: int) -> tuple[np.ndarray, np.ndarray]:
    """A room of 6 m x 4 m; from the wall above, after a gap, hang three dashes of 0.6 m in line, 0.2 m apart."""
    free = np.zeros((88, 128), bool)
    free[4:84, 4:124] = True
    for k in range(3):
        free[4 + gap_cells + 16 * k : 16 + gap_cells + 16 * k, 62:64] = False
    return free, ~free


def test_dashes_that_hang_on_a_wall_are_wall_with_their_gaps() -> None:
    free, occupied = room_with_a_hanging_wall(4)
    clear = fill_clutter(free, CELL_M, occupied)
    assert not clear[4:50, 62].any()
    assert clear[60:84, 62].all()


def test_dashes_far_from_a_wall_and_dashes_that_no_ray_ended_at_are_clutter() -> None:
    free, occupied = room_with_a_hanging_wall(12)
    assert fill_clutter(free, CELL_M, occupied)[4:84, 62].all()
    unseen, _ = room_with_a_hanging_wall(4)
    occupied[:, 60:66] = False
    assert fill_clutter(unseen, CELL_M, occupied)[4:84, 62].all()


def test_what_no_way_leads_to_is_no_room_if_it_is_a_block_or_open() -> None:
    """A room with a closed block in it, and beside it a closed room and a strip that was seen through glass."""
    label = np.zeros((140, 200), np.int32)
    label[10:130, 10:130] = 1
    label[50:80, 50:80] = 0
    label[53:77, 53:77] = 2
    label[10:60, 134:164] = 3
    label[70:100, 134:150] = 4
    occupied = cv2.dilate((label > 0).view(np.uint8), np.ones((5, 5), np.uint8)).view(bool) & (label == 0)
    occupied[62:, 146:] = False
    assert unreached_rooms(label, [], occupied, frozenset(), CELL_M) == {2, 4}
    assert unreached_rooms(label, [(1, 2), (1, 4)], occupied, frozenset(), CELL_M) == frozenset()
    assert unreached_rooms(np.minimum(label, 1), [], occupied, frozenset(), CELL_M) == frozenset()


@pytest.mark.parametrize(("closed", "dropped"), [(2, {2, 3}), (7, set())])
def test_a_few_small_closed_rooms_are_none_but_many_are_rooms_whose_doors_nobody_drew(
    closed: int, dropped: set[int]
) -> None:
    """A hall of 24 m2, and above it closed rooms of 0.9 m2 each, with walls all round."""
    label = np.zeros((100, 260), np.int32)
    label[50:90, 10:250] = 1
    for k in range(closed):
        label[10:28, 10 + 30 * k : 30 + 30 * k] = k + 2
    occupied = cv2.dilate((label > 0).view(np.uint8), np.ones((5, 5), np.uint8)).view(bool) & (label == 0)
    assert unreached_rooms(label, [], occupied, frozenset(), CELL_M) == dropped


@pytest.mark.parametrize("walled", [False, True])
def test_an_unseen_island_is_floor_unless_walls_are_around_it(walled: bool) -> None:
    """A hall of 10 m x 8 m; nobody looked at 6 m x 4 m in its middle, from which a neck of 0.3 m leads to the wall."""
    free = np.zeros((180, 220), bool)
    free[10:170, 10:210] = True
    free[50:130, 50:170] = free[130:170, 100:106] = False
    occupied = np.zeros_like(free)
    occupied[6:174, 6:214] = True
    occupied[10:170, 10:210] = False
    if walled:
        occupied[50:130, 50:170] = True
        occupied[54:126, 54:166] = False
    island = unseen_islands(free, occupied, CELL_M)
    assert island[50:130, 50:170].all() != walled
    assert not island[:48].any()
    rooms = segment_rooms(free, CELL_M, occupied=occupied)
    assert (rooms.label[90, 110] > 0) != walled
    if not walled:
        assert np.unique(rooms.label[10:170, 10:210]).tolist() == [1]
