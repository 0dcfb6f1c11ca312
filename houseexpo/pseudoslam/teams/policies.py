"""Choose frontiers for the robots of a team: nearest, greedy, Hungarian or auction, by what robots hear of each other.

Each robot is an explorer (``agents.explorers``) that chooses a frontier on its own map when it needs one. It knows the
places and the goals of the robots that it hears, and of those only.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.agents.explorers import Explorer, distances_to_cells, unknown_areas
from houseexpo.pseudoslam.agents.protocol import Knowledge, Robot
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.kernels.planning.paths import find_distances
from houseexpo.pseudoslam.kernels.planning.planner_types import STRAIGHT
from houseexpo.pseudoslam.kernels.tolerances import GAIN_PER_M
from houseexpo.pseudoslam.kernels.types import NO_WAY, PathScratch, Rows, new_path_scratch
from houseexpo.words import suggest_name

Grid = npt.NDArray[np.uint8]
Floats = npt.NDArray[np.float64]

_MOST_SHARED: Final = 24
"""The number of frontiers that are shared out: those that ``find_frontiers`` ranks first."""


class TeamExplorer(Explorer):
    """A robot of a team; ``others`` are told to it before each step: (x, y) and the goal's (x, y) or NaN, (n, 4)."""

    def __init__(self, robot: Robot, seed: int) -> None:
        super().__init__(robot, seed)
        self.others: Floats = np.empty((0, 4))
        self.goal_px = (math.nan, math.nan)
        self._ways: PathScratch = new_path_scratch(0)

    def choose(self, known: Grid, frontiers: Rows, info: Knowledge) -> int:
        """Return the frontier that ``share`` gives this robot."""
        first = frontiers[:_MOST_SHARED]
        rows, cols = np.divmod(first["goal"], known.shape[1])
        places = np.column_stack([cols + 0.5, rows + 0.5])
        chosen = self.share(known, first, places, info)
        self.goal_px = (float(places[chosen, 0]), float(places[chosen, 1]))
        return chosen

    @abstractmethod
    def share(self, known: Grid, frontiers: Rows, places: Floats, info: Knowledge) -> int:
        """Return the index of the frontier to go to; ``places`` are their goals (n, 2), pixels."""

    def ways_m(self, known: Grid, frontiers: Rows, places: Floats) -> Floats:
        """Return the ways of this robot and of the others to the frontiers (1 + others, n), metres.

        A robot that cannot stand where it is on this map, or that has no way, gets the straight distance and 100 m.
        """
        found = [frontiers["way"] / (STRAIGHT * self.metre)]
        if len(self._ways.ways) < known.size:
            self._ways = new_path_scratch(known.size)
        for x, y in self.others[:, :2].tolist():
            straight = np.hypot(*(places - (x, y)).T) / self.metre + 100.0
            if not (0 <= x < known.shape[1] and 0 <= y < known.shape[0]):
                found.append(straight)
                continue
            find_distances(known, x, y, self.radius_px, -1, self._ways)
            ways = distances_to_cells(self._ways, frontiers["goal"])
            found.append(np.where(ways >= NO_WAY, straight, ways / (STRAIGHT * self.metre)))
        return np.array(found)


class NearestEach(TeamExplorer):
    """Nearest frontier, each robot by itself (Yamauchi, 1998)."""

    def share(self, known: Grid, frontiers: Rows, places: Floats, info: Knowledge) -> int:
        """Return the first frontier, since they are in this order."""
        del known, frontiers, places, info
        return 0


class GreedyTeam(TeamExplorer):
    """The nearest frontier that is not within half the laser's range of the goal of a robot that is heard."""

    def share(self, known: Grid, frontiers: Rows, places: Floats, info: Knowledge) -> int:
        """Return the first such frontier; the first of all if there is none."""
        del known, frontiers, info
        goals = self.others[:, 2:]
        away = np.hypot(*(places[:, None] - goals[None]).transpose(2, 0, 1))
        taken = (away < self.range_px / 2).any(axis=1)  # False for NaN: no goal
        return int(np.argmin(taken))


