"""Make the state at the start of an episode: place obstacles, the robot, people and a goal in a world."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import GoalConfig, SimulatorConfig, StartConfig
from houseexpo.pseudoslam.kernels.collision import Disc, disc_is_free, placed_people
from houseexpo.pseudoslam.kernels.episode import StepParams
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE
from houseexpo.pseudoslam.kernels.people import mark_bodies
from houseexpo.pseudoslam.kernels.placement import count_before_rows, nth_cell
from houseexpo.pseudoslam.kernels.planning.fields import (
    FIELD_SIZES,
    GoalField,
    fast_march,
    find_open_blocks,
    goal_distance_at,
    no_goal_field,
)
from houseexpo.pseudoslam.kernels.tolerances import GOAL_BLOCK_M, GOAL_BLOCK_OF_RADIUS, START_TRIES
from houseexpo.pseudoslam.kernels.types import Grid, Scratch, as_read_only
from houseexpo.pseudoslam.state import State, new_episode
from houseexpo.pseudoslam.worlds.moving_obstacles import find_track_cells, new_bodies, start_people
from houseexpo.pseudoslam.worlds.place_obstacles import PlacedObstacles, place_obstacles
from houseexpo.pseudoslam.worlds.world import World, find_observable_cells

Floats = npt.NDArray[np.float64]


def make_initial_state(
    world: World,
    config: SimulatorConfig,
    params: StepParams,
    scratch: Scratch,
    rng: np.random.Generator,
    *,
    complete: bool = False,
    own: bool = True,
    pose_m: tuple[float, float, float] | None = None,
    view_px: int | None = None,
) -> State:
    """Return the state at the start of an episode in a world, before its first scan (``step_kernels.take_first_scan``).

    Parameters
    ----------
    complete
        Whether to draw also the overview and the ranges.
    own
        Whether the state has its own rasters; otherwise they may be the world's, which are read-only.
    pose_m
        The robot's start instead of the configured one: x, y in the plan's metres, heading in radians.
    view_px
        Number of cells per side of the view instead of the configured one.

    Raises
    ------
    ConfigError
        The configuration is not possible in this world.
    """
    key = int(rng.integers(2**62))
    placed = _place_obstacles(world, config, rng)
    bodies = new_bodies(len(world.tracks.times_s), config.people.number)
    occupied = placed.occupied.copy() if config.trajectories or config.people.number else placed.occupied
    if config.trajectories:
        mark_bodies(occupied, new_bodies(len(config.trajectories), 0), world.tracks, params.walk)
    pose = _random_pose(placed.traversable, occupied, world, config, rng)
    if pose_m is not None:
        pose = _given_pose(pose_m, placed.traversable, occupied, world, config, key="options['pose']")
    elif not config.start.random:
        pose = _given_pose(_start_m(config.start, world), placed.traversable, occupied, world, config)
    goal, field, best = _goal(config, placed.traversable, world, pose, rng)
    robot = Disc(float(pose[0]), float(pose[1]), params.robot.radius_px)
    if config.people.number:
        # a writable grid, as where people walk: the kernels are compiled once
        static = placed.occupied.copy() if config.trajectories else occupied
        start_people(config.people, static, bodies, world.tracks, world.flow, params.walk, key, robot, world.plan_id)
        mark_bodies(occupied, bodies._replace(people=placed_people(bodies.people)), world.tracks, params.walk)
    observable, observable_cells = _observable(world, placed, config, scratch)
    known = np.zeros(occupied.shape, np.uint8) if own or config.known_map else world.unknown
    if own and occupied is world.occupied:
        occupied = occupied.copy()
    if own and observable is world.observable:
        observable = observable.copy()
    side, cells = view_px or config.side_px, config.observation.global_cells if complete else 0
    beams = len(params.sensor.fan_cos) if complete else 0
    moving = bodies, world.tracks, world.flow, field
    episode = new_episode((occupied, observable, known), (side, cells, beams), pose, moving, key=key, best_px=best)
    state = State(episode, observable_cells, placed.obstacles, goal, best / config.pixels_per_metre)
    if config.known_map:
        episode.known[:] = np.where(placed.occupied != 0, OBSTACLE, FREE)
        episode.counts["known"], episode.counts["covered"] = occupied.size, observable_cells
    return state


def _place_obstacles(world: World, config: SimulatorConfig, rng: np.random.Generator) -> PlacedObstacles:
    """Place obstacles away from trajectories."""
    if not (config.obstacles.placed or config.obstacles.random):
        return PlacedObstacles(world.occupied, world.traversable, ())
    radius_px = config.robot.radius_m * config.pixels_per_metre
    if not len(world.tracks.times_s):
        return place_obstacles(
            world.occupied, world.traversable, world.frame, plan_id=world.plan_id,
            radius_px=radius_px, config=config.obstacles, rng=rng, free_before=world.free_before,
        )  # fmt: skip
    kept = find_track_cells(world.tracks, world.occupied.shape) & (world.occupied == 0)
    occupied = world.occupied | kept.view(np.uint8)
    placed = place_obstacles(
        occupied, world.traversable, world.frame, plan_id=world.plan_id,
        radius_px=radius_px, config=config.obstacles, rng=rng,
    )  # fmt: skip
    placed.occupied[kept] = 0
    return placed


def _observable(world: World, placed: PlacedObstacles, config: SimulatorConfig, scratch: Scratch) -> tuple[Grid, int]:
    """Return the cells that coverage counts, which are those that can be seen despite obstacles, and their number."""
    if not placed.obstacles:
        return world.observable, world.observable_cells
    radius_px, range_px = (size_m * config.pixels_per_metre for size_m in (config.robot.radius_m, config.laser.range_m))
    found = find_observable_cells(
        placed.occupied, placed.traversable, radius_px, range_px, buffers=scratch[:3], empty=world
    )
    return found, int(np.count_nonzero(found.view(bool)))


def _random_pose(
    traversable: npt.NDArray[np.uint8],
    occupied: npt.NDArray[np.uint8],
    world: World,
    config: SimulatorConfig,
    rng: np.random.Generator,
) -> Floats:
    """Return a random free pose in a standing cell, or the centre of one if none is found at random."""
    radius_px = config.robot.radius_m * config.pixels_per_metre
    standing = as_read_only(traversable)
    before = world.traversable_before if traversable is world.traversable else count_before_rows(standing, 1)
    for _ in range(START_TRIES):
        number = int(rng.integers(before[-1]))
        right, down, heading = rng.random(3).tolist()
        row, col = nth_cell(standing, 1, before, number)
        for x, y in ((col + right, row + down), (col + 0.5, row + 0.5)):
            if disc_is_free(occupied, x, y, radius_px):
                return np.array([x, y, (2.0 * heading - 1.0) * math.pi])
    raise ConfigError(
        f"start: no place for a robot of radius {config.robot.radius_m:g} m was found "
        f"in {START_TRIES} tries between the "
        f"moving obstacles of plan {world.plan_id!r}; configure fewer of them"
    )


def _start_m(start: StartConfig, world: World) -> tuple[float, float, float]:
    """Return the configured start: x, y in the plan's metres, heading in radians."""
    x_m, y_m = start.x_m, start.y_m
    if start.origin == "centre":
        centre = world.frame.points_from_pixels([world.frame.shape[1] / 2, world.frame.shape[0] / 2])
        x_m, y_m = x_m + float(centre[0]), y_m + float(centre[1])
    return x_m, y_m, math.radians(start.heading_deg)


