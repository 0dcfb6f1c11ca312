"""Learn the policies ``seek-likely``: which frontier to go to on the way to a room or a piece of furniture of a kind.

    python -m research.seek_training HOUSES FURNISHED OUT.json [SEED] [PLANS]

The robot searches in houses of the train lists, on the tasks of the tracks ``roomgoal`` (HOUSES) and ``objectgoal``
(FURNISHED). At each choice, the way through each frontier to the nearest goal is measured in the true house; what it is
longer than the shortest of them is the frontier's regret, as a share of the shortest way from the start. The weights
make the expected regret least if frontiers are drawn by the softmax of their scores (imitation of a clairvoyant oracle:
Choudhury et al., 2018). In the first round the robot goes by the weights of ``look-around``, in the later ones by
what it has learned so far, and in a tenth of its choices at random; all choices count (DAgger: Ross et al., 2011).
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra
from scipy.special import softmax

from houseexpo import Dataset, open_dataset
from houseexpo.errors import ConfigError, HouseExpoError
from houseexpo.files import write_atomically
from houseexpo.pseudoslam.agents.learned import look_around
from houseexpo.pseudoslam.agents.protocol import Knowledge, Robot, make_knowledge, make_robot
from houseexpo.pseudoslam.agents.seeking import (
    FORMAT,
    SEEKER_FEATURES,
    LikelyExplorer,
    Seeker,
    SeekerWeights,
)
from houseexpo.pseudoslam.benchmark.tracks import find_track
from houseexpo.pseudoslam.envs.single import NavigationEnv
from houseexpo.pseudoslam.kernels.planning.frontier_features import FEATURES, LOOKED_AT
from houseexpo.pseudoslam.kernels.planning.planner_types import STRAIGHT
from houseexpo.pseudoslam.learning.records import find_commit
from houseexpo.pseudoslam.learning.weights import read_weights

Floats = npt.NDArray[np.float64]
PIXELS_PER_METRE: Final = 12.5
ROUNDS: Final = 3
AT_RANDOM: Final = 0.1
"""The share of choices that are random, so that the robot also comes to where it would not go."""
SHRINK: Final = 1e-4
SHRINK_OF_KIND: Final = 1e-3
"""The weights of the squares of all weights, and of their differences between kinds of goals, in the loss."""
MOST_REGRET: Final = 5.0
"""The largest regret of a frontier, shortest ways."""


@dataclass
class Choice:
    """A choice of the robot: the kind of goal, the numbers of the frontiers (n, numbers), and their regrets (n,)."""

    goal: str
    numbers: Floats
    regrets: Floats


class Learner(LikelyExplorer):
    """An explorer that notes its choices, and what they are worth in the true house."""

    def __init__(
        self, robot: Robot, weights: SeekerWeights, ways_m: Floats, shortest_m: float, rng: np.random.Generator
    ) -> None:
        super().__init__(robot, 0, weights)
        self.choices: list[Choice] = []
        self._ways_m, self._shortest_m, self._rng = ways_m, shortest_m, rng

    def choose(self, known: npt.NDArray[np.uint8], frontiers: Any, info: Knowledge) -> int:
        """Return the frontier with the highest score, or a random one."""
        numbers = self.measure(known, frontiers, info)
        first = frontiers[: len(numbers)]
        ways = first["way"] / (STRAIGHT * self.metre) + self._ways_m.flat[first["goal"]]
        if len(numbers) > 1 and np.isfinite(ways.min()):
            regrets = np.minimum((ways - ways.min()) / self._shortest_m, MOST_REGRET)
            self.choices.append(Choice(info["goal_name"], numbers, regrets))
        if self._rng.random() < AT_RANDOM:
            return int(self._rng.integers(len(numbers)))
        return int(np.argmax(numbers @ np.array(self._by_goal.get(info["goal_name"], self._by_goal[""]))))


def ways_to(inside: npt.NDArray[np.uint8], standing: npt.NDArray[np.uint8], metre: float) -> Floats:
    """Return the way from each cell (rows, cols) to the nearest that is inside, metres; infinite without one."""
    numbers = np.full(standing.shape, -1)
    numbers[standing != 0] = np.arange(np.count_nonzero(standing))
    starts, ends, lengths = [], [], []
    for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
        cols = slice(max(-right, 0), standing.shape[1] - max(right, 0))
        here = numbers[: standing.shape[0] - down, cols]
        there = numbers[down:, max(right, 0) : standing.shape[1] + min(right, 0)]
        both = (here >= 0) & (there >= 0)
        starts.append(here[both])
        ends.append(there[both])
        lengths.append(np.full(int(both.sum()), np.hypot(down, right)))
    size = int(numbers.max()) + 1
    graph = coo_matrix((np.concatenate(lengths), (np.concatenate(starts), np.concatenate(ends))), (size, size)).tocsr()
    goals = numbers[(inside != 0) & (standing != 0)]
    found = np.full(standing.shape, np.inf)
    found[standing != 0] = dijkstra(graph, directed=False, indices=goals, min_only=True) / metre
    return found


def search(env: NavigationEnv, plan_id: str, seed: int, weights: SeekerWeights) -> tuple[list[Choice], float] | None:
    """Return the choices of a search and its SPL; None in a plan without two kinds of goals."""
    try:
        observation, info = env.reset(seed=seed, options={"plan_id": plan_id})
    except HouseExpoError:
        return None
    world, shortest_m = env.simulator.world, float(info["to_goal_m"])
    if len(world.regions) < 2 or shortest_m < 1.0:
        return None
    knowledge = make_knowledge(env.simulator, env.state)
    ways_m = ways_to(world.regions[knowledge["goal_name"]].inside, world.traversable, PIXELS_PER_METRE)
    robot = make_robot(env, Seeker.interface)
    learner = Learner(robot, weights, ways_m, shortest_m, np.random.default_rng(seed))
    policy = Seeker(robot, 0, learner)
    while True:
        action = policy(observation, make_knowledge(env.simulator, env.state))
        if action is None:
            return learner.choices, 0.0
        observation, _, terminated, truncated, info = env.step(action)
        if terminated or truncated:
            return learner.choices, float(info["spl"])


def fit(
    choices: list[Choice], shrink_all: float = SHRINK, shrink_kind: float = SHRINK_OF_KIND
) -> dict[str, tuple[float, ...]]:
    """Return the weights of each kind of goal, and those of all, that make the expected regret least."""
    goals = sorted({each.goal for each in choices})
    kind = np.array([goals.index(each.goal) for each in choices])
    wide = len(SEEKER_FEATURES)
    numbers = np.zeros((len(choices), LOOKED_AT, wide), np.float32)
    regrets = np.full((len(choices), LOOKED_AT), 0.0)
    there = np.zeros((len(choices), LOOKED_AT), bool)
    for i, each in enumerate(choices):
        n = len(each.regrets)
        numbers[i, :n], regrets[i, :n], there[i, :n] = each.numbers, each.regrets, True
    spread = np.maximum(numbers[there].std(axis=0, dtype=np.float64), 0.02)
    numbers /= spread.astype(np.float32)
    which = [np.flatnonzero(kind == goal) for goal in range(len(goals))]

    def loss(flat: Floats) -> tuple[float, Floats]:
        weights = flat.reshape(len(goals) + 1, wide)
        slope = np.zeros_like(weights)
        value = 0.0
        for goal, rows in enumerate(which):
            x, cost, ok = numbers[rows], regrets[rows], there[rows]
            p = softmax(np.where(ok, x @ (weights[0] + weights[goal + 1]), -np.inf), axis=1)
            mean = (p * cost).sum(axis=1, keepdims=True)
            value += float(mean.sum())
            of_scores = p * (cost - mean)
            slope[goal + 1] += np.einsum("ij,ijk->k", of_scores, x)
        slope[0] = slope[1:].sum(axis=0)
        slope /= len(choices)
        shrink = np.full((len(goals) + 1, 1), shrink_kind)
        shrink[0] = shrink_all
        return value / len(choices) + float((shrink * weights**2).sum()), (slope + 2 * shrink * weights).ravel()

    start = np.zeros((len(goals) + 1, wide))
    start[0, : len(FEATURES)] = 0.2 * START * spread[: len(FEATURES)]
    found = minimize(loss, start.ravel(), jac=True, method="L-BFGS-B", options={"maxiter": 200})
    weights = found.x.reshape(start.shape)
    each_kind = {"": weights[0], **{name: weights[0] + of for name, of in zip(goals, weights[1:], strict=True)}}
    print(f"  {len(choices)} choices: regret {found.fun:.3f}, at first {loss(start.ravel())[0]:.3f}", flush=True)  # noqa: T201
    return {name: tuple(float(f"{x:.3g}") for x in of / spread) for name, of in each_kind.items()}


START: Final = read_weights(look_around.file)[0]


def learn(track_name: str, plans: Dataset, seed: int, number: int) -> dict[str, tuple[float, ...]]:
    """Return the weights of the kinds of goals of a track, learned in a number of plans of the train list."""
    track = find_track(track_name)
    ids = sorted(plans.splits["train"])
    ids = [name for name in ids if name in plans]
    rng = np.random.default_rng([seed, len(track_name)])
    env = NavigationEnv(plans, replace(track.config, pixels_per_metre=PIXELS_PER_METRE))
    goals = {"": (*START.tolist(), *[0.0] * (len(SEEKER_FEATURES) - len(FEATURES)))}
    choices: list[Choice] = []
    for number_of_round in range(ROUNDS):
        weights, spls = SeekerWeights(FORMAT, {}, SEEKER_FEATURES, goals), list[float]()
        while len(spls) < number // ROUNDS:
            found = search(env, ids[int(rng.integers(len(ids)))], int(rng.integers(2**31)), weights)
            if found is not None:
                choices += found[0]
                spls.append(found[1])
        spl = 100 * float(np.mean(spls))
        print(f"{track_name}, round {number_of_round + 1}: SPL {spl:.1f} in {len(spls)} searches", flush=True)  # noqa: T201
        goals = fit(choices)
    return goals


def main() -> None:
    """Learn both tasks, and write the weights."""
    houses, furnished, out = open_dataset(sys.argv[1]), open_dataset(sys.argv[2]), Path(sys.argv[3])
    seed = int(sys.argv[4]) if len(sys.argv) > 4 else 0
    number = int(sys.argv[5]) if len(sys.argv) > 5 else 3000
    goals = learn("roomgoal", houses, seed, number)
    goals = {**learn("objectgoal", furnished, seed, number), **goals}
    about = {
        "family": "seek-likely",
        "seed": seed,
        "searches": number,
        "command": "python -m research.seek_training HOUSES FURNISHED OUT.json SEED",
        "commit": find_commit(),
    }
    write_atomically(out, msgspec.json.encode(SeekerWeights(FORMAT, about, SEEKER_FEATURES, goals)) + b"\n")


if __name__ == "__main__":
    try:
        main()
    except ConfigError as error:
        sys.exit(str(error))
