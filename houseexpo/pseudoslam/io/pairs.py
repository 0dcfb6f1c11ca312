"""Let a robot wander in a plan, and yield pairs of its partial map and the complete one, to learn to predict maps.

A pair is a square window around the robot on the map that it has built so far and on the complete map. The robot is at
the centre of both, with the same heading. Up is the plan's y according to odometry.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple, TypeAlias

import cv2
import numpy as np
import numpy.typing as npt

from houseexpo.configuration import check_above_zero, check_whole_number
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import GridFrame
from houseexpo.grids.raster import NOTHING, room_ids
from houseexpo.plan.room_labels import LABELS, UNLABELLED
from houseexpo.pseudoslam.config import NoiseConfig, SimulatorConfig
from houseexpo.pseudoslam.kernels.collision import STATIC
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE, UNKNOWN, draw_coarse_view, draw_nearest_cells
from houseexpo.pseudoslam.simulator import Action, Simulator
from houseexpo.pseudoslam.state import State
from houseexpo.pseudoslam.worlds.world import World

ROOM_LABELS: Final = (UNLABELLED, *LABELS)
"""The meaning of the numbers of ``labels``, from 1 on; 0 means no room."""
MAX_ROOMS: Final = 255
USUAL_NOISE: Final = NoiseConfig(
    laser_m=0.02, odometry_way=0.02, odometry_turn=0.02, odometry_deg_per_m=0.3, drop_out=0.01
)
"""Typical noise: ranges with errors of 2 cm, one lost beam in a hundred, and odometry with a drift of 2%."""
_NEIGHBOURS = np.ones((3, 3), np.uint8)
_NO_ROOMS = np.zeros((1, 1), np.uint8)
_TURN_CHANCE, _MAX_TURNS = 0.1, 12
Bytes: TypeAlias = npt.NDArray[np.uint8]


@dataclass(frozen=True)
class PairConfig:
    """The configuration of pairs: their number, their window, and the simulation.

    Parameters
    ----------
    each
        Number of pairs of an episode; the first is after a full turn at the start.
    every
        Number of steps between pairs.
    size_m, pixels
        Side of the window, in metres and in pixels.
    rooms
        Whether to include rooms; for plans without rooms, they are found (``FloorPlan.divided``).
    simulator
        Resolution, laser, noise and obstacles.
    """

    each: int = 10
    every: int = 8
    size_m: float = 16.0
    pixels: int = 128
    rooms: bool = True
    simulator: SimulatorConfig = field(default_factory=SimulatorConfig)

    def __post_init__(self) -> None:
        check_whole_number(self.each, "each", at_least=1, at_most=100_000)
        check_whole_number(self.every, "every", at_least=1, at_most=100_000)
        check_whole_number(self.pixels, "pixels", at_least=2, at_most=4096)
        check_above_zero(self, "pairs", "size_m", at_most=1000.0)

    def arrays(self) -> dict[str, tuple[str, tuple[int, ...]]]:
        """Return the type and shape of each array of one pair (see ``Pair``)."""
        square = ("uint8", (self.pixels, self.pixels))
        return {
            **dict.fromkeys(("partial", "complete", *(("rooms", "labels") if self.rooms else ())), square),
            **dict.fromkeys(("pose", "believed"), ("float32", (3,))),
            **dict.fromkeys(("coverage", "steps"), ("float32", ())),
        }


class Pair(NamedTuple):
    """One pair of maps (pixels, pixels) uint8, with row 0 at the highest y and the robot at the centre."""

    partial: Bytes
    """The partial map: 255 if one of the pixel's cells is an obstacle, else 127 if one is free, else 0 (unknown)."""
    complete: Bytes
    """The complete map, with the same values; 0 for places that cannot be seen: outside, and inside walls."""
    rooms: Bytes
    """The number of the room, from 1 on; 0 for no room."""
    labels: Bytes
    """The label of the room, a number of ``ROOM_LABELS`` from 1 on."""
    pose: npt.NDArray[np.float32]
    """The pose (3,): x, y in the plan's metres, heading in radians, counter-clockwise from x."""
    believed: npt.NDArray[np.float32]
    """The pose by odometry (3,), which is ``pose`` without noise."""
    coverage: np.float32
    """The known share of the observable cells, 0 to 1."""
    steps: np.float32
    """Number of steps since the start."""