def _given_pose(
    pose_m: tuple[float, float, float],
    traversable: npt.NDArray[np.uint8],
    occupied: npt.NDArray[np.uint8],
    world: World,
    config: SimulatorConfig,
    *,
    key: str = "start",
) -> Floats:
    """Return a pose in pixels; raise ConfigError, which names ``key``, if the robot cannot start there."""
    frame, radius_m = world.frame, config.robot.radius_m
    x_m, y_m, heading = pose_m
    x, y = frame.pixels_from_points([x_m, y_m]).tolist()
    row, col = math.floor(y), math.floor(x)
    if not bool(frame.contains([row, col])) or not disc_is_free(occupied, x, y, radius_m * config.pixels_per_metre):
        raise ConfigError(
            f"{key}: a robot of radius {radius_m:g} m does not fit at ({x_m:g}, {y_m:g}) m "
            f"in plan {world.plan_id!r}; start at random, or at another pose"
        )
    if not traversable[max(row - 1, 0) : row + 2, max(col - 1, 0) : col + 2].any():
        raise ConfigError(
            f"{key}: a robot of radius {radius_m:g} m cannot go from "
            f"({x_m:g}, {y_m:g}) m to the largest part of plan {world.plan_id!r}; start at random, or in that part"
        )
    return np.array([x, y, heading])


