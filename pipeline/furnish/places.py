"""Where a piece could stand, by the kind of its place; whether it may is judged elsewhere (``room``)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pipeline.furnish.boxes import FACINGS, STEP_CM, Boxes, Candidates, Edge, back_and_span, boxed
from pipeline.furnish.catalogue import Piece

_Found = tuple[tuple[int, int, int, int], int, float]
"""A box, the way it faces, and how little it is liked."""

_AROUND_CM = 55
"""A chair takes this much of a table's side."""


@dataclass(frozen=True, eq=False)
class Standing:
    """A piece that stands: its box (4,), the way it faces."""

    piece: Piece
    box: npt.NDArray[np.int64]
    facing: int


@dataclass(frozen=True, eq=False)
class Surroundings:
    """A room as a piece finds it: its walls, its bounds (4,), and what stands there already."""

    walls: Sequence[Edge]
    bounds: Boxes
    standing: Sequence[Standing]


def candidates(piece: Piece, width: int, around: Surroundings, rng: np.random.Generator) -> Candidates:
    """Return places for a piece of this width, the one liked best first; none where what it belongs to is missing."""
    anchors = [each for each in around.standing if each.piece.label == piece.by]
    if piece.place == "wall":
        found = _at_walls(piece, width, around.walls, rng)
    elif piece.place == "middle":
        found = _in_the_middle(piece, width, around.bounds, rng)
    elif piece.place == "opposite":
        found = _opposite(piece, width, around.walls, anchors, rng)
    elif piece.place == "beside":
        found = _beside(piece, width, anchors)
    elif piece.place == "before":
        found = _before(piece, width, anchors)
    else:
        found = _around(piece, width, anchors, rng)
    ordered = sorted(found, key=lambda each: each[2])
    boxes = np.array([box for box, _, _ in ordered], dtype=np.int64).reshape(-1, 4)
    return Candidates(boxes, np.array([facing for _, facing, _ in ordered], dtype=np.int64))


def _at_walls(piece: Piece, width: int, walls: Sequence[Edge], rng: np.random.Generator) -> Iterator[_Found]:
    for wall in walls:
        room = wall.high - wall.low - width
        if room < 0:
            continue
        for start in sorted({*range(0, room + 1, STEP_CM), room}):
            chance = float(rng.random())
            if piece.likes == "corner":
                dislike = (0.0 if start in (0, room) else 1.0) + chance
            elif piece.likes == "centre":
                dislike = abs(start - room / 2) / 100 + chance
            else:
                dislike = chance
            yield boxed(wall.facing, wall.at, wall.low + start, width, piece.depth), wall.facing, dislike


def _in_the_middle(piece: Piece, width: int, bounds: Boxes, rng: np.random.Generator) -> Iterator[_Found]:
    x1, y1, x2, y2 = bounds.tolist()
    for facing in (0, 1):
        wide, tall = (piece.depth, width) if facing == 0 else (width, piece.depth)
        for x in range(x1, x2 - wide + 1, 2 * STEP_CM):
            for y in range(y1, y2 - tall + 1, 2 * STEP_CM):
                off = abs(2 * x + wide - x1 - x2) / (x2 - x1) + abs(2 * y + tall - y1 - y2) / (y2 - y1)
                yield (x, y, x + wide, y + tall), facing, off + 0.5 * float(rng.random())


def _opposite(
    piece: Piece, width: int, walls: Sequence[Edge], anchors: Sequence[Standing], rng: np.random.Generator
) -> Iterator[_Found]:
    """At a wall that an anchor looks at, as near to its middle as can be; then at any other."""
    for box, facing, chance in _at_walls(piece, width, walls, rng):
        for anchor in anchors[:1]:
            _, start, end = back_and_span(anchor.box, anchor.facing)
            _, low, high = back_and_span(np.array(box), facing)
            faced = facing == (anchor.facing + 2) % 4
            yield box, facing, abs(start + end - low - high) / 200 + 0.1 * chance + (0.0 if faced else 5.0)


def _beside(piece: Piece, width: int, anchors: Sequence[Standing]) -> Iterator[_Found]:
    for anchor in anchors:
        back, start, end = back_and_span(anchor.box, anchor.facing)
        for begin, dislike in ((start - piece.gap - width, 0.0), (end + piece.gap, 0.5)):
            yield boxed(anchor.facing, back, begin, width, piece.depth), anchor.facing, dislike


def _before(piece: Piece, width: int, anchors: Sequence[Standing]) -> Iterator[_Found]:
    """In front of an anchor's middle, facing it."""
    for anchor in anchors:
        back, start, end = back_and_span(anchor.box, anchor.facing)
        ahead = 1 if anchor.facing < 2 else -1
        depth = abs(int(FACINGS[anchor.facing] @ (anchor.box[2:] - anchor.box[:2])))
        begin = (start + end - width) // 2
        near = back + ahead * (depth + piece.gap)
        yield boxed(anchor.facing, near, begin, width, piece.depth), (anchor.facing + 2) % 4, 0.0


def _around(piece: Piece, width: int, anchors: Sequence[Standing], rng: np.random.Generator) -> Iterator[_Found]:
    """On the sides of a table, looking at it."""
    for anchor in anchors:
        for facing in range(4):
            far, start, end = back_and_span(anchor.box, facing)
            count = max((end - start) // _AROUND_CM, 1)
            outward = -1 if facing < 2 else 1
            for k in range(count):
                middle = start + (2 * k + 1) * (end - start) // (2 * count)
                edge = far + outward * piece.gap
                box = boxed((facing + 2) % 4, edge, middle - width // 2, width, piece.depth)
                yield box, facing, float(rng.random())
