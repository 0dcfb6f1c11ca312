"""Go to a place in a known house among people: wait for who is in the way, keep away from them, or give way as learned.

R1  The house is the map at the start, in which the cells of people who are in sight are free.
R2  People are expected where they are, and where they will be after ``_AHEAD_S`` if they go on as they do.
R3  A robot that has waited for ``_PATIENCE_S`` takes the shortest way round them that touches none, until it has gone a
    step; if there is none, it waits again.

A robot that gives way does so by measures that are learned (``Measures``):

G1  It goes straight to the corners of the shortest way. If it has to turn by more than a step allows, but by no more
    than ``swing_rad``, it goes while it turns.
G2  A person is expected anywhere on the way of the next ``ahead_s``. It takes a step, or else half of one, that keeps a
    gap of ``stop_m`` or does not make the gap smaller. Otherwise it waits.
G3  Waiting makes the gaps of these rules smaller, down to 0.1 m: after ``calm_s`` they are half as large.
G4  After ``patience_s`` it takes a way that keeps ``round_m`` from the people in sight, if this way is at most
    ``extra_m`` longer, or more by a fifth for each second of waiting. It keeps to it for ``persist_s``.
G5  After ``retreat_s`` it makes room every other second: it goes forward or backward, where the gap is then widest.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.files import read_json
from houseexpo.pseudoslam.agents.explorers import GoalWalker
from houseexpo.pseudoslam.agents.protocol import Interface, Knowledge, Robot, Training, check_goal
from houseexpo.pseudoslam.agents.simple import FORWARD, LEFT, RIGHT
from houseexpo.pseudoslam.config.simulator import PlanningConfig
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE, UNKNOWN
from houseexpo.pseudoslam.kernels.planning.paths import find_distances, free_distance_by_map, next_motion, trace_path
from houseexpo.pseudoslam.kernels.planning.planner_types import GOING, STRAIGHT
from houseexpo.pseudoslam.kernels.types import PathScratch, new_path_scratch
from houseexpo.pseudoslam.planning import planner_rules

Floats = npt.NDArray[np.float64]
Grid = npt.NDArray[np.uint8]
_MOTIONS: Final = {FORWARD: (1.0, 0.0), LEFT: (0.0, 1.0), RIGHT: (0.0, -1.0), None: (0.0, 0.0)}
_AHEAD_S: Final = 1.0
_PATIENCE_S: Final = 5.0
_GAPS_M: Final = (1.2, 0.45)
"""The gaps that are kept if a way leads there, the widest first: Hall's personal and intimate distance (1966)."""
_LEAST_GAP_M: Final = 0.1
"""The gap that a robot keeps that goes round a person at last: cells of the map are 0.04 m wide (R3)."""
_CONTACT_M: Final = 0.12
"""The gap below which a robot that gives way goes no closer: within 0.1 m of a person it is stopped."""
_ROOM_M: Final = 0.15
"""The least gap at a place at which it makes room (G5)."""
_FORGOTTEN: Final = 4
"""How many steps of waiting are forgotten with each step on the way."""
_SWUNG: Final = 0.8
"""The share of a step that it goes while it turns (G1)."""
_SAFE: Final = 0.7
"""The share of the gap of a way round that its first step has to keep (G4)."""
_MORE_A_SECOND: Final = 0.2
"""By what share a way round may be longer for each second of waiting (G4)."""


class Waiting:
    """A policy that follows the shortest way, and waits while its next step would lead within 0.45 m of a person."""

    interface = Interface(actions="continuous", tasks=("navigation",))

    def __init__(self, robot: Robot, _: int) -> None:
        _check_task(robot)
        config = robot.config
        self._walker, self._metre = GoalWalker(robot), config.pixels_per_metre
        self._radius_px, self._step_px = config.robot.radius_m * self._metre, config.robot.step_m * self._metre
        self._patience = round(_PATIENCE_S / config.step_s)
        self._waited, self._path_m, self._detours = 0, 0.0, False
        self._house: Grid = np.zeros((0, 0), np.uint8)

    def __call__(self, _: Any, info: Knowledge) -> Floats:
        """Return the action (linear, angular)."""
        if not self._house.size:
            self._house = _house_at_start(info)
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


