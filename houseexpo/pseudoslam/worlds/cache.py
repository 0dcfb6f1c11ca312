"""Make the world of a plan (its rasters) for a configuration, or take it from memory or disk if it was made before.

``prepare_worlds`` makes those of a whole data set in advance, with several processes.
"""

from __future__ import annotations

import math
import sqlite3
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from threading import Lock
from typing import Final

import numpy as np

from houseexpo.dataset import Dataset
from houseexpo.errors import ConfigError, HouseExpoError
from houseexpo.floorplan import decode
from houseexpo.grids.frame import GridFrame
from houseexpo.lru_cache import LruCache
from houseexpo.processes import map_in_processes
from houseexpo.progress import show_progress
from houseexpo.pseudoslam.config import Ackermann, NoiseConfig, SimulatorConfig
from houseexpo.pseudoslam.worlds.goal_regions import make_goal_regions, mark_room_labels
from houseexpo.pseudoslam.worlds.maps import House, MapHouse, Plans, open_houses
from houseexpo.pseudoslam.worlds.moving_obstacles import make_flow_field, make_tracks
from houseexpo.pseudoslam.worlds.store import WorldStore, encode_world, unpack_raster, world_file
from houseexpo.pseudoslam.worlds.world import MAX_WORLD_CELLS, World, make_world, make_world_from_raster
from houseexpo.words import unknown_name_message

MAX_KEPT = 1_000_000_000
"""Bytes of packed worlds in memory. A house of 120 m2 takes 20 kB at 16 px/m, so that 10,000 of them fit easily."""
MAX_OPEN = 150_000_000
"""Bytes of unpacked worlds in memory: about 400 such houses."""
OF_A_CELL = 8
"""Bytes per cell of an unpacked world with obstacles: three rasters, an empty map and the nearest standing cells."""


def world_for(plan: House, config: SimulatorConfig) -> World:
    """Return the world of a plan or a map for a configuration, including what moves and the margin for noise.

    Raises
    ------
    ConfigError
        The grid would have more than ``world.MAX_WORLD_CELLS`` cells, the robot or people fit nowhere, or a trajectory
        runs into a wall.
    PlanError
        The plan has no free cell.
    """
    return finish_world(load_static_world(plan, config), plan, config)


def load_static_world(plan: House, config: SimulatorConfig) -> World:
    """Return the world of a plan or a map like ``world_for``, but without moving obstacles and the margin."""
    if isinstance(plan, MapHouse):
        house = plan.resample(config.pixels_per_metre).with_border()
        return make_world_from_raster(
            house.occupied.copy(), house.frame, config.robot.radius_m, config.laser.range_m, house.id
        )
    return make_world(plan, config.pixels_per_metre, config.robot.radius_m, config.laser.range_m)


def finish_world(world: World, plan: House, config: SimulatorConfig) -> World:
    """Return a static world with the margin for noise, and what goals, people and trajectories need."""
    world = add_margin(world, config)
    if config.trajectories:
        world = replace(world, tracks=make_tracks(config.trajectories, world.occupied, world.frame, plan.id))
    if config.goal_region:
        regions = make_goal_regions(plan, world, config.goal_region)
        world = replace(world, regions=regions, labels=mark_room_labels(plan, world.frame))
    if config.people.number:
        world = replace(world, flow=make_flow_field(world.occupied, world.frame, config.people.radius_m, plan))
    return world


