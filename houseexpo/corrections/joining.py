"""Cut passages into parts that corrections have separated, and remove cuts that corrections make needless.

J1  If words have separated a part and nothing leads into it, a cut joins it to the rest: at the widest place where the
    source's walls leave a gap, or else through the thinnest wall. A robot can then reach it, and a person sees where
    the program guesses.
J2  A part with an entrance needs no cut. Neither is a cut made into a part from which a person has removed a passage,
    nor into a part without a passage in the given plan: a cut in another wall would contradict the person.
J3  A cut between two parts is removed if another passage joins them now, or if a person states an entrance of the
    smaller part.
J4  A part that no inner passage joins to the others keeps its rooms; ``Draft.made`` joins its outline to theirs.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import Final

import numpy as np
import shapely
from shapely import Polygon

from houseexpo.corrections.draft import Draft, DraftDoor, DraftRoom, NoEffectError
from houseexpo.corrections.openings import SNAP_M, STEP_M, WALL_REACH_M, Strip, edges_of, faces_beside
from houseexpo.corrections.passages import WIDEST_DOOR_M, clear_part, fit_to_wall

CUT_M: Final = 0.8
"""The width of a cut: ``pipeline.config.ConnectivityConfig.cut_width_m``."""

_OPEN: Final = 0.8
"""The least share of a cut that a gap takes: walls of meshes reach into it by some centimetres."""
_RECTANGLE: Final = 5
"""The number of points of a rectangle's ring."""
_OUT_M: Final = 0.01
"""A line that is tried lies this far outside a room, metres."""
_SAME_M: Final = 1e-6
"""Walls whose thickness differs by less are equally thin, metres."""


def settle(draft: Draft) -> Iterator[str]:
    """Join separated parts (J1, J2) and remove needless cuts (J3); yield a sentence about each change."""
    before = [shapely.union_all([room.shape for room in part]) for part in Draft(draft.plan).pieces()]
    closed: set[int] = set()
    while True:
        parts = draft.pieces()
        lone = [part for part in _parts_without_entrance(draft, parts) if id(part[0]) not in closed]
        if not lone:
            break
        part = lone[-1]
        rest = [room for other in parts if other is not part for room in other]
        names = draft.names(part)
        is_denied = _is_denied(draft, part, before)
        gap = None if is_denied else _widest_gap(draft, part, rest)
        found = None if is_denied else gap or _thinnest_wall(draft, part, rest)
        if found is None:
            closed.add(id(part[0]))
            continue
        strip, (one, other) = found
        area = clear_part(strip.polygon(deeper_m=STEP_M), (room.shape for room in draft.rooms), strip.centre)
        draft.doors.append(DraftDoor("cut", area, strip.ends, (one, other), None))
        where = "" if gap is None else " where the walls leave a gap"
        yield (
            f"nothing else led into {names}: a cut of {strip.length:.2f} m joins {draft.name(one)} and "
            f"{draft.name(other)}{where}; if the way is elsewhere, draw the door"
        )
    yield from _without_needless_cuts(draft)
    yield from _apart(draft, before)


def _parts_without_entrance(draft: Draft, parts: Sequence[list[DraftRoom]]) -> list[list[DraftRoom]]:
    """Return the parts without an entrance, but not the largest part if no part has an entrance."""
    entered = {id(door.rooms[0]) for door in draft.doors if door.rooms[1] is None}
    lone = [part for part in parts if not any(id(room) in entered for room in part)]
    return lone[1:] if len(lone) == len(parts) else lone


def _is_denied(draft: Draft, part: Sequence[DraftRoom], before: Sequence[shapely.Geometry]) -> bool:
    """Return whether a person removed a passage of a part, or no passage led into it in the given plan (J2)."""
    shape = shapely.union_all([room.shape for room in part])
    if any(gone.distance(shape) < STEP_M for gone in draft.denied):
        return True
    was = [k for k, other in enumerate(before) if other.intersects(shape)]
    return bool(was) and 0 not in was


def _apart(draft: Draft, before: Sequence[shapely.Geometry]) -> Iterator[str]:
    """Yield a sentence about each part that has lost its last passage from inside."""
    parts = draft.pieces()
    lone = {id(part[0]) for part in _parts_without_entrance(draft, parts)}
    for part in parts[1:]:
        shape = shapely.union_all([room.shape for room in part])
        if not any(other.intersects(shape) for other in before[1:]):
            how = "nothing leads into" if id(part[0]) in lone else "only from outside does a way lead into"
            yield f"{how} {draft.names(part)} now; if there is a way inside, draw the door"


