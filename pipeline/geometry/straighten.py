"""Straighten room outlines: snap nearly parallel or collinear edges to shared directions and lines.

Slabs of one wall overlap, are skewed by a degree, or stand a centimetre apart, so the outline of their union has
stair-steps and slivers. Each edge becomes part of a line, and the outline is drawn again from the crossings of its
lines.

R1  The directions that many long edges share are the house's. An edge takes a shared direction if that moves its ends
    by at most ``offset_m``. A shared direction within ``angle_deg`` of an axis becomes the axis.
R2  Parallel edges that look the same way, closer than ``offset_m`` and next to each other, lie on one line.
R3  A step that is shorter than ``offset_m`` between two edges is dropped.
R4  An outline that would change by more than ``offset_m`` keeps its own edges.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon

from houseexpo.tolerances import SAME_M
from pipeline.geometry.areas import dot_product, polygons_of
from pipeline.tolerances import AROUND_M, RUN_M, SAME

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class _Edges:
    """All edges of all rings: ends (n, 2), unit direction, length, and their ring's index."""

    start: Floats
    end: Floats
    ring: npt.NDArray[np.int64]

    @property
    def length(self) -> Floats:
        return np.asarray(np.hypot(*(self.end - self.start).T))

    @property
    def angle(self) -> Floats:
        """Direction in [0, 2 pi)."""
        d = self.end - self.start
        return np.arctan2(d[:, 1], d[:, 0]) % (2 * np.pi)


def are_straight(rooms: Sequence[Polygon], apart_m: float) -> bool:
    """Return whether all edges of some rooms are parallel to an axis and run more than ``apart_m`` from each other.

    Then no part of a room is thinner than that, no edge is shorter, and nothing is left to straighten.
    """
    points, ring = shapely.get_coordinates(shapely.get_rings(rooms), return_index=True)
    on = np.flatnonzero(ring[1:] == ring[:-1])
    edges = np.stack([points[on], points[on + 1]], axis=1)
    across = np.abs(edges[:, 1] - edges[:, 0]) < SAME_M
    if not across.any(axis=1).all():
        return False
    low, high = edges.min(axis=1), edges.max(axis=1)
    return not any(
        _have_near_lines(low[across[:, k], k], low[across[:, k], 1 - k], high[across[:, k], 1 - k], apart_m)
        for k in (0, 1)
    )


def _have_near_lines(line: Floats, low: Floats, high: Floats, apart_m: float) -> bool:
    """Return whether two of some parallel edges (n,) run beside each other, on two lines up to ``apart_m`` apart."""
    order = np.argsort(line)
    line, low, high = line[order], low[order] - AROUND_M, high[order]
    for k in range(1, len(line)):
        apart = line[k:] - line[:-k]
        if not (near := apart <= apart_m).any():
            break
        beside = (low[k:] <= high[:-k]) & (low[:-k] <= high[k:])
        if (near & beside & (apart > SAME_M)).any():
            return True
    return False


def straighten_outlines(rooms: list[Polygon], *, offset_m: float, angle_deg: float) -> list[Polygon]:
    """Return the same rooms with straight faces; none moves by more than about ``offset_m`` metres."""
    cleaned = [shapely.orient_polygons(polygons_of(shapely.simplify(room, offset_m / 4))[0]) for room in rooms]
    rings = [shapely.get_coordinates(ring)[:-1] for room in cleaned for ring in (room.exterior, *room.interiors)]
    if not rings:
        return rooms
    edges = _Edges(
        np.concatenate(rings),
        np.concatenate([np.roll(r, -1, axis=0) for r in rings]),
        np.repeat(np.arange(len(rings)), [len(r) for r in rings]),
    )
    angle = _shared_angles(edges, offset_m, np.deg2rad(angle_deg))  # R1
    normal = np.stack([np.sin(angle), -np.cos(angle)], axis=1)
    line = _shared_lines(edges, angle, normal, offset_m)  # R2
    drawn = _redraw(edges, line, normal, len(rings), offset_m)
    result, at = [], 0
    for room in cleaned:
        count = 1 + len(room.interiors)
        result.append(_accept_if_sound(room, drawn[at : at + count], offset_m))
        at += count
    return result


