"""Search a data set: read a query from a web address, and find its plans, in order, in a table of the plans' measures.

A ``Query`` is a view of a data set as its address states it: which plans, in which order. The address
``rooms=3..6&area=..120&labels=Kitchen,Garage&source=ifc&text=loft&sort=-area`` holds the whole view; conditions that it
leaves out are open. ``radius`` is the robot's, for ``reach`` and ``narrowest``.

R1  A histogram, and the counts of sources and splits, ignore their own condition, so that they show what another choice
    would find. Counts of labels do not: labels add up, so each count says how many plans would remain with that label.
R2  Values that do not depend on the query, such as bins and orders, are computed once.
R3  ``without`` gives for each condition the number of plans that would be found if it were removed.
R4  Counts and histograms are computed on request; a page of plans does not need them.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any, Final
from urllib.parse import urlencode

import numpy as np
import numpy.typing as npt
from starlette.datastructures import ImmutableMultiDict

from houseexpo.analysis.measures import BY_NAME, Measure
from houseexpo.dataset import Dataset
from houseexpo.dataset.store.columns import parse_label
from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan
from houseexpo.lru_cache import LruCache
from houseexpo.plan import RADII_M
from houseexpo.plan.room_labels import LABELS
from houseexpo.tolerances import ROBOT_M
from houseexpo.words import suggest_name

Numbers = npt.NDArray[np.float64]
Bits = npt.NDArray[np.bool_]
Rows = npt.NDArray[np.int64]
"""Row numbers of plans (m,). Looking up a thousand rows is much faster than applying a mask of all plans."""

MEASURES: Final = tuple(
    BY_NAME[name]
    for name in (
        *("rooms", "source_rooms", "area", "long_side", "short_side", "doors", "cuts", "holes", "vertices", "quality"),
        *("narrowest", "reach"),
    )
)
"""The measures by which plans are filtered, sorted and counted."""

NAMES: Final = tuple(measure.name for measure in MEASURES)
RADII: Final = tuple(f"{radius:.2f}" for radius in RADII_M)
USUAL_RADIUS: Final = f"{ROBOT_M:.2f}"
GROUPS: Final = ("source", "split")
SORTS: Final = ("id", *NAMES)
PAGING: Final = ("offset", "limit")
PAGE: Final = ("view", "columns")
"""Parameters that say how a page shows the plans, not which plans."""

_WORDS: Final = ("labels", "without", "text", "radius", "sort")
TOKEN: Final = "token"  # noqa: S105  # the name of a parameter, which a server without a token ignores
_NUMBER: Final = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)(e[+-]?[0-9]{1,3})?", re.IGNORECASE)
JOINED: Final = {"labels": ",", "without": ",", **dict.fromkeys(GROUPS, ","), "text": " "}
"""The separators of parameters that may be given several times."""
_ALL: Final = (-math.inf, math.inf)

LONGEST_TEXT: Final = 200
"""Letters of a text to search for; more are ignored."""
BINS: Final = 32
"""Bars of a histogram, at most."""
_HISTOGRAM_TAIL: Final = 0.995
"""The last bar of a histogram begins at this quantile or below, so that a few huge plans do not hide the others."""
_EXACT: Final = 1e-9
"""Numbers this close below a bar, as a share of its width, belong to it, because decimals are inexact in binary."""
_STEPS: Final = (1.0, 2.0, 2.5, 5.0)
"""Round widths of bars, and their multiples by powers of ten."""
KEPT_VIEWS: Final = 128
KEPT_WORDS: Final = 64
"""The number of results that stay in memory, of queries and of words searched for."""
NAMED: Final = 20
"""The number of names that an error message lists."""

_SHAPE: Final = "shape of a plan, 2"
"""The name under which ``_shape_of`` is cached; change it when the function changes."""


@dataclass(frozen=True)
class Query:
    """Conditions, all of which must be met, and an order.

    Attributes
    ----------
    ranges
        By measure: the lowest and the highest value, both included.
    labels, without
        Labels that must all occur, and labels that must not occur.
    groups
        By ``source`` and ``split``: the names of which one must be the plan's.
    text
        Words that must all occur in a plan's id, labels or source.
    """

    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    labels: tuple[str, ...] = ()
    without: tuple[str, ...] = ()
    groups: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    text: str = ""
    radius: str = USUAL_RADIUS
    sort: str = "id"

    def __str__(self) -> str:
        """Return the query as an address holds it; equal queries give equal texts."""
        ranges = {name: _span(*self.ranges[name]) for name in NAMES if name in self.ranges}
        own = {"labels": self.labels, "without": self.without}
        lists = {**own, **{name: self.groups.get(name, ()) for name in GROUPS}}
        words = {"text": self.text, "radius": self.radius if self.radius != USUAL_RADIUS else ""}
        joined = {name: ",".join(values) for name, values in lists.items()}
        sort = {"sort": self.sort if self.sort != "id" else ""}
        return urlencode({name: value for name, value in {**ranges, **joined, **words, **sort}.items() if value})


def parse_query(given: Mapping[str, str], others: Sequence[str] = ()) -> Query:
    """Read a query from the parameters of an address; ``others`` are parameters with another purpose.

    A list may be given in several parameters: ``labels=Kitchen&labels=Garage`` is ``labels=Kitchen,Garage``.

    Raises
    ------
    ConfigError
        A parameter is unknown, is given twice, or has a value that cannot be read; the message names it.
    """
    found = {name: value for name, value in _each_once(given).items() if name not in (*others, *PAGE, TOKEN) and value}
    unknown = sorted(set(found) - {*NAMES, *GROUPS, *_WORDS})
    if unknown:
        known = ", ".join([*NAMES, *GROUPS, *_WORDS, *others])
        near = suggest_name(unknown[0][:40], [*NAMES, *GROUPS, *_WORDS, *others])
        raise ConfigError(f"query: expected {known}; found {unknown[0][:40]!r}{near}")
    sort, radius = found.get("sort", "id"), found.get("radius", USUAL_RADIUS)
    if sort.removeprefix("-") not in SORTS:
        raise ConfigError(f"query: sort: expected one of {', '.join(SORTS)}, or that with a '-', found {sort[:40]!r}")
    ranges = {name: _range(name, found[name]) for name in NAMES if name in found}
    groups = {name: tuple(sorted(_words(found, name))) for name in GROUPS}
    return Query(
        ranges={name: ends for name, ends in ranges.items() if ends != _ALL},
        labels=_labels(found, "labels"),
        without=_labels(found, "without"),
        groups={name: names for name, names in groups.items() if names},
        text=" ".join(found.get("text", "").casefold()[:LONGEST_TEXT].split()),
        radius=_radius(radius),
        sort=sort,
    )


def parse_whole_number(given: Mapping[str, str], name: str, default: int, most: int, least: int = 0) -> int:
    """Return a parameter that is a whole number from ``least`` to ``most``; raise ConfigError if it is not."""
    word = given.get(name, "") or str(default)
    if not re.fullmatch("[0-9]{1,9}", word) or not least <= int(word) <= most:
        raise ConfigError(f"query: {name}: expected a whole number, {least} to {most}, found {word[:40]!r}")
    return int(word)


def _each_once(given: Mapping[str, str]) -> dict[str, str]:
    if not isinstance(given, ImmutableMultiDict):
        return dict(given)
    found = {name: given.getlist(name) for name in given}
    twice = [name for name, values in found.items() if len(values) > 1 and name not in JOINED]
    if twice:
        raise ConfigError(f"query: {twice[0][:40]}: expected once, found {len(found[twice[0]])} of it")
    return {name: JOINED.get(name, "").join(values) for name, values in found.items()}


def _radius(word: str) -> str:
    try:
        found = f"{float(word[:12]):.2f}"
    except ValueError:
        found = word
    if found not in RADII:
        raise ConfigError(f"query: radius: expected one of {', '.join(RADII)} (metres), found {word[:40]!r}")
    return found


def _words(given: Mapping[str, str], name: str) -> set[str]:
    return {word.strip() for word in given.get(name, "").split(",") if word.strip()}


def _labels(given: Mapping[str, str], name: str) -> tuple[str, ...]:
    return tuple(sorted({parse_label(word) for word in _words(given, name)}))


def _range(name: str, word: str) -> tuple[float, float]:
    low, dots, high = word.partition("..")
    first = _number(low, -math.inf)
    last = _number(high, math.inf) if dots else first
    if not first <= last or not word.strip("."):
        raise ConfigError(f"query: {name}: expected a number or a range such as 3..6, ..6 or 3.., found {word[:40]!r}")
    return first, last


def _number(word: str, default: float) -> float:
    """Return a number in plain notation, NaN for other words; Python itself also reads ``1_0`` and foreign digits."""
    if not word:
        return default
    return float(word) if _NUMBER.fullmatch(word) else math.nan


def _span(low: float, high: float) -> str:
    """Return a range as an address holds it, with all digits: different ranges have different texts."""
    if low == high:
        return _end(low)
    return f"{'' if low == -math.inf else _end(low)}..{'' if high == math.inf else _end(high)}"


def _end(value: float) -> str:
    return repr(float(value)).removesuffix(".0")


@dataclass(frozen=True)
class MeasureTable:
    """The measures of a data set's plans, in its order; a measure that a plan lacks is NaN, which is in no range.

    Attributes
    ----------
    ids, words
        The id of each plan, and the text that a search looks through, in lower case.
    labels
        (25, n) bool: whether the plan has the label, in the order of ``LABELS``.
    groups
        ``source`` and ``split``: the names that occur, and the number of each plan's name (n,), -1 if it has none.
    """

    ids: Sequence[str]
    words: Sequence[str]
    labels: Bits
    groups: Mapping[str, tuple[tuple[str, ...], npt.NDArray[np.int32]]]
    _numbers: Mapping[str, Numbers] = field(repr=False)

    def __len__(self) -> int:
        return len(self.ids)

    def numbers(self, measure: str, radius: str = USUAL_RADIUS) -> Numbers:
        """Return a measure of each plan (n,); ``radius`` ("0.20") matters only if it depends on a robot."""
        return self._numbers[f"{measure} {radius}" if BY_NAME[measure].is_of_robot else measure]

    def value(self, row: int, measure: str, radius: str = USUAL_RADIUS) -> float | None:
        """Return a measure of one plan, None if it is unknown."""
        found = float(self.numbers(measure, radius)[row])
        return None if np.isnan(found) else found

    def title(self, row: int) -> str:
        """Return a plan's name on pages, such as "9 rooms, 121 m²" (``plan_title``), or its id if nothing is known."""
        return plan_title(*(self.value(row, name) for name in ("rooms", "area", "source_rooms"))) or self.ids[row]


