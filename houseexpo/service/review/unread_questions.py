"""Ask about a file that was not understood: a drawing's size if it was guessed, and which of its lines are the walls.

R1  The size is asked about first: a wall is as thick as walls are, whatever the drawing's size. The answer states it,
    so that what is said next keeps its place.
R2  One layer after the other is asked about, the likeliest walls first, until a plan is found; of a plan whose layers
    were guessed, one that draws walls in its rooms. The answer is a word of the file, which is read again with
    these walls.
R3  Of a source without such layers (the section of a mesh, a picture), all lines of a kind are asked about at once;
    the answer says of each that it is a wall.
"""

from __future__ import annotations

import json
import math
from collections.abc import Collection, Iterator, Sequence
from itertools import pairwise
from typing import Any, Final

import numpy as np

from houseexpo.corrections.vocabulary import UNITS_M, Correction
from houseexpo.grids.frame import source_points_from_plan
from houseexpo.service.review.question import Answer, Question
from houseexpo.service.review.source_questions import GUESS
from houseexpo.service.review.sources import SourceView
from houseexpo.tolerances import MIN_DOOR_M
from houseexpo.words import count_noun

LAYER: Final = "layer at "
"""Begins the keys of the questions about layers."""
_MOST_SHOWN: Final = 1000
"""The longest lines of a layer are shown; without layers, these are said to be walls."""
_SIZES_OFFERED: Final = 4
_KINDS: Final = {"section": "The section of the file", "outline": "The outline of the file"}
_Ends = tuple[tuple[float, float], tuple[float, float]]


def unread_questions(
    source: SourceView, left: Collection[str], said: Collection[Correction] = ()
) -> Iterator[Question]:
    """Yield the questions about the source of a house without a plan, without those ``left`` (their keys).

    ``said`` is what is said of the storey.
    """
    x1, y1, x2, y2 = source.pictured
    at = (round((x1 + x2) / 2, 3), round((y1 + y2) / 2, 3))  # the level is shown in its own frame
    record = source.record
    if "units" in source.level.guesses and record.unit_m and "units" in record.takes and GUESS not in left:
        wide, high = source.level.extent
        says = f"The size of this drawing is a guess: {wide:.1f} m x {high:.1f} m. Is that right?"
        right = Answer("Right", "units", text=_name_of(record.unit_m))
        others = (
            Answer(f"{wide * by:.1f} m x {high * by:.1f} m", "units", text=_name_of(unit_m))
            for unit_m in record.other_units_m[:_SIZES_OFFERED]
            for by in (unit_m / record.unit_m,)
        )
        yield Question(GUESS, at, says, (right, *others, Answer("Another", "file")), 1.0)
    yield from layer_questions(source, left, at, said)


def layer_questions(
    source: SourceView, left: Collection[str], at: tuple[float, float], said: Collection[Correction] | None = None
) -> Iterator[Question]:
    """Yield the question whether a layer is the walls, about the next one that is not ``left`` and not said (R2, R3).

    ``said`` is what is said of a house without a plan. Of a house with one (None), only layers that a word of the file
    can name are asked about.
    """
    is_word = "wall_layers" in source.record.takes
    named: list[str] = json.loads(dict(source.record.options).get("wall_layers", "[]"))
    walls_said = {_undirected(each.plain_value) for each in said or () if each.word in {"wall", "no_wall"}}
    for name in source.level.layers if is_word or said is not None else ():
        key, lines = f"{LAYER}{name[:80]}", lines_of_layer(source, name)
        if not lines or key in left or name in named or (not is_word and _are_said(source, lines, walls_said)):
            continue
        first, *more = lines[:_MOST_SHOWN]
        number = count_noun(len(lines) if is_word else 1 + len(more), "line")
        says = f"{_KINDS.get(name, f'“{name}” in the drawing')}: are these {number} walls?"
        text = "\n".join([*named, name]) if is_word else ""
        walls = Answer("Walls", "wall_layers" if is_word else "wall", first, text=text, more=tuple(more))
        yield Question(key, at, says, (walls, Answer("No walls")), 1.0)
        return


def _are_said(source: SourceView, lines: Sequence[_Ends], said: Collection[tuple[Any, ...]]) -> bool:
    """Return whether something is said of one of the lines; ``said`` are lines along the source's plan axes."""
    ends = source_points_from_plan(source.level.frame, np.reshape(lines, (-1, 2))).round(3).reshape(-1, 2, 2)
    return any(_undirected(each) in said for each in ends.tolist())


def lines_of_layer(source: SourceView, name: str) -> list[_Ends]:
    """Return the ends of the straight lines of a layer that can be walls, metres, the longest first."""
    left, low = source.origin
    found = {
        tuple(sorted((a, b))): None
        for each in source.level.strokes
        if each.kind == name
        for a, b in pairwise((round(x - left, 3), round(y - low, 3)) for x, y in each.points)
        if math.dist(a, b) > MIN_DOOR_M + 0.002  # points are rounded
    }
    return sorted(found, key=lambda ends: -math.dist(*ends))  # type: ignore[arg-type]  # two points


def _name_of(unit_m: float) -> str:
    return next((name for name, metres in UNITS_M.items() if math.isclose(metres, unit_m)), f"{unit_m:g}")


def _undirected(ends: Any) -> tuple[Any, ...]:
    """Return what is the same of a line whichever end is first."""
    return tuple(sorted(map(tuple, ends)))
