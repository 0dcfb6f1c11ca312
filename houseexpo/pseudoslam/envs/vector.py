"""Many robots at once: gymnasium's vector interface over one compiled call, without worker processes."""

from __future__ import annotations

from typing import Any, Unpack

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.config.planning import PlanningConfig
from houseexpo.pseudoslam.envs.batch import Batch
from houseexpo.pseudoslam.envs.draws_into import DrawsInto
from houseexpo.pseudoslam.envs.infos import infos_of, last_of
from houseexpo.pseudoslam.envs.make_spec import checked_vector, make_env_spec
from houseexpo.pseudoslam.envs.one_at_a_time import Locked, one_at_a_time
from houseexpo.pseudoslam.envs.options import EnvOptions, check_options
from houseexpo.pseudoslam.envs.plan_choice import TakesPlans
from houseexpo.pseudoslam.envs.reset_arguments import Pose, Seeds, options_for, seeds_of
from houseexpo.pseudoslam.envs.shared_attributes import SharedAttributes
from houseexpo.pseudoslam.envs.single import PseudoSlamEnv
from houseexpo.pseudoslam.envs.spec import Actions, Kind, Observation, constants_of, new_constants
from houseexpo.pseudoslam.envs.task_mixins import ExplorationMixin, NavigationMixin, ObstacleAvoidanceMixin
from houseexpo.pseudoslam.kernels.step_pool import REDRAW, SKIP, STEP
from houseexpo.pseudoslam.metrics import Metrics
from houseexpo.pseudoslam.simulator import Simulator
from houseexpo.pseudoslam.state import State
from houseexpo.pseudoslam.tasks import Task
from houseexpo.pseudoslam.worlds.cache import Plans

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]
PICTURE_PX = (480, 360)
"""Width and height of each environment's picture."""