def _without_needless_cuts(draft: Draft) -> Iterator[str]:
    """J3."""
    for cut in [door for door in draft.doors if door.kind == "cut" and door.before is not None]:
        if not _was_needed(draft, cut):
            continue
        count, kept = len(draft.pieces()), draft.doors
        draft.doors = [door for door in kept if door is not cut]
        parts = draft.pieces()
        if len(parts) > count and not _is_entered_instead(draft, cut, parts):
            draft.doors = kept
            continue
        one, other = cut.rooms
        assert other is not None  # noqa: S101  # a cut joins two rooms
        yield f"the cut between {draft.name(one)} and {draft.name(other)} is not needed any more, and gone"


def _is_entered_instead(draft: Draft, cut: DraftDoor, parts: Sequence[list[DraftRoom]]) -> bool:
    """Return whether a person has stated an entrance of the smaller of the two parts that a cut joined."""
    smaller = next(part for part in reversed(parts) if any(room is side for room in part for side in cut.rooms))
    return any(
        door.said and door.rooms[1] is None and any(door.rooms[0] is room for room in smaller) for door in draft.doors
    )


def _was_needed(draft: Draft, cut: DraftDoor) -> bool:
    """Return whether a cut was the only passage between two parts of the original plan."""
    before = Draft(draft.plan)
    count = len(before.pieces())
    before.doors = [door for door in before.doors if door.before is not cut.before]
    return len(before.pieces()) > count


_Cut = tuple[Strip, tuple[DraftRoom, DraftRoom]]


def _widest_gap(draft: Draft, part: Sequence[DraftRoom], rest: Sequence[DraftRoom]) -> _Cut | None:
    """Return the cut between two groups of rooms at the widest gap of the source's walls, or None."""
    if draft.source_walls is None:
        return None
    near = shapely.buffer(shapely.union_all([room.shape for room in part]), WALL_REACH_M)
    standing, walls = (
        shapely.union_all([shape for shape in shapes if near.intersects(shape)])
        for shapes in (draft.standing, draft.source_walls)
    )
    gaps = shapely.difference(standing, walls).buffer(-_OUT_M).buffer(_OUT_M, join_style="mitre")  # no slivers
    taken = shapely.union_all([door.shape for door in draft.doors])
    rooms = [*part, *rest]
    shapes = [room.shape for room in rooms]
    found: list[_Cut] = []
    for gap in shapely.get_parts(gaps).tolist():
        corners = shapely.get_coordinates(shapely.minimum_rotated_rectangle(gap))
        for a, b in itertools.pairwise(corners[:3]) if len(corners) == _RECTANGLE else ():
            line = Strip(corners[:4].mean(axis=0), (b - a) / math.dist(a, b), math.dist(a, b), 0.0)
            faces = faces_beside(line, shapes)
            if min(faces.shapes) < 0 or len({k < len(part) for k in faces.shapes}) == 1:
                continue
            with suppress(NoEffectError):
                strip = fit_to_wall(line, faces)
                area = strip.polygon()
                is_open = shapely.intersection(area, gap).area >= _OPEN * area.area
                if is_open and strip.length <= WIDEST_DOOR_M and not area.intersects(taken):
                    found.append((strip, (rooms[faces.shapes[0]], rooms[faces.shapes[1]])))
    return max(found, key=lambda each: each[0].length, default=None)


def _thinnest_wall(draft: Draft, part: Sequence[DraftRoom], rest: Sequence[DraftRoom]) -> _Cut | None:
    """Return the cut through the thinnest wall between ``part`` and ``rest`` that is clear of other passages, or None.

    A wall is at least as thick as its line's distances to both rooms. So lines are tried by this distance, until no
    wall can be thinner. Of equally thin walls, the first along the rooms' edges is taken.
    """
    shapes = [room.shape for room in rest]
    taken = shapely.union_all([door.shape for door in draft.doors]) if draft.doors else Polygon()
    lines = [(room, line, side) for room in part for line, side in _lines_along(room.shape)]
    ways = shapely.distance([shapely.LineString(line.ends) for _, line, _ in lines], shapely.union_all(shapes))
    found: list[tuple[int, Strip, tuple[DraftRoom, DraftRoom]]] = []
    thinnest = math.inf
    for k in np.argsort(np.round(ways / _SAME_M), kind="stable").tolist():
        if ways[k] + _OUT_M >= thinnest - _SAME_M or ways[k] > WALL_REACH_M:
            break  # an equally thin wall comes later along the edges
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
    """Yield lines of a cut's width just outside a room, in steps along its edges, and the index of the outer side."""
    for start, end in zip(*edges_of([shape]), strict=True):
        length = math.dist(start, end)
        if length < CUT_M:
            continue
        along = (end - start) / length
        for at in np.arange(CUT_M / 2, length - CUT_M / 2 + 1e-9, SNAP_M).tolist():
            line = Strip(start + along * at, along, CUT_M, 0.0)
            outside = -1 if shape.covers(shapely.Point(line.before(1, 0.02))) else 1
            yield Strip(line.centre + outside * line.across * _OUT_M, along, CUT_M, 0.0), 0 if outside < 0 else 1
