"""Find a mesh's up axis and the metres in its unit, from what user and file say and from the sizes that houses have.

A mesh that is no house in any unit is rejected. ``SizeOptions`` is what the user says, ``AxisAndUnit`` the answer.

R1  The up axis is the convention's unless the shape speaks clearly against it: a house is flatter than it is wide, its
    faces stand upright or lie level. An axis that the file itself
    declares is outvoted by nothing but an absurd shape. In a format without a unit, a storey of an unusual height in
    every unit speaks against an axis, but less than a house that would be higher than deep: models to odd scales are
    no rarer than that.
R2  A unit fits where a storey is 1.9 to 6.6 m high and the walls stand 1.5 to 200 m apart, the longer way at least 2 m.
R3  A declared unit stands while the building is 1.9 to 60 m high: a shell has no inner slab. Without one, metres are
    taken where they make a usual storey, or a usual head of an opening; else what the heads of openings tell
    (``scale``); else the unit that brings a storey nearest to 2.7 m. Where only the format declares it (glTF: metres),
    which few modellers heed, the heads of openings tell it too: a storey higher than any dwelling's, in which no
    opening ends at a usual height, is one of a model.
R4  Doors that the file names are 1.5 to 3.2 m high in any unit that is not absurd; where no unit does that, the model
    is to a scale that makes them 2.05 m. Against a declared unit they speak only if that scale gives a usual storey:
    else they are hatches, or handles.
    One door alone is a hatch, too, unless the storey is higher than any dwelling's without it.
R5  What the user says is believed: the axis, the unit or metres a unit, a model's scale, or a storey's height; it must
    put the walls within 1.5 to 200 m.
R6  Where the format lays down axis and unit, and what divides the walls leaves no storey as high as a room, the walls
    as a whole may be one: what divides them is no slab.
R7  Where no unit fits, the scale is tried that makes a storey 2.7 m high (``TRIED``). The caller believes it only if
    there are rooms then.
R8  So it is where a file without a unit would be a building in metres that nothing divides, if that scale, and not
    metres, gives an opening the height of a door.
R9  What the sizes of openings, walls and named things make clearly likelier (``size_evidence``) is taken instead of a
    guess. A unit that the file or its format lays down is no guess where the rules before kept it.
R10 Walls over whose openings nothing hangs may be cut off, as those of a dollhouse: what is lower than the lowest
    storey in a known unit, and reaches ``LOWEST_CUT_M``, may have its size (R9). Doors as high as such walls are cut
    with them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pipeline.geometry.meshes import SCAN_FACES
from pipeline.rejection import Reason, Rejection
from pipeline.sources.meshes.formats import FrameConvention
from pipeline.sources.named_scene import DoorHeight
from pipeline.sources.storeys.interior import check_interior
from pipeline.sources.storeys.levels import find_levels
from pipeline.sources.storeys.scale import (
    UNITS,
    do_opening_heads_fit_unit,
    has_head_at_door_height,
    unit_from_opening_heads,
    unit_from_storey,
)
from pipeline.sources.storeys.size_evidence import NamedThing, SizesFound, measure_openings, weigh_scale
from pipeline.sources.storeys.surfaces import Bools, Floats, Surfaces, WallProfile, find_storey_pairs, weighted_quantile
from pipeline.sources.tolerances import (
    COMMON_STOREY_M,
    CUSTOM_WEIGHT,
    DECLARED_WEIGHT,
    FEW,
    FLATNESS_WEIGHT,
    HEAD_GROWTH,
    HEAD_LEVEL,
    HEADS_AT,
    HIGHEST_BUILDING_M,
    HIGHEST_STOREY_M,
    LIKE,
    LONGEST_AT_LEAST_M,
    LOWEST_CUT_M,
    MAX_HEADS,
    NAMED_DOOR_M,
    NO_UNIT_WEIGHT,
    ODD_STOREY_WEIGHT,
    OUTSIDE_SHARE,
    PLINTH,
    PROFILE_BINS,
    SQUARE_WEIGHT,
    STOREY_M,
    TINY,
    USUAL_DOOR_M,
    USUAL_STOREY_M,
    WIDTH_M,
)
from pipeline.tolerances import HARDLY, MOSTLY, SAME, THIRD
from pipeline.values import CUT_OFF, Mesh

UPS = {"y": 1, "z": 2}
TRIED = "tried scale"
"""Among the guesses: no unit fits, and a storey of the usual height was taken."""


@dataclass(frozen=True)
class SizeOptions:
    """What the user says: ``metres`` in one unit and a ``storey_m`` are None where he does not."""

    up: str = "auto"
    metres: float | None = None
    scale: float = 1.0
    storey_m: float | None = None

    @property
    def is_about_size(self) -> bool:
        """Whether the size is his, and nothing is guessed."""
        return self.metres is not None or self.scale != 1.0 or self.storey_m is not None


@dataclass(frozen=True)
class AxisAndUnit:
    """The answer: up axis, metres in one unit, the unit's name for the record, and what of it was guessed.

    ``cut_off`` are the heights in metres between which walls stand that are cut off (R10), or None.
    """

    up: str
    metres: float
    units: str
    guesses: tuple[str, ...] = ()
    cut_off: tuple[float, float] | None = None


def find_axis_and_unit(
    mesh: Mesh,
    convention: FrameConvention,
    wish: SizeOptions,
    name: str,
    doors: Mapping[str, DoorHeight] | None = None,
    *,
    things: Mapping[str, Sequence[NamedThing]] | None = None,
) -> AxisAndUnit:
    """Find the up axis and the unit; ``doors`` are the named doors' heights, ``things`` all that is named, by axis.

    Raises
    ------
    Rejection
        BAD_UNITS where no unit, or not the given one, makes a house of the mesh.
    """
    step = -(-len(mesh.faces) // SCAN_FACES)  # of a larger mesh every second, third ... face is looked at
    surfaces = Surfaces.of(Mesh(mesh.vertices, mesh.faces[::step]))
    candidates = [wish.up] if wish.up in UPS else sorted(UPS)
    shapes = {axis: shape for axis in candidates if (shape := measure_upright_shape(surfaces, UPS[axis]))}
    if convention.binding and convention.metres is not None and convention.up in shapes:
        shapes[convention.up] = _as_one_storey(shapes[convention.up], convention.metres)
    if not shapes:  # no wall on any axis: the search for levels says so
        metres = (wish.metres or convention.metres or 1.0) * wish.scale
        return AxisAndUnit(convention.up if wish.up == "auto" else wish.up, metres, unit_name(metres))
    axis = max(shapes, key=lambda key: _upright_evidence(shapes[key], key, convention))
    shape, named = shapes[axis], (doors or {}).get(axis)
    too_high = shape.storey * (convention.metres or 1.0) > HIGHEST_STOREY_M
    door = named.height if named is not None and (named.is_sure or too_high) else None
    if door and shape.may_be_cut and abs(math.log(door / shape.storey)) < LIKE:  # R10
        door = None
    found = _given_metres(shape, convention, wish) if wish.is_about_size else _unit(shape, convention, door)
    tried = found is None and not wish.is_about_size
    if tried:  # R7
        found = USUAL_STOREY_M / shape.storey
    if found and not wish.is_about_size and found != convention.metres:
        sizes = _sizes_found(surfaces, axis, shape, (things or {}).get(axis, ()))
        likeliest = _likeliest(sizes, found, convention, shape, tried) if shape.may_be_cut else None
        if likeliest is None or not shape.is_cut(likeliest):
            shape = replace(shape, may_be_cut=False)
            likeliest = _likeliest(sizes, found, convention, shape)
        found = likeliest
    is_cut = found is not None and shape.is_cut(found)
    if found is None or not shape.fits_width(found):
        raise _bad_units(shape, axis, found if wish.is_about_size else None, wish, name)
    guesses = [] if wish.up in UPS or axis == convention.up else ["up"]
    if not wish.is_about_size:
        guesses += [TRIED] if tried and not is_cut else _guesses(found, convention)
    if not is_cut:
        return AxisAndUnit(axis, found, unit_name(found), tuple(guesses))
    cut_off = shape.foot * found, (shape.foot + shape.storey) * found
    return AxisAndUnit(axis, found, unit_name(found), (*guesses, CUT_OFF), cut_off)


def scale_rejection(mesh: Mesh, found: AxisAndUnit, name: str) -> Rejection:
    """Return the rejection of a mesh of which the scale that was tried (R7) gives no rooms."""
    shape = measure_upright_shape(Surfaces.of(mesh), UPS[found.up])
    if shape is None:  # there were walls when the scale was tried
        return Rejection("source", Reason.NO_LEVEL, f"{name}: no wall stands", "look at it in a viewer")
    return _bad_units(shape, found.up, None, SizeOptions(), name)


def _as_one_storey(shape: UprightShape, metres: float) -> UprightShape:
    """Return the shape with its walls as one storey, if no storey of it is as high as a room."""
    low, high = STOREY_M
    if shape.storey * metres < low <= shape.height * metres <= high:
        return replace(shape, storey=shape.height, heads=())
    return shape


def unit_name(metres: float) -> str:
    """Name of the unit of so many metres."""
    names = [unit for unit, length in UNITS.items() if math.isclose(length, metres, rel_tol=SAME)]
    return names[0] if names else f"{metres:g} m"


def _guesses(metres: float, convention: FrameConvention) -> list[str]:
    if math.isclose(metres, convention.metres or 1.0, rel_tol=SAME):
        return []
    return ["units"] if any(math.isclose(metres, unit, rel_tol=SAME) for unit in UNITS.values()) else ["scale"]


def _given_metres(shape: UprightShape, convention: FrameConvention, wish: SizeOptions) -> float:
    """Return the metres per unit that the user states; what makes no building is refused."""
    if wish.storey_m is not None:
        return wish.storey_m / shape.storey
    return (wish.metres or convention.metres or 1.0) * wish.scale


def _upright_evidence(shape: UprightShape, axis: str, convention: FrameConvention) -> float:
    """Sum the evidence for an up axis; if the format states a unit, an axis on which none makes a house comes last."""
    weight = CUSTOM_WEIGHT
    if convention.binding:
        # an axis that a format lays down counts as flatness does, since exporters forget to turn their models
        weight = DECLARED_WEIGHT if convention.declared else FLATNESS_WEIGHT
    evidence = FLATNESS_WEIGHT * shape.flatness + (weight if axis == convention.up else 0.0)
    # roofs, stairs and furniture may be the rest
    evidence += SQUARE_WEIGHT * min(shape.square, MOSTLY)
    if convention.metres is None:
        odd = [abs(math.log(shape.storey * metres / USUAL_STOREY_M)) for metres in UNITS.values() if shape.fits(metres)]
        return evidence - min([ODD_STOREY_WEIGHT * min(odd, default=math.inf), NO_UNIT_WEIGHT])
    possible = any(shape.fits(metres) for metres in UNITS.values()) or shape.stands(convention.metres)
    if possible or shape.is_cut(convention.metres):
        return evidence
    return evidence - NO_UNIT_WEIGHT


def _is_likely(shape: UprightShape) -> bool:
    """Return whether an opening is as high as a door where the storey is 2.7 m high."""
    tried = USUAL_STOREY_M / shape.storey
    return shape.fits_width(tried) and has_head_at_door_height(shape.heads, tried)


def _unit(shape: UprightShape, convention: FrameConvention, door: float | None) -> float | None:
    """Return the declared unit of a possible building, or one in which named doors are as high as doors; else None."""
    if door and convention.metres is not None and shape.fits(convention.metres):  # R4
        door = door if STOREY_M[0] <= shape.storey * USUAL_DOOR_M / door <= STOREY_M[1] else None

    def is_sound(metres: float) -> bool:
        return door is None or NAMED_DOOR_M[0] <= door * metres <= NAMED_DOOR_M[1]

    if convention.metres is not None and shape.stands(convention.metres) and is_sound(convention.metres):
        return _of_a_model(shape, convention, door) or convention.metres
    fitting = [metres for metres in UNITS.values() if shape.fits(metres) and is_sound(metres)]
    if 1.0 in fitting and (
        do_opening_heads_fit_unit(shape.heads, 1.0) or COMMON_STOREY_M[0] <= shape.storey <= COMMON_STOREY_M[1]
    ):
        return 1.0
    told = unit_from_opening_heads(shape.storey, shape.heads) if convention.metres is None else None
    if told and is_sound(told) and shape.fits_width(told):
        return told
    if fitting:
        nearest = min(fitting, key=lambda metres: abs(math.log(shape.storey * metres / USUAL_STOREY_M)))
        return 1.0 if 1.0 in fitting else nearest
    if convention.metres is None and shape.stands(1.0) and is_sound(1.0):
        return None if _is_likely(shape) and not do_opening_heads_fit_unit(shape.heads, 1.0) else 1.0  # R8
    scaled = USUAL_DOOR_M / door if door else unit_from_storey(shape.storey)
    return scaled if scaled and shape.stands(scaled) else None


def _of_a_model(shape: UprightShape, convention: FrameConvention, door: float | None) -> float | None:
    """Return what a unit stands for where the format's own is absurd, or None if it is not."""
    metres = convention.metres or 1.0
    if convention.declared or door is not None or shape.storey * metres <= HIGHEST_STOREY_M or not shape.heads:
        return None
    if do_opening_heads_fit_unit(shape.heads, metres):
        return None
    told = unit_from_opening_heads(shape.storey, shape.heads)
    return told if told and shape.fits_width(told) else None


