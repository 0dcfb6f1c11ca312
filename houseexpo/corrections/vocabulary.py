"""Define the corrections of a house: the keys of ``overrides.toml``, their values, and the checks of these values.

Builds, reviews and the Python API take their corrections from this module. Words of a storey (``WORDS``) are facts
about its plan; ``houseexpo.corrections.apply`` applies them. The other keys concern a file or a whole plan.
"""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, Literal, NamedTuple, TypeAlias

from houseexpo.errors import ConfigError
from houseexpo.plan.room_labels import LABELS, UNLABELLED, canonical
from houseexpo.tolerances import MIN_DOOR_M, SMALLEST_SAID_ROOM_M2

NAME: Final = "overrides.toml"
LOG: Final = "overrides.log.jsonl"
"""The log of a review; it lies in the folder of ``overrides.toml``."""
FARTHEST_M: Final = 1e7
"""Coordinates beyond this are errors, metres: coordinates of national grids have seven digits."""

FILE_WORDS: Final = ("up", "units", "scale", "distance", "storey_height", "floors", "drop_nodes", "wall_layers")
"""The keys that concern a whole file; the file's reader applies them."""
LOWEST_STOREY_M: Final = 1.8
"""The lowest storey, metres: ``pipeline.tolerances.HEAD_M``."""
UNITS_M: Final = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
UNITS: Final = tuple(UNITS_M)
"""The names that ``units`` accepts, as does the option ``--units`` of a build, and the metres in each."""

Point: TypeAlias = tuple[float, float]
Line: TypeAlias = tuple[Point, Point]
Label: TypeAlias = tuple[float, float, str]
Distance: TypeAlias = tuple[Point, Point, float]
Word: TypeAlias = Literal[
    "room",
    "room_outline",
    "wall",
    "no_wall",
    "door",
    "opening",
    "entrance",
    "one_room",
    "no_door",
    "window",
    "no_room",
    "outside",
    "label",
]


class Form(NamedTuple):
    """The form of a word's value: its syntax, the depth of its lists, and its meaning as a sentence for people."""

    written: str
    depth: int
    says: str


_LINE: Final = "[[x, y], [x, y]]"
WORDS: Final[dict[Word, Form]] = {
    "room": Form("[x, y]", 1, "the space between walls around this point is a room"),
    "room_outline": Form("[[x, y], [x, y], [x, y], ...]", 2, "the area between these corners is a room"),
    "wall": Form(_LINE, 2, "a wall stands here, from end to end"),
    "no_wall": Form(_LINE, 2, "no wall stands here, from end to end: what lies at both sides is one room"),
    "one_room": Form("[[x, y], [x, y], ...]", 2, "the rooms around these points are one room"),
    "door": Form(_LINE, 2, "there is a door here, from jamb to jamb"),
    "opening": Form(_LINE, 2, "there is an opening without a door here, from jamb to jamb"),
    "entrance": Form(_LINE, 2, "a door leads outside here, from jamb to jamb"),
    "no_door": Form("[x, y]", 1, "there is no door, opening, entrance or cut here"),
    "window": Form("[x, y]", 1, "what the plan has as a passage here is a window: nobody walks through it"),
    "no_room": Form("[x, y]", 1, "the region around this point is no room"),
    "outside": Form("[x, y]", 1, "the region around this point lies outside, and is open to the rooms beside it"),
    "label": Form('[x, y, "Kitchen"]', 1, "the room around this point has this label"),
}
"""The words of a storey, in the order in which they are applied if no log tells when they were said. A word takes one
value or a list of values. Points are in metres along the source's plan axes."""
_FEWEST: Final[dict[Word, int]] = {"room_outline": 3, "one_room": 2}
"""The least number of points, for words that take any number of points."""


