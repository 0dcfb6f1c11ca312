"""Policies trained by ``houseexpo train``, from files with the suffix ``.pt``."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import msgspec

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.agents.protocol import Interface, Policy, Robot, Training
from houseexpo.pseudoslam.learning.needs import need_learn
from houseexpo.pseudoslam.learning.places import simulator_of


class Learned:
    """A factory of policies with the weights of a file, each with its own memory and random generator.

    Observations and actions are those of its training. The sensor and the map's resolution are those of the new
    environment: a policy is refused if its view would have another number of pixels, and otherwise has to cope.
    """

    def __init__(self, file: Path) -> None:
        need_learn(str(file))
        import torch

        from houseexpo.pseudoslam.learning.policy_file import read_policy

        torch.set_num_threads(1)  # one decision is too little work to share, and episodes run in their own processes
        self._file, self._trained = file, read_policy(file)
        place, task = self._trained.config.environment, self._trained.task
        view = simulator_of(task, place).observation
        self.interface = Interface(place.actions, place.observation, view, tasks=(task,))
        self.training = Training(_family(self._trained.about), self._trained.config.seed)

    def __call__(self, robot: Robot, seed: int) -> Policy:
        """Return the policy for an episode; raise ConfigError if observations or actions differ from its training."""
        from houseexpo.pseudoslam.learning.policy_file import Actor

        policy = self._trained.policy
        for what, found, wanted in (
            ("observation", robot.observation_space, policy.observation_space),
            ("action", robot.action_space, policy.action_space),
        ):
            if found is not None and found != wanted:
                raise ConfigError(
                    f"{self._file}: expected the {what} that it was learned with, {wanted}, found {found}"
                )
        return Actor(self._trained, seed)


def _family(about: dict[str, Any]) -> str:
    """Return a name for all policies that differ only in the seed: PPO, the network, a hash of the training."""
    config = {key: value for key, value in about["config"].items() if key not in {"seed", "evaluation"}}
    place = {key: value for key, value in config["environment"].items() if key != "dataset"}  # its path may differ
    alike = msgspec.json.encode([about["task"], {**config, "environment": place}, about["lists"]], order="sorted")
    return f"PPO {config['policy']} {hashlib.sha256(alike).hexdigest()[:6]}"
