"""Read a world of the simulator Stage (``.world``), and return its floor plan: a bitmap's name, size and pose.

Format: Stage's world files: ``name value``, ``name ( ... )``, ``define name base ( ... )``, ``include "file"``, ``#``.

R1  A model inherits the properties of its definition, and the definition those of its base. Its own properties win.
R2  The floor plan is the model with a bitmap that covers the largest area; robots have bitmaps too.
R3  A pixel is free if it is lighter than ``FREE_FROM``, as in Stage, which has no unknown space.
R4  Stage stretches the bounds of the cells that are not free to the model's size; with ``boundary``, these are the
    whole picture. ``pose`` is their middle, with a turn in degrees.
R5  Includes are read from the world's folder only; a missing include is skipped.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from houseexpo.files import real_path

FREE_FROM: Final = 128
LARGEST_WORLD_BYTES: Final = 1 << 20
MOST_INCLUDES: Final = 100
_DEEPEST_BRACKETS: Final = 50
_START: Final = re.compile(rb'^\s*(?:define\s+\w+\s+\w+|include\s+"|resolution\s+[\d.]|\w+\s*\()', re.MULTILINE)
_TOKEN: Final = re.compile(
    r'\s+|#[^\n]*|"(?P<text>[^"\n]*)"|(?P<word>[^\s()\[\]"#]+(?:\[\d+\][^\s()\[\]"#]*)*)|(?P<mark>[()\[\]])'
)


class WorldError(ValueError):
    """A file is not a Stage world, or has no floor plan; the text says why."""


@dataclass(frozen=True)
class FloorModel:
    """A model with a bitmap: the name of its file, its size (x, y) in metres, and its pose (x, y, degrees)."""

    bitmap: str
    size_m: tuple[float, float]
    pose: tuple[float, float, float]
    boundary: bool


@dataclass(frozen=True)
class _Entity:
    """The content of brackets: properties, the last one of each name, and entities, in the file's order."""

    values: dict[str, Any] = field(default_factory=dict)
    inner: list[tuple[str, _Entity]] = field(default_factory=list)
    defined: dict[str, tuple[str, _Entity]] = field(default_factory=dict)


def is_stage_world(head: bytes) -> bool:
    """Return whether the first bytes of a ``.world`` are Stage's; Gazebo's are XML."""
    return not head.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<") and _START.search(head) is not None


def read_floor_model(path: Path) -> FloorModel:
    """Return the floor plan of a world.

    Raises
    ------
    WorldError
        The text is no world of Stage's, is too large, or no model has a bitmap and a size.
    OSError
        The file cannot be read.
    """
    world = _Entity()
    _read_into(world, path, real_path(path.parent), {real_path(path)})
    found = []
    for name, entity in world.inner:
        values = _with_definition(name, entity, world.defined)
        size, pose = _numbers(values.get("size")), _numbers(values.get("pose"))
        bitmap = values.get("bitmap")
        if isinstance(bitmap, str) and len(size) >= 2 and min(size[:2]) > 0:
            x, y, turn = (*pose, 0.0, 0.0, 0.0)[:3] if len(pose) < 4 else (pose[0], pose[1], pose[3])
            found.append(FloorModel(bitmap, (size[0], size[1]), (x, y, turn), bool(values.get("boundary"))))
    if not found:
        raise WorldError(f"{path.name}: expected a model with a bitmap and a size, found none")
    return max(found, key=lambda each: each.size_m[0] * each.size_m[1])  # R2


def _read_into(world: _Entity, path: Path, folder: Path, seen: set[Path]) -> None:
    if path.stat().st_size > LARGEST_WORLD_BYTES:
        raise WorldError(f"{path.name} has {path.stat().st_size:,} bytes, which no world of Stage's has")
    tokens = list(_tokens(path.read_text("utf-8-sig", "replace"), path.name))
    at = 0
    while at < len(tokens):
        kind, said = tokens[at]
        if kind == "word" and said == "include" and at + 1 < len(tokens) and tokens[at + 1][0] == "text":
            other = real_path(path.parent / tokens[at + 1][1])
            if other.is_relative_to(folder) and other.is_file() and other not in seen and len(seen) < MOST_INCLUDES:
                seen.add(other)
                _read_into(world, other, folder, seen)  # R5
            at += 2
        else:
            at = _statement(world, tokens, at, path.name, 0)


def _tokens(text: str, name: str) -> Iterator[tuple[str, str]]:
    at = 0
    while at < len(text):
        found = _TOKEN.match(text, at)
        if found is None:
            line = text.count("\n", 0, at) + 1
            raise WorldError(f"{name}: line {line}: expected a world of Stage's, found {text[at : at + 20]!r}")
        at = found.end()
        if found.lastgroup is not None:
            yield found.lastgroup, found[found.lastgroup]


def _statement(entity: _Entity, tokens: list[tuple[str, str]], at: int, name: str, depth: int) -> int:
    """Read a definition, an entity or a property; return where the next one begins."""

    def token(index: int) -> tuple[str, str]:
        if index >= len(tokens) or depth > _DEEPEST_BRACKETS:
            raise WorldError(f"{name} breaks off, or its brackets are deeper than {_DEEPEST_BRACKETS}")
        return tokens[index]

    kind, word = token(at)
    if kind != "word":
        raise WorldError(f"{name}: expected a name, found {word!r}")
    at += 1
    if word == "define" and token(at)[0] == token(at + 1)[0] == "word":
        made, base = token(at)[1], token(at + 1)[1]
        inner, at = _brackets(tokens, at + 2, name, depth)
        entity.defined[made] = (base, inner)
    elif token(at) == ("mark", "("):
        inner, at = _brackets(tokens, at, name, depth)
        entity.inner.append((word, inner))
    elif token(at) == ("mark", "["):
        end = at
        while token(end) != ("mark", "]"):
            end += 1
        entity.values[word] = [said for _, said in tokens[at + 1 : end]]
        at = end + 1
    elif token(at) != ("mark", ")"):  # a name may stand alone at the end
        kind, said = token(at)
        number = _number(said)
        entity.values[word] = said if kind == "text" or number is None else number
        at += 1
    return at


def _brackets(tokens: list[tuple[str, str]], at: int, name: str, depth: int) -> tuple[_Entity, int]:
    if at >= len(tokens) or tokens[at] != ("mark", "("):
        raise WorldError(f"{name}: expected ( after a definition")
    entity = _Entity()
    at += 1
    while at < len(tokens) and tokens[at] != ("mark", ")"):
        at = _statement(entity, tokens, at, name, depth + 1)
    if at >= len(tokens):
        raise WorldError(f"{name} breaks off within brackets")
    return entity, at + 1


def _with_definition(name: str, entity: _Entity, defined: Mapping[str, tuple[str, _Entity]]) -> dict[str, Any]:
    """Return an entity's properties and those that it inherits from its definition; its own win."""
    values, seen = dict(entity.values), set()
    while name in defined and name not in seen:
        seen.add(name)
        name, base = defined[name]
        values = base.values | values
    return values


def _numbers(value: Any) -> list[float]:
    found = [_number(each) for each in value] if isinstance(value, list) else []
    return [each for each in found if each is not None] if None not in found else []


def _number(said: str) -> float | None:
    try:
        found = float(said)
    except ValueError:
        return None
    return found if math.isfinite(found) else None
