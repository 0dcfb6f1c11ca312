"""Open a folder, an archive or JSON lines as a ``Catalogue``: its table, its ids, and the bytes of any plan."""

from __future__ import annotations

import hashlib
import logging
import shutil
from collections import Counter
from collections.abc import Sequence, Set
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from houseexpo.dataset.store.cache import PLANS, BlockReader, ensure_cached_copy, read_index, read_left_out
from houseexpo.dataset.store.folders import plan_file_names, plan_folder
from houseexpo.dataset.store.stored_plans import BrokenPlan, linked_list_names, plans_path, read_id_lists
from houseexpo.errors import DatasetError, PlanError
from houseexpo.files import is_device, without_mark
from houseexpo.plan import checks

_log = logging.getLogger(__name__)


class Catalogue:
    """The contents of a data set without its plans; rows are numbered in the order in which plans are stored."""

    def __init__(self, path: Path, table: Any, store: Path | None, left_out: tuple[BrokenPlan, ...] = ()) -> None:
        self.path, self.table, self._store, self._left_out = path, table, store, left_out
        self._is_loose = plans_path(path).is_dir()
        self.ids: list[str] = table.column("id").to_pylist()
        self.row_of = {name: number for number, name in enumerate(self.ids)}

    @property
    def display_name(self) -> str:
        """The name of the data set in error messages."""
        return str(self.path)

    @property
    def address(self) -> Path | str:
        """The path or address that opens the same data set again."""
        return self.path

    def read(self, row: int) -> bytes:
        """Return the bytes of a plan's JSON as they are stored."""
        if not self._is_loose:
            return self._read_packed(row)
        file = plan_folder(self.path) / self._files[row]
        try:
            return file.read_bytes()
        except OSError as error:
            raise DatasetError(f"{file}: cannot be read ({error.strerror}); open the data set again") from None

    def stages(self, row: int) -> bytes | None:
        """Return the picture (PNG) of the pipeline's stages for a plan, or None if the build did not keep it."""
        folder = self.path / "stages"
        file = folder / f"{self.ids[row]}.png"
        if folder.is_symlink() or file.is_symlink() or not file.is_file():
            return None
        try:
            return file.read_bytes()
        except OSError as error:
            raise DatasetError(f"{file}: cannot be read ({error.strerror}); open the data set again") from None

    def digest(self, row: int) -> str:
        """Return the SHA-1 of a plan's bytes, the key under which results for the plan are cached."""
        if "digest" in self.table.column_names:
            return str(self.table.column("digest")[row].as_py())
        return hashlib.sha1(self.read(row), usedforsecurity=False).hexdigest()

    @property
    def left_out(self) -> tuple[BrokenPlan, ...]:
        """The plans that cannot be read."""
        return self._left_out if self._store is None else read_left_out(self._store)

    @cached_property
    def lists(self) -> dict[str, tuple[str, ...]]:
        """The lists of ids that come with the data set, unchanged.

        A link to a file outside the data set counts as a list only if the file names plans of the data set. Otherwise a
        stranger's data set, when served, could disclose any text file of this machine.
        """
        found, elsewhere = {}, linked_list_names(self.path)
        for name, data in read_id_lists(self.path).items():
            if name in elsewhere and not self._names_plans(data):
                _log.warning("%s: list %r is a link to a file that names other things than plans", self.path, name)
                continue
            found[name] = parse_id_list(data, f"{self.path}: list {name!r}")
        return found

    def _names_plans(self, data: bytes) -> bool:
        """Return whether half of the lines or more are ids of plans."""
        lines = [
            line.strip().removesuffix(".json") for line in without_mark(data).decode(errors="replace").splitlines()
        ]
        return 2 * sum(line in self.row_of for line in lines) >= len(lines)

    def numbers(self, name: str) -> np.ndarray[Any, np.dtype[Any]]:
        """Return a column of numbers, NaN for plans that lack the value."""
        return np.asarray(self.table.column(name).to_numpy(zero_copy_only=False), dtype=np.float64)

    def _read_packed(self, row: int) -> bytes:
        try:
            return bytes(self._blocks[row])
        except (pa.ArrowException, OSError, IndexError) as error:
            if self._store is not None:
                shutil.rmtree(self._store, ignore_errors=True)  # it is built again when the data set is next opened
            raise DatasetError(f"{self.path}: the cached copy is damaged ({error}); open the data set again") from None

    @cached_property
    def _files(self) -> list[str]:
        if "file" in self.table.column_names:
            return list(self.table.column("file").to_pylist())
        return [f"{name}.json" for name in self.ids]

    @cached_property
    def _blocks(self) -> Any:
        return BlockReader((self._store or self.path) / PLANS)


