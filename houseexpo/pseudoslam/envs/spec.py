"""Hold what single and vector environments share: arguments, spaces, actions, observations, and episodes' starts."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from inspect import signature
from typing import Any, Literal, TypeAlias, TypedDict, get_args

import numpy as np
import numpy.typing as npt
from gymnasium import spaces
from gymnasium.vector import AutoresetMode

from houseexpo.configuration import check_one_of, check_whole_number
from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.config.robot import DRIVES, Motion
from houseexpo.pseudoslam.config.simulator import PRESETS, PlanningConfig, with_preset
from houseexpo.pseudoslam.envs.pictures import (
    Pictures,
    block_sides_px,
    count_channels,
    near_pixel_width,
    picture_side_px,
)
from houseexpo.pseudoslam.envs.planner_actions import PlannerSpec, make_planner_spec
from houseexpo.pseudoslam.envs.reset_options import Order, PlanChooser, Pose
from houseexpo.pseudoslam.kernels.collision import find_free_steps
from houseexpo.pseudoslam.kernels.episode import Episode, StepParams
from houseexpo.pseudoslam.kernels.map_pictures import draw_goal_views
from houseexpo.pseudoslam.kernels.step import look_up_motions
from houseexpo.pseudoslam.kernels.types import Counts, Scratch
from houseexpo.pseudoslam.metrics import Bools, EpisodeConstants, Metrics
from houseexpo.pseudoslam.simulator import ACTIONS, action_motions
from houseexpo.pseudoslam.state import State
from houseexpo.pseudoslam.step_kernels import make_scratch, make_step_params
from houseexpo.pseudoslam.tasks import Task
from houseexpo.pseudoslam.worlds.cache import WorldCache
from houseexpo.pseudoslam.worlds.maps import Plans, common_resolution, open_houses
from houseexpo.pseudoslam.worlds.reset import make_initial_state
from houseexpo.pseudoslam.worlds.world import World

Actions = Literal["discrete", "continuous", "frontier"]
Kind = Literal["map", "dict", "scales"]
Layout = Literal["CHW", "HWC"]


class EnvOptions(TypedDict, total=False):
    """Arguments of single and vector environments, and of ``gymnasium.make`` and ``make_vec``."""

    layout: Layout
    """Position of the channels of maps: "CHW", first as in torch, or "HWC", last as in pictures (for several channels,
    as a view of the former). Wrappers for pictures, such as gymnasium's ``ResizeObservation``, expect "HWC"."""
    plan_ids: Iterable[str] | None
    """Ids of the plans for episodes; None for all plans of the data set."""
    plan_order: Order
    """"random", or "in_turn": each plan once, in the order of the list, then again from the first, as after a seed."""
    motion: Motion | None
    """How the robot moves: "discrete", by exact turns and distances, or with a drive, "differential" or "ackermann",
    with the default values of ``config.robot``; None for what ``config.robot.drive`` says."""
    max_episode_steps: int | None
    """Number of steps of the robot after which an episode is truncated, instead of ``config.max_steps``. It may also be
    an argument of ``gymnasium.make`` or of a registration (``steps_asked_of_make``)."""
    action_mask: bool
    """Whether observations have "action_mask" (3,) int8 with "discrete" actions: 1 for motions on which the robot meets
    no obstacle of its own map. Actions of planners with a number always come with a mask."""
    float_maps: bool
    """Whether maps are float32 from 0 to 1 instead of uint8 from 0 to 255, for libraries that do not convert them."""
    text_info: bool
    """Whether ``info`` has its texts: "plan_id", and "outcome" of planners' actions. Some libraries take only numbers.
    True by default."""


class AllEnvOptions(EnvOptions, total=False):
    """All arguments of the environments of a task, other than the data set, the configuration and the task's own."""

    actions: Actions | None
    observation: Kind
    planning: PlanningConfig | None
    render_mode: str | None
    num_envs: int
    """This argument and the following ones are only for vector environments, see ``vector.PseudoSlamVectorEnv``."""
    autoreset_mode: AutoresetMode | str
    copy: bool
    threads: int | None


