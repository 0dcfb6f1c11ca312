"""One data set on show: opened, measured, and opened again where it was built again while it is shown."""

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
from houseexpo.dataset.store.folders import plan_stamp
from houseexpo.errors import ConfigError, HouseExpoError, UnknownPlanError
from houseexpo.floorplan import FloorPlan
from houseexpo.service.measures import measured
from houseexpo.service.query import Query
from houseexpo.service.recent import Recent
from houseexpo.service.records import Records, read_records
from houseexpo.service.tags import Tags
from houseexpo.service.thumbnails import thumbnail
from houseexpo.service.views import View, Views

RESERVED: Final = frozenset({"api", "static", "data", "openapi.json"})
"""Names in addresses of the service itself (``/static``, ``/api/data``), which no data set may take."""

_LOG = logging.getLogger(__name__)
_SUFFIXES: Final = (".tar.gz", ".tgz", ".zip", ".jsonl.gz", ".jsonl")
_LOOK_S: Final = 2.0
_PICTURES_BYTES: Final = 48 << 20
_DIVIDED_VERTS: Final = 2000
_OPENINGS: Final = itertools.count()


class Opened:
    """A data set as it was when it was opened, with what is made of it once; ``number`` tells openings apart."""

    def __init__(self, data: Dataset, stamp: object = None) -> None:
        self.data, self.stamp = data, stamp
        self.number = next(_OPENINGS)
        self.numbers = {name: number for number, name in enumerate(data.ids)}

    def known(self, plan_id: str) -> str:
        """Return an id that names a plan; UnknownPlanError else, without a search for the nearest, which takes long."""
        if plan_id not in self.numbers:
            raise UnknownPlanError(f"no plan {plan_id[:80]!r} in this data set")
        return plan_id

    def plan(self, plan_id: str) -> FloorPlan:
        """Return a plan by its id; raise UnknownPlanError if there is none."""
        return self.data[self.known(plan_id)]

    @cached_property
    def views(self) -> Views:
        """What answers queries."""
        return Views(measured(self.data))

    @cached_property
    def records(self) -> Records:
        """What was refused, and what repeats other plans."""
        return read_records(self.data.path)

    @cached_property
    def index(self) -> tuple[bytes, str]:
        """The index as a Parquet file, the plans' SHA-1 in it, and its tag; equal data sets give equal bytes."""
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
    """A data set with the name under which it is shown; ``/NAME/`` is its gallery."""

    def __init__(self, name: str, path: Path) -> None:
        self.name, self.path = name, path
        self.tags = Tags(path)
        self._now = Opened(open_dataset(path), _stamp(path))
        self._looked_s = time.monotonic()
        self._opening = threading.Lock()
        self._pictures: Recent[bytes] = Recent(_PICTURES_BYTES, len)

    @property
    def now(self) -> Opened:
        """The data set as it is; a request that needs several things of it takes them from one ``now``."""
        return self._now

    @property
    def dataset(self) -> Dataset:
        """The plans."""
        return self._now.data

    def find(self, query: Query) -> tuple[Opened, View]:
        """Return the data set as it is, and what a query finds in it, by its present tags; ConfigError as ``Views``."""
        now = self._now
        try:
            now.views.tagged(self.tags.now().tags)
        except ConfigError:
            if query.tags:  # else a damaged file of tags costs the tags alone
                raise
        return now, now.views.find(query)

    def plan(self, plan_id: str) -> FloorPlan:
        """Return a plan by its id, which is looked up in the index; raise UnknownPlanError if there is none."""
        return self._now.plan(plan_id)

    def thumbnail(self, plan_id: str) -> bytes | None:
        """Return a plan's small picture (SVG) where it was made before."""
        return self._pictures.get((self._now.number, plan_id))

    def drawn(self, plan_id: str) -> bytes:
        """Return a plan's small picture, drawn now where it was not before."""
        now = self._now
        return self._pictures.made((now.number, plan_id), lambda: thumbnail(_with_rooms(now.plan(plan_id))))

    def look(self) -> None:
        """Open the data set again, in a thread of its own, where it was built again; at most every two seconds."""
        if time.monotonic() - self._looked_s < _LOOK_S:
            return
        self._looked_s = time.monotonic()
        stamp = _stamp(self.path)
        if stamp not in (None, self._now.stamp) and not self._opening.locked():
            threading.Thread(target=partial(self._open_again, stamp), daemon=True).start()

    def _open_again(self, stamp: object) -> None:
        with self._opening:
            try:
                fresh = Opened(open_dataset(self.path), stamp)
                _ = fresh.views
            except HouseExpoError as error:  # it is being built, or damaged: what was opened before stays
                _LOG.warning("%s: was changed and cannot be opened yet: %s", self.path, error)
                return
            self._now = fresh
            _LOG.info("%s: was built anew; %s plans", self.path, len(fresh.data))


def opened(paths: Iterable[Path]) -> dict[str, Collection]:
    """Open data sets; each is named after its folder or file, and a number follows where that name is taken.

    ConfigError where there is no path; DatasetError and PlanError as ``open_dataset`` says.
    """
    found: dict[str, Collection] = {}
    for path in paths:
        name = _free_name(_name_of(path), found)
        found[name] = Collection(name, path)
    if not found:
        raise ConfigError("serve: expected a data set, found none")
    return found


def _with_rooms(plan: FloorPlan) -> FloorPlan:
    """Return a plan with the rooms that are found in it; as it is where it records them, or that would take long."""
    try:
        return plan.divided if len(plan.verts) <= _DIVIDED_VERTS else plan
    except HouseExpoError:
        return plan


def _stamp(path: Path) -> object:
    """Return what shows that a data set was built again; None while it is being built."""
    for file in (path / "manifest.json", path / "json", path):
        try:
            found = file.stat()
            if file == path and path.is_dir():  # a folder of plan files: decisions are written beside them
                return plan_stamp(path)
        except (OSError, HouseExpoError):
            continue
        return (str(file), found.st_size, found.st_mtime_ns)
    return None


def _name_of(path: Path) -> str:
    """Return a name that can stand in an address: letters, digits, ``.``, ``_`` and ``-``."""
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
