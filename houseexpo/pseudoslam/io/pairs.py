"""What a robot knows of a house beside the whole of it: pairs of maps, to learn from what is seen what is not.

A pair is a square window round the robot: the map that it has drawn so far, and what a map would be that has seen all,
laid so that the robot stands in the middle of both and looks the same way. Up is the plan's y, as odometry has it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple, TypeAlias

import cv2
import numpy as np
import numpy.typing as npt

from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import GridFrame
from houseexpo.grids.raster import NOTHING, room_mask
from houseexpo.plan.categories import LABELS, UNLABELLED
from houseexpo.pseudoslam.config import NoiseConfig, SimulatorConfig
from houseexpo.pseudoslam.config.checks import above_zero, whole
from houseexpo.pseudoslam.kernels.mapping.coarse import draw_coarse, draw_nearest
from houseexpo.pseudoslam.kernels.mapping.merge import FREE, OBSTACLE, UNKNOWN
from houseexpo.pseudoslam.kernels.motion.bodies import STATIC
from houseexpo.pseudoslam.simulator import Action, Simulator
from houseexpo.pseudoslam.state import State
from houseexpo.pseudoslam.worlds.world import World

ROOM_LABELS: Final = (UNLABELLED, *LABELS)
"""What the numbers of ``labels`` mean, from 1 on; 0 is no room."""
MAX_ROOMS: Final = 255
USUAL_NOISE: Final = NoiseConfig(
    laser_m=0.02, odometry_way=0.02, odometry_turn=0.02, odometry_deg_per_m=0.3, drop_out=0.01
)
"""A laser that errs by 2 cm and loses a beam in a hundred, and odometry that drifts by 2%, as usual ones do."""
_NEIGHBOURS = np.ones((3, 3), np.uint8)
_NO_ROOMS = np.zeros((1, 1), np.uint8)
_TURN_CHANCE, _MAX_TURNS = 0.1, 12
Bytes: TypeAlias = npt.NDArray[np.uint8]


@dataclass(frozen=True)
class PairConfig:
    """What pairs there are of an episode, and what they show.

    Parameters
    ----------
    each
        Pairs of an episode: the first after a look round at the start.
    every
        Steps from one to the next.
    size_m, pixels
        Side of the window, and how many pixels that is.
    rooms
        Whether rooms are wanted; of plans that record none they are found (``FloorPlan.divided``).
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
        whole(self.each, "each", at_least=1, at_most=100_000)
        whole(self.every, "every", at_least=1, at_most=100_000)
        whole(self.pixels, "pixels", at_least=2, at_most=4096)
        above_zero(self, "pairs", "size_m", at_most=1000.0)

    def arrays(self) -> dict[str, tuple[str, tuple[int, ...]]]:
        """Return type and shape of each array of one pair, see ``Pair``."""
        square = ("uint8", (self.pixels, self.pixels))
        return {
            **dict.fromkeys(("partial", "complete", *(("rooms", "labels") if self.rooms else ())), square),
            **dict.fromkeys(("pose", "believed"), ("float32", (3,))),
            **dict.fromkeys(("coverage", "steps"), ("float32", ())),
        }


class Pair(NamedTuple):
    """One pair; maps are (pixels, pixels) uint8, row 0 at the highest y, the robot in the middle."""

    partial: Bytes
    """0 unknown, 127 free, 255 obstacle: where one of a pixel's cells is one, else free where one is."""
    complete: Bytes
    """The same of a map that has seen all; 0 where nobody can look: outside, and within walls."""
    rooms: Bytes
    """The number of the room, from 1 on; 0 where there is none."""
    labels: Bytes
    """Its label, a number of ``ROOM_LABELS`` from 1 on."""
    pose: npt.NDArray[np.float32]
    """(3,): x, y in the plan's metres, heading in radians, counter-clockwise from x."""
    believed: npt.NDArray[np.float32]
    """(3,): where odometry has the robot; ``pose`` where it does not err."""
    coverage: np.float32
    """The share of what can be seen that is known."""
    steps: np.float32
    """Steps since the start."""