class UnknownArgumentError(ConfigError, TypeError):
    """There is no such argument; a TypeError for programs that try arguments and do without those that are refused."""


def check_options(kind: type, given: Iterable[str], more: Iterable[str] = ()) -> None:
    """Raise UnknownArgumentError if an environment of this class does not have one of the given arguments.

    ``more`` are other arguments that it takes, to be named in the error.
    """
    known = EnvOptions.__annotations__
    for name in given:
        if name not in known:
            own = (each for base in kind.__mro__ if "__init__" in vars(base) for each in signature(base).parameters)
            takes = ", ".join(sorted({*known, *own, *more} - {"self", "task", "args", "kwargs", "more", "options"}))
            advice = "; the id of an environment says which task it is" if name == "task" else ""
            raise UnknownArgumentError(
                f"{kind.__name__}() got an unexpected keyword argument {name!r}{advice}; it takes {takes}"
            )


MAPS = ("map", "global_map")
"""The parts of observations that ``EnvSpec.observe`` returns as views."""
_NO_VIEW_PX = 2  # the smallest, since it is not shown
_FAR_M = 10_000.0  # larger than any distance, since a grid has at most 1e8 cells
Observation: TypeAlias = npt.NDArray[Any] | dict[str, npt.NDArray[Any]]


@dataclass(frozen=True)
class EnvSpec:
    """The specification of an environment: its actions and its observations.

    Parameters
    ----------
    actions
        "discrete": 0 forward, 1 left, 2 right. "continuous": (linear, angular) in [-1, 1], as shares of the distance of
        a step (negative for backward) and of its turn (positive for left); the robot turns first. With a drive, they
        are shares of its largest speed, and of its largest speed of turning or steering angle. "frontier":
        travels on the robot's own map, see ``planner_actions.PlannerSpec``.
    kind
        "map": the map around the robot, (1, side, side) uint8, with its heading up: 0 unknown, 127 free, 255 obstacle.
        "dict": "map" as above; "global_map" (1, cells, cells) uint8, the whole map around the start; "pose" (3,)
        float32, the pose by odometry relative to the start (m, m, rad); and "ranges" (beams,) float32, metres, from the
        right edge of the fan.
        With a goal, each of these is a dict that also has "goal", (2,) float32, metres ahead and to the left; or, if
        the goal is a kind of room or furniture, "goal_number", its index in ``config.goal.names``, and "goal_map", a
        picture like the (nearest) map, 255 for known cells in which the goal is reached. With a drive, each also has
        "velocity" (2,) float32: m/s, and rad/s or the steering angle in radians.
        "scales": pictures (4, side, side) uint8: the map near the robot and the one ``observation.far_size_m`` wide
        around it, both with its heading up; the whole map around the start, with the plan's y up; and the mark of the
        robot's pose by odometry on the latter, 255, with a disc of 127 in front of it. With a goal, a fifth picture has
        its mark, at the border if it lies outside.
    layout
        See ``EnvOptions``, also for the last three.
    """

    task: Task
    config: SimulatorConfig
    choice: PlanChooser
    actions: Actions
    kind: Kind
    layout: Layout = "CHW"
    planner: PlannerSpec | None = None
    action_mask: bool = False
    float_maps: bool = False
    text_info: bool = True

    @property
    def complete(self) -> bool:
        """Whether the observation has the overview and the ranges."""
        return self.kind == "dict"

    @property
    def has_pictures(self) -> bool:
        """Whether the observation has other maps than the plain view (``pictures``)."""
        return self.kind == "scales" or self.config.observation.pixels is not None

    @property
    def keeps_house(self) -> bool:
        """Whether all episodes in a house have the same cells, because nothing is placed there and nothing moves."""
        placed, config = self.config.obstacles, self.config
        return not (placed.placed or placed.random or config.trajectories or config.people.number)

    @cached_property
    def _blocks_px(self) -> tuple[int, int, int]:
        if not self.has_pictures:
            return 0, 0, 0
        return block_sides_px(self.config, several=self.kind == "scales")

    def pictures(self, number: int) -> Pictures | None:
        """Return the ``Pictures`` for a number of environments, None if the step draws their plain view."""
        return Pictures(number, self.config, several=self.kind == "scales") if self.has_pictures else None

    def params(self) -> StepParams:
        """Return the parameters that are the same in all steps."""
        return make_step_params(self.config, self.task.clearance_m, self.planner.rules() if self.planner else None)

    def scratch(self) -> Scratch:
        """Return working memory for the scans of one thread."""
        return make_scratch(self.config)

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
            "map": self.image_space(count_channels(config, several=several), picture_side_px(config))
        }
        if self.complete:
            cells, reach = config.observation.global_cells, np.float32(config.laser.range_m)
            beams = len(self.params().sensor.fan_cos)
            parts["global_map"] = self.image_space(1, cells)
            parts["pose"] = spaces.Box(-_FAR_M, _FAR_M, (3,), np.float32)
            parts["ranges"] = spaces.Box(0.0, float(reach), (beams,), np.float32)
        if config.goal_place and not several:
            parts["goal"] = spaces.Box(-_FAR_M, _FAR_M, (2,), np.float32)
        if config.goal_region:
            parts["goal_number"] = spaces.Discrete(len(config.goal_region.names))
            parts["goal_map"] = self.image_space(1, picture_side_px(config))
        if (drive := config.robot.drive) and not several:
            most = np.array([drive.max_speed_m_s, drive.most_turning], np.float32)
            parts["velocity"] = spaces.Box(-most, most, (2,), np.float32)
        if self.planner:
            parts |= self.planner.spaces()
        elif self.action_mask:
            parts["action_mask"] = spaces.MultiBinary(len(ACTIONS))
        return spaces.Dict(parts) if len(parts) > 1 else parts["map"]

    def image_space(self, channels: int, side: int) -> spaces.Box:
        """Return the space of square images in the configured layout."""
        shape = (channels, side, side) if self.layout == "CHW" else (side, side, channels)
        return spaces.Box(0.0, 1.0, shape, np.float32) if self.float_maps else spaces.Box(0, 255, shape, np.uint8)

    def motions(self, actions: object, *number: int) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_]]:
        """Return the turns and distances (N, 2) of actions, in radians and pixels, and which actions go forward.

        With a drive, return the commands (N, 3) in the form of ``kernels.driving`` instead of turns and distances.
        ``actions`` are (N,) or (N, 2); without ``number`` they are a single one, () or (2,). Raise ConfigError for an
        invalid action.
        """
        if not number and type(actions) in {int, np.int64} and actions in self._known_motions:
            return self._known_motions[actions]
        discrete = self.actions != "continuous"
        shape = number if discrete else (*number, 2)
        try:
            values = np.asarray(actions)
        except ValueError as error:
            raise ConfigError(f"action: expected {_shape_text(shape)}, found {actions!r}") from error
        if values.shape != shape:
            raise ConfigError(f"action: expected {_shape_text(shape)}, found {_shape_text(values.shape)}")
        if self.planner:
            return self.planner.kernel_actions(values), np.zeros(math.prod(number), bool)
        return self._motions_by_number(values) if discrete else self._motions_by_share(values)

    @cached_property
    def _known_motions(self) -> dict[int, tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_]]]:
        """The results of ``motions`` for single numbers, of which a step changes none."""
        if self.planner or self.actions != "discrete":
            return {}
        return {action: self._motions_by_number(np.array(action)) for action in range(len(ACTIONS))}

    def _motions_by_number(self, values: npt.NDArray[Any]) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_]]:
        """Return ``motions`` of numbered actions."""
        is_whole = values.dtype.kind in "iu"
        flat = values.ravel().astype(np.int64, copy=False) if is_whole else np.full(values.size, -1)
        found, ahead = np.empty((len(flat), 2)), np.empty(len(flat), bool)
        strange = look_up_motions(flat, self._table, found, ahead)
        if strange >= 0:
            raise ConfigError(f"action: expected 0 (forward), 1 (left) or 2 (right), found {values.item(strange)!r}")
        return found, ahead

    def _motions_by_share(self, values: npt.NDArray[Any]) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_]]:
        """Return ``motions`` of continuous actions."""
        strange = ~((values >= -1) & (values <= 1)) if values.dtype.kind in "iuf" else np.ones(values.shape, bool)
        if np.count_nonzero(strange):  # much faster than strange.any()
            wanted = "(linear, angular), numbers from -1 to 1"
            raise ConfigError(f"action: expected {wanted}, found {values[strange].item(0)!r}")
        shares = values.reshape(-1, 2).astype(np.float64)
        if drive := self.config.robot.drive:
            commands = np.full((len(shares), 3), np.inf)
            most = drive.max_speed_m_s * self.config.pixels_per_metre, drive.most_turning
            np.multiply(shares, most, commands[:, :2])
            return commands, shares[:, 0] > 0
        return np.ascontiguousarray(shares[:, ::-1] * self._full), shares[:, 0] > 0

    @cached_property
    def _table(self) -> npt.NDArray[np.float64]:
        """The motions of the discrete actions, in the form of ``motions``."""
        return np.array([action_motions(self.config)[action] for action in ACTIONS]) * (
            1.0,
            self.config.pixels_per_metre,
        )

    @cached_property
    def _full(self) -> npt.NDArray[np.float64]:
        """The full turn and the full distance of a step, in the form of ``motions``."""
        robot = self.config.robot
        return np.array([math.radians(robot.turn_deg), robot.step_m * self.config.pixels_per_metre])

    def observe(self, episode: Episode, metrics: Metrics, pictures: Pictures | None, sizes: Counts) -> Observation:
        """Return the observations of a pool of episodes, whose ``pictures`` have been drawn; ``MAPS`` are views.

        ``sizes`` (N, 2) are the rows and columns of their maps.
        """
        shown = pictures.shown if pictures else episode.shown[:, None]
        parts: dict[str, npt.NDArray[Any]] = {"map": self.in_layout(shown)}
        if self.complete:
            parts["global_map"] = self.in_layout(episode.overview[:, None])
            parts["pose"] = metrics.since_start().astype(np.float32)
            parts["ranges"] = (episode.ranges * metrics.cell_m).astype(np.float32)
        if self.config.goal_place and self.kind != "scales":
            parts["goal"] = metrics.goal_ahead().astype(np.float32)
        if self.config.goal_region:
            parts["goal_number"] = metrics.constants.goal_number.astype(np.int64)
            side = picture_side_px(self.config)
            views = np.empty((len(sizes), side, side), np.uint8)
            pixel = near_pixel_width(self.config)
            draw_goal_views(episode.known, episode.paths.standing, sizes, episode.pose, pixel, views)
            parts["goal_map"] = self.in_layout(views[:, None])
        if self.config.robot.drive and self.kind != "scales":
            parts["velocity"] = metrics.velocity().astype(np.float32)
        if self.planner:
            parts |= self.planner.observe(episode, metrics)
        elif self.action_mask:
            parts["action_mask"] = self._motion_masks(episode, sizes).view(np.int8)
        return parts if len(parts) > 1 else parts["map"]

    def in_layout(self, images: npt.NDArray[np.uint8]) -> npt.NDArray[Any]:
        """Return images (N, channels, rows, cols) in the configured layout, as ``float_maps`` says."""
        found = images if self.layout == "CHW" else np.moveaxis(images, 1, -1)
        return np.multiply(found, np.float32(1.0 / 255.0), dtype=np.float32) if self.float_maps else found

    def initial_state(
        self,
        world: World,
        params: StepParams,
        scratch: Scratch,
        rng: np.random.Generator,
        *,
        own: bool = True,
        last: State | None = None,
        pose_m: Pose | None = None,
    ) -> State:
        """Return the start of an episode (``worlds.reset``); the next step takes its first scan."""
        state = make_initial_state(
            world, self.config, params, scratch, rng, complete=self.complete, own=own, last=last, pose_m=pose_m,
            view_px=_NO_VIEW_PX if self.has_pictures else None, blocks_px=self._blocks_px,
        )  # fmt: skip
        if self.planner:
            state.episode = state.episode._replace(plans=self.planner.plans(state, world, self.task))
        return state

    def report(self, episode: Episode, metrics: Metrics, success: Bools) -> dict[str, npt.NDArray[Any]]:
        """Return the ``info`` of a pool of episodes, as new arrays."""
        found = self.task.report(metrics, success)
        if self.config.robot.drive:
            found["velocity"] = metrics.velocity()
        if self.config.noise.odometry:
            found["lost_m2"] = metrics.counts["lost"] * metrics.cell_m**2
        if self.planner:
            found |= self.planner.report(episode, metrics.cell_m)
        return found if self.text_info else {key: part for key, part in found.items() if part.dtype != object}

    def masks(self, episode: Episode, sizes: Counts) -> npt.NDArray[np.bool_]:
        """Return the mask of allowed actions (N, K); raise ConfigError for actions without a number."""
        if self.planner:
            return self.planner.masks(episode)
        if self.actions != "discrete":
            raise ConfigError(f'action_masks: expected actions="discrete" or "frontier", found {self.actions!r}')
        return self._motion_masks(episode, sizes)

    def _motion_masks(self, episode: Episode, sizes: Counts) -> npt.NDArray[np.bool_]:
        """Return which of the discrete actions meet no obstacle of the robots' own maps (N, 3); turns never do."""
        number, ppm = len(episode.known), self.config.pixels_per_metre
        masks = np.ones((number, len(ACTIONS)), bool)
        known = episode.known.reshape(number, -1)
        poses = np.ascontiguousarray(episode.pose.view(np.float64).reshape(number, -1)[:, 3:])  # for one or many
        robot, fit = self.config.robot, np.empty(number, bool)
        find_free_steps(known, sizes, poses, robot.step_m * ppm, robot.radius_m * ppm, fit)
        masks[:, 0] = fit
        return masks