def _likeliest(
    sizes: SizesFound, metres: float, convention: FrameConvention, shape: UprightShape, tried: bool = False
) -> float:
    """Return the metres in a unit that the sizes make likely; where walls may be cut off, heads say nothing (R10).

    What was ``tried`` follows from the storey alone.
    """
    found = replace(sizes, heads=() if shape.may_be_cut else sizes.heads, may_be_cut=shape.may_be_cut)
    return weigh_scale(found, metres, convention.metres, *shape.scales(), is_heard=not tried)


def _sizes_found(surfaces: Surfaces, axis: str, shape: UprightShape, things: Sequence[NamedThing]) -> SizesFound:
    """Measure what the shape does not hold."""
    widths, thicknesses = measure_openings(surfaces, UPS[axis], shape.foot, shape.storey)
    extent = math.sqrt(math.prod(shape.widths))
    return SizesFound(shape.storey, extent, shape.heads, tuple(widths), tuple(thicknesses), tuple(things))


def _bad_units(shape: UprightShape, axis: str, metres: float | None, wish: SizeOptions, name: str) -> Rejection:
    long, high = max(shape.widths), shape.storey
    sizes = ", ".join(f"{unit}: {long * by:.4g} m and {high * by:.3g} m" for unit, by in UNITS.items())
    taken = "in any known unit" if metres is None else f"at {metres:g} m a unit"
    detail = (
        f"{name}, {axis} up, is {long:.4g} units long with storeys of {high:.4g}: no house {taken} "
        f"(2 to 200 m long, storeys of {STOREY_M[0]} to {STOREY_M[1]} m). Length and storey would be, in {sizes}"
    )
    fitting = [unit for unit, length in UNITS.items() if shape.fits(length)]
    scale = USUAL_STOREY_M / (high * (wish.metres or 1.0))
    other = f"for a scale model say --scale (about {scale:.3g} here), --units or --storey-height"
    advice = f"say --units {fitting[0]}" if fitting else other
    return Rejection("source", Reason.BAD_UNITS, detail, advice)


