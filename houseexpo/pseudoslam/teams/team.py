"""Start the robots of one team in one house, exchange their maps by radio, and measure the team; ``pools`` steps it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.config.moving_obstacles import PeopleConfig
from houseexpo.pseudoslam.config.obstacles import ObstaclesConfig
from houseexpo.pseudoslam.envs.reset_options import Pose
from houseexpo.pseudoslam.envs.spec import EnvSpec, compute_episode_constants, new_episode_constants
from houseexpo.pseudoslam.kernels.bound_pool import PoolBinding
from houseexpo.pseudoslam.kernels.collision import HALF_DIAGONAL, STATIC, mark_disc, placed_people
from houseexpo.pseudoslam.kernels.compiling import compiled_function
from houseexpo.pseudoslam.kernels.episode import Episode, StepParams
from houseexpo.pseudoslam.kernels.mapping import CHUNK
from houseexpo.pseudoslam.kernels.radio import exchange_maps
from houseexpo.pseudoslam.kernels.step import SKIP, STEP
from houseexpo.pseudoslam.kernels.team_step import (
    EVERYONE,
    TOGETHER,
    TeamKnowledge,
    TeamObstacles,
    count_met_and_seen,
    count_step,
    prepare_commands,
    prepare_motions,
)
from houseexpo.pseudoslam.kernels.types import Rows, Scratch
from houseexpo.pseudoslam.state import RASTERS, State, flatten_episode, unflatten_episode, view_episode
from houseexpo.pseudoslam.step_kernels import choose_kernel
from houseexpo.pseudoslam.teams.tasks import Radio
from houseexpo.pseudoslam.worlds.world import World

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]
Grid = npt.NDArray[np.uint8]

_ALL: Final = np.ones(1, np.uint8)
_LEVELS: Final = "90", "99"
"""The names of ``kernels.team_step.LEVELS``, in percent."""


def note_exchange(pool: Episode, sizes: npt.NDArray[np.int64]) -> None:
    """Have overviews and pictures redrawn: robots receive cells that their own scans have not drawn."""
    pool.changed[..., 0], pool.changed[..., 1] = 0, sizes[:, :1]
    pool.changed[..., 2], pool.changed[..., 3] = 0, sizes[:, 1:]


def moves_people(config: SimulatorConfig, robot: int) -> bool:
    """Return whether a robot's episode moves people and bodies on trajectories; only the first one's does."""
    return robot == 0 and (config.people.number > 0 or len(config.trajectories) > 0)


def new_measures(teams: int) -> Rows:
    """Return initial measures of teams (teams,), ``kernels.team_step.TOGETHER``."""
    found = np.zeros(teams, TOGETHER)
    for level in _LEVELS:
        found[f"steps_{level}"] = found[f"metres_{level}"] = np.nan
    return found


def new_knowledge(teams: int, robots: int, cells: int, chunks: int) -> TeamKnowledge:
    """Return the initial knowledge: teams know nothing, and their robots have exchanged nothing."""
    return TeamKnowledge(
        np.zeros((teams, cells), np.uint8),
        np.full((teams, robots, chunks), EVERYONE, np.uint16),
        np.full((teams, robots, count_chunks(chunks)), EVERYONE, np.uint16),
        new_measures(teams),
    )


def compute_report(
    measures: Rows, ways_m: Floats, collisions: npt.NDArray[np.int64], observable: Floats, pixels_per_metre: float
) -> dict[str, npt.NDArray[Any]]:
    """Return the measures of N teams by name, each (N,), NaN for what has not happened; see ``Team.report``."""
    now = measures.copy()  # its columns belong to the caller
    return {
        "team_coverage": now["covered"] / observable,
        "team_explored_m2": now["explored"] / pixels_per_metre**2,
        "makespan": now["steps"],
        "metres": ways_m.sum(axis=1),
        "longest_m": ways_m.max(axis=1),
        "overlap": np.maximum(1.0 - now["explored"] / np.maximum(now["found"], 1), 0.0),
        "connected": now["joined"] / np.maximum(now["steps"], 1),
        "collisions": collisions.sum(axis=1),
        "meetings": now["meetings"],
        "steps_to_90": now["steps_90"],
        "metres_to_90": now["metres_90"],
        "steps_to_99": now["steps_99"],
        "metres_to_99": now["metres_99"],
    }


def plain_report(found: dict[str, npt.NDArray[Any]]) -> dict[str, float | None]:
    """Return the measures of one team, from arrays (1,), as plain numbers; None for what has not happened."""
    values = {name: part.item() for name, part in found.items()}
    values |= {name: None for name, value in values.items() if value != value}  # noqa: PLR0124  # NaN
    return values | {n: int(value) for n, value in values.items() if n.startswith("steps") and value is not None}


class TeamKernels:
    """The compiled parts of a team's step around the single robot's step, for robots of the same number in N teams."""

    def __init__(self, params: StepParams, radio: Radio, pixels_per_metre: float, *, drives: bool) -> None:
        self._params, self._drives = params, drives
        self._pixels_per_metre = pixels_per_metre
        self._link = radio.link(1.0 / pixels_per_metre)
        self._calls: dict[str, Callable[..., Any]] = {}
        self._binding = PoolBinding()

    def prepare(
        self,
        pool: Episode,
        sizes: npt.NDArray[np.int64],
        motions: Floats,
        others: TeamObstacles,
        part: tuple[int, int, int],
    ) -> None:
        """Call ``kernels.team_step.prepare_motions`` for a robot's number and teams from one number to another."""
        given: tuple[Any, ...] = (
            pool.occupied, pool.counts, pool.pose, sizes, motions, others, self._params.errors, *part,
        )  # fmt: skip
        if self._drives:
            params = self._params
            given = *given, pool.readings, params.drive, params.robot, params.seconds
            self._call("prepare", prepare_commands, given)
        else:
            self._call("prepare", prepare_motions, given)

    def step(
        self,
        pool: Episode,
        sizes: npt.NDArray[np.int64],
        motions: Floats,
        scratch: Scratch,
        robot: int,
        *,
        moves: bool,
    ) -> None:
        """Take the step of one robot of a team alone; ``moves`` is an argument of ``choose_kernel``."""
        wanted = np.full(len(sizes), SKIP, np.uint8)
        wanted[robot] = STEP
        given = self._binding.bind(pool, sizes, self._params, scratch), motions, wanted, robot, robot + 1
        name = "step, people" if moves else "step"
        if name not in self._calls:
            kernel = choose_kernel(view_episode(pool, 0, (0, 0)), self._params, moves=moves)
            self._calls[name] = compiled_function(kernel, *given)
        self._calls[name](*given)

    def gather(
        self,
        pool: Episode,
        sizes: npt.NDArray[np.int64],
        others: TeamObstacles,
        shared: TeamKnowledge,
        part: tuple[int, int, int],
    ) -> None:
        """Call ``kernels.team_step.count_met_and_seen``."""
        given = (
            pool.observable, pool.known, pool.counts, pool.pose, sizes, pool.fresh, others, shared, *part,
        )  # fmt: skip
        self._call("gather", count_met_and_seen, given)

    def exchange(  # noqa: PLR0917  # what the kernel takes
        self,
        pool: Episode,
        sizes: npt.NDArray[np.int64],
        others: TeamObstacles,
        shared: TeamKnowledge,
        contact: RadioContact,
        wanted: Grid,
        part: tuple[int, int],
    ) -> None:
        """Call ``kernels.radio.exchange_maps`` for teams from one number to another."""
        given = (
            pool.known, pool.observable, pool.counts, sizes, others, shared, self._link,
            contact.heard.view(np.uint8), contact.joined.view(np.uint8), wanted, *part,
        )  # fmt: skip
        self._call("exchange", exchange_maps, given)

    def update_measures(
        self, measures: Rows, active: Bools, joined: Bools, ways_px: Floats, observable: Floats
    ) -> None:
        """Take note of a step of N teams, after their robots have exchanged maps.

        Parameters
        ----------
        measures
            (N,), changed in place.
        active
            (N,), whether a team has taken the step; the measures of other teams stay.
        joined
            (N,), whether each robot reaches every other robot by radio.
        ways_px
            (N, R), the distances that the robots have travelled, pixels.
        observable
            (N,), the number of cells that coverage counts.
        """
        given = measures, active.view(np.uint8), joined.view(np.uint8), observable
        if self._call("count_step", count_step, given):
            for level in _LEVELS:
                metres = measures[f"metres_{level}"]
                new = np.isnan(metres) & ~np.isnan(measures[f"steps_{level}"])
                metres[new] = ways_px[new].sum(axis=1) / self._pixels_per_metre

    def _call(self, name: str, kernel: Any, given: tuple[Any, ...]) -> Any:
        if name not in self._calls:
            self._calls[name] = compiled_function(kernel, *given)
        return self._calls[name](*given)

    def __getstate__(self) -> dict[str, Any]:
        """Pickle and copy without the compiled functions, which the copy finds again."""
        return {**self.__dict__, "_calls": {}}


