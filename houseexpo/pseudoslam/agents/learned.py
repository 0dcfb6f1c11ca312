"""Load trained policies: networks of ``houseexpo train`` (``.pt`` and ``.onnx`` files), and choosers (``.json`` files).

A chooser's score is a weighted sum of the numbers of ``kernels.planning.frontier_features``; everything else is like
the other explorers. The weights that come with the project were trained by ``houseexpo train chooser`` with three
seeds; the policy ``chooser`` has the first of them.
"""

from __future__ import annotations

import hashlib
import math
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.agents.explorers import Explorer, Grid
from houseexpo.pseudoslam.agents.protocol import Interface, Knowledge, Policy, Robot, Training
from houseexpo.pseudoslam.config.simulator import PlanningConfig
from houseexpo.pseudoslam.kernels.explore import (
    FORWARD,
    LEFT,
    RIGHT,
    find_unseen_in_sight,
    look_at_target,
    new_memory,
)
from houseexpo.pseudoslam.kernels.planning.frontier_features import (
    FEATURES,
    LOOKED_AT,
    compute_features,
    score_frontiers,
)
from houseexpo.pseudoslam.kernels.planning.paths import next_motion, trace_path
from houseexpo.pseudoslam.kernels.planning.planner_types import ARRIVED, GOING
from houseexpo.pseudoslam.kernels.tolerances import LOOK_ROUND_M, MAX_FRONTIERS, TURN_PARTS
from houseexpo.pseudoslam.kernels.types import Floats, Rows
from houseexpo.pseudoslam.learning.environments import make_simulator_config
from houseexpo.pseudoslam.learning.policy_file import EpisodeActor, read_policy
from houseexpo.pseudoslam.learning.weights import read_weights
from houseexpo.pseudoslam.planning import feature_rules, planner_rules


class NetworkFactory:
    """A factory of policies with the weights of a file, each with its own memory and random generator.

    Observations and actions are those of its training. The sensor and the map's resolution are those of the new
    environment: a policy is refused if its view would have another number of pixels, and otherwise has to cope.
    """

    def __init__(self, file: Path) -> None:
        self._file, self._trained = file, read_policy(file)
        place, task = self._trained.config.environment, self._trained.task
        view = make_simulator_config(task, place).observation
        self.interface = Interface(place.actions, place.observation, view, tasks=(task,), action_mask=place.action_mask)
        self.training = Training(_family(self._trained.about), self._trained.config.seed)

    def __call__(self, robot: Robot, seed: int) -> Policy:
        """Return the policy for an episode; raise ConfigError if observations or actions differ from its training."""
        trained = self._trained
        for what, found, wanted in (
            ("observation", robot.observation_space, trained.observation_space),
            ("action", robot.action_space, trained.action_space),
        ):
            if found is not None and found != wanted:
                raise ConfigError(f"{self._file}: expected the {what} space of its training, {wanted}, found {found}")
        return EpisodeActor(trained, seed)


def _family(about: dict[str, Any]) -> str:
    """Return a name for all policies that differ only in the seed: PPO, the network, a hash of the training."""
    config = {key: value for key, value in about["config"].items() if key not in {"seed", "evaluation"}}
    place = {key: value for key, value in config["environment"].items() if key != "dataset"}  # its path may differ
    alike = msgspec.json.encode([about["task"], {**config, "environment": place}, about["lists"]], order="sorted")
    return f"PPO {config['policy']} {hashlib.sha256(alike).hexdigest()[:6]}"


FAMILY: Final = "chooser"


