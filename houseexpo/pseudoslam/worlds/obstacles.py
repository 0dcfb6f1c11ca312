"""Setting obstacles down in a house (section III-E): never into each other or a wall, never so that they close it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from houseexpo.errors import ConfigError
from houseexpo.grids.frame import GridFrame
from houseexpo.pseudoslam.config.obstacles import ObstaclesConfig, RandomObstacles
from houseexpo.pseudoslam.config.shapes import Obstacle
from houseexpo.pseudoslam.kernels.placement.cells import count_before, nth_cell
from houseexpo.pseudoslam.kernels.placement.obstacles import FITS, OVERLAPS, set_down
from houseexpo.pseudoslam.kernels.types import Cells, Counts, Grid

_TRIES = 100  # places for one obstacle
_ROUNDS = 3  # times that all is cleared away, and begun anew


@dataclass(frozen=True, eq=False)
class Placement:
    """A house with its obstacles; arrays are (rows, cols) uint8.

    Parameters
    ----------
    occupied
        1 in walls, obstacles and outside.
    traversable
        1 where the robot can still stand and walk to all other such cells.
    obstacles
        Those told and those drawn, in this order.
    """

    occupied: Grid
    traversable: Grid
    obstacles: tuple[Obstacle, ...]


def place(
    occupied: Grid,
    traversable: Grid,
    frame: GridFrame,
    *,
    plan_id: str,
    radius_px: float,
    config: ObstaclesConfig,
    rng: np.random.Generator,
    free_before: Counts | None = None,
    into: Placement | None = None,
) -> Placement:
    """Set obstacles down so that the robot can still go everywhere.

    - R1: no two obstacles share a cell, nor does one share a cell with a wall; random ones keep ``gap_m``, from the
      cells' near sides.
    - R2: the cells where the robot can stand stay one piece. Pieces with less area than the robot's own disc are no
      place to be: they may be cut off, and are given up.
    - R3: a random obstacle that breaks R1 or R2 is drawn again, shape, size, heading and place (evenly over the free
      cells), 100 times; then all random ones are cleared away, and it begins anew, 3 times.

    Parameters
    ----------
    occupied
        (rows, cols), 1 in walls and outside; the border is.
    traversable
        1 where the middle of a robot of ``radius_px`` can be, one piece, as ``traversable_cells`` finds it.
    plan_id
        What errors call the house.
    rng
        Drawn from only for random obstacles.
    free_before
        ``count_before`` of the free cells, if it is known.
    into
        Another placement in a house of this shape, done with: its arrays are written over and returned.

    Raises
    ------
    ConfigError
        Where an obstacle was told to stand where it cannot, or too few of the random ones find a place.
    """
    low, high = config.random.number if config.random else (0, 0)
    wanted = int(rng.integers(low, high, endpoint=True)) if config.random else 0
    before = count_before(occupied, 0) if free_before is None else free_before
    most = 0
    for enough in (*[wanted] * (_ROUNDS - 1), low):
        house = _House(occupied, traversable, frame, radius_px, into)
        _set_down_told(house, config.placed, plan_id)
        drawn = _set_down_drawn(house, before, config.random, wanted, rng) if config.random else []
        if len(drawn) >= enough:
            return Placement(house.occupied, house.traversable, (*config.placed, *drawn))
        most = max(most, len(drawn))
    raise ConfigError(
        f"obstacles.random.number: at most {most} of {wanted} obstacles found a place in "
        f"{np.count_nonzero(occupied == 0) * frame.cell_m**2:.1f} m2 of free space of plan {plan_id!r} without "
        f"closing off a part of it for the robot, of at least {low}; ask for fewer (the low end of number), "
        "for smaller ones (size_m) or a smaller gap (gap_m)"
    )


class _House:
    """A copy of the rasters that obstacles are set down in, and scratch memory."""

    def __init__(
        self, occupied: Grid, traversable: Grid, frame: GridFrame, radius_px: float, into: Placement | None
    ) -> None:
        self.occupied, self.traversable = (
            (into.occupied, into.traversable) if into else (np.empty_like(occupied), np.empty_like(traversable))
        )
        np.copyto(self.occupied, occupied)
        np.copyto(self.traversable, traversable)
        self.frame, self.empty = frame, occupied
        self._robot = _disc(radius_px, 0.5)  # from the middle of a cell to the near side of another
        self._least = math.ceil(math.pi * radius_px**2)
        self._scratch = np.empty((3, occupied.size), np.int32)

    def set_down(self, obstacle: Obstacle, gap_m: float = 0.0) -> int:
        """Set an obstacle down where it can be; return what became of it."""
        spans, count, inside = obstacle.spans(self.frame)
        if not inside:
            return OVERLAPS
        gap = _disc(gap_m * self.frame.pixels_per_metre, 1.0)
        return int(
            set_down(self.occupied, self.traversable, spans, count, gap, self._robot, self._least, self._scratch)
        )


def _set_down_told(house: _House, placed: tuple[Obstacle, ...], plan_id: str) -> None:
    """Set the obstacles down whose places are told; ConfigError at the first that cannot be there."""
    for i, obstacle in enumerate(placed):
        verdict = house.set_down(obstacle)
        if verdict != FITS:
            where = f"obstacles.placed[{i}]: the {type(obstacle.shape).__name__.lower()} at "
            where += f"({obstacle.x_m:g}, {obstacle.y_m:g}) m in plan {plan_id!r}"
            if verdict != OVERLAPS:
                raise ConfigError(
                    f"{where} leaves the robot no way to a part of the house; move it, or make it smaller"
                )
            mask = obstacle.mask(house.frame)
            others = [f"obstacles.placed[{j}]" for j in range(i) if (mask & placed[j].mask(house.frame)).any()]
            what = others[0] if others else "a wall, or lies outside"
            raise ConfigError(f"{where} overlaps {what}; move it, or make it smaller")


def _set_down_drawn(
    house: _House, before: Counts, config: RandomObstacles, wanted: int, rng: np.random.Generator
) -> list[Obstacle]:
    """Set random obstacles down, up to the first that finds no place."""
    n_free = int(before[-1])
    found: list[Obstacle] = []
    for _ in range(wanted if n_free else 0):
        for _ in range(_TRIES):
            at, right, down, turn = rng.random(4).tolist()
            row, col = nth_cell(house.empty, 0, before, int(at * n_free))
            x_m, y_m = house.frame.point_from_pixel(col + right, row + down)
            obstacle = Obstacle(config.draw_shape(rng), x_m, y_m, 360.0 * turn)
            if house.set_down(obstacle, config.gap_m) == FITS:
                found.append(obstacle)
                break
        else:
            break
    return found


@lru_cache(maxsize=64)
def _disc(radius_px: float, near_px: float) -> Cells:
    """Return a disc of cells as half its width so many rows from the middle, -1 for none.

    A cell is in it where its centre, taken ``near_px`` nearer along each axis, lies within; the middle always is.
    """
    offsets = np.maximum(np.arange(math.ceil(radius_px + near_px) + 1) - near_px, 0.0)
    widths: Cells = (np.hypot(offsets[:, None], offsets) < radius_px - 1e-9).sum(axis=1, dtype=np.int32) - 1
    widths[0] = max(widths[0], 0)
    return widths