def _shared_angles(edges: _Edges, offset_m: float, tolerance: float) -> Floats:
    angle, length = edges.angle, edges.length
    result = angle.copy()
    free = length >= RUN_M
    while free.any():
        leader = int(np.argmax(np.where(free, length, 0.0)))
        near = free & (_angle_between(angle, angle[leader]) <= tolerance)
        shared = _mean_angle(angle[near], length[near])
        quarter = np.round(shared / (np.pi / 2)) * (np.pi / 2)
        shared = quarter if abs(shared - quarter) <= tolerance else shared
        close = _angle_between(angle, shared)
        takes = (close <= 2 * tolerance) & (np.sin(close) * length / 2 <= offset_m) & (near | (length < RUN_M))
        turned = np.cos(angle - shared) < 0
        result[takes] = (shared + np.pi * turned[takes]) % (2 * np.pi)
        free &= ~near
    return result


def _angle_between(angle: Floats, other: float) -> Floats:
    """Difference of directions, modulo half a turn."""
    d = (angle - other) % np.pi
    return np.asarray(np.minimum(d, np.pi - d))


def _mean_angle(angle: Floats, weight: Floats) -> float:
    double = np.sum(weight * np.exp(2j * angle))
    return float(np.angle(double) / 2 % np.pi)


def _shared_lines(edges: _Edges, angle: Floats, normal: Floats, offset_m: float) -> Floats:
    """For each edge the offset of its line along its normal, metres."""
    along = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    own: Floats = (((edges.start + edges.end) / 2) * normal).sum(axis=1)
    low = (edges.start * along).sum(axis=1)
    high = (edges.end * along).sum(axis=1)
    length = edges.length
    result = np.asarray(own * length / length)  # for an edge that shares its line with no other
    offsets, angles, lengths = own.tolist(), angle.tolist(), length.tolist()
    spans = list(zip(low.tolist(), high.tolist(), strict=True))
    for together in _may_share_lines(angle, own, low, high, offset_m):
        free = dict.fromkeys(together)
        for leader in sorted(together, key=lengths.__getitem__, reverse=True):
            if leader not in free or len(free) == 1:
                continue
            near = [k for k in free if abs(offsets[k] - offsets[leader]) <= offset_m]
            same = [k for k in near if abs(math.sin((angles[k] - angles[leader]) / 2)) < SAME]
            group = _within_reach(spans, same, leader) if len(same) > 1 else same
            for k in group:
                del free[k]
            if len(group) > 1:
                result[group] = (own[group] * length[group]).sum() / length[group].sum()
    return result


def _may_share_lines(angle: Floats, own: Floats, low: Floats, high: Floats, offset_m: float) -> list[list[int]]:
    """Return sets of two or more edges (ascending indices); edges of different sets cannot share a line.

    Edges (n,) are parted by direction, then by offset, then by their place along the line: wherever the step to the
    next edge is too wide.
    """
    part = np.zeros(len(own), np.int64)
    around = np.sort(angle)
    widest = int(np.diff(around, append=around[0] + 2 * np.pi).argmax())
    turned = (angle - around[(widest + 1) % len(around)]) % (2 * np.pi)  # from the widest step on
    for first, last, step in (
        (turned, turned, 4 * SAME),  # edges are parallel if the sine of half the angle between them is less
        (own, own, 2 * offset_m),
        (np.minimum(low, high), np.maximum(low, high), 2 * AROUND_M),
    ):
        order = np.lexsort((first, part))
        ends = _running_maximum(last[order], part[order])
        parted = np.ones(len(order), bool)
        parted[1:] = (part[order][1:] != part[order][:-1]) | (first[order][1:] > ends[:-1] + step)
        part[order] = np.cumsum(parted)
    order = np.argsort(part, kind="stable")
    starts = np.flatnonzero(np.diff(part[order], prepend=-1))
    ends = np.append(starts[1:], len(order))
    edges, several = order.tolist(), ends - starts > 1
    return [edges[start:end] for start, end in zip(starts[several].tolist(), ends[several].tolist(), strict=True)]


