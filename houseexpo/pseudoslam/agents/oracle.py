"""Explore with knowledge of the true house: make a short tour of a few places from which everything can be seen.

The tour is not the shortest possible one, which is hard to compute, but a reference for other explorers.

R1  Places are on a lattice of 0.5 m, or a coarser one if there were more than 600. What each sees is computed once.
R2  A greedy selection of few places together sees everything that is unknown. Their order is a short tour from the
    robot. Both are computed again when the purpose of the first place is fulfilled, and after each metre.
R3  The purpose of the first place is to see the cells that no other selected place sees. Of all places that see them,
    the robot goes to the one on the shortest path to the second place. There it turns until they are seen, by at most
    one full turn; cells that are not seen then are left for the end.
R4  At the end, it explores the remaining cells like the nearest-frontier explorer.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.agents.explorers import GoalWalker, NearestFrontier, distances_to_cells
from houseexpo.pseudoslam.agents.protocol import Interface, Knowledge, Robot
from houseexpo.pseudoslam.agents.simple import LEFT
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE, UNKNOWN
from houseexpo.pseudoslam.kernels.planning.cover import (
    count_new_cells_of_all,
    greedy_cover,
    list_visible_cells,
    short_tour,
)
from houseexpo.pseudoslam.kernels.planning.paths import find_distances
from houseexpo.pseudoslam.kernels.tolerances import LATTICE_M, MAX_PLACES, PLACE_CELLS, SERVED_SHARE, TOUR_AGAIN_M
from houseexpo.pseudoslam.kernels.types import new_path_scratch
from houseexpo.pseudoslam.step_kernels import make_scratch
from houseexpo.pseudoslam.worlds.world import World

Floats = npt.NDArray[np.float64]
Cells = npt.NDArray[np.int32]


class Oracle:
    """An explorer that knows the true house, and therefore where to go, but not the map that it will have."""

    interface = Interface(sees_truth=True, tasks=("exploration",))

    def __init__(self, robot: Robot, seed: int) -> None:
        if robot.world is None:
            raise ConfigError("policy 'oracle': expected to be given the world, found none")
        config = robot.config
        self._radius_px = config.robot.radius_m * config.pixels_per_metre
        self._full_turn = math.ceil(360.0 / config.robot.turn_deg - 1e-9)
        self._house = np.where(robot.world.occupied != 0, OBSTACLE, FREE).astype(np.uint8)
        self._unwanted = (robot.world.observable == 0).view(np.uint8).ravel()
        self._walker, self._rest = GoalWalker(robot), NearestFrontier(robot, seed)
        self._ways = new_path_scratch(self._house.size)
        self._places, self._starts, self._views = _views(robot.world, robot)
        self._lengths: dict[int, Floats] = {}
        self._purpose: Cells = np.empty(0, np.int32)
        self._decided_at_m, self._turns, self._is_left = 0.0, 0, True
        self.decided = False

    def __call__(self, _observation: Any, info: Knowledge) -> int | None:
        """Return the action forward, left or right, or None when everything is seen."""
        known, pose = info["map"], info["pose_px"]
        self.decided = False
        while self._is_left:
            if self._has_served(known) or info["path_m"] - self._decided_at_m > TOUR_AGAIN_M:
                self._decided_at_m, self.decided = info["path_m"], True
                self._is_left = self._choose(known, *pose[:2].tolist())
                if not self._is_left:
                    break
            action = self._walker.next(self._house, pose)
            if action is not None:
                return action
            if self._turns < self._full_turn:  # R3
                self._turns += 1
                return LEFT
            self._unwanted[self._purpose] = 1
        return self._rest.act(info)  # R4

    def _has_served(self, known: npt.NDArray[np.uint8]) -> bool:
        """Return whether the purpose of the current place is fulfilled or given up."""
        left = (known.ravel()[self._purpose] == UNKNOWN) & (self._unwanted[self._purpose] == 0)
        return bool(np.count_nonzero(left) <= (1 - SERVED_SHARE) * len(self._purpose))

    def _choose(self, known: npt.NDArray[np.uint8], x: float, y: float) -> bool:
        """Aim at the first place of a short tour that sees the remaining cells; return whether there is one (R2)."""
        covered = self._unwanted | (known.ravel() != UNKNOWN)
        needless = covered.copy()
        chosen = np.zeros(len(self._places), np.int64)
        chosen = chosen[: greedy_cover(self._starts, self._views, PLACE_CELLS, covered, chosen)]
        if not len(chosen):
            return False
        find_distances(self._house, x, y, self._radius_px, -1, self._ways)
        here = distances_to_cells(self._ways, self._places)
        lengths = np.zeros((len(chosen) + 1, len(chosen) + 1))
        lengths[0, 1:] = lengths[1:, 0] = here[chosen]
        for i, place in enumerate(chosen.tolist(), start=1):
            lengths[i, 1:] = self._lengths_from(place)[chosen]
        order = chosen[short_tour(np.minimum(lengths, lengths.T))[1:] - 1].tolist()
        onwards = self._only_seen_from(order, needless)
        beyond = self._lengths_from(onwards[1]) if len(onwards) > 1 else np.zeros(len(here))
        row, col = divmod(int(self._places[self._best_that_sees(here + beyond, onwards[0])]), self._house.shape[1])
        self._walker.aim(self._house, col + 0.5, row + 0.5)
        self._turns = 0
        return True

    def _only_seen_from(self, order: list[int], needless: npt.NDArray[np.uint8]) -> list[int]:
        """Set the purpose to the cells that only the first place sees; return the tour without useless places (R3)."""
        seen = [self._views[self._starts[place] : self._starts[place + 1]] for place in order]
        times = np.zeros(self._house.size, np.int32)
        for cells in seen:
            times[cells] += 1
        for i, cells in enumerate(seen):
            self._purpose = cells[(needless[cells] == 0) & (times[cells] == 1)]
            if len(self._purpose):
                return order[i:]
            times[cells] -= 1
        return order  # not reached: the last place would see cells that no other does

    def _best_that_sees(self, lengths: Floats, first: int) -> int:
        """Return the place with the shortest path among the places that see the cells of the purpose (R3)."""
        others = np.ones(self._house.size, np.uint8)
        others[self._purpose] = 0
        enough = np.flatnonzero(
            count_new_cells_of_all(self._starts, self._views, others) >= SERVED_SHARE * len(self._purpose)
        )
        return int(enough[lengths[enough].argmin()]) if len(enough) else first

    def _lengths_from(self, place: int) -> Floats:
        """Return the distances from a place to all places."""
        if place not in self._lengths:
            row, col = divmod(int(self._places[place]), self._house.shape[1])
            find_distances(self._house, col + 0.5, row + 0.5, self._radius_px, -1, self._ways)
            self._lengths[place] = distances_to_cells(self._ways, self._places)
        return self._lengths[place]


def _views(world: World, robot: Robot) -> tuple[Cells, npt.NDArray[np.int64], Cells]:
    """Return places (flat indices), and the cells that they see in the form of ``list_visible_cells`` (R1)."""
    config = robot.config
    traversable = np.flatnonzero(world.traversable)
    rows, cols = np.divmod(traversable, world.occupied.shape[1])
    apart = max(LATTICE_M * config.pixels_per_metre, math.sqrt(len(traversable) / MAX_PLACES))
    _, first = np.unique(np.stack([rows // apart, cols // apart]), axis=1, return_index=True)
    places = traversable[np.sort(first)].astype(np.int32)
    occupied, wanted = world.occupied.copy(), world.observable.copy()
    starts, room = np.zeros(len(places) + 1, np.int64), 1 << 20
    range_px, scratch = config.laser.range_m * config.pixels_per_metre, make_scratch(config)
    views = np.empty(room, np.int32)
    while not list_visible_cells(occupied, wanted, places, range_px, scratch, starts, views):
        room *= 2
        views = np.empty(room, np.int32)
    return places, starts, views[: starts[-1]].copy()