@dataclass(frozen=True)
class Correction:
    """One correction of a storey; points of ``value`` are in metres along the source's plan axes.

    ``said_of`` are the ids under which a build's corrections say it: of the storey, or of buildings of it.
    """

    word: Word
    value: Any
    said_of: tuple[str, ...] = field(default=(), repr=False, compare=False)

    def __str__(self) -> str:
        return f"{self.word} {self.plain_value}"

    @property
    def plain_value(self) -> Any:
        """The value as files have it: lists for tuples."""
        return _plain(self.value)

    @property
    def points(self) -> tuple[Point, ...]:
        """The points that the correction names."""
        if self.word == "label":
            return (self.value[:2],)
        return (self.value,) if WORDS[self.word].depth == 1 else self.value


@dataclass(frozen=True)
class Override:
    """The corrections of a house or a storey: the table of one id in ``overrides.toml``.

    Each word of ``WORDS`` takes one value or a sequence of values. Points are in metres along the source's plan axes,
    after units and scale: (X, Y) of a z-up source, (X, Z) of a y-up source. ``FILE_WORDS`` concern a whole file; its
    reader applies those that it supports. ``distance`` is two points in the file's own units, before any scale, and
    their distance in metres. ``floors`` are heights along the vertical axis, metres, after units and scale. ``why`` is
    a note for people. ``authors`` is not a key of the file: it holds a key (``author_key``), a name and a time for each
    statement in a review's log.

    Raises
    ------
    ConfigError
        A value has the wrong form, is not finite, or contradicts another value; the message names the key.

    Examples
    --------
    >>> said = Override(door=[[2.0, 3.1], [2.0, 4.0]], no_room=[5.5, 1.0])
    >>> said.corrections
    (Correction(word='door', value=((2.0, 3.1), (2.0, 4.0))), Correction(word='no_room', value=(5.5, 1.0)))
    """

    keep: bool = False
    drop: bool = False
    h_g: float | None = None
    h_d: float | None = None
    room: tuple[Point, ...] = ()
    room_outline: tuple[tuple[Point, ...], ...] = ()
    wall: tuple[Line, ...] = ()
    no_wall: tuple[Line, ...] = ()
    door: tuple[Line, ...] = ()
    opening: tuple[Line, ...] = ()
    entrance: tuple[Line, ...] = ()
    one_room: tuple[tuple[Point, ...], ...] = ()
    no_door: tuple[Point, ...] = ()
    window: tuple[Point, ...] = ()
    no_room: tuple[Point, ...] = ()
    outside: tuple[Point, ...] = ()
    label: tuple[Label, ...] = ()
    up: str | None = None
    units: str | None = None
    scale: float | None = None
    distance: Distance | None = None
    storey_height: float | None = None
    floors: tuple[float, ...] = ()
    drop_nodes: tuple[str, ...] = ()
    wall_layers: tuple[str, ...] = ()
    why: str = ""
    authors: tuple[tuple[str, str, str], ...] = ()

    def __post_init__(self) -> None:
        for word in WORDS:
            object.__setattr__(self, word, checked_values(word, getattr(self, word)))
        if self.keep and self.drop:
            raise ConfigError("expected keep or drop, found both; take one out")
        if self.h_g is not None and self.h_d is not None and self.h_d <= self.h_g:
            raise ConfigError(f"expected h_d above h_g, found {self.h_d:g} and {self.h_g:g}")
        for key in ("scale", "storey_height"):
            if (size := getattr(self, key)) is not None and not 0 < size < math.inf:
                raise ConfigError(f"{key}: expected more than 0, found {size:g}")
        if self.distance is not None:
            object.__setattr__(self, "distance", checked_distance(self.distance))
        object.__setattr__(self, "floors", _checked_floors(self.floors))
        sizes = [key for key in ("units", "distance", "storey_height") if getattr(self, key) is not None]
        sizes += ["scale"] if self.scale is not None and sizes != ["units"] else []
        if len(sizes) > 1:
            raise ConfigError(f"expected one of {' and '.join(sizes)}, found both; each says how large the model is")
        if self.up not in {None, "y", "z"}:
            raise ConfigError(f"up: expected y or z, found {self.up!r}")
        if self.units is not None and self.units not in UNITS and not _is_size(self.units):
            raise ConfigError(f"units: expected one of {', '.join(UNITS)}, or metres in a unit, found {self.units!r}")

    @property
    def corrections(self) -> tuple[Correction, ...]:
        """The corrections of the storey, in the order in which they are applied (``in_order_said``)."""
        said = [Correction(word, value) for word in WORDS for value in getattr(self, word)]
        return in_order_said(said, {key: at for key, _, at in self.authors})

    @property
    def of_file(self) -> bool:
        """Whether any key concerns a whole file rather than one of its levels (``FILE_WORDS``)."""
        return any(getattr(self, key) for key in FILE_WORDS)

    def joined(self, later: Override) -> Override:
        """Return the two tables of one id merged; ``later`` wins where they contradict each other."""
        decided = later if later.keep or later.drop else self
        heights = later if later.h_g is not None or later.h_d is not None else self
        lists = {name: (*getattr(self, name), *getattr(later, name)) for name in (*WORDS, "drop_nodes", "wall_layers")}
        rest: dict[str, Any] = {name: tuple(dict.fromkeys(values)) for name, values in lists.items()}
        return Override(
            keep=decided.keep,
            drop=decided.drop,
            h_g=heights.h_g,
            h_d=heights.h_d,
            up=later.up or self.up,
            floors=later.floors or self.floors,
            why=later.why or self.why,
            authors=(*self.authors, *later.authors),
            **_sizes(self, later),
            **rest,
        )


