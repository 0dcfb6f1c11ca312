"""Define the task of a team in pursuit: find people who walk about, and come near each of them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal, get_args

import numpy as np
from gymnasium import spaces

from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.config.checks import check_number, check_one_of
from houseexpo.pseudoslam.config.moving_obstacles import PeopleConfig
from houseexpo.pseudoslam.envs.spec import EnvSpec
from houseexpo.pseudoslam.kernels.collision import placed_people
from houseexpo.pseudoslam.metrics import Bools, Metrics
from houseexpo.pseudoslam.teams.tasks.task import (
    FARTHER_THAN_ANY_M,
    Array,
    Floats,
    TeamEpisode,
    TeamTask,
    are_in_view,
    has_line_of_sight,
    to_robot_frame,
)
from houseexpo.pseudoslam.teams.team import Team
from houseexpo.pseudoslam.worlds.maps import House

PursuitReward = Literal["capture", "sight"]


@dataclass(frozen=True)
class Pursuit(TeamTask):
    """The task of catching people: multi-robot search and capture (Hollinger et al., 2009; Chung et al., 2011).

    A person is caught when the centre of a robot is within ``capture_m`` of the person's, with no wall between them.
    Caught people walk on, but count no more. An episode terminates when all are caught. People do not flee: they walk
    from room to room, and round robots. A configuration without people gets one.

    Parameters
    ----------
    capture_m
        The distance of a capture, metres.
    reward
        "capture": for each robot, the share of the people that were caught in the step, so that an episode gives 1 at
        most. "sight": also ``1 / max_steps`` for each step in which the robot itself sees someone who is not caught.

    Notes
    -----
    An observation has "people" (P, 4) float32, a row for each of the ``config.people.number``: 1 if the robot or one
    that it hears sees the person, else 0; the person's place, metres ahead and to the left of the robot, 0 if it is not
    seen; and 1 if the person is caught. People are seen in the range and field of view of the laser, with no wall in
    between. A house with less space has fewer people; the rows of the others are 0.

    ``info["team"]`` has ``steps_to_detect`` and ``steps_to_capture``, the steps until the first person was seen or
    caught and until the last one was caught, None before; ``caught``, the share of people caught; and ``in_sight``, the
    share of steps after which some robot saw someone who was not caught.
    """

    capture_m: float = 1.0
    reward: PursuitReward = "capture"

    name = "pursuit"
    default = SimulatorConfig(people=PeopleConfig(1, least=1, away_m=3.0), max_steps=1000)

    def __post_init__(self) -> None:
        check_number(self.capture_m, "capture_m", above=0.0)
        check_one_of(self.reward, "reward", get_args(PursuitReward))

    def configure(self, config: SimulatorConfig) -> SimulatorConfig:
        """Add a person to a configuration without people."""
        return config if config.people.number else replace(config, people=replace(config.people, number=1, least=1))

    def spaces(self, spec: EnvSpec, robots: int) -> dict[str, spaces.Space[Any]]:
        """Return the space of the people's places."""
        del robots
        low, high = (
            np.array([0.0, -FARTHER_THAN_ANY_M, -FARTHER_THAN_ANY_M, 0.0], np.float32),
            np.array([1.0, FARTHER_THAN_ANY_M, FARTHER_THAN_ANY_M, 1.0], np.float32),
        )
        people = spec.config.people.number
        return {"people": spaces.Box(np.tile(low, (people, 1)), np.tile(high, (people, 1)), dtype=np.float32)}

    def begin(self, team: Team, house: House | None) -> TeamEpisode:
        """Return the task's part of an episode."""
        del house
        return PursuitEpisode(team, self)


class PursuitEpisode(TeamEpisode):
    """Who has been seen and caught in an episode.

    ``sees`` (n, P) says which robot sees whom now, and ``caught`` (P,) who has been caught.
    """

    def __init__(self, team: Team, task: Pursuit) -> None:
        super().__init__(team)
        self._task = task
        self.caught: Bools = np.zeros(len(self.people_px()), bool)
        self.sees: Bools = np.zeros((len(team), len(self.caught)), bool)
        self._steps_to_detect: int | None = None
        self._steps_to_capture: int | None = None
        self._in_sight = 0
        self._look()

    def people_px(self) -> Floats:
        """Return the people's places (P, 2), pixels."""
        people = placed_people(self.team.states[0].episode.bodies.people)
        return np.column_stack([people["x"], people["y"]])

    def _look(self) -> int:
        """Take note of who is seen and caught; return how many people were not caught before."""
        team, people = self.team, self.people_px()
        self.sees = np.array([are_in_view(team, k, people) for k in range(len(team))])
        places = team.places_px()
        away = np.hypot(*(places[:, None] - people[None]).transpose(2, 0, 1))
        new = 0
        for k, person in np.argwhere(away <= self._task.capture_m * team.ppm).tolist():
            if not self.caught[person] and has_line_of_sight(team, places[k], people[person]):
                self.caught[person] = True
                new += 1
        steps = team.measures.steps
        if self._steps_to_detect is None and (self.sees.any() or self.caught.any()):
            self._steps_to_detect = steps
        if self._steps_to_capture is None and self.caught.all():
            self._steps_to_capture = steps
        return new

    def step(self, before: Metrics, seen: Metrics, ahead: Bools) -> Floats:
        """Return the shares caught, and those for sight (n,)."""
        del before, ahead
        free = ~self.caught
        new = self._look()
        sees_free: Bools = np.asarray((self.sees & free).any(axis=1))
        self._in_sight += bool(sees_free.any())
        rewards = np.full(len(self.team), new / max(len(self.caught), 1))
        if self._task.reward == "sight":
            rewards += sees_free / seen.config.max_steps
        return rewards

    def success(self, now: Metrics) -> bool:
        """Return whether all people are caught."""
        del now
        return bool(self.caught.all())

    def known_people(self) -> Bools:
        """Return whom each robot knows of (n, P): whom it sees, and whom those that it hears see."""
        heard = self.team.heard | np.eye(len(self.team), dtype=bool)
        return np.asarray((heard[:, :, None] & self.sees[None]).any(axis=1))

    def observe(self) -> dict[str, Array]:
        """Return the places of the people."""
        team, people = self.team, self.people_px()
        found = np.zeros((len(team), team.spec.config.people.number, 4), np.float32)
        for k, known in enumerate(self.known_people()):
            rows = np.flatnonzero(known)
            found[k, rows, 0] = 1.0
            found[k, rows, 1:3] = to_robot_frame(team.states[k].pose_px, people[rows], team.ppm)
            found[k, : len(people), 3] = self.caught
        return {"people": found}

    def report(self) -> dict[str, float | None]:
        """Return the steps and the shares."""
        return {
            "steps_to_detect": self._steps_to_detect,
            "steps_to_capture": self._steps_to_capture,
            "caught": float(self.caught.mean()) if len(self.caught) else 1.0,
            "in_sight": self._in_sight / max(self.team.measures.steps, 1),
        }
