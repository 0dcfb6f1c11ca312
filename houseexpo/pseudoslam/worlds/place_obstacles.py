"""Place obstacles in a house (section III-E) so that they neither overlap each other or walls nor divide the house."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from houseexpo.errors import ConfigError
from houseexpo.grids.frame import GridFrame
from houseexpo.pseudoslam.config.obstacles import Obstacle, ObstaclesConfig, RandomObstacles
from houseexpo.pseudoslam.kernels.placement import FITS, OVERLAPS, count_before_rows, nth_cell, place_obstacle
from houseexpo.pseudoslam.kernels.tolerances import OBSTACLE_ROUNDS, OBSTACLE_TRIES
from houseexpo.pseudoslam.kernels.types import Cells, Counts, Grid, as_read_only


@dataclass(frozen=True, eq=False)
class PlacedObstacles:
    """A house with its obstacles; arrays are (rows, cols) uint8.

    Parameters
    ----------
    occupied
        1 in walls and obstacles, and outside.
    traversable
        1 for cells where the robot can still stand and from which it can go to all other such cells.
    obstacles
        The configured obstacles, followed by the random obstacles.
    """

    occupied: Grid
    traversable: Grid
    obstacles: tuple[Obstacle, ...]


def place_obstacles(
    occupied: Grid,
    traversable: Grid,
    frame: GridFrame,
    *,
    plan_id: str,
    radius_px: float,
    config: ObstaclesConfig,
    rng: np.random.Generator,
    free_before: Counts | None = None,
    into: PlacedObstacles | None = None,
) -> PlacedObstacles:
    """Place obstacles so that the robot can still go everywhere.

    - R1: no two obstacles share a cell, and none shares a cell with a wall; random ones keep a distance of ``gap_m``,
      measured from the near sides of cells.
    - R2: the cells where the robot can stand remain connected. Pieces with less area than the robot's own disc may be
      cut off; they are then no longer traversable.
    - R3: a random obstacle that violates R1 or R2 is drawn again, up to 100 times, with a new shape, size, heading and
      place (uniform over the free cells). After that, all random obstacles are removed and placed again, up to 3 times.

    Parameters
    ----------
    occupied
        (rows, cols), 1 in walls and outside, including the border.
    traversable
        1 for cells where the centre of a robot of ``radius_px`` can be, connected, from ``traversable_cells``.
    plan_id
        The name of the house in errors.
    rng
        The generator for random obstacles.
    free_before
        ``count_before_rows`` of the free cells, if it is known.
    into
        A former placement in a house of the same shape, whose arrays are overwritten and returned.

    Raises
    ------
    ConfigError
        A configured obstacle cannot be at its place, or there is no place for enough random ones.
    """
    low, high = config.random.number if config.random else (0, 0)
    wanted = int(rng.integers(low, high, endpoint=True)) if config.random else 0
    before = count_before_rows(as_read_only(occupied), 0) if free_before is None else free_before
    most = 0
    for enough in (*[wanted] * (OBSTACLE_ROUNDS - 1), low):
        house = _House(occupied, traversable, frame, radius_px, into)
        _place_configured(house, config.placed, plan_id)
        drawn = _place_random(house, before, config.random, wanted, rng) if config.random else []
        if len(drawn) >= enough:
            return PlacedObstacles(house.occupied, house.traversable, (*config.placed, *drawn))
        most = max(most, len(drawn))
    raise ConfigError(
        f"obstacles.random.number: at most {most} of {wanted} obstacles found a place in "
        f"{np.count_nonzero(occupied == 0) * frame.cell_m**2:.1f} m² of free space of plan {plan_id!r} without "
        f"closing off a part of it for the robot, of at least {low}; ask for fewer (the low end of number), "
        "for smaller ones (size_m) or a smaller gap (gap_m)"
    )


class _House:
    """A copy of the rasters for placing obstacles, and working memory."""

    def __init__(
        self, occupied: Grid, traversable: Grid, frame: GridFrame, radius_px: float, into: PlacedObstacles | None
    ) -> None:
        self.occupied, self.traversable = (
            (into.occupied, into.traversable) if into else (np.empty_like(occupied), np.empty_like(traversable))
        )
        np.copyto(self.occupied, occupied)
        np.copyto(self.traversable, traversable)
        self.frame, self.empty = frame, as_read_only(occupied)
        self._robot = _disc(radius_px, 0.5)  # from the centre of a cell to the near side of another
        self._least = math.ceil(math.pi * radius_px**2)
        self._scratch = np.empty((3, occupied.size), np.int32)

    def set_down(self, obstacle: Obstacle, gap_m: float = 0.0) -> int:
        """Place an obstacle if possible; return the outcome."""
        spans, count, inside = obstacle.spans(self.frame)
        if not inside:
            return OVERLAPS
        gap = _disc(gap_m * self.frame.pixels_per_metre, 1.0)
        return int(
            place_obstacle(self.occupied, self.traversable, spans, count, gap, self._robot, self._least, self._scratch)
        )


def _place_configured(house: _House, placed: tuple[Obstacle, ...], plan_id: str) -> None:
    """Place the configured obstacles; raise ConfigError for the first obstacle that cannot be at its place."""
    for i, obstacle in enumerate(placed):
        verdict = house.set_down(obstacle)
        if verdict != FITS:
            where = f"obstacles.placed[{i}]: the {type(obstacle.shape).__name__.lower()} at "
            where += f"({obstacle.x_m:g}, {obstacle.y_m:g}) m in plan {plan_id!r}"
            if verdict != OVERLAPS:
                raise ConfigError(f"{where} closes off a part of the house for the robot; move it, or make it smaller")
            mask = obstacle.mask(house.frame)
            others = [f"obstacles.placed[{j}]" for j in range(i) if (mask & placed[j].mask(house.frame)).any()]
            what = others[0] if others else "a wall, or lies outside"
            raise ConfigError(f"{where} overlaps {what}; move it, or make it smaller")


def _place_random(
    house: _House, before: Counts, config: RandomObstacles, wanted: int, rng: np.random.Generator
) -> list[Obstacle]:
    """Place random obstacles, up to the first one without a place."""
    n_free = int(before[-1])
    found: list[Obstacle] = []
    for _ in range(wanted if n_free else 0):
        for _ in range(OBSTACLE_TRIES):
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
    """Return a disc of cells as half its width at each distance in rows from the centre, -1 for none.

    A cell is in it if its centre, moved closer by ``near_px`` along each axis, lies within; the centre always is.
    """
    offsets = np.maximum(np.arange(math.ceil(radius_px + near_px) + 1) - near_px, 0.0)
    widths: Cells = (np.hypot(offsets[:, None], offsets) < radius_px - 1e-9).sum(axis=1, dtype=np.int32) - 1
    widths[0] = max(widths[0], 0)
    return widths
