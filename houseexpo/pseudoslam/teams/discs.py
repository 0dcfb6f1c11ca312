"""Mark the cells of robots, and check where they start."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.kernels.collision import mark_disc

ROBOTS_MOST: Final = 16
"""The largest number of robots in one house."""


def mark_discs(occupied: npt.NDArray[np.uint8], centres_px: npt.NDArray[np.float64], radius_px: float) -> None:
    """Mark the cells of discs, whose centres are (n, 2) pixels, as occupied by something that moves."""
    for x, y in centres_px.reshape(-1, 2).tolist():
        mark_disc(occupied, x, y, max(radius_px, 1.0))


def check_start_apart(
    number: int, start: tuple[float, float, float], others_m: npt.NDArray[np.float64], radius_m: float
) -> None:
    """Raise ConfigError if a robot's start overlaps one of the robots before it, whose centres are (n, 2) metres."""
    for other, (x, y) in enumerate(others_m.tolist()):
        if math.hypot(start[0] - x, start[1] - y) < 2.0 * radius_m:
            raise ConfigError(
                f"starts: robot {number + 1} at ({start[0]:g}, {start[1]:g}) m overlaps robot {other + 1} at "
                f"({x:g}, {y:g}) m; leave at least {2.0 * radius_m:g} m between their centres"
            )


def no_room_error(number: int, robots: int, radius_m: float, plan_id: str) -> ConfigError:
    """Return the error of a house in which no place is left for a robot."""
    return ConfigError(
        f"robots: there is no room for robot {number + 1} of {robots} with a radius of {radius_m:g} m in plan "
        f"{plan_id!r}; take fewer or smaller robots, or a larger house"
    )
