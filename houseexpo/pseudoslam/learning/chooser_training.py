"""Train a chooser of frontiers: search by CMA-ES for feature weights with which houses are explored on short paths.

R1  Weights are optimised by CMA-ES (Hansen and Ostermeier, 2001). The candidates of a generation are drawn around a
    mean, and all explore the same houses; then the mean and the covariance move towards the better ones. The search
    starts at a rule that weighs information gain against path length. The result is the mean of the last half of all
    means, since costs are noisy.
R2  The houses of each generation are drawn from the train list. All candidates have the same starts, so that they
    differ only in their choices. The last ``tested`` plans of the list, by their ids' SHA-256, are not used for this.
R3  The cost of a candidate in a house is the distance to 90% coverage plus a cost per step, including turns. It is
    divided by the square root of the cost of nearest frontier, so that large houses have more weight but do not
    dominate.
R4  The costs of a finished generation are stored. A killed run is replayed from them, and ends with the same weights.
    The number of threads does not affect the costs.
"""

from __future__ import annotations

import copy
import hashlib
import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from importlib.util import find_spec
from pathlib import Path
from threading import local
from typing import Any, Final

import msgspec
import numpy as np

from houseexpo.configuration import check_above_zero, check_number, check_whole_number
from houseexpo.dataset import Dataset
from houseexpo.dataset.splits import encode_id_list
from houseexpo.errors import ConfigError, MissingDependencyError, TrainingError, install_command
from houseexpo.files import encode_json, write_atomically
from houseexpo.floorplan import FloorPlan
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.kernels.explore import ExplorationCurve, ExplorerMemory, ExplorerRules, explore, new_memory
from houseexpo.pseudoslam.kernels.planning.frontier_features import FEATURES, LOOKED_AT
from houseexpo.pseudoslam.kernels.tolerances import MAX_BUMPS, MAX_FRONTIERS
from houseexpo.pseudoslam.kernels.types import Floats
from houseexpo.pseudoslam.learning.records import begin_run, find_commit, find_versions
from houseexpo.pseudoslam.learning.weights import make_weights, round_weights, write_weights
from houseexpo.pseudoslam.planning import (
    count_first_looks,
    descent_rules,
    explorer_frontier_rules,
    feature_rules,
)
from houseexpo.pseudoslam.simulator import Simulator
from houseexpo.pseudoslam.state import State
from houseexpo.pseudoslam.step_kernels import enlarge_scratch, make_scratch, make_step_params

SPREADS: Final = {
    "way": 0.45, "log way": 0.48, "way beyond the nearest": 0.45, "rank": 0.2, "turn": 0.27, "large": 0.31,
    "log length": 0.54, "log sight from the goal": 0.87, "log sight from the middle": 0.71, "sight less the best": 0.87,
    "unknown within 1 m": 0.17, "unknown within 2.5 m": 0.16, "unknown within 5 m": 0.12, "free within 2.5 m": 0.18,
    "walls within 2.5 m": 0.02, "others within 3 m": 0.59, "nearer to the others": 0.2, "nearer to their length": 0.21,
    "tour beyond the shortest": 0.53, "to the rim": 0.28,
}  # fmt: skip
"""Standard deviations among the frontiers of one map, over 60 published plans; they scale the search of each weight.
Features that are equal for all frontiers of a map do not affect the choice and have no weight."""
_FIRST_STEP = 0.3
_SEARCH = 2**31


class CmaEsSearch:
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
            raise MissingDependencyError(f"train chooser needs cma, not installed here: {install_command('learn')}")
        from cma import CMAEvolutionStrategy

        rng = np.random.default_rng([seed, _SEARCH])
        self._start, self._searched = start, [FEATURES.index(name) for name in SPREADS]
        self._spreads = np.array(list(SPREADS.values()))
        options = {"popsize": candidates, "seed": np.nan, "randn": lambda *n: rng.standard_normal(n), "verbose": -9}
        self._strategy: Any = CMAEvolutionStrategy(np.zeros(len(SPREADS)), _FIRST_STEP, options)
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


SEEN = 0.9
"""Coverage up to which distances and steps are counted."""
_FAR_M, _LONG = 150.0, 1000
"""Metres and steps charged for a house when time is up, in proportion to the part that is not explored."""


@dataclass
class ExplorationState:
    """The state of an exploration."""

    state: State
    memory: ExplorerMemory
    course: ExplorationCurve

    def copy(self) -> ExplorationState:
        """Return an independent copy; constant parts are shared."""
        changed = {name: getattr(self.state.episode, name).copy() for name in ("known", "pose", "counts", "readings")}
        state = State(self.state.episode._replace(**changed), self.state.observable_cells)
        memory, course = copy.deepcopy(self.memory), copy.deepcopy(self.course)
        return ExplorationState(state, memory, course)

    @property
    def steps(self) -> int:
        """Number of steps so far."""
        return int(self.state.counts.steps)

    @property
    def coverage(self) -> float:
        """The explored share of the observable cells, 0 to 1."""
        return float(self.state.counts.covered) / self.state.observable_cells


