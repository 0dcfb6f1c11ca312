"""Compute the changes of a review decision in a plan's table of ``overrides.toml``, and of its undo."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from houseexpo.corrections.decision_log import Action, LogLine
from houseexpo.corrections.vocabulary import WORDS, Word, checked_values, word_values
from houseexpo.errors import ConfigError


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


def words_added(table: Mapping[str, Any], said: Iterable[tuple[Word, Any]]) -> dict[str, Any]:
    """Return the values of words in a plan's table with further ones, by word."""
    found: dict[Word, list[Any]] = {}
    for word, value in said:
        items = found.setdefault(word, list_items(table.get(word), word))
        found[word] = items if value in items else [*items, value]
    return {word: _plain(items) for word, items in found.items()}


def words_removed(table: Mapping[str, Any], gone: Iterable[tuple[Word, Any]]) -> dict[str, Any]:
    """Return a plan's table without some values of words."""
    found = dict(table)
    for word, value in gone:
        if left := [each for each in list_items(found.pop(word, None), word) if each != value]:
            found[word] = _plain(left)
    return found


def decision_changes(
    table: Mapping[str, Any],
    action: Action,
    value: Any,
    more: Sequence[Any] = (),
    then: Sequence[tuple[Word, Any]] = (),
    *,
    gone: Sequence[tuple[Word, Any]] = (),
) -> dict[str, tuple[Any, Any]]:
    """Return the changes of a decision in a plan's table: the values before and after, by key.

    ``more`` are further values of the same word, ``then`` are other words, and ``gone`` are earlier ones that it takes
    out. The value is None if it does nothing else.
    """
    wanted: dict[str, Any]
    if action == "keep":
        wanted = {"drop": None, "keep": True}
    elif action == "drop":
        wanted = {"keep": None, "drop": True, **({"why": value} if value else {})}
    elif action == "note":
        wanted = {"why": value or None}
    elif action == "leave":
        wanted = {}
    else:
        word: Word = action  # type: ignore[assignment]  # all others are words
        left = words_removed(table, gone)
        added = words_added(left, [*((word, each) for each in (value, *more) if each is not None), *then])
        wanted = {**{word: left.get(word) for word, _ in gone}, **added}
    return {key: (table.get(key), after) for key, after in wanted.items()}


def _plain(items: list[Any]) -> Any:
    return items[0] if len(items) == 1 else items or None


def replacement(table: Mapping[str, Any], word: Word, old: Any, new: Any) -> dict[str, tuple[Any, Any]]:
    """Return the changes that replace one value of a word, or remove it if ``new`` is None.

    Raises
    ------
    DecidedOtherwiseError
        The table does not contain ``old``.
    """
    before = table.get(word)
    items = list_items(before, word)
    if old not in items:
        raise DecidedOtherwiseError(f"{word} {old}: nobody says this any more; look again before you decide")
    place = items.index(old)
    return {word: (before, _plain([*items[:place], *([] if new is None else [new]), *items[place + 1 :]]))}


def changed_value(line: LogLine, key: str, now: Any, start: Any, end: Any) -> tuple[Any, Any]:
    """Return a key's value now, and after the step from ``start`` to ``end`` that undoes or repeats a line.

    Values of words that others have added since then stay.

    Raises
    ------
    DecidedOtherwiseError
        Somebody has changed the value since then, and the key is not a word.
    """
    if now == start:
        return now, end
    word = next((word for word in WORDS if word == key), None)
    if word is None:
        raise DecidedOtherwiseError(
            f"{line.plan}: somebody changed {key!r} since {describe_log_line(line)}; decide again instead"
        )
    before, after, there = (list_items(value, word) for value in (start, end, now))
    kept = [item for item in there if item in after or item not in before]
    return now, _plain([*kept, *(item for item in after if item not in before and item not in kept)])


def describe_log_line(line: LogLine) -> str:
    """Return a sentence about what somebody did."""
    words = {str(word): f"said {word}" for word in WORDS}
    words |= {
        "note": "wrote a note",
        "leave": "left a question",
        "file": "said something of the file",
        "undo": "undid a decision",
        "move": "moved a correction",
        "remove": "took out a correction",
    }
    if line.answer:
        return f"{line.reviewer} answered “{line.answer}”"
    return f"{line.reviewer} {words.get(line.action, f'chose {line.action}')}"
