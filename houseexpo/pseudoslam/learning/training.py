"""A run: learn, test on held-out plans, keep checkpoints, go on.

1. A run belongs to its task, its configuration and its lists of plans; a folder holds one run.
2. Between two checkpoints the environments go on; at each of them all begin new episodes, by seeds that the run's seed
   and the steps done decide. So a run that was killed and goes on ends with the same weights as one that was not.
3. A policy with a weight that is no finite number ends the run; what was kept before stays.
4. ``policy.pt`` is written last: where it is, the run is done.
"""

from __future__ import annotations

import platform
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np
import torch
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger, TensorBoardOutputFormat
from stable_baselines3.common.vec_env import VecNormalize

import houseexpo
from houseexpo.errors import TrainingError
from houseexpo.files import as_json, make_folder, write_whole
from houseexpo.outputs import check_run_folder
from houseexpo.progress import watched
from houseexpo.pseudoslam.learning import checkpoints
from houseexpo.pseudoslam.learning.commits import commit
from houseexpo.pseudoslam.learning.config import TrainConfig
from houseexpo.pseudoslam.learning.curves import Curve
from houseexpo.pseudoslam.learning.evaluation import Score, evaluate
from houseexpo.pseudoslam.learning.model import Learner, new_learner, wrapped
from houseexpo.pseudoslam.learning.places import Places, environments
from houseexpo.pseudoslam.learning.policy_file import write_policy
from houseexpo.workers import cores

POLICY: Final = "policy.pt"
CHECKPOINTS: Final = "checkpoints"
_LIBRARIES: Final = ("torch", "stable-baselines3", "sb3-contrib", "gymnasium", "numpy")


@dataclass(frozen=True)
class Run:
    """What is learned, where, and in which folder it is kept."""

    task: str
    config: TrainConfig
    places: Places
    folder: Path

    def record(self) -> dict[str, Any]:
        """Return what tells this run from others."""
        return {"task": self.task, "config": self.config.record(), "lists": self.places.record()}


def train(
    run: Run, *, resume: bool = False, threads: int | None = None, say: Callable[[str], None] = lambda _: None
) -> Score:
    """Learn to the end; return the last test's score.

    Parameters
    ----------
    resume
        Go on from the last whole checkpoint of the folder; from the beginning where there is none.
    threads
        Of PyTorch and of the environments; None: as many as there are cores.
    say
        What takes a line after each test.

    Raises
    ------
    TrainingError
        The folder holds another run, or one and it is not to be resumed; its checkpoints are all damaged; or the
        policy broke.
    """
    torch.set_num_threads(threads or cores())
    begun = _begun(run, resume=resume)
    config, places = run.config, run.places
    shared = run.task, config.environment, places.plans
    envs = environments(*shared, number=config.envs, plan_ids=places.train, threads=threads)
    tests = environments(*shared, number=min(config.envs, config.evaluation.plans), threads=threads)
    try:
        learner = new_learner(wrapped(envs, config), config)
        if begun:
            checkpoints.restore(learner, begun.state)
            say(f"goes on from {begun.file}")
        return _Training(run, learner, tests, say).go_on(begun.updates if begun else 0)
    finally:
        envs.close()
        tests.close()


