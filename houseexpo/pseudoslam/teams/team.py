"""Robots of a team in one house: their episodes, their steps one after the other, their radios and their measures."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

import cv2
import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config.obstacles import ObstaclesConfig, PeopleConfig
from houseexpo.pseudoslam.envs.reset_options import Pose
from houseexpo.pseudoslam.envs.spec import EnvSpec, constants_of, new_constants
from houseexpo.pseudoslam.kernels.collision import STATIC, placed_people
from houseexpo.pseudoslam.kernels.driving import path_of, way_past_discs
from houseexpo.pseudoslam.kernels.episode import Episode
from houseexpo.pseudoslam.kernels.odometry import grip
from houseexpo.pseudoslam.kernels.teams import merge_map, way_in_walls
from houseexpo.pseudoslam.metrics import Metrics
from houseexpo.pseudoslam.state import State
from houseexpo.pseudoslam.step_kernels import arguments_of, entry_point, kernel_for
from houseexpo.pseudoslam.teams.discs import stamp, way_past
from houseexpo.pseudoslam.teams.radio import Radio
from houseexpo.pseudoslam.worlds.moving import new_bodies
from houseexpo.pseudoslam.worlds.world import World

Floats = npt.NDArray[np.float64]
Grid = npt.NDArray[np.uint8]

_TOUCH_PX: Final = 1e-6
_THINNER_PX: Final = 2.0
"""By how much others' discs are drawn smaller than they are, so that rounding to cells does not hold a robot fast."""
_ALL: Final = np.iinfo(np.int64).max
_SHARED: Final = ("shown", "overview", "ranges", "pose", "counts", "readings")
"""The arrays of all robots that are rows of one array."""
LEVELS: Final = (0.9, 0.99)
"""The shares of the house for which steps and metres are measured."""


@dataclass
class TeamMeasures:
    """What a team has done so far.

    Parameters
    ----------
    steps_to, metres_to
        The steps, and the metres travelled by all robots together, until the maps of all robots together showed each
        of ``LEVELS`` of what can be seen; None if they do not yet.
    found
        Number of cells that were unknown to the robot that saw them, over all robots.
    joined
        Number of steps after which each robot could reach each other one by radio, also through others.
    meetings
        Number of times that one robot was blocked by another.
    """

    steps: int = 0
    steps_to: list[int | None] = field(default_factory=lambda: [None] * len(LEVELS))
    metres_to: list[float | None] = field(default_factory=lambda: [None] * len(LEVELS))
    found: int = 0
    joined: int = 0
    meetings: int = 0


