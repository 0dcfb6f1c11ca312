"""Houses are of a kind: those of one kind have rooms named alike, and sizes and shapes that go together.

``published.json`` knows a kind by what its houses have: of each label the shares of those that have it 0, 1, 2 ...
times (within a kind one label says nothing of another: a latent class model), and numbers as normal scores with their
means and covariances (a mixture of Gaussian copulas). Doors have kinds of their own: makes of doors that go together.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np
import numpy.typing as npt
from scipy.special import ndtr, ndtri

from pipeline.sources.homes.tables import COUNTED, NUMBERS, stratum_of, table

_DRAWS: Final = 48
_HALF: Final = 0.5
_LEAST: Final = 1e-4
_Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Drawn:
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


def draw_house(rng: np.random.Generator) -> Drawn:
    """Draw a house: how many spaces, rooms, labels and nameless spaces it has, its kind, then the rest."""
    known, (houses, shares) = _kinds(), _houses()
    spaces, rooms, boxes, nameless = houses[int(rng.choice(len(houses), p=shares))].tolist()
    stratum = stratum_of(spaces)
    counted = _scores({"spaces": spaces, "rooms": rooms, "nameless": nameless}, stratum, rng)
    kind = _kind(stratum, counted, boxes, rng)
    scores = known.means[kind, len(COUNTED) :] + known.gives[kind] @ (counted - known.means[kind, : len(COUNTED)])
    scores = scores + known.root[kind] @ rng.standard_normal(len(scores))
    quantiles = table()["strata"][stratum]
    numbers = {
        name: float(np.interp(ndtr(score), table()["shares"], quantiles[name]))
        for name, score in zip(NUMBERS, scores.tolist(), strict=True)
    }
    return Drawn(spaces, rooms, nameless, _labels(kind, boxes, rng), _doors(spaces, known.doors[kind], rng), numbers)


def _scores(counts: dict[str, int], stratum: int, rng: np.random.Generator) -> _Floats:
    """Normal scores of whole numbers: anywhere within the share of houses that have just so many."""
    quantiles, shares = table()["strata"][stratum], table()["shares"]
    found = []
    for name in COUNTED:
        known = np.array(quantiles[name]) + 1e-9 * np.arange(len(shares))
        low, high = np.interp([counts[name] - _HALF, counts[name] + _HALF], known, shares, left=0.0, right=1.0)
        found.append(rng.uniform(low, high))
    return np.asarray(ndtri(np.clip(found, _LEAST, 1.0 - _LEAST)))


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
    draws = (rng.random((_DRAWS, len(words), 1)) > shares.cumsum(axis=1)[None, :, :-1]).sum(axis=2)
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
    likely = of_stratum[stratum_of(spaces)] * more
    kind = int(rng.choice(len(shares), p=likely / likely.sum()))
    return tuple(np.sort(rng.choice(widths, max(spaces - 1, 0), p=shares[kind])).tolist())


@cache
def _houses() -> tuple[npt.NDArray[np.int64], _Floats]:
    """Spaces, rooms, labels and nameless spaces that go together, and the share of houses that have just these."""
    rows = np.array(table()["houses"], dtype=np.int64)
    return rows[:, :-1], rows[:, -1] / rows[:, -1].sum()


@cache
def _kinds() -> _Kinds:
    known = table()["kinds"]
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
    known = table()["door_kinds"]
    shares = np.zeros((len(known["doors"]), len(known["widths_m"])))
    for kind, row in zip(known["doors"], shares, strict=True):
        for place, share in kind:
            row[place] = share
    return np.array(known["widths_m"]), _as_shares(shares), _as_shares(known["of_stratum"])


def _as_shares(rows: npt.ArrayLike) -> _Floats:
    found = np.array(rows, dtype=np.float64)
    return np.asarray(found / found.sum(axis=1, keepdims=True))
