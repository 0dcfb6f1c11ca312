"""What is asked of a home: numbers, labels and doors drawn together from the distributions of published plans.

``kinds.py`` draws them; here sides and areas of rooms are made of them.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from pipeline.sources.homes.kinds import draw_house
from pipeline.sources.homes.tables import table
from pipeline.sources.homes.values import Wish

NAMELESS: Final = "Unlabelled"
_CALM_TO_WILD: Final = (0.4, 1.1)
_AREA_DRAWS, _OF_MIN, _OF_SPREAD = 32, 0.5, 0.1
_LAID_OUT: Final = 0.97
"""Of the unevenness that is asked for; rooms differ from what they are asked to be, which adds the rest."""
_MOST_SPREAD, _HALVINGS = 4.0, 16
_NEAR_M: Final = 0.12
_SMALLEST_M2: Final = 1.0
_WALLS_M: Final = (0.05, 0.4)


def draw_wish(rng: np.random.Generator) -> Wish:
    """Draw what is asked of one home."""
    house = draw_house(rng)
    drawn, spaces = house.numbers, house.spaces
    nameless = min(house.nameless, spaces) if house.labels else spaces
    nameless = max(nameless, spaces - len(house.labels))
    long = float(np.sqrt(drawn["area_m2"] / (drawn["aspect"] * drawn["extent"])))
    short = _side("short_side_m", long * drawn["aspect"], rng)
    long = max(_side("long_side_m", long, rng), short)
    area = long * short * drawn["extent"]
    names = _dealt(list(house.labels), spaces, nameless, rng)
    return Wish(
        spaces=spaces,
        rooms=max(house.rooms, 1),
        area_m2=area,
        long_m=long,
        short_m=short,
        corners=round(drawn["corners"]),
        oblique=drawn["oblique"],
        wall_m=round(float(np.clip(drawn["wall_m"], *_WALLS_M)), 2),
        doors=house.doors,
        names=names,
        areas_m2=_areas(names, area, (_LAID_OUT * drawn["unevenness"], drawn["least_room"]), rng),
    )


def hub_of(label: str | None) -> float:
    """Return how many doors more than others a room of this label has."""
    return float(table()["hubs"].get(label or NAMELESS, 0.0))


def _side(name: str, near_m: float, rng: np.random.Generator) -> float:
    """Draw a side that houses have, near a length: rooms of floor planners begin as 5 m by 5 m, and walls snap."""
    known, counts = np.array(table()["sides_cm"][name]).T
    shares = counts * np.exp(-0.5 * ((known / 100 - near_m) / _NEAR_M) ** 2)
    return float(rng.choice(known, p=shares / shares.sum())) / 100 if shares.sum() > 0 else round(near_m, 2)


def _dealt(labels: list[str], spaces: int, nameless: int, rng: np.random.Generator) -> tuple[tuple[str, ...], ...]:
    """Deal labels to spaces, each named space one first."""
    names: list[list[str]] = [[] for _ in range(spaces)]
    named = spaces - nameless
    for i, label in enumerate(labels):
        names[i if i < named else int(rng.integers(max(named, 1)))].append(label)
    return tuple(tuple(each) for each in names)


def _areas(
    names: tuple[tuple[str, ...], ...], total_m2: float, asked: tuple[float, float], rng: np.random.Generator
) -> tuple[float, ...]:
    """Draw the areas of the spaces, by label, as uneven as is asked.

    ``asked`` is the deviation of the areas and the least of them, both over their mean. Each of several draws is spread
    until its deviation is that; the one is taken whose least area is nearest.
    """
    known = table()["room_areas"]
    rows = np.array([known.get(each[0] if each else NAMELESS, (0.0, 1.0, 0.6)) for each in names])
    logs = rows[:, 0] + rows[:, 1] * np.log(total_m2 / len(names))
    logs = logs + rows[:, 2] * rng.uniform(*_CALM_TO_WILD, (_AREA_DRAWS, 1)) * rng.standard_normal(
        (_AREA_DRAWS, len(names))
    )
    logs -= logs.max(axis=1, keepdims=True)
    low, high = np.zeros((_AREA_DRAWS, 1)), np.full((_AREA_DRAWS, 1), _MOST_SPREAD)
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        areas = np.exp(middle * logs)
        calm = areas.std(axis=1, keepdims=True) < asked[0] * areas.mean(axis=1, keepdims=True)
        low, high = np.where(calm, middle, low), np.where(calm, high, middle)
    areas = np.exp(low * logs)
    areas /= areas.mean(axis=1, keepdims=True)
    off = np.abs(areas.std(axis=1) - asked[0]) + np.abs(np.log(areas.min(axis=1) / asked[1])) * _OF_MIN
    off += np.abs(np.log(np.maximum(low[:, 0], 0.05))) * _OF_SPREAD
    found = np.maximum(areas[int(np.argmin(off))], _SMALLEST_M2 * len(names) / total_m2)
    return tuple((found / found.sum() * total_m2).tolist())
