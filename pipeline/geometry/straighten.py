"""Straighten room outlines: snap nearly parallel or collinear edges to shared directions and lines.

Slabs of one wall overlap, are skewed by a degree, or stand a centimetre apart, so the outline of their union has
stair-steps and slivers. Each edge becomes part of a line, and the outline is drawn again from the crossings of its
lines.

R1  Directions that many long edges share are the house's; an edge takes one if that moves its ends by no more than
    ``offset_m``. A shared direction within ``angle_deg`` of an axis is the axis.
R2  Parallel edges that look the same way, closer than ``offset_m`` and next to each other, lie on one line.
R3  A step that is shorter than ``offset_m`` between two edges is dropped.
R4  An outline that would change by more than that keeps its own edges.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon

from pipeline.geometry.areas import dot_product, polygons_of
from pipeline.tolerances import AROUND_M, RUN_M

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


def straighten_outlines(rooms: list[Polygon], *, offset_m: float, angle_deg: float) -> list[Polygon]:
    """Return the same rooms with straight faces; none moves by more than about ``offset_m`` metres."""
    cleaned = [shapely.orient_polygons(_simple(room, offset_m / 4)) for room in rooms]
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


def _simple(room: Polygon, tolerance_m: float) -> Polygon:
    return polygons_of(shapely.simplify(room, tolerance_m))[0]


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
    length, result = edges.length, own.copy()
    free = np.ones(len(own), bool)
    order = np.argsort(own, kind="stable")
    sorted_own = own[order]
    for leader in np.argsort(-length, kind="stable"):
        if not free[leader]:
            continue
        first, last = np.searchsorted(sorted_own, [own[leader] - 2 * offset_m, own[leader] + 2 * offset_m])
        near = np.sort(order[first:last])  # a wide window: the tests below decide
        near = near[free[near]]
        same = (np.abs(own[near] - own[leader]) <= offset_m) & (
            np.abs(np.sin((angle[near] - angle[leader]) / 2)) < 1e-6
        )
        group = _within_reach(low, high, near[same], int(leader))
        result[group] = (own[group] * length[group]).sum() / length[group].sum()
        free[group] = False
    return result


def _within_reach(low: Floats, high: Floats, index: npt.NDArray[np.int64], leader: int) -> npt.NDArray[np.int64]:
    """Candidates (n,) on the leader's line, each within reach of the stretch that the others cover already."""
    start, end = low[leader], high[leader]
    inside = np.zeros(len(index), bool)
    while True:
        grown = (low[index] <= end + AROUND_M) & (high[index] >= start - AROUND_M)
        if (grown == inside).all():
            return index[inside]
        inside = grown
        start, end = low[index[inside]].min(), high[index[inside]].max()


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
    """R3: drop short edges whose neighbours meet without them, and join neighbours on one line."""
    of = index  # the ring's edges: tuples of numbers are quicker than rows of arrays
    ways = dict(zip(of, zip(normal[of, 0].tolist(), normal[of, 1].tolist(), strict=True), strict=True))
    offsets = dict(zip(of, line[of].tolist(), strict=True))
    lengths = dict(zip(of, length[of].tolist(), strict=True))

    def parallel(a: int, b: int) -> bool:
        (ax, ay), (bx, by) = ways[a], ways[b]
        return bool(ax * bx + ay * by > 1 - 1e-9)

    kept, k = list(index), 0
    while len(kept) > 3 and k < len(kept):
        here, before, after = kept[k], kept[k - 1], kept[(k + 1) % len(kept)]
        same = parallel(before, here) and abs(offsets[before] - offsets[here]) < 1e-9
        step = lengths[here] <= offset_m and (
            not parallel(before, after) or abs(offsets[before] - offsets[after]) < 1e-9
        )
        if not (same or step):
            k += 1
            continue
        del kept[k]  # the first edge that can go now is the one before, or the first where the last is gone
        k = 0 if k == len(kept) else max(k - 1, 0)
    return kept


def _parallel(normal: Floats, a: int, b: int) -> bool:
    return bool(dot_product(normal[a], normal[b]) > 1 - 1e-9)


def _accept_if_sound(room: Polygon, rings: list[Floats], offset_m: float) -> Polygon:
    """R4: return the redrawn room if it is sound and close to what it was."""
    if any(len(ring) < 3 for ring in rings[:1]):
        return room
    redrawn = Polygon(rings[0], [ring for ring in rings[1:] if len(ring) >= 3])
    if not redrawn.is_valid or redrawn.is_empty:
        return room
    far = shapely.hausdorff_distance(redrawn.exterior, room.exterior)
    return redrawn if far <= 4 * offset_m else room
