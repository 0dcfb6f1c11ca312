"""Choose the actions of all robots of a team by a simple rule for each task, to compare other policies with.

Robots take discrete actions. They know their own maps, where they are on them, and what the task's observation tells
them.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Any, Final

import cv2
import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.agents.explorers import GoalWalker, NearestFrontier, distances_to_cells
from houseexpo.pseudoslam.agents.protocol import Knowledge, Robot
from houseexpo.pseudoslam.kernels.mapping import FREE
from houseexpo.pseudoslam.kernels.planning.paths import find_distances
from houseexpo.pseudoslam.kernels.planning.planner_types import STRAIGHT
from houseexpo.pseudoslam.kernels.types import NO_WAY, PathScratch, new_path_scratch
from houseexpo.pseudoslam.state import State
from houseexpo.pseudoslam.teams.env import TeamEnv
from houseexpo.pseudoslam.teams.policies import NearestEach, TeamPolicy
from houseexpo.pseudoslam.teams.tasks.coverage import CoverageEpisode
from houseexpo.pseudoslam.teams.tasks.patrol import PatrolEpisode
from houseexpo.pseudoslam.teams.tasks.pursuit import PursuitEpisode
from houseexpo.pseudoslam.teams.tasks.rasters import find_standing_grid
from houseexpo.pseudoslam.teams.tasks.task import are_in_view

Floats = npt.NDArray[np.float64]
Grid = npt.NDArray[np.uint8]
_FORWARD, _LEFT, _RIGHT = range(3)
_AIM_STEPS: Final = 5
"""Steps after which a robot plans its way again, since its map changes."""
_PATIENCE_STEPS: Final = 60
"""Steps after which a robot gives up a place that it does not reach."""
_LAST: Final = 1e6
"""What is added to the actions to a place that should come after all others."""
_TRIED: Final = 12
"""The number of places that a robot leaves out since it tried them last."""


class _Legs:
    """The walk of one robot on its own map. One that was blocked turns aside at random and goes on."""

    def __init__(self, robot: Robot, seed: int) -> None:
        self._walker, self._rng = GoalWalker(robot), np.random.default_rng(seed)
        self._goal: tuple[float, float] | None = None
        self._age = 0
        self._aside: list[int] = []

    def to(self, state: State, x: float, y: float) -> int | None:
        """Return the next action on the way to a place in pixels, None if no step brings the robot nearer."""
        if state.blocked and not self._aside:
            side = _LEFT if self._rng.random() < 0.5 else _RIGHT
            self._aside = [side] * int(self._rng.integers(2, 10)) + [_FORWARD]
        if self._aside:
            self._goal = None
            return self._aside.pop(0)
        if self._goal != (x, y) or self._age >= _AIM_STEPS:
            self._walker.aim(state.known, x, y)
            self._goal, self._age = (x, y), 0
        self._age += 1
        return self._walker.next(state.known, state.believed_px)


class Baseline(ABC):
    """A policy of a team: called with the environment before each step, it returns the actions of all agents."""

    def __init__(self, env: TeamEnv, seed: int = 0) -> None:
        robot, number = Robot(env.config), len(env.possible_agents)
        self._legs = [_Legs(robot, 1000 * seed + k) for k in range(number)]
        self._explorers = [NearestFrontier(robot, seed) for _ in range(number)]
        self._ways: PathScratch = new_path_scratch(0)

    def __call__(self, env: TeamEnv) -> dict[str, int]:
        """Return an action for each robot that is in the episode; one with nothing to do turns to the left."""
        actions = {}
        for k, agent in enumerate(env.possible_agents):
            action = self.act(env, k)
            actions[agent] = _LEFT if action is None else action
        return {agent: actions[agent] for agent in env.agents}

    @abstractmethod
    def act(self, env: TeamEnv, robot: int) -> int | None:
        """Return the action of a robot, None if it has nothing to do."""

    def explore(self, env: TeamEnv, robot: int) -> int | None:
        """Return the action of a robot that goes to its nearest frontier, None if its map has none."""
        state = env.team.states[robot]
        info: Knowledge = {
            "map": state.known, "pose_px": state.believed_px, "collided": state.blocked,
            "steps": int(state.counts.steps), "path_m": 0.0,
        }  # fmt: skip
        return self._explorers[robot](None, info)

    def ways(self, env: TeamEnv, robot: int) -> Floats:
        """Return the lengths of the ways to all cells (rows * cols,), ``STRAIGHT`` a cell, ``NO_WAY`` without a way."""
        state = env.team.states[robot]
        if len(self._ways.ways) < state.known.size:
            self._ways = new_path_scratch(state.known.size)
        x, y, _ = state.believed_px.tolist()
        find_distances(state.known, x, y, env.team.radius_px, -1, self._ways)
        return distances_to_cells(self._ways, np.arange(state.known.size))


class Exploring(Baseline):
    """Nearest frontier, each robot by itself (Yamauchi, 1998)."""

    def __init__(self, env: TeamEnv, seed: int = 0) -> None:
        super().__init__(env, seed)
        self._policy = TeamPolicy(NearestEach, env.config, len(env.possible_agents))

    def __call__(self, env: TeamEnv) -> dict[str, int]:
        """Return the actions of the explorers."""
        actions = zip(env.possible_agents, self._policy(env.team), strict=True)
        return {agent: _LEFT if action is None else action for agent, action in actions}

    def act(self, env: TeamEnv, robot: int) -> int | None:
        """Return the action of one explorer."""
        return self.explore(env, robot)


class Meeting(Baseline):
    """Meet at the centre of the map.

    R1  A robot that sees all others goes to the middle of them all.
    R2  Otherwise it goes to its nearest frontier.
    R3  Without a frontier, it goes to the middle of its map: the place to stand that is nearest to the centroid of the
        free cells. Robots with equal maps, merged or complete, choose the same one.
    """

    def act(self, env: TeamEnv, robot: int) -> int | None:
        """Return the action of a robot by R1 to R3."""
        team = env.team
        state, places = team.states[robot], team.places_px()
        others = np.delete(places, robot, axis=0)
        if are_in_view(team, robot, others).all():  # R1
            x, y = places.mean(axis=0).tolist()
            if (action := self._legs[robot].to(state, x, y)) is not None:
                return action
        if (action := self.explore(env, robot)) is not None:  # R2
            return action
        ways = self.ways(env, robot)  # R3
        rows, cols = np.nonzero(state.known == FREE)
        there = np.hypot(rows - rows.mean(), cols - cols.mean())
        reached = ways[rows * state.known.shape[1] + cols] < NO_WAY
        if not reached.any():
            return None
        middle = int(np.argmin(np.where(reached, there, math.inf)))
        x, y = cols[middle] + 0.5, rows[middle] + 0.5
        if math.hypot(x - state.believed_px[0], y - state.believed_px[1]) < 2.5 * team.radius_px:
            return None
        return self._legs[robot].to(state, x, y)


class Patrolling(Baseline):
    """Conscientious reactive patrol (Machado et al., 2002), with idleness that the robots share.

    A robot goes to the neighbouring place with the greatest idleness to which no other robot goes; from no place, or
    without a neighbour, to the one with the greatest idleness of all.
    """

    def __init__(self, env: TeamEnv, seed: int = 0) -> None:
        super().__init__(env, seed)
        episode = env.episode
        assert isinstance(episode, PatrolEpisode)  # noqa: S101  # chosen by the task
        self._episode, self._team = episode, env.team
        number = len(env.possible_agents)
        self._targets, self._ages = [-1] * number, [0] * number
        self._beside = _neighbours(episode.labels)
        standing = find_standing_grid(env.team)
        self._middles = [_middle(episode.labels == place + 1, standing) for place in range(len(episode.idle))]

    def act(self, env: TeamEnv, robot: int) -> int | None:
        """Return the action on the way to the robot's next place."""
        state, labels = env.team.states[robot], self._episode.labels
        col, row = state.pose_px[:2].astype(int).tolist()
        here = int(labels[row, col]) - 1
        self._ages[robot] += 1
        if self._targets[robot] in {-1, here} or self._ages[robot] > _PATIENCE_STEPS:
            self._choose(robot, here, late=self._ages[robot] > _PATIENCE_STEPS)
        action = self._legs[robot].to(state, *self._middles[self._targets[robot]])
        if action is None:
            self._choose(robot, here, late=True)
        return action

    def _choose(self, robot: int, here: int, *, late: bool) -> None:
        """Choose the next place of a robot; one that is ``late`` chooses among all."""
        taken = {target for k, target in enumerate(self._targets) if k != robot} | {here, self._targets[robot]}
        near = [] if here < 0 or late else [place for place in self._beside[here] if place not in taken]
        free = near or [place for place in range(len(self._middles)) if place not in taken] or [max(here, 0)]
        self._targets[robot] = max(free, key=lambda place: (int(self._episode.idle[place]), -place))
        self._ages[robot] = 0


