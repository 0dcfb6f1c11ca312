"""Change keys of one table in a TOML file that a person wrote; everything else, with comments and order, is kept.

R1  An existing key is changed in its place; a comment after it stays.
R2  A list that grows keeps the comments inside it. If a value with comments inside changes in another way, they move to
    lines above it.
R3  A new key follows the last key of its table; a new table is added at the end.
R4  A removed key leaves its comment. A table is removed with its last key, unless it contains a comment.
R5  The result is read again; if it does not have the intended values, an error is raised.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final, NamedTuple

import msgspec

from houseexpo.errors import ConfigError

_TOKENS: Final = re.compile(
    r'"""(?:[^\\]|\\.)*?"""(?!")|\'\'\'.*?\'\'\'(?!\')|"(?:[^"\\\n]|\\.)*"|\'[^\'\n]*\'|#[^\n]*|=', re.DOTALL
)
"""Strings, comments and equals signs; nothing else in a statement can hide one of these."""
_LINE: Final = re.compile(r"[^\n]*\n|[^\n]+")
"""A line in TOML; ``str.splitlines`` also splits at other characters, which may be in a comment."""
_BARE: Final = re.compile(r"[A-Za-z0-9_-]+")
_END: Final = re.compile(r"[ \t]*(?:#[^\n]*)?\s*\Z")


class _Statement(NamedTuple):
    """A part of the file; ``path`` is its full key or the table of a header, () for blank lines and comments."""

    text: str
    path: tuple[str, ...] = ()
    is_header: bool = False
    value: Any = None

    @property
    def is_value(self) -> bool:
        return bool(self.path) and not self.is_header


def edit_table(text: str, table: str, changes: Mapping[str, Any]) -> str:
    """Return the text of a TOML file with keys of a table changed.

    Parameters
    ----------
    changes
        New values by key: booleans, numbers, texts and lists of these; None removes a key.

    Raises
    ------
    ConfigError
        The text is not TOML, or it is written in a way that cannot be changed here (R5).
    """
    wanted = _read(text)
    if not isinstance(wanted.get(table, {}), dict):
        raise ConfigError(f"{table}: expected a table, found {wanted[table]!r}; write it as [{table}]")
    newline = "\r\n" if "\r\n" in text else "\n"
    statements = list(_statements(text))
    for key, value in changes.items():
        if value is not None:
            wanted.setdefault(table, {})[key] = value
            _set(statements, table, key, value, newline)
        elif key in wanted.get(table, {}):
            del wanted[table][key]
            _remove(statements, table, key, newline)
    found = "".join(statement.text for statement in statements)
    if _without_empty(_read(found)) != _without_empty(wanted):
        raise ConfigError(f"table [{table}] is written in a way that cannot be changed here; write it as [{table}]")
    return found


def _read(text: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"expected TOML, found {error}") from None


def _without_empty(tables: Mapping[str, Any]) -> dict[str, Any]:
    return {name: table for name, table in tables.items() if table != {}}


def _statements(text: str) -> Iterator[_Statement]:
    """Split a TOML file into statements; a statement ends with the first line with which it can be parsed."""
    waiting = ""
    header: tuple[str, ...] = ()
    for line in _LINE.findall(text):
        waiting += line
        try:
            found = tomllib.loads(waiting)
        except tomllib.TOMLDecodeError:  # a list or a text that continues
            continue
        statement = _Statement(waiting)
        if waiting.lstrip().startswith("["):
            header = _path(found)
            statement = _Statement(waiting, header, is_header=True)
        elif found:
            key = _parts(waiting)[0]
            path = _path(tomllib.loads(f"{key} 0"))
            value = found
            for name in path:
                value = value[name]
            statement = _Statement(waiting, (*header, *path), value=value)
        yield statement
        waiting = ""
    if waiting:
        yield _Statement(waiting)


def _path(tables: Any) -> tuple[str, ...]:
    """Return the names that lead to the innermost of nested tables with one entry each."""
    path = []
    while tables and isinstance(tables, dict | list):
        if isinstance(tables, list):
            tables = tables[-1]
            continue
        name = next(iter(tables))
        path.append(name)
        tables = tables[name]
    return tuple(path)


def _parts(text: str) -> tuple[str, str, str]:
    """Split ``key = value  # why`` into the key with its equals sign, the value, and the rest with its spaces."""
    tokens = [token for token in _TOKENS.finditer(text) if token[0][0] in "=#"]
    start = next(token.end() for token in tokens if token[0] == "=")
    last = tokens[-1]
    end = last.start() if last[0][0] == "#" and _END.match(text, last.start()) else len(text)
    body = text[start:end].strip()
    return text[:start], body, text[start + text[start:end].index(body) + len(body) :]


