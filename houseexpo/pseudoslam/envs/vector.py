"""Provide gymnasium vector environments of N robots, stepped by one compiled call, without worker processes."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import lru_cache, wraps
from threading import RLock
from typing import Any, TypeVar, Unpack

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.config.simulator import PlanningConfig
from houseexpo.pseudoslam.envs.episode_batch import EpisodeBatch
from houseexpo.pseudoslam.envs.pictures import count_channels, picture_side_px
from houseexpo.pseudoslam.envs.reset_options import Pose, Seeds, parse_seeds, parse_vector_options
from houseexpo.pseudoslam.envs.single import ExplorationMixin, NavigationMixin, ObstacleAvoidanceMixin, PseudoSlamEnv
from houseexpo.pseudoslam.envs.spec import (
    Actions,
    EnvOptions,
    Kind,
    Observation,
    check_options,
    check_vector_arguments,
    compute_episode_constants,
    make_env_spec,
    new_episode_constants,
)
from houseexpo.pseudoslam.kernels.step import REDRAW, SKIP, STEP
from houseexpo.pseudoslam.metrics import Metrics
from houseexpo.pseudoslam.simulator import Simulator
from houseexpo.pseudoslam.state import State
from houseexpo.pseudoslam.tasks import Task
from houseexpo.pseudoslam.worlds.maps import Plans

SETTABLE = ("task", "plan_ids")
"""Attributes that can be set later: the task, from the next step on, and the plans, from the next episodes on."""

FOR_ALL = ("reset", "step", "close", "call", "get_attr", "set_attr")
"""Methods that exist only for all environments together."""

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]
PICTURE_PX = (480, 360)
"""Width and height of each environment's picture, pixels."""
Method = TypeVar("Method", bound=Callable[..., Any])


def lock_method(method: Method) -> Method:
    """Make calls of a method of ``PseudoSlamVectorEnv`` wait for those of other threads."""

    @wraps(method)
    def call_locked(self: PseudoSlamVectorEnv, *args: Any, **kwargs: Any) -> Any:
        with self._lock:
            return method(self, *args, **kwargs)

    return call_locked  # type: ignore[return-value]  # it takes and returns what the method does