def plan_title(rooms: float | None, area_m2: float | None, source_rooms: float | None = None) -> str:
    """Return a plan's name on pages, such as "9 rooms, 121 m²", "" if no value is known.

    The rooms are those that the plan has or, if these are unknown, those of its source: "9 rooms in the source".
    """
    count, where = (rooms, "") if rooms is not None else (source_rooms, " in the source")
    words = [] if count is None else [("1 room" if count == 1 else f"{count:,.0f} rooms") + where]
    if area_m2 is not None:
        words.append(f"{area_m2:,.0f} m²" if area_m2 >= 10 else f"{area_m2:.1f} m²")
    return ", ".join(words)


def measure_table(data: Dataset) -> MeasureTable:
    """Return the table of a data set, from its index and from measures that take little time.

    Doors and reach of published plans are included if they were computed before, which takes minutes
    (``houseexpo serve --measure``).
    """
    sides = np.stack([_column(data, "width"), _column(data, "height")])
    shape = data.measure_cached(_SHAPE, _shape_of)
    labels = data.column("labels")
    numbers = {
        **{name: _column(data, BY_NAME[name].column) for name in ("source_rooms", "area", "doors", "cuts", "quality")},
        "rooms": _rooms(data, [found[3] for found in shape]),
        "long_side": sides.max(axis=0),
        "short_side": sides.min(axis=0),
        "holes": np.array([found[0] for found in shape], dtype=np.float64),
        "vertices": np.array([found[1] for found in shape], dtype=np.float64),
        **_reach(data.column("navigability", compute=False)),
    }
    sources = data.column("source")
    spelt = (" ".join(each).replace("_", " ") for each in labels)
    words = zip(data.ids, spelt, (source or "" for source in sources), (found[2] for found in shape), strict=True)
    return MeasureTable(
        ids=data.ids,
        words=[" ".join(each).casefold() for each in words],
        labels=np.array([[label in has for has in map(frozenset, labels)] for label in LABELS], dtype=bool),
        groups={"source": _encode_names(sources), "split": _encode_names(_split_of(data))},
        _numbers=numbers,
    )


