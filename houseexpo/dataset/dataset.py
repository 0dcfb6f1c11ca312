"""Open a data set, on disk or from a service, as a sequence of plans and as a table; select, split and sample it."""

from __future__ import annotations

import logging
import operator
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeAlias, overload

import numpy as np
import numpy.typing as npt

from houseexpo.errors import (
    ConfigError,
    DatasetError,
    MissingDependencyError,
    PlanError,
    UnknownPlanError,
    install_command,
)
from houseexpo.floorplan import FloorPlan, decode
from houseexpo.words import count_noun, unknown_name_message

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from houseexpo.analysis.geodataframe import Layer
    from houseexpo.dataset.store.catalogue import Catalogue
    from houseexpo.dataset.store.stored_plans import BrokenPlan

_log = logging.getLogger(__name__)

_LOST_NAMED: Final = 3
"""The number of unreadable plans that a warning names."""

Range: TypeAlias = tuple[float | None, float | None]
"""A lower and an upper limit, both inclusive; None means no limit."""


def open_dataset(path: str | os.PathLike[str]) -> Dataset:
    """Open a data set: a folder, the published ``json.tar.gz``, a ``.zip``, ``.jsonl`` or ``.jsonl.gz``.

    ``path`` may also be the address of a data set that ``houseexpo serve`` offers (``http://host:8000/demo``). A folder
    is the output of ``houseexpo build`` or ``houseexpo release``, or contains published JSON files.

    Opening reads only an index. The first time, it reads and checks every plan once and saves the index in the user's
    cache folder; for archives and JSON lines, it saves the plans there too, in blocks. The variable HOUSEEXPO_CACHE
    sets the cache folder. A plan is left out, with a warning, if it cannot be read, if it comes after the place at
    which a file is cut off, or if an earlier plan has the same id. ``left_out`` lists these plans.

    Parameters
    ----------
    path
        The folder, file or address.

    Raises
    ------
    DatasetError
        There is no data set, or it is damaged and the place is unknown (an archive's checksum does not match).
    PlanError
        No plan can be read; the error names the file, the plan and the key.

    Examples
    --------
    >>> import tempfile
    >>> from houseexpo import FloorPlan, open_dataset, save_plan
    >>> folder = tempfile.mkdtemp()
    >>> save_plan(FloorPlan("hut", [(0.1, 0.1), (0.1, 4.1), (4.1, 4.1), (4.1, 0.1)], 1, {}), f"{folder}/hut.json")
    >>> plans = open_dataset(folder)
    >>> len(plans), plans.ids, plans["hut"].room_num
    (1, ['hut'], 1)
    >>> len(plans.select(rooms=(4, 9), area=(50, 200)))
    0
    """
    from houseexpo.dataset.store import open_store

    found = Dataset(open_store(path))
    if found.left_out:
        listed = "; ".join(map(str, found.left_out[:_LOST_NAMED])) + (
            "; ..." if len(found.left_out) > _LOST_NAMED else ""
        )
        at = count_noun(len(found.left_out), "place")
        _log.warning("%s: plans left out, cannot be read, at %s: %s", path, at, listed)
    return found