def in_order_said(corrections: Sequence[Correction], times: Mapping[str, str]) -> tuple[Correction, ...]:
    """Return corrections in the order in which they were said: each is of the plan with all that was said before it.

    ``times`` are those of a review's log, by ``author_key``. What no log knows comes first, in the order given.
    """
    return tuple(
        sorted(corrections, key=lambda each: times.get(author_key(each.word, each.value), "") if times else "")
    )


def author_key(word: str, value: Any) -> str:
    """Return a key for one statement; it is the same for a value from a file, a log or a plan's provenance."""
    values = checked_values(word, [value]) if word in WORDS else (value,)
    return json.dumps([word, _plain(values[0])])


def _sizes(earlier: Override, later: Override) -> dict[str, Any]:
    """Return the merged keys of a model's size: units and scale state it together, each other key alone."""
    alone, together = ("distance", "storey_height"), ("units", "scale")
    says_later = [key for key in (*alone, *together) if getattr(later, key) is not None]
    if set(says_later) & set(alone) or (says_later and any(getattr(earlier, key) is not None for key in alone)):
        return {key: getattr(later, key) for key in (*alone, *together)}
    return {key: getattr(later if key in says_later else earlier, key) for key in (*alone, *together)}


def _checked_floors(floors: Sequence[float]) -> tuple[float, ...]:
    heights = tuple(sorted(float(height) for height in floors))
    if not all(abs(height) < FARTHEST_M for height in heights):
        raise ConfigError(f"floors: expected finite metres, found {_plain(floors)}")
    for low, high in itertools.pairwise(heights):
        if high - low < LOWEST_STOREY_M:
            raise ConfigError(
                f"floors: expected {LOWEST_STOREY_M} m or more from one to the next, found {low:g} and {high:g}"
            )
    return heights


def checked_distance(value: Any) -> Distance:
    """Return a known distance as two points (x, y) of the file and a length in metres.

    Raises
    ------
    ConfigError
        The value has the wrong form, a number is not finite, the points are equal, or the length is not above 0.
    """
    given = isinstance(value, list | tuple) and len(value) == 3 and all(map(_is_point, value[:2]))
    if not given or isinstance(value[2], bool) or not isinstance(value[2], int | float):
        raise ConfigError(f"distance: expected [[x, y], [x, y], metres], found {_plain(value)!r}")
    a, b, metres = _point("distance", value[0]), _point("distance", value[1]), float(value[2])
    if a == b or not 0 < metres < FARTHEST_M:
        raise ConfigError(f"distance: expected two points, and metres above 0, found {_plain(value)!r}")
    return a, b, metres


