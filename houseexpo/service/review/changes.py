"""Compute what a review decision changes in a plan's table of ``overrides.toml``, and how that is undone."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from houseexpo.errors import ConfigError
from houseexpo.plan.overrides import LISTS, override_values
from houseexpo.service.review.log import Action, LogLine

_FARTHEST_M: Final = 1e9
"""Coordinates beyond this are errors, metres."""


class DecidedOtherwiseError(ConfigError):
    """Somebody else has decided on the plan in the meantime."""


def list_items(value: Any, key: str) -> list[Any]:
    """Return the value of a key of ``LISTS`` as a list, empty if there is no value."""
    return list(override_values(value, key) or [])


def check_points(table: Mapping[str, Any], place: str) -> None:
    """Raise ConfigError, with ``place`` at the start, if the value of a key of ``LISTS`` is not points."""
    for key, depth in LISTS.items():
        value = table.get(key, [])
        if not isinstance(value, list) or not all(_is_points(item, depth) for item in list_items(value, key)):
            expected = "two points [[x, y], [x, y]]" if depth > 1 else "a point [x, y]"
            raise ConfigError(
                f"{place}: {key}: expected {expected}, or a list of these, found {value!r}; correct the file first"
            )


def _is_points(value: Any, depth: int) -> bool:
    """Return whether a value is two numbers, or two pairs of numbers (depth 2)."""
    if not isinstance(value, list) or len(value) != 2:
        return False
    if depth > 1:
        return all(_is_points(part, depth - 1) for part in value)
    return all(type(number) in {int, float} and abs(number) < _FARTHEST_M for number in value)


def decision_changes(table: Mapping[str, Any], action: Action, value: Any) -> dict[str, tuple[Any, Any]]:
    """Return the changes of a decision in a plan's table: the values before and after, by key."""
    wanted: dict[str, Any]
    if action == "keep":
        wanted = {"drop": None, "keep": True}
    elif action == "drop":
        wanted = {"keep": None, "drop": True, **({"why": value} if value else {})}
    elif action == "note":
        wanted = {"why": value or None}
    else:
        wanted = {action: _plain([*list_items(table.get(action), action), value])}
    return {key: (table.get(key), after) for key, after in wanted.items()}


def _plain(items: list[Any]) -> Any:
    return items[0] if len(items) == 1 else items or None


def undo_value(line: LogLine, key: str, now: Any, before: Any, after: Any) -> tuple[Any, Any]:
    """Return a key's value now and after an undo; raise DecidedOtherwiseError if somebody changed it since the line."""
    if now == after:
        return now, before
    if key in LISTS:
        added = [item for item in list_items(after, key) if item not in list_items(before, key)]
        return now, _plain([item for item in list_items(now, key) if item not in added])
    raise DecidedOtherwiseError(
        f"{line.plan}: somebody changed {key!r} since {describe_log_line(line)}; decide again instead"
    )


def describe_log_line(line: LogLine) -> str:
    """Return a sentence about what somebody did."""
    words = {
        "no_room": "marked an area that is no room",
        "door": "drew a door",
        "note": "wrote a note",
        "undo": "undid a decision",
    }
    return f"{line.reviewer} {words.get(line.action, f'chose {line.action}')}"
