"""A mesh as a house that would stand on one of its axes: how wide, how high a storey, how square."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pipeline.sources.split_levels import storeys_apart
from pipeline.sources.surfaces import Bools, Floats, Surfaces, WallProfile, weighted_quantile

STOREY_M = (1.9, 6.6)
HIGHEST_M = 60.0  # of a building whose storeys nothing divides
WIDTH_M = (1.5, 200.0)
LONGEST_AT_MIN_M = 2.0
SQUARE = 0.85  # roofs, stairs and furniture may be the rest
BINS = 400
HEAD = 0.03  # of the walls' usual length: what a door or two of a house add over their heads
LEVEL = 0.002  # of the plan: the undersides of a lintel or two
MAX_HEADS = 2
PLINTH = 0.04  # of the upright area: what the side of the base adds on which a model stands
AS_STRONG = 0.75
UPPER, LOWER = (0.5, 0.96), (0.15, 0.5)  # of a storey


@dataclass(frozen=True)
class Shape:
    """A mesh as a house that stands on one axis, in the file's unit: two plan widths, and a storey's height."""

    widths: tuple[float, float]
    storey: float
    flatness: float
    bare: bool  # hardly any face looks up: walls alone
    square: float  # share of the area that is upright or level; on a wrong axis, a turned house has slopes
    heads: tuple[float, ...] = ()  # of openings, above the storey's foot
    height: float = 0.0  # of all walls, whatever divides them
    lower: tuple[float, ...] = ()  # in the lower half of the storey, where openings end that are as many

    def fits(self, metres: float) -> bool:
        """R2: tell whether a unit of so many metres makes this a house."""
        return self.fits_width(metres) and STOREY_M[0] <= self.storey * metres <= STOREY_M[1]

    def stands(self, metres: float) -> bool:
        """R2: tell whether so many metres make this a building, of one storey or of several that nothing divides."""
        return self.fits_width(metres) and STOREY_M[0] <= self.storey * metres <= HIGHEST_M

    def fits_width(self, metres: float) -> bool:
        """Tell whether the walls stand as far apart as a house's."""
        narrow, wide = sorted(width * metres for width in self.widths)
        return WIDTH_M[0] <= narrow and LONGEST_AT_MIN_M <= wide <= WIDTH_M[1]


def measured(surfaces: Surfaces, axis: int) -> Shape | None:
    """Measure the mesh as it stands on one axis, or None if it has no wall then."""
    walls = surfaces.walls(axis)
    if not walls.any():
        return None
    spans = [_span(surfaces, walls, i) for i in range(3)]
    widths = tuple(high - low for i, (low, high) in enumerate(spans) if i != axis)
    height = float(np.ptp(np.concatenate([surfaces.low[walls, axis], surfaces.high[walls, axis]])))
    flats, all_area = surfaces.flats(axis), float(surfaces.area.sum())
    flat_area, wall_area = float(surfaces.area[flats].sum()), float(surfaces.area[walls].sum())
    square = (flat_area + wall_area) / all_area
    flatness = math.log(max(math.sqrt(widths[0] * widths[1]), 1e-12) / height)
    tall = [np.subtract(*_span(surfaces, walls, i, PLINTH)[::-1]) for i in range(3) if i != axis]
    storey, heads, lower = _storey(surfaces, walls, _over(surfaces, flats, spans, axis), axis, float(np.prod(tall)))
    bare = flat_area < 0.06 * all_area and square > SQUARE
    return Shape((widths[0], widths[1]), storey, flatness, bare, square, heads, height, lower)


def _span(surfaces: Surfaces, faces: Bools, axis: int, beyond: float = 0.005) -> tuple[float, float]:
    """Where the faces begin and end along an axis, but for this share of their area on each side."""
    low, high, area = surfaces.low[faces, axis], surfaces.high[faces, axis], surfaces.area[faces]
    return weighted_quantile(low, area, beyond), weighted_quantile(high, area, 1 - beyond)