def open_catalogue(path: Path) -> Catalogue:
    """Open a data set; the first time, this reads all of its plans (``houseexpo.dataset.store.cache``).

    Raises
    ------
    DatasetError, PlanError
        The path is not a data set, the data set is damaged or incomplete, or none of its plans can be read.
    """
    require_finished(path)
    if (path / "index.parquet").exists():
        table, left_out = _own_index(path)
        return Catalogue(path, table, None, left_out)
    if not path.exists():
        raise DatasetError(f"{path}: expected a data set, found nothing there; check the path")
    if is_device(path):
        raise DatasetError(f"{path}: expected a file or a folder, found a device or a pipe; save its content to a file")
    store = ensure_cached_copy(plans_path(path), _write_copy)
    return Catalogue(path, read_index(store), store)


def require_finished(path: Path) -> None:
    """Raise DatasetError if a folder is that of a build which is not finished."""
    if (path / ".build").is_dir() and not (path / "manifest.json").exists():
        raise DatasetError(f"{path}: expected a finished build, found no manifest.json; run houseexpo build again")


def parse_id_list(data: bytes, what: str) -> tuple[str, ...]:
    """Read a list of ids, one per line; a ``.json`` after an id and empty lines are ignored.

    Raises
    ------
    DatasetError
        A line is not an id, or an id occurs twice.
    """
    try:
        lines = [line.strip().removesuffix(".json") for line in without_mark(data).decode().splitlines()]
        ids = tuple(checks.check_plan_id(line) for line in lines if line)
    except (UnicodeDecodeError, PlanError) as error:
        raise DatasetError(f"{what}: expected one id a line in UTF-8, found {error}") from None
    if len(set(ids)) != len(ids):
        seen: set[str] = set()
        twice = next(name for name in ids if name in seen or seen.add(name))  # type: ignore[func-returns-value]
        raise DatasetError(f"{what}: expected each id once, found {twice!r} twice")
    return ids


def _write_copy(source: Path, target: Path) -> None:
    from houseexpo.dataset.store.cache import (
        write_cached_copy,  # it loads libraries that an existing copy does not need
    )

    write_cached_copy(source, target)


def _own_index(path: Path) -> tuple[Any, tuple[BrokenPlan, ...]]:
    """Read a data set folder's index; return the rows whose plans are there, and the other rows and plans."""
    import pyarrow.parquet as pq

    from houseexpo.dataset.index import SCHEMA, with_current_columns

    file = path / "index.parquet"
    try:
        table = with_current_columns(pq.read_table(file)).select(SCHEMA.names).cast(SCHEMA)
    except (pa.ArrowException, OSError, KeyError) as error:
        raise DatasetError(f"{file}: expected the columns {', '.join(SCHEMA.names)}; found {error}") from None
    ids = table.column("id").to_pylist()
    for name in ids:
        checks.check_plan_id(name)
    files = set(plan_file_names(plan_folder(path)))
    there = [f"{name}.json" in files for name in ids]
    left_out = _odd_plans(ids, files)
    if (left_out and not any(there)) or len(set(ids)) != len(ids):
        names = ", ".join(each.place for each in left_out[:3])
        raise DatasetError(
            f"{file}: expected one row for each file in json/, found {len(ids)} rows that differ in {len(left_out)}: "
            f"{names}; build again, or delete index.parquet to read the plans alone"
        )
    return (table.filter(pa.array(there)) if left_out else table), left_out


def plans_beside_index(path: Path) -> tuple[BrokenPlan, ...]:
    """Return the plans of a folder that its index, if it has one, does not list, and those that it lists in vain.

    An index that cannot be read lists nothing wrong.
    """
    import pyarrow.parquet as pq

    file = path / "index.parquet"
    try:
        ids = pq.read_table(file, columns=["id"]).column("id").to_pylist() if file.is_file() else None
    except (pa.ArrowException, OSError, KeyError):
        ids = None
    if ids is None:
        return ()
    return _odd_plans(ids, set(plan_file_names(plan_folder(path))))


def _odd_plans(ids: Sequence[str], files: Set[str]) -> tuple[BrokenPlan, ...]:
    rows = Counter(f"{name}.json" for name in ids)
    faults = dict.fromkeys(files - rows.keys(), "index.parquet does not list it; build again")
    faults |= dict.fromkeys(rows.keys() - files, "index.parquet lists it, and it is not there")
    faults |= {name: "index.parquet lists it more than once; build again" for name in rows if rows[name] > 1}
    return tuple(BrokenPlan(name, faults[name]) for name in sorted(faults))
