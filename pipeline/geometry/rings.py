"""Bodies that are each cut in simple closed rings: SUNCG's case, every slab a box of its own.

Tracing their rings and uniting these with Clipper (manifold3d) costs a tenth of noding all segments of the plane.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate

import manifold3d
import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.overlay import EMPTY, Shapes, united

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Rings:
    """Rings (n, 2), unclosed; for each its signed area (m2, counter-clockwise positive) and its thickness (m).

    The thickness of a long strip is just that; of any convex ring it is at least the radius of the largest disc in it.
    """

    rings: list[Floats]
    area: Floats
    thickness: Floats

    @classmethod
    def of(cls, rings: list[Floats]) -> Rings:
        """Measure them all at once."""
        length = np.array([len(ring) for ring in rings])
        start = np.cumsum(length) - length
        points = np.concatenate(rings)
        after = np.arange(1, len(points) + 1)
        after[start + length - 1] = start
        (x, y), (x2, y2) = points.T, points[after].T
        area = np.add.reduceat(x * y2 - x2 * y, start) / 2
        around = np.add.reduceat(np.hypot(x2 - x, y2 - y), start)
        return cls(rings, area, 2 * np.abs(area) / around)

    def polygons(self, which: npt.NDArray[np.bool_]) -> Shapes:
        """The areas in these of the rings."""
        chosen = [self.rings[k] for k in np.flatnonzero(which)]
        if not chosen:
            return np.zeros(0, np.object_)
        of_ring = np.repeat(np.arange(len(chosen)), [len(ring) for ring in chosen])
        return np.asarray(shapely.polygons(shapely.linearrings(np.concatenate(chosen), indices=of_ring)))


def closed_rings(
    ends: Floats, body: npt.NDArray[np.int64], grid_m: float, thickest_m: float = np.inf
) -> tuple[Rings | None, npt.NDArray[np.bool_]]:
    """The counter-clockwise rings of oriented segments (n, 2, 2), body by body, and which segments (n,) are in none.

    Ends are the same where they round to the same place of the grid. A body is left out as a whole where a segment of
    it does not go on in exactly one other, where a ring runs clockwise (a hole, or a body turned inside out), or is
    thicker than ``thickest_m``.
    """
    places = np.round(ends / grid_m).astype(np.int64)
    places -= places.min(axis=(0, 1))
    if places.max() >= 1 << 24 or body.max() >= 1 << 14:
        return None, np.ones(len(ends), np.bool_)  # larger than their keys: 1.6 km, 16,384 bodies
    keys = (body[:, None] << 48) + (places[:, :, 0] << 24) + places[:, :, 1]
    good = np.ones(int(body.max()) + 1, np.bool_)
    order = np.argsort(keys[:, 0], kind="stable")
    starts = keys[order, 0]
    good[body[order[1:][starts[1:] == starts[:-1]]]] = False
    good[body[~_among(keys[:, 1], starts) | ~_among(keys[:, 0], np.sort(keys[:, 1]))]] = False
    order = order[good[body[order]]]
    if not len(order):
        return None, np.ones(len(ends), np.bool_)
    after = np.zeros(len(ends), np.int64)
    after[order] = order[np.searchsorted(keys[order, 0], keys[order, 1])]
    cycles = [cycle for cycle in _cycles(np.sort(order).tolist(), after.tolist()) if len(cycle) > 2]
    if not cycles:
        return None, ~good[body]
    rings = Rings.of(_parts(ends[np.concatenate(cycles), 0], [len(cycle) for cycle in cycles]))
    of_ring = body[[cycle[0] for cycle in cycles]]
    good[of_ring[(rings.area <= 0) | (rings.thickness >= thickest_m)]] = False
    kept = np.flatnonzero(good[of_ring])
    rest = ~good[body]
    if not len(kept):
        return None, rest
    return Rings([rings.rings[k] for k in kept], rings.area[kept], rings.thickness[kept]), rest


def _among(keys: npt.NDArray[np.int64], ordered: npt.NDArray[np.int64]) -> npt.NDArray[np.bool_]:
    """Which of the keys stand in a sorted array."""
    return np.asarray(ordered[np.minimum(np.searchsorted(ordered, keys), len(ordered) - 1)] == keys)


def _parts(points: Floats, lengths: list[int]) -> list[Floats]:
    """Rows of an array in parts of such lengths."""
    stops = list(accumulate(lengths))
    return [points[stop - length : stop] for stop, length in zip(stops, lengths, strict=True)]


def _cycles(segments: list[int], after: list[int]) -> list[list[int]]:
    """Rings of segments, each followed by the one that ``after`` says."""
    done = bytearray(len(after))
    found = []
    for first in segments:
        cycle, at = [], first
        while not done[at]:
            done[at] = 1
            cycle.append(at)
            at = after[at]
        if cycle:
            found.append(cycle)
    return found


def united_rings(rings: list[Floats], crack_m: float) -> BaseGeometry:
    """The area of all rings together, with cracks up to ``crack_m`` wide closed and corners kept."""
    section = manifold3d.CrossSection(rings, manifold3d.FillRule.Positive)
    mitre = manifold3d.JoinType.Miter
    closed = section.offset(crack_m / 2, mitre, 3.0).offset(-crack_m / 2, mitre, 3.0)
    if closed.is_empty():
        return EMPTY
    found = Rings.of(closed.to_polygons())
    shells = [ring for ring, area in zip(found.rings, found.area, strict=True) if area > 0]
    holes = [ring for ring, area in zip(found.rings, found.area, strict=True) if area <= 0]
    return united(_with_holes(shells, holes))


def _with_holes(shells: list[Floats], holes: list[Floats]) -> list[Polygon]:
    """Each hole in the smallest shell around it."""
    outlines = [Polygon(shell) for shell in shells]
    inside: list[list[Floats]] = [[] for _ in shells]
    for hole in holes:
        point = shapely.points(hole[0])
        around = [k for k, outline in enumerate(outlines) if len(outlines) == 1 or outline.intersects(point)]
        inside[min(around, key=lambda k: outlines[k].area)].append(hole)
    return [Polygon(shell, own) for shell, own in zip(shells, inside, strict=True)]
