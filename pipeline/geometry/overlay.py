"""Overlays of areas that give areas: the lines and points that a touching pair leaves behind are dropped."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

EMPTY = Polygon()
FALLBACK_GRID_M = 1e-6
Shapes = npt.NDArray[np.object_]
_POLYGON, _MULTIPOLYGON = 3, 6


def polygons_of(shape: BaseGeometry) -> list[Polygon]:
    """The polygons of any geometry, largest first; lines and points are left out."""
    if isinstance(shape, Polygon):
        return [] if shape.is_empty else [shape]
    parts = shapely.get_parts(shape)
    if not isinstance(shape, MultiPolygon):
        parts = shapely.get_parts(parts)
    found = [p for p in parts if isinstance(p, Polygon) and not p.is_empty]
    return sorted(found, key=lambda p: (-p.area, p.bounds)) if len(found) > 1 else found


def areas(shape: BaseGeometry) -> BaseGeometry:
    """Only the areas of a geometry."""
    if shapely.get_type_id(shape) in (_POLYGON, _MULTIPOLYGON):
        return shape
    return MultiPolygon(polygons_of(shape))


def quiet() -> np.errstate:
    """Keep still NumPy's warnings that GEOS divides by the length of edges, which may be none."""
    return np.errstate(divide="ignore", invalid="ignore")


def mitred(shape: Any, distance_m: float, limit: float = 2.0) -> Any:
    """Grow (or, negative, draw in) an area, or each of an array of them, the corners kept square."""
    with quiet():
        return shapely.buffer(shape, distance_m, join_style="mitre", mitre_limit=limit)


def clipped(shape: BaseGeometry, x1: float, y1: float, x2: float, y2: float) -> BaseGeometry:
    """What of an area lies in a rectangle; lines may be left on its edge."""
    try:
        return shapely.clip_by_rect(shape, x1, y1, x2, y2)
    except shapely.errors.GEOSException:  # quick, and defeated by rings that touch the edge in a point
        return overlap(shape, shapely.box(x1, y1, x2, y2))


def subtract(a: BaseGeometry, b: BaseGeometry) -> BaseGeometry:
    """What of ``a`` is not in ``b``."""
    return areas(_robust(shapely.difference, a, b))


def overlap(a: BaseGeometry, b: BaseGeometry) -> BaseGeometry:
    """What ``a`` and ``b`` share."""
    return areas(_robust(shapely.intersection, a, b))


def overlaps(a: Shapes, b: Shapes) -> Shapes:
    """What each of ``a`` (n,) shares with its partner in ``b`` (n,); lines and points may be among it."""
    return _each(shapely.intersection, a, b)


def differences(a: Shapes, b: Shapes) -> Shapes:
    """What of each of ``a`` (n,) is not in its partner in ``b`` (n,)."""
    return _each(shapely.difference, a, b)


def united(shapes: Iterable[BaseGeometry]) -> BaseGeometry:
    """All of them in one."""
    return areas(_robust(shapely.union_all, list(shapes)))


def _robust(operation: Callable[..., BaseGeometry], *shapes: Any) -> BaseGeometry:
    """Overlay as exactly as it goes; where rounding defeats that, the shapes mended and on a grid of a micrometre.

    Buffers with square corners come out invalid now and then, which no grid can put right.
    """
    try:
        return operation(*shapes)
    except shapely.errors.GEOSException:
        return operation(*(_mended(shape) for shape in shapes), grid_size=FALLBACK_GRID_M)


def _each(operation: Callable[..., Any], a: Shapes, b: Shapes) -> Shapes:
    """Overlay pair by pair; where one of them defeats that, each by itself."""
    try:
        return np.asarray(operation(a, b))
    except shapely.errors.GEOSException:
        found = np.empty(len(a), np.object_)
        found[:] = [areas(_robust(operation, one, other)) for one, other in zip(a, b, strict=True)]
        return found


def _mended(shape: Any) -> Any:
    """A shape, or each of a list of them, valid and without the lines that mending leaves."""
    if isinstance(shape, BaseGeometry):
        return areas(shapely.make_valid(shape))
    return [_mended(each) for each in shape]
