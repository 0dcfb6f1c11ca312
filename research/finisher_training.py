"""Search the weights of the policy ``finisher``: a chooser of frontiers that goes short ways to 90% and to 99%.

    python -m research.finisher_training DATASET OUT.json [GENERATIONS]

The search is that of ``houseexpo train chooser`` (``learning.chooser_training``), with these differences: the cost is
the way to 99% plus 0.7 times the way to 90%, each divided by the square root of nearest frontier's, without a cost of
steps; it starts at the nearest frontier of a short tour; and a generation explores 50 houses. It takes 20 minutes for
17 generations on a third of a core.
"""

from __future__ import annotations

import hashlib
import sys
from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt

from houseexpo import FloorPlan, open_dataset
from houseexpo.errors import HouseExpoError
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.learning.chooser_training import NEAREST, CmaEsSearch, HouseExplorer
from houseexpo.pseudoslam.learning.records import find_commit
from houseexpo.pseudoslam.learning.weights import make_weights, write_weights

Floats = npt.NDArray[np.float64]
START: Final = make_weights(way=-2.0, tour_beyond_the_shortest=-1.0, large=0.5)
GENERATIONS, CANDIDATES, HOUSES, KEPT_OUT = 17, 12, 50, 200
SHARES, WEIGHTS = (0.9, 0.99), (0.7, 1.0)
PIXELS_PER_METRE: Final = 12.5
STEPS: Final = 2500
MISSED_M, MISSED_M_PER_SHARE = 5.0, 150.0
"""Metres charged where a share is not reached."""


def find_ways(explorer: HouseExplorer, plan: FloorPlan, key: list[int], each: list[Floats]) -> Floats | None:
    """Return the metres to each share (n, shares) for each of n weights from one start; None if no robot fits."""
    try:
        begun = explorer.begin(plan, np.random.default_rng(key))
    except HouseExpoError:
        return None
    found = np.zeros((len(each), len(SHARES)))
    for n, weights in enumerate(each):
        walk = begun.copy()
        explorer.go(walk, weights, SHARES[-1])
        seen = walk.course.covered[: walk.steps + 1] / walk.state.observable_cells
        gone_m = walk.course.gone_px[: walk.steps + 1] / PIXELS_PER_METRE
        for k, share in enumerate(SHARES):
            reached = np.flatnonzero(seen >= share)
            charged = MISSED_M + MISSED_M_PER_SHARE * max(share - seen[-1], 0.0)
            found[n, k] = gone_m[reached[0]] if len(reached) else gone_m[-1] + charged
    return found


def main() -> None:
    """Search, report each generation, and write the mean of the means of the last half of the generations."""
    plans, out = open_dataset(sys.argv[1]), Path(sys.argv[2])
    generations = int(sys.argv[3]) if len(sys.argv) > 3 else GENERATIONS
    listed = sorted(plans.split("train").ids, key=lambda name: hashlib.sha256(name.encode()).digest())[:-KEPT_OUT]
    explorer = HouseExplorer(SimulatorConfig(PIXELS_PER_METRE, max_steps=STEPS), STEPS)
    search, means = CmaEsSearch(START, CANDIDATES, 0), list[Floats]()
    for generation in range(generations):
        drawn = np.random.default_rng([0, generation]).permutation(len(listed))[:HOUSES]
        candidates = search.ask()
        each = [*candidates, search.mean, NEAREST]
        tried = [find_ways(explorer, plans[listed[i]], [0, generation, n], each) for n, i in enumerate(drawn)]
        ways = np.array([one for one in tried if one is not None])
        costs = (ways[:, :-2] / np.sqrt(ways[:, -1:] + 1.0)) @ WEIGHTS
        search.tell(costs.mean(axis=0).tolist())
        means.append(search.mean)
        learned, nearest = ways[:, -2:].mean(axis=0).round(2).tolist()
        print(f"generation {generation + 1}: metres to 90% and 99% {learned}, nearest frontier {nearest}", flush=True)  # noqa: T201
    about = {
        "family": "finisher",
        "seed": 0,
        "generations": generations,
        "command": "python -m research.finisher_training",
    }
    write_weights(out, np.mean(means[generations // 2 :], axis=0), {**about, "commit": find_commit()})


if __name__ == "__main__":
    main()
