"""What rooms a house has: their number and labels follow the published counts, their sizes follow sense."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from pipeline.sources.procedural.values import Spec

# Plans with 1, 2, ... 30 rooms among 33,717 published ones.
_ROOM_COUNTS: Final = np.fromstring(
    "603 1590 2339 3239 4019 4276 3921 3239 2710 2044 1466 1120 801 547 431 "
    "287 214 191 121 103 74 66 60 34 35 26 13 30 18 8",
    sep=" ",
)


class _Kind(NamedTuple):
    """Rooms of this label over all of SUNCG; usual area, m2; narrowest side, cm; one more for every ``per`` rooms."""

    label: str
    published: int
    area: float
    side: int
    per: int


# Hallways come with corridors (layout), Aeration with shafts (difficulties): neither is drawn here.
_KINDS: Final = (
    _Kind("Bedroom", 68334, 15.0, 240, 2),
    _Kind("Room", 60354, 12.0, 180, 3),
    _Kind("Bathroom", 51078, 6.5, 150, 4),
    _Kind("Toilet", 43961, 3.0, 100, 5),
    _Kind("Kitchen", 36427, 13.0, 210, 14),
    _Kind("Living_Room", 25693, 27.0, 300, 14),
    _Kind("Office", 19176, 13.0, 220, 7),
    _Kind("Dining_Room", 16456, 16.0, 260, 16),
    _Kind("Garage", 12664, 24.0, 280, 99),
    _Kind("Hall", 8029, 12.0, 200, 99),
    _Kind("Balcony", 5611, 6.0, 130, 8),
    _Kind("Child_Room", 5409, 13.0, 230, 5),
    _Kind("Gym", 5089, 22.0, 280, 99),
    _Kind("Wardrobe", 3470, 4.5, 130, 6),
    _Kind("Storage", 3411, 4.5, 120, 8),
    _Kind("Guest_Room", 2964, 14.0, 230, 10),
    _Kind("Terrace", 2504, 14.0, 200, 20),
    _Kind("Entryway", 2373, 7.0, 150, 99),
    _Kind("Lobby", 2352, 10.0, 180, 99),
    _Kind("Loggia", 1514, 6.0, 130, 10),
    _Kind("Boiler_room", 1098, 5.0, 150, 99),
    _Kind("Passenger_elevator", 299, 3.0, 140, 99),
    _Kind("Freight_elevator", 89, 5.0, 160, 99),
)
_HOMES: Final = {"Bedroom", "Room", "Living_Room", "Kitchen", "Office", "Gym"}  # a house has one of these at least
_UNNAMED_SHARE, _TWICE_NAMED_SHARE = 0.06, 0.04
_SPREAD = 0.28  # of a room's area about the usual one, as the standard deviation of its logarithm


def draw_number(rng: np.random.Generator, least: int = 1) -> int:
    """Draw a number of rooms, ``least`` or more."""
    weights = _ROOM_COUNTS[least - 1 :]
    return least + int(rng.choice(len(weights), p=weights / weights.sum()))


def draw_rooms(number: int, rng: np.random.Generator) -> list[Spec]:
    """Draw ``number`` rooms: labels by published counts, none more often than a house of that size has it."""
    taken = [0] * len(_KINDS)
    specs = []
    size = float(rng.lognormal(0.0, 0.15))  # some houses are roomier than others
    for drawn in range(number):
        weights = np.array(
            [
                kind.published if taken[i] < 1 + number // kind.per and (drawn or kind.label in _HOMES) else 0
                for i, kind in enumerate(_KINDS)
            ],
            dtype=np.float64,
        )
        index = int(rng.choice(len(_KINDS), p=weights / weights.sum()))
        taken[index] += 1
        kind = _KINDS[index]
        area = kind.area * size * float(np.clip(rng.lognormal(0.0, _SPREAD), 0.6, 1.8))
        specs.append(Spec(_words(kind.label, rng), area, kind.side))
    return specs


def corridor_words(rng: np.random.Generator) -> tuple[str, ...]:
    """Draw what a corridor is called."""
    return (("Hallway",), ("Hallway",), ("Hallway",), ("Hall",), ("Room",), ())[int(rng.integers(6))]


def _words(label: str, rng: np.random.Generator) -> tuple[str, ...]:
    draw = rng.random()
    if draw < _UNNAMED_SHARE:
        return ()
    second = {"Bathroom": "Toilet", "Living_Room": "Dining_Room", "Bedroom": "Office", "Kitchen": "Dining_Room"}
    if draw < _UNNAMED_SHARE + 2 * _TWICE_NAMED_SHARE and label in second:
        return label, second[label]
    return (label,)
