"""Plans with known truth for the tests of the library."""

from __future__ import annotations

import gzip
import itertools
from dataclasses import replace
from pathlib import Path

import pytest

from houseexpo.floorplan import FloorPlan
from houseexpo.plan import Door, Frame, Navigability, PlanObject, Quality, Room

PUBLISHED = Path(__file__).resolve().parents[3] / "shared" / "data" / "houseexpo" / "plans_33717.jsonl.gz"


def _box(x1: float, y1: float, x2: float, y2: float) -> list[tuple[float, float]]:
    return [(x1, y1), (x1, y2), (x2, y2), (x2, y1)]


@pytest.fixture
def two_rooms() -> FloorPlan:
    """4 x 3 m and 3 x 3 m, a wall of 0.1 m between them with a door of 0.8 m, a pillar of 0.4 m in the first."""
    pillar = _box(1.0, 1.0, 1.4, 1.4)[::-1]
    outline = [
        *((0.1, 0.1), (0.1, 3.1), (4.1, 3.1), (4.1, 1.9), (4.2, 1.9), (4.2, 3.1)),
        *((7.2, 3.1), (7.2, 0.1), (4.2, 0.1), (4.2, 1.1), (4.1, 1.1), (4.1, 0.1)),
    ]
    rooms = (
        Room(0, "Living_Room", _box(0.1, 0.1, 4.1, 3.1), (pillar,), ("Wohnzimmer",)),
        Room(1, "Unlabelled", _box(4.2, 0.1, 7.2, 3.1)),
    )
    doors = (
        Door(0, "door", ((4.15, 1.1), (4.15, 1.9)), 0.8, _box(4.1, 1.1, 4.2, 1.9), (0, 1)),
        Door(1, "entrance", ((0.05, 1.0), (0.05, 1.9)), 0.9, _box(0.0, 1.0, 0.1, 1.9), (0, None)),
    )
    return FloorPlan(
        id="two_rooms",
        verts=outline,
        room_num=2,
        room_category={"Living_Room": ((0.1, 0.1, 4.1, 3.1),)},
        holes=(pillar,),
        rooms=rooms,
        doors=doors,
        frame=Frame(((0.0, -1.0, 5.0), (1.0, 0.0, -2.0)), "z", 2.7, 1),
        navigability={"0.20": Navigability(1, 1.0, 0.8)},
        provenance={"source": "made by hand", "heights": [0.01, 0.2]},
    )


@pytest.fixture
def furnished(two_rooms: FloorPlan) -> FloorPlan:
    """The two rooms; the pillar is a stove of 0.9 m, and the plan says how sure it is."""
    stove = PlanObject(0, "Kachelofen", 0, two_rooms.holes[0][::-1], 0.9)
    quality = Quality(0.93, {"guessed_wall_share": 0.1, "cut_share": 0.0})
    return replace(two_rooms, id="furnished", objects=(stove,), quality=quality)


@pytest.fixture(scope="session")
def published_lines() -> list[bytes]:
    """The first 300 published plans, one JSON object each."""
    if not PUBLISHED.exists():
        pytest.skip("the published plans are not on this machine")
    with gzip.open(PUBLISHED) as stream:
        return [line.rstrip(b"\n") for line in itertools.islice(stream, 300)]