class PseudoSlamVectorEnv(VectorEnv[Observation, npt.NDArray[Any], npt.NDArray[Any]]):
    """N environments like ``single.PseudoSlamEnv``, each in its own house, stepped together on all cores.

    The results are identical to those of N single environments: ``reset(seed=s)`` corresponds to the seeds s to s + N -
    1, and a list gives each environment its own seed. ``options`` may have ``plan_id`` and ``pose`` as for a single
    environment, with one value for all or a list of N (None for random), and ``reset_mask`` (N,), the environments to
    reset.

    ``autoreset_mode`` determines what happens at the end of an episode:

    - NEXT_STEP (the default): the next step ignores the action, resets, and returns reward 0.
    - SAME_STEP: the environment is reset at once; ``info["final_obs"]`` and ``info["final_info"]`` are those of the
      last step.
    - DISABLED: the caller resets with ``reset(options={"reset_mask": ...})``; a step without it raises ResetNeeded.

    ``info`` has an array for each key and, as ``_key``, the mask of environments that it applies to.

    A copy or a pickle continues from the same step. Several threads may make calls, which wait for each other.

    Parameters
    ----------
    num_envs
        The number of environments, N.
    copy
        Whether to return copies of the observations. If False, maps are views, which the next step overwrites.
    threads
        Number of threads; None for one per core. It does not change the results.
    """

    def __init__(
        self,
        task: Task,
        /,
        dataset: Plans,
        config: SimulatorConfig | str | None = None,
        *,
        num_envs: int = 1,
        actions: Actions | None = None,
        observation: Kind = "map",
        planning: PlanningConfig | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        copy: bool = True,
        threads: int | None = None,
        render_mode: str | None = None,
        **more: Unpack[EnvOptions],
    ) -> None:
        self._lock = RLock()
        check_options(type(self), more)
        self.autoreset_mode = check_vector_arguments(num_envs, threads, autoreset_mode, render_mode)
        self.metadata = {**PseudoSlamEnv.metadata, "autoreset_mode": self.autoreset_mode}
        self._env_spec = make_env_spec(task, dataset, config, actions, observation, planning=planning, **more)
        self.task, self.config, self.render_mode = task, self._env_spec.config, render_mode
        self.num_envs, self._copy = num_envs, copy
        self.single_action_space = self._env_spec.action_space()
        self.single_observation_space = self._env_spec.observation_space()
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._params, self._scratch = self._env_spec.params(), self._env_spec.scratch()
        self._pictures = self._env_spec.pictures(num_envs)
        self._batch = EpisodeBatch(num_envs, self.config, self._params, threads)
        self._rngs: dict[int, np.random.Generator] = {}
        self._plan_ids = np.full(num_envs, None, object)
        self._simulators: dict[int, Simulator] = {}
        self._ended = np.ones(num_envs, bool)
        self._begun = np.zeros(num_envs, bool)
        self._are_begun = False
        self._everywhere, self._all = np.ones(num_envs, bool), np.full(num_envs, STEP, np.uint8)
        self._constants = new_episode_constants(num_envs)
        self._own: frozenset[str] = frozenset()  # names of attributes that the caller has set
        self._after: Metrics

    def __getstate__(self) -> dict[str, Any]:
        """Pickle and copy without the lock; each copy has its own."""
        return {name: value for name, value in self.__dict__.items() if name != "_lock"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state, _lock=RLock())

    @property
    def plan_ids(self) -> list[str] | None:
        """The ids of the plans for episodes; None for all plans of the data set. Setting it is for later episodes."""
        return self._env_spec.choice.plan_ids

    @plan_ids.setter
    def plan_ids(self, plan_ids: Iterable[str] | None) -> None:
        self._env_spec.choice.take(plan_ids)

    @lock_method
    def reset(self, *, seed: Seeds = None, options: dict[str, Any] | None = None) -> tuple[Observation, dict[str, Any]]:
        """Start episodes in all environments, or in those of ``options["reset_mask"]``."""
        seeds = parse_seeds(seed, self.num_envs)
        which, plan_ids, poses = parse_vector_options(options, self.num_envs)
        if which.all() and any(one is not None for one in seeds):
            self._env_spec.choice.start_over()
        self._are_begun, self._begun = False, self._begun & ~which  # if a start fails, none is half started
        for i in np.flatnonzero(which).tolist():
            if seeds[i] is not None or i not in self._rngs:
                self._rngs[i] = seeding.np_random(seeds[i])[0]
            self._start_episode(i, plan_ids[i], poses[i])
        self._look_round(which, REDRAW)
        self._begun |= which
        infos = self._infos(self._after, self.task.success(self._after), which)
        return self._observations(self._after), infos

    @lock_method
    def step(self, actions: npt.NDArray[Any]) -> tuple[Observation, Floats, Bools, Bools, dict[str, Any]]:
        """Take one action in each environment; actions (N,) or (N, 2)."""
        if not self._are_begun or (self.autoreset_mode == AutoresetMode.DISABLED and np.count_nonzero(self._ended)):
            ready = self._begun & ~self._ended if self.autoreset_mode == AutoresetMode.DISABLED else self._begun
            self._check_ready(ready)
            self._are_begun = True
        motions, ahead = self._env_spec.motions(actions, self.num_envs)
        starting = self._ended.nonzero()[0].tolist()  # in NEXT_STEP, or after a failed start
        for i in starting:
            self._start_episode(i)
            motions[i] = 0.0
        self._advance(motions, self._all, fresh=self._copy)
        before, after = self._after, self._metrics()
        self._after = after
        success = self.task.success(after)
        rewards = self.task.rewards(before, after, ahead, success)
        terminated, truncated = self.task.terminated(after, success), after.truncated()
        if starting:
            rewards[starting], terminated[starting], truncated[starting] = 0.0, False, False
        self._ended = terminated | truncated
        final: dict[str, Any] = {}
        if self.autoreset_mode == AutoresetMode.SAME_STEP and np.count_nonzero(self._ended):
            final, ended = self._finals(after, success), self._ended
            for i in ended.nonzero()[0].tolist():
                self._start_episode(i)
            self._look_round(ended, SKIP)
            success = self.task.success(self._after)
        infos = self._infos(self._after, success, self._everywhere) | final
        return self._observations(self._after), rewards, terminated, truncated, infos

    @lock_method
    def state(self, i: int) -> State:
        """Return the state of environment ``i``; its arrays are views, which the next step changes.

        Its ``view`` is the observation of the last step, in the same memory, even if that belongs to the caller.
        """
        self._check_ready(self._begun, i)
        return self._batch.state(i)

    @lock_method
    def render(self) -> list[npt.NDArray[np.uint8] | None] | None:  # type: ignore[override]  # a picture or none
        """Return a picture of each environment like ``PseudoSlamEnv.render``, all of size ``PICTURE_PX`` for movies.

        Return None without a render mode.
        """
        if self.render_mode is None:
            return None
        self._check_ready(self._begun)
        from houseexpo.pseudoslam.render.picture import draw_episode, pad_picture

        drawn = (draw_episode(self._simulators[i], self.state(i), most_px=PICTURE_PX) for i in range(self.num_envs))
        return [pad_picture(image, PICTURE_PX) for image in drawn]

    @lock_method
    def action_masks(self, i: int | None = None) -> Bools:
        """Return the masks of allowed actions (N, K), or the one of environment ``i`` (K,)."""
        self._check_ready(self._begun, i)
        masks = self._env_spec.masks(self._batch.arrays, self._batch.sizes)
        return masks if i is None else masks[i]

    @lock_method
    def draw_into(self, maps: npt.NDArray[np.uint8]) -> None:
        """Draw maps into an array of the caller from now on; each reset and step overwrites it.

        Parameters
        ----------
        maps
            (N, channels, side, side) uint8, C-contiguous, like "map" of the observations with ``layout="CHW"``.

        Raises
        ------
        ConfigError
            The array has another shape, type or layout, or the environments were made without ``copy=False``.
        """
        config, several = self._env_spec.config, self._env_spec.kind == "scales"
        shape = self.num_envs, count_channels(config, several=several), picture_side_px(config), picture_side_px(config)
        if self._copy or self._env_spec.layout != "CHW":
            raise ConfigError('draw_into: expected environments made with copy=False and layout="CHW"')
        if maps.shape != shape or maps.dtype != np.uint8 or not (maps.flags.c_contiguous and maps.flags.writeable):
            raise ConfigError(
                f"draw_into: expected a C-contiguous uint8 array of shape {shape} that can be written to, "
                f"found {maps.dtype} {maps.shape}"
            )
        if self._pictures:
            self._pictures.shown = maps
        else:
            self._batch.draw_into(maps[:, 0])

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Return the result of a method for each environment; its first argument is the number, as in ``state``.

        "render" gives a picture of each. For an attribute, this is ``get_attr``. Raise ConfigError for a method that is
        only for all environments together.
        """
        found = getattr(self, name)
        if not callable(found):
            return (found,) * self.num_envs
        if name == "render":
            return tuple(found() or (None,) * self.num_envs)
        if name in FOR_ALL:
            raise ConfigError(
                f"{name}: this method is for all environments together; call {name}() on the vector environment"
            )
        return tuple(found(i, *args, **kwargs) for i in range(self.num_envs))

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """Return an attribute for each environment; all share the same one."""
        return (getattr(self, name),) * self.num_envs

    def set_attr(self, name: str, values: Any) -> None:
        """Set an attribute that all environments share.

        A ``task`` must be of the same kind and applies from the next step on; ``plan_ids`` apply from the next episodes
        on. Other names are new attributes of the caller.

        Parameters
        ----------
        values
            One value for all, or a list or tuple of N equal ones; ``plan_ids`` is one list for all.

        Raises
        ------
        ConfigError
            The attribute is fixed when the environments are made, or the values differ.
        """
        value = values if name == "plan_ids" else self._one_for_all(name, values)
        if hasattr(self, name) and name not in (*SETTABLE, *self._own):
            raise ConfigError(
                f"{name}: this attribute is fixed when the environments are made; make new ones (these can be set: "
                f"{', '.join(SETTABLE)}, and attributes of your own)"
            )
        if name == "task":
            self._check_task(value)
        elif name not in SETTABLE:
            self._own |= {name}
        setattr(self, name, value)

    def _check_ready(self, ready: Bools, i: int | None = None) -> None:
        """Raise ResetNeeded if environment ``i`` is not ready or, for None, if any is not."""
        if not np.all(ready if i is None else ready[i]):
            raise gymnasium.error.ResetNeeded(f"environments {np.flatnonzero(~ready).tolist()}: call reset() first")

    def close_extras(self, **kwargs: Any) -> None:  # noqa: ARG002  # gymnasium's signature
        """End the threads."""
        self._batch.close()

    def _start_episode(self, i: int, plan_id: str | None = None, pose: Pose | None = None) -> None:
        """Put the start of an episode at place ``i``, before its first scan."""
        rng = self._rngs[i]
        world = self._env_spec.choice.draw(rng, plan_id)
        state = self._env_spec.initial_state(world, self._params, self._scratch, rng, own=False, pose_m=pose)
        self._batch.put(i, state)
        self._constants.rows[i], self._plan_ids[i] = compute_episode_constants(state, world), world.plan_id
        if self.render_mode is not None:  # a simulator keeps the rasters of its world
            self._simulators[i] = Simulator(world, self.config, self._params, self._scratch)

    def _look_round(self, which: Bools, others: int) -> None:
        """Take the first scans of new episodes together; the views are in a new array if all are shown."""
        wanted = np.where(which, STEP, others).astype(np.uint8)
        self._advance(np.zeros((self.num_envs, 2)), wanted, fresh=self._copy and others == REDRAW)
        self._after = self._metrics()
        self._ended = self._ended & ~which

    def _advance(self, motions: Floats, wanted: npt.NDArray[np.uint8], *, fresh: bool) -> None:
        """Do the ``wanted`` steps, and draw the observations."""
        self._batch.step(motions, wanted, fresh=fresh)
        if self._pictures:
            pool, sizes = self._batch.arrays, self._batch.sizes
            self._pictures.draw(pool, sizes, wanted, self._constants, self._batch.share, fresh=fresh)

    def _metrics(self) -> Metrics:
        return Metrics.of(self._constants, self._batch.arrays, self.config)

    def _observations(self, after: Metrics) -> Observation:
        """Return the observations, as copies if ``copy`` is set."""
        found = self._observe(after)
        if self._copy and isinstance(found, dict) and "global_map" in found:
            found["global_map"] = found["global_map"].copy()  # the view was drawn into the caller's array
        return found

    def _observe(self, after: Metrics) -> Observation:
        return self._env_spec.observe(self._batch.arrays, after, self._pictures, self._batch.sizes)

    def _infos(self, after: Metrics, success: Bools, which: Bools) -> dict[str, Any]:
        report = self._env_spec.report(self._batch.arrays, after, success)
        if self._env_spec.text_info:
            report["plan_id"] = self._plan_ids.copy()
        return with_masks(report, which)

    def _finals(self, after: Metrics, success: Bools) -> dict[str, Any]:
        last = _copies_of(self._observe(after), self._ended)
        masks = {"_final_obs": self._ended.copy(), "_final_info": self._ended.copy()}
        return {"final_obs": last, "final_info": self._infos(after, success, self._ended), **masks}

    def _one_for_all(self, name: str, values: Any) -> Any:
        if not isinstance(values, (list, tuple)):
            return values
        first = values[0] if values else None
        if len(values) != self.num_envs or not all(_are_equal(value, first) for value in values):
            raise ConfigError(
                f"{name}: expected one value, or {self.num_envs} equal ones, since all environments share it; "
                f"found {values!r}"
            )
        return first

    def _check_task(self, task: Any) -> None:
        if type(task) is not type(self.task):
            raise ConfigError(f"task: expected a task of the same kind, {type(self.task).__name__}, found {task!r}")
        if task.rewards_add_up != self.task.rewards_add_up:
            raise ConfigError(
                "task: expected the same rewards_add_up as that of the current task, "
                f"{self.task.rewards_add_up}, found "
                f"{task!r}; make new environments"
            )
        if task.clearance_m != self.task.clearance_m:
            raise ConfigError(
                f"task: expected the clearance that the current task measures, {self.task.clearance_m:g} m, "
                f"found {task.clearance_m:g} m; make new environments"
            )


class ExplorationVectorEnv(ExplorationMixin, PseudoSlamVectorEnv):
    """``PseudoSLAM/Exploration-v0``, vectorised: see ``tasks.Exploration`` and ``PseudoSlamVectorEnv``."""


class ObstacleAvoidanceVectorEnv(ObstacleAvoidanceMixin, PseudoSlamVectorEnv):
    """``PseudoSLAM/ObstacleAvoidance-v0``, vectorised: see ``tasks.ObstacleAvoidance`` and ``PseudoSlamVectorEnv``."""


class NavigationVectorEnv(NavigationMixin, PseudoSlamVectorEnv):
    """``PseudoSLAM/Navigation-v0``, vectorised: see ``tasks.Navigation`` and ``PseudoSlamVectorEnv``."""


def _are_equal(one: Any, other: Any) -> bool:
    """Return whether two values, which may be arrays, are equal."""
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        return np.array_equal(one, other)
    return bool(one is other or one == other)


def with_masks(report: dict[str, Any], which: npt.NDArray[np.bool_]) -> dict[str, Any]:
    """Return the info for arrays of N values, or for dicts of them, with the mask ``which`` for each key."""
    masks = np.empty((len(report), len(which)), bool)
    masks[:] = which
    return {**report, **dict(zip(_names(*report), masks, strict=True))}


def _copies_of(
    observed: npt.NDArray[Any] | dict[str, npt.NDArray[Any]], which: npt.NDArray[np.bool_]
) -> npt.NDArray[np.object_]:
    """Return copies of the observations of the environments ``which``, and None for the others (N,)."""
    last = np.full(len(which), None, object)
    for i in np.flatnonzero(which).tolist():
        if isinstance(observed, dict):
            last[i] = {key: part[i].copy() for key, part in observed.items()}
        else:
            last[i] = observed[i].copy()
    return last


@lru_cache(maxsize=8)
def _names(*keys: str) -> list[str]:
    """Return the names of the masks of these keys."""
    return [f"_{key}" for key in keys]