class Covering(Baseline):
    """Nearest uncovered cell, a step away or more, to which no other robot is on its way within a metre.

    Near is what takes few actions, to turn and to go there, so that robots go straight on where they can. A place at
    which the robot could not cover what it wanted is left out for a while.
    """

    def __init__(self, env: TeamEnv, seed: int = 0) -> None:
        super().__init__(env, seed)
        episode = env.episode
        assert isinstance(episode, CoverageEpisode)  # noqa: S101  # chosen by the task
        self._episode = episode
        self._goals: list[tuple[float, float] | None] = [None] * len(env.possible_agents)
        self._ages = [0] * len(env.possible_agents)
        self._tried: list[list[tuple[float, float]]] = [[] for _ in env.possible_agents]

    def act(self, env: TeamEnv, robot: int) -> int | None:
        """Return the action on the way to the nearest uncovered cell."""
        self._ages[robot] += 1
        for _ in range(_TRIED):
            goal = self._goals[robot]
            if goal is not None and self._ages[robot] > _PATIENCE_STEPS:
                self._tried[robot] = [*self._tried[robot], goal][-_TRIED:]
            if goal is None or self._ages[robot] > _PATIENCE_STEPS or not self._near(goal).any():
                goal = self._choose(env, robot)
            if goal is None:
                return None
            action = self._legs[robot].to(env.team.states[robot], *goal)
            if action is not None:
                return action
            self._tried[robot] = [*self._tried[robot], goal][-_TRIED:]
            self._goals[robot] = None
        return None

    def _near(self, goal: tuple[float, float]) -> Grid:
        """Return the uncovered cells of the square round a place that a tool there covers about half of."""
        x, y, reach = int(goal[0]), int(goal[1]), max(int(0.6 * self._episode.radius_px), 0)
        return self._episode.todo[max(y - reach, 0) : y + reach + 1, max(x - reach, 0) : x + reach + 1]

    def _choose(self, env: TeamEnv, robot: int) -> tuple[float, float] | None:
        """Choose a robot's next goal, None if it reaches no uncovered cell."""
        self._goals[robot], self._ages[robot] = None, 0
        ways = self.ways(env, robot)
        step = STRAIGHT * env.config.robot.step_m * env.team.ppm
        x, y, heading = env.team.states[robot].believed_px.tolist()
        taken_by = [(*goal, env.team.ppm) for goal in self._goals if goal is not None]
        taken_by += [(*goal, self._episode.radius_px / 2) for goal in self._tried[robot]]
        for share in (0.6, 1.0):
            side = 2 * int(share * self._episode.radius_px) + 1
            disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side))
            cells = np.flatnonzero((cv2.dilate(self._episode.todo, disc).ravel() != 0) & (ways < NO_WAY))
            if not len(cells):
                continue
            rows, cols = np.divmod(cells, self._episode.todo.shape[1])
            taken = np.zeros(len(cells), bool)
            for goal_x, goal_y, reach in taken_by:
                taken |= np.hypot(cols + 0.5 - goal_x, rows + 0.5 - goal_y) < reach
            turn = np.abs(np.angle(np.exp(1j * (np.arctan2(y - rows - 0.5, cols + 0.5 - x) - heading))))
            actions = ways[cells] / step + turn / math.radians(env.config.robot.turn_deg)
            best = int(np.argmin(actions + _LAST * (2.0 * taken + (ways[cells] < 0.9 * step))))
            self._goals[robot] = float(cols[best]) + 0.5, float(rows[best]) + 0.5
            break
        return self._goals[robot]


