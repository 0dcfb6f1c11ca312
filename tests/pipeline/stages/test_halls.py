"""Stage layout: a hall whose full breadth opens into bedrooms, beside stubs of walls or at corners, is a room (R6)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from houseexpo.floorplan import FloorPlan
from tests.builders.houses import Hole, Parts, gap, plan_of, shell, wall

WAY, STORE = gap(0.3, 1.2), gap(0.4, 1.2)


@dataclass(frozen=True)
class Flat:
    """A living room over a hall between two bedrooms, and a store under the hall; metres.

    The hall is ``breadth`` broad and ``length`` long between the bedrooms' walls, and its lower wall goes on into them
    by ``stubs``. ``way`` leads from the living room into the hall, and ``store`` from there into the store. With
    ``door`` the right bedroom is closed by a wall with this hole, from the lower wall up.
    """

    breadth: float = 1.1
    length: float = 1.8
    stubs: tuple[float, float] = (0.6, 0.7)
    bedrooms: tuple[float, float] = (3.6, 2.6)
    thickness: float = 0.1
    way: Hole | None = WAY
    store: Hole | None = STORE
    door: Hole | None = None

    @property
    def hall_m2(self) -> float:
        """The area of the hall from corner to corner."""
        return self.breadth * (self.length + 2 * self.thickness + sum(self.stubs))

    def parts(self) -> Parts:
        """Return its walls."""
        t, left, low = self.thickness, self.bedrooms[0] + self.thickness, 2.6 + self.thickness
        right, top = left + self.length, low + self.breadth
        way, store = ([_moved(hole, left)] if hole else [] for hole in (self.way, self.store))
        closed = wall((right, low, right + t, top), _moved(self.door, low)) if self.door else []
        width = right + t + self.bedrooms[1]
        return [
            *shell((0.0, 0.0, width, top + t + 4.0)),
            *wall((0.0, top, width, top + t), *way),
            *wall((left - t - self.stubs[0], 2.6, right + t + self.stubs[1], low), *store),
            *wall((left - t, 0.0, left, 2.6)),
            *wall((right, 0.0, right + t, 2.6)),
            *closed,
        ]


def _moved(hole: Hole, by: float) -> Hole:
    return replace(hole, start=hole.start + by, end=hole.end + by)


def drawn(seed: int) -> Flat:
    """Return a flat of other measures, whose ways are gaps or have lintels; half of the stubs are none."""
    rng = np.random.default_rng(seed)
    ways = []
    for _ in range(2):
        start, width = rng.uniform(0.0, 0.5), rng.uniform(0.7, 1.0)
        ways.append(gap(start, start + width) if rng.random() < 0.5 else Hole(start, start + width))
    left, right = (float(rng.choice([0.0, rng.uniform(0.1, 0.9)])) for _ in range(2))
    bedrooms = float(rng.uniform(2.4, 4.0)), float(rng.uniform(2.4, 4.0))
    measures = float(rng.uniform(0.95, 1.3)), float(rng.uniform(1.6, 3.5)), (left, right), bedrooms
    return Flat(*measures, float(rng.uniform(0.08, 0.25)), ways[0], ways[1])


def turned(parts: Parts, degrees: float, mirrored: bool) -> Parts:
    angle = np.deg2rad(degrees)
    matrix = np.eye(4)
    matrix[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    matrix[:2, 0] *= -1.0 if mirrored else 1.0
    return [part.copy().apply_transform(matrix) for part in parts]


def areas(plan: FloorPlan) -> list[float]:
    return sorted(room.polygon.area for room in plan.rooms)


@pytest.mark.parametrize("seed", range(20))
def test_a_hall_between_two_bedrooms_is_a_room(seed: int) -> None:
    flat = drawn(seed)
    plan = plan_of(turned(flat.parts(), 90 * (seed % 4) + 7.0 * (seed % 3), mirrored=seed % 5 == 0))
    assert len(plan.rooms) == 5
    assert len(plan.doors) == 4
    assert {door.kind for door in plan.doors} <= {"opening", "door"}
    assert any(0.7 * flat.hall_m2 <= area <= flat.hall_m2 for area in areas(plan))


@pytest.mark.parametrize(("door", "rooms"), [(Hole(0.1, 0.9), 4), (None, 5)])
def test_a_corridor_with_one_open_end_is_a_part_of_the_room_there(door: Hole | None, rooms: int) -> None:
    assert len(plan_of(Flat(door=door, stubs=(0.6, 0.0)).parts()).rooms) == rooms


@pytest.mark.parametrize(("breadth", "rooms"), [(1.4, 5), (1.7, 3)])
def test_a_hall_much_broader_than_a_way_is_open(breadth: float, rooms: int) -> None:
    flat = Flat(breadth=breadth, stubs=(0.0, 0.0), bedrooms=(3.0, 3.0), length=3.0)
    assert len(plan_of(flat.parts()).rooms) == rooms


def test_a_corridor_between_rooms_with_other_ways_is_a_part_of_them() -> None:
    """The living room has a door into each bedroom too."""
    flat = Flat(bedrooms=(3.6, 3.6))
    top = 2.6 + flat.thickness + flat.breadth
    parts = flat.parts()
    more = [Hole(0.5, 1.4), Hole(7.5, 8.4)]
    width = 2 * 3.6 + flat.length + 2 * flat.thickness
    way = _moved(WAY, 3.7)
    between = wall((0.0, top, width, top + flat.thickness), *more, way)
    rest = [part for part in parts if not (part.bounds[0][1] >= top - 1e-6 and part.bounds[1][1] <= top + 0.11)]
    assert len(plan_of([*rest, *between]).rooms) == 3


@pytest.mark.parametrize(("side_m", "rooms"), [(3.0, 4), (1.1, 2)])
def test_a_bend_of_a_corridor_is_no_end(side_m: float, rooms: int) -> None:
    """A corridor of 1.1 m before a room, and what lies at both of its ends: rooms, or corridors as broad as it."""
    left, right = side_m, side_m + 0.1 + 4.0 + 0.1
    middle = (left, 1.1, right, 1.2)
    parts = [
        *shell((0.0, 0.0, right + side_m, 6.0)),
        *wall(middle, Hole(left + 1.0, left + 1.9)),
        *wall((left, 1.2, left + 0.1, 6.0)),
        *wall((right - 0.1, 1.2, right, 6.0)),
    ]
    assert len(plan_of(parts).rooms) == rooms
