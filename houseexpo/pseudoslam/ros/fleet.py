"""Move robots by velocities in one house, with people, and report their poses, odometry, laser ranges and maps.

Each robot has a simulator of its own, and so a map of its own. The first robot's simulator also moves the people.
Robots are discs that keep off each other and off people.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.grids.raster import all_rings
from houseexpo.pseudoslam.config import FURTHEST_M, NoiseConfig, SimulatorConfig
from houseexpo.pseudoslam.config.moving_obstacles import PeopleConfig
from houseexpo.pseudoslam.config.obstacles import ObstaclesConfig
from houseexpo.pseudoslam.io.poses import Pose, relative_pose, wrap_angle
from houseexpo.pseudoslam.kernels.collision import HALF_DIAGONAL, STATIC, distance_to_disc, placed_people
from houseexpo.pseudoslam.kernels.episode import COUNTS, READINGS
from houseexpo.pseudoslam.kernels.odometry import draw_odometry_errors, grip_share
from houseexpo.pseudoslam.kernels.planning.fields import no_flow_field
from houseexpo.pseudoslam.kernels.sensing.rays import cast_beams
from houseexpo.pseudoslam.kernels.types import Rows
from houseexpo.pseudoslam.simulator import OccupancyGrid, Simulator
from houseexpo.pseudoslam.state import State
from houseexpo.pseudoslam.step_kernels import make_noise_params, make_scratch, make_step_params, take_first_scan
from houseexpo.pseudoslam.teams.team import (
    ROBOTS_MOST,
    check_start_apart,
    mark_discs,
    no_room_error,
)
from houseexpo.pseudoslam.worlds.cache import world_for
from houseexpo.pseudoslam.worlds.maps import House, MapHouse
from houseexpo.pseudoslam.worlds.reset import make_initial_state
from houseexpo.tolerances import SAME_M

Floats = npt.NDArray[np.float64]

_BEAM_WALL_PAIRS: Final = 2_000_000
"""Pairs of a beam and a wall that are intersected at a time: 16 MB for each array."""


@dataclass(frozen=True)
class Velocity:
    """A velocity in the robot's frame: ``ahead_m_s`` and ``left_m_s``, and ``turn_rad_s`` counter-clockwise."""

    ahead_m_s: float = 0.0
    left_m_s: float = 0.0
    turn_rad_s: float = 0.0


@dataclass(eq=False)
class _Robot:
    simulator: Simulator
    state: State
    rng: np.random.Generator
    counts: Rows
    """Ticks so far, and the key of the noise of odometry."""
    readings: Rows = field(default_factory=lambda: np.zeros(1, READINGS)[0])
    """The bias of odometry."""
    odometry: Pose = (0.0, 0.0, 0.0)
    moved: Velocity = field(default_factory=Velocity)


