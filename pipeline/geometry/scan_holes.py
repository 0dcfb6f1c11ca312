"""Holes in the walls of a scan, closed: a part of every scan is missing.

R1  A hole is closed where a straight wall ends and another stands before its end, if it is short, or if something
    stands below all along; and where two walls would meet in a corner and something stands below.
R2  A wall that was closed may end before another hole, so that all is done again until nothing is left to close. A
    hole has traces of a wall in it, a passage has none. Of a short hole these may be missing, too: where no ceiling was
    seen, it is closed at the end, before a free end of a wall, but not where that meets a wall that crosses, as walls
    beside a corridor do.
R3  Of a short wall with a door in it, all of the top may be missing. It is closed where in one line between two walls
    two jambs stand with a gap as wide as a door between them, or one that faces the end of a wall in that line. Jambs
    are as thick as walls, which leaves are not; and no wall runs close by, as behind the fronts of two cupboards.
"""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import numpy as np
import numpy.typing as npt

from pipeline.geometry.masks import SHEET, closed, dilated, grown, line, mostly, opened, square, touching
from pipeline.geometry.scan_columns import SPREAD, Bools, Raster

STRAIGHT_M = 1.6
"""A wall along the raster, drawn wider by what noise moves it, holds a line as long as this."""
HOLE_M, LONG_HOLE_M = 1.4, 2.4
"""The longer ones where something stands below all along."""
TURNS = 24
PASSES, FILLING = 6, 2
"""The first passes also fill what is rough."""
ALONGSIDE = 2
RUN_M = 0.3
"""A wall that goes on is at least this long, ..."""
OBLIQUE_RUN_M = 1.2
"""... an oblique one longer, for a short oblique line fits into a wall along the raster too."""
TRACED = 0.2
CROSSING_M = 0.7
"""A wall that crosses is longer than the thickest is thick."""
DOOR_M = (0.55, 1.25)
JAMB_M, WALL_M = 0.075, (0.15, 0.38)
"""From the thinnest wall, as drawn in the raster, to a thick one."""
SHORT_WALL_M = 2.6
CLOSE_BY_M = (0.42, 0.8)
"""From the back of a thick wall to that of a deep cupboard."""
ALONG = 0.5


def without_holes(reaching: Bools, body: Bools, traces: Bools, raster: Raster, *, has_ceiling: bool) -> Bools:
    """Close the holes in what reaches the top of the walls; ``body`` is what stands below, ``traces`` what is faint."""
    untraced = has_ceiling
    for k in range(PASSES):  # R2
        found = _pass(_between_jambs(reaching, body, raster), body, traces, raster)
        if k >= FILLING:
            found = reaching | _holes(found, reaching)
        if (found == reaching).all():
            if untraced:
                break
            untraced, found = True, reaching | _holes(_without_traces(reaching, raster), reaching)
        reaching = found
    return reaching


def _holes(found: Bools, reaching: Bools) -> Bools:
    """What was closed and does not merely lie along a wall: a wavy one would grow with each pass."""
    return touching(found & ~reaching, ~grown(reaching, ALONGSIDE))


def _pass(reaching: Bools, body: Bools, traces: Bools, raster: Raster) -> Bools:
    """R1: each straight run goes on to what stands before its end, and to its corner with another."""
    below = grown(body, 1)
    angles = np.pi * np.arange(TURNS) / TURNS
    runs = _runs(reaching, raster)
    found, beyond = reaching.copy(), []
    for turn, angle in enumerate(angles):
        if not runs[turn].any():
            beyond.append(runs[turn])
            continue
        ending = runs[turn] & ~_across(runs, turn)
        lanes = _lanes(reaching, ending, angle, raster.size(HOLE_M))
        found |= touching(mostly(lanes, traces, TRACED), grown(ending, 1))
        lanes = _lanes(reaching, ending, angle, raster.size(LONG_HOLE_M), below)
        found |= touching(lanes, grown(ending, 1))
        beyond.append(dilated(ending, line(angle, raster.size(HOLE_M))) & below)
    for turn, going_on in enumerate(beyond):
        found |= going_on & _across(beyond, turn)
    return _as_sheets(found, reaching)


def _without_traces(reaching: Bools, raster: Raster) -> Bools:
    """R2: short holes before the free ends of walls."""
    found = reaching.copy()
    for turn, run in enumerate(_runs(reaching, raster)):
        angle = np.pi * turn / TURNS
        crossing = opened(reaching, line(angle + np.pi / 2, raster.size(CROSSING_M)))
        ending = run & ~grown(crossing, 2)
        if ending.any():
            found |= touching(_lanes(reaching, ending, angle, raster.size(HOLE_M)), grown(ending, 1))
    return _as_sheets(found, reaching)