def _goal(
    config: SimulatorConfig,
    traversable: npt.NDArray[np.uint8],
    world: World,
    pose: Floats,
    rng: np.random.Generator,
) -> tuple[tuple[float, float] | None, GoalField, float]:
    """Return the goal (x, y) in metres, the distances to it, and the one from the start, pixels; None without a goal.

    A random goal is a standing cell with at least the configured walking distance from the start, or else the farthest.
    """
    if config.goal is None:
        return None, no_goal_field(), 0.0
    x, y = pose[0], pose[1]
    if config.goal.random:
        away = _ways(traversable, y, x, config)
        side, cols = int(away.sizes[0].side_px), int(away.sizes[0].cols)
        reached = np.where(np.isfinite(away.distances), away.distances, -1.0)
        far = np.flatnonzero(reached >= min(config.goal.least_way_m * config.pixels_per_metre, reached.max()))
        block = int(far[rng.integers(len(far))])
        row, col = block // cols * side, block % cols * side
        cells = np.argwhere(traversable[row : row + side, col : col + side])
        down, right = cells[rng.integers(len(cells))]
        goal_x, goal_y = col + right + 0.5, row + down + 0.5
    else:
        goal_x, goal_y = _given_goal(config.goal, traversable, world)
    field = _ways(traversable, goal_y, goal_x, config)
    goal = tuple(world.frame.points_from_pixels([goal_x, goal_y]).tolist())
    way, straight = float(goal_distance_at(field, x, y)), math.hypot(goal_x - x, goal_y - y)
    best = max(way, straight) if math.isfinite(way) else straight
    return (goal[0], goal[1]), field, best


def _given_goal(goal: GoalConfig, traversable: npt.NDArray[np.uint8], world: World) -> tuple[float, float]:
    x, y = world.frame.pixels_from_points([goal.x_m, goal.y_m]).tolist()
    row, col = math.floor(y), math.floor(x)
    if not bool(world.frame.contains([row, col])) or not traversable[row, col]:
        raise ConfigError(
            f"goal: the robot cannot stand at ({goal.x_m:g}, {goal.y_m:g}) m in plan {world.plan_id!r}, or cannot "
            "get there; set another goal, or a random one"
        )
    return x, y


def _ways(traversable: npt.NDArray[np.uint8], y: float, x: float, config: SimulatorConfig) -> GoalField:
    """Return the distances to a place; paths do not cross even thin walls if the robot's radius is at least a cell."""
    ppm = config.pixels_per_metre
    side = max(min(round(GOAL_BLOCK_M * ppm), int(GOAL_BLOCK_OF_RADIUS * config.robot.radius_m * ppm)), 1)
    shape = math.ceil(traversable.shape[0] / side), math.ceil(traversable.shape[1] / side)
    is_open, distances = np.zeros(shape, np.uint8), np.empty(shape, np.float32)
    find_open_blocks(as_read_only(traversable), side, is_open)
    fast_march(is_open, int(y) // side, int(x) // side, side, distances)
    return GoalField(np.array([(*shape, side)], FIELD_SIZES), distances.ravel())
