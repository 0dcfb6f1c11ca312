"""What ``houseexpo train`` has learned, as a policy: ``policy.pt``, read by its suffix."""

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
    """A factory of policies with the weights of a file, each with a memory and a chance of its own.

    It sees and acts as it learned to. The sensor and the map's resolution are those of where it is put: it is refused
    where its view would have another number of pixels, and has to cope where it would not.
    """

    def __init__(self, file: Path) -> None:
        need_learn(str(file))
        import torch

        from houseexpo.pseudoslam.learning.policy_file import read_policy

        torch.set_num_threads(1)  # one decision is too little to share, and episodes run in processes of their own
        self._file, self._trained = file, read_policy(file)
        place, task = self._trained.config.environment, self._trained.task
        view = simulator_of(task, place).observation
        self.interface = Interface(place.actions, place.observation, view, tasks=(task,))
        self.training = Training(_family(self._trained.about), self._trained.config.seed)

    def __call__(self, robot: Robot, seed: int) -> Policy:
        """Return the policy of an episode; ConfigError where it would see, or act, otherwise than it has learned to."""
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
    """Return a name that policies share which differ by the seed only: PPO, the network, a hash of how they learned."""
    config = {key: value for key, value in about["config"].items() if key not in {"seed", "evaluation"}}
    place = {key: value for key, value in config["environment"].items() if key != "dataset"}  # it may have moved
    alike = msgspec.json.encode([about["task"], {**config, "environment": place}, about["lists"]], order="sorted")
    return f"PPO {config['policy']} {hashlib.sha256(alike).hexdigest()[:6]}"