class Chasing(Baseline):
    """Search, then chase.

    R1  A robot that knows where someone is who is not caught goes there, to the nearest one.
    R2  Otherwise it goes to where it last knew of someone, unless it has been there.
    R3  Otherwise it goes to its nearest frontier, and without a frontier to places that it draws at random.
    """

    def __init__(self, env: TeamEnv, seed: int = 0) -> None:
        super().__init__(env, seed)
        episode = env.episode
        assert isinstance(episode, PursuitEpisode)  # noqa: S101  # chosen by the task
        self._episode = episode
        self._last: list[tuple[float, float] | None] = [None] * len(env.possible_agents)
        self._rng = np.random.default_rng(seed)

    def act(self, env: TeamEnv, robot: int) -> int | None:
        """Return the action of a robot by R1 to R3."""
        team = env.team
        state = team.states[robot]
        known = np.flatnonzero(self._episode.known_people()[robot] & ~self._episode.caught)
        if len(known):  # R1
            places = self._episode.people_px()[known]
            nearest = places[int(np.argmin(np.hypot(*(places - state.pose_px[:2]).T)))]
            self._last[robot] = (float(nearest[0]), float(nearest[1]))
        goal = self._last[robot]
        if goal is not None:  # R2
            action = self._legs[robot].to(state, *goal)
            if action is not None:
                return action
            self._last[robot] = None
        if (action := self.explore(env, robot)) is not None:  # R3
            return action
        cells = np.flatnonzero(self.ways(env, robot) < NO_WAY)
        if not len(cells):
            return None
        row, col = divmod(int(cells[int(self._rng.integers(len(cells)))]), state.known.shape[1])
        self._last[robot] = (col + 0.5, row + 0.5)
        return self._legs[robot].to(state, col + 0.5, row + 0.5)