# A mesh as a house that would stand on one of its axes: how wide, how high a storey, how square.


@dataclass(frozen=True)
class UprightShape:
    """A mesh as a house that stands on one axis, in the file's unit: two plan widths, and a storey's height."""

    widths: tuple[float, float]
    storey: float
    flatness: float
    square: float  # share of the area that is upright or level; on a wrong axis, a turned house has slopes
    heads: tuple[float, ...] = ()  # of openings, above the storey's foot
    height: float = 0.0  # of all walls, whatever divides them
    foot: float = 0.0  # where the storey begins
    may_be_cut: bool = False  # nothing covers the walls, and nothing hangs over their openings (R10)

    def fits(self, metres: float) -> bool:
        """Tell whether a unit of so many metres makes this a house."""
        return self.fits_width(metres) and STOREY_M[0] <= self.storey * metres <= STOREY_M[1]

    def stands(self, metres: float) -> bool:
        """Tell whether so many metres make this a building, of one storey or of several that nothing divides."""
        return self.fits_width(metres) and STOREY_M[0] <= self.storey * metres <= HIGHEST_BUILDING_M

    def is_cut(self, metres: float) -> bool:
        """Tell whether so many metres are a unit in which its walls are lower than a storey's, and may be cut."""
        is_unit = any(math.isclose(metres, unit, rel_tol=SAME) for unit in UNITS.values())
        low = LOWEST_CUT_M <= self.storey * metres < STOREY_M[0]
        return self.may_be_cut and is_unit and low and self.fits_width(metres)

    def scales(self) -> tuple[float, float]:
        """Return the least and the most metres in a unit with which it stands."""
        narrow, wide = (max(width, TINY) for width in sorted(self.widths))  # all walls may lie in one plane
        lowest = LOWEST_CUT_M if self.may_be_cut else STOREY_M[0]
        least = max(lowest / self.storey, WIDTH_M[0] / narrow, LONGEST_AT_LEAST_M / wide)
        return least, min(HIGHEST_BUILDING_M / self.storey, WIDTH_M[1] / wide)

    def fits_width(self, metres: float) -> bool:
        """Tell whether the walls stand as far apart as a house's."""
        narrow, wide = sorted(width * metres for width in self.widths)
        return WIDTH_M[0] <= narrow and LONGEST_AT_LEAST_M <= wide <= WIDTH_M[1]


