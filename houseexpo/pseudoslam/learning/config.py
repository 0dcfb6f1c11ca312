"""What is learned, and how: a TOML file's keys, with their defaults.

An example, in which all that is left out keeps its default::

    steps = 2_000_000
    policy = "cnn-lstm"

    [ppo]
    learning_rate = 2.5e-4

    [environment]
    dataset = "plans/demo"
    preset = "view-10m"
    task = { reward = "coverage" }
    simulator = { max_steps = 200 }
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, TypeVar, get_args

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config.checks import above_zero, number, one_of, whole
from houseexpo.pseudoslam.config.mapping import config_from, mapping_from

Config = TypeVar("Config")
Network = Literal["cnn", "cnn-lstm"]
Moves = Literal["discrete", "continuous", "waypoint"]
Sight = Literal["map", "dict", "scales"]
MAX_SEED = 2**32 - 1


@dataclass(frozen=True)
class PPOConfig:
    """Proximal policy optimisation (Schulman et al., 2017).

    Parameters
    ----------
    learning_rate
        Of Adam; it stays the same.
    rollout_steps
        Steps of each environment between two updates.
    minibatch, epochs
        Steps in a minibatch, and how often an update goes through all of them.
    gamma, gae_lambda
        Discount, and the mixture of generalised advantages.
    clip
        How far a probability may move in an update, as a share.
    entropy, value
        Weights of the entropy and of the value's error in the loss.
    max_grad_norm
        Longer gradients are shortened to this.
    normalise_rewards
        Divide rewards by the spread of returns so far. What is reported are the rewards as they are.
    """

    learning_rate: float = 2.5e-4
    rollout_steps: int = 128
    minibatch: int = 512
    epochs: int = 4
    gamma: float = 0.99
    gae_lambda: float = 0.95
    clip: float = 0.2
    entropy: float = 0.01
    value: float = 0.5
    max_grad_norm: float = 0.5
    normalise_rewards: bool = True

    def __post_init__(self) -> None:
        above_zero(self, "ppo", "learning_rate", at_most=1.0)
        above_zero(self, "ppo", "clip", "max_grad_norm")
        for name in ("rollout_steps", "minibatch"):  # an advantage's spread needs two
            whole(getattr(self, name), f"ppo.{name}", at_least=2)
        whole(self.epochs, "ppo.epochs", at_least=1)
        for name in ("gamma", "gae_lambda"):
            number(getattr(self, name), f"ppo.{name}", at_least=0.0, at_most=1.0)
        for name in ("entropy", "value"):
            number(getattr(self, name), f"ppo.{name}", at_least=0.0)


@dataclass(frozen=True)
class EnvironmentConfig:
    """Where is learned.

    Parameters
    ----------
    dataset
        Folder, archive or JSON lines; None: the one that ``houseexpo fetch`` brought, and for obstacle avoidance the
        paper's room.
    train, test
        The data set's lists of plans to learn in and to be tested in; they may not share a plan.
    actions, observation, preset
        As the environments take them; a preset is a configuration by name.
    simulator
        What differs from the preset, or else from the task's own ``SimulatorConfig``: its keys, nested.
    task
        The task's own options: ``reward``, ``success_coverage``, ...
    """

    dataset: str | None = None
    train: str = "train"
    test: str = "test"
    actions: Moves = "discrete"
    observation: Sight = "map"
    preset: str | None = None
    simulator: Mapping[str, Any] = field(default_factory=dict)
    task: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        one_of(self.actions, "environment.actions", get_args(Moves))
        one_of(self.observation, "environment.observation", get_args(Sight))
        for name in ("dataset", "preset"):
            if getattr(self, name) is not None:
                _words(getattr(self, name), f"environment.{name}")
        for name in ("train", "test"):
            _words(getattr(self, name), f"environment.{name}")
        for name in ("simulator", "task"):
            if not isinstance(getattr(self, name), Mapping):
                raise ConfigError(f"environment.{name}: expected a table, found {getattr(self, name)!r}")


@dataclass(frozen=True)
class EvaluationConfig:
    """How what was learned is tested on the way.

    Parameters
    ----------
    every
        Steps from one test to the next, rounded up to whole updates; one more is made at the end.
    plans
        Plans of the test list that are taken, the same in all tests, an episode each; where there is one room only, as
        many episodes in it.
    deterministic
        Take the likeliest action, not one by chance.
    """

    every: int = 100_000
    plans: int = 100
    deterministic: bool = False

    def __post_init__(self) -> None:
        whole(self.every, "evaluation.every", at_least=1)
        whole(self.plans, "evaluation.plans", at_least=1)


@dataclass(frozen=True)
class TrainConfig:
    """A whole run.

    Parameters
    ----------
    steps
        Of all environments together, rounded up to whole updates.
    envs
        Environments side by side.
    seed
        Decides weights, episodes and actions.
    policy
        "cnn", or "cnn-lstm": with a memory behind it, as in the paper.
    memory
        Size of that memory.
    checkpoint_every
        Steps from one checkpoint to the next, rounded up to whole updates. All environments begin new episodes there.
    """

    steps: int = 1_000_000
    envs: int = 16
    seed: int = 0
    policy: Network = "cnn-lstm"
    memory: int = 128
    checkpoint_every: int = 50_000
    ppo: PPOConfig = field(default_factory=PPOConfig)
    environment: EnvironmentConfig = field(default_factory=EnvironmentConfig)
    evaluation: EvaluationConfig = field(default_factory=EvaluationConfig)

    def __post_init__(self) -> None:
        for name in ("steps", "envs", "memory", "checkpoint_every"):
            whole(getattr(self, name), name, at_least=1)
        whole(self.seed, "seed", at_least=0, at_most=MAX_SEED)
        one_of(self.policy, "policy", get_args(Network))

    @property
    def steps_per_update(self) -> int:
        """Steps of all environments together between two updates."""
        return self.envs * self.ppo.rollout_steps

    def updates(self, steps: int) -> int:
        """Return how many updates so many steps are, rounded up."""
        return -(-steps // self.steps_per_update)

    def record(self) -> dict[str, Any]:
        """Return plain values, which ``config_from`` makes the same configuration of."""
        record: dict[str, Any] = mapping_from(self)
        return record


def read_config(file: Path) -> TrainConfig:
    """Return the configuration of a TOML file; ConfigError that names the file and the key where it is none."""
    return read_toml(TrainConfig, file)


def read_toml(kind: type[Config], file: Path) -> Config:
    """Return a configuration of some kind, as ``read_config`` does."""
    try:
        return config_from(kind, tomllib.loads(file.read_text(encoding="utf-8")))
    except OSError as error:
        raise ConfigError(f"{file}: expected a TOML file, found none that can be read: {error.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{file}: expected TOML, found {error}") from None
    except ConfigError as error:
        raise ConfigError(f"{file}: {error}") from None


def _words(value: object, key: str) -> None:
    if not isinstance(value, str) or not value:
        raise ConfigError(f"{key}: expected a name, found {value!r}")