class Fleet:
    """Robots in a house.

    Parameters
    ----------
    plan
        The house: a plan, or a map, whose occupied cells are its walls.
    config
        Robot, laser, noise, people, obstacles and start; its ``step_s`` is replaced by ``tick_s``.
    robots
        Number of robots.
    seed
        Seed of starts, people and noise. Equal seeds and velocities give equal poses, maps and scans.
    starts
        Poses of the first robots in the plan's frame; the others start at random places.
    tick_s
        Time that ``advance`` takes, seconds.

    Raises
    ------
    ConfigError
        A robot does not fit at its start, two overlap, the house has no room for all, or the configuration has
        trajectories.
    PlanError
        The plan has no free cell.
    """

    def __init__(
        self,
        plan: House,
        config: SimulatorConfig,
        *,
        robots: int = 1,
        seed: int = 0,
        starts: Sequence[Pose] = (),
        tick_s: float = 0.02,
    ) -> None:
        if not 1 <= robots <= ROBOTS_MOST:
            raise ConfigError(f"robots: expected a number from 1 to {ROBOTS_MOST}, found {robots}")
        if len(starts) > robots:
            raise ConfigError(f"starts: expected at most one for each of {robots} robots, found {len(starts)}")
        if config.trajectories:
            raise ConfigError("trajectories: robots in ROS meet people and obstacles only; leave trajectories out")
        if config.robot.drive:
            raise ConfigError("robot.drive: robots in ROS follow their velocities exactly; leave the drive out")
        self.plan, self.seed, self.starts, self.tick_s = plan, seed, tuple(starts), tick_s
        self.noise = config.noise
        self._errors = make_noise_params(config.noise, 1.0)
        self.config = replace(config, step_s=tick_s, noise=config.noise.without_odometry())
        self.radius_m = config.robot.radius_m
        self._world = world_for(plan, self.config)
        self._walls = _segments(plan)
        self._robots: list[_Robot] = []
        self._static: npt.NDArray[np.uint8] = self._world.occupied
        self._obstacles: npt.NDArray[np.uint8] = np.zeros_like(self._static)
        self._place(robots)

    def __len__(self) -> int:
        return len(self._robots)

    def reset(self) -> None:
        """Begin again: the same starts, people and noise, empty maps, odometry at 0."""
        self._place(len(self._robots))

    def _place(self, robots: int) -> None:
        streams = np.random.default_rng(self.seed).spawn(robots)
        self._robots = []
        alone = replace(self.config, people=PeopleConfig(), obstacles=ObstaclesConfig())
        for k, rng in enumerate(streams):
            config = self.config if k == 0 else alone
            world = self._world
            if k > 0:
                occupied = self._static.copy()
                near_m = HALF_DIAGONAL * world.frame.cell_m  # not a part of a cell too near
                self._stamp(occupied, self.people_m(), self.config.people.radius_m + near_m)
                self._stamp(occupied, self._positions_m(), self.radius_m)
                occupied.flags.writeable = False
                world = replace(world, occupied=occupied, flow=no_flow_field())
            params, scratch = make_step_params(config), make_scratch(config)
            start = self.starts[k] if k < len(self.starts) else None
            if start is not None:
                check_start_apart(k, start, self._positions_m(), self.radius_m)
            try:
                state = make_initial_state(world, config, params, scratch, rng, pose_m=start)
            except ConfigError as error:
                if k == 0 or start is not None:
                    raise
                raise no_room_error(k, robots, self.radius_m, self.plan.id) from error
            if k == 0:
                self._static = (state.occupied & STATIC).astype(np.uint8)
                robots_px = np.tile(state.pose_px[:2], (robots, 1))  # for people, who keep off them; see _refresh
                state.episode = state.episode._replace(bodies=state.episode.bodies._replace(robots=robots_px))
                self._obstacles = ((self._static != 0) & (self._world.occupied == 0)).astype(np.uint8)
            else:
                state.occupied[:] = self._static
            take_first_scan(state, params, scratch)
            counts = np.zeros(1, COUNTS)[0]
            own = rng.spawn(1)[0]
            counts.key = int(own.integers(2**62))
            self._robots.append(_Robot(Simulator(world, config, params, scratch), state, own, counts))

    def pose(self, robot: int) -> Pose:
        """Return the true pose: x, y in the plan's metres, and the heading."""
        one = self._robots[robot]
        return one.simulator.pose(one.state)

    def odometry(self, robot: int) -> Pose:
        """Return the pose that the wheels report, relative to the start, with the noise of odometry."""
        return self._robots[robot].odometry

    def velocity(self, robot: int) -> Velocity:
        """Return the velocity of the last tick: 0 ahead where an obstacle blocked the robot."""
        return self._robots[robot].moved

    def map(self, robot: int) -> OccupancyGrid:
        """Return the map that the robot has made so far, without drift: a SLAM that never fails."""
        one = self._robots[robot]
        return one.simulator.map(one.state)

    def occupied(self, robot: int) -> npt.NDArray[np.uint8]:
        """Return the cells (rows, cols) that are not free for a robot now: walls, obstacles, people, other robots."""
        self._refresh(robot)
        return self._robots[robot].state.occupied.copy()

    def people_m(self) -> Floats:
        """Return the centres of the people (n, 2), metres."""
        if not self._robots:
            return np.empty((0, 2))
        people = placed_people(self._robots[0].state.episode.bodies.people)
        return self._world.frame.points_from_pixels(np.column_stack([people["x"], people["y"]]))

    def place(self, robot: int, pose: Pose) -> None:
        """Put a robot at a pose; its map and its odometry stay as they are.

        Raises
        ------
        ConfigError
            The robot does not fit there, or could not leave the place.
        """
        others = self._others(robot)
        x, y, heading = pose
        if len(others) and np.hypot(*(others - (x, y)).T).min() < 2 * self.radius_m:
            raise ConfigError(f"pose: another robot is at ({x:g}, {y:g}) m")
        people = self.people_m()
        if len(people) and np.hypot(*(people - (x, y)).T).min() < self.radius_m + self.config.people.radius_m:
            raise ConfigError(f"pose: a person is at ({x:g}, {y:g}) m; wait until the person has gone on")
        one = self._robots[robot]
        self._refresh(robot)
        made = make_initial_state(
            replace(self._world, occupied=one.state.occupied), replace(one.simulator.config, people=PeopleConfig(),
            obstacles=ObstaclesConfig()), one.simulator.params, make_scratch(self.config), np.random.default_rng(0),
            pose_m=(x, y, wrap_angle(heading)), own=False,
        )  # fmt: skip
        one.state.pose_px[:] = made.pose_px
        one.state.believed_px[:] = made.pose_px
        one.moved = Velocity()

    def advance(self, velocities: Sequence[Velocity]) -> None:
        """Let all robots drive and all people walk for ``tick_s``; robots move one after the other.

        A robot stops at an obstacle. It drives along the chord of its arc, which at 1 rad/s and 50 ticks a second is
        shorter than the arc by 2e-5 of its length.
        """
        for k, velocity in enumerate(velocities):
            self._drive(k, velocity)

    def _drive(self, number: int, velocity: Velocity) -> None:
        robot, tick_s = self._robots[number], self.tick_s
        x, y, heading = before = self.pose(number)
        robot.counts.steps += 1
        held = grip_share(self._errors, int(robot.counts.key), int(robot.counts.steps))
        turn = velocity.turn_rad_s * tick_s * held
        way = math.hypot(velocity.ahead_m_s, velocity.left_m_s) * tick_s * held
        aside = math.atan2(velocity.left_m_s, velocity.ahead_m_s) if way else 0.0
        if abs(aside) > math.pi / 2:  # backward, so that a robot without sideways motion does not turn round
            aside, way = wrap_angle(aside + math.pi), -way
        if not (abs(way) <= FURTHEST_M and abs(turn) <= math.pi):
            raise ConfigError(
                f"velocity: expected at most {FURTHEST_M / tick_s:g} m/s and {math.pi / tick_s:.0f} rad/s, "
                f"found {velocity.ahead_m_s:g} and {velocity.left_m_s:g} m/s, {velocity.turn_rad_s:g} rad/s"
            )
        self._refresh(number)
        course = heading + turn / 2 + aside
        free = math.copysign(self._free_way(number, (x, y), course, way), way)
        robot.simulator.move(robot.state, turn / 2 + aside, free)
        for pose_px in (robot.state.pose_px, robot.state.believed_px):
            pose_px[2] = wrap_angle(heading + turn)
        now = self.pose(number)
        went = math.copysign(math.hypot(now[0] - x, now[1] - y), way)
        robot.odometry = self._wheels(robot, relative_pose(before, now), held)
        robot.moved = Velocity(went * math.cos(aside) / tick_s, went * math.sin(aside) / tick_s, turn / tick_s)

    def _wheels(self, robot: _Robot, step: Pose, held: float) -> Pose:
        """Return the odometry after a step in the robot's frame, with noise as ``NoiseConfig`` defines it.

        ``held`` is the share of the wheels' motion that is left after slipping.
        """
        x, y, heading = robot.odometry
        ahead, left, turned = step[0] / held, step[1] / held, step[2] / held
        if self._errors.odometry:
            way = math.hypot(ahead, left)
            off = draw_odometry_errors(self._errors, robot.counts, robot.readings, turned, way, True, self.tick_s)
            scale = off.way / way if way else 0.0
            ahead, left = (ahead * (1.0 + scale), left * (1.0 + scale)) if way else (off.way, 0.0)
            heading += off.before
            turned += off.turn + off.after
        cos, sin = math.cos(heading), math.sin(heading)
        return x + ahead * cos - left * sin, y + ahead * sin + left * cos, wrap_angle(heading + turned)

    def _refresh(self, number: int) -> None:
        """Draw what stands and moves into a robot's cells: other robots a little smaller, see ``_free_way``."""
        occupied = self._robots[number].state.occupied
        np.copyto(occupied, self._static)
        if number == 0:
            robots_px = self._world.frame.pixels_from_points(self._positions_m())
            self._robots[0].state.episode.bodies.robots[: len(robots_px)] = robots_px
            self._stamp(occupied, self.people_m(), self.config.people.radius_m)
        else:
            self._stamp(occupied, self.people_m(), self.config.people.radius_m - 2 * self._world.frame.cell_m)
        self._stamp(occupied, self._others(number), self.radius_m - 2 * self._world.frame.cell_m)

    def _free_way(self, number: int, at: tuple[float, float], course: float, way: float) -> float:
        """Return how far, up to ``abs(way)``, the robot's disc can go until it touches another robot or a person."""
        sign = 1.0 if way >= 0 else -1.0
        right, up = sign * math.cos(course), sign * math.sin(course)
        free = abs(way)
        discs = [(self._others(number), 2 * self.radius_m)]
        if number > 0:  # the first robot's simulator does it for that one
            discs.append((self.people_m(), self.radius_m + self.config.people.radius_m))
        for centres, reach in discs:
            for x, y in (centres - at).tolist():
                # apart by SAME_M, so that rounding does not make them overlap
                free = min(free, distance_to_disc(x, y, right, up, reach, SAME_M))
        return free

    def scan(self, robot: int, angles_rad: Floats, least_m: float, most_m: float) -> npt.NDArray[np.float32]:
        """Return the ranges (beams,) of a laser at the robot's centre, metres: exact, then with the laser's noise.

        Walls, people and robots are met where they are, not where their cells are; placed obstacles are met at their
        cells. Infinite where nothing is met within ``most_m``, NaN where a beam is lost.

        Parameters
        ----------
        angles_rad
            (beams,) directions relative to the heading.
        """
        x, y, heading = self.pose(robot)
        directions = heading + angles_rad
        cos, sin = np.cos(directions), np.sin(directions)
        ranges = _to_segments(self._walls, (x, y), cos, sin, most_m)
        for centres, radius in ((self._others(robot), self.radius_m), (self.people_m(), self.config.people.radius_m)):
            for centre in centres:
                ranges = np.minimum(ranges, _to_disc(centre - (x, y), radius, cos, sin))
        if self._obstacles.any():
            cell_m = self._world.frame.cell_m
            across, down = self._world.frame.pixels_from_points([x, y]).tolist()
            found = np.empty(len(angles_rad))
            cast_beams(
                self._obstacles, across, down, heading, np.cos(angles_rad), np.sin(angles_rad), most_m / cell_m, found
            )
            ranges = np.minimum(ranges, np.where(found >= most_m / cell_m, np.inf, found * cell_m))
        ranges = np.where(ranges > most_m, np.inf, ranges)
        return self._noisy(ranges, self._robots[robot].rng, least_m).astype(np.float32)

    def _noisy(self, ranges: Floats, rng: np.random.Generator, least_m: float) -> Floats:
        noise: NoiseConfig = self.noise
        if noise.laser_m:
            ranges = np.maximum(ranges + noise.laser_m * rng.standard_normal(len(ranges)), least_m)
        if noise.drop_out or noise.max_range:
            fate = rng.random(len(ranges))
            ranges = np.where(fate < noise.drop_out + noise.max_range, np.inf, ranges)
            ranges = np.where(fate < noise.drop_out, np.nan, ranges)
        return ranges

    def _positions_m(self) -> Floats:
        return np.array([self.pose(k)[:2] for k in range(len(self._robots))]).reshape(-1, 2)

    def _others(self, robot: int) -> Floats:
        return np.delete(self._positions_m(), robot, axis=0)

    def _stamp(self, occupied: npt.NDArray[np.uint8], centres_m: Floats, radius_m: float) -> None:
        mark_discs(occupied, self._world.frame.pixels_from_points(centres_m), radius_m / self._world.frame.cell_m)


