"""Stages contour, cells and isolated: what is outside, what is too small, what stands apart."""

import numpy as np
import pytest
import shapely

from pipeline.config import CellsConfig, IsolatedConfig
from pipeline.geometry.areas import unite
from pipeline.geometry.openings import Opening
from pipeline.geometry.rooms_and_passages import connected_rooms
from pipeline.rejection import Rejection
from pipeline.stages.buildings import drop_small_cells, erase_isolated, trace_contour
from pipeline.values import Spaces


def door(first: int, second: int) -> Opening:
    return Opening(np.zeros(2), np.array([1.0, 0.0]), 0.8, 0.2, (first, second), "door")


def house(*rooms: tuple[float, float, float, float], passages: tuple[Opening, ...] = (), **values: object) -> Spaces:
    """Rooms of which each has a wall of 0.1 m all round."""
    boxes = [shapely.box(*r) for r in rooms]
    walls = unite([b.buffer(0.1, join_style="mitre") for b in boxes]).difference(unite(boxes))
    return Spaces(walls, tuple(boxes), passages, **values)


def test_the_contour_is_the_outside_of_each_part_largest_first() -> None:
    found = trace_contour(house((10, 0, 12, 2), (0, 0, 4, 3), (4.1, 0, 7, 3)))
    assert [o.bounds for o in found.outlines] == [
        pytest.approx((-0.1, -0.1, 7.1, 3.1)),
        pytest.approx((9.9, -0.1, 12.1, 2.1)),
    ]


def test_a_court_is_inside_and_a_garden_wall_has_no_contour() -> None:
    ring = shapely.box(0, 0, 9, 9).difference(shapely.box(3, 3, 6, 6))
    walls = unite([shapely.box(-0.1, -0.1, 9.1, 9.1).difference(ring), shapely.box(20, 0, 30, 0.2)])
    (outline,) = trace_contour(Spaces(walls, (ring,), ())).outlines
    assert outline.area == pytest.approx(9.2**2)


def test_cells_are_rooms_that_can_be_reached_from_each_other() -> None:
    spaces = house(
        (0, 0, 2, 2),
        (3, 0, 5, 2),
        (6, 0, 8, 2),
        (9, 0, 11, 2),
        passages=(door(0, 2), door(3, -1)),
        open_pairs=((1, 3),),
    )
    assert connected_rooms(spaces) == [[0, 2], [1, 3]]


def test_a_closed_cell_under_the_threshold_is_filled() -> None:
    spaces = house((0, 0, 4, 3), (4.1, 0, 5.1, 1.9), (6, 0, 8, 2))
    found = drop_small_cells(spaces, CellsConfig())
    assert [r.area for r in found.rooms] == [12.0, 4.0]
    assert found.notes == {"filled_cells": 1}


@pytest.mark.parametrize("joined", ["door", "join"])
def test_a_small_room_with_a_way_out_stays(joined: str) -> None:
    how = {"passages": (door(0, 1),)} if joined == "door" else {"open_pairs": ((0, 1),)}
    spaces = house((0, 0, 4, 3), (4.1, 0, 5.1, 1), **how)
    assert drop_small_cells(spaces, CellsConfig()) is spaces


def test_an_entrance_is_no_way_from_room_to_room() -> None:
    spaces = house((0, 0, 4, 3), (4.1, 0, 5.1, 1), passages=(door(1, -1),))
    assert len(drop_small_cells(spaces, CellsConfig()).rooms) == 1


def test_passages_follow_their_rooms() -> None:
    spaces = house((0, 0, 1, 1), (2, 0, 6, 3), (7, 0, 11, 3), passages=(door(2, 1), door(2, -1)))
    found = drop_small_cells(spaces, CellsConfig())
    assert [p.sides for p in found.passages] == [(1, 0), (1, -1)]


@pytest.mark.parametrize(
    ("garage", "rooms"),
    [
        ((11.2, 0, 13, 2), 1),  # 3.0 m away and small: erased
        ((9.8, 0, 12, 2), 2),  # 1.6 m away
        ((11.2, 0, 16, 4), 2),  # more than a quarter of the main part
    ],
    ids=["far and small", "near", "large"],
)
def test_a_garage_that_stands_apart(garage: tuple[float, float, float, float], rooms: int) -> None:
    spaces = trace_contour(house((0, 0, 4, 5), (4.1, 0, 8, 5), garage, passages=(door(0, 1), door(2, -1))))
    main = 1 if rooms == 1 else 0
    found = erase_isolated(spaces, IsolatedConfig())
    assert len(found.rooms) == rooms + 1
    assert found.notes == ({"erased_parts": 1} if main else {})
    assert len(found.outlines) == rooms
    assert all(max(p.sides) < len(found.rooms) for p in found.passages)


def test_a_tiny_garage_close_by_is_kept_and_far_ones_all_go() -> None:
    spaces = trace_contour(house((0, 0, 8, 5), (11, 0, 13, 2), (-6, 0, -4, 2), (0, 6, 2, 8)))
    found = erase_isolated(spaces, IsolatedConfig())
    assert found.notes == {"erased_parts": 2}
    assert [r.area for r in found.rooms] == [40.0, 4.0]


def test_a_house_as_long_as_a_town_is_a_wrong_unit() -> None:
    long = Spaces(shapely.box(0, 0, 3600, 20), (shapely.box(1, 1, 3599, 19),), ())
    with pytest.raises(Rejection, match=r"at most 500 m a side, found 3,600 x 20 m.*--units"):
        trace_contour(long)
