"""Define the arrays and records of an episode and the parameters of steps; slice one environment out of a pool."""

from __future__ import annotations

from typing import NamedTuple

from numba import njit

from houseexpo.pseudoslam.kernels.body_tracks import Bodies, Tracks
from houseexpo.pseudoslam.kernels.collision import placed_people
from houseexpo.pseudoslam.kernels.hashing import uniform
from houseexpo.pseudoslam.kernels.people import WalkParams
from houseexpo.pseudoslam.kernels.planning.fields import FlowField, GoalField
from houseexpo.pseudoslam.kernels.planning.planner_types import Graph, PlannerMemory, PlannerRules
from houseexpo.pseudoslam.kernels.types import Counts, Drive, Errors, Floats, Grid, Robot, Rows, Sensor, make_row_dtype

POSE = make_row_dtype(x=float, y=float, heading=float, seen_x=float, seen_y=float, seen_heading=float)
"""The robot's pose and the believed pose, pixels and radians."""
COUNTS = make_row_dtype(steps=int, collisions=int, known=int, covered=int, scans=int, blocked=int, key=int)
"""Counts of steps, of collisions, of known cells and of scans; whether an obstacle blocked the last step; the key of
the episode's noise."""
READINGS = make_row_dtype(
    path_length=float, clearance=float, to_goal=float, start_x=float, start_y=float, speed=float, turning=float,
    bias=float,
)  # fmt: skip
"""The distance travelled, the clearance, the remaining distance to the goal, and the start, pixels; a drive's speed,
pixels per second, and its speed of turning, radians per second, or its steering angle, radians; and the rate at which
the heading by odometry drifts, radians per second."""
BEAMS, ODOMETRY, REGISTRATION, PEOPLE, MODEL, SLIP, BIAS = range(1, 8)
"""Kinds of random numbers, each with its own key (``noise_key``)."""


class Episode(NamedTuple):
    """The arrays of one environment. In a pool, each has an additional first axis, and rasters are flat and padded."""

    occupied: Grid
    """(rows, cols), not 0 for obstacles, including the border."""
    observable: Grid
    """(rows, cols), 1 for cells that count for coverage."""
    known: Grid
    """(rows, cols), the map."""
    shown: Grid
    """(side, side), the view."""
    overview: Grid
    """(cells, cells), the overview of the whole map; (0, 0) if it is not observed."""
    ranges: Floats
    """(beams,), the ranges of the last scan, pixels; (0,) if they are not observed."""
    fresh: Grid
    """(chunks,), 1 where a step has made cells of the map known, see ``mapping.CHUNK``; (0,) outside teams."""
    pose: Rows
    """(1,) ``POSE``; in a kernel's view of one environment, this and the next two are the records themselves."""
    counts: Rows
    """(1,) ``COUNTS``."""
    readings: Rows
    """(1,) ``READINGS``."""
    bodies: Bodies
    tracks: Tracks
    flow: FlowField
    field: GoalField
    plans: PlannerMemory
    graph: Graph


class StepParams(NamedTuple):
    """The parameters of all environments: the robot, its sensor, their noise, and moving obstacles."""

    robot: Robot
    sensor: Sensor
    errors: Errors
    walk: WalkParams
    seconds: float
    clearance_px: float
    overview_px: float
    """Side of an overview's cell, pixels."""
    plan: PlannerRules
    drive: Drive


@njit(inline="always")
def slice_episode(pool: Episode, sizes: Counts, i: int) -> Episode:
    """Return environment ``i`` of a pool, as views of its arrays; of people, only those who have a place."""
    rows, cols = sizes[i, 0], sizes[i, 1]
    cells = rows * cols
    bodies, tracks, flow, field, plans, graph = pool.bodies, pool.tracks, pool.flow, pool.field, pool.plans, pool.graph
    return Episode(
        pool.occupied[i, :cells].reshape((rows, cols)), pool.observable[i, :cells].reshape((rows, cols)),
        pool.known[i, :cells].reshape((rows, cols)), pool.shown[i], pool.overview[i], pool.ranges[i], pool.fresh[i],
        pool.pose[i, 0], pool.counts[i, 0], pool.readings[i, 0],
        Bodies(bodies.clocks[i], placed_people(bodies.people[i]), bodies.robots[i]),
        Tracks(tracks.times_s[i], tracks.poses[i], tracks.corners[i], tracks.shapes[i]),
        FlowField(flow.sizes[i], flow.toward[i], flow.spots[i], flow.goals[i]),
        GoalField(field.sizes[i], field.distances[i]),
        PlannerMemory(plans.frontiers[i], plans.given_up[i], plans.state[i]),
        Graph(graph.nodes[i], graph.edges[i], graph.visited[i], graph.state[i]),
    )  # fmt: skip


@njit(inline="always")
def noise_key(key: int, kind: int) -> int:
    """Return the key of one kind of noise."""
    return int(uniform(key, kind + 0) * 4611686018427387904.0)  # numba would compile again for each constant
