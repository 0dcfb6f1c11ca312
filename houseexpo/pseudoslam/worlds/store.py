"""Worlds on disk, with the plan's bytes, the resolution, the robot and the laser's range as key.

They are in the user's cache (HOUSEEXPO_CACHE sets its place), in one folder for each resolution, robot and range, so
that data sets with common plans share worlds. Processes share the files: each memory-maps them and writes its own.

R1  A world is found only by the hash of its plan, in a folder for its version and sizes, and is therefore never wrong.
R2  An incomplete file, or one of another layout, is removed, and a damaged record is skipped. Their worlds are made
    again.
R3  If files cannot be written (a full disk, a read-only folder), worlds stay in memory, with one warning.
R4  If a world is missing, files that other processes have written meanwhile are opened.
R5  Many small files are merged.
"""

from __future__ import annotations

import logging
import os
import time
import weakref
from contextlib import suppress
from pathlib import Path
from typing import Final

from houseexpo.errors import ConfigError
from houseexpo.files import cache_folder
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.worlds.records import WORLDS, RecordError, decode_world
from houseexpo.pseudoslam.worlds.shards import Shard, ShardError, write_shard
from houseexpo.pseudoslam.worlds.world import World

_SUFFIX: Final = ".worlds"
_PENDING: Final = 1024
"""Number of records that are collected in memory before they are written, about 2 MB."""
_WAIT_S: Final = 60.0
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
            _log.warning("a world is made again: %s", error)
            return None

    def put(self, key: bytes, record: bytes) -> None:
        """Add a missing world (``records.encode_world``), which is written later together with others."""
        self._pending[key] = record
        if len(self._pending) >= _PENDING or time.monotonic() - self._written > _WAIT_S:
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
                _log.warning("worlds are made again, for their file is removed: %s", error)
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