def _runs(reaching: Bools, raster: Raster) -> list[Bools]:
    """The straight walls in each direction; what fits into a wavy wall along the raster is no oblique one."""
    wavy = grown(reaching, 2)
    long = raster.size(STRAIGHT_M)
    straight = wavy & grown(opened(wavy, line(0.0, long)) | opened(wavy, line(np.pi / 2, long)), 1)
    found = []
    for turn in range(TURNS):
        oblique = turn % (TURNS // 2) != 0
        run = opened(reaching, line(np.pi * turn / TURNS, raster.size(OBLIQUE_RUN_M if oblique else RUN_M)))
        found.append(run & ~straight if oblique else run)
    return found


def _lanes(reaching: Bools, ending: Bools, angle: float, cells: int, within: Bools | None = None) -> Bools:
    """What lies in one direction between two walls, at most so many cells apart, beyond the end of a run."""
    hole = line(angle, cells)
    gaps = cv2.morphologyEx(reaching.view(np.uint8), cv2.MORPH_CLOSE, hole).view(bool) & ~reaching
    if within is not None:
        gaps &= within
    return np.asarray(gaps & dilated(ending, line(angle, 2 * cells)))


def _as_sheets(found: Bools, reaching: Bools) -> Bools:
    """What was found beyond what reaches the top, as wide as what was seen."""
    thin = found & ~reaching & ~opened(found, square(SHEET))
    return found | grown(thin, SPREAD)


def _across(by_turn: list[Bools], turn: int) -> Bools:
    """All that lies in one of the directions that cross this one."""
    return np.asarray(
        np.logical_or.reduce([by_turn[(turn + k) % TURNS] for k in range(TURNS // 3, 2 * TURNS // 3 + 1)])
    )


def _between_jambs(reaching: Bools, body: Bools, raster: Raster) -> Bools:
    """R3, along the rows and along the columns."""
    found = reaching.copy()
    for walls, standing, marked in ((reaching, body, found), (reaching.T, body.T, found.T)):
        beside = _close_by(walls, raster)
        for row, first, last in _short_walls(walls, standing, raster):
            if beside[row, first:last].mean() < ALONG:
                marked[row, first:last] = True
    return _as_sheets(found, reaching)


def _close_by(walls: Bools, raster: Raster) -> Bools:
    """Where a wall lies beside, above or below in the raster, as close as the wall behind a cupboard."""
    near, far = (raster.size(m) for m in CLOSE_BY_M)
    reach = np.zeros((2 * far + 1, 1), np.uint8)
    reach[: far - near] = reach[far + near + 1 :] = 1
    return dilated(walls, reach)


def _short_walls(walls: Bools, standing: Bools, raster: Raster) -> Iterator[tuple[int, int, int]]:
    """Rows with their first cell and the one after the last, where two jambs stand between two walls."""
    least, most = (raster.size(m) for m in DOOR_M)
    jamb, longest = raster.size(JAMB_M), raster.size(SHORT_WALL_M)
    in_line = opened(np.ascontiguousarray(walls), line(0.0, raster.size(RUN_M)))
    thin, thick = (raster.size(m) for m in WALL_M)
    solid = opened(closed(np.ascontiguousarray(walls | standing), thick), square(thin))
    for row in np.flatnonzero((standing & ~walls).any(axis=1)):
        at = np.flatnonzero(walls[row])
        for k in np.flatnonzero((np.diff(at) > least + jamb) & (np.diff(at) <= longest)):
            first, last = int(at[k]) + 1, int(at[k + 1])
            gap = _gap(standing[row, first:last])
            if gap is None or not least <= gap[1] - gap[0] <= most:
                continue
            parts = solid[row, first : first + gap[0]], solid[row, first + gap[1] : last]
            jambs = [len(part) >= jamb and part.mean() > ALONG for part in parts]
            ends = in_line[row, first - 1], in_line[row, last]
            if all(jambs) or (jambs[0] and ends[1]) or (jambs[1] and ends[0]):
                yield int(row), first, last


def _gap(standing: npt.NDArray[np.bool_]) -> tuple[int, int] | None:
    """Where the only gap in what stands begins and ends."""
    free = np.flatnonzero(~standing)
    if not len(free) or free[-1] - free[0] + 1 != len(free):
        return None
    return int(free[0]), int(free[-1]) + 1