class WorldCache:
    """The worlds of a data set for one configuration; recent ones stay in memory as bits, the latest as bytes.

    ``plans`` is a data set or its path, a plan, a list of plans, or maps (``worlds.maps``). The worlds of a data set
    are also stored on disk (``worlds.store``), by ``prepare`` or when they are first used, but without moving
    obstacles.
    """

    def __init__(self, plans: Plans, config: SimulatorConfig) -> None:
        self._plans: Sequence[House] = open_houses(plans)
        self._config = config
        self._stored = (self._plans, WorldStore(config)) if isinstance(self._plans, Dataset) else None
        self._adds = bool(config.trajectories or config.people.number or config.goal_region)
        self._kept: LruCache[_Packed] = LruCache(MAX_KEPT, lambda packed: packed.size)
        self._open: LruCache[World] = LruCache(MAX_OPEN, lambda world: OF_A_CELL * world.occupied.nbytes)
        self._lock = Lock()

    def __reduce__(self) -> tuple[type[WorldCache], tuple[Sequence[House], SimulatorConfig]]:
        """Pickle the plans and the configuration; worlds are made again when they are used."""
        return WorldCache, (self._plans, self._config)

    def __deepcopy__(self, memo: dict[int, object]) -> WorldCache:
        """Return the cache itself, since worlds do not change and threads may share it."""
        return self

    def __len__(self) -> int:
        return len(self._plans)

    def __getitem__(self, number: int) -> World:
        """Return the world of a plan; raise ConfigError or PlanError like ``world_for``."""
        with self._lock:
            self._kept.get(number)  # it is used, also where it is unpacked
            return self._open.get_or_make(number, lambda: self._world_for_unpacking(number))

    def _world_for_unpacking(self, number: int) -> World:
        """Return the world of a plan that is not unpacked: from memory, from disk, or newly made."""
        if self._stored is not None and not self._adds:
            return add_margin(self._static_world(number), self._config)

        def pack() -> _Packed:
            return _Packed(finish_world(self._static_world(number), self._plans[number], self._config))

        return self._kept.get_or_make(number, pack).unpack()

    def _static_world(self, number: int) -> World:
        """Return a world without moving obstacles; for a plan of a data set, load it from disk or store it there."""
        if self._stored is None:
            return load_static_world(self._plans[number], self._config)
        plans, store = self._stored
        key = plans.digest(number)
        world = store.get(key)
        if world is None:
            world = load_static_world(plans[number], self._config)
            store.put(key, world)
        return world

    def number_of(self, plan_id: str, key: str = "plan_id") -> int:
        """Return the number of a plan; raise ConfigError, which names ``key``, if there is no plan with this id."""
        if not isinstance(plan_id, str) or plan_id not in self._numbers:
            known = list(reversed(self._numbers))  # in the data set's order
            near = unknown_name_message(plan_id, known).partition("; ")[2] if isinstance(plan_id, str) else ""
            said = f"{key}: none of the {len(self._numbers)} plans has the id {plan_id!r}"
            raise ConfigError(f"{said}; {near}" if near else said)
        return self._numbers[plan_id]

    @cached_property
    def _numbers(self) -> dict[str, int]:
        """The plans' numbers by their ids; for equal ids, the first."""
        ids: Sequence[str] = getattr(self._plans, "ids", None) or [plan.id for plan in self._plans]
        return {plan_id: number for number, plan_id in reversed(list(enumerate(ids)))}


class _Packed:
    """A world with its rasters as bits, a thirtieth of the bytes that an episode copies."""

    def __init__(self, world: World) -> None:
        empty = np.empty((0, 0), np.uint8)
        self._world = replace(world, occupied=empty, traversable=empty, observable=empty)
        self._shape = world.occupied.shape
        self._bits = [np.packbits(raster) for raster in (world.occupied, world.traversable, world.observable)]

    @property
    def size(self) -> int:
        """The approximate number of bytes."""
        flow, regions = self._world.flow, self._world.regions.values()
        cells = self._world.labels.nbytes + sum(region.inside.nbytes + region.marked.nbytes for region in regions)
        return sum(bits.nbytes for bits in self._bits) + flow.toward.nbytes + flow.spots.nbytes + cells

    def unpack(self) -> World:
        """Return the unpacked world."""
        occupied, traversable, observable = (unpack_raster(bits, *self._shape) for bits in self._bits)
        return replace(self._world, occupied=occupied, traversable=traversable, observable=observable)


# Compute how far outside of a house noise can draw cells, and give worlds a margin of that width.
#
# A map is drawn from the believed pose, with the errors of the laser and of registration. What these move outward needs
# cells to be drawn in. The margin is unknown in maps and occupied in the world, so that nothing can go or see there.
#
# R1  A draw of ``kernels.hashing.normal`` is at most ``MOST_SIGMA``: errors that are drawn once (laser, registration)
#     have that bound, and none of their cells is lost. With ``max_range``, beams draw cells up to the laser's range.
# R2  Odometry turns the house about its middle and shifts it. With a heading error a_k after k steps and the robot at
#     p_k from the middle, a wall at w is drawn at R(a_n) w - sum (R(a_k) - R(a_(k-1))) p_k + the errors of the way. The
#     robot stays in the house; so for errors that are drawn, the shift grows with the root of the number of steps, and
#     not with the length of the path. The margin has ``DRIFT_SIGMA`` of it after ``max_steps`` steps, with the robot in
#     the house's corner and each step a full turn and a full way, and the sum of the systematic errors.
# R3  A map that has drifted by the house's own diagonal is no map of it: the margin ends there, and where the grid
#     would have more than ``MAX_WORLD_CELLS`` cells. Cells beyond it are counted (``COUNTS.lost``), and ``info`` has
#     ``lost_m2``.


