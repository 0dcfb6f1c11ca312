"""Learn the policies ``give-way``: by which measures a robot gives way to people on its way to a place.

    python -m research.social_training HOUSES OUT.json [SEED]

CMA-ES searches for the measures (``agents.social.Measures``) on plans of the train list, half of the episodes among the
people of the track ``social`` and half among those of ``social-orca``. All candidates of a generation go through the
same episodes, new ones in each generation. The cost of an episode is the time within 1.2 m of a person as a share of
what the policy ``wait`` takes there plus 5 s, three times what is missing to an SPL of 1, and 0.1 for each collision.
The result is the mean of the means of the later half of the generations.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np
import numpy.typing as npt

from houseexpo import Dataset, open_dataset
from houseexpo.errors import ConfigError, HouseExpoError
from houseexpo.files import write_atomically
from houseexpo.pseudoslam.agents.protocol import PolicyFactory, make_knowledge, make_robot
from houseexpo.pseudoslam.agents.social import GivingWay, LearnedMeasures, Measures, Waiting
from houseexpo.pseudoslam.benchmark.episodes import gap_to_people
from houseexpo.pseudoslam.benchmark.measures import PERSONAL_M
from houseexpo.pseudoslam.benchmark.tracks import find_track
from houseexpo.pseudoslam.envs.single import NavigationEnv
from houseexpo.pseudoslam.learning.records import find_commit

PIXELS_PER_METRE: Final = 12.5
TRACKS: Final = ("social", "social-orca")
GENERATIONS: Final = 6
CANDIDATES: Final = 8
EPISODES: Final = 14
STEP: Final = 0.42
"""The first standard deviation of the logarithm of each measure."""


@dataclass(frozen=True)
class Case:
    """An episode: its track, plan and seed, and the seconds near people of the policy ``wait`` in it."""

    track: str
    plan_id: str
    seed: int
    wait_s: float = 0.0


class School:
    """Episodes of the tracks in plans of the train list."""

    def __init__(self, plans: Dataset, seed: int) -> None:
        self._ids = [name for name in sorted(plans.splits["train"]) if name in plans]
        self._rng = np.random.default_rng([seed, 77])
        self._envs = {
            name: NavigationEnv(
                plans, replace(find_track(name).config, pixels_per_metre=PIXELS_PER_METRE), actions="continuous"
            )
            for name in TRACKS
        }

    def draw(self) -> Case:
        """Return a new episode."""
        while True:
            case = Case(
                TRACKS[int(self._rng.integers(2))],
                self._ids[int(self._rng.integers(len(self._ids)))],
                int(self._rng.integers(2**31)),
            )
            try:
                return replace(case, wait_s=self.play(case, Waiting)["personal_s"])
            except HouseExpoError:
                continue  # a plan in which the robot or a goal has no place

    def play(self, case: Case, factory: PolicyFactory) -> dict[str, float]:
        """Return the SPL, the seconds in personal space and the collisions of an episode."""
        env, personal_s, ended = self._envs[case.track], 0.0, False
        _, info = env.reset(seed=case.seed, options={"plan_id": case.plan_id})
        policy = factory(make_robot(env, GivingWay.interface), 0)
        while not ended:
            _, _, terminated, truncated, info = env.step(policy(None, make_knowledge(env.simulator, env.state)))
            personal_s += env.config.step_s * (gap_to_people(env) < PERSONAL_M)
            ended = terminated or truncated
        return {"spl": float(info["spl"]), "personal_s": personal_s, "collisions": float(info["collisions"])}


def measures_at(place: npt.NDArray[np.float64]) -> Measures:
    """Return the measures at a place of the search; those by hand are at 0."""
    by_hand = np.array(msgspec.structs.astuple(Measures()))
    return Measures(*(float(f"{x:.3g}") for x in by_hand * np.exp(place)))


def cost(case: Case, found: dict[str, float]) -> float:
    """Return the cost of an episode."""
    return found["personal_s"] / (5.0 + case.wait_s) + 3.0 * (1.0 - found["spl"]) + 0.1 * found["collisions"]


def learn(plans: Dataset, seed: int) -> Measures:
    """Return learned measures."""
    from cma import CMAEvolutionStrategy

    school = School(plans, seed)
    start = np.zeros(len(msgspec.structs.fields(Measures)))
    search: Any = CMAEvolutionStrategy(start, STEP, {"popsize": CANDIDATES, "seed": seed + 1, "verbose": -9})
    means = []
    for generation in range(GENERATIONS):
        cases = [school.draw() for _ in range(EPISODES)]
        places = search.ask()
        costs = []
        for place in places:
            policy = partial(GivingWay, measures=measures_at(place))
            costs.append(float(np.mean([cost(case, school.play(case, policy)) for case in cases])))
        search.tell(places, costs)
        means.append(search.mean)
        print(f"generation {generation + 1}: least cost {min(costs):.3f}, mean {np.mean(costs):.3f}", flush=True)  # noqa: T201
    return measures_at(np.mean(means[GENERATIONS // 2 :], axis=0))


def main() -> None:
    """Learn, and write the measures."""
    plans, out = open_dataset(sys.argv[1]), Path(sys.argv[2])
    seed = int(sys.argv[3]) if len(sys.argv) > 3 else 0
    about = {
        "family": "give-way",
        "seed": seed,
        "episodes": GENERATIONS * CANDIDATES * EPISODES,
        "command": "python -m research.social_training HOUSES OUT.json SEED",
        "commit": find_commit(),
    }
    write_atomically(out, msgspec.json.encode(LearnedMeasures(about, learn(plans, seed))) + b"\n")


if __name__ == "__main__":
    try:
        main()
    except ConfigError as error:
        sys.exit(str(error))