def _rooms(data: Dataset, recorded: Sequence[int]) -> Numbers:
    """Return the rooms that plans record or, for a plan that records none, those that were found before."""
    return np.where(np.array(recorded) > 0, recorded, _column(data, "rooms"))


def _column(data: Dataset, name: str) -> Numbers:
    return np.array(data.column(name, compute=False), dtype=np.float64)  # None becomes NaN


def _shape_of(plan: FloorPlan) -> tuple[int, int, str, int]:
    """Return the holes, the vertices of all rings, the words of the source (file and scene), and the rooms."""
    origin = plan.provenance or {}
    words = [str(origin[key]) for key in ("file", "scene", "name") if origin.get(key)]
    holes, vertices = (int(BY_NAME[name].numbers(plan)[0]) for name in ("holes", "vertices"))
    return holes, vertices, " ".join(words), len(plan.rooms)


def _reach(found: Sequence[Mapping[str, Mapping[str, float]] | None]) -> dict[str, Numbers]:
    columns = {}
    for radius in RADII:
        of_radius = [(reach or {}).get(radius) or {} for reach in found]
        columns[f"narrowest {radius}"] = np.array([r.get("narrowest", np.nan) for r in of_radius], dtype=np.float64)
        columns[f"reach {radius}"] = np.array([r.get("largest_share", np.nan) for r in of_radius], dtype=np.float64)
    return columns


