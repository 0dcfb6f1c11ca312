"""Search the weights of the policies ``finisher`` and ``look-around``, which go short ways to 90% and to 99%.

    python -m research.finisher_training DATASET OUT.json [finisher | look-around] [GENERATIONS]

The search is that of ``houseexpo train chooser`` (``learning.chooser_training``), with these differences: the cost is
the way to 99% plus 0.7 times the way to 90%, each divided by the square root of nearest frontier's, without a cost of
steps; it starts at the nearest frontier of a short tour; and a generation explores 50 houses. It takes 20 minutes for
17 generations on a third of a core.

``look-around`` starts at the finisher's weights, the way to 90% counts 1.3 times, and the robot of the search sees all
round, as one that looks round does. The search shortens the way to 90% and lengthens that to 99%, so that the weights
are the mean of its result and of its start.
"""

from __future__ import annotations

import hashlib
import sys
from dataclasses import replace
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from houseexpo import FloorPlan, open_dataset
from houseexpo.errors import HouseExpoError
from houseexpo.pseudoslam.agents.learned import finisher
from houseexpo.pseudoslam.config import LaserConfig, RobotConfig, SimulatorConfig
from houseexpo.pseudoslam.learning.chooser_training import NEAREST, CmaEsSearch, HouseExplorer
from houseexpo.pseudoslam.learning.records import find_commit
from houseexpo.pseudoslam.learning.weights import make_weights, read_weights, write_weights

Floats = npt.NDArray[np.float64]
CANDIDATES, HOUSES, KEPT_OUT = 12, 50, 200
SHARES: Final = (0.9, 0.99)
PIXELS_PER_METRE: Final = 12.5
STEPS: Final = 2500
MISSED_M, MISSED_M_PER_SHARE = 5.0, 150.0
"""Metres charged where a share is not reached."""


class Search(NamedTuple):
    """The search of a policy.

    The start is its first mean; ``kept`` is the share of the start in the weights; ``weights`` are those of the ways to
    each share.
    """

    start: Floats
    weights: tuple[float, float]
    config: SimulatorConfig
    generations: int
    kept: float = 0.0


_CONFIG: Final = SimulatorConfig(PIXELS_PER_METRE, max_steps=STEPS)
SEARCHES: Final = {
    "finisher": Search(
        make_weights(way=-2.0, tour_beyond_the_shortest=-1.0, large=0.5), (0.7, 1.0), _CONFIG, 17
    ),
    "look-around": Search(
        read_weights(finisher.file)[0],
        (1.3, 1.0),
        replace(_CONFIG, laser=LaserConfig(fov_deg=360.0), robot=RobotConfig(turn_deg=20.0)),
        20,
        0.5,
    ),
}  # fmt: skip


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
    name = sys.argv[3] if len(sys.argv) > 3 else "finisher"
    start, counted, config, generations, kept = SEARCHES[name]
    generations = int(sys.argv[4]) if len(sys.argv) > 4 else generations
    listed = sorted(plans.split("train").ids, key=lambda name: hashlib.sha256(name.encode()).digest())[:-KEPT_OUT]
    explorer = HouseExplorer(config, STEPS)
    search, means = CmaEsSearch(start, CANDIDATES, 0), list[Floats]()
    for generation in range(generations):
        drawn = np.random.default_rng([0, generation]).permutation(len(listed))[:HOUSES]
        candidates = search.ask()
        each = [*candidates, search.mean, NEAREST]
        tried = [find_ways(explorer, plans[listed[i]], [0, generation, n], each) for n, i in enumerate(drawn)]
        ways = np.array([one for one in tried if one is not None])
        costs = (ways[:, :-2] / np.sqrt(ways[:, -1:] + 1.0)) @ counted
        search.tell(costs.mean(axis=0).tolist())
        means.append(search.mean)
        learned, nearest = ways[:, -2:].mean(axis=0).round(2).tolist()
        print(f"generation {generation + 1}: metres to 90% and 99% {learned}, nearest frontier {nearest}", flush=True)  # noqa: T201
    about = {
        "family": name,
        "seed": 0,
        "generations": generations,
        "command": f"python -m research.finisher_training DATASET OUT.json {name}",
    }
    found = np.mean(means[generations // 2 :], axis=0)
    write_weights(out, kept * start + (1.0 - kept) * found, {**about, "commit": find_commit()})


if __name__ == "__main__":
    main()
