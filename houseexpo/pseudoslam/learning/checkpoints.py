"""Save and restore a run's weights, optimiser, random states and the actions of its running episodes.

R1  A file gets its name only when it is complete and on the disk.
R2  It contains tensors and numbers, but no code: weights, optimiser, the variance of returns, the states of random
    generators and of the memory, the number of steps, and the actions since all episodes were started anew. When a run
    resumes, these actions are played again (``replay_episodes``).
R3  It identifies its run. A checkpoint of another run is refused; the error names the first difference.
R4  The last two checkpoints are kept. If the last one is damaged, the one before it is used, with a warning.
"""

from __future__ import annotations

import io
import logging
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np
import numpy.typing as npt
import torch
from sb3_contrib.common.recurrent.type_aliases import RNNStates
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper, VecNormalize

from houseexpo.errors import TrainingError
from houseexpo.files import encode_json, write_atomically
from houseexpo.pseudoslam.learning.model import ActionLog, Learner
from houseexpo.pseudoslam.learning.policy_file import DAMAGED, describe_damage

FORMAT: Final = 1
KEPT_CHECKPOINTS: Final = 2
FREE: Final = ("config.steps", "config.environment.dataset")
"""What may differ in a resumed run: it may be longer, and the data set may have moved."""
_ABOUT, _STATE = "about.json", "state.pt"
_logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Checkpoint:
    """A checkpoint: its file, the description of its run, and the learner's state."""

    file: Path
    about: dict[str, Any]
    state: dict[str, Any]

    @property
    def updates(self) -> int:
        """The number of updates so far."""
        return int(self.state["updates"])


def save_checkpoint(folder: Path, learner: Learner, run: dict[str, Any], updates: int) -> Path:
    """Write a checkpoint and return its file; ``run`` describes the run (see ``check_same_run``)."""
    state = io.BytesIO()
    torch.save(_state_of(learner, updates), state)
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        archive.writestr(_ABOUT, encode_json({"format": FORMAT, "steps": learner.num_timesteps, "run": run}))
        archive.writestr(_STATE, state.getvalue())
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / f"{learner.num_timesteps:012d}.zip"
    write_atomically(file, packed.getvalue(), durable=True)  # R1
    for old in list_checkpoints(folder)[:-KEPT_CHECKPOINTS]:  # R4
        old.unlink()
    return file


def list_checkpoints(folder: Path) -> list[Path]:
    """Return the checkpoints of a run, the earliest first."""
    return sorted(folder.glob("[0-9]*.zip"))


def read_last_checkpoint(folder: Path) -> Checkpoint | None:
    """Return the last complete checkpoint, None without checkpoints; raise TrainingError if all are damaged."""
    found = list_checkpoints(folder)
    for file in reversed(found):
        try:
            return read_checkpoint(file)
        except TrainingError as error:
            _logger.warning("%s; the one before it is used", error)
    if found:
        raise TrainingError(f"{folder}: expected a whole checkpoint, found {len(found)}, all damaged; start again")
    return None


def read_checkpoint(file: Path) -> Checkpoint:
    """Return a checkpoint; raise TrainingError if it is damaged or from another version."""
    try:
        with zipfile.ZipFile(file) as archive:
            about = msgspec.json.decode(archive.read(_ABOUT), type=dict[str, Any])
            if about.get("format") != FORMAT:
                raise TrainingError(f"{file}: expected a checkpoint of format {FORMAT}, found {about.get('format')!r}")
            state = torch.load(io.BytesIO(archive.read(_STATE)), map_location="cpu", weights_only=True)  # R2
    except DAMAGED as error:
        raise TrainingError(
            f"{file}: expected a whole checkpoint, found it damaged ({describe_damage(error)})"
        ) from None
    return Checkpoint(file, about, state)


def restore_learner(learner: Learner, state: dict[str, Any], seed: int) -> None:
    """Restore the saved state of a learner and of its environments; ``seed`` is the run's."""
    learner.policy.load_state_dict(state["policy"])
    learner.policy.optimizer.load_state_dict(state["optimizer"])
    learner.num_timesteps = int(state["steps"])
    if len(actions := state.get("actions", ())):
        replay_episodes(learner, seed, int(state["begun_at"]), actions.numpy())
        if "memory" in state:
            learner._last_lstm_states = RNNStates(  # noqa: SLF001
                *(tuple(part.to(learner.device) for part in pair) for pair in state["memory"])
            )
    else:
        restart_episodes(learner, seed)
    spread = learner.get_vec_normalize_env().ret_rms
    spread.mean, spread.var, spread.count = (np.float64(value) for value in state["returns"])
    torch.set_rng_state(state["torch"])
    if torch.cuda.is_available() and state["cuda"]:
        torch.cuda.set_rng_state_all(state["cuda"])
    keys, place, has_gauss, gauss = state["numpy"]
    np.random.set_state(("MT19937", keys.numpy().astype(np.uint32), place, has_gauss, gauss))  # noqa: NPY002  # SB3's


def _state_of(learner: Learner, updates: int) -> dict[str, Any]:
    spread = learner.get_vec_normalize_env().ret_rms
    log = find_action_log(learner)
    memory = getattr(learner, "_last_lstm_states", None)
    _, keys, place, has_gauss, gauss = np.random.get_state()  # noqa: NPY002  # Stable-Baselines3 shuffles with it
    return {
        "updates": updates,
        "steps": learner.num_timesteps,
        "begun_at": log.begun_at,
        "actions": torch.from_numpy(np.stack(log.actions)) if log.actions else [],
        **({"memory": [[part.detach() for part in pair] for pair in memory]} if memory is not None else {}),
        "policy": learner.policy.state_dict(),
        "optimizer": learner.policy.optimizer.state_dict(),
        "returns": [float(value) for value in (spread.mean, spread.var, spread.count)],
        "torch": torch.get_rng_state(),
        "cuda": torch.cuda.get_rng_state_all() if torch.cuda.is_available() else [],
        "numpy": [torch.from_numpy(np.asarray(keys).astype(np.int64)), int(place), int(has_gauss), float(gauss)],
    }


# A checkpoint cannot hold environments, since it has no code in it. The seeds and the actions are enough: an
# environment's next state depends on nothing else. So a run can be saved at any update, and goes on with the same bits,
# also in the middle of episodes.


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
    learner._last_obs = envs.reset()  # noqa: SLF001  # as the learner does before its first step
    for each in actions:
        learner._last_obs, _, learner._last_episode_starts, _ = envs.step(each)  # noqa: SLF001


def _first_seed(seed: int, steps: int) -> int:
    return int(np.random.SeedSequence([seed, steps]).generate_state(1)[0])
