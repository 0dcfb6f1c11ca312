"""Draw what a household asks for: the kind of dwelling, its rooms and their areas, and the sides that have light.

Areas are log-normal, with the median and the spread of the rooms of 46,830 Swiss flats (Swiss Dwellings; the 5, 50 and
95% quantiles are tabulated in floorplan_eval, 2026), cut at the limits of what such a room needs.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from pipeline.sources.sound_homes.limits import follows_bedrooms
from pipeline.sources.sound_homes.values import SIDES, Programme, RoomWish, Side


class _Area(NamedTuple):
    """Median (m2), standard deviation of the logarithm, and limits (m2) of a room's area."""

    median_m2: float
    spread: float
    least_m2: float
    most_m2: float


AREAS: Final = {
    "Living_Room": _Area(27.2, 0.36, 13.0, 44.0),
    "Kitchen": _Area(7.45, 0.42, 3.5, 16.0),
    "Dining_Room": _Area(11.5, 0.22, 8.0, 14.5),
    "Bedroom": _Area(15.0, 0.2, 11.0, 24.0),
    "Child_Room": _Area(12.5, 0.2, 9.0, 18.0),
    "Office": _Area(11.0, 0.22, 7.5, 18.0),
    "Bathroom": _Area(3.2, 0.44, 2.5, 8.0),
    "Toilet": _Area(1.7, 0.15, 1.55, 2.6),
    "Storage": _Area(2.8, 1.35, 1.0, 7.6),
    "Wardrobe": _Area(3.6, 0.25, 2.4, 6.0),
    "Balcony": _Area(6.7, 0.75, 2.0, 26.0),
    "Terrace": _Area(14.0, 0.35, 8.0, 28.0),
    "Garage": _Area(20.0, 0.1, 17.0, 26.0),
}

_SIZES: Final = {
    ("studio", "Living_Room"): 0.85,
    ("studio", "Kitchen"): 0.55,
    ("studio", "Storage"): 0.5,
    ("bungalow", "Kitchen"): 1.3,
}
"""How much larger or smaller than in a flat rooms of other dwellings are."""

KINDS: Final = {
    "studio": 0.05,
    "flat": 0.45,
    "row house": 0.13,
    "house": 0.14,
    "bungalow": 0.09,
    "villa": 0.04,
    "shared flat": 0.05,
    "practice": 0.05,
}
"""The kinds of dwellings and their shares. A practice is no dwelling; it is labelled as what it is."""

STOREYS: Final = {"row house": {2: 0.7, 3: 0.3}, "house": {2: 0.9, 3: 0.1}, "villa": {2: 1.0}}
"""The kinds with several storeys, and the shares of homes with so many."""

_BEDROOMS: Final = {
    "flat": (0.22, 0.36, 0.32, 0.10),
    "bungalow": (0.08, 0.37, 0.40, 0.15),
    "shared flat": (0.0, 0.0, 0.5, 0.35, 0.15),
}
"""The shares of dwellings with one bedroom, two, ...; that of Swiss Dwellings has 2.26 in the mean."""

_DINING: Final = {("flat", False): 0.5, ("flat", True): 0.92, ("bungalow", True): 0.45}
"""How often there is a dining room, in dwellings of one bedroom and of more."""
_SECOND_BALCONIES: Final = 0.3
_UPPER_BALCONIES: Final = 0.4
"""How often a flat has a second balcony, and a house of several storeys one upstairs; not all find a place."""
_OFF_LIVING: Final = {"flat": 0.6, "bungalow": 0.2}
"""How often a bedroom off the living room is asked for, where there is another; not all find a place."""
_TWO_BATHS: Final = 4
"""So many bedrooms need two bathrooms."""
_COURTYARDS: Final = {"bungalow": 0.3}
"""How often rooms lie on four sides of a courtyard."""
_GALLERY_M: Final = (1.2, 1.5)
"""The clear width of a corridor along it, metres."""
_VESTIBULES: Final = 0.2
"""How often a door parts the entry from the hall."""
_SLEEP: Final = frozenset({"Bedroom", "Child_Room", "Office"})
_TWO_SIDED: Final = 3
"""So many rooms to sleep and work in need light on two sides, as a dining room does."""
_CORRIDOR_M: Final = (1.05, 1.2)
_SHORT_HALL_M: Final = (1.4, 1.8)
_WIDE_HALL_M: Final = (1.6, 2.5)
_INNER_M: Final = (0.10, 0.12, 0.14)
_OUTER_M: Final = (0.28, 0.30, 0.36, 0.40)


def draw_area(label: str, rng: np.random.Generator) -> float:
    """Return the area of a room, m2."""
    area = AREAS[label]
    drawn = area.median_m2 * float(np.exp(area.spread * rng.standard_normal()))
    return min(max(drawn, area.least_m2), area.most_m2)


def draw_kind(rng: np.random.Generator) -> str:
    """Return the kind of a dwelling."""
    return str(rng.choice(list(KINDS), p=list(KINDS.values())))


