"""A random home's layout: a plain one (see ``layout``), altered as homes are.

R1  A wing (garage, another living room, a bedroom) stands at a side now and then: the footprint is an L or a T.
R2  Closets and private bathrooms are cut out of bedrooms' corners.
R3  Now and then a partition stands askew, or an outer corner is cut off.
R4  Half of the layouts are mirrored.
"""

from __future__ import annotations

import math

import numpy as np
import shapely
from numpy.random import Generator
from shapely import Polygon, box

from tests.builders.kinds.parts.layout import Draft, corner_home, corridor_home, hub, on_grid, studio


def draft_home(rng: Generator, size: str = "home") -> Draft:
    """A random home; ``size`` is "small" (30-60 m2), "home" (50-150 m2) or "row" (a narrow house)."""
    pick = rng.random()
    if size == "small" and pick < 0.5:
        draft = studio(rng)
    elif pick < 0.5 or size == "row":
        draft = corridor_home(rng, size)
    elif pick < 0.65 and size == "home":
        draft = corner_home(rng)
    else:
        draft = hub(rng)
    if size == "home" and rng.random() < 0.35:
        add_wing(draft, rng)
    carve(draft, rng)
    if rng.random() < 0.3:
        skew(draft, rng)
    if rng.random() < 0.15:
        cut_corner(draft, rng)
    if rng.random() < 0.5:  # R4
        draft.shapes = [shapely.affinity.scale(s, -1.0, 1.0, origin=(0.0, 0.0)) for s in draft.shapes]
    return draft


def add_wing(draft: Draft, rng: Generator) -> None:
    """R1."""
    x1, y1, x2, y2 = shapely.union_all(draft.shapes).bounds
    wide, deep = on_grid(rng.uniform(3.0, 5.5)), on_grid(rng.uniform(2.8, 5.5))
    label = str(rng.choice(["Garage", "Living_Room", "Bedroom", "Office"]))
    if rng.random() < 0.5:
        y = on_grid(rng.uniform(y1, max(y1, y2 - deep)))
        shape = box(x2, y, x2 + wide, min(y + deep, y2))
    else:
        x = on_grid(rng.uniform(x1, max(x1, x2 - wide)))
        shape = box(x, y2, min(x + wide, x2), y2 + deep)
    draft.add(label, shape)


def carve(draft: Draft, rng: Generator) -> None:
    """R2."""
    for k in range(len(draft.labels)):
        shape = draft.shapes[k]
        if draft.labels[k] not in {"Bedroom", "Guest_Room"} or shape.area < 12 or rng.random() < 0.5:
            continue
        x1, y1, x2, y2 = shape.bounds
        if rng.random() < 0.5:
            wide, deep, label = rng.uniform(0.9, 1.3), rng.uniform(1.3, 2.0), "Wardrobe"
        else:
            wide, deep, label = rng.uniform(1.6, 2.0), rng.uniform(1.9, 2.4), "Bathroom"
        if rng.random() < 0.5:
            wide, deep = deep, wide
        wide, deep = on_grid(wide), on_grid(deep)
        if x2 - x1 - wide < 1.4 or y2 - y1 - deep < 1.4:
            continue
        a = x1 if rng.random() < 0.5 else x2 - wide
        b = y1 if rng.random() < 0.5 else y2 - deep
        part = box(a, b, a + wide, b + deep)
        rest = shape.difference(part)
        if rest.geom_type == "Polygon" and rest.area > 8:
            draft.shapes[k] = rest
            draft.private[draft.add(label, shape.intersection(part))] = k


def skew(draft: Draft, rng: Generator) -> None:
    """R3: a whole partition between two rectangular rooms leaves the right angle."""
    order = rng.permutation(len(draft.shapes))
    for i in order:
        for j in order:
            a, b = draft.shapes[i], draft.shapes[j]
            if i >= j or min(a.area, b.area) < 7 or not (rectangular(a) and rectangular(b)):
                continue
            shared = shapely.line_merge(a.intersection(b))
            if shared.geom_type != "LineString" or len(shared.coords) != 2:
                continue
            if not math.isclose(shared.length, side(a, shared)) or not math.isclose(shared.length, side(b, shared)):
                continue
            ends = np.array(shared.coords)
            normal = np.array([ends[0, 1] - ends[1, 1], ends[1, 0] - ends[0, 0]]) / shared.length
            away = ends[int(rng.integers(2))]
            if sum(s.distance(shapely.Point(away)) < 1e-9 for s in draft.shapes) > 2:
                continue
            shift = away + normal * rng.uniform(0.35, 0.8) * rng.choice([-1, 1])
            draft.shapes[i], draft.shapes[j] = swapped(a, away, shift), swapped(b, away, shift)
            return


def rectangular(shape: Polygon) -> bool:
    """Whether a polygon is a rectangle along the axes."""
    return math.isclose(shape.area, shape.envelope.area, rel_tol=1e-6)


def side(rectangle: Polygon, line: shapely.LineString) -> float:
    """The length of a rectangle's side along a line's direction."""
    x1, y1, x2, y2 = rectangle.bounds
    (a, b), (c, _) = line.coords[0][:2], line.coords[-1][:2]
    return float(y2 - y1) if math.isclose(a, c) else float(x2 - x1) + 0.0 * b


def swapped(shape: Polygon, old: np.ndarray, new: np.ndarray) -> Polygon:
    """A polygon with one corner moved."""
    ring = np.asarray(shape.exterior.coords)[:-1]
    ring = np.where((np.abs(ring - old) < 1e-9).all(axis=1)[:, None], new, ring)
    return Polygon(ring)


def cut_corner(draft: Draft, rng: Generator) -> None:
    """R3: an outer corner of the footprint is cut off."""
    whole = shapely.union_all(draft.shapes)
    for corner in rng.permutation(np.asarray(whole.exterior.coords)[:-1]):
        x, y = corner
        owners = [k for k, s in enumerate(draft.shapes) if s.distance(shapely.Point(corner)) < 1e-9]
        size = on_grid(rng.uniform(0.8, 1.6))
        square = box(x - size, y - size, x + size, y + size)
        quarter = whole.intersection(square)
        if len(owners) != 1 or draft.shapes[owners[0]].area < 10 or not math.isclose(quarter.area, size * size):
            continue
        if shapely.intersection(draft.shapes[owners[0]], square).area < size * size - 1e-6:
            continue
        mid = np.array(quarter.centroid.coords[0])
        far = 2 * mid - corner
        triangle = Polygon([corner, (far[0], y), (x, far[1])])
        draft.shapes[owners[0]] = draft.shapes[owners[0]].difference(triangle)
        return