def measure_upright_shape(surfaces: Surfaces, axis: int) -> UprightShape | None:
    """Measure the mesh as it stands on one axis, or None if it has no wall then."""
    walls = surfaces.walls(axis)
    if not walls.any():
        return None
    spans = [_span(surfaces, walls, i) for i in range(3)]
    widths = tuple(high - low for i, (low, high) in enumerate(spans) if i != axis)
    height = float(np.ptp(np.concatenate([surfaces.low[walls, axis], surfaces.high[walls, axis]])))
    flats = surfaces.flats(axis)
    square = float(surfaces.area[flats].sum() + surfaces.area[walls].sum()) / float(surfaces.area.sum())
    flatness = math.log(max(math.sqrt(widths[0] * widths[1]), TINY) / height)
    tall = [np.subtract(*_span(surfaces, walls, i, PLINTH)[::-1]) for i in range(3) if i != axis]
    level = _area_over_plan(surfaces, flats, spans, axis)
    foot, storey, heads, may_be_cut = _storey(surfaces, walls, level, axis, math.prod(tall))
    return UprightShape((widths[0], widths[1]), storey, flatness, square, heads, height, foot, may_be_cut)


def _span(surfaces: Surfaces, faces: Bools, axis: int, beyond: float = OUTSIDE_SHARE) -> tuple[float, float]:
    """Return where the faces begin and end along an axis, but for this share of their area on each side."""
    low, high, area = surfaces.low[faces, axis], surfaces.high[faces, axis], surfaces.area[faces]
    return weighted_quantile(low, area, beyond), weighted_quantile(high, area, 1 - beyond)