BASELINES: Final[dict[str, type[Baseline]]] = {
    "exploration": Exploring, "rendezvous": Meeting, "patrol": Patrolling, "coverage": Covering, "pursuit": Chasing,
}  # fmt: skip
"""The policies by the names of the tasks."""


def make_baseline(env: TeamEnv, seed: int = 0) -> Baseline:
    """Return the baseline of an environment's task for the episode that has begun, with random numbers of a seed.

    Raises
    ------
    ConfigError
        There is no baseline for the task, or the actions are not discrete.
    ResetNeeded
        No episode has begun.
    """
    if env.task.name not in BASELINES:
        raise ConfigError(f"task: expected one of {', '.join(BASELINES)}, found {env.task.name!r}")
    if not hasattr(env.action_space(env.possible_agents[0]), "n"):
        raise ConfigError("actions: expected discrete ones, found continuous; make the environment without a drive")
    _ = env.team  # an episode has begun
    return BASELINES[env.task.name](env, seed)


def _neighbours(labels: npt.NDArray[np.int32]) -> list[list[int]]:
    """Return the indices of the places beside each place: those with cells side by side."""
    pairs: set[tuple[int, int]] = set()
    for one, other in ((labels[1:], labels[:-1]), (labels[:, 1:], labels[:, :-1])):
        differ = (one != other) & (one > 0) & (other > 0)
        found: Any = np.unique(np.column_stack([one[differ], other[differ]]), axis=0)
        pairs |= {(int(a), int(b)) for a, b in found} | {(int(b), int(a)) for a, b in found}
    beside: list[list[int]] = [[] for _ in range(int(labels.max()))]
    for a, b in sorted(pairs):
        beside[a - 1].append(b - 1)
    return beside


def _middle(inside: npt.NDArray[np.bool_], standing: Grid) -> tuple[float, float]:
    """Return the centre of the cell of a place, where a robot can stand, that is nearest to their centroid, pixels."""
    rows, cols = np.nonzero(inside & (standing != 0))
    k = int(np.argmin(np.hypot(rows - rows.mean(), cols - cols.mean())))
    return float(cols[k]) + 0.5, float(rows[k]) + 0.5
