"""Make the worlds (rasters) of a whole data set in advance with several processes, and store them on disk."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final

from houseexpo.dataset import Dataset
from houseexpo.errors import ConfigError, HouseExpoError
from houseexpo.floorplan import decode
from houseexpo.processes import map_in_processes
from houseexpo.progress import show_progress
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.worlds.cache import load_static_world
from houseexpo.pseudoslam.worlds.store import WorldStore, encode_world, world_file

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
