"""A data set in spite of its broken plans: those that can be read, and why the others cannot."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from houseexpo.dataset.opening import Dataset, open_dataset
from houseexpo.dataset.store.records import Record, lists, records
from houseexpo.errors import DatasetError, PlanError
from houseexpo.floorplan import FloorPlan, decode
from houseexpo.progress import watched


@dataclass(frozen=True)
class Broken:
    """A plan that cannot be read: its file, member or line, and what is wrong."""

    place: str
    problem: str

    def __str__(self) -> str:
        return f"{self.place}: {self.problem}"


@contextmanager
def readable(path: Path) -> Iterator[tuple[Dataset, tuple[Broken, ...]]]:
    """Open the plans of a data set that can be read; the others are named.

    1. A plan is broken where it cannot be decoded or encloses nothing, and where its id is that of an earlier one.
    2. The others are copied to a file of JSON lines in the folder for temporary files, with the lists of ids.

    The data set is there until the block ends. One that ``open_dataset`` opens needs none of this.

    Raises
    ------
    DatasetError
        Where the data set itself is cut off or broken, or none of its plans can be read.
    """
    with tempfile.TemporaryDirectory(prefix="houseexpo-") as folder:
        copy = Path(folder) / f"{path.name}.jsonl"
        broken = _copied(path, copy)
        (Path(folder) / "splits").mkdir()
        for name, data in lists(path).items():
            (Path(folder) / "splits" / f"{name}.txt").write_bytes(data)
        if not copy.stat().st_size:
            raise DatasetError(f"{path}: none of its plans can be read: {broken[0]}")
        yield open_dataset(copy), broken


def _copied(path: Path, copy: Path) -> tuple[Broken, ...]:
    seen: dict[str, str] = {}
    broken = []
    with copy.open("wb") as out:
        for record in watched(records(path), f"reading {path.name}"):
            try:
                plan = _checked(record, seen)
            except PlanError as error:
                broken.append(Broken(record.place, f"{error.key}: {error.problem}" if error.key else error.problem))
                continue
            seen[plan.id] = record.place
            out.write(record.data.replace(b"\r", b" ").replace(b"\n", b" ") + b"\n")
    return tuple(broken)


def _checked(record: Record, seen: dict[str, str]) -> FloorPlan:
    """Decode a plan (R1); PlanError where it is broken."""
    plan = decode(record.data)
    if plan.id in seen:
        raise PlanError(f"expected an id of its own, found that of {seen[plan.id]}", "id", plan.id)
    if plan.area <= 0:
        raise PlanError("expected free space, found none", "verts", plan.id)
    return plan
