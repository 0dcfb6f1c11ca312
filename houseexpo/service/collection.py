"""Hold a data set that the service shows: open and measure it, and open it again after it has been rebuilt."""

from __future__ import annotations

import hashlib
import io
import itertools
import logging
import re
import threading
import time
from collections.abc import Iterable
from functools import cached_property, partial
from pathlib import Path
from typing import Any, Final

from houseexpo.dataset import Dataset, open_dataset
from houseexpo.dataset.store.folders import folder_stamp
from houseexpo.errors import ConfigError, HouseExpoError, UnknownPlanError
from houseexpo.floorplan import FloorPlan
from houseexpo.lru_cache import LruCache
from houseexpo.service.build_lists import BuildLists, read_build_lists
from houseexpo.service.search import FoundPlans, PlanSearch, Query, measure_table
from houseexpo.service.thumbnails import draw_thumbnail

RESERVED: Final = frozenset({"api", "static", "data"})
"""Names in the service's own addresses (``/static``, ``/api/data``), which no data set may have."""

_LOG = logging.getLogger(__name__)
_SUFFIXES: Final = (".tar.gz", ".tgz", ".zip", ".jsonl.gz", ".jsonl")
_REBUILT_LOOK_S: Final = 2.0
"""Seconds between two looks at whether a data set was rebuilt."""
_PICTURES_BYTES: Final = 48 << 20
"""Size of the small pictures that stay in memory."""
_DIVIDED_VERTS: Final = 2000
"""Rooms are not found in outlines with more vertices, which would take seconds."""
_OPENINGS: Final = itertools.count()


class OpenedDataset:
    """A data set at the time it was opened, with values that are computed once; each opening has another ``number``."""

    def __init__(self, data: Dataset, stamp: object = None) -> None:
        self.data, self.stamp = data, stamp
        self.number = next(_OPENINGS)
        self.numbers = {name: number for number, name in enumerate(data.ids)}

    def check_id(self, plan_id: str) -> str:
        """Return the id if it names a plan; raise UnknownPlanError if not, without the slow search for similar ids."""
        if plan_id not in self.numbers:
            raise UnknownPlanError(f"no plan {plan_id[:80]!r} in this data set")
        return plan_id

    def plan(self, plan_id: str) -> FloorPlan:
        """Return a plan by its id; raise UnknownPlanError if it does not exist."""
        return self.data[self.check_id(plan_id)]

    @cached_property
    def views(self) -> PlanSearch:
        """The views that answer queries."""
        return PlanSearch(measure_table(self.data))

    @cached_property
    def records(self) -> BuildLists:
        """The inputs that gave no plan, and the plans that were dropped as duplicates."""
        return read_build_lists(self.data.path)

    @cached_property
    def index(self) -> tuple[bytes, str]:
        """The index with the plans' SHA-1 as a Parquet file, and its tag; equal data sets give equal bytes."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        table: Any = self.data.to_arrow()
        if "digest" not in table.column_names:
            digests = [self.data.digest(number).hex() for number in range(len(self.data))]
            table = table.append_column("digest", pa.array(digests))
        stream = io.BytesIO()
        pq.write_table(table, stream, compression="zstd", row_group_size=4096)
        return stream.getvalue(), hashlib.sha256(stream.getvalue()).hexdigest()[:32]


class Collection:
    """A data set and the name under which it is shown; ``/NAME/`` is its gallery."""

    def __init__(self, name: str, path: Path) -> None:
        self.name, self.path = name, path
        self._now = OpenedDataset(open_dataset(path), _stamp(path))
        self._looked_s = time.monotonic()
        self._opening = threading.Lock()
        self._pictures: LruCache[bytes] = LruCache(_PICTURES_BYTES, len)

    @property
    def now(self) -> OpenedDataset:
        """The data set as it is now; a request that needs several values takes them from the same ``now``."""
        return self._now

    @property
    def dataset(self) -> Dataset:
        """The plans."""
        return self._now.data

    def find(self, query: Query) -> tuple[OpenedDataset, FoundPlans]:
        """Return the data set as it is now, and the plans that a query finds; for errors see ``PlanSearch.find``."""
        now = self._now
        return now, now.views.find(query)

    def plan(self, plan_id: str) -> FloorPlan:
        """Return a plan by its id; raise UnknownPlanError if it does not exist."""
        return self._now.plan(plan_id)

    def thumbnail(self, plan_id: str) -> bytes | None:
        """Return a plan's small picture (SVG) if it is in memory, otherwise None."""
        return self._pictures.get((self._now.number, plan_id))

    def draw_thumbnail(self, plan_id: str) -> bytes:
        """Return a plan's small picture; draw it if it is not in memory."""
        now = self._now
        return self._pictures.get_or_make((now.number, plan_id), lambda: draw_thumbnail(_with_rooms(now.plan(plan_id))))

    def look(self) -> None:
        """Reopen the data set in its own thread if it has been rebuilt; look at most every two seconds."""
        if time.monotonic() - self._looked_s < _REBUILT_LOOK_S:
            return
        self._looked_s = time.monotonic()
        stamp = _stamp(self.path)
        if stamp not in (None, self._now.stamp) and not self._opening.locked():
            threading.Thread(target=partial(self._open_again, stamp), daemon=True).start()

    def _open_again(self, stamp: object) -> None:
        with self._opening:
            try:
                fresh = OpenedDataset(open_dataset(self.path), stamp)
                _ = fresh.views
            except HouseExpoError as error:  # it is being built, or damaged: the old state remains
                _LOG.warning("%s: it has changed and cannot be opened yet: %s", self.path, error)
                return
            self._now = fresh
            _LOG.info("%s: it was rebuilt; %s plans", self.path, len(fresh.data))


def open_collections(paths: Iterable[Path]) -> dict[str, Collection]:
    """Open data sets; each is named after its folder or file, with a number if that name is taken.

    Raises
    ------
    ConfigError
        There is no path.
    DatasetError, PlanError
        See ``houseexpo.open_dataset``.
    """
    found: dict[str, Collection] = {}
    for path in paths:
        name = _free_name(_name_of(path), found)
        found[name] = Collection(name, path)
    if not found:
        raise ConfigError("serve: expected a data set, found none")
    return found


def _with_rooms(plan: FloorPlan) -> FloorPlan:
    """Return a plan with rooms found from its outline; it is unchanged if it has rooms or that would take too long."""
    try:
        return plan.divided if len(plan.verts) <= _DIVIDED_VERTS else plan
    except HouseExpoError:
        return plan


def _stamp(path: Path) -> object:
    """Return a value that changes when a data set is rebuilt, None while it is being built."""
    for file in (path / "manifest.json", path / "json", path):
        try:
            found = file.stat()
            if file == path and path.is_dir():  # plan files; decisions beside them do not count
                return folder_stamp(path)
        except (OSError, HouseExpoError):
            continue
        return (str(file), found.st_size, found.st_mtime_ns)
    return None


def _name_of(path: Path) -> str:
    """Return a name for addresses, of letters, digits, ``.``, ``_`` and ``-``."""
    whole = path.resolve().name
    plain = next((whole.removesuffix(suffix) for suffix in _SUFFIXES if whole.endswith(suffix)), whole)
    return re.sub(r"[^A-Za-z0-9._-]+", "-", plain).strip("-.") or "plans"


def _free_name(name: str, taken: Iterable[str]) -> str:
    used = {*taken, *RESERVED}
    number, found = 1, name
    while found in used:
        number += 1
        found = f"{name}-{number}"
    return found
