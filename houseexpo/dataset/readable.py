"""Open the readable plans of a data set of which some are broken, and list the broken ones with their faults."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from houseexpo.dataset.dataset import Dataset, open_dataset
from houseexpo.dataset.store.stored_plans import BrokenPlan, StoredPlan, broken_plan, read_id_lists, read_stored_plans
from houseexpo.errors import DatasetError, PlanError
from houseexpo.floorplan import FloorPlan
from houseexpo.progress import show_progress


@contextmanager
def open_readable(path: Path) -> Iterator[tuple[Dataset, tuple[BrokenPlan, ...]]]:
    """Open the readable plans of a data set, and list the broken ones.

    1. A plan is broken if it cannot be decoded, encloses no area, or has the id of an earlier plan.
    2. The other plans are copied, with the lists of ids, to a file of JSON lines in the folder for temporary files.

    The data set exists until the context ends. It is needed for plans that were damaged after the build, since the
    index of a build still lists them; ``open_dataset`` leaves out all others.

    Raises
    ------
    DatasetError
        The data set is damaged at no place that is known, or none of its plans can be read.
    """
    with tempfile.TemporaryDirectory(prefix="houseexpo-") as folder:
        copy = Path(folder) / f"{path.name}.jsonl"
        broken = _copy_readable(path, copy)
        (Path(folder) / "splits").mkdir()
        for name, data in read_id_lists(path).items():
            (Path(folder) / "splits" / f"{name}.txt").write_bytes(data)
        if not copy.stat().st_size:
            raise DatasetError(f"{path}: none of its plans can be read: {broken[0]}")
        yield open_dataset(copy), broken


def _copy_readable(path: Path, copy: Path) -> tuple[BrokenPlan, ...]:
    seen: dict[str, str] = {}
    broken = []
    with copy.open("wb") as out:
        for record in show_progress(read_stored_plans(path), f"reading {path.name}"):
            try:
                plan = _decode_checked(record, seen)
            except PlanError as error:
                broken.append(broken_plan(record.place, error))
                continue
            seen[plan.id] = record.place
            out.write(record.data.replace(b"\r", b" ").replace(b"\n", b" ") + b"\n")
    return tuple(broken)


def _decode_checked(record: StoredPlan, seen: dict[str, str]) -> FloorPlan:
    """Decode a plan (R1); raise PlanError if it is broken."""
    plan = record.decode()
    if plan.id in seen:
        raise PlanError(f"expected an id of its own, found that of {seen[plan.id]}", "id", plan.id)
    if plan.area <= 0:
        raise PlanError("expected free space, found none", "verts", plan.id)
    return plan
