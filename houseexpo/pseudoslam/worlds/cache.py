"""Plans as worlds, each rasterised once and shared."""

from __future__ import annotations

import os
from collections import OrderedDict
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from threading import Lock
from typing import Generic, TypeAlias, TypeVar, Union

import numpy as np

from houseexpo.dataset import Dataset, open_dataset
from houseexpo.dataset.store.catalogue import nearest
from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.worlds.flow import make_flow
from houseexpo.pseudoslam.worlds.records import encode_world, raster_of
from houseexpo.pseudoslam.worlds.store import WorldStore
from houseexpo.pseudoslam.worlds.trajectories import make_tracks
from houseexpo.pseudoslam.worlds.world import World, make_world

Thing = TypeVar("Thing")
Plans: TypeAlias = Union[str, "os.PathLike[str]", FloorPlan, Sequence[FloorPlan]]

MAX_KEPT = 1_000_000_000
"""Bytes of worlds that stay in memory. Packed, a house of 120 m2 takes 20 kB at 16 px/m: 10,000 of them fit easily."""
MAX_OPEN = 150_000_000
"""Bytes of worlds that stay in memory unpacked, too: some 400 such houses."""
OF_A_CELL = 8
"""Bytes of such a world, where obstacles are set down: three rasters, an empty map and the nearest standing cells."""


def world_for(plan: FloorPlan, config: SimulatorConfig) -> World:
    """Return the world of a plan for a configuration, with the ways of what moves in it.

    Raises
    ------
    ConfigError
        Where the grid would have more than ``world.MAX_CELLS``, the robot or people fit nowhere, or a trajectory runs
        into a wall.
    PlanError
        Where the plan has no free cell.
    """
    return with_what_moves(still_world(plan, config), plan, config)


def still_world(plan: FloorPlan, config: SimulatorConfig) -> World:
    """Return the world of a plan without what moves in it, as ``world_for`` does."""
    return make_world(plan, config.pixels_per_metre, config.robot.radius_m, config.laser.range_m)


def with_what_moves(world: World, plan: FloorPlan, config: SimulatorConfig) -> World:
    """Return a world with the ways of what moves in it, as ``world_for`` does."""
    if config.trajectories:
        world = replace(world, tracks=make_tracks(config.trajectories, world.occupied, world.frame, plan.id))
    if config.people.number:
        world = replace(world, flow=make_flow(world.occupied, world.frame, config.people.radius_m, plan))
    return world


