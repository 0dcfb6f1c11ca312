"""Measure each readable plan of a data set, in several processes, cache the records, and sum them up."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

import msgspec

from houseexpo.dataset import Dataset
from houseexpo.dataset.store import open_store
from houseexpo.dataset.store.stored_plans import BrokenPlan
from houseexpo.errors import ConfigError
from houseexpo.processes import count_cores
from stats.record import VERSION, Record, find_rooms_and_measure, measure_and_audit
from stats.summary import PlanSummary


@dataclass
class DataSetSummary:
    """The statistics of a data set or of a part of one.

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


def open_and_measure(path: Path, *, geometry: bool = False, workers: int | None = None) -> MeasuredDataSet:
    """Open a data set and measure its readable plans; the others are listed.

    The parameters are those of ``measure_plans``.

    Raises
    ------
    DatasetError, PlanError, ConfigError
        The data set itself is truncated, has no readable plan, or was changed since it was built.
    """
    data_set = Dataset(open_store(path))
    if not len(data_set):
        raise ConfigError(f"{path}: expected plans, found none")
    found = measure_plans(data_set, geometry=geometry, workers=workers)
    return MeasuredDataSet(path.name, data_set, found, geometry, data_set.left_out)


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