def _is_size(text: str) -> bool:
    try:
        return 0 < float(text) < math.inf
    except ValueError:
        return False


def word_values(word: Word, value: Any) -> list[Any]:
    """Return the values of a word as a list; a file may give a single value without the outer list."""
    if not isinstance(value, list | tuple):
        return [value]
    inner: Any = value
    for _ in range(WORDS[word].depth):
        inner = inner[0] if isinstance(inner, list | tuple) and inner else None
    return [value] if inner is not None and not isinstance(inner, list | tuple) else list(value)


def checked_values(word: Word, value: Any) -> tuple[Any, ...]:
    """Return the values of a word as tuples of floats, each once.

    Raises
    ------
    ConfigError
        A value has the wrong form, a number is not finite or is too large, a line is too short, sides of an outline
        cross, or a label is unknown.
    """
    values = word_values(word, value)
    if not all(isinstance(each, list | tuple) for each in values):
        raise _other_form(word, value)
    return tuple(dict.fromkeys(_check_value(word, each) for each in values))


def _check_value(word: Word, value: Any) -> Any:
    form = WORDS[word]
    if word == "label":
        if not (_is_list(value, 3) and _is_point(value[:2]) and isinstance(value[2], str)):
            raise _other_form(word, value)
        label = canonical(value[2]) or (UNLABELLED if value[2] == UNLABELLED else None)
        if label is None:
            raise ConfigError(f"label: expected one of {', '.join((*LABELS, UNLABELLED))}; found {value[2]!r}")
        found: Any = (*_point(word, value[:2]), label)
        return found
    if form.depth == 1:
        if not _is_point(value):
            raise _other_form(word, value)
        return _point(word, value)
    count = len(value) if isinstance(value, list | tuple) else 0
    if count < _FEWEST.get(word, 2) or (word not in _FEWEST and count != 2) or not all(map(_is_point, value)):
        raise _other_form(word, value)
    points = tuple(_point(word, each) for each in value)
    if word == "room_outline":
        return _checked_outline(points)
    if word == "one_room":
        return points
    if (length := math.dist(*points)) < MIN_DOOR_M:
        ends, found = "ends" if word in {"wall", "no_wall"} else "jambs", f"{length:.2f} m: {_plain(points)}"
        raise ConfigError(f"{word}: expected {ends} {MIN_DOOR_M} m apart or more, found {found}")
    return points


def _checked_outline(points: tuple[Point, ...]) -> tuple[Point, ...]:
    from shapely import Polygon, is_valid_reason

    shape = Polygon(points)
    if not shape.is_valid:
        raise ConfigError(f"room_outline: expected sides that do not cross, found {is_valid_reason(shape)}")
    if shape.area < SMALLEST_SAID_ROOM_M2:
        raise ConfigError(f"room_outline: expected {SMALLEST_SAID_ROOM_M2} m2 or more, found {shape.area:.2f} m2")
    return points


def _other_form(word: Word, value: Any) -> ConfigError:
    expected = f"{WORDS[word].written}, or a list of these, in metres"
    return ConfigError(f"{word}: expected {expected}, found {_plain(value)!r}")


def _point(word: str, value: Sequence[float]) -> Point:
    x, y = float(value[0]), float(value[1])
    if not (abs(x) < FARTHEST_M and abs(y) < FARTHEST_M):  # also refuses NaN
        raise ConfigError(f"{word}: expected finite metres, found {_plain(value)}")
    return x, y


def _is_point(value: Any) -> bool:
    return _is_list(value, 2) and all(isinstance(n, int | float) and not isinstance(n, bool) for n in value)


def _is_list(value: Any, length: int) -> bool:
    return isinstance(value, list | tuple) and len(value) == length


def _plain(value: Any) -> Any:
    """Return a value as the file has it: lists for tuples."""
    return [_plain(part) for part in value] if isinstance(value, list | tuple) else value
