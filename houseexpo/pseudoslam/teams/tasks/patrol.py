"""Define the task of a team on patrol: visit all rooms or squares again and again, none of them unvisited for long."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.config.checks import check_number, check_one_of
from houseexpo.pseudoslam.envs.spec import EnvSpec
from houseexpo.pseudoslam.metrics import Bools, Metrics
from houseexpo.pseudoslam.teams.tasks.rasters import (
    Labels,
    draw_rasters,
    find_standing_grid,
    make_raster_space,
    number_rooms,
    number_squares,
)
from houseexpo.pseudoslam.teams.tasks.task import Array, Floats, TeamEpisode, TeamTask
from houseexpo.pseudoslam.teams.team import Team
from houseexpo.pseudoslam.worlds.maps import House

Places = Literal["rooms", "cells"]
PatrolReward = Literal["removed", "idleness"]


@dataclass(frozen=True)
class Patrol(TeamTask):
    """The task of patrolling (Machado et al., 2002; Portugal and Rocha, 2011).

    The idleness of a place is the number of steps since a robot was in it, or since the start. Only the time limit ends
    an episode.

    Parameters
    ----------
    places
        "rooms": the rooms in which a robot can stand. A plan that records none is divided by ``FloorPlan.divided``.
        "cells": squares of ``square_m``; walls divide them, and small pieces do not count (``rasters.number_squares``).
    square_m
        The side of a square, metres.
    reward
        "removed": the idleness that a robot's visits remove, divided by the number of places. Robots that visit a place
        in the same step share it equally. "idleness": for each robot, minus the mean idleness of the places now.

    Notes
    -----
    An observation has "idleness" (2, side, side) uint8, pictures as of ``rasters.draw_rasters``: 0 outside the places,
    else 1 for a place that is visited now, and up to 255 for those that were not visited for the longest time.

    ``info["team"]`` has measures in steps. ``mean_idleness`` is Machado et al.'s graph idleness: the mean over the
    places, averaged over the steps. ``worst_idleness`` is the largest idleness that a place has had. ``idleness_now``
    is the mean at present. ``visit_idleness`` is Portugal and Rocha's average graph idleness: the mean over the places
    of each one's mean idleness when robots arrived; None while no place has been arrived at. ``visited`` is the share
    of places that a robot has been in.
    """

    places: Places = "cells"
    square_m: float = 1.0
    reward: PatrolReward = "removed"

    name = "patrol"
    default = SimulatorConfig(known_map=True, max_steps=1000)

    def __post_init__(self) -> None:
        check_one_of(self.places, "places", get_args(Places))
        check_number(self.square_m, "square_m", above=0.0, at_most=100.0)
        check_one_of(self.reward, "reward", get_args(PatrolReward))

    @property
    def house_matters(self) -> bool:  # type: ignore[override]  # a constant of other tasks
        """Whether the places are rooms."""
        return self.places == "rooms"

    def spaces(self, spec: EnvSpec, robots: int) -> dict[str, spaces.Space[Any]]:
        """Return the space of the pictures of idleness."""
        del robots
        return {"idleness": make_raster_space(spec)}

    def begin(self, team: Team, house: House | None) -> TeamEpisode:
        """Return the task's part of an episode; raise ConfigError if the house has no rooms."""
        standing = find_standing_grid(team)
        if self.places == "rooms":
            labels = number_rooms(team, house, None, "places")
            kept = np.unique(labels[(standing != 0) & (labels > 0)])
            numbers = np.zeros(int(labels.max()) + 1, np.int32)
            numbers[kept] = np.arange(1, len(kept) + 1)
            labels = numbers[labels]
        else:
            labels = number_squares(standing, self.square_m * team.ppm)
        if not labels.any():
            raise ConfigError(f"places: a robot can stand in no room of plan {team.world.plan_id!r}; take 'cells'")
        return PatrolEpisode(team, self, labels)


class PatrolEpisode(TeamEpisode):
    """What has been visited in an episode.

    ``labels`` (rows, cols) is the number of each cell's place, from 1, and 0 for none; ``idle`` (places,) is the
    idleness of each, in the order of their numbers.
    """

    def __init__(self, team: Team, task: Patrol, labels: Labels) -> None:
        super().__init__(team)
        self._task, self.labels = task, labels
        places = int(labels.max())
        self.idle: npt.NDArray[np.int64] = np.zeros(places, np.int64)
        self._visited, self._arrivals = np.zeros(places, bool), np.zeros(places, np.int64)
        self._waited = np.zeros(places, np.int64)
        self._sum, self._worst, self._steps = 0.0, 0, 0
        self._visited[np.unique(self._where()[self._where() >= 0])] = True

    def _where(self) -> npt.NDArray[np.int64]:
        """Return the index of the place in which each robot is (n,), -1 for none."""
        cols, rows = self.team.places_px().astype(np.int64).T
        found: npt.NDArray[np.int64] = self.labels[rows, cols].astype(np.int64) - 1
        return found

    def step(self, before: Metrics, seen: Metrics, ahead: Bools) -> Floats:
        """Return the idleness removed, or minus the mean idleness (n,)."""
        del before, seen, ahead
        where = self._where()
        self.idle += 1
        self._steps += 1
        removed = np.zeros(len(where))
        for place in np.unique(where[where >= 0]).tolist():
            idle, here = int(self.idle[place]), where == place
            removed[here] = idle / np.count_nonzero(here)
            if idle > 1:  # nobody was here in the step before
                self._arrivals[place] += 1
                self._waited[place] += idle
            self.idle[place], self._visited[place] = 0, True
        self._worst = max(self._worst, int(self.idle.max()))
        self._sum += float(self.idle.mean())
        if self._task.reward == "idleness":
            return np.full(len(where), -float(self.idle.mean()))
        return removed / len(self.idle)

    def success(self, now: Metrics) -> bool:
        """Return False, since a patrol has no end."""
        del now
        return False

    def observe(self) -> dict[str, Array]:
        """Return the pictures of idleness."""
        shades = np.zeros(len(self.idle) + 1, np.uint8)
        shades[1:] = 1 + 254 * self.idle // max(int(self.idle.max()), 1)
        return {"idleness": draw_rasters(self.team, shades[self.labels])}

    def report(self) -> dict[str, float | None]:
        """Return the measures of idleness."""
        arrived = self._arrivals > 0
        waits = self._waited[arrived] / self._arrivals[arrived]
        return {
            "mean_idleness": self._sum / max(self._steps, 1),
            "worst_idleness": self._worst,
            "idleness_now": float(self.idle.mean()),
            "visit_idleness": float(waits.mean()) if len(waits) else None,
            "visited": float(self._visited.mean()),
        }