class HouseExplorer:
    """Explores houses with a limited number of steps; each thread needs its own object.

    Parameters
    ----------
    config
        The robot, its sensor, which must scan sectors without noise, and the resolution.
    most_steps
        The largest number of steps.
    """

    def __init__(self, config: SimulatorConfig, most_steps: int) -> None:
        if config.laser.rule != "sector" or config.noise.any or config.people.number or config.trajectories:
            raise ConfigError(
                "explorations: expected a laser that scans sectors without noise, and no moving obstacles"
            )
        self.config, self.most_steps = config, most_steps
        self._params, self._scratch = make_step_params(config), make_scratch(config)
        self._features = np.zeros((LOOKED_AT, len(FEATURES)))
        self._rules = ExplorerRules(
            descent_rules(config), MAX_BUMPS, explorer_frontier_rules(config), feature_rules(config)
        )

    def begin(self, plan: FloorPlan, rng: np.random.Generator) -> ExplorationState:
        """Return a new exploration."""
        simulator = Simulator.of(plan, self.config)
        self._scratch = enlarge_scratch(self._scratch, simulator.world.occupied.size)
        state = simulator.start(rng)
        memory = new_memory(count_first_looks(self.config), MAX_FRONTIERS)
        course = ExplorationCurve(np.zeros(self.most_steps + 1, np.int64), np.zeros(self.most_steps + 1))
        course.covered[0] = state.counts.covered
        return ExplorationState(state, memory, course)

    def go(self, walk: ExplorationState, weights: Floats, seen: float = SEEN) -> int:
        """Continue until this share is explored; see ``kernels.explore.explore``."""
        enough = math.ceil(seen * walk.state.observable_cells)
        return int(
            explore(
                walk.state.pool, walk.state.sizes, walk.memory, self._features, weights, self._rules, self._params,
                self._scratch, enough, walk.course,
            )
        )  # fmt: skip

    def way(self, plan: FloorPlan, rng: np.random.Generator, *each: Floats) -> Floats:
        """Return the metres and the steps to 90% (n, 2), for each of n weights from the same start.

        If 90% is not reached, the rest is charged for.
        """
        begun, found = self.begin(plan, rng), np.zeros((len(each), 2))
        for n, weights in enumerate(each):
            walk = begun.copy()
            self.go(walk, weights)
            left = max(SEEN - walk.coverage, 0.0)
            gone_m = walk.course.gone_px[walk.steps] / self.config.pixels_per_metre
            found[n] = gone_m + _FAR_M * left, walk.steps + _LONG * left
        return found


WEIGHTS: Final = "weights.json"
INFORMATION: Final = make_weights(log_sight_from_the_goal=1.0, way=-2.0, large=10.0)
NEAREST: Final = make_weights(rank=-1.0)
Say = Callable[[str], None]
_COSTS: Final = "costs.json"


@dataclass(frozen=True)
class ChooserConfig:
    """The configuration of the training of a chooser.

    Parameters
    ----------
    seed
        The seed of all random numbers.
    generations, candidates, plans
        The numbers of generations, of candidates per generation, and of houses per generation.
    tested
        Number of plans on which the result is compared with the initial rule and with nearest frontier.
    pixels_per_metre
        Resolution of the maps in training; features of frontiers are in metres.
    steps
        Largest number of steps of an exploration.
    step_m
        The cost of a step, in metres.
    """

    seed: int = 0
    generations: int = 30
    candidates: int = 12
    plans: int = 100
    tested: int = 200
    pixels_per_metre: float = 12.5
    steps: int = 2500
    step_m: float = 0.02

    def __post_init__(self) -> None:
        check_whole_number(self.seed, "seed", at_least=0)
        for name in ("generations", "plans", "tested", "steps"):
            check_whole_number(getattr(self, name), name, at_least=1)
        check_whole_number(self.candidates, "candidates", at_least=4)
        check_above_zero(self, "choosing", "pixels_per_metre")
        check_number(self.step_m, "choosing.step_m", at_least=0.0)


def train_chooser(
    plans: Dataset, ids: Sequence[str], config: ChooserConfig, folder: Path, *, resume: bool, threads: int, say: Say
) -> dict[str, Any]:
    """Train a chooser, write ``weights.json``, and return its description.

    Parameters
    ----------
    ids
        The ids of the train list.

    Raises
    ------
    TrainingError
        The folder holds another run, or a run and ``resume`` is False.
    ConfigError
        There are too few plans.
    MissingDependencyError
        ``cma`` is not installed.
    """
    run = {**asdict(config), "train": hashlib.sha256(encode_id_list(sorted(ids))).hexdigest()}
    made_by = find_commit()  # the code at the start, not at the end
    search = CmaEsSearch(INFORMATION, config.candidates, config.seed)
    houses = _Houses(plans, ids, config, threads)
    begin_run(folder, run, resume=resume)
    learned = round_weights(_search_weights(search, houses, config, folder / _COSTS, say))
    about = {
        **run,
        "commit": made_by,
        "versions": find_versions(),
        "tests": _compare_rules(houses, learned, say),
    }
    write_weights(folder / WEIGHTS, learned, about)
    return about