MOST_SIGMA: Final = math.sqrt(66.0 * math.log(2.0))
"""The largest draw of a normal distribution: 6.76; a uniform one is at least 2 ** -33 (``kernels.hashing``)."""
DRIFT_SIGMA: Final = 1.5
"""Standard deviations of drift that have room, of a robot that is always in the house's corner. Robots that wandered
through 60 published plans for 4,000 steps with the noise of the track ``noisy`` used 0.47 of the margin at most, and
0.13 on average."""


def margin_px(config: SimulatorConfig, rows: int, cols: int) -> int:
    """Return the width of the margin that a map of (rows, cols) needs with the noise of a configuration, cells."""
    noise, ppm = config.noise, config.pixels_per_metre
    if not noise.any:
        return 0
    needed_m = _scan_m(noise, config.laser.range_m)
    if noise.odometry:
        needed_m += min(_drift_m(config, rows / ppm, cols / ppm), math.hypot(rows, cols) / ppm)
    needed = math.ceil(needed_m * ppm) + 1  # a cell's centre falls into the next cell
    # (rows + 2a)(cols + 2a) = MAX_WORLD_CELLS
    across = (math.sqrt((rows - cols) ** 2 + 4.0 * MAX_WORLD_CELLS) - rows - cols) / 4.0
    return max(min(needed, math.floor(across)), 0)


def add_margin(world: World, config: SimulatorConfig) -> World:
    """Return a world with the margin that a configuration needs, or the same world if it needs no margin."""
    rows, cols = world.occupied.shape
    margin = margin_px(config, rows, cols)
    if not margin:
        return world
    frame, margin_m = world.frame, margin / world.frame.pixels_per_metre
    origin_m = (frame.origin_m[0] - margin_m, frame.origin_m[1] - margin_m)
    wider = replace(
        world,
        frame=GridFrame(origin_m, frame.pixels_per_metre, (rows + 2 * margin, cols + 2 * margin), frame.y_up),
        occupied=np.pad(world.occupied, margin, constant_values=1),
        traversable=np.pad(world.traversable, margin),
        observable=np.pad(world.observable, margin),
        margin_px=margin,
    )
    for array in (wider.occupied, wider.traversable, wider.observable):
        array.flags.writeable = False
    return wider


def _scan_m(noise: NoiseConfig, range_m: float) -> float:
    """Return how far the noise of a scan can move a cell outward (R1)."""
    laser_m = range_m if noise.max_range > 0 else min(MOST_SIGMA * noise.laser_m, range_m)
    turned = 2.0 * math.sin(min(MOST_SIGMA * math.radians(noise.registration_deg), math.pi) / 2.0)
    return laser_m + turned * range_m + MOST_SIGMA * noise.registration_m


def _drift_m(config: SimulatorConfig, height_m: float, width_m: float) -> float:
    """Return how far odometry may move the walls of a house of this size outward in an episode (R2)."""
    steps, half_m = config.max_steps, math.hypot(height_m, width_m) / 2.0
    turn, way, always_turn, always_way = _errors_of_a_step(config)
    seconds = steps * config.step_s
    rate = math.radians(config.noise.odometry_bias_deg_s)  # its integral has the deviation rate sqrt(t ** 3 / 3)
    heading = math.sqrt(turn**2 * steps + rate**2 * seconds**3 / 3.0)
    turned = min(DRIFT_SIGMA * heading + always_turn * steps, math.pi)
    rotation_m = min(2.0 * math.sin(turned / 2.0) * half_m, half_m - min(height_m, width_m) / 2.0)
    shift_m = DRIFT_SIGMA * math.hypot(heading * half_m, way * math.sqrt(steps))
    return rotation_m + shift_m + (always_turn * half_m + always_way) * steps


