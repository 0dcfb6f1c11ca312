"""Name the file and the list keys of manual corrections (``overrides.toml``), which builds read and reviews write."""

from __future__ import annotations

from typing import Any, Final

NAME: Final = "overrides.toml"
LOG: Final = "overrides.log.jsonl"
"""The log of a review, beside the file with its decisions."""
LISTS: Final = {"door": 2, "no_room": 1}
"""Keys with several values, and the list depth of one value: 2 for two points, 1 for a point [x, y]."""


def override_values(value: Any, key: str) -> Any:
    """Return the values of a key of ``LISTS`` as a list; the file may give a single value without the outer list.

    Other values are returned unchanged.
    """
    inner = value
    for _ in range(LISTS[key]):
        inner = inner[0] if isinstance(inner, list) and inner else None
    return [value] if inner is not None and not isinstance(inner, list) else value
