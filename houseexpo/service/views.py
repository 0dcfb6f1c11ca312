"""What a query finds in a table of measures: the rows in order, and beside each condition how many there are.

R1  A histogram, and the counts of sources and splits, leave their own condition out: they show what another choice
    would give. Counts of labels do not: labels add up, so each says how many would be left with it.
R2  All that does not depend on the query is made once: bins, orders.
R3  ``without`` says for each condition how many plans would be found if it were taken off.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.plan.categories import LABELS
from houseexpo.service.measures import MEASURES, OF_A_RADIUS, RADII, Bits, Measure, Numbers, Table
from houseexpo.service.query import Query
from houseexpo.service.recent import Recent

_BINS: Final = 32
_KEPT: Final = 128
_WORDS: Final = 64
_NAMED: Final = 20
_STEPS: Final = (1.0, 2.0, 2.5, 5.0)

Rows = npt.NDArray[np.int64]
"""Numbers of plans (m,): looking up a thousand of them takes a fraction of the time that a mask of all plans takes."""


@dataclass(frozen=True)
class Bins:
    """Where the bars of a histogram stand: ``first`` is the left end, the last bar takes all that is greater.

    ``of`` (n,) is the bar of each plan, ``number`` for those of which the measure is not known.
    """

    first: float
    step: float
    number: int
    of: npt.NDArray[np.int16]

    def counts(self, among: Rows | Bits) -> list[int]:
        """Return how many of the plans with these numbers, or of this mask (n,), each bar holds."""
        if not self.number:
            return []
        found = np.bincount(self.of[among], minlength=self.number + 1)[: self.number]
        counts: list[int] = found.tolist()
        return counts


@dataclass(frozen=True)
class View:
    """What a query found: ``rows`` in order; ``facets`` as plain values, ready for JSON."""

    rows: npt.NDArray[np.int64]
    mask: Bits
    facets: dict[str, Any]


class Views:
    """Answers queries; the last ones are kept, since a page asks for one view many times."""

    def __init__(self, table: Table) -> None:
        self.table = table
        self._kept: Recent[View] = Recent(_KEPT)
        self._tagged: dict[str, Bits] = {}
        self._tags: object = None
        self._turn = 0
        self._holds = lru_cache(_WORDS)(self._searched)  # a person who typed a word changes other conditions

    def tagged(self, tags: Mapping[str, Sequence[str]]) -> None:
        """Take the ids of each tag; ids that the data set lacks, since it was built again, are left out."""
        if tags is self._tags:
            return
        number = self._numbers
        masks = {}
        for name, ids in tags.items():
            masks[name] = np.zeros(len(self.table), dtype=bool)
            masks[name][[number[each] for each in ids if each in number]] = True
        self._tags, self._tagged, self._turn = tags, masks, self._turn + 1

    def tags_of(self, row: int) -> list[str]:
        """Return the tags of one plan."""
        return [name for name, has in self._tagged.items() if has[row]]

    def find(self, query: Query) -> View:
        """Return what a query finds; raise ConfigError if it names a source, split or tag that the data set lacks."""
        return self._kept.made((self._turn, str(query)), lambda: self._found(query))

    def _found(self, query: Query) -> View:
        failed = dict(self._failed(query))
        fails = np.zeros(len(self.table), dtype=np.uint8)
        for each in failed.values():
            fails += each
        mask = fails == 0

        found = np.flatnonzero(mask)

        def without(name: str) -> Rows:  # R1
            return found if name not in failed else np.flatnonzero(fails == failed[name])

        measures = {measure.name: self._histogram(measure, query.radius, without(measure.name)) for measure in MEASURES}
        groups = {
            name: dict(zip(known, _counted(code[without(name)], len(known)), strict=True))
            for name, (known, code) in self.table.groups.items()
        }
        of_labels = np.bitwise_count(self._labels & np.packbits(mask)).sum(axis=1, dtype=np.int64)
        labels = dict(zip(LABELS, of_labels.tolist(), strict=True))
        tags = {name: int((has & mask).sum()) for name, has in self._tagged.items()}
        order = self._order(query.sort, query.radius)
        rows = order[mask[order]]
        facets = {
            "total": len(self.table),
            "found": len(rows),
            "measures": measures,
            "labels": labels,
            "tags": tags,
            "without": {name: int((fails == each).sum()) for name, each in failed.items()},  # R3
            **groups,
        }
        return View(rows, mask, facets)

    def _failed(self, query: Query) -> Iterator[tuple[str, Bits]]:
        """Yield each condition's name and the plans that fail it."""
        table = self.table
        for name, (low, high) in query.ranges.items():
            values = table.numbers(name, query.radius)
            yield name, ~((values >= low) & (values <= high))
        for label in query.labels:
            yield f"labels={label}", ~table.labels[LABELS.index(label)]
        for label in query.without:
            yield f"without={label}", table.labels[LABELS.index(label)]
        for name in query.tags:
            if name not in self._tagged:
                there = ", ".join(list(self._tagged)[:_NAMED]) or "none"
                raise ConfigError(f"query: tags: no {name[:60]!r} in this data set; there are: {there}")
            yield f"tags={name}", ~self._tagged[name]
        for name, wanted in query.groups.items():
            known, code = table.groups[name]
            for strange in sorted(set(wanted) - set(known)):
                there = ", ".join(known[:_NAMED]) or "none"
                raise ConfigError(f"query: {name}: no {strange[:40]!r} in this data set; there are: {there}")
            numbers = [number for number, found in enumerate(known) if found in wanted]
            yield name, ~np.isin(code, numbers)
        if query.text:
            lacking = [~self._holds(word) for word in query.text.split()]
            yield "text", np.logical_or.reduce(lacking)

    def _searched(self, word: str) -> Bits:
        """Whether each plan's words hold a word."""
        from pyarrow import compute

        found: Bits = compute.match_substring(self._words, word).to_numpy(zero_copy_only=False)
        return found

    @cached_property
    def _numbers(self) -> dict[str, int]:
        return {name: number for number, name in enumerate(self.table.ids)}

    @cached_property
    def _words(self) -> Any:
        import pyarrow as pa

        return pa.array(self.table.words, pa.string())

    @cached_property
    def _labels(self) -> npt.NDArray[np.uint8]:  # R2
        """The table's labels, eight plans a byte."""
        return np.packbits(self.table.labels, axis=1)

    def _histogram(self, measure: Measure, radius: str, among: Rows) -> dict[str, Any]:
        bins = self._bins[f"{measure.name} {radius}" if measure.name in OF_A_RADIUS else measure.name]
        return {"first": bins.first, "step": bins.step, "counts": bins.counts(among)}

    @cached_property
    def _bins(self) -> dict[str, Bins]:  # R2
        names = {measure.name: (measure, RADII if measure.name in OF_A_RADIUS else ("",)) for measure in MEASURES}
        return {
            f"{name} {radius}".strip(): bins_of(self.table.numbers(name, radius), whole=measure.counts)
            for name, (measure, radii) in names.items()
            for radius in radii
        }

    def _order(self, sort: str, radius: str) -> npt.NDArray[np.int64]:
        """Return all rows in an order: what is not known comes last, ties in the order of the ids."""
        name = sort.removeprefix("-")
        key = (name, radius if name in OF_A_RADIUS else "", sort.startswith("-"))
        if key not in self._orders:
            self._orders[key] = self._sorted(*key)
        return self._orders[key]

    @cached_property
    def _orders(self) -> dict[tuple[str, str, bool], npt.NDArray[np.int64]]:
        return {}

    def _sorted(self, name: str, radius: str, descending: bool) -> npt.NDArray[np.int64]:
        by_id = np.array(sorted(range(len(self.table)), key=self.table.ids.__getitem__), dtype=np.int64)
        if name == "id":
            return by_id[::-1] if descending else by_id
        values = self.table.numbers(name, radius)[by_id]
        return np.asarray(by_id[np.argsort(-values if descending else values, kind="stable")])


