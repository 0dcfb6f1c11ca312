"""Ask about a drawing of which no plan came: its size if it was guessed, and which of its layers are the walls.

R1  The size is asked about first: a wall is as thick as walls are, whatever the drawing's size. The answer states it,
    so that what is said next keeps its place.
R2  One layer after the other is asked about, the likeliest walls first, until a plan is found. All lines of a layer are
    said to be walls at once.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator
from itertools import pairwise
from typing import Any, Final

from houseexpo.corrections import Correction
from houseexpo.corrections.vocabulary import UNITS_M
from houseexpo.grids.frame import source_points_from_plan
from houseexpo.service.review.question import Answer, Question
from houseexpo.service.review.source_questions import GUESS
from houseexpo.service.review.sources import SourceView
from houseexpo.tolerances import MIN_DOOR_M

MOST_LINES: Final = 1000
"""Lines that one decision says to be walls."""
_MOST_SIZES: Final = 4
_Ends = tuple[tuple[float, float], tuple[float, float]]


def unread_questions(source: SourceView, left: Collection[str], said: Iterable[Correction]) -> Iterator[Question]:
    """Yield the questions about the source of a house without a plan.

    ``left`` are the keys of answered or skipped questions, ``said`` the words of the storey.
    """
    x1, y1, x2, y2 = source.pictured
    at, record = (round((x1 + x2) / 2, 3), round((y1 + y2) / 2, 3)), source.record
    if "units" in source.level.guesses and record.unit_m and "units" in record.takes and GUESS not in left:
        wide, high = source.level.extent
        says = f"The size of this drawing is a guess: {wide:.1f} m x {high:.1f} m. Is that right?"
        right = Answer("Right", "units", text=_name_of(record.unit_m))
        others = (
            Answer(f"{wide * by:.1f} m x {high * by:.1f} m", "units", text=_name_of(unit_m))
            for unit_m in record.other_units_m[:_MOST_SIZES]
            for by in (unit_m / record.unit_m,)
        )
        yield Question(GUESS, at, says, (right, *others, Answer("Another", "file")), 1.0)
    known = {_key(each.plain_value) for each in said if each.word == "wall"}
    for name in source.level.layers:
        key, lines = f"layer at {name[:80]}", lines_of_layer(source, name)
        if not lines or key in left:
            continue
        if _key(source_points_from_plan(source.level.frame, lines[0]).round(3).tolist()) in known:
            continue
        count = f"{len(lines):,} lines" if len(lines) <= MOST_LINES else f"{MOST_LINES:,} longest lines"
        says = f"“{name}” in the drawing: are these {count} walls?"
        first, *more = lines[:MOST_LINES]
        yield Question(key, at, says, (Answer("Walls", "wall", first, more=tuple(more)), Answer("No walls")), 1.0)
        return


def lines_of_layer(source: SourceView, name: str) -> list[_Ends]:
    """Return the ends of the straight lines of a layer that can be walls, metres, the longest first."""
    found = {
        tuple(sorted((a, b))): None
        for each in source.level.strokes
        if each.kind == name
        for a, b in pairwise((round(x, 3), round(y, 3)) for x, y in each.points)
        if math.dist(a, b) > MIN_DOOR_M + 0.002  # points are rounded
    }
    return sorted(found, key=lambda ends: -math.dist(*ends))  # type: ignore[arg-type]  # two points


def _name_of(unit_m: float) -> str:
    return next((name for name, metres in UNITS_M.items() if math.isclose(metres, unit_m)), f"{unit_m:g}")


def _key(value: Any) -> tuple[Any, ...]:
    """Return what is the same of a line whichever end is first."""
    return tuple(sorted(map(tuple, value)))
