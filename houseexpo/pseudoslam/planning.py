"""Planning on a robot's own map: where it can stand, how far away that is, and where the frontiers are."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.kernels.planning.frontiers import find_frontiers
from houseexpo.pseudoslam.kernels.planning.known_ways import find_ways, trace
from houseexpo.pseudoslam.kernels.planning.plan import FRONTIER, STRAIGHT
from houseexpo.pseudoslam.plan_rules import LARGE_M, frontier_rules
from houseexpo.pseudoslam.step_params import scratch_of, with_room


class MapPlanner:
    """A planner for one map at a time. It has its own memory, so that each thread needs its own object.

    Cells are flat indices of the map, ``row * cols + col``; the centre of a cell is at (col + 0.5, row + 0.5).

    Parameters
    ----------
    config
        The robot's radius, the laser's range and the resolution are used.
    most
        Largest number of frontiers to return.
    large_m, least_m
        Clusters at least ``large_m`` long come first; those shorter than ``least_m`` are left out.

    Examples
    --------
    >>> planner = MapPlanner(SimulatorConfig())
    >>> x, y, _ = state.believed_px  # doctest: +SKIP
    >>> frontiers = planner.frontiers(state.known, x, y)  # doctest: +SKIP
    >>> path = planner.path(frontiers["goal"][0])  # doctest: +SKIP
    """

    def __init__(
        self, config: SimulatorConfig, *, most: int = 256, large_m: float = LARGE_M, least_m: float = 0.0
    ) -> None:
        self._rules = frontier_rules(config, large_m, least_m)
        self._cell_m = 1.0 / config.pixels_per_metre
        self._scratch = scratch_of(config)
        self._table = np.zeros(most, FRONTIER)
        self._shape = (0, 0)

    def frontiers(self, known: npt.NDArray[np.uint8], x: float, y: float, given_up: Sequence[int] = ()) -> Any:
        """Return the frontiers of a map, (n,) records ``FRONTIER`` in the order of ``kernels.planning.frontiers``.

        They are valid until the next call. ``goal`` is the cell to stand on, ``middle`` the cell to look at, ``cells``
        the size, and ``way`` the distance to the goal (``metres`` converts it). Cells within the robot's radius of
        those ``given_up`` are not frontiers. This also computes the distances of ``find_ways``.
        """
        self._prepare(known)
        lost = np.asarray(given_up, np.int32)
        n = find_frontiers(known, float(x), float(y), self._rules, lost, self._scratch, self._table)
        return self._table[:n]

    def find_ways(self, known: npt.NDArray[np.uint8], x: float, y: float, until: int = -1) -> None:
        """Compute only the distances to cells: those up to the cell ``until``, or all of them."""
        self._prepare(known)
        find_ways(known, float(x), float(y), self._rules.radius_px, int(until), self._scratch.ways)

    @property
    def ways(self) -> npt.NDArray[np.int32]:
        """The distance to each cell (rows, cols), in the units of ``KnownWays.ways``, valid until the next call."""
        return self._scratch.ways.ways[: self._shape[0] * self._shape[1]].reshape(self._shape)

    def path(self, cell: int) -> npt.NDArray[np.int32]:
        """Return the cells on the shortest path from the robot to a cell, none if there is no path."""
        path = np.empty(max(self._shape[0] * self._shape[1], 1), np.int32)
        return path[: trace(self._scratch.ways, int(cell), path)]

    def metres(self, ways: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
        """Convert distances to metres."""
        found: npt.NDArray[np.float64] = ways * (self._cell_m / STRAIGHT)
        return found

    def _prepare(self, known: npt.NDArray[np.uint8]) -> None:
        """Allocate memory for a map, if needed."""
        self._scratch = with_room(self._scratch, known.size)
        self._shape = known.shape
