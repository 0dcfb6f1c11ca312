"""Keep worlds on disk, found by the plan's hash, in a folder for each resolution, robot radius and laser range.

They are in the user's cache (HOUSEEXPO_CACHE sets its place), in one folder for each resolution, robot and range, so
that data sets with common plans share worlds. Processes share the files: each memory-maps them and writes its own.

A *record* is a world as bytes: compressed bits of its rasters, without moving obstacles. A *shard* is a file of many
records, written once and then memory-mapped: a head, a table of (hash, offset, length, checksum) and the records. The
head contains the file's length and the checksum of the table, so that truncated files are detected. The checksum of a
record is verified when it is read.

R1  A world is found only by the hash of its plan, in a folder for its version and sizes, and is therefore never wrong.
R2  An incomplete file, or one of another layout, is removed, and a damaged record is skipped. Their worlds are made
    again.
R3  If files cannot be written (a full disk, a read-only folder), worlds stay in memory, with one warning.
R4  If a world is missing, files that other processes have written meanwhile are opened.
R5  Many small files are merged.
"""

from __future__ import annotations

import logging
import mmap
import os
import struct
import time
import weakref
import zlib
from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.files import cache_folder, write_atomically
from houseexpo.grids.frame import GridFrame
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.worlds.world import MAX_WORLD_CELLS, World

WORLDS: Final = 1
"""The version of worlds; change it when any raster of a house or this layout changes."""

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


KEY_BYTES: Final = 20
"""Length of a hash (SHA-1), bytes."""

_MAGIC: Final = b"HXWORLDS"
_LAYOUT: Final = 1
_SHARD_HEAD: Final = struct.Struct("<8sIIQI")
"""Magic number, layout, number of records, bytes of the file, checksum of the table."""
_ROW: Final = np.dtype([("key", f"V{KEY_BYTES}"), ("at", "<u8"), ("length", "<u4"), ("checksum", "<u4")])


class ShardError(Exception):
    """A file is not a shard, has another layout, or is incomplete."""


def write_shard(file: Path, records: Mapping[bytes, bytes]) -> None:
    """Write records by their hash atomically; raise OSError if the disk is full."""
    table = np.zeros(len(records), _ROW)
    at = _SHARD_HEAD.size + table.nbytes
    for row, (key, data) in enumerate(records.items()):
        table[row] = np.void(key), at, len(data), zlib.crc32(data)
        at += len(data)
    rows = table.tobytes()
    head = _SHARD_HEAD.pack(_MAGIC, _LAYOUT, len(records), at, zlib.crc32(rows))
    write_atomically(file, b"".join([head, rows, *records.values()]))


class Shard:
    """A file of records; raises ShardError if it is incomplete."""

    def __init__(self, file: Path) -> None:
        try:
            with file.open("rb") as stream:
                self._data = mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ)
        except (OSError, ValueError) as error:  # ValueError: it is empty
            raise ShardError(f"{file}: cannot be read ({error})") from None
        if len(self._data) < _SHARD_HEAD.size:
            raise ShardError(f"{file}: expected a head of {_SHARD_HEAD.size} bytes, found {len(self._data)}")
        magic, layout, number, size, checksum = _SHARD_HEAD.unpack_from(self._data)
        end = _SHARD_HEAD.size + number * _ROW.itemsize
        if (magic, layout) != (_MAGIC, _LAYOUT):
            raise ShardError(f"{file}: expected worlds in layout {_LAYOUT}, found {magic!r}, {layout}")
        if size != len(self._data) or end > size or zlib.crc32(self._data[_SHARD_HEAD.size : end]) != checksum:
            raise ShardError(f"{file}: expected {size:,} whole bytes, found {len(self._data):,}, or others")
        table = np.frombuffer(self._data, _ROW, number, _SHARD_HEAD.size)
        places = zip(table["at"].tolist(), table["length"].tolist(), table["checksum"].tolist(), strict=True)
        self._places = dict(zip(map(bytes, table["key"]), places, strict=True))

    def __len__(self) -> int:
        return len(self._places)

    def keys(self) -> list[bytes]:
        """Return the hashes of the records."""
        return list(self._places)

    def get(self, key: bytes) -> bytes | None:
        """Return a record, None if it is missing or damaged."""
        place = self._places.get(key)
        if place is None:
            return None
        at, length, checksum = place
        data = self._data[at : at + length]
        return data if zlib.crc32(data) == checksum else None


_SUFFIX: Final = ".worlds"
_PENDING: Final = 1024
"""Number of records that are collected in memory before they are written, about 2 MB."""
_WRITE_WAIT_S: Final = 60.0
_FILES: Final = 64
_log = logging.getLogger(__name__)


def store_folder(config: SimulatorConfig) -> Path:
    """Return the folder of a configuration's worlds; raise ConfigError if it cannot be created."""
    sizes = config.pixels_per_metre, config.robot.radius_m, config.laser.range_m
    return cache_folder("worlds", str(WORLDS), "-".join(repr(float(size)) for size in sizes))