def bins_of(values: Numbers, *, whole: bool) -> Bins:
    """Choose round bars for numbers: at most 32, of equal width; what few plans exceed falls in the last one."""
    known = values[~np.isnan(values)]
    if not len(known):
        return Bins(0.0, 1.0, 0, np.zeros(len(values), dtype=np.int16))
    low, high = float(known.min()), float(np.quantile(known, 0.995, method="higher"))
    step = _round_step((high - low) / (_BINS - 1), whole=whole)
    first = math.floor(low / step + 1e-9) * step
    number = min(int((max(high, low) - first) / step + 1e-9) + 1, _BINS)
    place = np.floor((np.nan_to_num(values, nan=first) - first) / step + 1e-9)
    of = np.clip(place, 0, number - 1).astype(np.int16)
    of[np.isnan(values)] = number
    return Bins(round(first, 9), step, number, of)


def _round_step(least: float, *, whole: bool) -> float:
    if least <= 0:
        return 1.0
    power = 10.0 ** math.floor(math.log10(least))
    step = next((factor * power for factor in _STEPS if factor * power >= least), 10 * power)
    return max(1.0, math.ceil(step)) if whole else step


def _counted(codes: npt.NDArray[np.int32], number: int) -> list[int]:
    counts: list[int] = np.bincount(codes[codes >= 0], minlength=number)[:number].tolist()
    return counts