def _area_over_plan(surfaces: Surfaces, flats: Bools, spans: list[tuple[float, float]], axis: int) -> Floats:
    """Area (m,) of each level face, no more of it than may lie where the walls span the plan: terrain goes on."""
    sides = [
        np.minimum(surfaces.high[:, i], high) - np.maximum(surfaces.low[:, i], low)
        for i, (low, high) in enumerate(spans)
        if i != axis
    ]
    return np.where(flats, np.minimum(surfaces.area, np.prod(np.maximum(sides, 0.0), axis=0)), 0.0)


def _storey(
    surfaces: Surfaces, walls: Bools, level: Floats, axis: int, footprint: float
) -> tuple[float, float, tuple[float, ...], bool]:
    """Return the foot and the greatest height between two level surfaces that cover the plan, or the ends of the walls.

    The halves of a split level have storeys of their own.

    And in it, above its foot, the heights in its upper half at which openings end: where there is more wall than below,
    or the underside of a lintel. At last whether the walls may be cut off. ``level`` is each face's level area
    (m,), ``footprint`` what the walls span.
    """
    low, high = surfaces.low[walls, axis].min(), surfaces.high[walls, axis].max()
    profile = WallProfile.of(surfaces, walls, axis, float(high - low) / PROFILE_BINS)
    standing = np.flatnonzero(profile.length >= FEW * profile.length.max())  # the walls of a storey stand from there
    foot, top = profile.edges[standing[0]], profile.edges[standing[-1] + 1]
    up = surfaces.normal[:, axis] > 0
    flats, middle = level > 0, (surfaces.low[:, axis] + surfaces.high[:, axis]) / 2
    looks = [_area_over_height(middle[chosen], level[chosen], profile.edges) for chosen in (flats & up, flats & ~up)]
    covered = np.maximum(*looks)  # not their sum: walls made in courses have faces of both kinds between these
    layers = profile.edges[:-1][covered > THIRD * footprint]  # level faces that divide storeys
    stops = np.concatenate([[foot], layers[(layers > foot) & (layers < top)], [top]])
    stops = np.sort(stops)
    widest = int(np.diff(stops).argmax())
    foot, storey = float(stops[widest]), float(stops[widest + 1] - stops[widest])
    for floor, ceiling in find_storey_pairs(surfaces, flats, axis, layers, float(np.diff(profile.edges)[0])):
        if ceiling - floor > storey:
            foot, storey = floor, ceiling - floor
    growth, usual = _growth(profile), float(np.median(profile.length))
    heights = (profile.edges[:-1] - foot) / storey
    grown = _heads(heights, growth, HEAD_GROWTH * usual)
    level_at = np.histogram(middle[flats], profile.edges, weights=level[flats])[0]
    undersides = _heads(heights, level_at, HEAD_LEVEL * footprint)
    heads = sorted({head * storey for head in (*grown, *undersides)})
    may_be_cut = _is_open_above(profile, covered, foot, storey, footprint)
    return foot, storey, tuple(heads), may_be_cut