class _Training:
    """A learner at work."""

    def __init__(self, run: Run, learner: Learner, tests: Any, say: Callable[[str], None]) -> None:
        self._run, self._learner, self._tests, self._say = run, learner, tests, say
        done = learner.num_timesteps
        self._learning = Curve(run.folder / "learning.csv", done)
        self._tested = Curve(run.folder / "evaluation.csv", done)
        learner.set_logger(Logger(None, [TensorBoardOutputFormat(str(run.folder / "tensorboard"))]))

    def go_on(self, done: int) -> Score:
        """Make the updates that are left."""
        config, learner = self._run.config, self._learner
        total = config.updates(config.steps)
        test_every, keep_every = config.updates(config.evaluation.every), config.updates(config.checkpoint_every)
        score: Score = {}
        begin_anew(learner, config.seed)
        for update in watched(range(done + 1, total + 1), f"learning {self._run.task}", total - done):
            self._learning.add(*self._update(update))
            if update % test_every == 0 or update == total:
                score = self._test()
            if update % keep_every == 0 or update == total:
                checkpoints.save(self._run.folder / CHECKPOINTS, learner, self._run.record(), update)
                begin_anew(learner, config.seed)  # R2
        learner.logger.close()
        score = score or self._score()  # it was done, but not to the last file
        write_policy(self._run.folder / POLICY, learner.policy, {**about(self._run, learner), "score": score})  # R4
        return score

    def _update(self, update: int) -> tuple[int, dict[str, float]]:
        """Collect steps and learn of them; return the steps done and what came of the episodes that ended."""
        learner, episodes = self._learner, _Episodes()
        try:
            learner.learn(self._run.config.steps_per_update, callback=episodes, reset_num_timesteps=False)
        except ValueError as error:  # a distribution that cannot be made of what is no number
            check_finite(learner, update, self._run.config)
            raise TrainingError(f"update {update}, after {learner.num_timesteps:,} steps: {error}") from error
        check_finite(learner, update, self._run.config)
        return learner.num_timesteps, episodes.means()

    def _test(self) -> Score:
        """Measure how good the policy is now; put it into the curve and the log."""
        steps, score = self._learner.num_timesteps, self._score()
        self._tested.add(steps, score)
        for name, value in score.items():
            self._learner.logger.record(f"test/{name}", value)
        self._learner.logger.dump(steps)
        said = ", ".join(f"{name} {value:.3g}" for name, value in score.items())
        self._say(f"{steps:,} of {self._run.config.steps:,} steps: {said}")
        return score

    def _score(self) -> Score:
        ids, config = self._run.places.test, self._run.config.evaluation
        return evaluate(self._learner.policy, self._tests, ids, config.plans, deterministic=config.deterministic)


class _Episodes(BaseCallback):  # type: ignore[misc]  # it comes without types where it is not installed
    """Counts the episodes that end while steps are collected."""

    def __init__(self) -> None:
        super().__init__()
        self._ended: list[dict[str, float]] = []

    def _on_step(self) -> bool:
        self._ended += [info["episode"] for info in self.locals["infos"] if "episode" in info]
        return True

    def means(self) -> dict[str, float]:
        """Return how many ended, and their mean return and length; those are not there where none ended."""
        found = {"episodes": float(len(self._ended))}
        for name, key in (("return", "r"), ("steps", "l")):
            found[name] = float(np.mean([one[key] for one in self._ended])) if self._ended else float("nan")
        return found


def begin_anew(learner: Learner, seed: int) -> None:
    """Have all environments begin episodes that the seed and the steps done decide (R2)."""
    envs: VecNormalize = learner.get_env()
    state = np.random.SeedSequence([seed, learner.num_timesteps]).generate_state(1)
    envs.seed(int(state[0]))
    learner.set_env(envs)  # it resets them before its next step


def check_finite(learner: Learner, update: int, config: TrainConfig) -> None:
    """TrainingError where a weight is no finite number (R3)."""
    for name, weight in learner.policy.named_parameters():
        if not torch.isfinite(weight).all():
            raise TrainingError(
                f"update {update}, after {learner.num_timesteps:,} steps: expected finite weights, found NaN or "
                f"infinity in the policy's {name!r}; take a smaller learning rate than ppo.learning_rate = "
                f"{config.ppo.learning_rate:g}, or go on from the last checkpoint with --resume where that was chance"
            )


def about(run: Run, learner: Learner) -> dict[str, Any]:
    """Return what is to be said of a policy: its run, and what made it."""
    made_by = {"houseexpo": houseexpo.__version__, "python": platform.python_version()}
    return {
        **run.record(),
        "seed": run.config.seed,
        "steps": learner.num_timesteps,
        "commit": commit(),
        "versions": {**made_by, **{name: version(name) for name in _LIBRARIES}},
        "device": str(learner.device),
    }


def _begun(run: Run, *, resume: bool) -> checkpoints.Checkpoint | None:
    """Return the checkpoint to go on from; write what the folder holds where a run begins."""
    folder = run.folder
    kept = folder / CHECKPOINTS
    record = folder / "run.json"
    if not resume and (record.exists() or checkpoints.files(kept)):
        raise TrainingError(f"{folder}: holds a run; go on with it by --resume, or name another folder")
    check_run_folder(folder, [record.name, CHECKPOINTS])
    if record.exists():
        checkpoints.check_run(msgspec.json.decode(record.read_bytes(), type=dict[str, Any]), run.record(), record)
    found = checkpoints.last_whole(kept) if resume else None
    if found:
        checkpoints.check_run(found.about["run"], run.record(), found.file)
    make_folder(folder)
    write_whole(record, as_json(run.record()))
    return found
