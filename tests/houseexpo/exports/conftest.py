"""Plans to export: a chiral flat with an oblique wall, pillars and every kind of door; published ones of each sort."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from houseexpo.floorplan import FloorPlan, decode
from houseexpo.plan import Door, Frame, Room

Z_UP = Frame(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), "z", 0.0, 0)
Y_UP_MIRRORED = Frame(((1.0, 0.0, 3.0), (0.0, 1.0, -2.0)), "y", 0.0, 0)


def box(x1: float, y1: float, x2: float, y2: float) -> np.ndarray:
    return np.array([(x1, y1), (x1, y2), (x2, y2), (x2, y1)])


@pytest.fixture
def flat() -> FloorPlan:
    """A room of 4 x 3 m with two pillars; a door to a room whose far wall is oblique; an opening to a hall above."""
    first, second = box(1.0, 1.0, 1.4, 1.4), box(2.5, 1.6, 2.8, 2.2)
    bedroom = [(4.2, 0.1), (4.2, 3.1), (6.2, 3.1), (7.7, 1.6), (7.7, 0.1)]
    verts = [
        *((0.1, 0.1), (0.1, 3.1), (0.5, 3.1), (0.5, 3.3), (0.1, 3.3), (0.1, 5.3), (4.1, 5.3), (4.1, 3.3), (1.5, 3.3)),
        *((1.5, 3.1), (4.1, 3.1), (4.1, 1.9), (4.2, 1.9), (4.2, 3.1), (6.2, 3.1), (7.7, 1.6), (7.7, 0.1), (4.2, 0.1)),
        *((4.2, 1.1), (4.1, 1.1), (4.1, 0.1)),
    ]
    return FloorPlan(
        id="flat 1: it's & <odd>",
        verts=verts,
        room_num=3,
        room_category={"Living_Room": ((0.0, 0.0, 4.1, 3.2),), "Bedroom": ((4.2, 0.1, 7.8, 3.2),)},
        holes=(first[::-1], second[::-1]),
        rooms=(
            Room(0, "Living_Room", box(0.1, 0.1, 4.1, 3.1), (first[::-1], second[::-1])),
            Room(1, "Bedroom", bedroom),
            Room(2, "Unlabelled", box(0.1, 3.3, 4.1, 5.3)),
        ),
        doors=(
            Door(0, "door", ((4.15, 1.1), (4.15, 1.9)), 0.8, box(4.1, 1.1, 4.2, 1.9), (0, 1)),
            Door(1, "opening", ((0.5, 3.2), (1.5, 3.2)), 1.0, box(0.5, 3.1, 1.5, 3.3), (0, 2)),
            Door(2, "entrance", ((0.05, 4.0), (0.05, 4.9)), 0.9, box(0.0, 4.0, 0.1, 4.9), (2, None)),
        ),
        frame=Z_UP,
    )


@pytest.fixture
def mirrored(flat: FloorPlan) -> FloorPlan:
    """The same numbers from a source like SUNCG, where x = X and y = Z."""
    return replace(flat, id="mirrored", frame=Y_UP_MIRRORED)


@pytest.fixture
def published(published_lines: list[bytes]) -> list[FloorPlan]:
    """Ten published plans: small, large, oblique, and one whose ring is no valid polygon."""
    plans = [decode(line) for line in published_lines]
    invalid = next(plan for plan in plans if plan.free_space.geom_type == "MultiPolygon")
    return [*plans[::34], invalid]


@pytest.fixture
def plans(flat: FloorPlan, mirrored: FloorPlan, published: list[FloorPlan]) -> list[FloorPlan]:
    return [flat, mirrored, *published]
