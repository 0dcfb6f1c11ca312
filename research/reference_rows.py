"""Compute a row that no policy drove, on the plans and starts of a result, and write it beside the result."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rich.console import Console

from houseexpo import open_dataset
from houseexpo.errors import ConfigError
from houseexpo.progress import show_progress
from houseexpo.pseudoslam.benchmark.cases import Case
from houseexpo.pseudoslam.benchmark.episodes import EpisodeOutcome
from houseexpo.pseudoslam.benchmark.result import PolicyRecord, read_result, write_result
from houseexpo.pseudoslam.benchmark.run import make_result, make_run_times
from houseexpo.pseudoslam.benchmark.tracks import Track, find_track
from houseexpo.pseudoslam.envs.single import ExplorationEnv
from houseexpo.pseudoslam.worlds.world import World

OutcomeFinder = Callable[[Track, Case, World, float, float], EpisodeOutcome]
"""From a track, a case, its house and the start (x, y), pixels."""


def write_reference_row(name: str, module: str, fits: Callable[[Track], str], find: OutcomeFinder) -> None:
    """Write a row for all plans of a result, or print the means over some of them beside the result's own.

    The command's arguments are DATASET RESULT [NUMBER].

    Parameters
    ----------
    fits
        What is expected of a track that does not fit; an empty text if it fits.

    Raises
    ------
    ConfigError
        The track does not fit.
    """
    file = Path(sys.argv[2])
    like, number = read_result(file), int(sys.argv[3]) if len(sys.argv) > 3 else None
    track, start = find_track(like.track_id), time.perf_counter()
    if expected := fits(track):
        raise ConfigError(f"{file}: expected {expected}, found {track.id}")
    cases = list(map(Case, like.episodes["plan"], like.episodes["seed"]))[:number]
    env = ExplorationEnv(open_dataset(sys.argv[1]).only([case.plan_id for case in cases]), track.config)
    outcomes = []
    for case in show_progress(cases, name, len(cases)):
        env.reset(seed=case.seed, options={"plan_id": case.plan_id})
        x, y = env.state.pose_px[:2].tolist()
        outcomes.append(find(track, case, env.simulator.world, x, y))
    for metric in track.metrics:
        pairs = [
            (one, other)
            for one, other in zip([each.values[metric.key] for each in outcomes], like.column(metric.key), strict=False)
            if one is not None and other is not None
        ]
        if pairs:
            one, other = np.mean(pairs, axis=0).tolist()
            text = f"{metric.key}: {name} {one:.3f}, {like.policy.name} {other:.3f}, {len(pairs)} plans"
            Console(width=160).print(text, highlight=False)
    if number is None:
        policy = PolicyRecord(name, module, "", 0, True, "discrete", "map")
        times = make_run_times(outcomes, time.perf_counter() - start, 1)
        result = make_result(track, policy, like.plans, outcomes, times)
        write_result(result, file.with_name(f"{track.id}-{name.replace(' ', '-')}.json"))
