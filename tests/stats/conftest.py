"""Houses of known measures: three rooms in a row with a way round, and published outlines."""

from __future__ import annotations

from pathlib import Path

import pytest

from houseexpo.floorplan import FloorPlan, save_plan
from houseexpo.plan import Door, Room


def box(x1: float, y1: float, x2: float, y2: float) -> list[tuple[float, float]]:
    return [(x1, y1), (x1, y2), (x2, y2), (x2, y1)]


def outline(name: str, width: float = 4.0, height: float = 3.0, rooms: int = 2) -> FloorPlan:
    """Return a published plan: one box, two labels."""
    boxes = {"Kitchen": ((0.1, 0.1, 1.0, 1.0),), "Bedroom": ((1.0, 0.1, 2.0, 1.0),)}
    return FloorPlan(name, box(0.1, 0.1, 0.1 + width, 0.1 + height), rooms, boxes)


@pytest.fixture
def ring_of_rooms() -> FloorPlan:
    """Rooms 0, 1, 2 in a row and 3 behind the first: 0-1 by two doors, 1-2, 0-3; one enters room 3."""
    rooms = (
        Room(0, "Hall", box(0.1, 0.1, 2.1, 2.1)),
        Room(1, "Kitchen", box(2.1, 0.1, 4.1, 2.1)),
        Room(2, "Bedroom", box(4.1, 0.1, 6.1, 2.1)),
        Room(3, "Unlabelled", box(0.1, 2.1, 2.1, 3.1)),
    )

    def door(number: int, kind: str, one: int, other: int | None) -> Door:
        return Door(number, kind, ((0.0, 0.0), (0.0, 0.8)), 0.8, box(0.0, 0.0, 0.1, 0.8), (one, other))

    doors = (
        *(door(0, "door", 0, 1), door(1, "opening", 0, 1), door(2, "door", 1, 2)),
        *(door(3, "cut", 0, 3), door(4, "entrance", 3, None)),
    )
    verts = [(0.1, 0.1), (0.1, 3.1), (2.1, 3.1), (2.1, 2.1), (6.1, 2.1), (6.1, 0.1)]
    return FloorPlan("ring", verts, 4, {"Kitchen": ((2.1, 0.1, 4.1, 2.1),)}, (), rooms, doors)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a data set of five outlines, the last two alike, in two splits, and an empty cache beside it."""
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path / "cache"))
    plans = tmp_path / "houses"
    plans.mkdir()
    for i, width in enumerate((3.0, 4.0, 5.0, 6.0, 6.0)):
        save_plan(outline(f"h{i}", width, rooms=i + 1), plans / f"h{i}.json")
    (plans / "splits").mkdir()
    (plans / "splits" / "train.txt").write_text("h0\nh1\nh3\nelsewhere\n")
    (plans / "splits" / "test.txt").write_text("h2\nh4\n")
    return plans
