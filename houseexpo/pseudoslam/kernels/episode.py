"""The arrays of one environment, what their columns hold, and what is the same in all steps."""

from __future__ import annotations

from typing import NamedTuple

from numba import njit

from houseexpo.pseudoslam.kernels.hashing import uniform
from houseexpo.pseudoslam.kernels.motion.bodies import Bodies, Tracks, bodies_of, tracks_of
from houseexpo.pseudoslam.kernels.people.social_force import Walk
from houseexpo.pseudoslam.kernels.planning.distance_field import Field, field_of
from houseexpo.pseudoslam.kernels.planning.flow import Flow, flow_of
from houseexpo.pseudoslam.kernels.planning.plan import Graph, PlanRules, Plans, graph_of, plans_of
from houseexpo.pseudoslam.kernels.types import Counts, Errors, Floats, Grid, Robot, Rows, Sensor, row_type

POSE = row_type(x=float, y=float, heading=float, seen_x=float, seen_y=float, seen_heading=float)
"""Pixels and radians: where the robot is, and where it believes it is."""
COUNTS = row_type(steps=int, collisions=int, known=int, covered=int, scans=int, blocked=int, key=int)
"""Steps and those that met an obstacle; cells of the map; scans; whether the last step met an obstacle; the key of the
episode's noise."""
READINGS = row_type(path_length=float, clearance=float, to_goal=float, start_x=float, start_y=float)
"""Pixels: the way gone, the room round the robot, the way that is left to the goal, and where the episode started."""
BEAMS, ODOMETRY, REGISTRATION, PEOPLE = range(1, 5)
"""Kinds of chance, each with a key of its own (``key_of``)."""


class Episode(NamedTuple):
    """The arrays of one environment. In a pool each has one axis more in front, and rasters lie flat, with room."""

    occupied: Grid
    """(rows, cols), not 0 where an obstacle is; the border is."""
    observable: Grid
    """(rows, cols), 1 where a cell counts for coverage."""
    known: Grid
    """(rows, cols) the map."""
    shown: Grid
    """(side, side) what the robot is shown."""
    overview: Grid
    """(cells, cells) the whole map, coarsely; (0, 0) where nobody asks."""
    ranges: Floats
    """(beams,) what the last scan's beams returned, pixels; (0,) where nobody asks."""
    pose: Rows
    """(1,) ``POSE``; in a kernel's view of one environment the row itself, as the next two."""
    counts: Rows
    """(1,) ``COUNTS``."""
    readings: Rows
    """(1,) ``READINGS``."""
    bodies: Bodies
    tracks: Tracks
    flow: Flow
    field: Field
    plans: Plans
    graph: Graph


class StepParams(NamedTuple):
    """What is the same for all environments: the robot and its sensor, their errors, and what moves beside it."""

    robot: Robot
    sensor: Sensor
    errors: Errors
    walk: Walk
    seconds: float
    clearance_px: float
    overview_px: float
    """Pixels along the side of an overview's cell."""
    plan: PlanRules


@njit(inline="always")
def episode_of(pool: Episode, sizes: Counts, i: int) -> Episode:
    """Return environment ``i`` of a pool, views of its arrays."""
    rows, cols = sizes[i, 0], sizes[i, 1]
    cells = rows * cols
    return Episode(
        pool.occupied[i, :cells].reshape((rows, cols)), pool.observable[i, :cells].reshape((rows, cols)),
        pool.known[i, :cells].reshape((rows, cols)), pool.shown[i], pool.overview[i], pool.ranges[i],
        pool.pose[i, 0], pool.counts[i, 0], pool.readings[i, 0], bodies_of(pool.bodies, i), tracks_of(pool.tracks, i),
        flow_of(pool.flow, i), field_of(pool.field, i), plans_of(pool.plans, i),
        graph_of(pool.graph, i),
    )  # fmt: skip


@njit(inline="always")
def key_of(key: int, kind: int) -> int:
    """Return the key of one kind of noise."""
    return int(uniform(key, kind + 0) * 4611686018427387904.0)  # for each constant numba would compile anew
