"""Compute what a review decision changes in a plan's table of ``overrides.toml``, and how that is undone."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from houseexpo.corrections.vocabulary import WORDS, Word, checked_values, word_values
from houseexpo.errors import ConfigError
from houseexpo.service.review.log import Action, LogLine


class DecidedOtherwiseError(ConfigError):
    """Somebody else has decided on the plan in the meantime."""


def list_items(value: Any, word: Word) -> list[Any]:
    """Return the value of a word as a list, empty if there is no value."""
    return word_values(word, value) if value else []


def check_points(table: Mapping[str, Any], place: str) -> None:
    """Raise ConfigError, with ``place`` at the start, if the value of a word has another form."""
    for word in WORDS:
        try:
            checked_values(word, table.get(word, ()))
        except ConfigError as error:
            raise ConfigError(f"{place}: {error}; correct the file first") from None


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
        word: Word = action  # type: ignore[assignment]  # all others are words
        wanted = {word: _plain([*list_items(table.get(word), word), value])}
    return {key: (table.get(key), after) for key, after in wanted.items()}


def _plain(items: list[Any]) -> Any:
    return items[0] if len(items) == 1 else items or None


def undo_value(line: LogLine, key: str, now: Any, before: Any, after: Any) -> tuple[Any, Any]:
    """Return a key's value now and after an undo; raise DecidedOtherwiseError if somebody changed it since the line."""
    if now == after:
        return now, before
    word = next((word for word in WORDS if word == key), None)
    if word is not None:
        added = [item for item in list_items(after, word) if item not in list_items(before, word)]
        return now, _plain([item for item in list_items(now, word) if item not in added])
    raise DecidedOtherwiseError(
        f"{line.plan}: somebody changed {key!r} since {describe_log_line(line)}; decide again instead"
    )


def describe_log_line(line: LogLine) -> str:
    """Return a sentence about what somebody did."""
    words = {
        "no_room": "marked an area that is no room",
        "no_door": "took out a passage",
        "one_room": "made rooms one",
        "room": "marked a room",
        "label": "named a room",
        "note": "wrote a note",
        "undo": "undid a decision",
        "door": "drew a door",
        "opening": "drew an opening",
        "entrance": "drew an entrance",
        "wall": "drew a wall",
    }
    return f"{line.reviewer} {words.get(line.action, f'chose {line.action}')}"