def draw_programme(kind: str, rng: np.random.Generator) -> Programme:
    """Return the programme of one home of a kind."""
    draw = {"studio": _studio, "practice": _practice}.get(kind)
    labels: list[tuple[str, int | None]] = []
    off_living = bool(rng.random() < _OFF_LIVING.get(kind, 0.0))
    courtyard = bool(rng.random() < _COURTYARDS.get(kind, 0.0))
    if not courtyard:
        labels = (
            draw(rng) if draw else _outside(rng) if kind in STOREYS else _dwelling(kind, rng, off_living=off_living)
        )
    dines = any(label == "Dining_Room" for label, _ in labels)
    names = [label for label, _ in labels]
    rooms = tuple(
        RoomWish(label, _wish(kind, label, names, rng) * _size(kind, label, dines=dines), behind)
        for label, behind in labels
    )
    inner, outer = float(rng.choice(_INNER_M)), float(rng.choice(_OUTER_M))
    light = _light(kind, names, rng)
    return Programme(
        kind,
        rooms,
        light,
        inner,
        outer,
        _storeys(kind, rng),
        vestibule=bool(rng.random() < _VESTIBULES),
        hall_m=float(rng.uniform(*_GALLERY_M)) if courtyard else _hall(kind, rng),
        off_living=off_living,
        courtyard=courtyard,
    )


def _wish(kind: str, label: str, labels: list[str], rng: np.random.Generator) -> float:
    """Return the area of a room of a dwelling, whose living room follows the number of bedrooms, m2."""
    area = draw_area(label, rng)
    while label == "Living_Room" and not follows_bedrooms(area, kind, labels):
        area = draw_area(label, rng)
    return area


def _size(kind: str, label: str, *, dines: bool) -> float:
    """Return how much larger a room is than in other dwellings; people without a dining room eat in the kitchen."""
    if kind in {"flat", "shared flat"} and label == "Kitchen":
        return 0.93 if dines else 1.25
    return _SIZES.get((kind, label), 1.0)


def _hall(kind: str, rng: np.random.Generator) -> float:
    """Return the width of a hall: a corridor, or a hall in which furniture may stand."""
    wide = {"practice": 1.0, "studio": 1.0, "flat": 0.2, "shared flat": 0.2, "bungalow": 0.15}.get(kind, 0.0)
    if rng.random() >= wide:
        return float(rng.uniform(*_CORRIDOR_M))
    return float(rng.uniform(*(_SHORT_HALL_M if kind in {"practice", "studio"} else _WIDE_HALL_M)))


def _storeys(kind: str, rng: np.random.Generator) -> int:
    shares = STOREYS.get(kind, {1: 1.0})
    return int(rng.choice(list(shares), p=list(shares.values())))


def _outside(rng: np.random.Generator) -> list[tuple[str, int | None]]:
    found: list[tuple[str, int | None]] = [("Terrace", None)] if rng.random() < 0.92 else []
    return [*found, ("Balcony", None)] if rng.random() < _UPPER_BALCONIES else found


def _studio(rng: np.random.Generator) -> list[tuple[str, int | None]]:
    found: list[tuple[str, int | None]] = [("Living_Room", None), ("Kitchen", None), ("Bathroom", None)]
    return [
        *found,
        *([("Storage", None)] if rng.random() < 0.3 else []),
        *([("Balcony", None)] if rng.random() < 0.7 else []),
    ]


def _practice(rng: np.random.Generator) -> list[tuple[str, int | None]]:
    """Reception and waiting, rooms for consultations, a kitchen for the staff."""
    offices = [("Office", None)] * int(rng.integers(3, 6))
    return [("Living_Room", None), ("Kitchen", None), *offices, ("Toilet", None), ("Bathroom", None), ("Storage", None)]


def _dwelling(kind: str, rng: np.random.Generator, *, off_living: bool) -> list[tuple[str, int | None]]:
    bedrooms = 1 + int(rng.choice(len(_BEDROOMS[kind]), p=_BEDROOMS[kind]))
    found: list[tuple[str, int | None]] = [("Living_Room", None), ("Kitchen", None)]
    if rng.random() < _DINING.get((kind, bedrooms > 1), 0.0):
        found.append(("Dining_Room", None))
    found.append(("Bedroom", None))
    master = len(found) - 1
    found += [
        ("Bedroom" if kind == "shared flat" or rng.random() < 0.4 else "Child_Room", None) for _ in range(bedrooms - 1)
    ]
    if rng.random() < {"bungalow": 0.3}.get(kind, 0.1):
        found.append(("Office", None))
    found.append(("Bathroom", None))
    if bedrooms >= _TWO_BATHS:
        found.append(("Bathroom", None if kind == "shared flat" else master))
    elif bedrooms >= 2 and not off_living and rng.random() < (0.85 if bedrooms >= 3 else 0.7):
        found.append(("Bathroom", master))
    elif kind == "bungalow" and rng.random() < 0.4:
        found.append(("Wardrobe", master))
    if bedrooms >= 2 and rng.random() < 0.9:
        found.append(("Toilet", None))
    if rng.random() < 0.25:
        found.append(("Storage", None))
    if rng.random() < {"bungalow": 0.3}.get(kind, 0.0):
        found.append(("Garage", None))
    if rng.random() < 0.83:
        found.append(("Balcony" if kind in {"flat", "shared flat"} else "Terrace", None))
    if kind in {"flat", "shared flat"} and rng.random() < _SECOND_BALCONIES:
        found.append(("Balcony", None))
    return found


def _light(kind: str, labels: list[str], rng: np.random.Generator) -> frozenset[Side]:
    """Return the sides without a party wall; a layout's rooms lie along x, its day rooms at the east end."""
    if kind in {"bungalow", "house", "villa"}:
        return frozenset(SIDES)
    if kind == "row house":
        return frozenset[Side](("north", "south"))
    if kind == "studio":
        return frozenset[Side](("east",))
    two_sided = kind == "practice" or "Dining_Room" in labels or sum(label in _SLEEP for label in labels) >= _TWO_SIDED
    sides: list[list[Side]] = [["north", "south"], ["north", "south", "east"], ["north"], ["north", "east"]]
    return frozenset[Side](sides[int(rng.choice(2 if two_sided else 4))])