@dataclass(frozen=True)
class RadioContact:
    """The radio contact of the robots of N teams of R in the last exchange."""

    heard: Bools
    """(N, R, R), whether one robot could hear another."""
    joined: Bools
    """(N,), whether each robot reached every other robot, directly or through others."""


def disc_sizes_px(params: StepParams) -> tuple[float, float, float]:
    """Return the last fields of ``TeamObstacles``: the radii of robots and people, and how far robots see."""
    radius = float(params.robot.radius_px)
    return radius, float(params.walk.radius_px), params.sensor.range_px + params.clearance_px + 2.0 * radius


def new_radio_contact(teams: int, robots: int) -> RadioContact:
    """Return the initial contact: nobody has heard anybody; only a team of one robot is joined."""
    return RadioContact(np.zeros((teams, robots, robots), bool), np.full(teams, robots == 1))


def count_chunks(cells: int) -> int:
    """Return the number of chunks of cells (``kernels.mapping.CHUNK``)."""
    return -(-cells // CHUNK)


def shares_map_changes(radio: Radio) -> bool:
    """Return whether the kernel exchanges the changes of the robots' maps."""
    return radio.model != "none"


class Team:
    """The episode of a team in one house, up to the first scans; ``pools.TeamPools.step`` goes on.

    Robots move one after the other, in the order of their numbers; they block and see each other. Each has its own map.
    After all have moved, robots that hear each other exchange their maps. The first robot's episode also moves the
    people; people walk round that robot, and the other robots are obstacles to them.

    Parameters
    ----------
    spec
        The specification of one robot's environment, without planners' actions.
    world
        The house.
    rng
        Source of all random values. The first robot draws the same values as a single robot; the others have their own.
    starts
        Poses of the first robots; the others start at random places.
    around
        The result of ``make_team_kernels``, if there is one already.

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
        around: TeamKernels | None = None,
    ) -> None:
        self.spec, self.world, self.radio = spec, world, radio
        self.params, self.scratch = spec.params(), spec.scratch()
        self.ppm, self.radius_px = spec.config.pixels_per_metre, self.params.robot.radius_px
        self.states: list[State] = []
        self._place(robots, rng, list(starts))
        first = self.states[0]
        self.walls: Grid = (first.occupied & STATIC).astype(np.uint8)
        self.constants = new_episode_constants(robots)
        for k, state in enumerate(self.states):
            self.constants.rows[k] = compute_episode_constants(state, world)
        self.pool, self.sizes = self._share()
        self.contact = new_radio_contact(1, robots)
        chunks = count_chunks(self.walls.size) if shares_map_changes(radio) and robots > 1 else 0
        self.shared = new_knowledge(1, robots, self.walls.size, chunks)
        self.observable = np.array([float(max(first.observable_cells, 1))])
        self._around = around or make_team_kernels(spec, self.params, radio)
        bodies = self.pool.bodies
        self.others = TeamObstacles(
            self.walls.reshape(1, -1), bodies.people, bodies.robots,
            np.full((robots, robots + bodies.people.shape[1], 2), np.nan), np.zeros(1, np.uint8), np.zeros(1, np.int64),
            *disc_sizes_px(self.params),
        )  # fmt: skip
        still = np.zeros((robots, 3 if spec.config.robot.drive else 2))
        for k in range(robots):
            self._look(k, still)
        self.exchange()

    @property
    def known(self) -> Grid:
        """The combined map of all robots (rows, cols)."""
        return self.shared.known[0, : self.walls.size].reshape(self.walls.shape)

    @property
    def heard(self) -> Bools:
        """Whether one robot could hear another in the last exchange (n, n)."""
        found: Bools = self.contact.heard[0]
        return found

    @property
    def together(self) -> Rows:
        """The team's row of ``kernels.team_step.TOGETHER``, as an array (1,)."""
        return self.shared.together

    @property
    def steps(self) -> int:
        """The number of steps so far."""
        return int(self.together["steps"][0])

    @property
    def explored(self) -> int:
        """The number of cells that the robots know together."""
        return int(self.together["explored"][0])

    @property
    def covered(self) -> int:
        """The number of cells that the robots know together and that coverage counts."""
        return int(self.together["covered"][0])

    def __len__(self) -> int:
        return len(self.states)

    def _place(self, robots: int, rng: np.random.Generator, starts: list[Pose | None]) -> None:
        """Start the episodes of all robots, each away from those before it."""
        config = self.spec.config
        starts += [None] * (robots - len(starts))
        alone = replace(self.spec, config=replace(config, people=PeopleConfig(), obstacles=ObstaclesConfig()))
        for k, start in enumerate(starts):
            if start is not None:
                check_start_apart(
                    k, start, self.world.frame.points_from_pixels(self.places_px()), config.robot.radius_m
                )
            if k == 0:
                self.states.append(self.spec.initial_state(self.world, self.params, self.scratch, rng, pose_m=start))
                streams = rng.spawn(robots - 1)
                continue
            first = self.states[0]
            occupied = first.occupied.copy()
            mark_discs(occupied, self.places_px(), self.radius_px)
            people = placed_people(first.episode.bodies.people)
            centres = np.column_stack([people["x"], people["y"]])
            mark_discs(occupied, centres, self.params.walk.radius_px + HALF_DIAGONAL)  # not a part of a cell too near
            occupied.flags.writeable = False
            world = replace(self.world, occupied=occupied)
            try:
                state = alone.initial_state(world, self.params, self.scratch, streams[k - 1], pose_m=start)
            except ConfigError as error:
                if start is not None:
                    raise
                raise no_room_error(k, robots, config.robot.radius_m, self.world.plan_id) from error
            state.observable_cells, state.obstacles = first.observable_cells, first.obstacles
            state.episode.observable[:] = first.episode.observable
            if config.known_map:  # without the robots before it
                state.episode.known[:] = first.episode.known
            self.states.append(state)
        places, people = self.places_px(), self.states[0].episode.bodies.people
        for k, state in enumerate(self.states):
            bodies = state.episode.bodies._replace(robots=places)
            if k > 0:
                bodies = bodies._replace(people=np.zeros_like(people))
            fresh = np.ones(count_chunks(state.occupied.size), np.uint8)  # also what a robot knows from the start
            state.episode = state.episode._replace(bodies=bodies, fresh=fresh)

    def _share(self) -> tuple[Episode, npt.NDArray[np.int64]]:
        """Put the robots' episodes into one pool; return it, and the sizes of the rasters of each."""
        shape = self.walls.shape
        leaves = [
            np.stack(parts) for parts in zip(*(flatten_episode(state.episode) for state in self.states), strict=True)
        ]
        leaves[:RASTERS] = [raster.reshape(len(self), -1) for raster in leaves[:RASTERS]]
        pool = unflatten_episode(self.states[0].episode, leaves)
        self.states = [replace(state, episode=view_episode(pool, k, shape)) for k, state in enumerate(self.states)]
        return pool, np.tile(np.array(shape), (len(self), 1))

    def places_px(self) -> Floats:
        """Return the robots' places (n, 2), pixels, as a new array."""
        return np.array([state.pose_px[:2] for state in self.states]).reshape(-1, 2)

    def _look(self, robot: int, still: Floats) -> None:
        """Take one robot's first scan, and add it to the team's combined map."""
        part = robot, 0, 1
        self._around.prepare(self.pool, self.sizes, still, self.others, part)
        moves = moves_people(self.spec.config, robot)
        self._around.step(self.pool, self.sizes, still, self.scratch, robot, moves=moves)
        self._around.gather(self.pool, self.sizes, self.others, self.shared, part)

    def exchange(self) -> None:
        """Let the robots that hear each other exchange their maps as they were before the exchange."""
        if len(self) == 1:
            return
        self._around.exchange(self.pool, self.sizes, self.others, self.shared, self.contact, _ALL, (0, 1))

    @property
    def is_joined(self) -> bool:
        """Whether each robot reached every other robot by radio in the last exchange, directly or through others."""
        return bool(self.contact.joined[0])

    def ways_m(self) -> Floats:
        """Return the metres that each robot has travelled (n,)."""
        return np.array([float(state.episode.readings[0].path_length) for state in self.states]) / self.ppm

    @property
    def coverage(self) -> float:
        """The share of what can be seen that the robots know together, 0 to 1."""
        return self.covered / float(self.observable[0])

    def report(self) -> dict[str, float | None]:
        """Return the measures of the team.

        ``team_coverage`` and ``team_explored_m2`` are measured on the combined map. ``steps_to_90``, ``metres_to_90``
        and the same for 99 are the steps, and the metres of all robots together, until the team knew these percentages
        of the observable cells. ``meetings`` is how often one robot was blocked by another. ``makespan`` is the number
        of steps so far.
        ``metres`` is the distance of all robots, ``longest_m`` the longest distance of one robot. Of the cells that
        were new to the robot that saw them, ``overlap`` is the share that the team knew. ``connected`` is the share of
        steps after which each robot could reach every other robot by radio. ``collisions`` counts those of all robots.
        """
        collisions = np.array([[int(state.counts.collisions) for state in self.states]])
        found = compute_report(self.together, self.ways_m()[None], collisions, self.observable, self.ppm)
        return plain_report(found)


def make_team_kernels(spec: EnvSpec, params: StepParams, radio: Radio) -> TeamKernels:
    """Return the compiled parts of a step round the single robot's."""
    return TeamKernels(params, radio, spec.config.pixels_per_metre, drives=spec.config.robot.drive is not None)


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
