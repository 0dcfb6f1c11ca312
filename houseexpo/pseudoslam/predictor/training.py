"""Train the network of ``houseexpo.predict_map`` on maps of explored houses and of made office floors.

R1  Plans of the train list, plans that are enlarged and get thick walls, and floors of ``office_floors`` are explored
    by nearest frontier and by information gain, on cells of 0.1 m, with a laser of 20 m and 2,500 beams all round. Of
    each exploration, ``SNAPSHOTS`` maps are kept. A robot sees the surfaces of walls. What is behind them differs in
    the drawings of buildings, so that enlarged plans and floors are scored by one at random (``draw_walls``): walls are
    solid, as is the outside, or lines of one or two cells around a free inside, with a free outside. Walls that are
    learned are obstacles that border free space.
R2  Of the unknown cells of each map, some are drawn: walls and others by themselves, since few cells are walls. A step
    of training takes ``BATCH`` cells, half of them of plans, half of each kind with row and column exchanged.
R3  The loss is the log score of walls and of free space. Each cell weighs what it stands for, so that the answers are
    probabilities of all unknown cells; those of a map are divided by its number of unknown wall cells. The result is a
    moving average of the weights.
R4  Random numbers depend on the seed and on the number of the house, floor or step. Maps are stored in files of
    ``SHARD`` explorations, and the state of the training after each ``SAVED_STEPS`` steps, so that a killed run goes on
    with the same bits.
"""

from __future__ import annotations

import hashlib
import io
import itertools
import math
import zipfile
import zlib
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import cv2
import msgspec
import numpy as np
import numpy.typing as npt

from houseexpo.configuration import check_whole_number
from houseexpo.dataset import Dataset
from houseexpo.dataset.splits import encode_id_list
from houseexpo.errors import ConfigError, PlanError, TrainingError
from houseexpo.files import write_atomically
from houseexpo.floorplan import FloorPlan
from houseexpo.inference.map_prediction import (
    CELL_M,
    FREE,
    NUMBERS,
    OBSTACLE,
    UNKNOWN,
    WEIGHTS,
    describe_cells,
    swap_lines,
    write_network,
)
from houseexpo.pseudoslam.agents.explorers import InformationGain, NearestFrontier
from houseexpo.pseudoslam.agents.protocol import Robot, make_knowledge
from houseexpo.pseudoslam.config import LaserConfig, RobotConfig, SimulatorConfig
from houseexpo.pseudoslam.learning.records import begin_run, find_commit, find_versions
from houseexpo.pseudoslam.predictor.office_floors import make_office_floor
from houseexpo.pseudoslam.simulator import ACTIONS, Simulator
from houseexpo.pseudoslam.worlds.maps import House, map_house

Say = Callable[[str], None]
Bytes = npt.NDArray[np.uint8]
Floats = npt.NDArray[np.float32]
Halves = npt.NDArray[np.float16]

SNAPSHOTS: Final = 6
CELLS: Final = 400
"""Cells of a map that are learned from, at most."""
BATCH: Final = 4096
_SHARES_OF_KINDS: Final = (0.5, 0.25, 0.25)
"""Of plans, of enlarged ones with thick walls, and of floors."""
SHARD: Final = 20
SAVED_STEPS: Final = 500
LAYERS: Final = (96, 48)
_SOME_WALLS: Final = 50
"""Maps with fewer unknown wall cells weigh less."""
_RATE, _LAST_RATE = 3e-3, 0.01
_SCALED: Final = 50_000
"""Cells of each kind of map, at most, of which the mean and the spread of the numbers are taken."""
_LEAST_SPREAD: Final = np.float32(0.02)
_AVERAGED: Final = 0.998
_FREE_WEIGHT: Final = 0.3
_ROBOT: Final = SimulatorConfig(1 / CELL_M, RobotConfig(0.1), LaserConfig(20.0, 360.0, 0.144), max_steps=3500)
"""A laser of 2,500 beams. Far along a wall they are wider apart than cells, so that maps have gaps in walls."""
_SHARES, _SPREAD = (0.05, 0.93), 0.05
"""Coverage of the first and the last map, and by how much each may differ at random."""
_LINES: Final = (0, 1, 2)
"""Cells: the thickness of the lines that are drawn for a wall; 0 for solid walls."""
_FACADE_SHARE: Final = 0.7
"""The share of floors whose drawings show the outer surface of outer walls."""
_LARGER, _THICKER = (1.2, 2.2), 3.5
"""By how much plans are enlarged, and by how many cells their walls become thicker, for each time as large."""
_STATE: Final = "state.npz"


