"""Count finished episodes in a Stable-Baselines3 callback, and discount advantages by steps or metres if configured.

A travel to a frontier is an option in a semi-Markov decision process (Sutton, Precup and Singh, 1999): if it takes k
steps, what follows it is worth gamma ** k. Stable-Baselines3 discounts each action alike. So advantages are computed
anew here, before it learns from them.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import numpy.typing as npt
import torch
from stable_baselines3.common.callbacks import BaseCallback

from houseexpo.pseudoslam.learning.config import Clock, PPOConfig

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
