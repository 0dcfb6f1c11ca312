"""Start a learner's episodes anew with known seeds, log the actions since then, and play them again when a run resumes.

A checkpoint cannot hold environments: it has no code in it (``checkpoints``). The seeds and the actions are enough,
since an environment's next state depends on nothing else. So a run can be saved at any update, and goes on with the
same bits, also in the middle of episodes.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper, VecNormalize

from houseexpo.errors import TrainingError
from houseexpo.pseudoslam.learning.model import ActionLog, Learner


def find_action_log(learner: Learner) -> ActionLog:
    """Return the log of a learner's environments (``model.wrap_for_learner``)."""
    envs: VecEnv = learner.get_env()
    while isinstance(envs, VecEnvWrapper):
        if isinstance(envs, ActionLog):
            return envs
        envs = envs.venv
    raise TrainingError("the environments of this learner were made without a log of actions")


def restart_episodes(learner: Learner, seed: int) -> None:
    """Start episodes in all environments, with seeds from the run's seed and the number of steps."""
    envs: VecNormalize = learner.get_env()
    log = find_action_log(learner)
    log.begun_at, log.actions = learner.num_timesteps, []
    envs.seed(_first_seed(seed, learner.num_timesteps))
    learner.set_env(envs)  # it resets them before its next step


def replay_episodes(learner: Learner, seed: int, begun_at: int, actions: npt.NDArray[Any]) -> None:
    """Bring all environments to where they were after episodes began at a number of steps and took actions.

    Parameters
    ----------
    actions
        (T, N) or (T, N, 2): as ``ActionLog.actions``. The running statistics of returns are changed, and must be
        restored afterwards.
    """
    envs: VecNormalize = learner.get_env()
    find_action_log(learner).begun_at = begun_at
    envs.seed(_first_seed(seed, begun_at))
    learner._last_obs = envs.reset()  # noqa: SLF001  # what it does itself before its first step
    for each in actions:
        learner._last_obs, _, learner._last_episode_starts, _ = envs.step(each)  # noqa: SLF001


def _first_seed(seed: int, steps: int) -> int:
    return int(np.random.SeedSequence([seed, steps]).generate_state(1)[0])