def _shape_text(shape: tuple[int, ...]) -> str:
    return f"an array of shape {shape}" if shape else "a single number"


def new_episode_constants(number: int) -> EpisodeConstants:
    """Return the constants of a number of episodes that have not begun."""
    rows = np.full((number, 11), np.nan)
    rows[:, 6], rows[:, 7], rows[:, 10] = 1.0, 0.0, -1.0
    return EpisodeConstants.of(rows)


def compute_episode_constants(state: State, world: World) -> tuple[float, ...]:
    """Return the constants of a new episode: a row of ``EpisodeConstants.rows``."""
    corner, goal = (*world.corner_m, 0.0), state.goal_m or (math.nan, math.nan)
    return *corner, *corner, max(state.observable_cells, 1), state.shortest_path_m, *goal, state.goal_number


MAX_ENVS = (1 << 20) - 1  # in one vector


def make_env_spec(
    task: Task,
    dataset: Plans,
    config: SimulatorConfig | str | None,
    actions: Actions | None,
    observation: Kind,
    *,
    motion: Motion | None = None,
    planning: PlanningConfig | None = None,
    layout: Layout = "CHW",
    plan_ids: Iterable[str] | None = None,
    plan_order: Order = "random",
    max_episode_steps: int | None = None,
    action_mask: bool = False,
    float_maps: bool = False,
    text_info: bool = True,
) -> EnvSpec:
    """Return the specification of an environment; raise ConfigError if an argument is invalid.

    Without ``actions``, they are "continuous" for a robot with a drive, and otherwise "discrete".
    """
    houses = open_houses(dataset)
    kept = common_resolution(houses) if config is None or isinstance(config, str) else None
    config = _with_motion(_make_config(task, config, observation, max_episode_steps, kept), motion)
    actions = actions if actions is not None else "continuous" if config.robot.drive else "discrete"
    for name, value, kinds in (
        ("actions", actions, Actions),
        ("observation", observation, Kind),
        ("layout", layout, Layout),
    ):
        check_one_of(value, name, get_args(kinds))
    if config.robot.drive and actions != "continuous":
        raise ConfigError(
            f"actions: a robot with a drive takes continuous actions, found {actions!r}; leave actions out, or take "
            'motion="discrete" and no robot.drive'
        )
    planner = make_planner_spec(actions, planning, config, task)
    if action_mask and actions == "continuous":
        raise ConfigError(f'action_mask: expected actions="discrete" or "frontier", found {actions!r}; leave it out')
    choice = PlanChooser(WorldCache(houses, config), plan_ids, plan_order)
    return EnvSpec(task, config, choice, actions, observation, layout, planner, action_mask, float_maps, text_info)


