"""The search for weights: CMA-ES over the features in which frontiers of one map differ."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec
from typing import Any, Final

import numpy as np

from houseexpo.errors import MissingDependencyError, installing
from houseexpo.pseudoslam.kernels.planning.outlook import OUTLOOKS
from houseexpo.pseudoslam.kernels.types import Floats

SPREADS: Final = {
    "way": 0.45, "log way": 0.48, "way beyond the nearest": 0.45, "rank": 0.2, "turn": 0.27, "large": 0.31,
    "log length": 0.54, "log sight from the goal": 0.87, "log sight from the middle": 0.71, "sight less the best": 0.87,
    "unknown within 1 m": 0.17, "unknown within 2.5 m": 0.16, "unknown within 5 m": 0.12, "free within 2.5 m": 0.18,
    "walls within 2.5 m": 0.02, "others within 3 m": 0.59, "nearer to the others": 0.2, "nearer to their length": 0.21,
    "tour beyond the shortest": 0.53, "to the rim": 0.28,
}  # fmt: skip
"""Standard deviations among the frontiers of one map, over 60 published plans; they scale the search of each weight.
Features that are equal for all frontiers of a map do not affect the choice and have no weight."""
_STEP = 0.3
_SEARCH = 2**31


class Search:
    """A search that returns the candidates of a generation and then receives their costs; ``mean`` is the result.

    Parameters
    ----------
    start
        The mean of the first generation (numbers,).
    candidates
        Number of candidates in a generation.
    seed
        The seed of random numbers; NumPy's global generator is not used.
    """

    def __init__(self, start: Floats, candidates: int, seed: int) -> None:
        if find_spec("cma") is None:
            raise MissingDependencyError(f"train chooser needs cma, not installed here: {installing('learn')}")
        from cma import CMAEvolutionStrategy

        rng = np.random.default_rng([seed, _SEARCH])
        self._start, self._searched = start, [OUTLOOKS.index(name) for name in SPREADS]
        self._spreads = np.array(list(SPREADS.values()))
        options = {"popsize": candidates, "seed": np.nan, "randn": lambda *n: rng.standard_normal(n), "verbose": -9}
        self._strategy: Any = CMAEvolutionStrategy(np.zeros(len(SPREADS)), _STEP, options)
        self._asked: list[Floats] = []

    def ask(self) -> list[Floats]:
        """Return the weights of a generation's candidates."""
        self._asked = self._strategy.ask()
        return [self._weights(one) for one in self._asked]

    def tell(self, costs: Sequence[float]) -> None:
        """Update the search with the costs of the last candidates."""
        self._strategy.tell(self._asked, list(costs))

    @property
    def mean(self) -> Floats:
        """The mean of the next generation (numbers,)."""
        return self._weights(self._strategy.mean)

    def _weights(self, found: Floats) -> Floats:
        weights = self._start.copy()
        weights[self._searched] += found / self._spreads
        return weights