class WorldStore:
    """The worlds of a folder; with ``None``, they are only in memory."""

    def __init__(self, folder: Path | None, pixels_per_metre: float) -> None:
        self._folder, self._pixels_per_metre = folder, pixels_per_metre
        self._shards: dict[str, Shard] = {}
        self._where: dict[bytes, Shard] = {}
        self._pending: dict[bytes, bytes] = {}
        self._kept: dict[bytes, bytes] = {}  # if nothing can be written
        self._written, self._seen = time.monotonic(), -1
        self._look_up()
        self.close = weakref.finalize(self, _write_if_possible, folder, self._pending)

    @classmethod
    def of(cls, config: SimulatorConfig) -> WorldStore:
        """Return the store of a configuration, which is only in memory if there is no folder."""
        try:
            folder = store_folder(config)
        except ConfigError as error:
            _log.warning("worlds cannot be stored on disk: %s", error)
            return cls(None, config.pixels_per_metre)
        return cls(folder, config.pixels_per_metre)

    def __len__(self) -> int:
        return len(self._where.keys() | self._pending.keys() | self._kept.keys())

    def __contains__(self, key: bytes) -> bool:
        return self._record(key) is not None

    def get(self, key: bytes) -> World | None:
        """Return the world for a plan's hash, None if it is missing."""
        data = self._record(key)
        try:
            return None if data is None else decode_world(data, self._pixels_per_metre)
        except RecordError as error:
            _log.warning("a world will be made again: %s", error)
            return None

    def put(self, key: bytes, record: bytes) -> None:
        """Add a missing world (``encode_world``), which is written later together with others."""
        self._pending[key] = record
        if len(self._pending) >= _PENDING or time.monotonic() - self._written > _WRITE_WAIT_S:
            try:
                self.flush()
            except OSError as error:  # R3
                _log.warning("worlds cannot be stored on disk and stay in memory: %s: %s", self._folder, error)
                self._folder = None
                self.flush()

    def flush(self) -> None:
        """Write the collected records; if that fails, raise OSError and keep them."""
        self._written = time.monotonic()
        if self._folder is None:
            self._kept.update(self._pending)
            self._pending.clear()
            return
        _write(self._folder, self._pending)
        self._look_up()
        if len(self._shards) > _FILES:
            self._merge()

    def write(self, records: dict[bytes, bytes]) -> None:
        """Write records at once, and empty the dictionary; raise OSError if they cannot be written."""
        _write(self._folder, records)
        self._look_up()

    def _record(self, key: bytes) -> bytes | None:
        for records in (self._pending, self._kept):
            if key in records:
                return records[key]
        shard = self._where.get(key)
        if shard is None and self._look_up():  # R4
            shard = self._where.get(key)
        return None if shard is None else shard.get(key)

    def _look_up(self) -> bool:
        """Open new files in the folder; return whether there were any."""
        if self._folder is None:
            return False
        try:
            seen = self._folder.stat().st_mtime_ns
            if seen == self._seen:
                return False
            names = sorted(entry.name for entry in os.scandir(self._folder) if entry.name.endswith(_SUFFIX))
        except OSError:
            return False
        self._seen = seen
        fresh = [name for name in names if name not in self._shards and not name.startswith(".")]
        for name in fresh:
            self._open(self._folder / name)
        return bool(fresh)

    def _open(self, file: Path) -> None:
        try:
            shard = Shard(file)
        except ShardError as error:  # R2
            if file.exists():  # unless another process has merged it
                _log.warning("worlds will be made again, since their file was removed: %s", error)
            with suppress(OSError):
                file.unlink()
            return
        self._shards[file.name] = shard
        self._where.update(dict.fromkeys(shard.keys(), shard))

    def _merge(self) -> None:
        """Write all records to one file, and remove the merged files (R5)."""
        folder = self._folder
        if folder is None:
            return
        found = {key: shard.get(key) for key, shard in self._where.items()}
        with suppress(OSError):  # then they remain unmerged
            _write(folder, {key: data for key, data in found.items() if data is not None})
            for name in self._shards:
                (folder / name).unlink(missing_ok=True)
            self._shards.clear()
            self._where.clear()
            self._look_up()


def _write(folder: Path | None, records: dict[bytes, bytes]) -> None:
    """Write records to a new file, if there are any, and empty the dictionary."""
    if folder is None or not records:
        return
    write_shard(folder / f"{time.time_ns():x}-{os.getpid()}{_SUFFIX}", records)
    records.clear()


def _write_if_possible(folder: Path | None, records: dict[bytes, bytes]) -> None:
    """Write at the end of a program; worlds that cannot be written will be made again."""
    with suppress(OSError):
        _write(folder, records)