def _errors_of_a_step(config: SimulatorConfig) -> tuple[float, float, float, float]:
    """Return the deviations of a full step's heading and way by odometry, and their systematic errors; rad and m."""
    noise, robot = config.noise, config.robot
    way, turn = config.full_step_m, math.radians(robot.turn_deg)
    if isinstance(robot.drive, Ackermann):
        turn = way / robot.drive.least_radius_m
    elif robot.drive:
        turn = robot.drive.most_turning * config.step_s
    way2, turn2 = way * way, turn * turn
    heading2 = (noise.odometry_turn * turn) ** 2 + (math.radians(noise.odometry_deg_per_m) * way) ** 2
    along2, slipped = (noise.odometry_way * way) ** 2, 2.0 * noise.slip
    heading2, along2 = heading2 + (slipped * turn) ** 2 / 12.0, along2 + (slipped * way) ** 2 / 12.0  # a uniform share
    always_turn, always_way = noise.slip * turn, noise.slip * way
    model = noise.odometry_model
    if model is not None:
        along2 += model.alpha3 * way2 + model.alpha4 * turn2
        heading2 += 2.0 * (model.alpha1 * turn2 + model.alpha2 * way2)
    return math.sqrt(heading2), math.sqrt(along2), always_turn, always_way


_WORLDS_PER_CHUNK: Final = 16
_BATCH: Final = 4096
"""Number of worlds that are written together, which an interrupted run may lose."""
Job = tuple[bytes, bytes]


@dataclass(frozen=True)
class PreparedWorlds:
    """The result of ``prepare_worlds``.

    Parameters
    ----------
    file
        The file of all worlds.
    known, made
        The numbers of worlds that already existed and of those that were made.
    refused
        The errors of plans without a world, for example because the robot does not fit anywhere.
    size
        Size of the file, bytes.
    """

    file: Path
    known: int
    made: int
    refused: tuple[str, ...]
    size: int


def prepare_worlds(plans: Dataset, config: SimulatorConfig, workers: int) -> PreparedWorlds:
    """Make and store the missing worlds of a data set.

    An interrupted run continues where it stopped. With several workers, a script needs ``if __name__ == "__main__"``.

    Raises
    ------
    ConfigError
        Worlds cannot be written: the disk is full, or the folder is read-only.
    """
    file, store = world_file(), WorldStore(config)
    known = store.keys()
    missing = {key: number for number in range(len(plans)) if (key := plans.digest(number)) not in known}
    jobs = ((key, plans.raw_of(number)) for key, number in missing.items())
    refused, waiting, made = [], dict[bytes, bytes](), 0
    for key, found in show_progress(
        _make_records(jobs, len(missing), config, workers), "preparing worlds", len(missing)
    ):
        if isinstance(found, str):
            refused.append(found)
            continue
        waiting[key] = found
        made += 1
        if len(waiting) == _BATCH:
            _keep(store, file, waiting)
    _keep(store, file, waiting)
    return PreparedWorlds(file, len(plans) - len(missing), made, tuple(refused), file.stat().st_size)


def _make_records(
    jobs: Iterator[Job], number: int, config: SimulatorConfig, workers: int
) -> Iterator[tuple[bytes, bytes | str]]:
    """Yield the bytes of worlds, or the error, with the plan's hash."""
    work = partial(_make_record, config)
    if workers <= 1 or number <= _WORLDS_PER_CHUNK:
        yield from map(work, jobs)
        return
    yield work(next(jobs))  # so that kernels are compiled only once
    yield from map_in_processes(work, jobs, workers, _WORLDS_PER_CHUNK)


def _make_record(config: SimulatorConfig, job: Job) -> tuple[bytes, bytes | str]:
    key, data = job
    try:
        return key, encode_world(load_static_world(decode(data), config))
    except HouseExpoError as error:
        return key, str(error)


def _keep(store: WorldStore, file: Path, waiting: dict[bytes, bytes]) -> None:
    """Write worlds, and empty the dictionary."""
    try:
        store.write(waiting)
    except (sqlite3.Error, OSError) as error:
        raise ConfigError(
            f"{file}: {len(waiting)} worlds, some {sum(map(len, waiting.values())) / 1e6:.0f} MB at once, cannot be "
            f"written ({error}); free some space, or name another folder in HOUSEEXPO_CACHE. Worlds that were written "
            "before are kept"
        ) from None
    waiting.clear()
