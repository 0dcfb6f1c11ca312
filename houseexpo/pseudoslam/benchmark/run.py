"""Run a policy on a track: choose plans, run episodes in processes, return the result; for ``benchmark run``."""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Final

import msgspec
import numpy as np

from houseexpo import __version__
from houseexpo.dataset import Dataset
from houseexpo.errors import ConfigError, PlanError
from houseexpo.progress import show_progress
from houseexpo.pseudoslam.agents.loading import NamedPolicy, load_policy
from houseexpo.pseudoslam.benchmark import result as results
from houseexpo.pseudoslam.benchmark.cases import (
    Case,
    choose_plan_ids,
    content_sha256,
    ids_sha256,
    make_cases,
    make_room_cases,
)
from houseexpo.pseudoslam.benchmark.episodes import EpisodeOutcome, EpisodeRunner
from houseexpo.pseudoslam.benchmark.maps import map_cases, maps_sha256
from houseexpo.pseudoslam.benchmark.prediction import check_predictor_name
from houseexpo.pseudoslam.benchmark.supervise import run_cases
from houseexpo.pseudoslam.benchmark.tracks import MAP_TRACKS, Houses, Track, find_track
from houseexpo.pseudoslam.tasks import ROOM
from houseexpo.pseudoslam.worlds.cache import WorldCache
from houseexpo.pseudoslam.worlds.maps import MapHouse
from houseexpo.words import count_noun

_LIBRARIES: Final = ("gymnasium", "llvmlite", "numba", "numpy", "opencv-python-headless", "scipy")

DEFAULT_PLANS: Final = 500
DECISION_LIMIT_S: Final = 60.0
"""Time limit of an action, if no other one is given: planners in large houses need some seconds."""


@dataclass(frozen=True)
class RunSettings:
    """The settings of a run.

    Parameters
    ----------
    split, number
        The list from which plans are chosen, and their number; for avoidance, the number of episodes.
    fewer
        Whether all suitable plans will do if the list has fewer than ``number``.
    seed
        The seed of the policy; starts do not depend on it.
    workers
        Number of processes.
    decision_limit_s
        Time limit of an action of the policy, seconds.
    prediction
        The predicted map to score, as for ``EpisodeRunner``; "" for no map.
    """

    split: str = "test"
    number: int = DEFAULT_PLANS
    seed: int = 0
    workers: int = 1
    decision_limit_s: float = DECISION_LIMIT_S
    prediction: str = ""
    fewer: bool = False


def run_benchmark(
    track: Track, policy_name: str, plans: Dataset | list[MapHouse] | None, settings: RunSettings
) -> results.Result:
    """Run a policy on a track; a script that calls this needs ``if __name__ == "__main__"``.

    Parameters
    ----------
    policy_name
        A name for ``load_policy``.
    plans
        A data set with the list, or maps, which are all run; None if the track has its own room.

    Raises
    ------
    ConfigError, DatasetError
        There is no such policy or list, or the list has too few plans.
    PolicyError
        The policy failed in an episode.
    """
    named = load_policy(policy_name)
    check_task(named, track)
    policy = make_policy_record(named, settings.seed)
    if settings.prediction:
        check_predictor_name(settings.prediction)
        policy = msgspec.structs.replace(policy, prediction=settings.prediction)
    chosen, cases, record = _cases(track, plans, settings)
    start = time.perf_counter()
    new_runner = partial(make_runner, track.id, policy_name, chosen, settings.seed, settings.prediction)
    done = run_cases(new_runner, cases, settings.workers, settings.decision_limit_s, policy_name)
    outcomes = dict(show_progress(done, f"{policy_name}, {track.id}", len(cases)))
    in_order = [outcomes[number] for number in range(len(cases))]
    times = make_run_times(in_order, time.perf_counter() - start, settings.workers)
    return make_result(track, policy, record, in_order, times)


def make_runner(track_id: str, policy_name: str, plans: Houses, seed: int, prediction: str = "") -> EpisodeRunner:
    """Return a runner of episodes for one process."""
    return EpisodeRunner(find_track(track_id), load_policy(policy_name), plans, seed, prediction=prediction)


def check_task(policy: NamedPolicy, track: Track) -> None:
    """Raise ConfigError if a policy is for other tasks."""
    tasks = policy.interface.tasks
    if tasks and track.task not in tasks:
        raise ConfigError(f"policy {policy.name!r}: made for {', '.join(tasks)}; track {track.id} is {track.task}")


def _cases(
    track: Track, plans: Dataset | list[MapHouse] | None, settings: RunSettings
) -> tuple[Houses, list[Case], results.PlansRecord]:
    ids = [ROOM.id] * settings.number
    if track.needs_plans and not isinstance(plans, list):
        if track in MAP_TRACKS:
            raise ConfigError(f"track {track.id}: expected a folder of maps; name one with --maps")
        if plans is None:
            raise ConfigError(f"track {track.id}: expected a data set; name one with --dataset")
        ids = choose_plan_ids(
            plans, settings.split, settings.number, settings.workers, track.largest, fewer=settings.fewer
        )
        if track.config.goal_region:
            ids = playable_plans(track, plans, ids)
    return find_cases(track, plans, ids, settings.split)