@dataclass(frozen=True)
class PredictorConfig:
    """The configuration of the training of a predictor.

    Parameters
    ----------
    seed
        The seed of all random numbers.
    houses, thick, floors
        The numbers of plans of the train list, of enlarged ones with thick walls, and of made floors that are explored.
    steps
        The number of steps, of ``BATCH`` cells each.
    """

    seed: int = 0
    houses: int = 500
    thick: int = 250
    floors: int = 200
    steps: int = 4000

    def __post_init__(self) -> None:
        check_whole_number(self.seed, "seed", at_least=0)
        for name in ("houses", "thick", "floors", "steps"):
            check_whole_number(getattr(self, name), name, at_least=1)


# ---------------------------------------------------------------------------------------------------------------------
# Maps.
# ---------------------------------------------------------------------------------------------------------------------


class Explored(msgspec.Struct, frozen=True):
    """Maps of one exploration, as packed bits of (rows, cols): true walls, and (walls, free cells) of each map."""

    rows: int
    cols: int
    walls: bytes
    free: bytes
    maps: list[tuple[bytes, bytes]]

    def unpack(self, bits: bytes) -> Bytes:
        """Return bits as (rows, cols) uint8."""
        found: Bytes = np.unpackbits(np.frombuffer(bits, np.uint8), count=self.rows * self.cols)
        return found.reshape(self.rows, self.cols)


def explore_house(house: House, outside: Bytes | None, rng: np.random.Generator) -> Explored:
    """Explore a house and return maps at increasing coverage (R1); its walls are solid.

    Parameters
    ----------
    outside
        (rows, cols), not 0 for cells outside a floor that its drawing shows as free; None without such cells.

    Raises
    ------
    ConfigError, PlanError
        The robot fits nowhere.
    """
    simulator = Simulator.of(house, _ROBOT)
    state = simulator.start(rng)
    policy = (NearestFrontier, InformationGain)[int(rng.integers(2))](Robot(_ROBOT), 0)
    free = (state.occupied == 0).astype(np.uint8)
    open_ = free if outside is None else free | (outside != 0)
    walls = cv2.dilate(open_, np.ones((3, 3), np.uint8)) & (1 - open_)
    shares = np.linspace(*_SHARES, SNAPSHOTS) + rng.uniform(-_SPREAD, _SPREAD, SNAPSHOTS)
    maps: list[tuple[bytes, bytes]] = []
    for _ in range(_ROBOT.max_steps):
        seen = state.counts.covered / state.observable_cells
        while len(maps) < SNAPSHOTS and seen >= shares[len(maps)]:
            maps.append((np.packbits(state.known == OBSTACLE).tobytes(), np.packbits(state.known == FREE).tobytes()))
        action = policy(None, make_knowledge(simulator, state)) if len(maps) < SNAPSHOTS else None
        if action is None:
            break
        simulator.step(state, ACTIONS[action])
    rows, cols = free.shape
    return Explored(rows, cols, np.packbits(walls).tobytes(), np.packbits(free).tobytes(), maps)


def _explore_floor(key: list[int]) -> Explored | None:
    """Return maps of a made floor, None if the robot cannot go anywhere in it."""
    rng = np.random.default_rng(key)
    walls, _ = make_office_floor(rng)
    solid = walls.astype(np.uint8)
    cv2.floodFill(solid, None, (0, 0), 2, flags=4)
    outside = (solid == 2).astype(np.uint8)
    seen_facade = rng.random() < _FACADE_SHARE
    try:
        return explore_house(map_house(solid != 0, CELL_M), outside if seen_facade else None, rng)
    except ConfigError:
        return None


