"""Each ground is nothing in a house that speaks for itself, and as large as it should be in one that gives it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from shapely import Polygon, box

from houseexpo.plan import DoorKind, Frame
from pipeline.geometry.bridges import Bridge
from pipeline.geometry.regions import OUTSIDE
from pipeline.quality import GROUNDS
from pipeline.stages.grounds import weigh
from pipeline.values import Closer, Evidence, Layout, Level, Mesh, Passage, SourceRoom, Spaces

ROOMS = (box(0, 0, 4, 4), box(4.2, 0, 8.2, 4), box(0, 4.2, 8.2, 8.2))
NOTHING = Polygon()
WALLS = box(-0.2, -0.2, 8.4, 8.4).difference(shapely.union_all(ROOMS))


def passage(kind: DoorKind, one: int, other: int) -> Passage:
    """A passage between two rooms; where it is makes no difference here."""
    return Passage(Bridge(np.array([4.1, 1.5]), np.array([0.0, 1.0]), 0.9, 0.2, (one, other)), kind)


LEVEL = Level(
    "house",
    Mesh(np.empty((0, 3)), np.empty((0, 3), np.int64)),
    2.7,
    Frame(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), "z", 0.0, 0),
    floor=box(-0.2, -0.2, 8.4, 8.4),
    rooms=tuple(SourceRoom((), (), room) for room in ROOMS),
)
EVIDENCE = Evidence(WALLS, WALLS, NOTHING, NOTHING, NOTHING)
LAYOUT = Layout(WALLS, WALLS, (), ROOMS)
SPACES = Spaces(WALLS, ROOMS, (passage("door", 0, 1), passage("opening", 0, 2), passage("entrance", 0, OUTSIDE)))


def grounds(
    level: Level = LEVEL, evidence: Evidence = EVIDENCE, layout: Layout = LAYOUT, spaces: Spaces = SPACES
) -> dict[str, float]:
    """The grounds that are more than nothing, and every one of them is known to the model."""
    found = weigh(level, evidence, layout, spaces)
    assert set(found) == {ground.name for ground in GROUNDS}
    assert all(0 <= value <= 1 for value in found.values())
    return {name: round(value, 3) for name, value in found.items() if value > 1e-9}


def test_nothing_speaks_against_a_house_of_which_all_is_known() -> None:
    assert grounds() == {}


def test_cuts_count_against_doors_and_against_the_rooms_that_they_alone_lead_into() -> None:
    one_cut = replace(SPACES, passages=(passage("door", 0, 1), passage("cut", 0, 2), passage("entrance", 0, OUTSIDE)))
    assert grounds(spaces=one_cut) == {"cut_share": 0.5, "cut_off_share": round(1 / 3, 3)}
    beside = replace(SPACES, passages=(*SPACES.passages, passage("cut", 1, 2)))
    assert grounds(spaces=beside) == {"cut_share": round(1 / 3, 3)}
    joined = replace(one_cut, joins=((1, 2),))
    assert grounds(spaces=joined) == {"cut_share": 0.5}


@pytest.mark.parametrize(("kind", "counts"), [("gap", True), ("wall_ends", True), ("lintel", False), ("sill", False)])
def test_walls_closed_without_evidence(kind, counts: bool) -> None:
    closers = (Closer(box(0, 0, 1, 0.2), kind),)
    share = 1.2 / (WALLS.length / 2)
    expected = {"guessed_wall_share": round(share, 3)} if counts else {}
    assert grounds(layout=replace(LAYOUT, closers=closers)) == expected


def test_what_the_reader_guessed() -> None:
    assert grounds(replace(LEVEL, guesses=("units",))) == {"guesses": 0.5}
    assert grounds(replace(LEVEL, guesses=("units", "up", "scale"))) == {"guesses": 1.0}


def test_rooms_without_a_floor_unless_there_is_no_floor_at_all() -> None:
    half = replace(LEVEL, floor=box(-0.2, 4.1, 8.4, 8.4))
    assert grounds(half) == {"floorless_share": round(32 / 64.8, 3)}
    assert grounds(replace(LEVEL, floor=None)) == {}


@pytest.mark.parametrize(
    ("room", "odd"),
    [
        (box(0, 0, 0.9, 1.0), True),  # too small
        (box(0, 0, 0.6, 4.0), True),  # too narrow
        (box(0, 0, 20, 11), True),  # too large
        (box(0, 0, 1.0, 10.0), False),  # a corridor
        (box(0, 0, 1.2, 1.0), False),  # a toilet
    ],
)
def test_rooms_of_odd_shape_or_size(room: Polygon, odd: bool) -> None:
    spaces = Spaces(WALLS, (room,), (passage("entrance", 0, OUTSIDE),))
    found = weigh(replace(LEVEL, rooms=()), EVIDENCE, LAYOUT, spaces)
    assert found["odd_room_share"] == odd


def test_rooms_unlike_those_of_the_source() -> None:
    two = (SourceRoom((), (), box(0, 0, 8.2, 4)), SourceRoom((), (), ROOMS[2]))
    assert grounds(replace(LEVEL, rooms=two)) == {"unlike_spaces": round((1 - 16 / 32.8) / 2, 3)}
    assert grounds(replace(LEVEL, rooms=(), room_count=4)) == {"unlike_spaces": 0.25}
    assert grounds(replace(LEVEL, rooms=())) == {}


def test_a_shell_looks_like_one_room_without_a_door_inside() -> None:
    one = Spaces(WALLS, (box(0, 0, 8, 8),), (passage("entrance", 0, OUTSIDE),))
    assert weigh(LEVEL, EVIDENCE, LAYOUT, one)["lone_room"] == 1.0


def test_furniture_told_apart_by_its_shape() -> None:
    bed = replace(EVIDENCE, furniture=box(0, 0, 2, 1.62))
    assert grounds(evidence=bed) == {"furnished_share": round(3.24 / 64.8, 3)}
