"""Check and convert values of a plan's parts when they are constructed; a failure is a PlanError that names the key."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from numbers import Integral, Real
from typing import Any

import numpy as np
import numpy.typing as npt

from houseexpo.errors import PlanError

_UNSAFE = re.compile(r"[/\\\x00-\x1f\x7f\ud800-\udfff]")  # the last are surrogates, which cannot be written
_FLOAT = {float}
_LONGEST_ID = 200  # leaves room for an extension in a file name

LARGEST_COORDINATE_M = 20_000.0
"""Largest distance from the origin, metres; larger ones are in another unit, in map coordinates, or damaged."""

MAX_VERTICES = 100_000
"""Largest number of vertices of one ring; the largest published one has 12,000."""

_MAX = 2**31 - 1  # counts fit the index's 32 bits


def check_plan_id(value: object) -> str:
    """Return an id that is safe as a file name: it cannot lead to another folder."""
    if not isinstance(value, str) or not 0 < len(value) <= _LONGEST_ID:
        raise PlanError(f"expected 1 to {_LONGEST_ID} characters, found {_short(value)}", "id")
    if value.startswith(".") or _UNSAFE.search(value):
        raise PlanError(
            f"expected a name that is safe as a file name, found {value!r}; "
            "take out slashes, control characters and leading dots",
            "id",
        )
    return value


def check_ring(value: object, key: str) -> npt.NDArray[np.float64]:
    """Return the ring as a read-only (n, 2) array: n >= 3, near the origin, unclosed; it need not be simple."""
    try:
        array = np.array(value, dtype=np.float64, order="C")
    except (TypeError, ValueError):
        raise PlanError(f"expected a list of [x, y] in metres, found {_short(value)}", key) from None
    if array.ndim != 2 or array.shape[1] != 2 or len(array) < 3:
        raise PlanError(f"expected at least 3 vertices [x, y], found an array of shape {array.shape}", key)
    if not (array.min() >= -LARGEST_COORDINATE_M and array.max() <= LARGEST_COORDINATE_M):
        row = int(np.flatnonzero(~(np.abs(array) <= LARGEST_COORDINATE_M).all(axis=1))[0])
        raise PlanError(
            f"expected finite metres, {LARGEST_COORDINATE_M:g} from the origin at most, found {array[row].tolist()}",
            f"{key}[{row}]",
        )
    if len(array) > MAX_VERTICES:
        raise PlanError(f"expected at most {MAX_VERTICES} vertices, found {len(array)}; simplify the ring", key)
    if array[0, 0] == array[-1, 0] and array[0, 1] == array[-1, 1]:
        raise PlanError("expected an unclosed ring, found the first vertex repeated at the end; leave it out", key)
    array.flags.writeable = False
    return array


def check_rings(value: Iterable[object], key: str) -> tuple[npt.NDArray[np.float64], ...]:
    """Return several rings, each checked as ``check_ring`` does."""
    return tuple(check_ring(item, f"{key}[{i}]") for i, item in enumerate(value))


def check_count(value: object, key: str) -> int:
    """Return an integer >= 0 that fits 32 bits."""
    if type(value) is int and 0 <= value <= _MAX:
        return value  # a fast path for the common case: asking for an abstract class takes ten times as long
    if isinstance(value, bool) or not isinstance(value, Integral) or not 0 <= int(value) <= _MAX:
        raise PlanError(f"expected an integer from 0 to {_MAX}, found {_short(value)}", key)
    return int(value)


def to_finite_float(value: object, key: str) -> float:
    """Return any real number as a finite float."""
    if type(value) is float and math.isfinite(value):
        return value
    if isinstance(value, bool) or not isinstance(value, Real) or not math.isfinite(value):
        raise PlanError(f"expected a finite number, found {_short(value)}", key)
    return float(value)


def check_share(value: object, key: str) -> float:
    """Return a float from 0 to 1."""
    found = to_finite_float(value, key)
    if not 0 <= found <= 1:
        raise PlanError(f"expected 0 to 1, found {found:g}", key)
    return found


def check_numbers(value: Any, length: int, key: str) -> tuple[float, ...]:
    """Return ``length`` finite floats."""
    try:
        found = tuple(value)
    except TypeError:
        found = ()
    if len(found) == length and set(map(type, found)) == _FLOAT and all(map(math.isfinite, found)):
        return found  # a fast path for the common case
    if len(found) != length:
        raise PlanError(f"expected {length} numbers, found {_short(value)}", key)
    return tuple(to_finite_float(item, f"{key}[{i}]") for i, item in enumerate(found))


def check_boxes(
    category: Mapping[str, Iterable[Any]], key: str
) -> dict[str, tuple[tuple[float, float, float, float], ...]]:
    """Return the boxes (x1, y1, x2, y2) of each label, all finite; labels keep their order."""
    return {
        label: tuple(check_numbers(box, 4, f"{key}.{label}[{i}]") for i, box in enumerate(found))  # type: ignore[misc]
        for label, found in category.items()
    }


def check_text(value: object, key: str) -> str:
    """Return a string that is not blank."""
    if not isinstance(value, str) or not value.strip():
        raise PlanError(f"expected a name, found {_short(value)}", key)
    return value


def check_word(value: object, allowed: Iterable[str], key: str) -> None:
    """Raise PlanError if a word is not among those allowed."""
    words = tuple(allowed)
    if value not in words:
        raise PlanError(f"expected one of {', '.join(words)}; found {_short(value)}", key)


def check_unique(ids: Iterable[int], key: str) -> None:
    """Raise PlanError if an id occurs twice."""
    seen: set[int] = set()
    for i, item in enumerate(ids):
        if item in seen:
            raise PlanError(f"expected ids that differ, found {item} twice", f"{key}[{i}].id")
        seen.add(item)


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
