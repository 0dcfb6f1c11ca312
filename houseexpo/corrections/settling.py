"""Join what words have parted, and take out what they make needless (R7 of ``apply``)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
import shapely
from shapely import Polygon

from houseexpo.corrections.draft import Draft, DraftDoor, DraftRoom
from houseexpo.corrections.openings import (
    SNAP_M,
    STEP_M,
    WALL_REACH_M,
    Strip,
    edges_of,
    faces_beside,
)
from houseexpo.corrections.passages import clear_part, fit_to_wall

CUT_M: Final = 0.8
"""The width of a cut: ``pipeline.config.ConnectivityConfig.cut_width_m``."""

_SAME_M: Final = 1e-6
"""Walls whose thickness differs by less are equally thin, metres."""


def settle(draft: Draft) -> Iterator[str]:
    """Join what words have parted, and take out the cuts that a person's door makes needless; yield what was done."""
    while len(groups := draft.pieces()) > 1:
        found = _thinnest_wall(draft, groups[-1], groups[:-1])
        names = " and ".join(draft.name(room) for room in groups[-1][:3])
        if found is None:
            for room in groups[-1]:
                draft.remove_room(room)
            yield f"nothing leads into {names} any more, and no wall near is thin enough for a cut: left out"
            continue
        strip, (one, other) = found
        area = clear_part(strip.polygon(deeper_m=STEP_M), (room.shape for room in draft.rooms), strip.centre)
        draft.doors.append(DraftDoor("cut", area, strip.ends, (one, other), None))
        yield (
            f"nothing else led into {names}: a cut of {strip.length:.2f} m joins {draft.name(one)} and "
            f"{draft.name(other)}; if the way is elsewhere, draw the door"
        )
    yield from _without_needless_cuts(draft)


def _without_needless_cuts(draft: Draft) -> Iterator[str]:
    for cut in [door for door in draft.doors if door.kind == "cut" and door.before is not None]:
        if not _was_needed(draft, cut):
            continue
        without = [door for door in draft.doors if door is not cut]
        kept, draft.doors = draft.doors, without
        if len(draft.pieces()) > 1:
            draft.doors = kept
        else:
            one, other = cut.rooms
            assert other is not None  # noqa: S101  # a cut joins two rooms
            yield f"the cut between {draft.name(one)} and {draft.name(other)} is not needed any more, and gone"


def _was_needed(draft: Draft, cut: DraftDoor) -> bool:
    """Return whether nothing but a cut joined two parts of the plan as it was."""
    before = Draft(draft.plan)
    before.doors = [door for door in before.doors if door.before is not cut.before]
    return len(before.pieces()) > 1


def _thinnest_wall(
    draft: Draft, part: Sequence[DraftRoom], others: Sequence[Sequence[DraftRoom]]
) -> tuple[Strip, tuple[DraftRoom, DraftRoom]] | None:
    """Return where the thinnest wall between some rooms and the others takes a cut, clear of other passages.

    A wall is no thinner than the way from its line to the nearest other room. So lines are tried from the nearest on,
    until none can be thinner; of equally thin walls, the first along the rooms' edges is taken.
    """
    rest = [room for group in others for room in group]
    shapes = [room.shape for room in rest]
    taken = shapely.union_all([door.shape for door in draft.doors]) if draft.doors else Polygon()
    lines = [(room, line, side) for room in part for line, side in _lines_along(room.shape)]
    ways = shapely.distance([shapely.LineString(line.ends) for _, line, _ in lines], shapely.union_all(shapes))
    found: list[tuple[int, Strip, tuple[DraftRoom, DraftRoom]]] = []
    thinnest = math.inf
    for k in np.argsort(ways, kind="stable").tolist():
        if ways[k] > min(thinnest, WALL_REACH_M) + _SAME_M:
            break
        room, line, side = lines[k]
        faces = faces_beside(line, [room.shape, *shapes])
        there = faces.shapes[side] - 1
        low, high = faces.clear
        if there < 0 or high - low < CUT_M - 0.02:
            continue
        strip = fit_to_wall(line, faces)
        if strip.depth <= thinnest + _SAME_M and not strip.polygon().intersects(taken):
            found.append((k, strip, (room, rest[there])))
            thinnest = min(thinnest, strip.depth)
    best = min((each for each in found if each[1].depth <= thinnest + _SAME_M), default=None, key=lambda each: each[0])
    return None if best is None else best[1:]


def _lines_along(shape: Polygon) -> Iterator[tuple[Strip, int]]:
    """Yield the lines as wide as a cut, just outside a room along its edges, in steps, and the side away from it."""
    for start, end in zip(*edges_of([shape]), strict=True):
        length = math.dist(start, end)
        if length < CUT_M:
            continue
        along = (end - start) / length
        for at in np.arange(CUT_M / 2, length - CUT_M / 2 + 1e-9, SNAP_M).tolist():
            line = Strip(start + along * at, along, CUT_M, 0.0)
            outside = -1 if shape.covers(shapely.Point(line.before(1, 0.02))) else 1
            yield Strip(line.centre + outside * line.across * 0.01, along, CUT_M, 0.0), 0 if outside < 0 else 1
