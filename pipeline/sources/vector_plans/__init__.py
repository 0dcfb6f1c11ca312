"""Read plans drawn as lines, areas and names, by one module per family of formats, and yield their levels.

Each module of the table has two functions: ``can_read(path, head)``, which tells by a file's name and its first bytes
whether it is of that family, and ``read_drawing(path)``, which reads it as a ``Drawing``: it says what the file draws
as ``Feature`` values, of which ``storey_from_features`` makes storeys. That of a family whose files may hold many plans
also has ``list_plan_names(path)``, and reads one of them by ``read_drawing(path, key)``. One whose unit may be a
guess, or which has names for its parts, says so by ``TAKES``: ``unit_m``, the metres in a unit, ``without`` and
``walls``, patterns of names; they are keywords of ``read_drawing``.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache, partial
from importlib import import_module
from pathlib import Path
from typing import Any, Final, Protocol, cast

import numpy as np
import shapely

from houseexpo.file_kinds import HEAD_BYTES
from houseexpo.grids.frame import plan_points_from_source
from houseexpo.plan import Frame
from pipeline.rejection import Reason, Rejection
from pipeline.sources.files import check_file, id_from_file_name, input_from_file, slug
from pipeline.sources.storeys.scale import said_size
from pipeline.sources.vector_plans.drawing import (
    Drawing,
    Line,
    is_named,
    levels_from_drawing,
    scale_drawing,
    storeys_drawn,
)
from pipeline.values import Input, Level

FAMILIES = (
    "rmf",
    "mjcf",
    "usd",
    "webots",
    "scene_state",
    "dxf",
    "imdf",
    "geojson",
    "svg",
)
_MOST_LINES: Final = 8_000
_FAULTS = (ArithmeticError, LookupError, RecursionError, TypeError, ValueError, shapely.errors.ShapelyError)
"""What numbers beyond all measure, and shapes that cross themselves, lead geometry to."""


class PlanFormat(Protocol):
    """What each module of ``pipeline.sources.vector_plans`` offers as functions of these names."""

    def can_read(self, path: Path, head: bytes) -> bool:
        """Return whether a file is of this family, by its name and its first bytes."""
        ...

    def read_drawing(self, path: Path) -> Drawing:
        """Read a file; raise Rejection if it cannot be read."""
        ...


def is_vector_plan(path: Path, head: bytes) -> bool:
    """Return whether one of the families knows a file."""
    return _family(path, head) is not None


def find(path: str, **options: str) -> Iterator[Input]:
    """List one file, or the plans in it. An unreadable file is one input, so that its reader says why."""
    single = input_from_file(path, "vector_plans", options)
    with Path(path).open("rb") as stream:
        head = stream.read(HEAD_BYTES)
    found: Any = _family(Path(path), head)
    if not hasattr(found, "list_plan_names"):
        yield single
        return
    try:
        keys = found.list_plan_names(Path(path))
    except Rejection:
        keys = [""]
    for key in keys or [""]:
        yield replace(single, id=id_from_file_name(f"{single.id}_{slug(key)}") if key else single.id, key=key)


def read(item: Input) -> Iterator[Level]:
    """Yield the levels of a file, lowest first; raise Rejection if it cannot be read or holds no plan."""
    path = Path(item.path)
    check_file(path)
    with path.open("rb") as stream:
        head = stream.read(HEAD_BYTES)
    family = _family(path, head)
    if family is None:  # listed, and changed since
        family = cast("PlanFormat", import_module(f"{__name__}.{FAMILIES[0]}"))
    many: Any = family
    try:
        drawing = _read(many, path, item)
        for level in levels_from_drawing(item, drawing, path, dict(item.options).get("file", path.name)):
            yield replace(level, lines=partial(_lines_of_level, item, level.frame, level.unit_m))
    except _FAULTS as error:
        what = " ".join(str(error).split())[:120]
        detail = f"{path.name} has numbers or parts that make no plan: {type(error).__name__}: {what}"
        raise Rejection("source", Reason.UNREADABLE, detail, "correct it, or leave it out") from error


def _read(family: Any, path: Path, item: Input) -> Drawing:
    """Return the drawing, with what a person says of its size and its parts."""
    options = dict(item.options)
    (units, scale), dropped = said_size(options), json.loads(options.get("drop_nodes", "[]"))
    walls = json.loads(options.get("wall_layers", "[]"))
    takes = getattr(family, "TAKES", ())
    said: dict[str, Any] = {"unit_m": units} if units is not None and "unit_m" in takes else {}
    said |= {"without": dropped} if dropped and "without" in takes else {}
    said |= {"walls": walls} if walls and "walls" in takes else {}
    drawing: Drawing = family.read_drawing(path, *([item.key] if item.key else []), **said)
    factor = scale * (1.0 if units is None or "unit_m" in takes else units)
    idle = tuple(
        f"{key} {name!r}: nothing in {path.name} has this name"
        for key, names in (("drop_nodes", dropped), ("wall_layers", walls))
        for name in names
        if not any(is_named(each, [name]) for each in drawing.names)
    )
    return replace(drawing if factor == 1.0 else scale_drawing(drawing, factor), idle=idle)


def drawing_lines(item: Input) -> tuple[list[Sequence[Line]], list[str]]:
    """Return the lines of each storey of a drawing, lowest first, in its unit, and the names of parts to leave out.

    The lines are along the source's plan axes. They are what the reader made ``Feature`` values of. A family may also
    have ``drawn_lines(path, key)``, all lines of a file, whatever they are called: those of a file with named parts
    (``TAKES``) are shown in any case, others where the file gives no level.
    """
    path = Path(item.path)
    with path.open("rb") as stream:
        family: Any = _family(path, stream.read(HEAD_BYTES))
    has_parts = "without" in getattr(family, "TAKES", ())
    if not has_parts and (read := _lines_read(family, path, item)):
        return read, []
    lines: Sequence[Line] = family.drawn_lines(path, item.key) if hasattr(family, "drawn_lines") else []
    return [lines] if lines else [], sorted({name for name, _ in lines}) if has_parts else []


def lines_without(lines: Sequence[Line], dropped: Sequence[str]) -> list[Line]:
    """Return the lines of a drawing without those of parts whose names match a pattern of ``dropped``."""
    return [each for each in lines if not is_named(each[0], dropped)]


def lines_in_level(lines: Sequence[Line], frame: Frame, unit_m: float) -> list[Line]:
    """Return the lines of a drawing in a level's frame; of more than a browser can show, the longest."""
    if len(lines) > _MOST_LINES:
        lines = sorted(lines, key=lambda line: -float(np.ptp(np.asarray(line[1]), axis=0).max()))[:_MOST_LINES]
    moved = [(kind, plan_points_from_source(frame, np.asarray(points) * unit_m)) for kind, points in lines]
    return [(kind, points.round(4)) for kind, points in moved]


def _lines_of_level(item: Input, frame: Frame, unit_m: float) -> list[Line]:
    """Return the lines of a level in its frame."""
    found = drawing_lines(item)[0]
    return lines_in_level(found[frame.level], frame, unit_m) if frame.level < len(found) else []


def _lines_read(family: Any, path: Path, item: Input) -> list[Sequence[Line]]:
    """Return the lines of the storeys that a file gives; none if it cannot be read."""
    try:
        drawing = _read(family, path, item)
        to_file = np.array([1.0, -1.0 if drawing.y_up else 1.0]) / drawing.unit_m
        return [[(name, points * to_file) for name, points in each.lines()] for each in storeys_drawn(drawing)]
    except (Rejection, *_FAULTS):
        return []


def _family(path: Path, head: bytes) -> PlanFormat | None:
    return next((module for module in _modules() if module.can_read(path, head)), None)


@cache
def _modules() -> tuple[PlanFormat, ...]:
    return tuple(cast("PlanFormat", import_module(f"{__name__}.{name}")) for name in FAMILIES)