def _split_of(data: Dataset) -> list[str | None]:
    """Return the list that contains each plan; of several, the longest."""
    of: dict[str, str] = {}
    for name, ids in sorted(data.splits.items(), key=lambda item: len(item[1])):
        of.update(dict.fromkeys(ids, name))
    recorded: list[Any] = data.column("split")
    return [of.get(name) or given for name, given in zip(data.ids, recorded, strict=True)]


def _encode_names(names: Sequence[str | None]) -> tuple[tuple[str, ...], npt.NDArray[np.int32]]:
    known = tuple(sorted({name for name in names if name}))
    code = {name: number for number, name in enumerate(known)}
    return known, np.array([code.get(name or "", -1) for name in names], dtype=np.int32)


@dataclass(frozen=True)
class HistogramBins:
    """The bars of a histogram: ``first`` is the left end of the first bar; the last bar includes all greater values.

    ``of`` (n,) is the bar of each plan; it equals ``number`` if the plan's measure is unknown.
    """

    first: float
    step: float
    number: int
    of: npt.NDArray[np.int16]

    def counts(self, among: Rows | Bits) -> list[int]:
        """Return the height of each bar, for the plans of these rows or of this mask (n,)."""
        if not self.number:
            return []
        found = np.bincount(self.of[among], minlength=self.number + 1)[: self.number]
        counts: list[int] = found.tolist()
        return counts


class FoundPlans:
    """The plans that a query finds: ``rows`` in order, ``mask`` (n,) of all plans, and ``facets``."""

    def __init__(self, rows: Rows, mask: Bits, count: Any) -> None:
        self.rows, self.mask, self._count = rows, mask, count

    @cached_property
    def facets(self) -> dict[str, Any]:
        """The counts and histograms beside the conditions, as plain values for JSON (R4)."""
        found: dict[str, Any] = self._count()
        return found


