"""What is asked of a home: numbers drawn together from the distributions of published plans.

``published.json`` holds quantiles and correlations (``tests/benchmarks/home_statistics.py`` writes it), no plan. Of a
stratum, houses with about so many spaces, numbers that go together are drawn through normal scores: correlated normal
numbers, each taken to the quantile at its share (a Gaussian copula).
"""

from __future__ import annotations

import hashlib
import json
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from scipy.special import ndtr

from pipeline.sources.homes.values import DoorWish, Wish

TABLE: Final = Path(__file__).with_name("published.json")
NUMBERS: Final = (
    *("rooms", "boxes", "nameless", "area_m2", "aspect", "extent", "corners", "oblique", "wall_m"),
    *("door_least_m", "door_range_m", "door_share", "unevenness", "least_room"),
)
STRATA: Final = (1, 2, 3, 4, 5, 6, 7, 9, 12)
"""The least number of spaces of each stratum."""
NAMELESS: Final = "Unlabelled"
_DRAWS: Final = 12
_CALM_TO_WILD: Final = (0.4, 1.1)
_AREA_DRAWS, _OF_MIN = 24, 0.25
_LARGEST, _MIN_GIVE, _HALVINGS = 1.5, 20.0, 40
_WALLS_M: Final = (0.05, 0.4)
MIN_DOOR_M: Final = 0.5
"""No door is narrower: a robot of 0.2 m passes each with some room to spare."""


def stratum_of(spaces: int) -> int:
    """Return the index of the stratum that holds houses of so many spaces."""
    return int(np.searchsorted(STRATA, max(spaces, 1), side="right")) - 1


@cache
def table() -> dict[str, Any]:
    """Return the published distributions."""
    found: dict[str, Any] = json.loads(TABLE.read_text(encoding="utf-8"))
    for stratum in found["strata"]:
        stratum["root"] = _root(np.array(stratum["correlations"]))
    return found


@cache
def table_digest() -> str:
    """Return what stands for the table in what a build depends on."""
    return hashlib.sha256(TABLE.read_bytes()).hexdigest()[:16]


def draw_wish(rng: np.random.Generator) -> Wish:
    """Draw what is asked of one home."""
    counts = np.array(table()["spaces"], dtype=np.float64)
    spaces = int(rng.choice(len(counts), p=counts / counts.sum()))
    drawn = _drawn(spaces, rng)
    rooms, boxes = max(round(drawn["rooms"]), 1), max(round(drawn["boxes"]), 0)
    nameless = min(max(round(drawn["nameless"]), 0), spaces)
    if boxes == 0:
        nameless = spaces
    nameless = max(nameless, spaces - boxes)
    long = float(np.sqrt(drawn["area_m2"] / (drawn["aspect"] * drawn["extent"])))
    least = max(drawn["door_least_m"], MIN_DOOR_M)
    names = _dealt(draw_labels(boxes, rng), spaces, nameless, rng)
    return Wish(
        spaces=spaces,
        rooms=rooms,
        area_m2=drawn["area_m2"],
        long_m=long,
        short_m=long * drawn["aspect"],
        corners=round(drawn["corners"]),
        oblique=drawn["oblique"],
        wall_m=round(float(np.clip(drawn["wall_m"], *_WALLS_M)), 2),
        doors=DoorWish(least, max(drawn["door_range_m"], 0.0), float(np.clip(drawn["door_share"], 0.0, 1.0))),
        names=names,
        areas_m2=_areas(names, drawn["area_m2"], (drawn["unevenness"], drawn["least_room"]), rng),
    )


def draw_labels(boxes: int, rng: np.random.Generator) -> list[str]:
    """Draw the labels of a house: how often each occurs, then some more or fewer until there are ``boxes``."""
    k = stratum_of(boxes)
    shares = {label: np.array(rows[k]) for label, rows in table()["labels"].items()}
    sums = np.cumsum([p / p.sum() for p in shares.values()], axis=1)
    draws = (rng.random((_DRAWS, len(sums), 1)) > sums[None]).sum(axis=2)
    nearest = draws[int(np.argmin(np.abs(draws.sum(axis=1) - boxes)))]
    labels = [label for label, n in zip(shares, nearest.tolist(), strict=True) for _ in range(n)]
    labels = [labels[i] for i in rng.permutation(len(labels))]
    means = np.array([p @ np.arange(len(p)) for p in shares.values()])
    words = list(shares)
    while len(labels) < boxes:
        labels.append(words[int(rng.choice(len(words), p=means / means.sum()))])
    return labels[:boxes]


def hub_of(label: str | None) -> float:
    """Return how many doors more than others a room of this label has."""
    return float(table()["hubs"].get(label or NAMELESS, 0.0))


def _drawn(spaces: int, rng: np.random.Generator) -> dict[str, float]:
    """Draw the numbers of a house together."""
    stratum, shares = table()["strata"][stratum_of(spaces)], table()["shares"]
    scores = stratum["root"] @ rng.standard_normal(len(NUMBERS))
    return {
        name: float(np.interp(ndtr(score), shares, stratum["quantiles"][name]))
        for name, score in zip(NUMBERS, scores.tolist(), strict=True)
    }


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
    """Draw the areas of the spaces, by label; large ones that vary much give and take what the whole asks.

    Of several draws, calm and wild ones, the one is taken that is nearest to what is ``asked``: the deviation of the
    areas and the least of them, both over their mean.
    """
    known = table()["room_areas"]
    rows = np.array([known.get(each[0] if each else NAMELESS, (0.0, 1.0, 0.6)) for each in names])
    spread = rows[:, 2] * rng.uniform(*_CALM_TO_WILD, (_AREA_DRAWS, 1))
    logs = rows[:, 0] + rows[:, 1] * np.log(total_m2 / len(names)) + spread * rng.standard_normal(spread.shape)
    give = spread**2 * np.exp(np.clip(logs - logs.mean(axis=1, keepdims=True), -_LARGEST, _LARGEST))
    low, high = np.full((_AREA_DRAWS, 1), -_MIN_GIVE), np.full((_AREA_DRAWS, 1), _MIN_GIVE)
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        over = np.exp(logs + middle * give).sum(axis=1, keepdims=True) > total_m2
        low, high = np.where(over, low, middle), np.where(over, middle, high)
    areas = np.exp(logs + low * give)
    areas /= areas.mean(axis=1, keepdims=True)
    off = np.abs(areas.std(axis=1) - asked[0]) + np.abs(np.log(areas.min(axis=1) / asked[1])) * _OF_MIN
    found = areas[int(np.argmin(off))]
    return tuple((found / found.sum() * total_m2).tolist())


def _root(correlations: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return a matrix whose square (with its transpose) is the correlations, the nearest valid ones."""
    values, vectors = np.linalg.eigh(np.nan_to_num(correlations))
    return np.asarray(vectors * np.sqrt(np.clip(values, 0.0, None)))
