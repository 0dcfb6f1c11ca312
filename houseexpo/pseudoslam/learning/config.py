"""Hold the configuration of training, which is read from a TOML file; missing keys have their defaults.

An example, in which missing keys have their defaults::

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

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

from houseexpo.configuration import check_above_zero, check_number, check_one_of, check_whole_number, config_to_mapping
from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config.robot import Motion

Network = Literal["cnn", "cnn-lstm", "set"]
Moves = Literal["discrete", "continuous", "frontier"]
Clock = Literal["actions", "steps", "metres"]
Sight = Literal["map", "dict", "scales"]
Precision = Literal["float32", "bfloat16"]
MAX_SEED = 2**32 - 1
_LATER = (("ppo", "discount"), ("ppo", "precision"), ("environment", "motion"), ("environment", "action_mask"))


@dataclass(frozen=True)
class PPOConfig:
    """Proximal policy optimisation (Schulman et al., 2017).

    Parameters
    ----------
    learning_rate
        Learning rate of Adam, which is constant.
    rollout_steps
        Number of steps of each environment between two updates.
    minibatch, epochs
        Number of steps in a minibatch, and number of passes over all steps in an update.
    gamma, gae_lambda
        Discount factor, and lambda of generalised advantage estimation.
    discount
        What ``gamma`` discounts: each of the "actions", as usual; each of the "steps" that an action takes, so that a
        long travel costs time (options in a semi-Markov decision process: Sutton, Precup and Singh, 1999); or each of
        the "metres" that it covers.
    clip
        Clipping range of the ratio of probabilities in an update.
    entropy, value
        Weights of the entropy and of the value error in the loss.
    max_grad_norm
        Largest norm of gradients; longer ones are scaled down.
    normalise_rewards
        Whether to divide rewards by the standard deviation of the returns so far. Reports contain original rewards.
    precision
        The numbers in which convolutions are computed while a policy learns. "bfloat16" takes about half the time, on a
        processor that multiplies such numbers (AVX-512 BF16 or AMX) and on GPUs. Weights are of "float32" in any case,
        and a trained policy is played in "float32".
    """

    learning_rate: float = 2.5e-4
    rollout_steps: int = 128
    minibatch: int = 512
    epochs: int = 4
    gamma: float = 0.99
    gae_lambda: float = 0.95
    discount: Clock = "actions"
    clip: float = 0.2
    entropy: float = 0.01
    value: float = 0.5
    max_grad_norm: float = 0.5
    normalise_rewards: bool = True
    precision: Precision = "float32"

    def __post_init__(self) -> None:
        check_above_zero(self, "ppo", "learning_rate", at_most=1.0)
        check_above_zero(self, "ppo", "clip", "max_grad_norm")
        for name in ("rollout_steps", "minibatch"):  # the deviation of advantages needs two
            check_whole_number(getattr(self, name), f"ppo.{name}", at_least=2)
        check_whole_number(self.epochs, "ppo.epochs", at_least=1)
        check_one_of(self.discount, "ppo.discount", get_args(Clock))
        check_one_of(self.precision, "ppo.precision", get_args(Precision))
        for name in ("gamma", "gae_lambda"):
            check_number(getattr(self, name), f"ppo.{name}", at_least=0.0, at_most=1.0)
        for name in ("entropy", "value"):
            check_number(getattr(self, name), f"ppo.{name}", at_least=0.0)


@dataclass(frozen=True)
class EnvironmentConfig:
    """The environments of training.

    Parameters
    ----------
    dataset
        A folder, an archive or JSON lines. None means the data set that ``houseexpo fetch`` downloaded or, for obstacle
        avoidance, the paper's room.
    train, test
        The data set's lists of plans for training and for evaluation, which must not have common plans.
    actions, observation, preset
        Arguments of the environments; a preset is a named configuration.
    motion
        How the robot moves; None for what ``simulator`` says. A drive takes continuous actions.
    action_mask
        Whether the policy "cnn" never chooses a motion on which the robot would meet an obstacle of its map.
    simulator
        Changes to the preset or, without one, to the task's ``SimulatorConfig``: its keys, nested.
    task
        Options of the task: ``reward``, ``success_coverage``, ...
    """

    dataset: str | None = None
    train: str = "train"
    test: str = "test"
    actions: Moves = "discrete"
    observation: Sight = "map"
    preset: str | None = None
    motion: Motion | None = None
    action_mask: bool = False
    simulator: Mapping[str, Any] = field(default_factory=dict)
    task: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_one_of(self.actions, "environment.actions", get_args(Moves))
        check_one_of(self.observation, "environment.observation", get_args(Sight))
        if self.motion is not None:
            check_one_of(self.motion, "environment.motion", get_args(Motion))
        if not isinstance(self.action_mask, bool):
            raise ConfigError(f"environment.action_mask: expected true or false, found {self.action_mask!r}")
        if self.motion not in {None, "discrete"} and self.actions != "continuous":
            raise ConfigError(
                f"environment.actions: expected continuous for the motion {self.motion!r}, found {self.actions!r}"
            )
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
    """The evaluation of the policy during training.

    Parameters
    ----------
    every
        Number of steps between evaluations, rounded up to whole updates; there is another one at the end.
    plans
        Number of plans of the test list, with one episode each; they are the same in all evaluations. If there is only
        one room, this is the number of episodes in it.
    deterministic
        Whether to take the most likely action instead of a random one.
    """

    every: int = 100_000
    plans: int = 100
    deterministic: bool = False

    def __post_init__(self) -> None:
        check_whole_number(self.every, "evaluation.every", at_least=1)
        check_whole_number(self.plans, "evaluation.plans", at_least=1)


@dataclass(frozen=True)
class TrainConfig:
    """The configuration of a training run.

    Parameters
    ----------
    steps
        Number of steps of all environments together, rounded up to whole updates.
    envs
        Number of parallel environments.
    seed
        The seed of weights, episodes and actions.
    policy
        "cnn"; "cnn-lstm", which adds a memory, as in the paper; or "set", for frontiers: one small network rates each
        of them, and also sees the mean and the maximum over all of them.
    memory
        Size of the memory.
    checkpoint_every
        Number of steps after which all environments start new episodes and a checkpoint is written, rounded up to whole
        updates. Checkpoints are also written after each evaluation and every 5 minutes, in the middle of episodes.
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
            check_whole_number(getattr(self, name), name, at_least=1)
        check_whole_number(self.seed, "seed", at_least=0, at_most=MAX_SEED)
        check_one_of(self.policy, "policy", get_args(Network))
        actions, clock = self.environment.actions, self.ppo.discount
        if (self.policy == "set") != (actions == "frontier"):
            raise ConfigError(
                f'policy: expected "set" with environment.actions = "frontier", and only there; found '
                f"{self.policy!r} with {actions!r}"
            )
        if self.ppo.precision != "float32" and self.policy == "set":
            raise ConfigError(
                f'ppo.precision: expected "float32" with policy = "set", which has no convolutions, found '
                f"{self.ppo.precision!r}"
            )
        if self.environment.action_mask and (actions != "discrete" or self.policy != "cnn"):
            raise ConfigError(
                'environment.action_mask: expected policy = "cnn" and environment.actions = "discrete", found '
                f"{self.policy!r} and {actions!r}"
            )
        if clock != "actions" and actions != "frontier":
            raise ConfigError(
                f'ppo.discount: expected "actions", since {clock} are counted for frontier actions; found {clock!r} '
                f"with {actions!r}"
            )

    @property
    def steps_per_update(self) -> int:
        """Number of steps of all environments together between two updates."""
        return self.envs * self.ppo.rollout_steps

    def updates(self, steps: int) -> int:
        """Return the number of updates for a number of steps, rounded up."""
        return -(-steps // self.steps_per_update)

    def record(self) -> dict[str, Any]:
        """Return plain values from which ``config_from_mapping`` makes the same configuration.

        Keys that came after the first policies (``_LATER``) are in it only where they differ from their defaults. So
        the records of two trainings are equal if the trainings are, whichever version made them.
        """
        record: dict[str, Any] = config_to_mapping(self)
        for part, name in _LATER:
            if record[part][name] == getattr(type(getattr(self, part)), name):
                del record[part][name]
        return record


def _words(value: object, key: str) -> None:
    if not isinstance(value, str) or not value:
        raise ConfigError(f"{key}: expected a name, found {value!r}")
