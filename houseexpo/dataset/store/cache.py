"""Keep data sets in the user's cache, as an index and plans in compressed blocks, so that they open fast again.

A data set that was read before is found by path, size and time, or by the hash of its content.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import nullcontext, suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Final

import numpy as np
import pyarrow as pa
import shapely

from houseexpo.dataset.index import SCHEMA, index_row
from houseexpo.dataset.store.folders import file_stamp, folder_stamp, plan_file_names, plan_folder
from houseexpo.dataset.store.stored_plans import (
    BrokenPlan,
    StoredPlan,
    broken_plan,
    damage_as_dataset_error,
    read_stored_plans,
)
from houseexpo.errors import PlanError
from houseexpo.files import PARTIAL, atomic_folder, cache_folder, encode_json, read_json, real_path, write_atomically
from houseexpo.floorplan import FloorPlan
from houseexpo.processes import split_into_chunks
from houseexpo.progress import show_progress

VERSION: Final = "2"
"""Part of every key, so that files in another layout are not read."""

INDEX: Final = "index.arrow"
PLANS: Final = "plans.arrow"
LEFT_OUT: Final = "left_out.json"
"""The plans that cannot be read, if there are any."""

PLANS_PER_BLOCK: Final = 32
"""Plans per block: about 80 KB, which is decompressed in a tenth of a millisecond."""

_SCHEMA: Final = pa.schema([("plan", pa.large_binary())])
_LEFT_S: Final = 3600.0  # seconds after which an unchanged temporary folder is left over from a killed process


def ensure_cached_copy(path: Path, write: Callable[[Path, Path], None]) -> Path:
    """Return the folder with the cached copy of a data set, and call ``write`` if there is none yet.

    1. Path, size and time of a file (for a folder, of every plan in it) lead to the hash of its content.
    2. The hash leads to the copy, so that a copied or touched file is not read again.
    3. ``write`` takes the path and fills a temporary folder, which is renamed when it is complete.
    4. A damaged copy is made again. Remains of killed processes are deleted.
    """
    key = cache_folder("keys", VERSION) / _stamp(path)
    stores = cache_folder("stores", VERSION)
    if key.exists():  # R1
        known = stores / key.read_text(errors="replace")
        if known.parent == stores and _is_whole(path, known):
            return known
    store = stores / _content(path)
    if not _is_whole(path, store):  # R2, R4
        _sweep(stores)
        _sweep(key.parent)
        shutil.rmtree(store, ignore_errors=True)
        with atomic_folder(store) as partial:  # R3
            write(path, partial)
    write_atomically(key, store.name.encode())
    return store


def read_index(store: Path) -> Any:
    """Return the index of a cached copy as an Arrow table, also of one that an earlier version made."""
    from houseexpo.dataset.index import with_current_columns

    return with_current_columns(pa.ipc.open_file(pa.memory_map(str(store / INDEX))).read_all())


def read_left_out(store: Path) -> tuple[BrokenPlan, ...]:
    """Return the plans that a cached copy lacks since they cannot be read."""
    try:
        return tuple(BrokenPlan(*found) for found in read_json(store / LEFT_OUT, list[tuple[str, str]]))
    except FileNotFoundError:
        return ()


class BlockWriter:
    """A context manager that writes plans in order."""

    def __init__(self, path: Path) -> None:
        options = pa.ipc.IpcWriteOptions(compression=pa.Codec("zstd", compression_level=1))
        self._writer = pa.ipc.new_file(str(path), _SCHEMA, options=options)
        self._waiting: list[bytes] = []

    def __enter__(self) -> BlockWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self._flush()
        self._writer.close()

    def add(self, data: bytes) -> None:
        """Add one plan."""
        self._waiting.append(data)
        if len(self._waiting) == PLANS_PER_BLOCK:
            self._flush()

    def _flush(self) -> None:
        if self._waiting:
            self._writer.write_batch(pa.record_batch([pa.array(self._waiting, pa.large_binary())], schema=_SCHEMA))
            self._waiting = []


class BlockReader:
    """A reader of plans by number. It keeps the last block, so that reading in order decompresses each block once."""

    def __init__(self, path: Path) -> None:
        options = pa.ipc.IpcReadOptions(use_threads=False)  # reading a block is faster than using a thread
        self._reader = pa.ipc.open_file(pa.memory_map(str(path)), options=options)
        self._last: tuple[int, Any] = (-1, None)

    def __len__(self) -> int:
        """Return the number of plans; all blocks but the last are full."""
        blocks = self._reader.num_record_batches
        return PLANS_PER_BLOCK * (blocks - 1) + int(self._reader.get_batch(blocks - 1).num_rows) if blocks else 0

    def __getitem__(self, number: int) -> bytes:
        block, place = divmod(number, PLANS_PER_BLOCK)
        at, batch = self._last
        if at != block:
            batch = self._reader.get_batch(block)
            self._last = block, batch  # one assignment: threads may share a reader
        data: bytes = batch.column(0)[place].as_py()
        return data


def _is_whole(source: Path, store: Path) -> bool:
    """Return whether the files of a cached copy are readable; a truncated one lacks its table of contents."""
    try:
        rows = read_index(store).num_rows
        plans = rows if source.is_dir() else len(BlockReader(store / PLANS))
    except (pa.ArrowException, OSError):
        return False
    return bool(rows and rows == plans)


def _stamp(path: Path) -> str:
    digest = hashlib.sha256(os.fsencode(real_path(path)))
    if path.is_dir():
        digest.update(folder_stamp(plan_folder(path)).encode())
    else:
        digest.update(repr(file_stamp(path.stat())).encode())
    return digest.hexdigest()


def _content(path: Path) -> str:
    digest = hashlib.sha256()
    with damage_as_dataset_error(path):
        if path.is_dir():
            folder = plan_folder(path)
            for name in plan_file_names(folder):
                digest.update(name.encode() + b"\0")
                with suppress(OSError):  # a file that cannot be read is left out
                    digest.update(hashlib.sha256((folder / name).read_bytes()).digest())
        else:
            with path.open("rb") as stream:
                digest.update(hashlib.file_digest(stream, "sha256").digest())
            digest.update(path.name.rpartition(".")[2].encode())
    return digest.hexdigest()


def _sweep(folder: Path) -> None:
    """Remove folders that were started and not changed for an hour, since their process was killed."""
    for partial in folder.glob(f"{PARTIAL}*"):
        with suppress(OSError):
            latest = max(entry.stat().st_mtime for entry in (partial, *partial.rglob("*")))
            if time.time() - latest > _LEFT_S:
                shutil.rmtree(partial) if partial.is_dir() else partial.unlink()


CACHED: Final = pa.schema([*SCHEMA, ("file", pa.string()), ("digest", pa.string())])
"""The columns of the index, the plan's file or place in the archive, and the SHA-1 of its bytes."""