def _is_open_above(profile: WallProfile, covered: Floats, foot: float, storey: float, footprint: float) -> bool:
    """Tell whether walls are no longer under their top than anywhere below, and nothing covers them.

    ``covered`` is the level area (k,) at each step of the profile, ``footprint`` what the walls span.
    """
    heights = (profile.edges[:-1] - foot) / storey
    if covered[heights > HEADS_AT[1]].max(initial=0.0) > THIRD * footprint:
        return False
    under_top, below = (
        profile.length[(heights > low) & (heights < high)] for low, high in ((HEADS_AT[1], 1.0), (HARDLY, HEADS_AT[1]))
    )
    if not len(under_top) or not len(below):
        return False
    return float(np.median(under_top) - below.min()) < HEAD_GROWTH * float(np.median(profile.length))


def _growth(profile: WallProfile) -> Floats:
    """Return how much longer the walls are two steps above each height than two steps below it."""
    grown = np.zeros_like(profile.length)
    grown[2:-2] = profile.length[4:] - profile.length[:-4]
    return grown


def _heads(heights: Floats, evidence: Floats, least: float) -> tuple[float, ...]:
    """Return the heights, as shares of a storey, at which the evidence peaks, the strongest few above ``least``."""
    left = np.where((heights > HEADS_AT[0]) & (heights < HEADS_AT[1]), evidence, 0.0)
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


# Tell the outside of a house of unknown size from rooms, where no unit makes a house of a mesh.
#
# R1  The mesh is examined with storeys of the usual height. If it has no inside then, that is why it gives no plan: a
#     unit or a scale would not help.
# R2  One that is longer than houses are then has other proportions than a house: its unit, or its axis, is the fault.


def reject_exterior(upright: Mesh, name: str) -> Rejection | None:
    """Return the rejection NO_INTERIOR of a z-up mesh in an unknown unit, or None if it may have rooms (R1)."""
    shape = measure_upright_shape(Surfaces.of(upright), 2)
    if shape is None or shape.storey <= 0:
        return None
    usual = Mesh(upright.vertices * (USUAL_STOREY_M / shape.storey), upright.faces)
    if np.ptp(usual.vertices[:, :2], axis=0).max() > WIDTH_M[1]:  # R2
        return None
    try:
        check_interior((level.walls for level in find_levels(usual)), name, is_sized=False)
    except Rejection as rejection:
        if rejection.reason is not Reason.NO_INTERIOR:
            return None
        detail = f"{rejection.detail} (with storeys of {USUAL_STOREY_M} m; no known unit makes a house of it)"
        return Rejection("source", Reason.NO_INTERIOR, detail, rejection.advice)
    return None