def _explore_thick_plan(plan: FloorPlan, key: list[int]) -> Explored | None:
    """Return maps of an enlarged plan with thick walls, None if the robot cannot go anywhere in it."""
    rng = np.random.default_rng(key)
    try:
        occupied = Simulator.of(plan, _ROBOT).world.occupied != 0
        larger = rng.uniform(*_LARGER)
        rows, cols = (np.arange(int(n * larger)) * (1 / larger) for n in occupied.shape)
        enlarged = occupied[rows.astype(int)[:, None], cols.astype(int)[None]]
        thick = np.ones((1 + int(rng.integers(round(_THICKER * larger))),) * 2, np.uint8)
        return explore_house(map_house(cv2.dilate(enlarged.astype(np.uint8), thick) != 0, CELL_M), None, rng)
    except (ConfigError, PlanError):
        return None


def _read_or_explore(
    folder: Path, name: str, number: int, explore: Callable[[int], Explored | None], say: Say
) -> list[Explored]:
    """Return the maps of a number of houses or floors, those of finished shards from their files (R4)."""
    found: list[Explored] = []
    for first in range(0, number, SHARD):
        file = folder / f"{name}-{first:06d}.msgpack"
        if not file.exists():
            made = [explore(i) for i in range(first, min(first + SHARD, number))]
            write_atomically(file, msgspec.msgpack.encode([each for each in made if each is not None]))
            say(f"{name}: {min(first + SHARD, number):,} of {number:,} explored")
        try:
            found += msgspec.msgpack.decode(file.read_bytes(), type=list[Explored])
        except msgspec.MsgspecError as error:
            raise TrainingError(f"{file}: expected maps of a run, found it damaged ({error}); delete it") from None
    return found


# ---------------------------------------------------------------------------------------------------------------------
# Cells, and the network.
# ---------------------------------------------------------------------------------------------------------------------


def draw_walls(one: Explored, rng: np.random.Generator) -> tuple[Bytes, Bytes]:
    """Return the walls and free cells (rows, cols) of a drawing of an explored building, in a style at random (R1)."""
    line = _LINES[int(rng.integers(len(_LINES)))]
    if not line:
        return one.unpack(one.walls), one.unpack(one.free)
    walls, inside = one.unpack(one.walls), one.unpack(one.free)
    padded = np.pad(1 - (walls | inside), 1, constant_values=1)
    cv2.floodFill(padded, None, (0, 0), 2, flags=4)
    outside = (padded[1:-1, 1:-1] == 2).astype(np.uint8)
    near = np.ones((2 * line + 1,) * 2, np.uint8)
    drawn = (cv2.dilate(inside, near) | (cv2.dilate(outside, near) & (1 - outside))) & (1 - inside)
    return cv2.dilate(1 - drawn, np.ones((3, 3), np.uint8)) & drawn, 1 - drawn


@dataclass(frozen=True)
class Samples:
    """Unknown cells of maps: their numbers (n, NUMBERS), whether they are walls and free (n, 2), and weights (n,).

    The numbers are float16, since there are many.
    """

    numbers: Halves
    truth: Floats
    weights: Floats


