"""Measure each readable plan of a data set, in several processes, cache the records, and sum them up."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import msgspec

from houseexpo.cpu_cores import count_cores
from houseexpo.dataset import Dataset, open_dataset
from houseexpo.dataset.store import open_store
from houseexpo.dataset.store.stored_plans import BrokenPlan, StoredPlan, broken_plan, read_id_lists, read_stored_plans
from houseexpo.errors import ConfigError, DatasetError, PlanError
from houseexpo.floorplan import FloorPlan
from houseexpo.progress import show_progress
from stats.record import VERSION, Record, find_rooms_and_measure, measure_and_audit
from stats.summary import PlanSummary


@dataclass
class DataSetSummary:
    """The statistics of a data set or of a part of one; those of two parts can be merged.

    ``splits`` are the lists that come with it; ``listed`` is the number of ids in each list, including ids without a
    plan. ``geometry`` says whether rooms and doors were found for plans without them.
    """

    name: str
    geometry: bool = False
    whole: PlanSummary = field(default_factory=PlanSummary)
    splits: dict[str, PlanSummary] = field(default_factory=dict)
    listed: dict[str, int] = field(default_factory=dict)

    def take(self, found: Record, splits: tuple[str, ...] = ()) -> None:
        """Add one plan, which belongs to these splits."""
        self.whole.take(found)
        for name in splits:
            self.splits.setdefault(name, PlanSummary()).take(found)

    def merge(self, other: DataSetSummary) -> None:
        """Add another part of the data set."""
        self.whole.merge(other.whole)
        for name, summary in other.splits.items():
            self.splits.setdefault(name, PlanSummary()).merge(summary)


@dataclass(frozen=True)
class MeasuredDataSet:
    """A data set with a record for each readable plan; ``broken`` are the others."""

    name: str
    data_set: Dataset
    records: list[Record]
    geometry: bool = False
    broken: tuple[BrokenPlan, ...] = ()

    def total(self) -> DataSetSummary:
        """Return the sum of the records."""
        found = summarise_records(self.data_set, self.records, geometry=self.geometry)
        found.name = self.name
        return found


@contextmanager
def open_and_measure(path: Path, *, geometry: bool = False, workers: int | None = None) -> Iterator[MeasuredDataSet]:
    """Open a data set and measure its readable plans; the others are listed.

    The parameters are those of ``measure_plans``. The data set exists until the context ends.

    Raises
    ------
    DatasetError, ConfigError
        The data set itself is truncated, or has no readable plan.
    """
    with ExitStack() as opened:
        try:
            data_set = Dataset(open_store(path))
            broken = data_set.left_out
            found = measure_plans(data_set, geometry=geometry, workers=workers)
        except (PlanError, DatasetError) as error:
            data_set, broken = opened.enter_context(open_readable(path))
            broken = broken or (BrokenPlan(path.name, str(error)),)
            found = measure_plans(data_set, geometry=geometry, workers=workers)
        if not len(data_set):
            raise ConfigError(f"{path}: expected plans, found none")
        yield MeasuredDataSet(path.name, data_set, found, geometry, broken)


def measure_plans(data_set: Dataset, *, geometry: bool = False, workers: int | None = None) -> list[Record]:
    """Measure and audit every plan, and return the records in the data set's order.

    Records are cached by the plan's content. A second run therefore measures only new plans, and an interrupted run
    continues where it stopped. A progress bar shows the remaining plans.

    Parameters
    ----------
    data_set
        From ``houseexpo.open_dataset``.
    geometry
        Whether to find rooms and doors of plans without them (``houseexpo.inference.with_rooms``), which takes some
        minutes for 30,000 plans.
    workers
        Number of processes; by default one for each core.
    """
    name, measure = (
        (f"statistics with rooms {VERSION}", find_rooms_and_measure) if geometry else (_PLAIN, measure_and_audit)
    )
    found = data_set.measure_cached(name, measure, workers or count_cores())
    return [msgspec.convert(values, Record) for values in found]


def summarise_data_set(data_set: Dataset, *, geometry: bool = False, workers: int | None = None) -> DataSetSummary:
    """Measure every plan and add up the records; the parameters are those of ``measure_plans``."""
    return summarise_records(data_set, measure_plans(data_set, geometry=geometry, workers=workers), geometry=geometry)


def summarise_records(data_set: Dataset, measured: Iterable[Record], *, geometry: bool = False) -> DataSetSummary:
    """Add up the records of a data set's plans, in total and for each list that comes with it."""
    lists = {name: frozenset(ids) for name, ids in data_set.splits.items()}
    total = DataSetSummary(data_set.path.name, geometry, listed={name: len(ids) for name, ids in lists.items()})
    for found in measured:
        total.take(found, tuple(name for name, ids in lists.items() if found.id in ids))
    return total


_PLAIN = f"statistics {VERSION}"


# Open the readable plans of a partly broken data set, and list the broken plans with their faults.


@contextmanager
def open_readable(path: Path) -> Iterator[tuple[Dataset, tuple[BrokenPlan, ...]]]:
    """Open the readable plans of a data set, and list the broken plans.

    1. A plan is broken if it cannot be decoded, encloses no area, or has the id of an earlier plan.
    2. The other plans are copied, with the lists of ids, to a file of JSON lines in the folder for temporary files.

    The data set exists until the context ends. It is needed for plans that were damaged after the build, since the
    index of a build still lists them; ``open_dataset`` leaves out all other broken plans.

    Raises
    ------
    DatasetError
        The data set is damaged and the place is unknown, or none of its plans can be read.
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
    """Decode a plan; raise PlanError if it is broken."""
    plan = record.decode()
    if plan.id in seen:
        raise PlanError(f"expected an id of its own, found that of {seen[plan.id]}", "id", plan.id)
    if plan.area <= 0:
        raise PlanError("expected free space, found none", "verts", plan.id)
    return plan