class PseudoSlamVectorEnv(
    SharedAttributes, DrawsInto, TakesPlans, Locked, VectorEnv[Observation, npt.NDArray[Any], npt.NDArray[Any]]
):
    """N environments as ``env.PseudoSlamEnv``, each in a house of its own, stepped together on all cores.

    They agree with N single environments bit by bit: ``reset(seed=s)`` is theirs with the seeds s to s + N - 1, and a
    list gives each its own. ``options`` may hold ``plan_id`` and ``pose`` as for one of them, one for all or a list of
    N (None: at random), and ``reset_mask`` (N,) of those to reset.

    What happens at an episode's end is ``autoreset_mode``'s to say:

    - NEXT_STEP (the default): the next step ignores the action, resets, and returns reward 0.
    - SAME_STEP: the environment is reset at once; ``info["final_obs"]`` and ``info["final_info"]`` hold the end.
    - DISABLED: ``reset(options={"reset_mask": ...})`` is the caller's; a step without it raises ResetNeeded.

    ``info`` holds an array for each key and, as ``_key``, which environments it speaks of.

    A copy or a pickle goes on from the same step. Several threads may call: each call waits for the one before it.

    Parameters
    ----------
    num_envs
        N.
    copy
        Return copies of the observations; False: views of the maps, which the next step overwrites.
    threads
        How many share the work; None: as many as there are cores. The outcome is the same.
    """

    def __init__(
        self,
        task: Task,
        dataset: Plans,
        config: SimulatorConfig | str | None = None,
        *,
        num_envs: int = 1,
        actions: Actions = "discrete",
        observation: Kind = "map",
        planning: PlanningConfig | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        copy: bool = True,
        threads: int | None = None,
        render_mode: str | None = None,
        **more: Unpack[EnvOptions],
    ) -> None:
        Locked.__init__(self)
        self._mode = checked_vector(num_envs, threads, autoreset_mode, render_mode)
        self.metadata = {**PseudoSlamEnv.metadata, "autoreset_mode": self._mode}
        check_options(type(self), more)
        self._env_spec = make_env_spec(task, dataset, config, actions, observation, planning=planning, **more)
        self._choice = self._env_spec.choice
        self.task, self.config, self.render_mode = task, self._env_spec.config, render_mode
        self.num_envs, self._copy = num_envs, copy
        self.single_action_space = self._env_spec.action_space()
        self.single_observation_space = self._env_spec.observation_space()
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._params, self._scratch = self._env_spec.params(), self._env_spec.scratch()
        self._pictures = self._env_spec.pictures(num_envs)
        self._batch = Batch(num_envs, self.config, self._params, threads)
        self._rngs: dict[int, np.random.Generator] = {}
        self._plan_ids = np.full(num_envs, None, object)
        self._simulators: dict[int, Simulator] = {}
        self._ended = np.ones(num_envs, bool)
        self._begun = np.zeros(num_envs, bool)
        self._are_begun = False
        self._everywhere, self._all = np.ones(num_envs, bool), np.full(num_envs, STEP, np.uint8)
        self._constants = new_constants(num_envs)
        self._after: Metrics

    @one_at_a_time
    def reset(self, *, seed: Seeds = None, options: dict[str, Any] | None = None) -> tuple[Observation, dict[str, Any]]:
        """Start episodes in all environments, or in those of ``options["reset_mask"]``."""
        seeds = seeds_of(seed, self.num_envs)
        which, plan_ids, poses = options_for(options, self.num_envs)
        if which.all() and any(one is not None for one in seeds):
            self._choice.start_over()
        self._are_begun, self._begun = False, self._begun & ~which  # where a start fails, none of them is half begun
        for i in np.flatnonzero(which).tolist():
            if seeds[i] is not None or i not in self._rngs:
                self._rngs[i] = seeding.np_random(seeds[i])[0]
            self._start_episode(i, plan_ids[i], poses[i])
        self._look_round(which, REDRAW)
        self._begun |= which
        infos = self._infos(self._after, self.task.success(self._after), which)
        return self._observations(self._after), infos

    @one_at_a_time
    def step(self, actions: npt.NDArray[Any]) -> tuple[Observation, Floats, Bools, Bools, dict[str, Any]]:
        """Take one action in each environment; actions (N,) or (N, 2)."""
        if not self._are_begun or (self._mode == AutoresetMode.DISABLED and np.count_nonzero(self._ended)):
            ready = self._begun & ~self._ended if self._mode == AutoresetMode.DISABLED else self._begun
            self._need(ready)
            self._are_begun = True
        motions, ahead = self._env_spec.motions(actions, self.num_envs)
        starting = self._ended.nonzero()[0].tolist()  # in NEXT_STEP, or where a start has failed
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
        if self._mode == AutoresetMode.SAME_STEP and np.count_nonzero(self._ended):
            final, ended = self._finals(after, success), self._ended
            for i in ended.nonzero()[0].tolist():
                self._start_episode(i)
            self._look_round(ended, SKIP)
            success = self.task.success(self._after)
        infos = self._infos(self._after, success, self._everywhere) | final
        return self._observations(self._after), rewards, terminated, truncated, infos

    @one_at_a_time
    def state(self, i: int) -> State:
        """Return environment ``i``'s episode: its arrays are views, which the next step changes.

        Its ``view`` is the observation of the last step: the same memory, also where that is the caller's own.
        """
        self._need(self._begun, i)
        return self._batch.state(i)

    @one_at_a_time
    def render(self) -> list[npt.NDArray[np.uint8] | None] | None:  # type: ignore[override]  # a picture or none
        """Return a picture of each environment, as ``PseudoSlamEnv.render`` does, all of ``PICTURE_PX``, as films want.

        None without a render mode.
        """
        if self.render_mode is None:
            return None
        self._need(self._begun)
        from houseexpo.pseudoslam.render.picture import framed, picture

        drawn = (picture(self._simulators[i], self.state(i), most_px=PICTURE_PX) for i in range(self.num_envs))
        return [framed(image, PICTURE_PX) for image in drawn]

    @one_at_a_time
    def action_masks(self, i: int | None = None) -> Bools:
        """Return (N, K) which frontiers there are to choose from, or (K,) those of one environment."""
        self._need(self._begun, i)
        masks = self._env_spec.masks(self._batch.arrays)
        return masks if i is None else masks[i]

    def _need(self, ready: Bools, i: int | None = None) -> None:
        """Raise ResetNeeded where environment ``i`` is not ready; None: where any is not."""
        if not np.all(ready if i is None else ready[i]):
            raise gymnasium.error.ResetNeeded(f"environments {np.flatnonzero(~ready).tolist()}: call reset() first")

    def close_extras(self, **kwargs: Any) -> None:  # noqa: ARG002  # gymnasium's signature
        """End the threads."""
        self._batch.close()

    def _start_episode(self, i: int, plan_id: str | None = None, pose: Pose | None = None) -> None:
        """Put the start of an episode in place ``i``; it has not looked round yet."""
        rng = self._rngs[i]
        world = self._choice.draw(rng, plan_id)
        state = self._env_spec.initial_state(world, self._params, self._scratch, rng, own=False, pose_m=pose)
        self._batch.put(i, state)
        self._constants.rows[i], self._plan_ids[i] = constants_of(state, world), world.plan_id
        if self.render_mode is not None:  # a simulator keeps its world's rasters
            self._simulators[i] = Simulator(world, self.config, self._params, self._scratch)

    def _look_round(self, which: Bools, others: int) -> None:
        """Take the first looks of the episodes that have just begun, together; the views are new if all are shown."""
        wanted = np.where(which, STEP, others).astype(np.uint8)
        self._advance(np.zeros((self.num_envs, 2)), wanted, fresh=self._copy and others == REDRAW)
        self._after = self._metrics()
        self._ended = self._ended & ~which

    def _advance(self, motions: Floats, wanted: npt.NDArray[np.uint8], *, fresh: bool) -> None:
        """Do what is wanted, and draw what is shown of it."""
        self._batch.step(motions, wanted, fresh=fresh)
        if self._pictures:
            pool, sizes = self._batch.arrays, self._batch.sizes
            self._pictures.draw(pool, sizes, wanted, self._constants, self._batch.share, fresh=fresh)

    def _metrics(self) -> Metrics:
        return Metrics.of(self._constants, self._batch.arrays, self.config)

    def _observations(self, after: Metrics) -> Observation:
        """Return what is observed, the caller's own where he wants copies."""
        found = self._env_spec.observe(self._batch.arrays, after, self._pictures)
        if self._copy and isinstance(found, dict) and "global_map" in found:
            found["global_map"] = found["global_map"].copy()  # the view was drawn into an array of the caller's own
        return found

    def _infos(self, after: Metrics, success: Bools, which: Bools) -> dict[str, Any]:
        report = self._env_spec.report(self._batch.arrays, after, success)
        return infos_of({**report, "plan_id": self._plan_ids.copy()}, which)

    def _finals(self, after: Metrics, success: Bools) -> dict[str, Any]:
        last = last_of(self._env_spec.observe(self._batch.arrays, after, self._pictures), self._ended)
        masks = {"_final_obs": self._ended.copy(), "_final_info": self._ended.copy()}
        return {"final_obs": last, "final_info": self._infos(after, success, self._ended), **masks}


class ExplorationVectorEnv(ExplorationMixin, PseudoSlamVectorEnv):
    """``PseudoSLAM/Exploration-v0``, vectorised: see ``tasks.Exploration`` and ``PseudoSlamVectorEnv``."""


class ObstacleAvoidanceVectorEnv(ObstacleAvoidanceMixin, PseudoSlamVectorEnv):
    """``PseudoSLAM/ObstacleAvoidance-v0``, vectorised: see ``tasks.ObstacleAvoidance`` and ``PseudoSlamVectorEnv``."""


class NavigationVectorEnv(NavigationMixin, PseudoSlamVectorEnv):
    """``PseudoSLAM/Navigation-v0``, vectorised: see ``tasks.Navigation`` and ``PseudoSlamVectorEnv``."""