def _search_weights(search: CmaEsSearch, houses: _Houses, config: ChooserConfig, file: Path, say: Say) -> Floats:
    """Run a search through all generations, using the stored costs of earlier generations (R4)."""
    known, means = _read(file, config), list[Floats]()
    for generation in range(config.generations):
        candidates = search.ask()
        if generation == len(known):
            ways = houses.explore_training(generation, [*candidates, search.mean, NEAREST])
            known.append(_costs(ways, config.step_m).tolist())
            write_atomically(file, encode_json(known), durable=True)
            (metres, steps), (nearest_m, nearest_steps) = ways[:, -2:].mean(axis=0).tolist()
            say(
                f"generation {generation + 1} of {config.generations}: {metres:.2f} m and {steps:.0f} steps to 90%, "
                f"nearest frontier {nearest_m:.2f} m and {nearest_steps:.0f}"
            )
        search.tell(known[generation])
        means.append(search.mean)
    learned: Floats = np.mean(means[config.generations // 2 :], axis=0)
    return learned


def _costs(ways: Floats, step_m: float) -> Floats:
    """Return the candidates' costs (R3) from distances and steps (houses, candidates + 2, 2), nearest frontier last."""
    metres = ways[..., 0] + step_m * ways[..., 1]
    costs: Floats = (metres[:, :-2] / np.sqrt(metres[:, -1:] + 1.0)).mean(axis=0)
    return costs


def _compare_rules(houses: _Houses, learned: Floats, say: Say) -> dict[str, dict[str, float]]:
    """Return the means over the plans that are not used in training, and report them."""
    named = {"learned": learned, "information": INFORMATION, "nearest": NEAREST}
    means = houses.explore_test(list(named.values())).mean(axis=0).round(3).tolist()
    for name, (metres, steps) in zip(named, means, strict=True):
        say(f"on plans not used in training, {name}: {metres:.2f} m and {steps:.0f} steps to 90%")
    return {name: {"metres": metres, "steps": steps} for name, (metres, steps) in zip(named, means, strict=True)}


class _Houses:
    """Explores the houses of a run on several threads."""

    def __init__(self, plans: Dataset, ids: Sequence[str], config: ChooserConfig, threads: int) -> None:
        wanted = config.plans + config.tested
        if len(ids) < wanted:
            said = f"expected {wanted} plans for training and testing"
            raise ConfigError(f"{said}, found {len(ids)}; ask for fewer")
        listed = sorted(ids, key=lambda name: hashlib.sha256(name.encode()).digest())
        self._plans, self._config, self._threads = plans, config, threads
        self._train_ids, self._test_ids = listed[: -config.tested], listed[-config.tested :]
        self._own = local()

    def explore_training(self, generation: int, each: list[Floats]) -> Floats:
        """Return metres and steps to 90% (plans, n, 2) in the houses of a generation, for each of n weights (R2)."""
        drawn = np.random.default_rng([self._config.seed, generation]).permutation(len(self._train_ids))
        names = [self._train_ids[i] for i in drawn[: self._config.plans].tolist()]
        return self._ways(names, [self._config.seed, generation], each)

    def explore_test(self, each: list[Floats]) -> Floats:
        """Return the same for the houses that are not used in training."""
        return self._ways(self._test_ids, [], each)

    def _ways(self, names: list[str], key: list[int], each: list[Floats]) -> Floats:
        def way(n: int) -> Floats:
            rng = np.random.default_rng([*key, n])
            return self._explorations().way(self._plans[names[n]], rng, *each)

        with ThreadPoolExecutor(self._threads) as pool:
            return np.array(list(pool.map(way, range(len(names)))))

    def _explorations(self) -> HouseExplorer:
        """Return the ``HouseExplorer`` of this thread."""
        if not hasattr(self._own, "explorations"):
            robot = SimulatorConfig(self._config.pixels_per_metre, max_steps=self._config.steps)
            self._own.explorations = HouseExplorer(robot, self._config.steps)
        made: HouseExplorer = self._own.explorations
        return made


def _read(file: Path, config: ChooserConfig) -> list[list[float]]:
    """Return the costs of the finished generations."""
    if not file.exists():
        return []
    try:
        costs = msgspec.json.decode(file.read_bytes(), type=list[list[float]])
    except (OSError, msgspec.MsgspecError) as error:
        raise TrainingError(f"{file}: expected costs of a run, found it damaged ({error}); delete it") from None
    if any(len(one) != config.candidates for one in costs):
        raise TrainingError(f"{file}: expected costs of {config.candidates} candidates; found others; delete it")
    return costs
