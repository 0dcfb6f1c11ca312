"""Read a data set once, and write its cached copy: an index and, unless it is a folder, the plans in blocks."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import nullcontext
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyarrow as pa
import shapely

from houseexpo.dataset.index import SCHEMA, index_row
from houseexpo.dataset.store.cache import INDEX, LEFT_OUT, PLANS, BlockWriter
from houseexpo.dataset.store.stored_plans import StoredPlan, broken_plan, read_stored_plans
from houseexpo.errors import PlanError
from houseexpo.files import encode_json
from houseexpo.floorplan import FloorPlan
from houseexpo.processes import split_into_chunks
from houseexpo.progress import show_progress

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
