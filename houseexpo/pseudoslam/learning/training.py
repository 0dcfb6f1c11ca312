"""Train a policy in a run: update, evaluate on held-out plans, write checkpoints, resume, and write ``policy.pt``.

1. A run is defined by its task, its configuration and its lists of plans; a folder contains one run.
2. After every ``checkpoint_every`` steps, all environments start new episodes with seeds that depend on the run's seed
   and the number of steps. A checkpoint is written there, after each evaluation, and when ``KEEP_S`` have passed since
   the last one. A run that is killed and resumed ends with the same weights as an uninterrupted one.
3. A weight that is not a finite number ends the run; earlier files are kept.
4. ``policy.pt`` is written last; if it exists, the run is finished.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
import numpy.typing as npt
import torch
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger, TensorBoardOutputFormat

from houseexpo.errors import TrainingError
from houseexpo.progress import show_progress
from houseexpo.pseudoslam.envs.vector import PseudoSlamVectorEnv
from houseexpo.pseudoslam.learning import checkpoints
from houseexpo.pseudoslam.learning.config import Clock, PPOConfig, TrainConfig
from houseexpo.pseudoslam.learning.environments import RunPlans, make_environments
from houseexpo.pseudoslam.learning.model import Learner, Policy, new_learner, wrap_for_learner
from houseexpo.pseudoslam.learning.records import CurveFile, begin_run, check_same_run, find_commit, find_versions
from houseexpo.pseudoslam.learning.torch_network import write_policy
from houseexpo.words import count_noun

POLICY: Final = "policy.pt"
CHECKPOINTS: Final = "checkpoints"
KEEP_S: Final = 300.0
"""Seconds after which a checkpoint is due: what a kill costs at most."""
_LIBRARIES: Final = ("torch", "stable-baselines3", "sb3-contrib", "gymnasium", "numpy")


@dataclass(frozen=True)
class TrainingRun:
    """A training run: its task, its configuration, its plans, and its folder."""

    task: str
    config: TrainConfig
    plans: RunPlans
    folder: Path

    def record(self) -> dict[str, Any]:
        """Return what distinguishes this run from others."""
        return {"task": self.task, "config": self.config.record(), "lists": self.plans.record()}


def train(
    run: TrainingRun, *, resume: bool = False, threads: int | None = None, say: Callable[[str], None] = lambda _: None
) -> Score:
    """Train a policy to the end and return the score of the last evaluation.

    Parameters
    ----------
    resume
        Whether to continue from the last complete checkpoint of the folder, or from the start if there is none.
    threads
        Number of threads of PyTorch and of the environments. None for one of PyTorch, whose threads wait for each other
        in busy loops, and one per core of the environments.
    say
        A function that is called with a line after each evaluation.

    Raises
    ------
    TrainingError
        The folder holds another run, or a run and ``resume`` is False; all of its checkpoints are damaged; or training
        has diverged.
    """
    torch.set_num_threads(threads or 1)
    begun = _checkpoint_to_resume(run, resume=resume)
    config, plans = run.config, run.plans
    shared = run.task, config.environment, plans.source
    envs = make_environments(*shared, number=config.envs, plan_ids=plans.train, threads=threads)
    tests = make_environments(*shared, number=min(config.envs, config.evaluation.plans), threads=threads)
    try:
        learner = new_learner(wrap_for_learner(envs, config), config)
        if begun:
            checkpoints.restore_learner(learner, begun.state, config.seed)
            say(f"continues from {begun.file}")
        else:
            if resume:
                say("begins anew, since the run has no checkpoint yet")
            checkpoints.restart_episodes(learner, config.seed)
        return _Training(run, learner, tests, say).go_on(begun.updates if begun else 0)
    finally:
        envs.close()
        tests.close()


class _Training:
    """A learner in training."""

    def __init__(self, run: TrainingRun, learner: Learner, tests: Any, say: Callable[[str], None]) -> None:
        self._run, self._learner, self._tests, self._say = run, learner, tests, say
        done = learner.num_timesteps
        self._learning = CurveFile(run.folder / "learning.csv", done)
        self._tested = CurveFile(run.folder / "evaluation.csv", done)
        learner.set_logger(Logger(None, [TensorBoardOutputFormat(str(run.folder / "tensorboard"))]))

    def go_on(self, done: int) -> Score:
        """Make the remaining updates."""
        config, learner = self._run.config, self._learner
        total = config.updates(config.steps)
        test_every, keep_every = config.updates(config.evaluation.every), config.updates(config.checkpoint_every)
        score: Score = {}
        self._say(
            f"learns in {count_noun(total - done, 'update')} of {config.steps_per_update:,} steps; evaluates "
            f"{count_noun(config.evaluation.plans, 'episode')} after every {test_every * config.steps_per_update:,} "
            f"steps and at the end; on {_title(learner.device)}"
        )
        if config.policy == "set" and not done:
            self._say(f"nearest frontier in these episodes: {_text(self._score(NearestFrontierBaseline()))}")
        saved_at = start = time.monotonic()
        for update in show_progress(range(done + 1, total + 1), f"learning {self._run.task}", total - done):
            steps, means = self._update(update)
            self._learning.add(steps, means)
            if update == done + 1:
                speed = config.steps_per_update / (time.monotonic() - start)
                self._say(
                    f"{steps:,} of {config.steps:,} steps: {means['reward']:.3g} a step, {speed:,.0f} steps a second"
                )
            is_test, is_restart = (update % every == 0 or update == total for every in (test_every, keep_every))
            if is_test:
                score = self._test()
            if is_restart:
                checkpoints.restart_episodes(learner, config.seed)  # R2
            if is_test or is_restart or time.monotonic() - saved_at >= KEEP_S:
                checkpoints.save_checkpoint(self._run.folder / CHECKPOINTS, learner, self._run.record(), update)
                saved_at = time.monotonic()
        learner.logger.close()
        score = score or self._score()  # finished, except for the last file
        write_policy(
            self._run.folder / POLICY, learner.policy, {**describe_policy(self._run, learner), "score": score}
        )  # R4
        return score

    def _update(self, update: int) -> tuple[int, dict[str, float]]:
        """Collect steps and learn from them; return the number of steps and the means of finished episodes."""
        learner, episodes = self._learner, CollectionCallback(self._run.config.ppo)
        try:
            learner.learn(self._run.config.steps_per_update, callback=episodes, reset_num_timesteps=False)
        except ValueError as error:  # a distribution of values that are not finite
            check_finite(learner, update, self._run.config)
            raise TrainingError(f"update {update}, after {learner.num_timesteps:,} steps: {error}") from error
        check_finite(learner, update, self._run.config)
        return learner.num_timesteps, episodes.means()

    def _test(self) -> Score:
        """Evaluate the policy, and add the score to the curve and the log."""
        steps, score = self._learner.num_timesteps, self._score()
        self._tested.add(steps, score)
        for name, value in score.items():
            self._learner.logger.record(f"test/{name}", value)
        self._learner.logger.dump(steps)
        self._say(f"{steps:,} of {self._run.config.steps:,} steps: {_text(score)}")
        return score

    def _score(self, policy: NearestFrontierBaseline | None = None) -> Score:
        """Return the score of a policy, by default of the learning policy."""
        ids, config = self._run.plans.test, self._run.config.evaluation
        tried = policy or self._learner.policy
        return evaluate(tried, self._tests, ids, config.plans, deterministic=config.deterministic)


def _title(device: torch.device) -> str:
    if device.type == "cuda":
        return f"the GPU, {torch.cuda.get_device_name(device)}"
    return f"the CPU, by {count_noun(torch.get_num_threads(), 'thread')} of PyTorch"


def _text(score: Score) -> str:
    return ", ".join(f"{name} {value:.3g}" for name, value in score.items())


def check_finite(learner: Learner, update: int, config: TrainConfig) -> None:
    """Raise TrainingError if a weight is not a finite number (R3)."""
    for name, weight in learner.policy.named_parameters():
        if not torch.isfinite(weight).all():
            raise TrainingError(
                f"update {update}, after {learner.num_timesteps:,} steps: expected finite weights, found NaN or "
                f"infinity in the policy's {name!r}; take a smaller learning rate than ppo.learning_rate = "
                f"{config.ppo.learning_rate:g}, or continue from the last checkpoint with --resume"
            )


def describe_policy(run: TrainingRun, learner: Learner) -> dict[str, Any]:
    """Return the description of a policy: its run, and the versions of the code."""
    return {
        **run.record(),
        "seed": run.config.seed,
        "steps": learner.num_timesteps,
        "commit": find_commit(),
        "versions": find_versions(_LIBRARIES),
        "device": str(learner.device),
    }


def _checkpoint_to_resume(run: TrainingRun, *, resume: bool) -> checkpoints.Checkpoint | None:
    """Return the checkpoint to resume from, if any; for a new run, write its description to the folder."""
    found = checkpoints.read_last_checkpoint(run.folder / CHECKPOINTS) if resume else None
    if found:
        check_same_run(found.about["run"], run.record(), found.file, checkpoints.FREE)
    begin_run(run.folder, run.record(), resume=resume, holds=[CHECKPOINTS], free=checkpoints.FREE)
    return found


# Run a policy for one episode in each plan that is not used in training, and return its mean scores.


MEASURES: Final = ("coverage", "explored_m2", "collisions", "is_success", "way_m", "spl")
"""Measures in the info at the end of an episode; each task has some of them."""

Score = dict[str, float]
_WAY: Final = 2  # of a frontier's numbers in an observation: the length of the path to it


class NearestFrontierBaseline:
    """Goes to the frontier with the shortest path, in the same episodes as a policy that learns to choose."""

    training = False

    def set_training_mode(self, mode: bool) -> None:
        """Do nothing, since it does not learn."""

    def predict(self, observation: Any, *_: object, **__: object) -> tuple[npt.NDArray[np.int64], None]:
        """Return the number of the frontier in each environment (N,), and no memory."""
        ways = np.where(observation["action_mask"] == 0, np.inf, observation["frontiers"][:, :, _WAY])
        return ways.argmin(axis=1), None


Tried: TypeAlias = Policy | NearestFrontierBaseline


def evaluate(
    policy: Tried, envs: PseudoSlamVectorEnv, plan_ids: tuple[str, ...] | None, episodes: int, *, deterministic: bool
) -> Score:
    """Return the means of ``score_episodes`` over a number of episodes."""
    rows = score_episodes(policy, envs, plan_ids, episodes, deterministic=deterministic)
    return {name: float(np.mean([row[name] for row in rows])) for name in rows[0]}


def score_episodes(
    policy: Tried, envs: PseudoSlamVectorEnv, plan_ids: tuple[str, ...] | None, episodes: int, *, deterministic: bool
) -> list[Score]:
    """Return the scores of a number of episodes: ``return``, ``steps``, and the task's ``MEASURES``.

    1. Episode i starts with seed i, in plan i if there are ids, so that policies are compared in the same episodes.
    2. Actions use a separate random state, so that evaluation does not affect training.
    """
    plans: list[str | None] = [None] * episodes if plan_ids is None else list(plan_ids[:episodes])
    rows: list[Score] = []
    was_training = policy.training
    policy.set_training_mode(False)
    with torch.random.fork_rng(devices=range(torch.cuda.device_count())):  # 2
        torch.manual_seed(0)
        for first in range(0, len(plans), envs.num_envs):
            wanted = plans[first : first + envs.num_envs]
            spare = [wanted[0]] * (envs.num_envs - len(wanted))
            seeds = [first + i for i in range(envs.num_envs)]  # 1
            found = list(_episodes(policy, envs, seeds, [*wanted, *spare], deterministic=deterministic))
            rows += found[: len(wanted)]
    policy.set_training_mode(was_training)
    return rows


def _episodes(
    policy: Tried, envs: PseudoSlamVectorEnv, seeds: list[int], plans: list[str | None], *, deterministic: bool
) -> Iterator[Score]:
    """Yield the score of an episode in each of the environments."""
    observation, _ = envs.reset(seed=seeds, options={"plan_id": plans})
    number = envs.num_envs
    returns, lengths = np.zeros(number), np.zeros(number)
    ends: dict[int, dict[str, Any]] = {}
    state, starts = None, np.ones(number, bool)
    while len(ends) < number:
        actions, state = policy.predict(observation, state, starts, deterministic=deterministic)
        observation, rewards, terminated, truncated, infos = envs.step(actions)
        starts = terminated | truncated
        steps = infos.get("primitive_steps", np.ones(number)).astype(float)
        if starts.any() and "primitive_steps" in infos:  # those of the last action, not of the new episode
            steps[starts] = infos["final_info"]["primitive_steps"][starts]
        running = np.array([i not in ends for i in range(number)])
        returns += rewards * running
        lengths += steps * running
        for i in np.flatnonzero(starts & running).tolist():
            ends[i] = {name: infos["final_info"][name][i] for name in MEASURES if name in infos["final_info"]}
    for i in range(number):
        yield {
            "return": float(returns[i]),
            "steps": float(lengths[i]),
            **{name: float(value) for name, value in ends[i].items()},
        }


# Count finished episodes in a Stable-Baselines3 callback, and discount advantages by steps or metres if configured.
#
# A travel to a frontier is an option in a semi-Markov decision process (Sutton, Precup and Singh, 1999): if it takes k
# steps, what follows it is worth gamma ** k. Stable-Baselines3 discounts each action alike. So advantages are computed
# anew here, before it learns from them.


Floats = npt.NDArray[np.float32]
_TIMES: Final[dict[Clock, str]] = {"steps": "primitive_steps", "metres": "travelled_m"}
"""The entries of ``info`` that say how long an action took."""


class CollectionCallback(BaseCallback):  # type: ignore[misc]  # it comes without types where it is not installed
    """Counts the episodes that end while steps are collected, and discounts by ``PPOConfig.discount``."""

    def __init__(self, ppo: PPOConfig) -> None:
        super().__init__()
        self._ppo, self._clock = ppo, _TIMES.get(ppo.discount)
        self._ended: list[dict[str, float]] = []
        self._rewards: list[float] = []
        self._discounts: list[Floats] = []

    def means(self) -> dict[str, float]:
        """Return the mean reward of an action, the number of finished episodes, and their mean return and length."""
        found = {"reward": float(np.mean(self._rewards)), "episodes": float(len(self._ended))}
        for name, key in (("return", "r"), ("steps", "l")):
            found[name] = float(np.mean([one[key] for one in self._ended])) if self._ended else float("nan")
        return found

    def _on_step(self) -> bool:
        infos: list[dict[str, Any]] = self.locals["infos"]
        self._rewards.append(float(self.model.get_vec_normalize_env().get_original_reward().mean()))
        self._ended += [info["episode"] for info in infos if "episode" in info]
        if self._clock:
            times = np.array([info[self._clock] for info in infos], np.float32)
            self._discounts.append(np.float32(self._ppo.gamma) ** times)
            self._add_values_after_time_limits(infos)
        return True

    def _add_values_after_time_limits(self, infos: list[dict[str, Any]]) -> None:
        """Do what Stable-Baselines3 does next, but with the discount of the action's time."""
        for i, info in enumerate(infos):
            if info.get("TimeLimit.truncated") and info.get("terminal_observation") is not None:
                seen, _ = self.model.policy.obs_to_tensor(info["terminal_observation"])
                with torch.no_grad():
                    value = float(self.model.policy.predict_values(seen)[0])
                self.locals["rewards"][i] += self._discounts[-1][i] * value
                info["TimeLimit.truncated"] = False

    def _on_rollout_end(self) -> None:
        if self._clock:
            buffer, local = self.locals["rollout_buffer"], self.locals
            values = np.concatenate([buffer.values, local["values"].cpu().numpy().reshape(1, -1)])
            starts = np.concatenate([buffer.episode_starts, local["dones"].reshape(1, -1)])
            buffer.advantages[:] = estimate_advantages(
                buffer.rewards, values, starts, np.stack(self._discounts), self._ppo.gae_lambda
            )
            buffer.returns = buffer.advantages + buffer.values
            self._discounts.clear()


def estimate_advantages(
    rewards: Floats, values: Floats, starts: Floats, discounts: Floats, gae_lambda: float
) -> Floats:
    """Return generalised advantage estimates (Schulman et al., 2016) with a discount for each action.

    Parameters
    ----------
    rewards, discounts
        (T, N): of T actions in N environments.
    values, starts
        (T + 1, N): the value before each action and after the last one; 1 where an episode begins, else 0.

    Returns
    -------
    (T, N) float32.
    """
    found = np.zeros_like(rewards)
    after = np.zeros_like(rewards[0])
    for t in reversed(range(len(rewards))):
        ahead = discounts[t] * (1.0 - starts[t + 1])
        after = rewards[t] + ahead * values[t + 1] - values[t] + ahead * gae_lambda * after
        found[t] = after
    return found