class FrontierChooser(Explorer):
    """An explorer that goes to the frontier with the highest score."""

    def __init__(self, robot: Robot, seed: int, weights: Floats) -> None:
        super().__init__(robot, seed)
        self._weights = weights
        self._outlook = feature_rules(robot.config)
        self._outlooks, self._scores = np.zeros((LOOKED_AT, len(FEATURES))), np.zeros(LOOKED_AT)

    def choose(self, known: Grid, frontiers: Rows, info: Knowledge) -> int:
        """Return the best of the frontiers that ``find_frontiers`` ranks first."""
        x, y, heading = info["pose_px"].tolist()
        n = compute_features(
            known, x, y, heading, info["steps"], frontiers, len(frontiers), self._outlook,
            self.scratch.ways, self._outlooks,
        )  # fmt: skip
        return int(score_frontiers(self._outlooks, n, self._weights, self._scores))


class LookAround(FrontierChooser):
    """A chooser that looks round before it goes on, since turns cost no metres (R5 of ``kernels.explore``)."""

    def __init__(self, robot: Robot, seed: int, weights: Floats) -> None:
        super().__init__(robot, seed, weights)
        self._half_fov_rad = math.radians(robot.config.laser.fov_deg) / 2
        self._turn_rad = math.radians(robot.config.robot.turn_deg)
        self._came_rad: float | None = None
        """The heading at which the robot came to where it is; its choices depend on this one."""
        self._turns = self._leftmost = self._rightmost = 0
        """The turns since then, to the left."""

    def act(self, info: Knowledge) -> int | None:
        """Return the next turn to something unknown in sight, otherwise what the chooser does."""
        if self._came_rad is None:
            self._came_rad = float(info["pose_px"][2])
        action = self._look(info)
        if action is None:
            action = super().act(info)
        if action == FORWARD:
            self._came_rad = float(info["pose_px"][2])
            self._turns = self._leftmost = self._rightmost = 0
        elif action is not None:
            self._turns += 1 if action == LEFT else -1
            self._leftmost = max(self._leftmost, self._turns)
            self._rightmost = min(self._rightmost, self._turns)
        return action

    def _look(self, info: Knowledge) -> int | None:
        """Return a turn to something unknown in sight, None if there is too little, or a step is planned."""
        state = self._memory.state[0]
        if state.looks > 0 or state.turns != 0 or state.goes != 0 or self._came_rad is None:
            return None
        self.decided = False
        x, y, heading = info["pose_px"].tolist()
        right = self._came_rad - self._half_fov_rad + self._rightmost * self._turn_rad
        left = self._came_rad + self._half_fov_rad + self._leftmost * self._turn_rad
        if left - right >= 2 * math.pi:
            return None
        cells, to_left, to_right = find_unseen_in_sight(
            info["map"], x, y, heading, self._half_fov_rad, self.range_px, (right, left), self.scratch
        )
        if cells < LOOK_ROUND_M * self.metre:
            return None
        return LEFT if to_left <= to_right else RIGHT

    def choose(self, known: Grid, frontiers: Rows, info: Knowledge) -> int:
        """Return the chooser's choice at the heading at which the robot came here."""
        x, y, _ = info["pose_px"].tolist()
        return super().choose(known, frontiers, {**info, "pose_px": np.array([x, y, self._came_rad])})


class Swift(FrontierChooser):
    """A chooser that turns while it goes, since turns cost steps (R6 of ``kernels.explore``)."""

    interface = Interface(actions="continuous", tasks=("exploration",))
    parts = TURN_PARTS