class Truth(NamedTuple):
    """A house as cells (rows, cols): the map of one who has seen all, the rooms' numbers and those of their labels."""

    complete: Bytes
    rooms: Bytes
    labels: Bytes


def pairs_of(plan: FloorPlan, world: World, config: PairConfig, rng: np.random.Generator) -> Iterator[Pair]:
    """Yield the pairs of an episode that begins somewhere in a house; the robot wanders.

    Raises
    ------
    ConfigError
        Where the house cannot give what the simulator is to start with, see ``Simulator.start``.
    """
    simulator = Simulator(world, config.simulator)
    state = simulator.start(rng)
    truth = Truth(_complete(state), *(_rooms(plan, world.frame) if config.rooms else (_NO_ROOMS, _NO_ROOMS)))
    walk = _wander(state, rng)
    for number in range(config.each):
        for _ in range(config.every if number else 0):
            simulator.step(state, next(walk))
        yield _pair(simulator, state, truth, config)


def _wander(state: State, rng: np.random.Generator) -> Iterator[Action]:
    """Go on; turn to one side where the way is blocked, and now and then."""
    while True:
        yield "forward"
        if state.blocked or rng.random() < _TURN_CHANCE:
            side: Action = "left" if rng.random() < 0.5 else "right"
            for _ in range(int(rng.integers(1, _MAX_TURNS))):
                yield side


def _complete(state: State) -> Bytes:
    """Return the map of one who has seen all: free cells, and obstacles as far as they are beside one."""
    free = ((state.occupied & STATIC) == 0).view(np.uint8)
    near: Any = cv2.dilate(free, _NEIGHBOURS)
    return np.where(free != 0, FREE, np.where(near != 0, OBSTACLE, UNKNOWN)).astype(np.uint8)


def _rooms(plan: FloorPlan, frame: GridFrame) -> tuple[Bytes, Bytes]:
    """Return the number of the room of each cell, and of its label; rooms beyond ``MAX_ROOMS`` have no number."""
    divided = plan.divided
    ids = room_mask(divided, frame)
    numbers, labels = np.zeros(
        (2, max((room.id for room in divided.rooms), default=0) + 2), np.uint8
    )  # the last: no room
    for number, room in enumerate(divided.rooms[:MAX_ROOMS], start=1):
        numbers[room.id], labels[room.id] = number, ROOM_LABELS.index(room.label) + 1
    ids[ids == NOTHING] = len(numbers) - 1
    return numbers[ids], labels[ids]


def _pair(simulator: Simulator, state: State, truth: Truth, config: PairConfig) -> Pair:
    """Draw the windows: the robot's map round where it believes it is, the truth round where it is."""
    pixel = config.size_m * config.simulator.pixels_per_metre / config.pixels
    x, y, heading = state.pose_px.tolist()
    seen_x, seen_y, seen_heading = state.believed_px.tolist()
    up = math.pi / 2 + heading - seen_heading
    drawn = np.empty((4, config.pixels, config.pixels), np.uint8)
    draw_coarse(state.known, seen_x, seen_y, 0.0, 1.0, pixel, drawn[0])
    cos, sin = (0.0, 1.0) if heading == seen_heading else (math.cos(up), math.sin(up))
    draw_coarse(truth.complete, x, y, cos, sin, pixel, drawn[1])
    for grid, out in zip((truth.rooms, truth.labels), drawn[2:], strict=True):
        draw_nearest(grid, x, y, cos, sin, pixel, out)
    pose, believed = np.array([simulator.pose(state), simulator.believed_pose(state)], np.float32)
    partial, complete, rooms, labels = drawn
    coverage, steps = np.float32(simulator.coverage(state)), np.float32(state.counts.steps)
    return Pair(partial, complete, rooms, labels, pose, believed, coverage, steps)


def stacked(pairs: list[Pair], config: PairConfig) -> dict[str, npt.NDArray[Any]]:
    """Return the arrays of pairs, each with one axis more in front; (0, ...) of none."""
    names = [name for name in Pair._fields if name in config.arrays()]
    return {
        name: np.array([getattr(pair, name) for pair in pairs], config.arrays()[name][0]).reshape(
            len(pairs), *config.arrays()[name][1]
        )
        for name in names
    }
