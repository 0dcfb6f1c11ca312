"""Read a data set once, and write its cached copy: an index and, unless it is a folder, the plans in blocks."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import nullcontext
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyarrow as pa
import shapely

from houseexpo.dataset.index import SCHEMA, index_row
from houseexpo.dataset.store.cache import INDEX, PLANS, BlockWriter
from houseexpo.dataset.store.stored_plans import StoredPlan, read_stored_plans
from houseexpo.errors import DatasetError, PlanError
from houseexpo.floorplan import FloorPlan, decode
from houseexpo.processes import split_into_chunks
from houseexpo.progress import show_progress

CACHED: Final = pa.schema([*SCHEMA, ("file", pa.string()), ("digest", pa.string())])
"""The columns of the index, the plan's file or place in the archive, and the SHA-1 of its bytes."""

_PLANS_PER_CHUNK: Final = 256  # plans that are measured together


def write_cached_copy(source: Path, target: Path) -> None:
    """Write ``index.arrow`` and, unless the source is a folder, ``plans.arrow`` into the folder ``target``.

    Raises
    ------
    DatasetError
        The data set is damaged, or two plans have the same id.
    PlanError
        A plan violates the format; the error names its file, its id and the key.
    """
    seen: dict[str, str] = {}  # the place of each plan, by its id
    blocks = nullcontext() if source.is_dir() else BlockWriter(target / PLANS)
    with blocks as writer, pa.ipc.new_file(str(target / INDEX), CACHED) as index:
        for chunk, plans, found in _measure_chunks(source):
            for record in chunk:
                if writer is not None:
                    writer.add(record.data)
            for record, plan in zip(chunk, plans, strict=True):
                if plan.id in seen:
                    places = f"{seen[plan.id]} and in {record.place}"
                    raise DatasetError(f"{source}: expected ids that differ, found {plan.id!r} in {places}")
                seen[plan.id] = record.place
            rows = [_row(*item) for item in zip(chunk, plans, found, strict=True)]
            index.write_batch(pa.RecordBatch.from_pylist(rows, schema=CACHED))


def _measure_chunks(source: Path) -> Iterator[tuple[list[StoredPlan], list[FloorPlan], list[float]]]:
    """Yield records, plans and areas in chunks; a thread measures one chunk while the next is decoded."""
    waiting: tuple[list[StoredPlan], list[FloorPlan], Future[list[float]]] | None = None
    with ThreadPoolExecutor(1) as thread:
        for chunk in split_into_chunks(
            show_progress(read_stored_plans(source), f"reading {source.name}"), _PLANS_PER_CHUNK
        ):
            plans = [_decode(source, record) for record in chunk]
            before, waiting = waiting, (chunk, plans, thread.submit(_areas, plans))
            if before is not None:
                yield before[0], before[1], before[2].result()
        if waiting is not None:
            yield waiting[0], waiting[1], waiting[2].result()


def _row(record: StoredPlan, plan: FloorPlan, area: float) -> dict[str, Any]:
    digest = hashlib.sha1(record.data, usedforsecurity=False).hexdigest()
    return {**index_row(plan, area), "file": record.place, "digest": digest}


def _decode(source: Path, record: StoredPlan) -> FloorPlan:
    """Decode a record; add its place to any error."""
    try:
        return decode(record.data)
    except PlanError as error:
        place = f"{source}: {record.place}"
        raise PlanError(error.problem, f"{place}: {error.key}" if error.key else place, error.plan) from None


def _areas(plans: Sequence[FloorPlan]) -> list[float]:
    """Return the areas of the free spaces, m2; plans without holes and with a valid ring are measured together."""
    rings = [plan.verts for plan in plans]
    numbers = np.repeat(np.arange(len(rings)), [len(ring) for ring in rings])
    shapes = shapely.polygons(shapely.linearrings(np.concatenate(rings), indices=numbers))
    plain = shapely.is_valid(shapes) & np.array([not plan.holes for plan in plans])
    return [float(area) if ok else plan.area for plan, area, ok in zip(plans, shapely.area(shapes), plain, strict=True)]