class Dataset(Sequence[FloorPlan]):
    """A sequence of plans; a plan is read when it is accessed.

    ``plans[3]``, ``plans[-1]`` and ``plans["id"]`` are plans. ``plans[10:20]``, ``plans[[0, 3]]``,
    ``plans[["a", "b"]]``, with ids, and ``plans[mask]``, with a truth value for each plan, are data sets that read the
    same files. A mask from a table (``to_pandas``) is matched by its ids, whatever their order. A pickle holds only the
    path and the ids.
    """

    def __init__(self, catalogue: Catalogue, rows: npt.NDArray[np.int64] | None = None) -> None:
        if isinstance(catalogue, str | os.PathLike):
            raise TypeError(f"Dataset({str(catalogue)!r}): expected a catalogue, found a path; use open_dataset(path)")
        self._catalogue = catalogue
        self._rows = np.arange(len(catalogue.ids)) if rows is None else rows

    @property
    def path(self) -> Path:
        """The path of the data set."""
        return self._catalogue.path

    @property
    def ids(self) -> list[str]:
        """The plans' ids, in order."""
        return [self._catalogue.ids[row] for row in self._rows]

    @property
    def left_out(self) -> tuple[BrokenPlan, ...]:
        """The unreadable plans of the whole data set: where each is, and what is wrong with it."""
        return self._catalogue.left_out

    @property
    def splits(self) -> dict[str, tuple[str, ...]]:
        """The lists of ids stored with the data set, by name, unchanged; some ids may not be in this data set."""
        return dict(self._catalogue.lists)

    def __len__(self) -> int:
        return len(self._rows)

    def __contains__(self, item: object) -> bool:
        name = item.id if isinstance(item, FloorPlan) else item
        row = self._catalogue.row_of.get(name) if isinstance(name, str) else None
        return row is not None and row in self._rows

    @overload
    def __getitem__(self, item: str | int) -> FloorPlan: ...
    @overload
    def __getitem__(self, item: slice | Sequence[int] | list[str] | npt.NDArray[Any]) -> Dataset: ...
    def __getitem__(self, item: Any) -> FloorPlan | Dataset:
        if isinstance(item, str):
            return self._plan(self._row(item))
        if isinstance(item, slice):
            return Dataset(self._catalogue, self._rows[item])
        if np.ndim(item) == 0 and hasattr(item, "__index__") and not isinstance(item, bool | np.bool_):
            number = operator.index(item)
            if not -len(self) <= number < len(self):
                raise IndexError(f"plans[{number}]: there are {count_noun(len(self), 'plan')}, with numbers from 0")
            return self._plan(int(self._rows[number]))
        return self._take(item)

    def _take(self, items: Any) -> Dataset:
        """Return the plans that an array selects by numbers, by ids, or by one truth value for each plan."""
        chosen = np.asarray(items)
        if chosen.ndim != 1 or not (chosen.dtype.kind in "biuU" or all(isinstance(each, str) for each in chosen)):
            raise TypeError(
                "plans[]: expected a number, an id, a slice, a list of numbers or ids, or a truth value for each plan; "
                f"found {items!r}"
            )
        if chosen.dtype.kind == "b" and hasattr(items, "reindex") and items.index.dtype.kind not in "iu":
            # A column of a table has the plans' ids, maybe in another order, or those of other plans.
            chosen = items[items.index.isin(self.ids)].reindex(self.ids).dropna().to_numpy(dtype=bool)
        if chosen.dtype.kind == "b" and len(chosen) != len(self):
            raise IndexError(f"plans[mask]: expected {len(self)} truth values, one for each plan, found {len(chosen)}")
        if chosen.dtype.kind in "biu":
            return Dataset(self._catalogue, self._rows[chosen])
        return self.only(chosen.tolist())

    def __iter__(self) -> Iterator[FloorPlan]:
        return map(self._plan, self._rows.tolist())

    def raw(self, plan_id: str) -> bytes:
        """Return the bytes of a plan's JSON as they are stored.

        Parameters
        ----------
        plan_id
            The plan's id.

        Raises
        ------
        UnknownPlanError
            There is no such plan.
        """
        return self._catalogue.read(self._row(plan_id))

    def digest(self, number: int) -> bytes:
        """Return the SHA-1 of a plan's JSON (20 bytes), the key under which results for the plan are cached.

        Parameters
        ----------
        number
            The plan's number, from 0.
        """
        return bytes.fromhex(self._catalogue.digest(int(self._rows[number])))

    def raw_of(self, number: int) -> bytes:
        """Return the bytes of a plan's JSON as they are stored, by the plan's number.

        Parameters
        ----------
        number
            The plan's number, from 0.
        """
        return self._catalogue.read(int(self._rows[number]))

    def stages(self, plan_id: str) -> bytes | None:
        """Return the picture (PNG) of the pipeline's stages for a plan, or None if the build did not keep it.

        Parameters
        ----------
        plan_id
            The plan's id.

        Raises
        ------
        UnknownPlanError
            There is no such plan.
        """
        return self._catalogue.stages(self._row(plan_id))

    def column(self, name: str, *, compute: bool = True) -> list[Any]:
        """Return a column of the index, one value per plan: ``rooms``, ``area``, ``labels``, ``doors``, ...

        ``rooms`` counts the rooms of the plan, ``source_rooms`` the rooms that its source states. Published plans have
        no ``rooms``, ``doors`` and ``navigability``; these are computed on request, in about 20 ms per plan, and
        cached. With ``compute=False``, values that are not cached yet are None.

        Parameters
        ----------
        name
            A column of the index.
        compute
            Whether to compute values that are not cached yet.

        Raises
        ------
        ConfigError
            There is no such column.
        """
        from houseexpo.dataset.store.columns import read_column

        return read_column(self._catalogue, self._rows, str(name), compute=compute)

    def index(self, item: Any, start: int = 0, stop: int | None = None) -> int:
        """Return the number of a plan, given the plan or its id: ``plans[plans.index(item)]`` is that plan.

        Parameters
        ----------
        item
            A plan or an id.
        start, stop
            The range of numbers to search, as for ``list.index``.

        Raises
        ------
        ValueError
            The plan is not in the data set, or not between ``start`` and ``stop``.
        """
        name = item.id if isinstance(item, FloorPlan) else item
        number = self.ids.index(name)
        if number not in range(len(self))[start:stop]:
            raise ValueError(f"{name!r} is not in the data set from {start} to {stop}")
        return number

    def to_arrow(self) -> Any:
        """Return the index as a ``pyarrow.Table`` with one row per plan (docs/format.md, "A data set folder").

        Rooms and doors of published plans are null until ``column("rooms")`` has computed them.
        """
        from houseexpo.dataset.store.columns import read_table

        return read_table(self._catalogue, self._rows)

    def to_pandas(self) -> Any:
        """Return the index as a ``pandas.DataFrame`` with one row per plan, indexed by id.

        Its columns are those of ``to_arrow``. No plan is read.

        Raises
        ------
        MissingDependencyError
            pandas is not installed.
        """
        try:
            import pandas  # noqa: F401 - pyarrow looks for it
        except ImportError:
            raise MissingDependencyError(f"to_pandas needs pandas: {install_command('frames')}") from None
        return self.to_arrow().to_pandas().set_index("id")

    def to_geopandas(self, layer: Layer = "rooms") -> Any:
        """Return the rooms, doors, walls, furniture or free spaces of all plans as a ``geopandas.GeoDataFrame``.

        This reads every plan. Coordinates are in metres. Rooms and doors are those of ``FloorPlan.divided``.

        Parameters
        ----------
        layer
            "rooms", "doors", "walls" (0.1 m thick), "objects" (furniture), or "plans" (the free spaces).

        Raises
        ------
        ConfigError
            ``layer`` has another value.
        MissingDependencyError
            GeoPandas is not installed.
        """
        from houseexpo.analysis.geodataframe import make_geodataframe

        return make_geodataframe((plan.divided for plan in self), layer)

    def plot(
        self,
        n: int = 12,
        *,
        columns: int = 4,
        size: float = 3.0,
        figsize: tuple[float, float] | None = None,
        **options: Any,
    ) -> Figure:
        """Draw the first plans side by side, with matplotlib.

        Parameters
        ----------
        n
            Number of plans.
        columns
            Number of plans in a row.
        size
            Side of each picture, inches.
        figsize
            Width and height of the whole figure, inches, instead of ``size``.
        **options
            Options of ``FloorPlan.plot``: ``rooms``, ``labels``, ``doors``, ...

        Returns
        -------
        The figure.

        Raises
        ------
        MissingDependencyError
            matplotlib is not installed.
        """
        from houseexpo.drawing.axes import plot_sheet

        shown = [plan.divided for plan in self[:n]]
        options = {"labels": False, "size": size, "figsize": figsize, **options}
        return plot_sheet(shown, columns=min(columns, max(len(shown), 1)), titles=_title_of, **options)

    @property
    def rejected(self) -> list[dict[str, str]]:
        """The inputs that the build rejected: id, stage, reason, detail and advice of each.

        Raises
        ------
        DatasetError
            The file ``rejected.jsonl`` is damaged.
        """
        file = self.path / "rejected.jsonl"
        if not file.is_file():
            return []
        import msgspec

        from houseexpo.files import decode_json, read_file

        try:
            return [decode_json(line, dict[str, str]) for line in read_file(file).splitlines() if line.strip()]
        except (OSError, msgspec.DecodeError) as error:
            raise DatasetError(f"{file}: expected a rejected input a line, found {error}; build again") from None

    def measure_cached(self, name: str, measure: Callable[[FloorPlan], Any], workers: int = 1) -> list[Any]:
        """Return ``measure(plan)`` for each plan, cached under ``name`` in the user's cache (``measure_cached``).

        A progress bar shows the plans still to be measured. An interrupted run continues where it stopped.

        Parameters
        ----------
        name
            The name of the results in the cache; change it when ``measure`` changes.
        measure
            A function that takes a plan and returns a value that JSON can represent.
        workers
            Number of processes.
        """
        from houseexpo.dataset.store.columns import measure_cached

        return measure_cached(self._catalogue, self._rows.tolist(), name, measure, workers)

    def select(
        self,
        *,
        rooms: Range | int | None = None,
        source_rooms: Range | int | None = None,
        area: Range | None = None,
        labels: Iterable[str] = (),
        doors: Range | int | None = None,
        robot_radius: float | None = None,
        min_connected: float | None = None,
        min_quality: float | None = None,
        where: Callable[[FloorPlan], bool] | None = None,
    ) -> Dataset:
        """Return the plans that meet all conditions, in order.

        Parameters
        ----------
        rooms, doors
            A number, or a lower and an upper limit, both inclusive (None for no limit). Published plans record neither;
            they are computed once, in about 20 ms for each plan that meets the conditions below.
        source_rooms
            The same for the number of rooms in the source, which every plan states.
        area
            Lower and upper limit of the free space, m2.
        labels
            Labels that must all occur, in any spelling (``houseexpo.canonical``).
        robot_radius, min_connected
            The radius of a disc, metres, and the least share, 0 to 1 (1 by default). Of the area that the disc's centre
            can occupy, the largest connected piece must have at least this share. A share that is not recorded is
            measured once, in about 10 ms per plan.
        min_quality
            The lowest quality score, 0 to 1. Plans without a score are left out.
        where
            Any other condition, a function of the plan; it is evaluated last.
        """
        from houseexpo.dataset.store.columns import (
            are_within_limits,
            check_least_share,
            largest_area_shares,
            parse_labels,
            read_column,
            required_share,
            warn_if_unknown,
        )

        least = required_share(robot_radius, min_connected)
        found = (("rooms", rooms), ("doors", doors))
        for name, limits in found:
            if limits is not None:
                are_within_limits(np.empty(0), limits, name)  # an error now, not after minutes of finding rooms
        rows = self._rows
        least_quality = None if min_quality is None else (check_least_share(min_quality, "min_quality"), None)
        given = (
            ("source_rooms", "source_rooms", source_rooms),
            ("area", "area", area),
            ("min_quality", "quality", least_quality),
        )
        for name, measure, limits in given:
            if limits is not None:
                warn_if_unknown(self._catalogue, rows, measure, name)
                rows = rows[are_within_limits(self._catalogue.numbers(measure)[rows], limits, name)]
        if wanted := parse_labels(labels):
            labelled = self._catalogue.table.column("labels").take(rows).to_pylist()
            rows = rows[np.array([wanted.issubset(has) for has in labelled], dtype=bool)]
        for name, limits in found:
            if limits is not None:
                counts = read_column(self._catalogue, rows, name)
                rows = rows[are_within_limits(np.array(counts, dtype=np.float64), limits, name)]
        if robot_radius is not None:
            rows = rows[largest_area_shares(self._catalogue, rows, robot_radius) >= least]
        if where is not None:
            rows = rows[np.array([bool(where(self._plan(row))) for row in rows.tolist()], dtype=bool)]
        return Dataset(self._catalogue, rows)

    @overload
    def split(self, name: str, /) -> Dataset: ...
    @overload
    def split(self, name: None = None, /, *, seed: int = 0, **shares: float) -> dict[str, Dataset]: ...
    def split(self, name: str | None = None, /, *, seed: int = 0, **shares: float) -> Dataset | dict[str, Dataset]:
        """Return the plans of a list that comes with the data set, or divide the plans into parts.

        Parameters
        ----------
        name
            The name of a list ("train", "val", "test"); its plans are returned in the list's order. ``houseexpo split``
            writes such lists; the published ``map_id_train.txt`` and ``map_id_test.txt`` are also read. Ids without a
            plan are left out; ``splits`` contains them.
        seed
            The seed that decides which plan goes into which part.
        **shares
            The share of each part: ``split(train=0.7, test=0.3)`` returns ``{"train": ..., "test": ...}``, the parts
            that ``houseexpo split`` writes. Levels and copies of one house are in the same part. All plans are read.

        Raises
        ------
        DatasetError
            There is no list of this name.
        ConfigError
            Neither a name nor shares are given, or both; a share is not from 0 to 1, or they do not add up to 1.
        """
        if (name is None) == (not shares) or not isinstance(name, str | None):
            found = f"; found {name!r}" if name is not None else ""
            raise ConfigError(f"split: expected the name of a list, or shares such as train=0.7, test=0.3{found}")
        if name is None:
            from houseexpo.dataset.splits import split_plans

            return {part: self.only(ids) for part, ids in split_plans(self, shares, seed).parts.items()}
        lists = self._catalogue.lists
        if name not in lists:
            known = ", ".join(sorted(lists)) or "none; houseexpo split makes some"
            raise DatasetError(f"{self._catalogue.display_name}: no list {name!r}; known: {known}")
        here, row_of = set(self._rows.tolist()), self._catalogue.row_of
        rows = [row for found in lists[name] if (row := row_of.get(found, -1)) in here]
        return Dataset(self._catalogue, np.array(rows, dtype=np.int64))

    def head(self, n: int = 5) -> Dataset:
        """Return the first ``n`` plans.

        Parameters
        ----------
        n
            Number of plans; all plans if the data set has fewer.
        """
        return self[:n]

    def sort(self, by: str, *, descending: bool = False) -> Dataset:
        """Return the plans sorted by a column. Plans without a value come last; equal plans keep their order.

        Parameters
        ----------
        by
            A column (``column``).
        descending
            Whether the largest value comes first.

        Raises
        ------
        ConfigError
            There is no such column, or its values have no order.
        """
        values = self.column(by)
        known = [number for number, value in enumerate(values) if value is not None]
        try:
            order = sorted(known, key=values.__getitem__, reverse=descending)
        except TypeError:
            raise ConfigError(f"sort: expected a column of numbers or words, found {by!r}") from None
        return self[order + [number for number, value in enumerate(values) if value is None]]

    def only(self, ids: Iterable[str]) -> Dataset:
        """Return the plans with these ids, in this order.

        Parameters
        ----------
        ids
            Ids of plans of this data set, or a single one.

        Raises
        ------
        UnknownPlanError
            A plan does not exist.
        """
        names = [ids] if isinstance(ids, str) else ids
        return Dataset(self._catalogue, np.array([self._row(name) for name in names], dtype=np.int64))

    def sample(self, n: int, seed: int | np.random.Generator) -> Dataset:
        """Return ``n`` different plans drawn at random; the same seed always gives the same plans.

        Parameters
        ----------
        n
            Number of plans.
        seed
            A whole number, or a generator, whose state advances.

        Raises
        ------
        ConfigError
            The data set has fewer plans.
        """
        if not 0 <= n <= len(self):
            raise ConfigError(f"sample: expected 0 to {len(self)} plans, found {n}")
        return Dataset(self._catalogue, self._rows[np.random.default_rng(seed).permutation(len(self))[:n]])

    def __reduce__(self) -> tuple[Any, ...]:
        return _reopen, (self._catalogue.address, self.ids)

    def __repr__(self) -> str:
        some = "" if len(self) == len(self._catalogue.ids) else f"{len(self):,} of "
        return f"Dataset({self.path.name!r}, {some}{count_noun(len(self._catalogue.ids), 'plan')})"

    def _repr_html_(self) -> str:
        """Show the data set in a notebook: counts, the first plans as pictures, and a table of some plans."""
        from houseexpo.dataset.notebook import dataset_html

        return dataset_html(self)

    def _row(self, plan_id: str) -> int:
        row = self._catalogue.row_of.get(plan_id, -1)
        if row < 0 or (len(self) < len(self._catalogue.ids) and row not in self._rows):
            known = self._catalogue.ids if row < 0 else self.ids
            raise UnknownPlanError(f"{self._catalogue.display_name}: {unknown_name_message(plan_id, known)}")
        return row

    def _plan(self, row: int) -> FloorPlan:
        expected = self._catalogue.ids[row]
        try:
            plan = decode(self._catalogue.read(row))
        except PlanError as error:
            raise error.within(plan=expected) from None
        if plan.id != expected:
            raise PlanError(f"expected {expected!r}, as the index of {self.path} says; it was changed", "id", plan.id)
        return plan


def _title_of(plan: FloorPlan) -> str:
    """Return a short description of a plan: its rooms and its free space."""
    return f"{count_noun(len(plan.rooms), 'room')}, {plan.area:.0f} m²"


def _reopen(address: str | Path, ids: list[str]) -> Dataset:
    from houseexpo.dataset.store import open_store

    return Dataset(open_store(address)).only(ids)