class Team:
    """The episode of a team in one house.

    Robots move one after the other, in the order of their numbers, and are in each other's way and in each other's
    sight. Each has its own map. After all have moved, those that hear each other exchange their maps. The first robot's
    episode also moves the people; people walk round that robot, and the others are obstacles to them.

    Parameters
    ----------
    spec
        The specification of one robot's environment, without planners' actions.
    world
        The house.
    rng
        Source of all random values. The first robot draws from it what a single robot draws; the others have their own.
    starts
        Poses of the first robots; the others start at random places.

    Raises
    ------
    ConfigError
        A robot does not fit at its start, two overlap, or the house has no room for all.
    """

    def __init__(  # noqa: PLR0917  # what an episode is made of
        self,
        spec: EnvSpec,
        world: World,
        robots: int,
        radio: Radio,
        rng: np.random.Generator,
        starts: Sequence[Pose | None] = (),
    ) -> None:
        self.spec, self.world, self.radio = spec, world, radio
        self.params, self.scratch = spec.params(), spec.scratch()
        self._drives = spec.config.robot.drive is not None
        self.ppm, self.radius_px = spec.config.pixels_per_metre, self.params.robot.radius_px
        self.states: list[State] = []
        self._place(robots, rng, list(starts))
        first = self.states[0]
        self.walls: Grid = (first.occupied & STATIC).astype(np.uint8)
        self.fading_db = _fading(radio, first)
        self.constants = new_constants(robots)
        for k, state in enumerate(self.states):
            self.constants.rows[k] = constants_of(state, world)
        self.pool = self._share()
        self._poses: Floats = self.pool.pose.view(np.float64).reshape(robots, 6)
        self._steps = [self._kernel(k) for k in range(robots)]
        self.known: Grid = np.zeros_like(first.known)
        """What the robots know together (rows, cols)."""
        self.covered = 0
        self.explored = 0
        self.heard = np.zeros((robots, robots), bool)
        """Who could hear whom in the last exchange (n, n)."""
        self.measures = TeamMeasures()
        self._reach_px = self.params.sensor.range_px + spec.config.full_step_m * self.ppm + 2.0
        self._rest = [np.flatnonzero(np.arange(robots) != k) for k in range(robots)]
        self._sent = np.full((robots, robots), -1)
        self._from: dict[tuple[int, int], Floats] = {}
        for k in range(robots):
            self._act(k, np.zeros(3 if self._drives else 2))
        self.measures.found = int(self.pool.counts["known"].sum())
        self._exchange()

    def __len__(self) -> int:
        return len(self.states)

    def _kernel(self, robot: int) -> tuple[Callable[..., None], tuple[Any, ...]]:
        """Return the compiled step of a robot, and its arguments, of which the third is its motion or command."""
        state = self.states[robot]
        given = arguments_of(state, np.zeros((1, 3 if self._drives else 2)), self.params, self.scratch)
        return entry_point(kernel_for(state.episode, self.params, moves=self._has_people(robot)), *given), given

    def _has_people(self, robot: int) -> bool:
        return robot == 0 and (self.spec.config.people.number > 0 or len(self.spec.config.trajectories) > 0)

    def _place(self, robots: int, rng: np.random.Generator, starts: list[Pose | None]) -> None:
        """Start the episodes of all robots, each away from those before it."""
        config = self.spec.config
        starts += [None] * (robots - len(starts))
        alone = replace(self.spec, config=replace(config, people=PeopleConfig(), obstacles=ObstaclesConfig()))
        for k, start in enumerate(starts):
            self._check_start(k, start)
            if k == 0:
                self.states.append(self.spec.initial_state(self.world, self.params, self.scratch, rng, pose_m=start))
                streams = rng.spawn(robots - 1)
                continue
            first = self.states[0]
            occupied = first.occupied.copy()
            stamp(occupied, self.places_px(), self.radius_px)
            occupied.flags.writeable = False
            world = replace(self.world, occupied=occupied)
            try:
                state = alone.initial_state(world, self.params, self.scratch, streams[k - 1], pose_m=start)
            except ConfigError as error:
                if start is not None:
                    raise
                raise ConfigError(
                    f"robots: there is no room for robot {k + 1} of {robots} with a radius of "
                    f"{config.robot.radius_m:g} m in plan {self.world.plan_id!r}; take fewer or smaller robots, or a "
                    "larger house"
                ) from error
            state.observable_cells, state.obstacles = first.observable_cells, first.obstacles
            state.episode.observable[:] = first.episode.observable
            if config.known_map:  # without the robots before it
                state.episode.known[:] = first.episode.known
            self.states.append(state)
        if robots > 1:  # a clock says that something moves, so that scans do not rely on the map
            for k, state in enumerate(self.states):
                if not self._has_people(k):
                    state.episode = state.episode._replace(bodies=new_bodies(1, 0))

    def _check_start(self, number: int, start: Pose | None) -> None:
        """Raise ConfigError if a start overlaps an earlier robot's."""
        for other, place in enumerate(self.places_px() if start is not None else ()):
            x, y = self.world.frame.points_from_pixels(place).tolist()
            least = 2.0 * self.spec.config.robot.radius_m
            if start is not None and math.hypot(start[0] - x, start[1] - y) < least:
                raise ConfigError(
                    f"starts: robot {number + 1} at ({start[0]:g}, {start[1]:g}) m overlaps robot {other + 1} at "
                    f"({x:g}, {y:g}) m; leave at least {least:g} m between their centres"
                )

    def _share(self) -> Episode:
        """Put the robots' small arrays into rows of shared ones, and return an episode with these."""
        shared: dict[str, Any] = {
            name: np.stack([getattr(state.episode, name) for state in self.states]) for name in _SHARED
        }
        for k, state in enumerate(self.states):
            rows = {name: part[k] for name, part in shared.items()}
            self.states[k] = replace(state, episode=state.episode._replace(**rows))
        return self.states[0].episode._replace(**shared)

    def places_px(self) -> Floats:
        """Return the robots' places (n, 2), pixels, as a new array."""
        return np.array([state.pose_px[:2] for state in self.states]).reshape(-1, 2)

    def metrics(self) -> Metrics:
        """Return the metrics of all robots."""
        return Metrics.of(self.constants, self.pool, self.spec.config)

    def step(self, motions: Floats) -> Metrics:
        """Let each robot turn and go forward (n, 2), radians and pixels, or follow a command (n, 3); exchange maps.

        Return the metrics after the motions and before the exchange, so that rewards are for what a robot saw itself.
        """
        before = self.pool.counts["known"][:, 0].copy()
        for k, motion in enumerate(motions):
            self._act(k, motion)
        after = self.metrics()
        self.measures.steps += 1
        self.measures.found += int((after.counts["known"] - before).sum())
        self._exchange()
        self._measure(after)
        return after

    def _act(self, robot: int, motion: Floats) -> None:
        """Take one robot's step, and add what it saw to what the team knows."""
        state, meets = self.states[robot], False
        kernel, given = self._steps[robot]
        given[2][0] = motion
        if len(self) > 1:
            others = self._poses[self._rest[robot], :2]
            self._refresh(robot, others)
            meets = self._keep_off(robot, others, given[2][0])
        kernel(*given)
        if meets:
            counts = state.counts
            counts.collisions += 1 - counts.blocked
            counts.blocked = 1
            self.measures.meetings += 1
        box = self._box(robot)
        new, covered = merge_map(self.known, state.episode.observable, state.known, box, _ALL)
        self.explored += new
        self.covered += covered

    def _keep_off(self, robot: int, others: Floats, motion: Floats) -> bool:
        """Shorten a robot's motion, in place, so that it does not overlap another; return whether it would have."""
        counts = self.pool.counts[robot, 0]
        held = grip(self.params.errors, int(counts.key), int(counts.steps) + 1)
        if self._drives:
            speed, turning, _ = motion.tolist()
            readings, pose = self.pool.readings[robot, 0], self.pool.pose[robot, 0]
            params = self.params
            path = path_of(readings, speed, turning, params.drive, params.robot, params.seconds, held)
            motion[2] = way_past_discs(path, pose, np.ascontiguousarray(others), 2.0 * self.radius_px, _TOUCH_PX)
            return bool(motion[2] < math.inf)
        turn, forward = (motion * held).tolist()
        x, y, heading = self._poses[robot, :3].tolist()
        sign = -1.0 if forward < 0.0 else 1.0
        course = sign * math.cos(heading + turn), -sign * math.sin(heading + turn)
        free = way_past((others - (x, y)).tolist(), 2.0 * self.radius_px, course, abs(forward), _TOUCH_PX)
        if free < abs(forward):
            motion[1] = math.copysign(free, forward) / held
        return bool(free < abs(forward))

    def _refresh(self, robot: int, others: Floats) -> None:
        """Draw the others, and people, into a robot's cells."""
        occupied = self.states[robot].occupied
        np.copyto(occupied, self.walls)
        if self._has_people(0):
            people = placed_people(self.states[0].episode.bodies.people)
            radius_px = self.spec.config.people.radius_m * self.ppm
            stamp(occupied, np.column_stack([people["x"], people["y"]]), radius_px - _THINNER_PX * (robot > 0))
        stamp(occupied, others, self.radius_px - _THINNER_PX)

    def _box(self, robot: int) -> npt.NDArray[np.int64]:
        """Return the rows and columns in which a step can have changed the map."""
        rows, cols = self.known.shape
        if self.params.errors.any or self.measures.steps == 0:
            return np.array([0, rows, 0, cols])
        x, y = self._poses[robot, 3:5].tolist()
        reach = self._reach_px
        top, left = max(int(y - reach), 0), max(int(x - reach), 0)
        return np.array([top, min(int(y + reach) + 1, rows), left, min(int(x + reach) + 1, cols)])

    def _exchange(self) -> None:
        """Let the robots that hear each other exchange their maps, each what it had before."""
        if len(self) == 1:
            return
        self.heard = self.radio.hears(self.walls, self.places_px(), 1.0 / self.ppm, self.fading_db)
        if self.radio.relative_poses == "met":
            self._meet()
        counts = self.pool.counts[:, 0]
        had = counts["known"].tolist()
        news = [
            (i, j)
            for i, j in np.argwhere(self.heard).tolist()
            if self._may_use_pose(i, j) and self._sent[i, j] != had[j]
        ]
        maps = {j: self.states[j].known.copy() for _, j in news}
        most = self.radio.cells_per_step or _ALL
        for i, j in news:
            known, observable = self.states[i].known, self.states[i].episode.observable
            box = np.array([0, known.shape[0], 0, known.shape[1]])
            new, covered = merge_map(known, observable, self._in_frame_of(i, j, maps[j]), box, most)
            counts["known"][i] += new
            counts["covered"][i] += covered
            if new < most:
                self._sent[i, j] = had[j]

    def _may_use_pose(self, i: int, j: int) -> bool:
        return self.radio.relative_poses == "known" or (i, j) in self._from

    def _meet(self) -> None:
        """Measure the transformation between the maps of robots that see each other."""
        places, reach = self.places_px(), self.params.sensor.range_px
        for i in range(len(self)):
            for j in range(i):
                near = math.hypot(*(places[i] - places[j]).tolist()) <= reach
                if near and way_in_walls(self.walls, *places[i].tolist(), *places[j].tolist()) == 0.0:
                    self._from[i, j], self._from[j, i] = self._map_between(i, j), self._map_between(j, i)

    def _map_between(self, i: int, j: int) -> Floats:
        """Return the affine map (2, 3) from pixels of robot j's map to those of robot i's."""
        own, other = self.states[i], self.states[j]
        to_truth = _rotation(other.pose_px[2] - other.believed_px[2])
        to_own = _rotation(own.believed_px[2] - own.pose_px[2])
        shift = to_own @ (other.pose_px[:2] - own.pose_px[:2]) + own.believed_px[:2]
        linear = to_own @ to_truth
        return np.column_stack([linear, shift - linear @ other.believed_px[:2]])

    def _in_frame_of(self, i: int, j: int, known: Grid) -> Grid:
        """Return robot j's map in the frame of robot i's."""
        affine = self._from.get((i, j))
        if affine is None or np.allclose(affine, np.eye(2, 3), atol=1e-6):
            return known
        centred = affine.copy()
        centred[:, 2] += affine[:, :2] @ (0.5, 0.5) - 0.5  # cv2 counts from the centres of cells
        rows, cols = known.shape
        found = cv2.warpAffine(known, centred, (cols, rows), flags=cv2.INTER_NEAREST, borderValue=0)
        return found.astype(np.uint8, copy=False)

    def _measure(self, after: Metrics) -> None:
        measures = self.measures
        measures.joined += _is_joined(self.heard)
        metres = float(after.readings["path_length"].sum()) / self.ppm
        for k, level in enumerate(LEVELS):
            if measures.steps_to[k] is None and self.coverage >= level:
                measures.steps_to[k], measures.metres_to[k] = measures.steps, metres

    @property
    def coverage(self) -> float:
        """The share of what can be seen that the robots know together, 0 to 1."""
        return self.covered / max(self.states[0].observable_cells, 1)

    def report(self) -> dict[str, float | None]:
        """Return the measures of the team.

        ``team_coverage`` and ``team_explored_m2`` are those of all maps together; ``steps_to_90``, ``metres_to_90``
        and the same for 99 are in ``TeamMeasures``, as are ``meetings``. ``makespan`` is the number of steps so far.
        ``metres`` and ``longest_m`` are the way of all robots and the greatest way of one. ``overlap`` is the share of
        the cells that were new to the robot that saw them but not to the team. ``connected`` is the share of steps
        after which each robot could reach each other one by radio. ``collisions`` are those of all robots.
        """
        measures, ways = self.measures, self.pool.readings["path_length"] / self.ppm
        report: dict[str, float | None] = {
            "team_coverage": self.coverage,
            "team_explored_m2": self.explored / self.ppm**2,
            "makespan": measures.steps,
            "metres": float(ways.sum()),
            "longest_m": float(ways.max()),
            "overlap": max(1.0 - self.explored / max(measures.found, 1), 0.0),
            "connected": measures.joined / max(measures.steps, 1),
            "collisions": int(self.pool.counts["collisions"].sum()),
            "meetings": measures.meetings,
        }
        for level, steps, metres in zip(LEVELS, measures.steps_to, measures.metres_to, strict=True):
            report[f"steps_to_{100 * level:.0f}"] = steps
            report[f"metres_to_{100 * level:.0f}"] = metres
        return report


def _rotation(angle: float) -> Floats:
    """Return the rotation by an angle, counter-clockwise, for pixels with y down."""
    cos, sin = math.cos(angle), math.sin(angle)
    return np.array([[cos, sin], [-sin, cos]])


def _fading(radio: Radio, first: State) -> tuple[float, float]:
    """Return the losses of an episode in air and in walls, which its key decides."""
    if not (radio.air_fading_db or radio.wall_fading_db):
        return 0.0, 0.0
    air, wall = np.random.default_rng(int(first.counts.key)).random(2).tolist()
    return air * radio.air_fading_db, wall * radio.wall_fading_db


def _is_joined(heard: npt.NDArray[np.bool_]) -> bool:
    """Return whether each robot reaches each other one, also through others."""
    reached, more = {0}, [0]
    while more:
        for k in np.flatnonzero(heard[more.pop()]).tolist():
            if k not in reached:
                reached.add(k)
                more.append(k)
    return len(reached) == len(heard)
