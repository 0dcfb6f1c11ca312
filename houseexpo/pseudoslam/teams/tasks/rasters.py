"""Number the cells of rooms or squares for tasks of teams, and draw rasters round robots for their observations."""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.raster import room_ids
from houseexpo.plan.room_labels import LABELS, UNLABELLED
from houseexpo.pseudoslam.envs.pictures import near_pixel_width, picture_side_px
from houseexpo.pseudoslam.envs.spec import EnvSpec
from houseexpo.pseudoslam.kernels.mapping import draw_coarse_view
from houseexpo.pseudoslam.teams.team import Team
from houseexpo.pseudoslam.worlds.maps import House
from houseexpo.pseudoslam.worlds.world import traversable_cells
from houseexpo.words import suggest_name

Grid = npt.NDArray[np.uint8]
Labels = npt.NDArray[np.int32]
_LEAST_SHARE = 0.25
"""The least share of a square that a piece of standing cells must have to count as a place."""


def check_room_names(names: Sequence[str] | None, key: str) -> None:
    """Raise ConfigError unless these are labels of rooms, or None."""
    known = [*LABELS, UNLABELLED]
    if names is not None and (isinstance(names, str) or not names):
        raise ConfigError(f"{key}: expected a list of labels of rooms or None (all), found {names!r}")
    for name in names or ():
        if name not in known:
            raise ConfigError(f"{key}: expected labels of rooms, found {name!r}" + suggest_name(str(name), known))


def find_standing_grid(team: Team) -> Grid:
    """Return 1 where the robot can stand, obstacles considered, like ``World.traversable``."""
    if np.array_equal(team.walls != 0, team.world.occupied != 0):
        return team.world.traversable
    return traversable_cells((team.walls != 0).view(np.uint8), team.radius_px)


def number_rooms(team: Team, house: House | None, names: Sequence[str] | None, key: str) -> Labels:
    """Return for each cell (rows, cols) the number of its room, from 1, and 0 for cells outside the rooms.

    Parameters
    ----------
    names
        The labels of the rooms that count; None for all.
    key
        The argument to be named in errors.

    Raises
    ------
    ConfigError
        The house has no rooms, since it is a map, or none with these labels.
    """
    if not isinstance(house, FloorPlan):
        raise ConfigError(f"{key}: expected plans with rooms, but {team.world.plan_id!r} is a map, which has none")
    plan = house.divided
    ids = room_ids(plan, team.world.frame)
    chosen = [room.id for room in plan.rooms if names is None or room.label in names]
    if not chosen:
        found = ", ".join(sorted({room.label for room in plan.rooms})) or "none"
        raise ConfigError(
            f"{key}: plan {plan.id!r} has no {' or '.join(names or ('room',))}; its rooms are {found}; choose others, "
            "or choose plans that have such rooms with plan_ids"
        )
    labels = np.zeros(ids.shape, np.int32)
    for number, room in enumerate(chosen, start=1):
        labels[ids == room] = number
    return labels


def number_squares(standing: Grid, side_px: float) -> Labels:
    """Return for each cell (rows, cols) the number of its square of standing cells, from 1, and 0 elsewhere.

    Squares are ``side_px`` wide. A wall divides a square into pieces; a piece of less than a quarter of the whole
    square does not count, unless the house is so small that there would be none.
    """
    rows, cols = standing.shape
    labels, number = np.zeros(standing.shape, np.int32), 0
    for least in (_LEAST_SHARE * side_px**2, 1.0):
        for top in range(math.ceil(rows / side_px)):
            for left in range(math.ceil(cols / side_px)):
                down, across = (slice(round(k * side_px), round((k + 1) * side_px)) for k in (top, left))
                square = down, across
                if not standing[square].any():
                    continue
                _, pieces, stats, _ = cv2.connectedComponentsWithStats(standing[square], connectivity=4)
                for piece in range(1, len(stats)):
                    if stats[piece, cv2.CC_STAT_AREA] >= least:
                        number += 1
                        labels[square][pieces == piece] = number
        if number:
            break
    return labels


def make_raster_space(spec: EnvSpec) -> spaces.Box:
    """Return the space of ``draw_rasters`` for one robot."""
    return spec.image_space(2, picture_side_px(spec.config))


def draw_rasters(team: Team, raster: Grid) -> Grid:
    """Return pictures of a raster (rows, cols) round each robot, (n, 2, side, side) uint8 in the layout of its maps.

    Both have the robot's heading by odometry up. The first shows the part of the near map, the second
    ``observation.far_size_m``. A pixel shows the highest value of its cells; outside the house, it is 0.
    """
    config = team.spec.config
    side = picture_side_px(config)
    found = np.zeros((len(team), 2, side, side), np.uint8)
    scales = near_pixel_width(config), config.observation.far_size_m * config.pixels_per_metre / side
    for k, state in enumerate(team.states):
        x, y, heading = state.believed_px.tolist()
        for channel, pixel in enumerate(scales):
            draw_coarse_view(raster, x, y, math.cos(heading), math.sin(heading), pixel, found[k, channel])
    return team.spec.in_layout(found)
