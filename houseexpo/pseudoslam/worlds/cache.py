"""Make the world of a plan (its rasters) for a configuration, or take it from memory or disk if it was made before."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from threading import Lock

import numpy as np

from houseexpo.dataset import Dataset
from houseexpo.errors import ConfigError
from houseexpo.lru_cache import LruCache
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.worlds.goal_regions import make_goal_regions, mark_room_labels
from houseexpo.pseudoslam.worlds.maps import House, MapHouse, Plans, open_houses
from houseexpo.pseudoslam.worlds.margin import add_margin
from houseexpo.pseudoslam.worlds.moving_obstacles import make_flow_field, make_tracks
from houseexpo.pseudoslam.worlds.store import WorldStore, unpack_raster
from houseexpo.pseudoslam.worlds.world import World, make_world, make_world_from_raster
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
        The grid would have more than ``world.MAX_CELLS`` cells, the robot or people fit nowhere, or a trajectory runs
        into a wall.
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
