"""A task of a team as a user would write it: all robots come near each other, with no wall between any two."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations
from typing import Any, Literal, get_args

import numpy as np
from gymnasium import spaces

from houseexpo.pseudoslam.config.checks import check_number, check_one_of
from houseexpo.pseudoslam.envs.spec import EnvSpec
from houseexpo.pseudoslam.kernels.radio import length_in_walls
from houseexpo.pseudoslam.metrics import Bools, Metrics
from houseexpo.pseudoslam.teams.tasks import Array, Floats, TeamEpisode, TeamTask
from houseexpo.pseudoslam.teams.team import Team
from houseexpo.pseudoslam.worlds.maps import House

MeetingReward = Literal["meeting", "nearer"]
FARTHER_THAN_ANY_M = 10_000.0


@dataclass(frozen=True)
class Rendezvous(TeamTask):
    """The task of meeting, for robots that share no frame (Roy and Dudek, 2001; Alpern and Gal, 2003).

    An episode terminates when each two robots are within ``meet_m`` of each other, with no wall between them. One
    robot alone has met.

    Parameters
    ----------
    meet_m
        The greatest distance between the centres of two robots that have met, metres.
    reward
        "meeting": 1 for each robot when all have met. "nearer": also, at each step, the metres by which a robot's mean
        straight distance to the others has shrunk.

    Notes
    -----
    An observation has "robots" (n - 1, 3) float32, a row for each other robot in the order of their numbers: 1 if it
    is in the range and field of view of the laser with no wall in between, else 0; and its place, metres ahead and to
    the left, 0 if it is not seen.

    ``info["team"]`` has ``steps_to_meet`` and ``metres_to_meet``, the steps and the metres travelled by all robots
    until they met, None before; ``spread_m``, the greatest distance between two robots now; and ``pairs_in_sight``, the
    share of pairs that have no wall between them now.
    """

    meet_m: float = 1.5
    reward: MeetingReward = "meeting"

    name = "rendezvous"
    house_matters = True

    def __post_init__(self) -> None:
        check_number(self.meet_m, "meet_m", above=0.0)
        check_one_of(self.reward, "reward", get_args(MeetingReward))

    def spaces(self, spec: EnvSpec, robots: int) -> dict[str, spaces.Space[Any]]:
        """Return the space of the other robots' places."""
        del spec
        low = np.tile(np.array([0.0, -FARTHER_THAN_ANY_M, -FARTHER_THAN_ANY_M], np.float32), (robots - 1, 1))
        high = np.tile(np.array([1.0, FARTHER_THAN_ANY_M, FARTHER_THAN_ANY_M], np.float32), (robots - 1, 1))
        return {"robots": spaces.Box(low, high, dtype=np.float32)} if robots > 1 else {}

    def begin(self, team: Team, house: House | None) -> TeamEpisode:
        """Return the task's part of an episode."""
        assert house is not None, "it matters"
        return _Episode(team, self)


class _Episode(TeamEpisode):
    def __init__(self, team: Team, task: Rendezvous) -> None:
        super().__init__(team)
        self._task = task
        self._met_at: tuple[int, float] | None = None
        self._apart = self._distances_m()
        self._note()

    def _distances_m(self) -> Floats:
        """Return the straight distances between robots (n, n)."""
        places = self.team.places_px()
        found: Floats = np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1)) / self.team.ppm
        return found

    def _note(self) -> bool:
        """Take note of the meeting if the robots have just met; return whether they have."""
        team, places = self.team, self.team.places_px()
        if self._met_at is not None or self._apart.max() > self._task.meet_m:
            return False
        if not all(has_line_of_sight(team, places[i], places[j]) for i, j in combinations(range(len(team)), 2)):
            return False
        self._met_at = team.steps, float(team.ways_m().sum())
        return True

    def step(self, before: Metrics, seen: Metrics, ahead: Bools) -> Floats:
        del before, seen, ahead
        was, n = self._apart, len(self.team)
        self._apart = self._distances_m()
        rewards = np.zeros(n)
        if self._task.reward == "nearer" and n > 1:
            rewards += (was - self._apart).sum(axis=1) / (n - 1)
        return rewards + float(self._note())

    def success(self, now: Metrics) -> bool:
        del now
        return self._met_at is not None

    def observe(self) -> dict[str, Array]:
        n = len(self.team)
        if n == 1:
            return {}
        places, found = self.team.places_px(), np.zeros((n, n - 1, 3), np.float32)
        for k in range(n):
            others = places[np.arange(n) != k]
            seen = are_in_view(self.team, k, others)
            found[k, seen, 0] = 1.0
            found[k, seen, 1:] = to_robot_frame(self.team.states[k].pose_px, others[seen], self.team.ppm)
        return {"robots": found}

    def report(self) -> dict[str, float | None]:
        team, places = self.team, self.team.places_px()
        pairs = [has_line_of_sight(team, places[i], places[j]) for i, j in combinations(range(len(team)), 2)]
        steps, metres = self._met_at or (None, None)
        return {
            "steps_to_meet": steps,
            "metres_to_meet": metres,
            "spread_m": float(self._apart.max()),
            "pairs_in_sight": float(np.mean(pairs)) if pairs else 1.0,
        }


def to_robot_frame(pose_px: Floats, places_px: Floats, pixels_per_metre: float) -> Floats:
    """Return places (n, 2) relative to a pose (3,), both in pixels with y down: metres ahead and to the left (n, 2)."""
    right, up = places_px[:, 0] - pose_px[0], pose_px[1] - places_px[:, 1]
    cos, sin = math.cos(pose_px[2]), math.sin(pose_px[2])
    return np.column_stack([right * cos + up * sin, up * cos - right * sin]) / pixels_per_metre


def are_in_view(team: Team, robot: int, places_px: Floats) -> Bools:
    """Return which places (n, 2), pixels, are in the range and field of view of a robot's laser, with no wall between.

    Robots and people do not hide each other.
    """
    pose = team.states[robot].pose_px
    near = to_robot_frame(pose, places_px, 1.0)
    sensor = team.params.sensor
    found: Bools = np.hypot(*near.T) <= sensor.range_px
    found &= np.abs(np.arctan2(near[:, 1], near[:, 0])) <= sensor.half_fov
    for k in np.flatnonzero(found).tolist():
        found[k] = has_line_of_sight(team, pose[:2], places_px[k])
    return found


def has_line_of_sight(team: Team, one_px: Floats, other_px: Floats) -> bool:
    """Return whether no wall is between two places (2,), pixels."""
    return length_in_walls(team.walls, *one_px.tolist(), *other_px.tolist()) == 0.0
