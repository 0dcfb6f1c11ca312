"""A view of a data set as its address says it: which plans, in which order.

``rooms=3..6&area=..120&labels=Kitchen,Garage&source=ifc&text=loft&sort=-area`` holds the whole view; what is left out
is open. ``radius`` is the robot's, for ``reach`` and ``narrowest``.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final
from urllib.parse import urlencode

from starlette.datastructures import ImmutableMultiDict

from houseexpo.dataset.store.columns import known_label
from houseexpo.errors import ConfigError
from houseexpo.service.measures import MEASURES, RADII, USUAL_RADIUS

NAMES: Final = tuple(measure.name for measure in MEASURES)
GROUPS: Final = ("source", "split")
SORTS: Final = ("id", *NAMES)
PAGING: Final = ("offset", "limit")
PAGE: Final = ("view", "columns")
"""How a page shows what is found; these say nothing about which plans are found."""

_WORDS: Final = ("labels", "without", "tags", "text", "radius", "sort")
_TOKEN: Final = "token"  # noqa: S105  # the name of a parameter, which a server without one does not mind
_NUMBER: Final = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)(e[+-]?[0-9]{1,3})?", re.IGNORECASE)

_JOINED: Final = {"labels": ",", "without": ",", "tags": ",", **dict.fromkeys(GROUPS, ","), "text": " "}
"""What stands between the values of a parameter that may be given several times."""

_LONGEST: Final = 200
_ALL: Final = (-math.inf, math.inf)


@dataclass(frozen=True)
class Query:
    """Conditions that all have to be met.

    Attributes
    ----------
    ranges
        By measure: from and to, both included.
    labels, without
        Labels that all occur, and that do not occur.
    tags
        Tags that the plan has, all of them.
    groups
        By ``source`` and ``split``: names of which one is the plan's.
    text
        Words that all occur in a plan's id, labels or source.
    """

    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    labels: tuple[str, ...] = ()
    without: tuple[str, ...] = ()
    tags: tuple[str, ...] = ()
    groups: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    text: str = ""
    radius: str = USUAL_RADIUS
    sort: str = "id"

    def __str__(self) -> str:
        """Return the query as an address holds it, always in the same order."""
        ranges = {name: _span(*self.ranges[name]) for name in NAMES if name in self.ranges}
        own = {"labels": self.labels, "without": self.without, "tags": self.tags}
        lists = {**own, **{name: self.groups.get(name, ()) for name in GROUPS}}
        words = {"text": self.text, "radius": self.radius if self.radius != USUAL_RADIUS else ""}
        joined = {name: ",".join(values) for name, values in lists.items()}
        sort = {"sort": self.sort if self.sort != "id" else ""}
        return urlencode({name: value for name, value in {**ranges, **joined, **words, **sort}.items() if value})


def parsed(given: Mapping[str, str], others: Sequence[str] = ()) -> Query:
    """Read a query from the parameters of an address; ``others`` are those that say something else.

    A list may come in several parameters: ``labels=Kitchen&labels=Garage`` is ``labels=Kitchen,Garage``.

    Raises
    ------
    ConfigError
        A parameter is unknown or given twice, or its value cannot be read; the text names it.
    """
    found = {name: value for name, value in _each_once(given).items() if name not in (*others, *PAGE, _TOKEN) and value}
    unknown = sorted(set(found) - {*NAMES, *GROUPS, *_WORDS})
    if unknown:
        known = ", ".join([*NAMES, *GROUPS, *_WORDS, *others])
        raise ConfigError(f"query: expected {known}; found {unknown[0][:40]!r}")
    sort, radius = found.get("sort", "id"), found.get("radius", USUAL_RADIUS)
    if sort.removeprefix("-") not in SORTS:
        raise ConfigError(f"query: sort: expected one of {', '.join(SORTS)}, or that with a '-', found {sort[:40]!r}")
    ranges = {name: _range(name, found[name]) for name in NAMES if name in found}
    groups = {name: tuple(sorted(_words(found, name))) for name in GROUPS}
    return Query(
        ranges={name: ends for name, ends in ranges.items() if ends != _ALL},
        labels=_labels(found, "labels"),
        without=_labels(found, "without"),
        tags=tuple(sorted(_words(found, "tags"))),
        groups={name: names for name, names in groups.items() if names},
        text=" ".join(found.get("text", "").casefold()[:_LONGEST].split()),
        radius=_radius(radius),
        sort=sort,
    )


def number(given: Mapping[str, str], name: str, usual: int, most: int, least: int = 0) -> int:
    """Return a whole number of the address, ``least`` to ``most``; raise ConfigError if it is none."""
    word = given.get(name, "") or str(usual)
    if not re.fullmatch("[0-9]{1,9}", word) or not least <= int(word) <= most:
        raise ConfigError(f"query: {name}: expected a whole number, {least} to {most}, found {word[:40]!r}")
    return int(word)


def _each_once(given: Mapping[str, str]) -> dict[str, str]:
    if not isinstance(given, ImmutableMultiDict):
        return dict(given)
    found = {name: given.getlist(name) for name in given}
    twice = [name for name, values in found.items() if len(values) > 1 and name not in _JOINED]
    if twice:
        raise ConfigError(f"query: {twice[0][:40]}: expected once, found {len(found[twice[0]])} of it")
    return {name: _JOINED.get(name, "").join(values) for name, values in found.items()}


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
    return tuple(sorted({known_label(word) for word in _words(given, name)}))


def _range(name: str, word: str) -> tuple[float, float]:
    low, dots, high = word.partition("..")
    first = _number(low, -math.inf)
    last = _number(high, math.inf) if dots else first
    if not first <= last or not word.strip("."):
        raise ConfigError(f"query: {name}: expected a number or a range such as 3..6, ..6 or 3.., found {word[:40]!r}")
    return first, last


def _number(word: str, without: float) -> float:
    """Return a number as everybody writes it: Python takes ``1_0`` and other scripts' digits too; NaN else."""
    if not word:
        return without
    return float(word) if _NUMBER.fullmatch(word) else math.nan


def _span(low: float, high: float) -> str:
    """Return a range as an address holds it, each end to its last digit: two ranges never look alike."""
    if low == high:
        return _end(low)
    return f"{'' if low == -math.inf else _end(low)}..{'' if high == math.inf else _end(high)}"


def _end(value: float) -> str:
    return repr(float(value)).removesuffix(".0")
