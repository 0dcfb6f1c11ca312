"""Keep worlds on disk (``houseexpo.disk_cache``), found by the plan's hash, the resolution, the robot and its laser.

A record is a world as bytes: compressed bits of its rasters, without moving obstacles. Data sets with common plans
share worlds, and so do processes.
"""

from __future__ import annotations

import logging
import struct
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from houseexpo.disk_cache import DiskCache
from houseexpo.errors import ConfigError
from houseexpo.files import cache_folder
from houseexpo.grids.frame import GridFrame
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.worlds.world import MAX_WORLD_CELLS, World

_WORLDS_FILE: Final = "worlds-2.sqlite"
"""The name has the version of worlds; change it when any raster of a house or a record's layout changes."""

_RECORD_HEAD: Final = struct.Struct("<IIddQH")
"""Rows, columns, x and y of the grid's origin in metres, number of cells for coverage, bytes of the plan's id."""


class RecordError(Exception):
    """Bytes that are not a world of this version; the reader has to make the world again."""


def encode_world(world: World) -> bytes:
    """Return the bytes of a world: about 2 kB for a house of 120 m2 at 25 px/m, 1/30 of its bits."""
    rows, cols = world.occupied.shape
    name = world.plan_id.encode()
    head = _RECORD_HEAD.pack(rows, cols, *world.frame.origin_m, world.observable_cells, len(name))
    rasters = (world.occupied, world.traversable, world.observable)
    bits = np.concatenate([np.packbits(raster) for raster in rasters])
    packed: bytes = _codec().compress(bits, asbytes=True)
    return head + name + packed


def decode_world(data: bytes | memoryview, pixels_per_metre: float) -> World:
    """Return an encoded world, with read-only rasters.

    Raise RecordError if the bytes are not a world of this version.
    """
    try:
        rows, cols, x, y, observable, length = _RECORD_HEAD.unpack_from(data)
        cells = rows * cols
        if not 0 < cells <= MAX_WORLD_CELLS:
            raise RecordError(f"a grid of {rows} x {cols} cells")
        begin = _RECORD_HEAD.size + length
        name = bytes(data[_RECORD_HEAD.size : begin]).decode()
        each = -(-cells // 8)
        bits = np.frombuffer(_codec().decompress(data[begin:], 3 * each), np.uint8)
        occupied, traversable, seen = (unpack_raster(packed, rows, cols) for packed in bits.reshape(3, each))
        frame = GridFrame((x, y), pixels_per_metre, (rows, cols), y_up=True)
        world = World(name, frame, occupied, traversable, seen)
    except (struct.error, UnicodeDecodeError, OSError, ValueError) as error:  # OSError: from the codec
        raise RecordError(str(error)) from None
    world.__dict__["observable_cells"] = observable  # known, so that it need not be counted
    return world


def unpack_raster(bits: npt.NDArray[np.uint8], rows: int, cols: int) -> npt.NDArray[np.uint8]:
    """Return a read-only raster from its bits, as made by ``np.packbits``."""
    raster = np.unpackbits(bits, count=rows * cols).reshape(rows, cols)
    raster.flags.writeable = False
    return raster


@cache
def _codec() -> Any:
    import pyarrow as pa

    return pa.Codec("zstd", compression_level=1)


_log = logging.getLogger(__name__)


def world_file() -> Path:
    """Return the file of all worlds; raise ConfigError if its folder cannot be created."""
    return cache_folder() / _WORLDS_FILE


class WorldStore:
    """The worlds on disk of one configuration; if there can be no file, they are only in memory."""

    def __init__(self, config: SimulatorConfig) -> None:
        self._pixels_per_metre = config.pixels_per_metre
        sizes = config.pixels_per_metre, config.robot.radius_m, config.laser.range_m
        self._name = "-".join(repr(float(size)) for size in sizes)
        try:
            self._cache = DiskCache(world_file())
        except ConfigError as error:
            _log.warning("worlds cannot be stored on disk: %s", error)
            self._cache = DiskCache(None)

    def keys(self) -> set[bytes]:
        """Return the hashes of the plans that have a world."""
        return self._cache.keys(self._name)

    def get(self, key: bytes) -> World | None:
        """Return the world for a plan's hash, None if it is missing."""
        record = self._cache.get(self._name, key)
        try:
            return None if record is None else decode_world(record, self._pixels_per_metre)
        except RecordError as error:
            _log.warning("a world will be made again: %s", error)
            return None

    def put(self, key: bytes, world: World) -> None:
        """Add a missing world, which is written within seconds."""
        self._cache.put(self._name, key, encode_world(world))

    def flush(self) -> None:
        """Write the worlds that are not written yet."""
        self._cache.flush()

    def write(self, records: dict[bytes, bytes]) -> None:
        """Write worlds (``encode_world``) at once; raise sqlite3.Error or OSError if they cannot be written."""
        self._cache.write(self._name, records)
