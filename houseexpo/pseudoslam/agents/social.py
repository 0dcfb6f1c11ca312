"""Go to a place in a known house among people: wait for those who are in the way, or keep at a distance from them.

R1  The house is the map at the start, in which the cells of people who are in sight are free.
R2  People are expected where they are, and where they will be after ``_AHEAD_S`` if they go on as they do.
R3  A robot that has waited for ``_PATIENCE_S`` takes the shortest way round them that touches none, until it has gone a
    step; if there is none, it waits again.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.agents.explorers import GoalWalker
from houseexpo.pseudoslam.agents.protocol import Interface, Knowledge, Robot, check_goal
from houseexpo.pseudoslam.agents.simple import FORWARD, LEFT, RIGHT
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE, UNKNOWN

Floats = npt.NDArray[np.float64]
Grid = npt.NDArray[np.uint8]
_MOTIONS: Final = {FORWARD: (1.0, 0.0), LEFT: (0.0, 1.0), RIGHT: (0.0, -1.0), None: (0.0, 0.0)}
_AHEAD_S: Final = 1.0
_PATIENCE_S: Final = 5.0
_GAPS_M: Final = (1.2, 0.45)
"""The gaps that are kept if a way leads there, the widest first: Hall's personal and intimate distance (1966)."""
_LEAST_GAP_M: Final = 0.1
"""The gap that a robot keeps that goes round a person at last: cells of the map are 0.04 m wide (R3)."""


class Waiting:
    """A policy that follows the shortest way, and waits while its next step would lead within 0.45 m of a person."""

    interface = Interface(actions="continuous", tasks=("navigation",))

    def __init__(self, robot: Robot, _: int) -> None:
        check_goal(robot, place=True)
        config = robot.config
        if not config.known_map:
            raise ConfigError("policy: expected a task in a known house (known_map), found an unknown one")
        self._walker, self._metre = GoalWalker(robot), config.pixels_per_metre
        self._radius_px, self._step_px = config.robot.radius_m * self._metre, config.robot.step_m * self._metre
        self._patience = round(_PATIENCE_S / config.step_s)
        self._waited, self._path_m, self._detours = 0, 0.0, False
        self._house: Grid = np.zeros((0, 0), np.uint8)

    def __call__(self, _: Any, info: Knowledge) -> Floats:
        """Return the action (linear, angular)."""
        if not self._house.size:
            self._house = np.where(info["map"] == UNKNOWN, FREE, info["map"])
            for x, y, radius, _, _ in _moving(info).tolist():
                self._house[_disc(self._house.shape, x, y, radius + 1.0)] = FREE  # R1
            self._house[[0, -1]] = self._house[:, [0, -1]] = OBSTACLE
            self._walker.aim(self._house, *info["goal_px"].tolist())
        if info["path_m"] > self._path_m:
            self._waited, self._path_m = 0, info["path_m"]
        is_patient = self._waited < self._patience
        action = self.choose(info) if is_patient else self._go_round(info, _LEAST_GAP_M)  # R3
        if action is None:
            self._waited = self._waited + 1 if is_patient else 0
        return np.array(_MOTIONS[action], np.float32)

    def choose(self, info: Knowledge) -> int | None:
        """Return the action forward, left or right, or None to wait."""
        action = self._go_straight(info)
        x, y, heading = info["pose_px"].tolist()
        if action == FORWARD:
            before = self._gap_px(info, x, y)
            x, y = x + self._step_px * np.cos(heading), y - self._step_px * np.sin(heading)
            if self._gap_px(info, x, y) < min(_GAPS_M[-1] * self._metre, before):
                return None
        return action

    def _go_straight(self, info: Knowledge) -> int | None:
        """Return the next action of the shortest way, without regard to people."""
        if self._detours:
            self._walker.aim(self._house, *info["goal_px"].tolist())
            self._detours = False
        return self._walker.next(self._house, info["pose_px"])

    def _go_round(self, info: Knowledge, gap_m: float) -> int | None:
        """Return the next action of the shortest way that keeps a gap from people in sight; None if there is none."""
        free = self._house.copy()
        for x, y, radius in _predict_people(info).tolist():
            free[_disc(free.shape, x, y, radius + gap_m * self._metre)] = OBSTACLE
        self._walker.aim(free, *info["goal_px"].tolist())
        self._detours = True
        return self._walker.next(free, info["pose_px"])

    def _gap_px(self, info: Knowledge, x: float, y: float) -> float:
        """Return the gap between the robot at a place and the nearest person (R2), pixels."""
        people = _predict_people(info)
        return (
            float((np.hypot(people[:, 0] - x, people[:, 1] - y) - people[:, 2]).min(initial=np.inf)) - self._radius_px
        )


class KeepingAway(Waiting):
    """A policy that follows the shortest way that keeps 1.2 m from people, else 0.45 m, else 0.1 m, or waits.

    Ways are planned again after each step in which people are in sight.
    """

    def choose(self, info: Knowledge) -> int | None:
        """Return the action forward, left or right, or None to wait."""
        if not len(_moving(info)):
            return self._go_straight(info)
        for gap_m in (*_GAPS_M, _LEAST_GAP_M):
            action = self._go_round(info, gap_m)
            if action is not None:
                return action
        return None


def _moving(info: Knowledge) -> Floats:
    return info.get("moving_px", np.zeros((0, 5)))


def _predict_people(info: Knowledge) -> Floats:
    """Return the places of people in sight, now and a little later (R2): (n, 3), x, y and radius in pixels."""
    moving = _moving(info)
    return np.vstack([moving[:, :3], moving[:, :3] + _AHEAD_S * np.insert(moving[:, 3:], 2, 0.0, axis=1)])


def _disc(shape: tuple[int, ...], x: float, y: float, radius: float) -> npt.NDArray[np.bool_]:
    """Return the cells (rows, cols) whose centre is in a disc."""
    rows, cols = np.ogrid[: shape[0], : shape[1]]
    found: npt.NDArray[np.bool_] = np.hypot(cols + 0.5 - x, rows + 0.5 - y) <= radius
    return found