def _over(surfaces: Surfaces, flats: Bools, spans: list[tuple[float, float]], axis: int) -> Floats:
    """Area (m,) of each level face, no more of it than may lie where the walls span the plan: terrain goes on."""
    sides = [
        np.minimum(surfaces.high[:, i], high) - np.maximum(surfaces.low[:, i], low)
        for i, (low, high) in enumerate(spans)
        if i != axis
    ]
    return np.where(flats, np.minimum(surfaces.area, np.prod(np.maximum(sides, 0.0), axis=0)), 0.0)


def _storey(
    surfaces: Surfaces, walls: Bools, level: Floats, axis: int, footprint: float
) -> tuple[float, tuple[float, ...], tuple[float, ...]]:
    """Return the greatest height between two level surfaces that cover the plan, or the ends of the walls.

    The halves of a split level have storeys of their own.

    And in it, above its foot, the heights at which openings end and there is more wall than below: those in its upper
    half, and those in its lower half. ``level`` is each face's level area (m,), ``footprint`` what the walls span.
    """
    low, high = surfaces.low[walls, axis].min(), surfaces.high[walls, axis].max()
    profile = WallProfile.of(surfaces, walls, axis, float(high - low) / BINS)
    standing = np.flatnonzero(profile.length >= 0.2 * profile.length.max())
    foot, top = profile.edges[standing[0]], profile.edges[standing[-1] + 1]
    up = surfaces.normal[:, axis] > 0
    flats, middle = level > 0, (surfaces.low[:, axis] + surfaces.high[:, axis]) / 2
    looks = [_area_over_height(middle[chosen], level[chosen], profile.edges) for chosen in (flats & up, flats & ~up)]
    covered = np.maximum(*looks)  # not their sum: walls made in courses have faces of both kinds between these
    layers = profile.edges[:-1][covered > 0.35 * footprint]
    stops = np.concatenate([[foot], layers[(layers > foot) & (layers < top)], [top]])
    stops = np.sort(stops)
    widest = int(np.diff(stops).argmax())
    foot, storey = float(stops[widest]), float(stops[widest + 1] - stops[widest])
    for floor, ceiling in storeys_apart(surfaces, flats, axis, layers, float(np.diff(profile.edges)[0])):
        if ceiling - floor > storey:
            foot, storey = floor, ceiling - floor
    growth, usual = _growth(profile), float(np.median(profile.length))
    heights = (profile.edges[:-1] - foot) / storey
    grown = _heads(heights, growth, UPPER, HEAD * usual)
    level_at = np.histogram(middle[flats], profile.edges, weights=level[flats])[0]
    undersides = _heads(heights, level_at, UPPER, LEVEL * footprint)
    strongest = max((float(growth[heights == head].max()) for head in grown), default=0.0)
    lower = _heads(heights, growth, LOWER, max(AS_STRONG * strongest, HEAD * usual))
    upper = sorted({head * storey for head in (*grown, *undersides)})
    return storey, tuple(upper), tuple(sorted(head * storey for head in lower))


def _growth(profile: WallProfile) -> Floats:
    """How much longer the walls are two steps above each height than two steps below it."""
    grown = np.zeros_like(profile.length)
    grown[2:-2] = profile.length[4:] - profile.length[:-4]
    return grown


def _heads(heights: Floats, evidence: Floats, part: tuple[float, float], least: float) -> tuple[float, ...]:
    """Heights in one part of a storey at which the evidence peaks, the strongest few; both are shares of a storey."""
    left = np.where((heights > part[0]) & (heights < part[1]), evidence, 0.0)
    found: list[float] = []
    while len(found) < MAX_HEADS and left.max() > least:
        best = int(left.argmax())
        found.append(float(heights[best]))
        left[max(best - 4, 0) : best + 5] = 0.0
    return tuple(found)


def _area_over_height(heights: Floats, area: Floats, edges: Floats) -> Floats:
    """Area of level faces in each step of height and its two neighbours, or 0 if the step itself has none."""
    areas = np.histogram(heights, edges, weights=area)[0]
    return np.where(areas > 0, np.convolve(areas, np.ones(3), mode="same"), 0.0)