class Measures(msgspec.Struct, frozen=True):
    """How a robot gives way (G1 to G5); metres, seconds and radians. Learning starts at these values."""

    stop_m: float = 0.2
    ahead_s: float = 0.4
    patience_s: float = 4.0
    round_m: float = 0.3
    extra_m: float = 1.0
    swing_rad: float = 0.4
    persist_s: float = 4.0
    calm_s: float = 5.0
    retreat_s: float = 30.0


class StraightWalker:
    """A robot that goes to the corners of the shortest way to a place, with exact turns."""

    def __init__(self, robot: Robot) -> None:
        travel = planner_rules(robot.config, PlanningConfig()).travel
        self._travel = travel._replace(aim_cells=2**30)  # all: where nothing is in between, the way is a straight line
        self._ways: PathScratch = new_path_scratch(0)
        self._cells, self._at = 0, 0

    def aim(self, known: Grid, pose: Floats, goal: Floats) -> float:
        """Find the shortest way from a pose to a goal (x, y); return its length, infinite without one, pixels."""
        if len(self._ways.ways) < known.size:
            self._ways = new_path_scratch(known.size)
        find_distances(known, pose[0], pose[1], self._travel.radius_px, -1, self._ways)
        cell = int(goal[1]) * known.shape[1] + int(goal[0])
        self._cells, self._at = trace_path(self._ways, cell, self._ways.queue[0]), 0
        return float(self._ways.ways[cell]) / STRAIGHT if self._cells else math.inf

    def next(self, known: Grid, x: float, y: float, heading: float) -> tuple[float, float] | None:
        """Return the next turn and distance, radians and pixels; None if there is none."""
        if not self._cells:
            return None
        turn, way, self._at, outcome = next_motion(
            known, x, y, heading, self._ways, self._cells, self._at, -1, self._travel
        )
        return (turn, way) if outcome == GOING else None


