"""Draw what a household asks for: the kind of dwelling, its rooms and their areas, and the sides that have light.

Areas are log-normal, with the median and the spread of the rooms of 46,830 Swiss flats (Swiss Dwellings; the 5, 50 and
95% quantiles are tabulated in floorplan_eval, 2026), cut at the limits of what such a room needs.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from pipeline.sources.sound_homes.values import SIDES, Programme, RoomWish, Side


class _Area(NamedTuple):
    """Median (m2), standard deviation of the logarithm, and limits (m2) of a room's area."""

    median_m2: float
    spread: float
    least_m2: float
    most_m2: float


AREAS: Final = {
    "Living_Room": _Area(26.0, 0.27, 16.0, 48.0),
    "Kitchen": _Area(8.3, 0.33, 5.0, 16.0),
    "Dining_Room": _Area(11.5, 0.22, 8.0, 18.0),
    "Bedroom": _Area(15.0, 0.2, 11.0, 24.0),
    "Child_Room": _Area(12.5, 0.2, 9.0, 18.0),
    "Office": _Area(11.0, 0.22, 7.5, 18.0),
    "Bathroom": _Area(4.6, 0.2, 3.3, 7.5),
    "Toilet": _Area(1.9, 0.15, 1.5, 3.0),
    "Storage": _Area(2.6, 0.4, 1.2, 7.0),
    "Wardrobe": _Area(3.6, 0.25, 2.4, 6.0),
    "Balcony": _Area(7.3, 0.45, 3.5, 20.0),
    "Garage": _Area(20.0, 0.1, 17.0, 26.0),
}

KINDS: Final = {
    "studio": 0.10,
    "flat": 0.44,
    "row house": 0.10,
    "bungalow": 0.16,
    "villa": 0.08,
    "shared flat": 0.06,
    "practice": 0.06,
}
"""The kinds of dwellings and their shares. A practice is no dwelling; it is labelled as what it is."""

_BEDROOMS: Final = {
    "flat": (0.27, 0.38, 0.27, 0.08),
    "row house": (1.0,),
    "bungalow": (0.08, 0.37, 0.40, 0.15),
    "villa": (0.0, 0.0, 0.4, 0.6),
    "shared flat": (0.0, 0.0, 0.5, 0.35, 0.15),
}
"""The shares of dwellings with one bedroom, two, ...; the mean of flats is 2.1, that of Swiss Dwellings 2.26."""

_INNER_M: Final = (0.10, 0.12, 0.14)
_OUTER_M: Final = (0.28, 0.30, 0.36, 0.40)


def draw_area(label: str, rng: np.random.Generator) -> float:
    """Return the area of a room, m2."""
    area = AREAS[label]
    drawn = area.median_m2 * float(np.exp(area.spread * rng.standard_normal()))
    return min(max(drawn, area.least_m2), area.most_m2)


def draw_programme(rng: np.random.Generator) -> Programme:
    """Return the programme of one home."""
    kind = str(rng.choice(list(KINDS), p=list(KINDS.values())))
    labels = _studio(rng) if kind == "studio" else _practice(rng) if kind == "practice" else _dwelling(kind, rng)
    rooms = tuple(RoomWish(label, draw_area(label, rng), behind) for label, behind in labels)
    inner, outer = float(rng.choice(_INNER_M)), float(rng.choice(_OUTER_M))
    return Programme(kind, rooms, _light(kind, rng), inner, outer)


def _studio(rng: np.random.Generator) -> list[tuple[str, int | None]]:
    found: list[tuple[str, int | None]] = [("Living_Room", None), ("Kitchen", None), ("Bathroom", None)]
    return [
        *found,
        *([("Storage", None)] if rng.random() < 0.4 else []),
        *([("Balcony", None)] if rng.random() < 0.5 else []),
    ]


def _practice(rng: np.random.Generator) -> list[tuple[str, int | None]]:
    """Reception and waiting, rooms for consultations, a kitchen for the staff."""
    offices = [("Office", None)] * int(rng.integers(3, 6))
    return [("Living_Room", None), ("Kitchen", None), *offices, ("Toilet", None), ("Bathroom", None), ("Storage", None)]


def _dwelling(kind: str, rng: np.random.Generator) -> list[tuple[str, int | None]]:
    bedrooms = 1 + int(rng.choice(len(_BEDROOMS[kind]), p=_BEDROOMS[kind]))
    found: list[tuple[str, int | None]] = [("Living_Room", None), ("Kitchen", None)]
    if bedrooms >= 2 and kind != "shared flat" and rng.random() < (0.8 if kind == "villa" else 0.25):
        found.append(("Dining_Room", None))
    found.append(("Bedroom", None))
    master = len(found) - 1
    found += [
        ("Bedroom" if kind == "shared flat" or rng.random() < 0.4 else "Child_Room", None) for _ in range(bedrooms - 1)
    ]
    if kind != "row house" and rng.random() < {"villa": 0.8, "bungalow": 0.35}.get(kind, 0.12):
        found.append(("Office", None))
    found.append(("Bathroom", None))
    if bedrooms >= 3 and (kind == "villa" or rng.random() < 0.4):
        found.append(("Bathroom", master))
    elif kind in {"bungalow", "villa"} and rng.random() < 0.4:
        found.append(("Wardrobe", master))
    if bedrooms >= 2 and rng.random() < 0.75:
        found.append(("Toilet", None))
    if rng.random() < 0.5:
        found.append(("Storage", None))
    if kind in {"villa", "bungalow"} and rng.random() < {"villa": 0.6, "bungalow": 0.25}[kind]:
        found.append(("Garage", None))
    if kind in {"flat", "shared flat"} and rng.random() < 0.85:
        found.append(("Balcony", None))
    return found


def _light(kind: str, rng: np.random.Generator) -> frozenset[Side]:
    """Return the sides without a party wall; a layout's rooms lie along x, its day rooms at the east end."""
    if kind in {"bungalow", "villa"}:
        return frozenset(SIDES)
    if kind == "row house":
        return frozenset[Side](("west", "east"))
    if kind == "studio":
        return frozenset[Side](("east",))
    sides: list[list[Side]] = [["north"], ["north", "east"], ["north", "south"], ["north", "south", "east"]]
    shares = (0.1, 0.15, 0.4, 0.35) if kind != "practice" else (0.0, 0.0, 0.5, 0.5)
    return frozenset[Side](sides[int(rng.choice(len(sides), p=shares))])