class Straight(LookAround):
    """A robot that looks round after each step, chooses anew, and goes straight to the corners of the shortest way.

    Its turns are exact (T1 and T2 of ``kernels.planning.paths``), and a step may end at a corner. Where it touches an
    obstacle and no line along the way leads on, it goes a step down the distances to its goal, as other explorers do.
    """

    interface = Interface(actions="continuous", tasks=("exploration",))

    def __init__(self, robot: Robot, seed: int, weights: Floats) -> None:
        super().__init__(robot, seed, weights)
        self._memory = new_memory(0, MAX_FRONTIERS)  # it looks round before its first step, too
        travel = planner_rules(robot.config, PlanningConfig()).travel
        self._travel = travel._replace(aim_cells=2**30)  # all: where nothing is in between, the way is a straight line
        self._chosen, self._descends = 0, False
        """The frontier of its target, and whether ``scratch.ways`` are the distances to that frontier's goal."""
        self._moved, self._motion = False, np.zeros(2)
        """Whether its last action was a step; the step's distance and turn, as shares of the largest."""

    def __call__(self, _observation: Any, info: Knowledge) -> Floats | None:
        """Return the next action, or None when there is nothing left to see."""
        action = self.act(info)
        if action == FORWARD:
            self._came_rad = float(info["pose_px"][2]) + float(self._motion[1]) * self._turn_rad
            return self._motion
        return None if action is None else np.array([0.0, 1.0 if action == LEFT else -1.0])

    def _must_choose(self, known: Grid) -> bool:
        """Return whether to choose again: where it has gone a step, and where its target is known."""
        return super()._must_choose(known) or self._moved

    def _set_target(self, known: Grid, x: float, y: float, chosen: int) -> None:
        """Make one of the memory's frontiers the target; the distances stay those from the robot."""
        del known, x, y
        state, frontier = self._memory.state[0], self._memory.frontiers[chosen]
        state.bumps = state.bumps if state.target == frontier.middle else 0
        state.target, self._chosen, self._descends = frontier.middle, chosen, False
        self._cells = trace_path(self.scratch.ways, frontier.goal, self.scratch.ways.queue[0])

    def _next_action(self, known: Grid, x: float, y: float, heading: float) -> int:
        """Return a step on the way or a turn before it; at its end, a turn to the target."""
        ways, travel = self.scratch.ways, self._travel
        if not self._descends:
            turn, way, _, outcome = next_motion(known, x, y, heading, ways, self._cells, 0, -1, travel)
            self._moved = outcome == GOING and way > 0.0
            if self._moved:
                self._motion = np.array([way / travel.step_px, turn / self._turn_rad])
                return FORWARD
            if outcome == GOING:
                return LEFT if turn > 0.0 else RIGHT
            if outcome == ARRIVED:
                return look_at_target(known, x, y, heading, self._memory, self._turn_rad)
            bumps = int(self._memory.state[0].bumps)
            super()._set_target(known, x, y, self._chosen)
            self._memory.state[0].bumps, self._descends = bumps, True
        action = super()._next_action(known, x, y, heading)
        if action == FORWARD:
            self._moved, self._motion = True, np.array([1.0, 0.0])
        return action


class ChooserFactory:
    """A factory of choosers with the weights of a file."""

    def __init__(self, file: Path, kind: type[FrontierChooser] = FrontierChooser, family: str = "") -> None:
        self.file, self._kind, self._family, self.interface = file, kind, family, kind.interface

    def __call__(self, robot: Robot, seed: int) -> Policy:
        """Return the explorer for an episode."""
        return self._kind(robot, seed, self._weights_and_notes[0])

    @property
    def training(self) -> Training:
        """The family of the weights, and the seed of their training."""
        about = self._weights_and_notes[1]
        return Training(self._family or str(about.get("family", FAMILY)), int(about.get("seed", 0)))

    @cached_property
    def _weights_and_notes(self) -> tuple[Floats, dict[str, Any]]:
        return read_weights(self.file)


def chooser_weights_path(seed: int) -> Path:
    """Return the path of the project's weights that were trained with a seed."""
    return Path(__file__).with_name(f"{FAMILY}-{seed}.json")


chooser_0, chooser_1, chooser_2 = (ChooserFactory(chooser_weights_path(seed)) for seed in range(3))
finisher = ChooserFactory(Path(__file__).with_name("finisher.json"))
"""Searched by ``research.finisher_training`` for short ways to 90% and to 99%."""
look_around = ChooserFactory(Path(__file__).with_name("look-around.json"), LookAround)
"""Searched by the same script for a robot that sees all round."""
swift = ChooserFactory(chooser_0.file, Swift, "swift")
straight = ChooserFactory(look_around.file, Straight, "straight")