class CompleteMap(NamedTuple):
    """A house as cells (rows, cols): the complete map, the numbers of rooms, and those of their labels."""

    complete: Bytes
    rooms: Bytes
    labels: Bytes


def simulate_pairs(plan: FloorPlan, world: World, config: PairConfig, rng: np.random.Generator) -> Iterator[Pair]:
    """Yield the pairs of an episode in which the robot wanders from a random start.

    Raises
    ------
    ConfigError
        The configuration is not possible in this house, see ``Simulator.start``.
    """
    simulator = Simulator(world, config.simulator)
    state = simulator.start(rng)
    truth = CompleteMap(_complete(state), *(_rooms(plan, world.frame) if config.rooms else (_NO_ROOMS, _NO_ROOMS)))
    walk = _wander(state, rng)
    for number in range(config.each):
        for _ in range(config.every if number else 0):
            simulator.step(state, next(walk))
        yield _pair(simulator, state, truth, config)


def _wander(state: State, rng: np.random.Generator) -> Iterator[Action]:
    """Yield actions: go straight on, and turn to one side when blocked and from time to time."""
    while True:
        yield "forward"
        if state.blocked or rng.random() < _TURN_CHANCE:
            side: Action = "left" if rng.random() < 0.5 else "right"
            for _ in range(int(rng.integers(1, _MAX_TURNS))):
                yield side


def _complete(state: State) -> Bytes:
    """Return the complete map: free cells, and obstacles beside them."""
    free = ((state.occupied & STATIC) == 0).view(np.uint8)
    near: Any = cv2.dilate(free, _NEIGHBOURS)
    return np.where(free != 0, FREE, np.where(near != 0, OBSTACLE, UNKNOWN)).astype(np.uint8)


def _rooms(plan: FloorPlan, frame: GridFrame) -> tuple[Bytes, Bytes]:
    """Return the numbers of the room and of its label in each cell; rooms beyond ``MAX_ROOMS`` have no number."""
    divided = plan.divided
    ids = room_ids(divided, frame)
    numbers, labels = np.zeros(
        (2, max((room.id for room in divided.rooms), default=0) + 2), np.uint8
    )  # the last: no room
    for number, room in enumerate(divided.rooms[:MAX_ROOMS], start=1):
        numbers[room.id], labels[room.id] = number, ROOM_LABELS.index(room.label) + 1
    ids[ids == NOTHING] = len(numbers) - 1
    return numbers[ids], labels[ids]


def _pair(simulator: Simulator, state: State, truth: CompleteMap, config: PairConfig) -> Pair:
    """Draw the windows: the robot's map around its pose by odometry, and the truth around its true pose."""
    pixel = config.size_m * config.simulator.pixels_per_metre / config.pixels
    x, y, heading = state.pose_px.tolist()
    seen_x, seen_y, seen_heading = state.believed_px.tolist()
    up = math.pi / 2 + heading - seen_heading
    drawn = np.empty((4, config.pixels, config.pixels), np.uint8)
    draw_coarse_view(state.known, seen_x, seen_y, 0.0, 1.0, pixel, drawn[0])
    cos, sin = (0.0, 1.0) if heading == seen_heading else (math.cos(up), math.sin(up))
    draw_coarse_view(truth.complete, x, y, cos, sin, pixel, drawn[1])
    for grid, out in zip((truth.rooms, truth.labels), drawn[2:], strict=True):
        draw_nearest_cells(grid, x, y, cos, sin, pixel, out)
    pose, believed = np.array([simulator.pose(state), simulator.believed_pose(state)], np.float32)
    partial, complete, rooms, labels = drawn
    coverage, steps = np.float32(simulator.coverage(state)), np.float32(state.counts.steps)
    return Pair(partial, complete, rooms, labels, pose, believed, coverage, steps)


def stack_pairs(pairs: list[Pair], config: PairConfig) -> dict[str, npt.NDArray[Any]]:
    """Return the arrays of pairs, stacked along a new first axis; (0, ...) without pairs."""
    names = [name for name in Pair._fields if name in config.arrays()]
    return {
        name: np.array([getattr(pair, name) for pair in pairs], config.arrays()[name][0]).reshape(
            len(pairs), *config.arrays()[name][1]
        )
        for name in names
    }