class GivingWay:
    """A policy that goes straight, turns while it goes, and gives way to people (G1 to G5)."""

    interface = Waiting.interface

    def __init__(self, robot: Robot, _: int, measures: Measures | None = None) -> None:
        _check_task(robot)
        self._by, self._walker, config = measures or Measures(), StraightWalker(robot), robot.config
        self._descent = GoalWalker(robot)
        self._metre, self._step_s = config.pixels_per_metre, config.step_s
        self._radius_px, self._step_px = config.robot.radius_m * self._metre, config.robot.step_m * self._metre
        self._turn_rad = math.radians(config.robot.turn_deg)
        self._house: Grid = np.zeros((0, 0), np.uint8)
        self._waited, self._path_m, self._until, self._makes_room = 0, -1.0, -1, False

    def __call__(self, _: Any, info: Knowledge) -> Floats:
        """Return the action (linear, angular)."""
        pose, people = info["pose_px"], _moving(info)
        if not self._house.size:
            self._house = _house_at_start(info)
            self._walker.aim(self._house, pose, info["goal_px"])
            self._descent.aim(self._house, *info["goal_px"].tolist())
        if info["path_m"] > self._path_m:
            self._path_m = info["path_m"]
            if not self._makes_room:
                self._waited = max(self._waited - _FORGOTTEN, 0)
        self._makes_room = False
        if info["steps"] == self._until:
            self._walker.aim(self._house, pose, info["goal_px"])
        motion = self._plan_motion(pose)
        if motion is None:
            self._walker.aim(self._house, pose, info["goal_px"])
            motion = self._plan_motion(pose)
        turn, way = motion or self._descend(pose)
        for each in (way, way / 2.0):  # G2
            if self._keeps_gap(people, pose, turn, each, self._shrink(self._by.stop_m)):
                return self._to_action(turn, each)
        self._waited += 1
        waited_s = self._waited * self._step_s
        if waited_s > self._by.retreat_s and self._waited % 4 < 2 and (room := self._find_room(people, pose)):  # G5
            self._makes_room = True
            self._walker.aim(self._house, pose, info["goal_px"])
            return self._to_action(*room)
        if waited_s > self._by.patience_s and len(people):  # G4
            turn, way = self._go_round(people, info, waited_s) or (turn, 0.0)
            if self._keeps_gap(people, pose, turn, way, _SAFE * self._shrink(self._by.round_m)):
                return self._to_action(turn, way)
        return self._to_action(turn, 0.0)

    def _plan_motion(self, pose: Floats) -> tuple[float, float] | None:
        """Return the next turn and distance on the way, without regard to people; None if there is none."""
        x, y, heading = pose.tolist()
        motion = self._walker.next(self._house, x, y, heading)
        if motion is None or motion[1] > 0.0:
            return motion
        left = 0.0
        after: tuple[float, float] | None = motion
        while after is not None and after[1] == 0.0 and left <= self._by.swing_rad:
            heading += after[0]
            after = self._walker.next(self._house, x, y, heading)
            left += abs(after[0]) if after else 0.0
        if left > self._by.swing_rad:
            return motion
        course, most = float(pose[2]) + motion[0], _SWUNG * self._step_px
        way = free_distance_by_map(self._house, x, y, math.cos(course), -math.sin(course), most, self._radius_px)
        return motion[0], way if way >= 0.5 * self._step_px else 0.0  # G1

    def _descend(self, pose: Floats) -> tuple[float, float]:
        """Return a turn and a distance where no straight line leads on: beside a corner, after it made room."""
        action = self._descent.next(self._house, pose)
        if action is None:
            return self._find_free_step(pose)
        linear, angular = _MOTIONS[action]
        return angular * self._turn_rad, linear * self._step_px

    def _find_free_step(self, pose: Floats) -> tuple[float, float]:
        """Return the longest step, forward or backward, that walls allow, or a turn: it stands too near to a wall."""
        best = self._turn_rad, 0.0
        for motion, _ in self._free_steps(pose, (1.0, -1.0), self._step_px / 2.0):
            if abs(motion[1]) > abs(best[1]):
                best = motion
        return best

    def _free_steps(
        self, pose: Floats, ahead_or_back: tuple[float, float], most_px: float
    ) -> Iterator[tuple[tuple[float, float], tuple[float, float]]]:
        """Yield turns and distances (negative: backward) that walls allow, and the places they lead to, pixels."""
        x, y, heading = pose.tolist()
        for turn in (0.0, self._turn_rad, -self._turn_rad):
            for ahead in ahead_or_back:
                right, down = ahead * math.cos(heading + turn), -ahead * math.sin(heading + turn)
                way = free_distance_by_map(self._house, x, y, right, down, most_px, self._radius_px)
                yield (turn, ahead * way), (x + way * right, y + way * down)

    def _shrink(self, gap_m: float) -> float:
        """Return the gap that is kept now in place of a gap at first, metres (G3)."""
        return max(gap_m / (1.0 + self._waited * self._step_s / self._by.calm_s), _LEAST_GAP_M)

    def _keeps_gap(self, people: Floats, pose: Floats, turn: float, way: float, gap_m: float) -> bool:
        """Return whether a step keeps a gap from people, or does not make it smaller (G2)."""
        if way == 0.0 or not len(people):
            return True
        x, y, course = float(pose[0]), float(pose[1]), float(pose[2]) + turn
        to_x, to_y = x + way * math.cos(course), y - way * math.sin(course)
        now, then = self._gap_m(people, x, y, 0.0), self._gap_m(people, to_x, to_y, 0.0)
        if then < min(now, _CONTACT_M):
            return False
        ahead = self._by.ahead_s
        return self._gap_m(people, to_x, to_y, ahead) >= min(gap_m, self._gap_m(people, x, y, ahead))

    def _gap_m(self, people: Floats, x: float, y: float, ahead_s: float) -> float:
        """Return the smallest gap between the robot at a place and people, now and until then, metres."""
        found = math.inf
        for time in (0.0, ahead_s / 2.0, ahead_s):
            at = people[:, :2] + time * people[:, 3:]
            found = min(found, float((np.hypot(at[:, 0] - x, at[:, 1] - y) - people[:, 2]).min()))
        return (found - self._radius_px) / self._metre

    def _go_round(self, people: Floats, info: Knowledge, waited_s: float) -> tuple[float, float] | None:
        """Take a way round people if it is short enough, and return its first motion."""
        direct = self._walker.aim(self._house, info["pose_px"], info["goal_px"])
        free = self._house.copy()
        for x, y, radius, _, _ in people.tolist():
            free[_disc(free.shape, x, y, radius + self._shrink(self._by.round_m) * self._metre)] = OBSTACLE
        way = self._walker.aim(free, info["pose_px"], info["goal_px"])
        if way > direct + self._by.extra_m * (1.0 + _MORE_A_SECOND * waited_s) * self._metre:
            self._walker.aim(self._house, info["pose_px"], info["goal_px"])
            return None
        self._until = info["steps"] + max(int(self._by.persist_s / self._step_s), 1)
        return self._plan_motion(info["pose_px"])

    def _find_room(self, people: Floats, pose: Floats) -> tuple[float, float] | None:
        """Return the turn and the distance, negative for backward, to the widest gap that a step leads to (G5)."""
        best: tuple[float, tuple[float, float] | None] = _ROOM_M, None
        for motion, place in self._free_steps(pose, (-1.0, 1.0), self._step_px):
            gap_m = self._gap_m(people, *place, 0.0) if len(people) else 0.0
            if abs(motion[1]) >= 0.5 * self._step_px and gap_m > best[0]:
                best = gap_m, motion
        return best[1]

    def _to_action(self, turn: float, way: float) -> Floats:
        return np.clip([way / self._step_px, turn / self._turn_rad], -1.0, 1.0)


