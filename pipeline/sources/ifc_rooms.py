"""A level's rooms from its IfcSpaces.

R1  A room is where its space stands on the floor.
R2  A space less than head high, or named as lying outside, is no room; one without a storey belongs to the level on
    whose floor it stands.
R3  Of two spaces with one footprint the first stays, with the words of both.
R4  A space that others fill (a flat, a storey's gross area) is no room; one that lies within another is cut out of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import shapely
from shapely import Polygon

from pipeline.sources.ifc_file import Part
from pipeline.sources.ifc_shapes import are_one, floor_of
from pipeline.sources.room_names import is_outside_the_count, labels_for
from pipeline.values import SourceRoom

HEAD_M = 1.8
SAME = 0.9  # intersection over union of two spaces that are one
FILLED = 0.8  # share of a space that others cover where it only groups them
WITHIN = 0.95  # share of a space that lies in another where it is cut out of it
OVERLAP_M2 = 0.01


@dataclass(frozen=True, eq=False)
class _Found:
    words: tuple[str, ...]
    shape: Polygon


def is_room(space: Part) -> bool:
    """R2."""
    return space.top - space.bottom >= HEAD_M and not is_outside_the_count(space.words)


def rooms_of(spaces: Sequence[Part]) -> tuple[SourceRoom, ...]:
    """Return the rooms of a level in the order of the file, in project axes."""
    found = [_Found(space.words, floor_of(space.mesh)) for space in spaces if is_room(space)]
    found = _without_overlaps(_without_groups(_without_doubles([each for each in found if not each.shape.is_empty])))
    return tuple(SourceRoom(each.words, labels_for(each.words), each.shape) for each in found)


def _without_doubles(found: list[_Found]) -> list[_Found]:
    """R3."""
    kept: list[_Found] = []
    for each in found:
        at = next((k for k, other in enumerate(kept) if are_one(each.shape, other.shape, SAME)), None)
        if at is None:
            kept.append(each)
        else:
            kept[at] = replace(kept[at], words=tuple(dict.fromkeys((*kept[at].words, *each.words))))
    return kept


def _without_groups(found: list[_Found]) -> list[_Found]:
    """Leave groups out: two rooms or more that lie in a space fill it (R4)."""
    kept = []
    for each in found:
        inner = [o.shape for o in found if o is not each and _is_within(o.shape, each.shape)]
        covered = shapely.union_all(inner).intersection(each.shape).area if len(inner) > 1 else 0.0
        if covered < FILLED * each.shape.area:
            kept.append(each)
    return kept


def _without_overlaps(found: list[_Found]) -> list[_Found]:
    """Cut spaces out of those that they lie within (R4)."""
    kept = []
    for each in found:
        inner = [o.shape for o in found if o is not each and _is_within(o.shape, each.shape)]
        shape = each.shape.difference(shapely.union_all(inner)) if inner else each.shape
        pieces = [piece for piece in shapely.get_parts(shape) if isinstance(piece, Polygon)]
        if pieces:
            kept.append(replace(each, shape=max(pieces, key=lambda piece: piece.area)))
    return kept


def _is_within(small: Polygon, large: Polygon) -> bool:
    if small.area >= large.area:
        return False
    shared = small.intersection(large).area
    return bool(shared > OVERLAP_M2 and shared > WITHIN * small.area)