def playable_plans(track: Track, plans: Dataset, ids: Sequence[str], most: int | None = None) -> list[str]:
    """Return the plans in which the robot fits and that have, if goals are of a kind, two kinds that it can reach.

    With two kinds, one is away from any start.

    Parameters
    ----------
    most
        The number of plans after which it stops; None for all.

    Raises
    ------
    ConfigError
        There is no such plan.
    """
    worlds = WorldCache(plans.only(ids), track.config)
    found = []
    for number, name in show_progress(enumerate(ids), "looking at plans", len(ids)):
        with suppress(ConfigError, PlanError):  # it has no goal, or no room for the robot
            if len(worlds[number].regions) > 1 or not track.config.goal_region:
                found.append(name)
        if len(found) == most:
            break
    if not found:
        goals = f" and that have two kinds of {track.config.goal_region.kind}" if track.config.goal_region else ""
        raise ConfigError(
            f"track {track.id}: expected plans in which a robot of {track.config.robot.radius_m:g} m fits{goals}, "
            f"found none among {count_noun(len(ids), 'plan')}; take another data set"
        )
    return found


def find_cases(
    track: Track, plans: Dataset | list[MapHouse] | None, ids: Sequence[str], split: str
) -> tuple[Houses, list[Case], results.PlansRecord]:
    """Return the houses of a run, its episodes, and the entries of a result about them.

    Parameters
    ----------
    plans
        A data set, or maps, which are all used; None if the track has its own room.
    ids
        The plan of each episode; only their number matters in the track's own room, and not even that in maps.
    split
        The list of the data set that the plans were chosen from.
    """
    if not track.needs_plans:
        cases = make_room_cases(track.id, ROOM.id, len(ids))
        return [ROOM], cases, results.PlansRecord(ROOM.id, len(cases), ids_sha256([ROOM.id]), "")
    if isinstance(plans, list):
        cases = map_cases(track, plans)
        names = [case.plan_id for case in cases]
        return plans, cases, results.PlansRecord("maps", len(cases), ids_sha256(names), maps_sha256(plans))
    assert plans is not None  # noqa: S101  # callers say which
    chosen = plans.only(ids)
    record = results.PlansRecord(split, len(ids), ids_sha256(ids), content_sha256(chosen))
    return chosen, make_cases(track.id, ids), record


def make_result(
    track: Track,
    policy: results.PolicyRecord,
    plans: results.PlansRecord,
    outcomes: Sequence[EpisodeOutcome],
    times: results.RunTimes,
) -> results.Result:
    """Return the result of the outcomes."""
    libraries = {library: version(library) for library in _LIBRARIES}
    return results.Result(
        results.FORMAT,
        track.record(),
        policy,
        plans,
        {"houseexpo": __version__, "python": platform.python_version(), **libraries},
        results.compute_summary(track, outcomes),
        results.compute_mean_curves(track, outcomes),
        results.make_episode_columns(outcomes),
        times,
        results.round_episode_curves(track, outcomes) if track in MAP_TRACKS else msgspec.UNSET,
        [results.encode_actions(each.actions) for each in outcomes],
    )


def make_policy_record(policy: NamedPolicy, seed: int) -> results.PolicyRecord:
    """Return the record of a policy in a result."""
    shown, made = policy.interface, policy.training
    return results.PolicyRecord(
        policy.name, policy.source, policy.sha256, seed, shown.sees_truth, shown.actions, shown.observation,
        made.family if made else "", made.seed if made else None,
    )  # fmt: skip


def make_run_times(outcomes: Sequence[EpisodeOutcome], wall_s: float, workers: int) -> results.RunTimes:
    """Return the times of decisions and of the whole run."""
    took_ms = np.concatenate([each.decisions_ms for each in outcomes])
    found: dict[str, float] = {}
    if len(took_ms):
        median, late = np.percentile(took_ms, (50, 99)).tolist()
        found = {"median": median, "mean": float(took_ms.mean()), "p99": late, "worst": float(took_ms.max())}
    decisions = {"number": float(len(took_ms)), **{name: round(value, 4) for name, value in found.items()}}
    return results.RunTimes(decisions, round(wall_s, 1), workers, _machine())


def _machine() -> dict[str, str | int | float]:
    return {
        "system": f"{platform.system()} {platform.machine()}",
        "processor": _processor(),
        "cores": os.cpu_count() or 1,
        "load": round(os.getloadavg()[0], 1) if hasattr(os, "getloadavg") else -1.0,
    }


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "")