class Hungarian(TeamExplorer):
    """The assignment of robots to frontiers with the shortest sum of ways (Kuhn, 1955), over those that are heard."""

    def share(self, known: Grid, frontiers: Rows, places: Floats, info: Knowledge) -> int:
        """Return this robot's frontier; the nearest one if there are too few for all."""
        del info
        robots, chosen = linear_sum_assignment(self.ways_m(known, frontiers, places))
        own = dict(zip(robots.tolist(), chosen.tolist(), strict=True))
        return int(own.get(0, 0))


class Auction(TeamExplorer):
    """An auction (Simmons et al., 2000): robots bid for frontiers, and the highest bid wins its frontier.

    A bid is A exp(-0.2 L), with A the unknown area in sight of the frontier and L the way. When a frontier is won, the
    areas of others within the laser's range fall in proportion to their nearness, since they see much of the same.
    """

    def share(self, known: Grid, frontiers: Rows, places: Floats, info: Knowledge) -> int:
        """Return the frontier that this robot wins; its own best one if there are too few for all."""
        del info
        gains = unknown_areas(known, frontiers, self.range_px)
        near = np.exp(-GAIN_PER_M * self.ways_m(known, frontiers, places))
        bidding, free = set(range(len(near))), np.ones(len(places), bool)
        best = int(np.argmax(gains * near[0]))
        while bidding and free.any():
            robots = sorted(bidding)
            bids = np.where(free, gains * near[robots], -1.0)
            robot, won = divmod(int(np.argmax(bids)), len(places))
            if robots[robot] == 0:
                return won
            bidding.remove(robots[robot])
            free[won] = False
            away = np.hypot(*(places - places[won]).T)
            gains = gains * np.minimum(away / self.range_px, 1.0)
        return best


POLICIES: Final[dict[str, type[TeamExplorer]]] = {
    "nearest": NearestEach, "greedy": GreedyTeam, "hungarian": Hungarian, "auction": Auction,
}  # fmt: skip


def find_policy_class(name: str) -> type[TeamExplorer]:
    """Return a policy by its name; raise ConfigError if there is none."""
    if name not in POLICIES:
        known = list(POLICIES)
        raise ConfigError(f"--policy: expected one of {', '.join(known)}; found {name!r}" + suggest_name(name, known))
    return POLICIES[name]


class TeamPolicy:
    """The explorers of a team, which act together; ``team`` is a ``teams.team.Team``."""

    def __init__(self, kind: type[TeamExplorer], config: SimulatorConfig, robots: int) -> None:
        self._explorers = [kind(Robot(config), k) for k in range(robots)]
        self._idle = [-1] * robots

    def __call__(self, team: Any) -> list[int | None]:
        """Return for each robot its action forward, left or right, or None if its map has no frontier."""
        ppm = team.ppm
        told = [(*s.believed_px[:2].tolist(), *e.goal_px) for s, e in zip(team.states, self._explorers, strict=True)]
        actions: list[int | None] = []
        for k, (state, explorer) in enumerate(zip(team.states, self._explorers, strict=True)):
            counts = state.counts
            if self._idle[k] == int(counts.known):
                actions.append(None)
                continue
            explorer.others = np.array([told[j] for j in np.flatnonzero(team.heard[k])]).reshape(-1, 4)
            info: Knowledge = {
                "map": state.known,
                "pose_px": state.believed_px,
                "collided": state.blocked,
                "steps": int(counts.steps),
                "path_m": float(state.episode.readings[0].path_length) / ppm,
            }
            action = explorer.act(info)
            if action is None:
                explorer.goal_px = (math.nan, math.nan)
                self._idle[k] = int(counts.known)
            told[k] = (*told[k][:2], *explorer.goal_px)
            actions.append(action)
        return actions