def _comments(text: str) -> list[str]:
    return [token[0].rstrip() for token in _TOKENS.finditer(text) if token[0][0] == "#"]


def _set(statements: list[_Statement], table: str, key: str, value: Any, newline: str) -> None:
    places = {statement.path: i for i, statement in enumerate(statements) if statement.is_value}
    if (here := places.get((table, key))) is not None:  # R1
        statements[here] = _with_value(statements[here], value, newline)
    elif (whole := places.get((table,))) is not None:  # an inline table
        statements[whole] = _with_value(statements[whole], {**statements[whole].value, key: value}, newline)
    elif (last := _last_of(statements, table)) is not None:  # R3
        dotted = "" if _has_header(statements, table) else f"{_key(table)}."
        statements[last] = _end_line(statements[last], newline)
        line = f"{dotted}{_key(key)} = {_text(value)}{newline}"
        statements.insert(last + 1, _Statement(line, (table, key), value=value))
    else:
        if statements:
            statements[-1] = _end_line(statements[-1], newline)
            statements.append(_Statement(newline))
        statements.append(_Statement(f"[{_key(table)}]{newline}", (table,), is_header=True))
        statements.append(_Statement(f"{_key(key)} = {_text(value)}{newline}", (table, key), value=value))


def _remove(statements: list[_Statement], table: str, key: str, newline: str) -> None:
    for i, statement in enumerate(statements):
        if statement.is_value and statement.path == (table,):
            rest = {name: value for name, value in statement.value.items() if name != key}
            statements[i] = _with_value(statement, rest, newline)
            return
        if statement.is_value and statement.path == (table, key):
            left = _comments(statement.text)  # R4
            statements[i : i + 1] = [_Statement(comment + newline) for comment in left]
            break
    head = next((i for i, found in enumerate(statements) if found.is_header and found.path == (table,)), None)
    if head is None:
        return
    end = next((i for i in range(head + 1, len(statements)) if statements[i].is_header), len(statements))
    body = "".join(statement.text for statement in statements[head:end])
    if not any(statement.is_value for statement in statements[head + 1 : end]) and not _comments(body):
        blank = head > 0 and not statements[head - 1].text.strip()
        del statements[head - blank : end if not blank or end == len(statements) else head + 1]


def _has_header(statements: Sequence[_Statement], table: str) -> bool:
    return any(statement.is_header and statement.path == (table,) for statement in statements)


def _last_of(statements: Sequence[_Statement], table: str) -> int | None:
    """Return the place of the table's last key or else of its header, None if there is no such table."""
    own = [i for i, found in enumerate(statements) if found.path[:1] == (table,) and len(found.path) <= 2]
    return max(own, default=None)


def _end_line(statement: _Statement, newline: str) -> _Statement:
    return statement if statement.text.endswith("\n") else statement._replace(text=statement.text + newline)


def _with_value(statement: _Statement, value: Any, newline: str) -> _Statement:
    head, body, tail = _parts(statement.text)
    inner = _comments(body)
    if not inner:
        return statement._replace(text=f"{head} {_text(value)}{tail}", value=value)
    if isinstance(value, list) and value:
        added, old = _text(value[-1]), body[:-1]
        grown = (f"{old}  {added}{newline}]", f"{old}, {added}{newline}]", f"[{body}, {added}]")
        for candidate in grown:  # R2: behind a comma, without one, and a single value that becomes a list
            if _value_of(candidate) == value:
                return statement._replace(text=f"{head} {candidate}{tail}", value=value)
    above = "".join(comment + newline for comment in inner)
    return statement._replace(text=f"{above}{head} {_text(value)}{tail}", value=value)


def _value_of(text: str) -> Any:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return None


def _key(name: str) -> str:
    return name if _BARE.fullmatch(name) else _text(name)


def _text(value: Any) -> str:
    """Return a value as TOML writes it."""
    if isinstance(value, str):
        return msgspec.json.encode(value).decode().replace("\x7f", "\\u007f")
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Mapping):
        inside = ", ".join(f"{_key(key)} = {_text(part)}" for key, part in value.items())
        return f"{{ {inside} }}" if inside else "{}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_text, value))}]"
    return repr(value)
