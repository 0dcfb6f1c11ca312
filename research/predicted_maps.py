"""Score predicted maps at equal coverage, on published plans and on the floors of KTH.

    python -m research.predicted_maps DATASET [NUMBER]
    python -m research.predicted_maps --kth FOLDER

A robot with the sensor of track ``kth`` explores by nearest frontier: the first NUMBER (100) plans of the benchmark,
which are on the published test list, or the 24 starts of ``kth``. The first map that reaches each share of
``SHARES`` is predicted, and scored by the IoU of obstacles over all judged cells, and over the unseen ones
(``benchmark.prediction``).
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt

from houseexpo import open_dataset
from houseexpo.progress import show_progress
from houseexpo.pseudoslam.agents.explorers import NearestFrontier
from houseexpo.pseudoslam.agents.protocol import Interface, Robot, make_knowledge
from houseexpo.pseudoslam.benchmark.cases import Case, make_cases, read_test_ids
from houseexpo.pseudoslam.benchmark.maps import map_cases, read_maps
from houseexpo.pseudoslam.benchmark.prediction import PREDICTORS, find_predictor, score_prediction
from houseexpo.pseudoslam.benchmark.tracks import find_track
from houseexpo.pseudoslam.envs.single import PseudoSlamEnv
from houseexpo.pseudoslam.kernels.collision import STATIC
from houseexpo.pseudoslam.simulator import ACTIONS

SHARES: Final = (0.33, 0.52, 0.71, 0.83)
Grid = npt.NDArray[np.uint8]


def maps_at_shares(env: PseudoSlamEnv, case: Case) -> Iterator[tuple[float, Grid, Grid]]:
    """Yield the first map that reaches each share: the share, the map, and the occupied cells."""
    _, info = env.reset(seed=case.seed, options={"plan_id": case.plan_id, "pose": case.pose})
    explorer, left = NearestFrontier(Robot(env.config), 0), list(SHARES)
    occupied = (env.state.occupied & STATIC).astype(np.uint8)
    for _ in range(env.config.max_steps):
        while left and info["coverage"] >= left[0]:
            yield left.pop(0), env.state.known.copy(), occupied
        action = explorer(None, make_knowledge(env.simulator, env.state)) if left else None
        if action is None:
            return
        env.simulator.step(env.state, ACTIONS[action])
        info = {"coverage": env.state.counts.covered / env.state.observable_cells}


def main() -> None:
    """Print a table for each share: the number of maps, and the scores of each predictor, percent."""
    track = find_track("kth")
    if sys.argv[1] == "--kth":
        houses = read_maps(track, Path(sys.argv[2]))
        cases, env = map_cases(track, houses), track.environment(houses, Interface())
    else:
        ids = read_test_ids()[: int(sys.argv[2]) if len(sys.argv) > 2 else 100]
        cases, env = make_cases(track.id, ids), track.environment(open_dataset(sys.argv[1]).only(ids), Interface())
    predictors = {name: find_predictor(name, track.config.pixels_per_metre) for name in PREDICTORS if name != "solid"}
    found: dict[float, list[list[float]]] = {share: [] for share in SHARES}
    for case in show_progress(cases, "exploring", len(cases)):
        for share, known, occupied in maps_at_shares(env, case):
            scores = [score_prediction(predict(known), known, occupied) for predict in predictors.values()]
            found[share].append([value for each in scores for value in (each.iou, each.iou_unseen_walls or 0.0)])
    print("share, maps, " + ", ".join(f"{name}: IoU, unseen walls" for name in predictors))  # noqa: T201
    for share, rows in found.items():
        means = " ".join(f"{100 * value:.1f}" for value in np.mean(rows, axis=0)) if rows else "-"
        print(f"{share:.0%}, {len(rows)}, {means}")  # noqa: T201


if __name__ == "__main__":
    main()