class WorldCache:
    """The worlds of a data set for one configuration; those used last stay in memory: as bits, the latest as bytes.

    ``plans`` is a data set or its path, a plan, or a list of plans. The worlds of a data set are kept on disk, too
    (``worlds.store``), made by ``prepare`` or when they are first asked for; what moves in them is not.
    """

    def __init__(self, plans: Plans, config: SimulatorConfig) -> None:
        found = open_dataset(plans) if isinstance(plans, (str, os.PathLike)) else plans
        self._plans: Sequence[FloorPlan] = [found] if isinstance(found, FloorPlan) else found
        given = self._plans if isinstance(self._plans, (list, tuple)) else ()  # a data set's plans are read later
        if not isinstance(self._plans, Sequence) or not all(isinstance(plan, FloorPlan) for plan in given):
            raise ConfigError(f"dataset: expected a data set or its path, a plan, or a list of plans, found {found!r}")
        if not len(self._plans):
            raise ConfigError("dataset: expected at least one plan, found none")
        self._config = config
        self._stored = (self._plans, WorldStore.of(config)) if isinstance(self._plans, Dataset) else None
        self._moves = bool(config.trajectories or config.people.number)
        self._kept: _Recent[_Packed] = _Recent(MAX_KEPT)
        self._open: _Recent[World] = _Recent(MAX_OPEN)
        self._lock = Lock()

    def __reduce__(self) -> tuple[type[WorldCache], tuple[Sequence[FloorPlan], SimulatorConfig]]:
        """Pickle the plans and the configuration; worlds are made again where they are used."""
        return WorldCache, (self._plans, self._config)

    def __deepcopy__(self, memo: dict[int, object]) -> WorldCache:
        """Return the cache itself: worlds do not change, and threads may share it."""
        return self

    def __len__(self) -> int:
        return len(self._plans)

    def __getitem__(self, number: int) -> World:
        """Return the world of a plan; ConfigError and PlanError as ``world_for`` raises them."""
        with self._lock:
            world = self._open.used(number)
            if world is None:
                world = self._closed(number)
                self._open.keep(number, world, OF_A_CELL * world.occupied.nbytes)
            else:
                self._kept.used(number)
            return world

    def _closed(self, number: int) -> World:
        """Return the world of a plan that is not open: from disk, or from memory, or made anew."""
        if self._stored is not None and not self._moves:
            return self._still(number)
        packed = self._kept.used(number)
        if packed is None:
            packed = _Packed(with_what_moves(self._still(number), self._plans[number], self._config))
            self._kept.keep(number, packed, packed.size)
        return packed.unpacked()

    def _still(self, number: int) -> World:
        """Return a world without what moves: of a data set's plan from disk, where it is kept from now on."""
        if self._stored is None:
            return still_world(self._plans[number], self._config)
        plans, store = self._stored
        key = plans.digest(number)
        world = store.get(key)
        if world is None:
            world = still_world(plans[number], self._config)
            store.put(key, encode_world(world))
        return world

    def number_of(self, plan_id: str, key: str = "plan_id") -> int:
        """Return the number of a plan; ConfigError, which names the ``key``, where there is none of that id."""
        if not isinstance(plan_id, str) or plan_id not in self._numbers:
            known = list(reversed(self._numbers))  # in the data set's order
            near = nearest(plan_id, known).partition("; ")[2] if isinstance(plan_id, str) else ""
            said = f"{key}: none of the {len(self._numbers)} plans has the id {plan_id!r}"
            raise ConfigError(f"{said}; {near}" if near else said)
        return self._numbers[plan_id]

    @cached_property
    def _numbers(self) -> dict[str, int]:
        """The plans' numbers by their ids; the first of those with one id."""
        ids: Sequence[str] = getattr(self._plans, "ids", None) or [plan.id for plan in self._plans]
        return {plan_id: number for number, plan_id in reversed(list(enumerate(ids)))}


class _Recent(Generic[Thing]):
    """Things by their number; those used last, up to so many bytes, and the last one in any case."""

    def __init__(self, most: int) -> None:
        self._things: OrderedDict[int, tuple[Thing, int]] = OrderedDict()
        self._most, self.bytes = most, 0

    def __len__(self) -> int:
        return len(self._things)

    def __iter__(self) -> Iterator[int]:
        """Iterate over the numbers, from the one used longest ago."""
        return iter(self._things)

    def used(self, number: int) -> Thing | None:
        """Return a thing that is used now; None where it is not here."""
        if number not in self._things:
            return None
        self._things.move_to_end(number)
        return self._things[number][0]

    def keep(self, number: int, thing: Thing, size: int) -> None:
        """Take in one that is not here, and drop those used longest ago where that is too many bytes."""
        self._things[number] = thing, size
        self.bytes += size
        while self.bytes > self._most and len(self._things) > 1:
            self.bytes -= self._things.popitem(last=False)[1][1]


class _Packed:
    """A world whose rasters are bits: a thirtieth of what an episode copies of them."""

    def __init__(self, world: World) -> None:
        empty = np.empty((0, 0), np.uint8)
        self._world = replace(world, occupied=empty, traversable=empty, observable=empty)
        self._shape = world.occupied.shape
        self._bits = [np.packbits(raster) for raster in (world.occupied, world.traversable, world.observable)]

    @property
    def size(self) -> int:
        """Bytes, nearly."""
        return sum(bits.nbytes for bits in self._bits) + self._world.flow.toward.nbytes + self._world.flow.spots.nbytes

    def unpacked(self) -> World:
        """Return the world."""
        occupied, traversable, observable = (raster_of(bits, *self._shape) for bits in self._bits)
        return replace(self._world, occupied=occupied, traversable=traversable, observable=observable)