_PLANS_PER_CHUNK: Final = 256  # plans that are measured together


def write_cached_copy(source: Path, target: Path) -> None:
    """Write ``index.arrow`` and, unless the source is a folder, ``plans.arrow`` into the folder ``target``.

    Plans that cannot be read are left out; ``left_out.json`` lists them.

    Raises
    ------
    DatasetError
        The data set is damaged at no place that is known.
    PlanError
        No plan can be read; the error names the first one's file, its id and the key.
    """
    broken: list[_Broken] = []
    seen: dict[str, str] = {}  # the place of each plan, by its id
    blocks = nullcontext() if source.is_dir() else BlockWriter(target / PLANS)
    with blocks as writer, pa.ipc.new_file(str(target / INDEX), CACHED) as index:
        for chunk in _measure_chunks(source, broken):
            rows = []
            for record, plan, area in chunk:
                if plan.id in seen:
                    problem = f"expected an id of its own, found {plan.id!r} in {seen[plan.id]}, too"
                    broken.append((record.place, PlanError(problem, "id", plan.id)))
                    continue
                if writer is not None:
                    writer.add(record.data)
                seen[plan.id] = record.place
                rows.append(_row(record, plan, area))
            index.write_batch(pa.RecordBatch.from_pylist(rows, schema=CACHED))
    if broken and not seen:
        place, error = broken[0]
        where = f"{source}: {place}"
        raise PlanError(error.problem, f"{where}: {error.key}" if error.key else where, error.plan)
    if broken:
        left_out = [broken_plan(place, error) for place, error in broken]
        (target / LEFT_OUT).write_bytes(encode_json(left_out))


_Measured = tuple[StoredPlan, FloorPlan, float]
_Broken = tuple[str, PlanError]
"""The place of a plan that cannot be read, and its fault."""


def _measure_chunks(source: Path, broken: list[_Broken]) -> Iterator[list[_Measured]]:
    """Yield records, plans and areas in chunks; a thread measures one chunk while the next is decoded.

    The places and errors of records that are no plans go into ``broken``.
    """
    waiting: tuple[list[StoredPlan], list[FloorPlan], Future[list[float | PlanError]]] | None = None
    with ThreadPoolExecutor(1) as thread:
        records = show_progress(read_stored_plans(source), f"reading {source.name}")
        for pairs in split_into_chunks(_decode_readable(records, broken), _PLANS_PER_CHUNK):
            chunk, plans = [record for record, _ in pairs], [plan for _, plan in pairs]
            before, waiting = waiting, (chunk, plans, thread.submit(_areas, plans))
            if before is not None:
                yield _with_area(before[0], before[1], before[2].result(), broken)
        if waiting is not None:
            yield _with_area(waiting[0], waiting[1], waiting[2].result(), broken)


def _with_area(
    records: list[StoredPlan], plans: list[FloorPlan], areas: list[float | PlanError], broken: list[_Broken]
) -> list[_Measured]:
    found = []
    for record, plan, area in zip(records, plans, areas, strict=True):
        if isinstance(area, PlanError):
            broken.append((record.place, area))
        else:
            found.append((record, plan, area))
    return found


def _row(record: StoredPlan, plan: FloorPlan, area: float) -> dict[str, Any]:
    digest = hashlib.sha1(record.data, usedforsecurity=False).hexdigest()
    return {**index_row(plan, area), "file": record.place, "digest": digest}


def _decode_readable(records: Iterable[StoredPlan], broken: list[_Broken]) -> Iterator[tuple[StoredPlan, FloorPlan]]:
    for record in records:
        try:
            plan = record.decode()
        except PlanError as error:
            broken.append((record.place, error))
        else:
            yield record, plan


def _areas(plans: Sequence[FloorPlan]) -> list[float | PlanError]:
    """Return the areas of the free spaces, m2, or why a plan has none.

    Plans without holes and with a valid ring are measured together.
    """
    rings = [plan.verts for plan in plans]
    numbers = np.repeat(np.arange(len(rings)), [len(ring) for ring in rings])
    shapes = shapely.polygons(shapely.linearrings(np.concatenate(rings), indices=numbers))
    plain = shapely.is_valid(shapes) & np.array([not plan.holes for plan in plans])
    return [
        float(area) if ok else _area(plan) for plan, area, ok in zip(plans, shapely.area(shapes), plain, strict=True)
    ]


def _area(plan: FloorPlan) -> float | PlanError:
    try:
        return plan.area
    except PlanError as error:
        return error