class PlanSearch:
    """Answers queries on one table; recent answers are kept, because a page asks for the same view many times."""

    def __init__(self, table: MeasureTable) -> None:
        self.table = table
        self._kept: LruCache[FoundPlans] = LruCache(KEPT_VIEWS)
        self._holds = lru_cache(KEPT_WORDS)(
            self._contains_word
        )  # a person who typed a word then changes other conditions

    def find(self, query: Query) -> FoundPlans:
        """Return the plans that a query finds.

        Raises
        ------
        ConfigError
            The query names a source or split that the data set lacks.
        """
        return self._kept.get_or_make(str(query), lambda: self._find(query))

    def _find(self, query: Query) -> FoundPlans:
        failed = dict(self._failures(query))
        fails = np.zeros(len(self.table), dtype=np.uint8)
        for each in failed.values():
            fails += each
        mask = fails == 0
        order = self._order(query.sort, query.radius)
        return FoundPlans(order[mask[order]], mask, lambda: self._facets(query.radius, failed, fails, mask))

    def _facets(
        self, radius: str, failed: Mapping[str, Bits], fails: npt.NDArray[np.uint8], mask: Bits
    ) -> dict[str, Any]:
        found = np.flatnonzero(mask)

        def without(name: str) -> Rows:  # R1
            return found if name not in failed else np.flatnonzero(fails == failed[name])

        measures = {measure.name: self._histogram(measure, radius, without(measure.name)) for measure in MEASURES}
        groups = {
            name: dict(zip(known, _count_codes(code[without(name)], len(known)), strict=True))
            for name, (known, code) in self.table.groups.items()
        }
        of_labels = np.bitwise_count(self._labels & np.packbits(mask)).sum(axis=1, dtype=np.int64)
        return {
            "total": len(self.table),
            "found": len(found),
            "measures": measures,
            "labels": dict(zip(LABELS, of_labels.tolist(), strict=True)),
            "without": {name: int((fails == each).sum()) for name, each in failed.items()},  # R3
            **groups,
        }

    def _failures(self, query: Query) -> Iterator[tuple[str, Bits]]:
        """Yield each condition's name, and the plans that do not meet it."""
        table = self.table
        for name, (low, high) in query.ranges.items():
            values = table.numbers(name, query.radius)
            yield name, ~((values >= low) & (values <= high))
        for label in query.labels:
            yield f"labels={label}", ~table.labels[LABELS.index(label)]
        for label in query.without:
            yield f"without={label}", table.labels[LABELS.index(label)]
        for name, wanted in query.groups.items():
            known, code = table.groups[name]
            for unknown in sorted(set(wanted) - set(known)):
                listed = ", ".join(known[:NAMED]) or "none"
                raise ConfigError(f"query: {name}: no {unknown[:40]!r} in this data set; it has: {listed}")
            numbers = [number for number, found in enumerate(known) if found in wanted]
            yield name, ~np.isin(code, numbers)
        if query.text:
            lacking = [~self._holds(word) for word in query.text.split()]
            yield "text", np.logical_or.reduce(lacking)

    def _contains_word(self, word: str) -> Bits:
        """Return whether each plan's words contain a word."""
        from pyarrow import compute

        found: Bits = compute.match_substring(self._words, word).to_numpy(zero_copy_only=False)
        return found

    @cached_property
    def _words(self) -> Any:
        import pyarrow as pa

        return pa.array(self.table.words, pa.string())

    @cached_property
    def _labels(self) -> npt.NDArray[np.uint8]:  # R2
        """The table's labels, eight plans in a byte."""
        return np.packbits(self.table.labels, axis=1)

    def _histogram(self, measure: Measure, radius: str, among: Rows) -> dict[str, Any]:
        bins = self._bins[f"{measure.name} {radius}" if measure.is_of_robot else measure.name]
        return {"first": bins.first, "step": bins.step, "counts": bins.counts(among)}

    @cached_property
    def _bins(self) -> dict[str, HistogramBins]:  # R2
        return {
            f"{measure.name} {radius}".strip(): choose_bins(
                self.table.numbers(measure.name, radius), whole=measure.is_count
            )
            for measure in MEASURES
            for radius in (RADII if measure.is_of_robot else ("",))
        }

    def _order(self, sort: str, radius: str) -> Rows:
        """Return all rows in an order: unknown values come last, equal values in the order of the ids."""
        name = sort.removeprefix("-")
        of_robot = name != "id" and BY_NAME[name].is_of_robot
        key = (name, radius if of_robot else "", sort.startswith("-"))
        if key not in self._orders:
            self._orders[key] = self._sort(*key)
        return self._orders[key]

    @cached_property
    def _orders(self) -> dict[tuple[str, str, bool], Rows]:
        return {}

    def _sort(self, name: str, radius: str, descending: bool) -> Rows:
        by_id = np.array(sorted(range(len(self.table)), key=self.table.ids.__getitem__), dtype=np.int64)
        if name == "id":
            return by_id[::-1] if descending else by_id
        values = self.table.numbers(name, radius)[by_id]
        return np.asarray(by_id[np.argsort(-values if descending else values, kind="stable")])


def choose_bins(values: Numbers, *, whole: bool) -> HistogramBins:
    """Choose bars for numbers: at most 32, of equal and round width; the last one includes the few greatest numbers."""
    known = values[~np.isnan(values)]
    if not len(known):
        return HistogramBins(0.0, 1.0, 0, np.zeros(len(values), dtype=np.int16))
    low, high = float(known.min()), float(np.quantile(known, _HISTOGRAM_TAIL, method="higher"))
    step = _round_step((high - low) / (BINS - 1), whole=whole)
    first = math.floor(low / step + _EXACT) * step
    number = min(int((max(high, low) - first) / step + _EXACT) + 1, BINS)
    place = np.floor((np.nan_to_num(values, nan=first) - first) / step + _EXACT)
    of = np.clip(place, 0, number - 1).astype(np.int16)
    of[np.isnan(values)] = number
    return HistogramBins(round(first, 9), step, number, of)


def _round_step(least: float, *, whole: bool) -> float:
    if least <= 0:
        return 1.0
    power = 10.0 ** math.floor(math.log10(least))
    step = next((factor * power for factor in _STEPS if factor * power >= least), 10 * power)
    return max(1.0, math.ceil(step)) if whole else step


def _count_codes(codes: npt.NDArray[np.int32], number: int) -> list[int]:
    counts: list[int] = np.bincount(codes[codes >= 0], minlength=number)[:number].tolist()
    return counts