def _segments(plan: House) -> Floats:
    """Return the walls of a plan, or the edges of a map's occupied cells, as segments (n, 4): x, y of both ends."""
    if isinstance(plan, MapHouse):
        return _edges(plan.with_border())
    rings = [np.asarray(ring, np.float64).reshape(-1, 2) for ring in all_rings(plan)]
    return np.concatenate([np.hstack([ring, np.roll(ring, -1, axis=0)]) for ring in rings])


def _edges(house: MapHouse) -> Floats:
    """Return the edges between occupied and free cells, those in one line joined: (n, 4), metres."""
    solid = house.occupied != 0
    right, top, bottom = _runs((solid[:, 1:] != solid[:, :-1]).T)  # edges that run down
    down, left, end = _runs(solid[1:] != solid[:-1])  # edges that run across
    first = np.concatenate([np.column_stack([right + 1, top]), np.column_stack([left, down + 1])])
    last = np.concatenate([np.column_stack([right + 1, bottom]), np.column_stack([end, down + 1])])
    points = house.frame.points_from_pixels
    return np.hstack([points(first.astype(np.float64)), points(last.astype(np.float64))])


def _runs(are_edges: npt.NDArray[np.bool_]) -> tuple[npt.NDArray[np.intp], ...]:
    """Return the runs of true values in each row (n,): the row, the first column, and the column after the last."""
    change = np.diff(np.pad(are_edges, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    row, start = np.nonzero(change == 1)
    return row, start, np.nonzero(change == -1)[1]


def _to_segments(walls: Floats, at: tuple[float, float], cos: Floats, sin: Floats, most_m: float) -> Floats:
    """Return the distances (beams,) to the nearest segment, infinite where a beam meets none."""
    start = walls[:, :2] - at
    end = walls[:, 2:] - at
    near = (np.minimum(start, end) <= most_m).all(axis=1) & (np.maximum(start, end) >= -most_m).all(axis=1)
    start, along = start[near], (end - start)[near]
    found = np.full(len(cos), np.inf)
    each = max(_BEAM_WALL_PAIRS // max(len(start), 1), 1)
    for first in range(0, len(cos), each):
        right, up = cos[first : first + each, None], sin[first : first + each, None]
        across = right * along[:, 1] - up * along[:, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            gone = (start[:, 0] * along[:, 1] - start[:, 1] * along[:, 0]) / across
            part = (start[:, 0] * up - start[:, 1] * right) / across
        meets = (gone >= 0.0) & (part >= 0.0) & (part <= 1.0)
        found[first : first + each] = np.where(meets, gone, np.inf).min(axis=1, initial=np.inf)
    return found


def _to_disc(off: Floats, radius: float, cos: Floats, sin: Floats) -> Floats:
    """Return the distances (beams,) to a disc whose centre is ``off`` away, infinite where a beam passes it."""
    along = off[0] * cos + off[1] * sin
    inside = along * along - (off @ off - radius * radius)
    gone = along - np.sqrt(np.maximum(inside, 0.0))
    return np.where((inside >= 0.0) & (gone >= 0.0), gone, np.inf)
