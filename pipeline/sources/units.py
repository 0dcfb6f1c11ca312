"""Which axis of a mesh points up and what its unit is: the format's convention, checked against the geometry.

R1  The up axis is the convention's unless the shape speaks clearly against it: a house is flatter than it is wide, its
    faces stand upright or lie level, and in a mesh of walls alone hardly any looks up.
R2  A unit fits where a storey is 1.9 to 6.6 m high and the walls stand 1.5 to 200 m apart, the longer way at least 3 m.
R3  The unit is the convention's, else metres, where these fit; else the one that brings a storey nearest to 2.7 m.
R4  What the user says is believed for the axis; a unit that he gives must put the walls within 1.5 to 200 m.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pipeline.rejection import Reason, Rejection
from pipeline.sources.mesh_load import Convention
from pipeline.sources.surfaces import Bools, Floats, Surfaces, WallProfile, weighted_quantile
from pipeline.values import Mesh

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
UPS = {"y": 1, "z": 2}
STOREY_M = (1.9, 6.6)
USUAL_STOREY_M = 2.7
WIDTH_M = (1.5, 200.0)
LONGEST_AT_LEAST_M = 3.0
CUSTOM_WEIGHT = 0.9  # a house outweighs it that is 1.5 times as deep as high when stood on the other axis
BINDING_WEIGHT = 1.6  # here twice as deep as high: exporters forget to turn their models
SQUARE = 0.85  # roofs, stairs and furniture may be the rest
BINS = 400


@dataclass(frozen=True)
class Shape:
    """A mesh as a house that stands on one axis, in the file's unit: two plan widths, and a storey's height."""

    widths: tuple[float, float]
    storey: float
    flatness: float
    bare: bool  # hardly any face looks up: walls alone
    square: float  # share of the area that is upright or level; on a wrong axis, a turned house has slopes

    def fits(self, metres: float) -> bool:
        """R2: tell whether a unit of so many metres makes this a house."""
        return self.fits_width(metres) and STOREY_M[0] <= self.storey * metres <= STOREY_M[1]

    def fits_width(self, metres: float) -> bool:
        """Tell whether the walls stand as far apart as a house's."""
        narrow, wide = sorted(width * metres for width in self.widths)
        return WIDTH_M[0] <= narrow and LONGEST_AT_LEAST_M <= wide <= WIDTH_M[1]


@dataclass(frozen=True)
class Frame3D:
    """The answer: up axis, metres in one unit, and the unit's name for the record."""

    up: str
    metres: float
    units: str


def detect(mesh: Mesh, convention: Convention, up: str, units: str, name: str) -> Frame3D:
    """Find the up axis and the unit; ``up`` and ``units`` are the user's, or "auto".

    Raises
    ------
    Rejection
        BAD_UNITS where no unit, or not the given one, makes a house of the mesh.
    """
    surfaces = Surfaces.of(mesh)
    candidates = [up] if up in UPS else sorted(UPS)
    shapes = {axis: shape for axis in candidates if (shape := _shape(surfaces, UPS[axis]))}
    if not shapes:  # no wall on any axis: the search for levels says so
        return Frame3D(convention.up if up == "auto" else up, UNITS.get(units, 1.0), units if units in UNITS else "m")
    axis = max(shapes, key=lambda key: _upright(shapes[key], key, convention))
    metres = UNITS[units] if units in UNITS else _unit(shapes[axis], convention)
    if metres is None or not shapes[axis].fits_width(metres):
        raise _bad_units(shapes[axis], axis, metres, units, name)
    names = [unit for unit, length in UNITS.items() if math.isclose(length, metres, rel_tol=1e-6)]
    return Frame3D(axis, metres, names[0] if names else f"{metres:g} m")


def _shape(surfaces: Surfaces, axis: int) -> Shape | None:
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
    storey = _storey(surfaces, walls, flats, axis, widths[0] * widths[1])
    return Shape((widths[0], widths[1]), storey, flatness, flat_area < 0.06 * all_area and square > SQUARE, square)


def _span(surfaces: Surfaces, faces: Bools, axis: int) -> tuple[float, float]:
    low, high, area = surfaces.low[faces, axis], surfaces.high[faces, axis], surfaces.area[faces]
    return weighted_quantile(low, area, 0.005), weighted_quantile(high, area, 0.995)


def _storey(surfaces: Surfaces, walls: Bools, flats: Bools, axis: int, footprint: float) -> float:
    """Return the greatest height between two level surfaces that cover the plan, or the ends of the walls."""
    low, high = surfaces.low[walls, axis].min(), surfaces.high[walls, axis].max()
    profile = WallProfile.of(surfaces, walls, axis, float(high - low) / BINS)
    standing = np.flatnonzero(profile.length >= 0.2 * profile.length.max())
    foot, top = profile.edges[standing[0]], profile.edges[standing[-1] + 1]
    up = surfaces.normal[:, axis] > 0
    looks = [_area_over_height(surfaces, flats & looking, axis, profile.edges) for looking in (up, ~up)]
    covered = np.maximum(*looks)  # not their sum: walls made in courses have faces of both kinds between these
    layers = profile.edges[:-1][covered > 0.35 * footprint]
    stops = np.concatenate([[foot], layers[(layers > foot) & (layers < top)], [top]])
    return float(np.diff(np.sort(stops)).max())


def _area_over_height(surfaces: Surfaces, faces: Bools, axis: int, edges: Floats) -> Floats:
    """Area of the chosen faces in each step of height and its two neighbours; 0 where the step itself has none."""
    heights = (surfaces.low[faces, axis] + surfaces.high[faces, axis]) / 2
    areas = np.histogram(heights, edges, weights=surfaces.area[faces])[0]
    return np.where(areas > 0, np.convolve(areas, np.ones(3), mode="same"), 0.0)


def _upright(shape: Shape, axis: str, convention: Convention) -> float:
    """R1, as a sum of evidence; an axis on which no unit makes a house comes last."""
    weight = BINDING_WEIGHT if convention.binding else CUSTOM_WEIGHT
    evidence = 1.5 * shape.flatness + (1.5 if shape.bare else 0.0) + (weight if axis == convention.up else 0.0)
    evidence += 3.0 * min(shape.square, SQUARE)
    return evidence if any(shape.fits(metres) for metres in UNITS.values()) else evidence - 10.0


def _unit(shape: Shape, convention: Convention) -> float | None:
    """R3."""
    first = [1.0] if convention.metres is None else [convention.metres, 1.0]
    for metres in first:
        if shape.fits(metres):
            return metres
    others = [metres for metres in UNITS.values() if shape.fits(metres)]
    return min(others, key=lambda metres: abs(math.log(shape.storey * metres / USUAL_STOREY_M)), default=None)


def _bad_units(shape: Shape, axis: str, metres: float | None, units: str, name: str) -> Rejection:
    long, high = max(shape.widths), shape.storey
    taken = f"taken as {units}" if metres is not None else "in any known unit"
    detail = (
        f"{name}, {axis} up, is {long:.4g} units long with storeys of {high:.4g}: no house {taken} "
        f"(3 to 200 m long, storeys of {STOREY_M[0]} to {STOREY_M[1]} m)"
    )
    fitting = [unit for unit, length in UNITS.items() if shape.fits(length)]
    advice = f"say --units {fitting[0]}" if fitting else "check the model's scale, or give --units and --up"
    return Rejection("source", Reason.BAD_UNITS, detail, advice)
