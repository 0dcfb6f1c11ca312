"""Draw what a home shall have (areas, labels, doors) from the distributions of published plans (``published.json``).

A kind is a class of houses whose labels and doors go together.

The file holds distributions, no plan; ``research/home_statistics.py`` writes it.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from scipy.special import ndtr, ndtri

from pipeline.sources.homes.values import HomeWish

TABLE: Final = Path(__file__).with_name("published.json")
COUNTED: Final = ("spaces", "rooms", "nameless")
NUMBERS: Final = ("area_m2", "aspect", "extent", "corners", "oblique", "wall_m", "unevenness", "least_room")
STRATA: Final = (1, 2, 3, 4, 5, 6, 7, 9, 12)
"""The least number of spaces of each stratum."""


def stratum_index(spaces: int) -> int:
    """Return the index of the stratum that holds houses of so many spaces."""
    return int(np.searchsorted(STRATA, max(spaces, 1), side="right")) - 1


@cache
def published_distributions() -> dict[str, Any]:
    """Return the published distributions."""
    found: dict[str, Any] = json.loads(TABLE.read_text(encoding="utf-8"))
    return found


@cache
def distributions_digest() -> str:
    """Return what stands for the table in what a build depends on."""
    return hashlib.sha256(TABLE.read_bytes()).hexdigest()[:16]


# Houses are of a kind: those of one kind have rooms named alike, and sizes and shapes that go together.
#
# ``published.json`` knows a kind by what its houses have: of each label the shares of those that have it 0, 1, 2 ...
# times (within a kind one label says nothing of another: a latent class model), and numbers as normal scores with their
# means and covariances (a mixture of Gaussian copulas). Doors have kinds of their own: makes of doors that go together.


_KIND_DRAWS: Final = 48
_LEAST_RANK: Final = 1e-4
_Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class HouseProfile:
    """What a house is to be like: ``numbers`` by name, ``doors`` by their clear widths, metres, ascending."""

    spaces: int
    rooms: int
    nameless: int
    labels: tuple[str, ...]
    doors: tuple[float, ...]
    numbers: dict[str, float]


@dataclass(frozen=True, eq=False)
class _Kinds:
    """``labels``: the share of houses of each kind (k) that have each of ``words`` n times, (k, labels, n).

    ``boxes`` is the share of houses of a kind that have n labels in all; ``doors`` how much more often than elsewhere
    its houses have doors of each kind. Of the scores, the counted ones first, ``means`` and, for drawing the others
    given these: the inverse covariances of the counted ones and their log determinants, what a counted score gives to
    the others, and the root of the covariance that is left.
    """

    words: list[str]
    of_stratum: _Floats
    labels: _Floats
    boxes: _Floats
    doors: _Floats
    means: _Floats
    inverse: _Floats
    log_det: _Floats
    gives: _Floats
    root: _Floats


def draw_house_profile(rng: np.random.Generator) -> HouseProfile:
    """Draw a house: how many spaces, rooms, labels and nameless spaces it has, its kind, then the rest."""
    known, (houses, shares) = _kinds(), _houses()
    spaces, rooms, boxes, nameless = houses[int(rng.choice(len(houses), p=shares))].tolist()
    stratum = stratum_index(spaces)
    counted = _scores({"spaces": spaces, "rooms": rooms, "nameless": nameless}, stratum, rng)
    kind = _kind(stratum, counted, boxes, rng)
    scores = known.means[kind, len(COUNTED) :] + known.gives[kind] @ (counted - known.means[kind, : len(COUNTED)])
    scores = scores + known.root[kind] @ rng.standard_normal(len(scores))
    quantiles = published_distributions()["strata"][stratum]
    numbers = {
        name: float(np.interp(ndtr(score), published_distributions()["shares"], quantiles[name]))
        for name, score in zip(NUMBERS, scores.tolist(), strict=True)
    }
    return HouseProfile(
        spaces, rooms, nameless, _labels(kind, boxes, rng), _doors(spaces, known.doors[kind], rng), numbers
    )


def _scores(counts: dict[str, int], stratum: int, rng: np.random.Generator) -> _Floats:
    """Normal scores of whole numbers: anywhere within the share of houses that have just so many."""
    quantiles, shares = published_distributions()["strata"][stratum], published_distributions()["shares"]
    found = []
    for name in COUNTED:
        known = np.array(quantiles[name]) + 1e-9 * np.arange(len(shares))
        low, high = np.interp([counts[name] - 0.5, counts[name] + 0.5], known, shares, left=0.0, right=1.0)
        found.append(rng.uniform(low, high))
    return np.asarray(ndtri(np.clip(found, _LEAST_RANK, 1.0 - _LEAST_RANK)))


def _kind(stratum: int, counted: _Floats, boxes: int, rng: np.random.Generator) -> int:
    """Draw the kind of a house with these scores and so many labels."""
    known = _kinds()
    off = counted - known.means[:, : len(COUNTED)]
    logs = -0.5 * np.einsum("ki,kij,kj->k", off, known.inverse, off) - 0.5 * known.log_det
    likely = known.of_stratum[stratum] * np.exp(logs - logs.max())
    fits = likely * known.boxes[:, min(boxes, known.boxes.shape[1] - 1)]
    likely = fits if fits.sum() > 0 else likely
    return int(rng.choice(len(likely), p=likely / likely.sum()))


def _labels(kind: int, boxes: int, rng: np.random.Generator) -> tuple[str, ...]:
    """Draw ``boxes`` labels: of several draws one with so many, or else the nearest one, with some more or fewer."""
    words, shares = _kinds().words, _kinds().labels[kind]
    draws = (rng.random((_KIND_DRAWS, len(words), 1)) > shares.cumsum(axis=1)[None, :, :-1]).sum(axis=2)
    nearest = draws[int(np.argmin(np.abs(draws.sum(axis=1) - boxes)))]
    labels = [word for word, n in zip(words, nearest.tolist(), strict=True) for _ in range(n)]
    labels = [labels[i] for i in rng.permutation(len(labels))]
    means = shares @ np.arange(shares.shape[1])
    while len(labels) < boxes:
        labels.append(words[int(rng.choice(len(words), p=means / means.sum()))])
    return tuple(labels[:boxes])


def _doors(spaces: int, more: _Floats, rng: np.random.Generator) -> tuple[float, ...]:
    """Draw the clear widths of the doors of a house, of one kind of doors: a tree has one door less than spaces."""
    widths, shares, of_stratum = _door_kinds()
    likely = of_stratum[stratum_index(spaces)] * more
    kind = int(rng.choice(len(shares), p=likely / likely.sum()))
    return tuple(np.sort(rng.choice(widths, max(spaces - 1, 0), p=shares[kind])).tolist())


@cache
def _houses() -> tuple[npt.NDArray[np.int64], _Floats]:
    """Spaces, rooms, labels and nameless spaces that go together, and the share of houses that have just these."""
    rows = np.array(published_distributions()["houses"], dtype=np.int64)
    return rows[:, :-1], rows[:, -1] / rows[:, -1].sum()


@cache
def _kinds() -> _Kinds:
    known = published_distributions()["kinds"]
    words = list(known["labels"])
    labels = np.array([known["labels"][word] for word in words], dtype=np.float64).transpose(1, 0, 2)
    labels /= labels.sum(axis=2, keepdims=True)
    boxes = []
    for kind in labels:
        total = np.ones(1)
        for label in kind:
            total = np.convolve(total, label)
        boxes.append(total)
    covariance, n = np.array(known["covariances"]), len(COUNTED)
    inverse = np.linalg.inv(covariance[:, :n, :n])
    gives = covariance[:, n:, :n] @ inverse
    left = covariance[:, n:, n:] - gives @ covariance[:, :n, n:]
    return _Kinds(
        words=words,
        of_stratum=_as_shares(known["of_stratum"]),
        labels=labels,
        boxes=np.array(boxes),
        doors=np.array(known["doors"]),
        means=np.array(known["means"]),
        inverse=inverse,
        log_det=np.linalg.slogdet(covariance[:, :n, :n])[1],
        gives=gives,
        root=np.linalg.cholesky(left),  # there is one only, whatever library finds it
    )


@cache
def _door_kinds() -> tuple[_Floats, _Floats, _Floats]:
    """Widths; the shares of each among the doors of a kind; the shares of the kinds in each stratum."""
    known = published_distributions()["door_kinds"]
    shares = np.zeros((len(known["doors"]), len(known["widths_m"])))
    for kind, row in zip(known["doors"], shares, strict=True):
        for place, share in kind:
            row[place] = share
    return np.array(known["widths_m"]), _as_shares(shares), _as_shares(known["of_stratum"])


def _as_shares(rows: npt.ArrayLike) -> _Floats:
    found = np.array(rows, dtype=np.float64)
    return np.asarray(found / found.sum(axis=1, keepdims=True))


# What is asked of a home: numbers, labels and doors drawn together from the distributions of published plans.
#
# Sides and areas of rooms follow from them.


NAMELESS: Final = "Unlabelled"
_CALM_TO_WILD: Final = (0.4, 1.1)
_AREA_DRAWS, _OF_MIN, _OF_SPREAD = 32, 0.5, 0.1
_LAID_OUT: Final = 0.97
"""Of the unevenness that is asked for; rooms differ from what they are asked to be, which adds the rest."""
_MOST_SPREAD, _HALVINGS = 4.0, 16
_NEAR_WIDTH_M: Final = 0.12
_SMALLEST_M2: Final = 1.0
_WALLS_M: Final = (0.05, 0.4)


def draw_home_wish(rng: np.random.Generator) -> HomeWish:
    """Draw what is asked of one home."""
    house = draw_house_profile(rng)
    drawn, spaces = house.numbers, house.spaces
    nameless = min(house.nameless, spaces) if house.labels else spaces
    nameless = max(nameless, spaces - len(house.labels))
    long = float(np.sqrt(drawn["area_m2"] / (drawn["aspect"] * drawn["extent"])))
    short = _draw_side("short_side_m", long * drawn["aspect"], rng)
    long = max(_draw_side("long_side_m", long, rng), short)
    area = long * short * drawn["extent"]
    names = _deal_labels(list(house.labels), spaces, nameless, rng)
    return HomeWish(
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


def extra_doors(label: str | None) -> float:
    """Return how many doors more than others a room of this label has."""
    return float(published_distributions()["hubs"].get(label or NAMELESS, 0.0))


def _draw_side(name: str, near_m: float, rng: np.random.Generator) -> float:
    """Draw a side that houses have, near a length: rooms of floor planners begin as 5 m by 5 m, and walls snap."""
    known, counts = np.array(published_distributions()["sides_cm"][name]).T
    shares = counts * np.exp(-0.5 * ((known / 100 - near_m) / _NEAR_WIDTH_M) ** 2)
    return float(rng.choice(known, p=shares / shares.sum())) / 100 if shares.sum() > 0 else round(near_m, 2)


def _deal_labels(
    labels: list[str], spaces: int, nameless: int, rng: np.random.Generator
) -> tuple[tuple[str, ...], ...]:
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
    known = published_distributions()["room_areas"]
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
