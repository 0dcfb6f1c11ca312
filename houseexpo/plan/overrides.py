"""``overrides.toml``, corrections by hand: what the build that reads it and the review that writes it share."""

from __future__ import annotations

from typing import Any, Final

NAME: Final = "overrides.toml"
LOG: Final = "overrides.log.jsonl"
"""The log of a review, beside the file that its decisions go to."""
MIN_DOOR_M: Final = 0.3
"""The least distance between the jambs of a door that a person gives."""
LISTS: Final = {"door": 2, "no_room": 1}
"""Keys that hold several values, and how many lists deep one of these is: two points, or one point [x, y]."""


def as_list(value: Any, key: str) -> Any:
    """Return what a key of ``LISTS`` holds as a list: one value may stand in the file without a list round it.

    Anything else is returned as it is.
    """
    inner = value
    for _ in range(LISTS[key]):
        inner = inner[0] if isinstance(inner, list) and inner else None
    return [value] if inner is not None and not isinstance(inner, list) else value