class GivingWayFactory:
    """A factory of policies that give way by the measures of a file."""

    interface = GivingWay.interface

    def __init__(self, file: Path) -> None:
        self.file = file

    def __call__(self, robot: Robot, seed: int) -> GivingWay:
        """Return the policy for an episode."""
        return GivingWay(robot, seed, self._learned.measures)

    @property
    def training(self) -> Training:
        """The family of the measures, and the seed of their training."""
        return Training(str(self._learned.about["family"]), int(self._learned.about["seed"]))

    @cached_property
    def _learned(self) -> LearnedMeasures:
        return read_json(self.file, LearnedMeasures)


class LearnedMeasures(msgspec.Struct, frozen=True):
    """The contents of a file of measures: how they were learned, and what they are."""

    about: dict[str, Any]
    measures: Measures


give_way_0, give_way_1, give_way_2 = (
    GivingWayFactory(Path(__file__).with_name(f"give-way-{seed}.json")) for seed in range(3)
)


def _check_task(robot: Robot) -> None:
    check_goal(robot, place=True)
    if not robot.config.known_map:
        raise ConfigError("policy: expected a task in a known house (known_map), found an unknown one")


def _house_at_start(info: Knowledge) -> Grid:
    """Return the map at the start without the people in sight (R1)."""
    house: Grid = np.where(info["map"] == UNKNOWN, FREE, info["map"])
    for x, y, radius, _, _ in _moving(info).tolist():
        house[_disc(house.shape, x, y, radius + 1.0)] = FREE
    house[[0, -1]] = house[:, [0, -1]] = OBSTACLE
    return house


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