def _with_motion(config: SimulatorConfig, motion: str | None) -> SimulatorConfig:
    """Return the configuration with the drive of a motion; raise ConfigError if it has another one."""
    if motion is None or motion == config.robot.motion:
        return config
    check_one_of(motion, "motion", get_args(Motion))
    if config.robot.drive is not None:
        raise ConfigError(f"motion: expected that of config.robot.drive, {config.robot.motion!r}, found {motion!r}")
    return replace(config, robot=replace(config.robot, drive=DRIVES[motion]()))


def _make_config(
    task: Task,
    config: SimulatorConfig | str | None,
    observation: Kind,
    max_episode_steps: int | None,
    own_ppm: float | None,
) -> SimulatorConfig:
    """Return the configuration; raise ConfigError if it is invalid or does not fit the observation.

    ``own_ppm`` are the cells per metre of maps, which are kept if no configuration is given.
    """
    if own_ppm is not None:
        kept = replace(task.configure(None), pixels_per_metre=own_ppm)
        config = with_preset(config, kept) if isinstance(config, str) else kept
    if isinstance(config, str):
        config = with_preset(config, task.configure(None))
    if config is not None and not isinstance(config, SimulatorConfig):
        raise ConfigError(f"config: expected a SimulatorConfig, one of {', '.join(PRESETS)}, or None; found {config!r}")
    config = task.configure(config)
    if max_episode_steps is not None:
        check_whole_number(max_episode_steps, "max_episode_steps", at_least=1)
        config = replace(config, max_steps=max_episode_steps)
    view = config.observation
    if observation == "scales" and view.far_size_m <= view.size_m:
        raise ConfigError(
            f"observation.far_size_m: expected more than size_m, {view.size_m:g}, for several scales, "
            f"found {view.far_size_m:g}"
        )
    return config


def check_vector_arguments(
    num_envs: int, threads: int | None, autoreset_mode: AutoresetMode | str, render_mode: str | None
) -> AutoresetMode:
    """Return the autoreset mode of a vector environment; raise ConfigError if an argument is invalid."""
    check_whole_number(num_envs, "num_envs", at_least=1, at_most=MAX_ENVS)
    check_whole_number(1 if threads is None else threads, "threads", at_least=1)
    if autoreset_mode not in set(AutoresetMode) | {mode.value for mode in AutoresetMode}:
        modes = ", ".join(mode.value for mode in AutoresetMode)
        raise ConfigError(f"autoreset_mode: expected one of {modes}; found {autoreset_mode!r}")
    if not (render_mode is None or (isinstance(render_mode, str) and render_mode == "rgb_array")):
        raise ConfigError(f"render_mode: expected 'rgb_array' or None, found {render_mode!r}")
    return AutoresetMode(autoreset_mode)