def _running_maximum(values: Floats, part: npt.NDArray[np.int64]) -> Floats:
    """Return the greatest of the values (n,) so far, in each of the parts (n,), which ascend."""
    span = float(np.ptp(values)) + 1.0
    return np.asarray(np.maximum.accumulate(values + part * span) - part * span)


def _within_reach(spans: list[tuple[float, float]], index: list[int], leader: int) -> list[int]:
    """Return the candidates on the leader's line, each within reach of the stretch that the ones before it cover."""
    start, end = spans[leader]
    inside: list[int] = []
    while True:
        grown = [k for k in index if spans[k][0] <= end + AROUND_M and spans[k][1] >= start - AROUND_M]
        if grown == inside:
            return inside
        inside = grown
        start, end = min(spans[k][0] for k in inside), max(spans[k][1] for k in inside)


def _redraw(edges: _Edges, line: Floats, normal: Floats, n_rings: int, offset_m: float) -> list[Floats]:
    """Return all rings from the crossings of their lines."""
    length = edges.length
    rings = [np.flatnonzero(edges.ring == k).tolist() for k in range(n_rings)]
    kept = [_without_steps(ring, line, normal, length, offset_m) for ring in rings]
    here = np.array([k for ring in kept for k in ring])
    after = np.array([k for ring in kept for k in ring[1:] + ring[:1]])
    (x1, y1), (x2, y2) = normal[here].T, normal[after].T
    turn = x1 * y2 - y1 * x2
    crossing = np.abs(turn) > 0.1
    pairs = np.stack([here, after], axis=1)
    one, other = line[here], line[after]
    met = np.stack([one * y2 - other * y1, other * x1 - one * x2], axis=1) / np.where(crossing, turn, 1.0)[:, None]
    points: list[list[Floats]] = [[] for _ in rings]
    for k, (first, second) in enumerate(pairs.tolist()):
        if crossing[k]:
            points[edges.ring[first]].append(met[k])
        else:  # (nearly) parallel: a step between two lines
            corner = edges.end[first] if second == first + 1 else (edges.end[first] + edges.start[second]) / 2
            step = [corner + (line[i] - dot_product(corner, normal[i])) * normal[i] for i in (first, second)]
            points[edges.ring[first]] += step
    return [np.array(ring).reshape(-1, 2) for ring in points]


def _without_steps(index: list[int], line: Floats, normal: Floats, length: Floats, offset_m: float) -> list[int]:
    """Drop short edges whose neighbours meet without them, and join neighbours on one line."""
    ways, offsets = normal[index].tolist(), line[index].tolist()  # lists of numbers are quicker than arrays
    short = (length[index] <= offset_m).tolist()

    def parallel(a: int, b: int) -> bool:
        (ax, ay), (bx, by) = ways[a], ways[b]
        return bool(ax * bx + ay * by > 1 - 1e-9)

    kept, k, left = list(range(len(index))), 0, len(index)
    while left > 3 and k < left:
        here, before = kept[k], kept[k - 1]
        goes = abs(offsets[before] - offsets[here]) < 1e-9 and parallel(before, here)
        if not goes and short[here]:
            after = kept[k + 1 - left]
            goes = abs(offsets[before] - offsets[after]) < 1e-9 or not parallel(before, after)
        if not goes:
            k += 1
            continue
        del kept[k]  # the first edge that can go now is the one before, or the first where the last is gone
        left -= 1
        k = 0 if k == left else max(k - 1, 0)
    return [index[k] for k in kept]


def _accept_if_sound(room: Polygon, rings: list[Floats], offset_m: float) -> Polygon:
    """Return the redrawn room if it is sound and close to what it was."""
    if any(len(ring) < 3 for ring in rings[:1]):
        return room
    redrawn = Polygon(rings[0], [ring for ring in rings[1:] if len(ring) >= 3])
    if not redrawn.is_valid or redrawn.is_empty:
        return room
    far = shapely.hausdorff_distance(redrawn.exterior, room.exterior)
    return redrawn if far <= 4 * offset_m else room