def draw_cells(one: Explored, rng: np.random.Generator, *, restyled: bool = False) -> list[Samples]:
    """Return at most ``CELLS`` unknown cells of each map of an exploration; a third of the cells are walls (R2)."""
    found = []
    drawn_walls, drawn_free = draw_walls(one, rng) if restyled else (one.unpack(one.walls), one.unpack(one.free))
    truth = np.stack([drawn_walls, drawn_free], axis=-1).reshape(-1, 2)
    for packed in one.maps:
        walls, free = (one.unpack(bits) for bits in packed)
        known = (OBSTACLE * walls + FREE * free).astype(np.uint8)
        unknown = known.ravel() == UNKNOWN
        chosen, weights = [], []
        for is_wall, most in ((True, CELLS // 3), (False, CELLS - CELLS // 3)):
            cells = np.flatnonzero(unknown & ((truth[:, 0] != 0) == is_wall))
            drawn = rng.choice(cells, min(most, len(cells)), replace=False)
            chosen.append(drawn)
            weights.append(np.full(len(drawn), len(cells) / max(len(drawn), 1)))
        cells = np.concatenate(chosen)
        if len(chosen[0]):  # R3
            weight = np.concatenate(weights) / (_SOME_WALLS + weights[0].sum())
            found.append(
                Samples(
                    describe_cells(known, cells).astype(np.float16),
                    truth[cells].astype(np.float32),
                    weight.astype(np.float32),
                )
            )
    return found


def _join(samples: Sequence[Samples]) -> Samples:
    return Samples(
        *(np.concatenate([getattr(each, name) for each in samples]) for name in ("numbers", "truth", "weights"))
    )


class Learner:
    """The layers of a network, their averages, and the state of Adam (Kingma and Ba, 2015)."""

    def __init__(self, mean: Floats, spread: Floats, rng: np.random.Generator) -> None:
        sizes = (NUMBERS, *LAYERS, 2)
        self.scaling = {"mean": mean, "spread": spread}
        self.layers: dict[str, Floats] = {}
        for k, (ins, outs) in enumerate(itertools.pairwise(sizes)):
            self.layers[f"w.{k}"] = (rng.standard_normal((ins, outs)) * math.sqrt(2 / ins)).astype(np.float32)
            self.layers[f"b.{k}"] = np.zeros(outs, np.float32)
        self.layers[f"b.{len(LAYERS)}"][:] = -2.0  # few cells are walls
        self.layers[f"w.{len(LAYERS)}"] *= 0.1
        self.average = {name: value.copy() for name, value in self.layers.items()}
        self.first = {name: np.zeros_like(value) for name, value in self.layers.items()}
        self.second = {name: np.zeros_like(value) for name, value in self.layers.items()}
        self.steps = 0

    def step(self, batch: Samples, rate: float) -> float:
        """Learn from a batch; return the loss of walls before that."""
        loss, slopes = self.find_slopes(batch)
        self.steps += 1
        for name, slope in slopes.items():
            self.first[name] = 0.9 * self.first[name] + 0.1 * slope
            self.second[name] = 0.999 * self.second[name] + 0.001 * slope**2
            step = self.first[name] / (1 - 0.9**self.steps)
            self.layers[name] -= np.float32(rate) * step / (np.sqrt(self.second[name] / (1 - 0.999**self.steps)) + 1e-8)
            kept = min(_AVERAGED, self.steps / (self.steps + 20))
            self.average[name] = np.float32(kept) * self.average[name] + np.float32(1 - kept) * self.layers[name]
        return loss

    def find_slopes(self, batch: Samples) -> tuple[float, dict[str, Floats]]:
        """Return the loss of walls, and the derivatives of the loss (R3) with respect to all layers."""
        inputs = [(batch.numbers.astype(np.float32) - self.scaling["mean"]) / self.scaling["spread"]]
        last = len(LAYERS)
        for k in range(last):
            inputs.append(np.maximum(inputs[-1] @ self.layers[f"w.{k}"] + self.layers[f"b.{k}"], 0.0))
        logits = inputs[-1] @ self.layers[f"w.{last}"] + self.layers[f"b.{last}"]
        weights = batch.weights[:, None] / batch.weights.sum() * np.array([1.0, _FREE_WEIGHT], np.float32)
        scores = np.logaddexp(0.0, logits) - batch.truth * logits
        back = (1.0 / (1.0 + np.exp(-logits)) - batch.truth) * weights
        slopes: dict[str, Floats] = {}
        for k in range(last, -1, -1):
            slopes[f"w.{k}"], slopes[f"b.{k}"] = inputs[k].T @ back, back.sum(axis=0)
            if k:
                back = (back @ self.layers[f"w.{k}"].T) * (inputs[k] > 0)
        return float((scores[:, 0] * weights[:, 0]).sum()), slopes

    def arrays(self) -> dict[str, Floats | Halves]:
        """Return the averages for ``map_prediction.Network``, float16."""
        return {**self.scaling, **{name: value.astype(np.float16) for name, value in self.average.items()}}

    def save(self, file: Path) -> None:
        """Write the state."""
        packed = io.BytesIO()
        parts = {"layers": self.layers, "average": self.average, "first": self.first, "second": self.second}
        named: dict[str, Any] = {
            f"{part}/{name}": value for part, values in parts.items() for name, value in values.items()
        }
        np.savez(packed, **named, steps=np.array(self.steps))
        write_atomically(file, packed.getvalue(), durable=True)

    def load(self, file: Path) -> None:
        """Restore the state; raise TrainingError if the file is damaged."""
        try:
            with np.load(io.BytesIO(file.read_bytes()), allow_pickle=False) as found:
                for part in ("layers", "average", "first", "second"):
                    for name in self.layers:
                        getattr(self, part)[name] = found[f"{part}/{name}"]
                self.steps = int(found["steps"])
        except (OSError, KeyError, ValueError, EOFError, zipfile.BadZipFile, zlib.error) as error:
            raise TrainingError(f"{file}: expected the state of a run, found it damaged ({error}); delete it") from None


def train_predictor(
    plans: Dataset, ids: Sequence[str], config: PredictorConfig, folder: Path, *, resume: bool, say: Say
) -> dict[str, Any]:
    """Train a predictor, write ``predictor.npz``, and return its description.

    Parameters
    ----------
    ids
        The ids of the train list.

    Raises
    ------
    TrainingError
        The folder holds another run, or a run and ``resume`` is False; or a file of the run is damaged.
    ConfigError
        There are too few plans.
    """
    if len(ids) < max(config.houses, config.thick):
        raise ConfigError(
            f"expected {max(config.houses, config.thick)} plans for training, found {len(ids)}; ask for fewer houses"
        )
    run = {**asdict(config), "train": hashlib.sha256(encode_id_list(sorted(ids))).hexdigest()}
    made_by = find_commit()
    begin_run(folder, run, resume=resume)
    listed = sorted(ids, key=lambda name: hashlib.sha256(name.encode()).digest())

    def explore_plan(n: int) -> Explored | None:
        try:
            return explore_house(plans[listed[n]], None, np.random.default_rng([config.seed, 0, n]))
        except (ConfigError, PlanError):  # a robot fits nowhere
            return None

    def explore_thick(n: int) -> Explored | None:
        return _explore_thick_plan(plans[listed[-1 - n]], [config.seed, 5, n])

    houses = _read_or_explore(folder, "houses", config.houses, explore_plan, say)
    thick = _read_or_explore(folder, "thick", config.thick, explore_thick, say)
    floors = _read_or_explore(folder, "floors", config.floors, lambda n: _explore_floor([config.seed, 1, n]), say)
    say(f"{len(houses):,} houses, {len(thick):,} with thick walls, and {len(floors):,} floors explored")
    parts = []
    for kind, explored in enumerate((houses, thick, floors)):
        drawn = [
            draw_cells(one, np.random.default_rng([config.seed, 3, kind, n]), restyled=kind > 0)
            for n, one in enumerate(explored)
        ]
        parts.append(_join([each for cells in drawn for each in cells]))
    some = np.concatenate([part.numbers[:: len(part.weights) // _SCALED + 1] for part in parts]).astype(np.float32)
    both = np.concatenate([some, swap_lines(some)])
    learner = Learner(both.mean(axis=0), both.std(axis=0) + _LEAST_SPREAD, np.random.default_rng([config.seed, 4]))
    if (folder / _STATE).exists():
        learner.load(folder / _STATE)
    losses: list[float] = []
    while learner.steps < config.steps:
        falling = 0.5 * (1 + math.cos(math.pi * learner.steps / config.steps)) + _LAST_RATE
        batch = _draw_batch(parts, np.random.default_rng([config.seed, 2, learner.steps]))
        losses.append(learner.step(batch, _RATE * falling))
        if learner.steps % SAVED_STEPS == 0 or learner.steps == config.steps:
            learner.save(folder / _STATE)
            say(f"{learner.steps:,} of {config.steps:,} steps: loss of walls {np.mean(losses):.4f}")
            losses = []
    about = {**run, "commit": made_by, "versions": find_versions()}
    write_network(folder / WEIGHTS, learner.arrays(), about)
    return about


def _draw_batch(parts: Sequence[Samples], rng: np.random.Generator) -> Samples:
    """Return cells of all kinds of maps; for half of the cells, row and column are exchanged (R2)."""
    found = []
    for part, share in zip(parts, _SHARES_OF_KINDS, strict=True):
        size = round(BATCH * share / 2)
        chosen, other = rng.integers(len(part.weights), size=(2, size))
        for at, numbers in ((chosen, part.numbers[chosen]), (other, swap_lines(part.numbers[other]))):
            found.append(Samples(numbers, part.truth[at], part.weights[at]))
    return _join(found)
