"""Make the state at the start of an episode: place obstacles, the robot, people and a goal in a world."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import GoalConfig, SimulatorConfig, StartConfig
from houseexpo.pseudoslam.kernels.collision import Disc, disc_is_free, placed_people
from houseexpo.pseudoslam.kernels.episode import StepParams
from houseexpo.pseudoslam.kernels.people import mark_bodies
from houseexpo.pseudoslam.kernels.placement import count_before_rows, nth_cell
from houseexpo.pseudoslam.kernels.planning.goal_paths import (
    GOAL_CELL,
    CornerGraph,
    GoalPaths,
    find_goal_paths,
    goal_distance_at,
    make_corner_graph,
    nearest_place,
    no_goal_paths,
)
from houseexpo.pseudoslam.kernels.tolerances import GOAL_LINE_M, GOAL_TRIES, START_TRIES
from houseexpo.pseudoslam.kernels.types import Counts, Grid, Scratch, as_read_only
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
    last: State | None = None,
    pose_m: tuple[float, float, float] | None = None,
    view_px: int | None = None,
    blocks_px: tuple[int, int, int] = (0, 0, 0),
) -> State:
    """Return the state at the start of an episode in a world, before its first scan (``step_kernels.take_first_scan``).

    Parameters
    ----------
    complete
        Whether to draw also the overview and the ranges.
    own
        Whether the state has its own rasters; otherwise they may be the world's, which are read-only.
    last
        The state of an earlier episode in this world, with the same configuration, in which nothing is placed and
        nothing moves. Its arrays are used again, so that the cost does not grow with the house.
    pose_m
        The robot's start instead of the configured one: x, y in the plan's metres, heading in radians.
    view_px
        Number of cells per side of the view instead of the configured one.
    blocks_px
        The side of the blocks that are kept for pictures, cells (``state.new_episode``).

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
    goal, number, paths, best = _goal(config, placed, world, pose, rng)
    robot = Disc(float(pose[0]), float(pose[1]), params.robot.radius_px)
    if config.people.number:
        # a writable grid, as where people walk: the kernels are compiled once
        static = placed.occupied.copy() if config.trajectories else occupied
        start_people(config.people, static, bodies, world.tracks, world.flow, params.walk, key, robot, world.plan_id)
        mark_bodies(occupied, bodies._replace(people=placed_people(bodies.people)), world.tracks, params.walk)
    observable, observable_cells = _observable(world, placed, config, scratch)
    known = _first_map(world, placed.occupied, config, last, own=own)
    if own and occupied is world.occupied:
        occupied = occupied.copy() if last is None else last.occupied
    if own and observable is world.observable:
        observable = observable.copy() if last is None else last.episode.observable
    side, cells = view_px or config.side_px, config.observation.global_cells if complete else 0
    beams = len(params.sensor.fan_cos) if complete else 0
    moving = bodies, world.tracks, world.flow, paths
    episode = new_episode(
        (occupied, observable, known), (side, cells, beams), pose, moving, key=key, best_px=best, blocks_px=blocks_px
    )
    state = State(episode, observable_cells, placed.obstacles, goal, best / config.pixels_per_metre, number)
    if config.known_map:
        episode.counts["known"], episode.counts["covered"] = known[world.inside_margin].size, observable_cells
        episode.changed[:] = 0, known.shape[0], 0, known.shape[1]
    return state


def _first_map(world: World, occupied: Grid, config: SimulatorConfig, last: State | None, *, own: bool) -> Grid:
    """Return the map (rows, cols) at the start: the last one, cleared where scans have drawn, or a new one."""
    if occupied is not world.occupied and config.known_map:
        return world.map_of(occupied)
    first = world.known if config.known_map else world.unknown
    if last is None:
        return first.copy() if own else first
    scanned = slice(last.counts.low, last.counts.high)
    last.known.reshape(-1)[scanned] = first.reshape(-1)[scanned]
    return last.known


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
    """Return the cells that coverage counts, that is, those visible despite obstacles, and their number."""
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
    """Return a random free pose in a standing cell, or the centre of a standing cell if random tries fail."""
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
    placed: PlacedObstacles,
    world: World,
    pose: Floats,
    rng: np.random.Generator,
) -> tuple[tuple[float, float] | None, int, GoalPaths, float]:
    """Return the goal (x, y) in metres, its number, the paths to it, and the one from the start, pixels.

    Without a goal, they are None, -1, no paths and 0. A random goal is a standing cell with at least the configured
    walking distance from the start, or else the farthest of ``GOAL_TRIES``. For a goal of a kind, it is the place where
    the shortest way leads into its region.
    """
    if config.goal is None:
        return None, -1, no_goal_paths(), 0.0
    x, y = float(pose[0]), float(pose[1])
    traversable, ppm = placed.traversable, config.pixels_per_metre
    radius_px = config.robot.radius_m * ppm
    if traversable is world.traversable:
        graph, before = world.corner_graph(radius_px), world.traversable_before
    else:
        graph = make_corner_graph(traversable.copy(), placed.occupied.copy(), radius_px, GOAL_LINE_M * ppm)
        before = count_before_rows(as_read_only(traversable), 1)
    number, inside = -1, None
    if config.goal_region:
        number, (goal_x, goal_y), inside = _region_goal(config, graph, world, (x, y), rng)
    elif config.goal.random:
        goal_x, goal_y = _random_goal(config, graph, before, (x, y), rng)
    else:
        goal_x, goal_y = _given_goal(config.goal, traversable, world)
    paths = find_goal_paths(graph, goal_x, goal_y)
    if inside is not None:
        paths = paths._replace(standing=np.where(inside, np.uint8(GOAL_CELL), graph.standing).ravel())
    goal = tuple(world.frame.points_from_pixels([goal_x, goal_y]).tolist())
    way, straight = float(goal_distance_at(paths, x, y)), math.hypot(goal_x - x, goal_y - y)
    best = max(way, straight) if math.isfinite(way) else straight
    return (goal[0], goal[1]), number, paths, best


