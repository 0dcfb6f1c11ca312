"""Choices and what they were worth: each frontier is tried out, and the exploration goes on from there to its end.

R1  An explorer goes through a house by a scorer; now and then it chooses at random, so that it gets to where that
    scorer would not take it.
R2  At some of its choices, half of them or fewer in large houses, some of the frontiers are tried: the nearest ones,
    those with the highest scores, and others at random. Each time the exploration goes on by the scorer, in the true
    house, to its end.
R3  A choice's worth is the area under the curve of coverage that came of it, and the metres to 90%.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from houseexpo.floorplan import FloorPlan
from houseexpo.pseudoslam.kernels.explore import CHOICE
from houseexpo.pseudoslam.kernels.planning.outlook import OUTLOOKS
from houseexpo.pseudoslam.kernels.planning.scoring import Scorer
from houseexpo.pseudoslam.learning.explorations import METRES_COVERAGE, Explorations, Walk

Floats = npt.NDArray[np.float64]
TRIED: Final = 5
"""Frontiers that are tried at a choice, at most."""
_NEAREST, _BEST = 2, 2
_AT_RANDOM, _LOOKED_INTO = 0.2, 0.5
_USUAL_M2 = 80.0
_SEEN = 0.97
"""Coverage from which on nothing is to be learned."""


@dataclass(frozen=True, eq=False)
class Choices:
    """Choices, n of them.

    Parameters
    ----------
    outlooks
        (n, TRIED, numbers): what each frontier that was tried looked like.
    tried
        (n, TRIED) bool: whether there was one.
    worth
        (n, TRIED, 2): what it was worth, R3; the metres are 0 where 90% was seen before.
    """

    outlooks: Floats
    tried: npt.NDArray[np.bool_]
    worth: Floats

    def __len__(self) -> int:
        return len(self.tried)

    def and_then(self, others: Choices) -> Choices:
        """Return these and others."""
        return Choices(
            np.concatenate([self.outlooks, others.outlooks]),
            np.concatenate([self.tried, others.tried]),
            np.concatenate([self.worth, others.worth]),
        )


def no_choices() -> Choices:
    """Return none."""
    return Choices(np.zeros((0, TRIED, len(OUTLOOKS))), np.zeros((0, TRIED), bool), np.zeros((0, TRIED, 2)))


def choices_in(explorations: Explorations, plan: FloorPlan, scorer: Scorer, rng: np.random.Generator) -> Choices:
    """Return the choices of one exploration (R1)."""
    walk, found = explorations.begin(plan, rng), no_choices()
    area_m2 = walk.state.observable_cells / explorations.config.pixels_per_metre**2
    looked_into = _LOOKED_INTO * min(_USUAL_M2 / area_m2, 1.0)
    while explorations.go(walk, scorer, choices=0) == CHOICE and walk.coverage < _SEEN:
        n = walk.choices
        if n > 1 and rng.random() < looked_into:
            found = found.and_then(_tried(explorations, walk, scorer, rng))
        best = int(walk.errand.scores[:n].argmax())
        first = int(rng.integers(min(n, TRIED))) if rng.random() < _AT_RANDOM else best
        if explorations.go(walk, scorer, first=first, choices=1) != CHOICE:
            break
    return found


def _tried(explorations: Explorations, walk: Walk, scorer: Scorer, rng: np.random.Generator) -> Choices:
    """Try some of the frontiers that there are (R2)."""
    n, since = walk.choices, walk.steps
    by_score = np.argsort(-walk.errand.scores[:n], kind="stable")[:_BEST].tolist()
    some = list(dict.fromkeys([*by_score, *range(min(n, _NEAREST)), *rng.permutation(n).tolist()]))[:TRIED]
    outlooks, worth = np.zeros((1, TRIED, len(OUTLOOKS))), np.zeros((1, TRIED, 2))
    tried = (np.arange(TRIED) < len(some))[None]
    before = walk.coverage
    for place, number in enumerate(some):
        outlooks[0, place] = walk.errand.outlooks[number]
        branch = walk.copy()
        explorations.go(branch, scorer, first=number)
        area, metres = explorations.worth(branch, since)
        worth[0, place] = area, metres if before < METRES_COVERAGE else 0.0
    return Choices(outlooks, tried, worth)
