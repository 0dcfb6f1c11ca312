"""What single and vector environments share: spaces, the meaning of actions, what is observed, and the houses."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, TypeAlias

import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.envs.options import Layout
from houseexpo.pseudoslam.envs.pictures import Pictures, channels_of, side_of
from houseexpo.pseudoslam.envs.plan_choice import PlanChoice
from houseexpo.pseudoslam.envs.planners import PlannerSpec
from houseexpo.pseudoslam.envs.reset_arguments import Pose
from houseexpo.pseudoslam.kernels.episode import Episode, StepParams
from houseexpo.pseudoslam.kernels.motion.actions import look_up
from houseexpo.pseudoslam.kernels.types import Scratch
from houseexpo.pseudoslam.metrics import Bools, EpisodeConstants, Metrics
from houseexpo.pseudoslam.simulator import ACTIONS, motions
from houseexpo.pseudoslam.state import State
from houseexpo.pseudoslam.step_params import scratch_of, step_params_of
from houseexpo.pseudoslam.tasks import Task
from houseexpo.pseudoslam.worlds.reset import initial_state
from houseexpo.pseudoslam.worlds.world import World

Actions = Literal["discrete", "continuous", "frontier", "waypoint", "neighbour"]
Kind = Literal["map", "dict", "graph", "scales"]
MAPS = ("map", "global_map")
"""What ``EnvSpec.observe`` returns as views."""
_NO_VIEW_PX = 2  # the smallest: nobody looks at it
_FAR_M = 10_000.0  # nothing is further away: a grid has at most 1e8 cells
Observation: TypeAlias = npt.NDArray[Any] | dict[str, npt.NDArray[Any]]


@dataclass(frozen=True)
class EnvSpec:
    """What an environment takes and gives: how a task is seen and acted on.

    Parameters
    ----------
    actions
        "discrete": 0 forward, 1 left, 2 right. "continuous": (linear, angular) in [-1, 1], as shares of a step's way
        (backward where negative) and turn (left where positive); the turn comes first. "frontier",
        "waypoint" and "neighbour": travels along the robot's own map, see ``planners.PlannerSpec``.
    kind
        "map": the map round the robot, (1, side, side) uint8, heading up: 0 unknown, 127 free, 255 obstacle. "dict":
        that as "map", "global_map" (1, cells, cells) uint8, the whole map round the start, "pose" (3,) float32, where
        odometry has the robot since then (m, m, rad), and "ranges" (beams,) float32, metres, from the fan's right.
        "graph": that as "map", and a graph of what is known, see ``planners.PlannerSpec``.
        Where there is a goal, each is a dict that has "goal", (2,) float32, metres ahead and to the left.
        "scales": one picture (4, side, side) uint8: the map near the robot and, ``observation.far_size_m`` wide,
        farther round it, both heading up; the whole map round the start, the plan's y up, and on a picture of its own
        where odometry has the robot on that, 255, with a disc of 127 before it. Where there is a goal, a fifth picture
        has it, at the rim where it lies outside.
    layout
        ``options.EnvOptions``.
    """

    task: Task
    config: SimulatorConfig
    choice: PlanChoice
    actions: Actions
    kind: Kind
    layout: Layout = "CHW"
    planner: PlannerSpec | None = None

    @property
    def complete(self) -> bool:
        """Whether the overview and the ranges are wanted."""
        return self.kind == "dict"

    @property
    def has_pictures(self) -> bool:
        """Whether what is shown is not the plain view (``pictures``)."""
        return self.kind == "scales" or self.config.observation.pixels is not None

    def pictures(self, number: int) -> Pictures | None:
        """Return what draws the maps of so many environments; None where the step does, in their plain view."""
        return Pictures(number, self.config, several=self.kind == "scales") if self.has_pictures else None

    def params(self) -> StepParams:
        """Return what is the same in all steps."""
        return step_params_of(self.config, self.task.clearance_m, self.planner.rules() if self.planner else None)

    def scratch(self) -> Scratch:
        """Return memory for the scans of one thread."""
        return scratch_of(self.config)

    def action_space(self) -> spaces.Space[Any]:
        """Return the space of one environment's actions."""
        if self.planner:
            return self.planner.action_space()
        if self.actions == "discrete":
            return spaces.Discrete(len(ACTIONS))
        return spaces.Box(-1.0, 1.0, (2,), np.float32)

    def observation_space(self) -> spaces.Space[Any]:
        """Return the space of one environment's observations."""
        config, several = self.config, self.kind == "scales"
        parts: dict[str, spaces.Space[Any]] = {
            "map": self._image_space(channels_of(config, several=several), side_of(config))
        }
        if self.complete:
            cells, reach = config.observation.global_cells, np.float32(config.laser.range_m)
            beams = len(self.params().sensor.fan_cos)
            parts["global_map"] = self._image_space(1, cells)
            parts["pose"] = spaces.Box(-_FAR_M, _FAR_M, (3,), np.float32)
            parts["ranges"] = spaces.Box(0.0, float(reach), (beams,), np.float32)
        if config.goal and not several:
            parts["goal"] = spaces.Box(-_FAR_M, _FAR_M, (2,), np.float32)
        if self.planner:
            parts |= self.planner.spaces()
        return spaces.Dict(parts) if len(parts) > 1 else parts["map"]

    def _image_space(self, channels: int, side: int) -> spaces.Box:
        shape = (channels, side, side) if self.layout == "CHW" else (side, side, channels)
        return spaces.Box(0, 255, shape, np.uint8)

    def motions(self, actions: object, *number: int) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_]]:
        """Return the turns and ways (N, 2), radians and pixels, that actions mean, and which go ahead.

        ``actions`` are so many, (N,) or (N, 2); without a number they are one, () or (2,). ConfigError where there is
        no such action.
        """
        discrete = self.planner.numbers > 0 if self.planner else self.actions == "discrete"
        shape = number if discrete else (*number, 2)
        try:
            values = np.asarray(actions)
        except ValueError as error:
            raise ConfigError(f"action: expected {_shaped(shape)}, found {actions!r}") from error
        if values.shape != shape:
            raise ConfigError(f"action: expected {_shaped(shape)}, found {_shaped(values.shape)}")
        if self.planner:
            return self.planner.meant(values), np.zeros(math.prod(number), bool)
        return self._looked_up(values) if discrete else self._scaled(values)

    def _looked_up(self, values: npt.NDArray[Any]) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_]]:
        """Return what ``motions`` does for numbered actions."""
        is_whole = values.dtype.kind in "iu"
        flat = values.ravel().astype(np.int64, copy=False) if is_whole else np.full(values.size, -1)
        found, ahead = np.empty((len(flat), 2)), np.empty(len(flat), bool)
        strange = look_up(flat, self._table, found, ahead)
        if strange >= 0:
            raise ConfigError(f"action: expected 0 (forward), 1 (left) or 2 (right), found {values.item(strange)!r}")
        return found, ahead

    def _scaled(self, values: npt.NDArray[Any]) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_]]:
        """Return what ``motions`` does for continuous actions."""
        strange = ~((values >= -1) & (values <= 1)) if values.dtype.kind in "iuf" else np.ones(values.shape, bool)
        if np.count_nonzero(strange):  # a fraction of what strange.any() takes
            wanted = "(linear, angular), numbers from -1 to 1"
            raise ConfigError(f"action: expected {wanted}, found {values[strange].item(0)!r}")
        shares = values.reshape(-1, 2).astype(np.float64)
        return np.ascontiguousarray(shares[:, ::-1] * self._full), shares[:, 0] > 0

    @cached_property
    def _table(self) -> npt.NDArray[np.float64]:
        """What the discrete actions mean, as ``motions`` returns it."""
        return np.array([motions(self.config)[action] for action in ACTIONS]) * (1.0, self.config.pixels_per_metre)

    @cached_property
    def _full(self) -> npt.NDArray[np.float64]:
        """A step's whole turn and whole way, as ``motions`` returns them."""
        robot = self.config.robot
        return np.array([math.radians(robot.turn_deg), robot.step_m * self.config.pixels_per_metre])

    def observe(self, episode: Episode, metrics: Metrics, pictures: Pictures | None) -> Observation:
        """Return the observations of a pool of episodes, whose ``pictures`` are drawn; ``MAPS`` are views."""
        shown = pictures.shown if pictures else episode.shown[:, None]
        parts: dict[str, npt.NDArray[Any]] = {"map": self._laid_out(shown)}
        if self.complete:
            parts["global_map"] = self._laid_out(episode.overview[:, None])
            parts["pose"] = metrics.since_start().astype(np.float32)
            parts["ranges"] = (episode.ranges * metrics.cell_m).astype(np.float32)
        if self.config.goal and self.kind != "scales":
            parts["goal"] = metrics.goal_ahead().astype(np.float32)
        if self.planner:
            parts |= self.planner.observe(episode, metrics)
        return parts if len(parts) > 1 else parts["map"]

    def _laid_out(self, images: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
        """Return (N, channels, rows, cols) as the layout has it."""
        return images if self.layout == "CHW" else np.moveaxis(images, 1, -1)

    def initial_state(
        self,
        world: World,
        params: StepParams,
        scratch: Scratch,
        rng: np.random.Generator,
        *,
        own: bool = True,
        pose_m: Pose | None = None,
    ) -> State:
        """Return the start of an episode, see ``worlds.reset``; its first look round is the next step's to take."""
        state = initial_state(
            world, self.config, params, scratch, rng, complete=self.complete, own=own, pose_m=pose_m,
            view_px=_NO_VIEW_PX if self.has_pictures else None,
        )  # fmt: skip
        if self.planner:
            state.episode = state.episode._replace(
                plans=self.planner.plans(state, world, self.task), graph=self.planner.graph()
            )
        return state

    def report(self, episode: Episode, metrics: Metrics, success: Bools) -> dict[str, npt.NDArray[Any]]:
        """Return what ``info`` says of a pool of episodes: arrays of the caller's own."""
        found = self.task.report(metrics, success)
        return {**found, **self.planner.report(episode, metrics.cell_m)} if self.planner else found

    def masks(self, episode: Episode) -> npt.NDArray[np.bool_]:
        """Return (N, K) which of a planner's actions are allowed; ConfigError where all always are."""
        if not self.planner or not self.planner.numbers:
            wanted = 'actions="frontier" or "neighbour"'
            raise ConfigError(f"action_masks: expected {wanted}, found {self.actions!r}")
        return self.planner.masks(episode)


def _shaped(shape: tuple[int, ...]) -> str:
    return f"an array of shape {shape}" if shape else "a single number"


def new_constants(number: int) -> EpisodeConstants:
    """Return the facts of so many episodes that have not begun."""
    rows = np.full((number, 10), np.nan)
    rows[:, 6], rows[:, 7] = 1.0, 0.0
    return EpisodeConstants.of(rows)


def constants_of(state: State, world: World) -> tuple[float, ...]:
    """Return the facts of an episode that begins: a row of ``EpisodeConstants.rows``."""
    corner, goal = (*world.corner_m, 0.0), state.goal_m or (math.nan, math.nan)
    return *corner, *corner, max(state.observable_cells, 1), state.shortest_path_m, *goal
