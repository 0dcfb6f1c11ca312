"""From a data set to what it adds up to: every plan is measured once, in processes, and its record is kept."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import msgspec

from houseexpo.dataset import Dataset, open_dataset
from houseexpo.dataset.readable import Broken, readable
from houseexpo.errors import ConfigError, DatasetError, PlanError
from houseexpo.workers import cores
from stats.record import VERSION, Record, record, record_with_rooms
from stats.summary import PlanSummary


@dataclass
class Gathered:
    """What is known of a data set; two parts of one add up.

    ``splits`` are the lists that come with it; ``listed`` says how many ids each list names, whether or not there is a
    plan. ``geometry`` says whether rooms and doors were found where plans had none.
    """

    name: str
    geometry: bool = False
    whole: PlanSummary = field(default_factory=PlanSummary)
    splits: dict[str, PlanSummary] = field(default_factory=dict)
    listed: dict[str, int] = field(default_factory=dict)

    def take(self, found: Record, splits: tuple[str, ...] = ()) -> None:
        """Take in one plan, which belongs to these splits."""
        self.whole.take(found)
        for name in splits:
            self.splits.setdefault(name, PlanSummary()).take(found)

    def merge(self, other: Gathered) -> None:
        """Take in another part."""
        self.whole.merge(other.whole)
        for name, summary in other.splits.items():
            self.splits.setdefault(name, PlanSummary()).merge(summary)


@dataclass(frozen=True)
class Measured:
    """A data set with a record for each plan that can be read; ``broken`` are the others."""

    name: str
    data_set: Dataset
    records: list[Record]
    geometry: bool = False
    broken: tuple[Broken, ...] = ()

    def summed(self) -> Gathered:
        """Return what the records add up to."""
        found = add_up(self.data_set, self.records, geometry=self.geometry)
        found.name = self.name
        return found


@contextmanager
def measured(path: Path, *, geometry: bool = False, workers: int | None = None) -> Iterator[Measured]:
    """Open a data set and measure its plans; one that cannot be read is named, and the others count.

    Parameters as in ``records``. The data set is there until the block ends.

    Raises
    ------
    DatasetError, ConfigError
        Where the data set itself is cut off, or holds no plan that can be read.
    """
    with ExitStack() as opened:
        broken: tuple[Broken, ...] = ()
        try:
            data_set = open_dataset(path)
            found = records(data_set, geometry=geometry, workers=workers)
        except (PlanError, DatasetError) as error:
            data_set, broken = opened.enter_context(readable(path))
            broken = broken or (Broken(path.name, str(error)),)
            found = records(data_set, geometry=geometry, workers=workers)
        if not len(data_set):
            raise ConfigError(f"{path}: expected plans, found none")
        yield Measured(path.name, data_set, found, geometry, broken)


def records(data_set: Dataset, *, geometry: bool = False, workers: int | None = None) -> list[Record]:
    """Measure every plan, in the data set's order.

    Records are kept in the user's cache by the plan's content, so a second run measures only what is new, and one that
    was stopped goes on; a progress bar shows what is left.

    Parameters
    ----------
    data_set
        From ``houseexpo.open_dataset``.
    geometry
        Find rooms and doors where a plan has none (``houseexpo.inference.with_rooms``): some minutes for 30,000 plans.
    workers
        Processes; one a core by default.
    """
    name, measure = (f"statistics with rooms {VERSION}", record_with_rooms) if geometry else (_PLAIN, record)
    found = data_set.derived(name, measure, workers or cores())
    return [msgspec.convert(values, Record) for values in found]


def gather(data_set: Dataset, *, geometry: bool = False, workers: int | None = None) -> Gathered:
    """Measure every plan and add it all up; parameters as in ``records``."""
    return add_up(data_set, records(data_set, geometry=geometry, workers=workers), geometry=geometry)


def add_up(data_set: Dataset, measured: Iterable[Record], *, geometry: bool = False) -> Gathered:
    """Add up the records of a data set's plans, in all and by the lists that come with it."""
    lists = {name: frozenset(ids) for name, ids in data_set.splits.items()}
    total = Gathered(data_set.path.name, geometry, listed={name: len(ids) for name, ids in lists.items()})
    for found in measured:
        total.take(found, tuple(name for name, ids in lists.items() if found.id in ids))
    return total


_PLAIN = f"statistics {VERSION}"
