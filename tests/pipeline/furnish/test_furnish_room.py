"""Furniture in rooms whose plan one can write down: where it may stand and where not."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
import shapely

from houseexpo.plan import Door, Room
from houseexpo.plan.room_labels import LABELS, UNLABELLED
from pipeline.furnish.catalogue import WANTS, FurnitureWish
from pipeline.furnish.room import (
    COVERED,
    GAP_CM,
    RoomFurnisher,
    are_disjoint,
    axis_parallel_walls,
    back_and_span,
    box_from_back,
    boxes_with_fronts,
    has_simple_rings,
    round_to_cm,
)

SEEDS = range(12)


def _room(label: str, width: float = 4.0, depth: float = 4.0) -> Room:
    return Room(0, label, [(0.1, 0.1), (0.1, 0.1 + depth), (0.1 + width, 0.1 + depth), (0.1 + width, 0.1)])


def _door_below(x: float = 1.0, width: float = 0.9) -> Door:
    """A door in the wall at y = 0.1, 0.1 m thick."""
    ring = [(x, 0.0), (x, 0.1), (x + width, 0.1), (x + width, 0.0)]
    return Door(0, "entrance", ((x, 0.05), (x + width, 0.05)), width, ring, (0, None))


def _furnished(room: Room, *doors: Door, seed: int = 0) -> list[tuple[str, shapely.Polygon]]:
    standing = RoomFurnisher(room, doors, WANTS.get(room.label, ()), np.random.default_rng(seed)).furnish()
    return [(each.piece.label, shapely.box(*each.box.tolist())) for each in standing]


@pytest.mark.parametrize("label", sorted(WANTS))
def test_pieces_stand_in_the_room_apart_and_clear_of_the_door(label: str) -> None:
    room, door = _room(label, 6.0, 5.0), _door_below(2.0)
    shape, way = round_to_cm(room.polygon), shapely.box(200, 10, 290, 10 + 75)
    count = 0
    for seed in SEEDS:
        boxes = [box for _, box in _furnished(room, door, seed=seed)]
        count += len(boxes)
        assert all(shape.covers(box) for box in boxes)
        assert all(box.intersection(way).area == 0 for box in boxes)
        assert all(one.distance(other) >= GAP_CM for one, other in combinations(boxes, 2))
        assert all(not 0 < box.distance(shape.exterior) < GAP_CM for box in boxes)
        assert sum(box.area for box in boxes) <= COVERED * shape.area
        left = shapely.difference(shape, shapely.union_all(boxes))
        assert has_simple_rings(left)
        places = shapely.get_parts(shapely.buffer(left, -20))
        assert len([part for part in places if part.area > 1000]) == 1
    assert count >= len(SEEDS) / 2


def _window_below(x: float, width: float, sill: float | None) -> Door:
    ring = [(x, 0.0), (x, 0.1), (x + width, 0.1), (x + width, 0.0)]
    return Door(0, "window", ((x, 0.05), (x + width, 0.05)), width, ring, (0, None), sill=sill, head=2.2)


@pytest.mark.parametrize(("sill", "before"), [(0.9, False), (None, False), (2.15, True)])
def test_no_wardrobe_stands_before_a_window_but_a_desk_does(sill: float | None, before: bool) -> None:
    wants = [FurnitureWish(each.piece) for each in WANTS["Bedroom"] if each.piece.label in {"wardrobe", "desk"}]
    door = Door(
        0, "entrance", ((1.0, 4.15), (1.9, 4.15)), 0.9, [(1.0, 4.1), (1.0, 4.2), (1.9, 4.2), (1.9, 4.1)], (0, None)
    )
    near, found = shapely.box(50, 10, 350, 40), set[str]()
    for seed in SEEDS:
        furnisher = RoomFurnisher(
            _room("Bedroom"), [door], wants, np.random.default_rng(seed), [_window_below(0.5, 3.0, sill)]
        )
        found |= {each.piece.label for each in furnisher.furnish() if near.intersects(shapely.box(*each.box.tolist()))}
    assert found == ({"desk", "wardrobe"} if before else {"desk"})


def test_a_bedroom_has_a_bed_and_a_bathroom_what_it_is_for() -> None:
    for seed in SEEDS:
        names = [name for name, _ in _furnished(_room("Bedroom"), _door_below(), seed=seed)]
        assert names[0] == "bed"
        names = [name for name, _ in _furnished(_room("Bathroom", 2.4, 2.6), _door_below(), seed=seed)]
        assert {"toilet", "washbasin"} & set(names)


def test_what_belongs_to_a_piece_stands_by_it_or_not_at_all() -> None:
    for seed in SEEDS:
        for label, size in (("Office", 3.0), ("Dining_Room", 4.5), ("Bedroom", 4.5), ("Living_Room", 5.0)):
            found = _furnished(_room(label, size, size), _door_below(), seed=seed)
            by_name = dict(found)
            for name, anchor, far in (("chair", ("desk", "table"), 5), ("nightstand", ("bed",), 5)):
                near = [box for other, box in found if other in anchor]
                assert all(min(box.distance(each) for each in near) <= far for other, box in found if other == name)
            if "coffee table" in by_name:
                assert by_name["coffee table"].distance(by_name["sofa"]) == 40


def test_a_room_of_no_known_use_or_size_stays_empty() -> None:
    assert not _furnished(_room("Passenger_elevator"))
    assert not _furnished(_room("Bedroom", 0.5, 0.5))
    assert not _furnished(_room("Bedroom", 1.0, 1.0), _door_below(0.2, 0.7))


def test_a_corridor_between_two_doors_stays_open() -> None:
    """1.2 m wide: what stands at a wall leaves a way of 0.6 m, so nothing deeper than 0.6 m stands there."""
    room = _room("Hallway", 6.0, 1.2)
    ends = [
        Door(
            k,
            "door",
            ((x, 0.3), (x, 1.1)),
            0.8,
            [(x - 0.05, 0.3), (x - 0.05, 1.1), (x + 0.05, 1.1), (x + 0.05, 0.3)],
            (0, 1),
        )
        for k, x in enumerate((0.05, 6.15))
    ]
    for seed in SEEDS:
        boxes = [box for _, box in _furnished(room, *ends, seed=seed)]
        left = (
            shapely.difference(round_to_cm(room.polygon), shapely.union_all(boxes))
            if boxes
            else round_to_cm(room.polygon)
        )
        places = shapely.get_parts(shapely.buffer(left, -30))
        assert len([part for part in places if part.area > 1000]) == 1


def test_walls_at_an_angle_bear_nothing_but_keep_their_distance() -> None:
    diamond = Room(0, "Living_Room", [(0, 4), (4, 8), (8, 4), (4, 0)])
    for seed in SEEDS:
        found = [box for _, box in _furnished(diamond, seed=seed)]
        assert all(box.distance(round_to_cm(diamond.polygon).exterior) > GAP_CM for box in found)
    cut = Room(0, "Bedroom", [(0.1, 0.1), (0.1, 4.1), (3.1, 4.1), (5.1, 2.1), (5.1, 0.1)])
    found = [box for seed in SEEDS for _, box in _furnished(cut, _door_below(), seed=seed)]
    slope = shapely.LineString([(310, 410), (510, 210)])
    assert found
    assert all(box.distance(slope) > 0 for box in found)


def test_chance_is_the_seeds_alone() -> None:
    one, two = (_furnished(_room("Kitchen"), _door_below(), seed=7) for _ in range(2))
    assert one == two
    assert len({str(_furnished(_room("Kitchen"), _door_below(), seed=seed)) for seed in SEEDS}) > 3


def test_every_label_that_is_furnished_is_one() -> None:
    assert set(WANTS) <= {*LABELS, UNLABELLED}


def test_boxes_stand_with_their_backs_at_the_wall_and_face_the_room() -> None:
    ring = np.array([(0, 0), (400, 0), (400, 300), (0, 300)])  # the room on the left
    walls = {(edge.facing, edge.at): (edge.low, edge.high) for edge in axis_parallel_walls([ring])}
    assert walls == {(1, 0): (0, 400), (2, 400): (0, 300), (3, 300): (0, 400), (0, 0): (0, 300)}
    for facing, at in walls:
        box = np.array(box_from_back(facing, at, 50, 100, 60))
        assert shapely.box(0, 0, 400, 300).covers(shapely.box(*box.tolist()))
        assert back_and_span(box, facing) == (at, 50, 150)
        zone = boxes_with_fronts(box[None], np.array([facing]), 40)[0]
        assert shapely.box(*zone.tolist()).area == 100 * 100


def test_boxes_that_touch_are_apart() -> None:
    boxes = np.array([(0, 0, 10, 10), (5, 5, 15, 15), (20, 0, 30, 10)])
    assert are_disjoint(boxes, np.array([(10, 0, 20, 10)])).tolist() == [True, False, True]
    assert are_disjoint(boxes, np.zeros((0, 4), dtype=np.int64)).all()
