"""Provide gymnasium environments with one robot (exploration, avoidance, navigation), and each task's arguments."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, Unpack

import gymnasium
import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.config.simulator import PlanningConfig
from houseexpo.pseudoslam.envs.reset_options import check_reset_options, parse_pose
from houseexpo.pseudoslam.envs.spec import (
    MAPS,
    Actions,
    AllEnvOptions,
    EnvOptions,
    Kind,
    Observation,
    check_options,
    compute_episode_constants,
    make_env_spec,
    new_episode_constants,
)
from houseexpo.pseudoslam.kernels.compiling import compiled_function
from houseexpo.pseudoslam.kernels.step import STEP
from houseexpo.pseudoslam.metrics import Bools, Metrics
from houseexpo.pseudoslam.simulator import Simulator
from houseexpo.pseudoslam.state import State
from houseexpo.pseudoslam.step_kernels import (
    choose_kernel,
    enlarge_scratch,
    kernel_arguments,
    take_first_scan,
)
from houseexpo.pseudoslam.tasks import (
    ROOM,
    AvoidanceReward,
    Exploration,
    ExplorationReward,
    Navigation,
    ObstacleAvoidance,
    Task,
)
from houseexpo.pseudoslam.worlds.maps import Plans

if TYPE_CHECKING:
    from houseexpo.pseudoslam.render.picture import PictureWindow

_WANTED = np.full(1, STEP, np.uint8)


class _RenderModes(list[str]):
    """The names of render modes; asked for what is no text, it says so, where gymnasium.make would fail."""

    def __contains__(self, mode: object) -> bool:
        if not isinstance(mode, str):
            raise ConfigError(f"render_mode: expected one of {list(self)}, found {mode!r}")
        return super().__contains__(mode)


class PseudoSlamEnv(gymnasium.Env[Observation, Any]):
    """A gymnasium environment: a robot with a task in a house.

    - *Action* and *observation*: see ``spec.EnvSpec``, for the parameters ``actions`` and ``observation``.
    - *Reward* and *terminated*: defined by the task; *truncated*: after ``config.max_steps`` steps, or as
      many as ``max_episode_steps`` says, here or in ``gymnasium.make``.
    - *Info*: ``explored_m2``, ``coverage`` (0 to 1), ``collisions`` so far, ``collided`` in this step, ``pose`` (x, y
      in the plan's metres, heading in radians), ``is_success``, ``plan_id``, ``velocity`` of a drive, and the entries
      of the task.

    The seed of ``reset(seed=...)`` determines plan, start, obstacles, people and noise.
    ``options={"plan_id": ..., "pose": ...}`` sets the plan, and the start as x, y in the plan's metres and heading in
    radians.

    Parameters
    ----------
    dataset
        The path of a data set, a data set, a plan or a list of plans; a plan is drawn at random for each episode.
    config
        The configuration of the simulation, or the name of one of ``config.simulator.PRESETS``, which sets the laser
        and the view. By default, the values of the task.
    actions
        "discrete", "continuous" or "frontier"; by default "discrete", or "continuous" for a robot with a drive
        (``EnvOptions.motion``).
    observation
        "map", "dict" or "scales".
    planning
        The configuration of planners' actions.
    render_mode
        "rgb_array", "human", or None.
    more
        Further arguments, see ``EnvOptions``.

    Raises
    ------
    ConfigError
        An argument, an option or an action is invalid.
    """

    metadata = {"render_modes": _RenderModes(("rgb_array", "human")), "render_fps": 10}  # noqa: RUF012  # as gymnasium declares it

    def __init__(
        self,
        task: Task,
        /,
        dataset: Plans,
        config: SimulatorConfig | str | None = None,
        *,
        actions: Actions | None = None,
        observation: Kind = "map",
        planning: PlanningConfig | None = None,
        render_mode: str | None = None,
        **more: Unpack[EnvOptions],
    ) -> None:
        if render_mode is not None and render_mode not in self.metadata["render_modes"]:
            raise ConfigError(f"render_mode: expected one of {self.metadata['render_modes']}, found {render_mode!r}")
        check_options(type(self), more)
        if more.get("max_episode_steps") is None:
            more["max_episode_steps"] = steps_asked_of_make(type(self))
        self._env_spec = make_env_spec(task, dataset, config, actions, observation, planning=planning, **more)
        self.task, self.config, self.render_mode = task, self._env_spec.config, render_mode
        self.actions, self.observation = self._env_spec.actions, observation
        self.action_space, self.observation_space = self._env_spec.action_space(), self._env_spec.observation_space()
        self._params, self._scratch = self._env_spec.params(), self._env_spec.scratch()
        self._pictures = self._env_spec.pictures(1)
        self._simulator: Simulator | None = None
        self._state: State | None = None
        self._constants = new_episode_constants(1)
        self._after: Metrics
        self._trail: list[npt.NDArray[np.float64]] = []
        self._window: PictureWindow | None = None
        self._run: Callable[..., None] | None = None  # the compiled step, which the first one finds

    @property
    def plan_ids(self) -> list[str] | None:
        """The ids of the plans for episodes; None for all plans of the data set. Setting it is for later episodes."""
        return self._env_spec.choice.plan_ids

    @plan_ids.setter
    def plan_ids(self, plan_ids: Iterable[str] | None) -> None:
        self._env_spec.choice.take(plan_ids)

    @property
    def simulator(self) -> Simulator:
        """The simulator of this episode; raises ResetNeeded before the first reset."""
        if self._simulator is None:
            raise gymnasium.error.ResetNeeded("call reset() before anything else")
        return self._simulator

    @property
    def state(self) -> State:
        """The state of this episode, which the next step or reset changes; raises ResetNeeded before the first reset.

        Use ``state.copy()`` to keep one.
        """
        if self._state is None:
            raise gymnasium.error.ResetNeeded("call reset() before anything else")
        return self._state

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode; return the observation and the info."""
        super().reset(seed=seed)
        given = check_reset_options(options)
        pose = parse_pose(given.get("pose"))
        if seed is not None:
            self._env_spec.choice.start_over()
        before, last = self._simulator, self._state
        self._simulator = self._state = None  # if the start fails, the old episode must not continue
        world = self._env_spec.choice.draw(self.np_random, given.get("plan_id"))
        if before is None or before.world is not world or not self._env_spec.keeps_house:
            last = None
        if self._env_spec.planner:
            self._scratch = enlarge_scratch(self._scratch, world.occupied.size)
        state = self._env_spec.initial_state(world, self._params, self._scratch, self.np_random, last=last, pose_m=pose)
        take_first_scan(state, self._params, self._scratch)
        self._simulator, self._state = Simulator(world, self.config, self._params, self._scratch), state
        self._believe(starts=True)
        self._constants.rows[0] = compute_episode_constants(state, world)
        after = self._after = self._metrics()
        self._trail = []
        self._show()
        return self._observation(after), self._info(after, self.task.success(after))

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Take one action; return the observation, the reward, terminated, truncated and the info."""
        state = self.state
        moves, ahead = self._env_spec.motions(action)
        before = self._after
        if self._run is None:
            kernel = choose_kernel(state.episode, self._params)
            self._run = compiled_function(kernel, *kernel_arguments(state, moves, self._params, self._scratch))
        self._run(*kernel_arguments(state, moves, self._params, self._scratch))
        self._believe(starts=False)
        after = self._after = self._metrics()
        success = self.task.success(after)
        reward = float(self.task.rewards(before, after, ahead, success)[0])
        ends = bool(self.task.terminated(after, success)[0]), bool(after.truncated()[0])
        self._show()
        return self._observation(after), reward, *ends, self._info(after, success)

    def look_from(
        self, pose: tuple[float, float, float], occupied: npt.NDArray[np.uint8]
    ) -> tuple[Observation, dict[str, Any]]:
        """Put the robot at a pose among other obstacles, scan there by a step in place; return the values of ``reset``.

        This is for a robot that another program moves. The robot's map stays.

        Parameters
        ----------
        pose
            x, y in the plan's metres, heading in radians.
        occupied
            (rows, cols) of the state's ``occupied``.
        """
        state, frame = self.state, self.simulator.world.frame
        state.occupied[:] = occupied
        for pose_px in (state.pose_px, state.believed_px):
            pose_px[:] = *frame.pixels_from_points(pose[:2]).tolist(), pose[2]
        take_first_scan(state, self._params, self._scratch)
        self._believe(starts=False)
        after = self._after = self._metrics()
        self._show()
        return self._observation(after), self._info(after, self.task.success(after))

    def render(self) -> npt.NDArray[np.uint8] | None:
        """Return the map with the robot on it, (rows, cols, 3) uint8, row 0 at the highest y, or show it in a window.

        See ``render.picture``. Raise MissingDependencyError if ``render_mode`` is "human" and pygame is not installed.
        """
        if self.render_mode is None:
            gymnasium.logger.warn(
                "nothing is drawn without a render_mode: make the environment with 'rgb_array' or 'human'"
            )
            return None
        from houseexpo.pseudoslam.render.picture import draw_episode

        image = draw_episode(self.simulator, self.state, self._trail)
        if self.render_mode == "rgb_array":
            return image
        from houseexpo.pseudoslam.render.picture import PictureWindow

        self._window = self._window or PictureWindow("PseudoSLAM")
        self._window.show(image, fps=self.metadata["render_fps"])
        return None

    def action_masks(self) -> npt.NDArray[np.bool_]:
        """Return the mask of allowed actions (K,), for MaskablePPO of sb3-contrib."""
        masks: npt.NDArray[np.bool_] = self._env_spec.masks(self.state.pool, self.state.sizes)[0]
        return masks

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            self._window.close()
            self._window = None

    def __getstate__(self) -> dict[str, Any]:
        """Pickle and copy everything but the window and the compiled step; the copy continues from the same step."""
        return {**self.__dict__, "_window": None, "_run": None}

    def _show(self) -> None:
        """Record the trail if pictures are drawn, and show a picture if ``render_mode`` is "human"."""
        if self.render_mode is not None:
            self._trail.append(self.state.poses_px.copy())
        if self.render_mode == "human":
            self.render()

    def _believe(self, *, starts: bool) -> None:
        """Replace the belief that the simulator has drawn, in environments with a SLAM of their own."""

    def _metrics(self) -> Metrics:
        return Metrics.of(self._constants, self.state.pool, self.config)

    def _observation(self, after: Metrics) -> Observation:
        if self._pictures:
            pool, sizes = self.state.pool, self.state.sizes
            self._pictures.draw(pool, sizes, _WANTED, self._constants, lambda draw: draw(0, 1))
        found = self._env_spec.observe(self.state.pool, after, self._pictures, self.state.sizes)
        if isinstance(found, dict):
            return {key: part[0].copy() if key in MAPS else part[0] for key, part in found.items()}
        one: npt.NDArray[Any] = found[0].copy()
        return one

    def _info(self, after: Metrics, success: Bools) -> dict[str, Any]:
        report = self._env_spec.report(self.state.pool, after, success)
        info = {key: value[0] if value.ndim > 1 else value.item() for key, value in report.items()}
        if self._env_spec.text_info:
            info["plan_id"] = self.simulator.world.plan_id
        return info


class ExplorationMixin:
    """Arguments of exploration."""

    def __init__(
        self,
        dataset: Plans | None = None,  # gymnasium.make passes on what it is given; None is refused in plain words
        config: SimulatorConfig | str | None = None,
        *,
        success_coverage: float | None = None,
        reward: ExplorationReward = "area",
        cost_per_metre: float = 0.0,
        cost_per_turn: float = 0.0,
        **options: Unpack[AllEnvOptions],
    ) -> None:
        task = Exploration(success_coverage, reward, cost_per_metre, cost_per_turn)
        super().__init__(task, dataset, config, **options)  # type: ignore[call-arg, misc]  # the next base's


class ObstacleAvoidanceMixin:
    """Arguments of obstacle avoidance."""

    def __init__(
        self,
        dataset: Plans = ROOM,
        config: SimulatorConfig | str | None = None,
        *,
        terminate_on_collision: bool = False,
        safe_m: float = 0.5,
        reward: AvoidanceReward = "paper",
        **options: Unpack[AllEnvOptions],
    ) -> None:
        task = ObstacleAvoidance(terminate_on_collision, safe_m, reward)
        super().__init__(task, dataset, config, **options)  # type: ignore[call-arg, misc]  # the next base's


class NavigationMixin:
    """Arguments of navigation."""

    def __init__(
        self,
        dataset: Plans | None = None,  # gymnasium.make passes on what it is given; None is refused in plain words
        config: SimulatorConfig | str | None = None,
        *,
        success_reward: float = 2.5,
        **options: Unpack[AllEnvOptions],
    ) -> None:
        super().__init__(Navigation(success_reward), dataset, config, **options)  # type: ignore[call-arg, misc]  # the next base's


class ExplorationEnv(ExplorationMixin, PseudoSlamEnv):
    """``PseudoSLAM/Exploration-v0``; see ``tasks.Exploration`` and ``PseudoSlamEnv``."""


class ObstacleAvoidanceEnv(ObstacleAvoidanceMixin, PseudoSlamEnv):
    """``PseudoSLAM/ObstacleAvoidance-v0``; see ``tasks.ObstacleAvoidance`` and ``PseudoSlamEnv``."""


class NavigationEnv(NavigationMixin, PseudoSlamEnv):
    """``PseudoSLAM/Navigation-v0``; see ``tasks.Navigation`` and ``PseudoSlamEnv``."""


# Find the ``max_episode_steps`` given to ``gymnasium.make``, which it does not pass on to the environment.


def steps_asked_of_make(kind: type[gymnasium.Env[Any, Any]]) -> int | None:
    """Return ``max_episode_steps`` of the call of ``gymnasium.make`` that is making an environment of this class.

    ``make`` keeps that argument, and the one of a registration, for its wrapper ``TimeLimit``, which can shorten
    episodes but not lengthen them: an environment with a limit of its own would end first, in silence. So it is read
    from the call itself. Return None without such a call, and if neither names a number; -1 means no wrapper.
    """
    frame = inspect.currentframe()
    while frame is not None and frame.f_code is not gymnasium.make.__code__:
        frame = frame.f_back
    if frame is None or frame.f_locals.get("env_creator") is not kind:  # the caller makes an environment of its own
        return None
    asked, spec = frame.f_locals.get("max_episode_steps"), frame.f_locals.get("env_spec")
    steps: int | None = asked if asked is not None else getattr(spec, "max_episode_steps", None)
    return None if steps == -1 else steps