def _region_goal(
    config: SimulatorConfig, graph: CornerGraph, world: World, start: tuple[float, float], rng: np.random.Generator
) -> tuple[int, tuple[float, float], npt.NDArray[np.bool_]]:
    """Return the number of a kind that is far enough from the start, the nearest place of the kind, and its cells."""
    goal = config.goal_region or GoalConfig()
    from_start, standing = find_goal_paths(graph, *start), graph.standing != 0
    least_px = goal.least_way_m * config.pixels_per_metre
    found: list[tuple[float, int, tuple[float, float], npt.NDArray[np.bool_]]] = []
    for number, name in enumerate(goal.names):
        if name not in world.regions:
            continue
        inside = (world.regions[name].inside != 0) & standing
        if inside[math.floor(start[1]), math.floor(start[0])]:
            found.append((0.0, number, start, inside))
            continue
        places = np.argwhere(inside & _beside(standing & ~inside))[:, ::-1].astype(np.float64) + 0.5
        nearest, way = nearest_place(from_start, places)
        if nearest >= 0:
            found.append((way, number, (float(places[nearest, 0]), float(places[nearest, 1])), inside))
    if not found:
        raise ConfigError(
            f"goal: no {goal.kind} of the names can be reached in plan {world.plan_id!r}: obstacles are there"
        )
    far = [each for each in found if each[0] >= least_px] or [max(found, key=lambda each: each[0])]
    return far[int(rng.integers(len(far))) if len(far) > 1 else 0][1:]


def _beside(cells: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Return the cells that share a side with one of these."""
    found = np.zeros_like(cells)
    found[1:] |= cells[:-1]
    found[:-1] |= cells[1:]
    found[:, 1:] |= cells[:, :-1]
    found[:, :-1] |= cells[:, 1:]
    return found


def _random_goal(
    config: SimulatorConfig, graph: CornerGraph, before: Counts, start: tuple[float, float], rng: np.random.Generator
) -> tuple[float, float]:
    """Return the centre of a random standing cell that is far enough from the start.

    No path is shorter than the straight line, so paths from the start are only needed for a cell that is close to it.
    """
    least_px = (config.goal or GoalConfig()).least_way_m * config.pixels_per_metre
    cells = as_read_only(graph.standing)
    best, found, from_start = -1.0, (0.0, 0.0), None
    for _ in range(GOAL_TRIES):
        row, col = nth_cell(cells, 1, before, int(rng.integers(before[-1])))
        place = col + 0.5, row + 0.5
        if math.dist(place, start) >= least_px:
            return place
        from_start = from_start or find_goal_paths(graph, *start)
        way = float(goal_distance_at(from_start, *place))
        if math.isfinite(way) and way > best:
            best, found = way, place
        if best >= least_px:
            break
    return found


def _given_goal(goal: GoalConfig, traversable: npt.NDArray[np.uint8], world: World) -> tuple[float, float]:
    x, y = world.frame.pixels_from_points([goal.x_m, goal.y_m]).tolist()
    row, col = math.floor(y), math.floor(x)
    if not bool(world.frame.contains([row, col])) or not traversable[row, col]:
        raise ConfigError(
            f"goal: the robot cannot stand at ({goal.x_m:g}, {goal.y_m:g}) m in plan {world.plan_id!r}, or cannot "
            "get there; set another goal, or a random one"
        )
    return x, y
