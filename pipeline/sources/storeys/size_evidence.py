"""Weigh which scale a mesh has by the sizes of what is in it.

Storeys, heads, openings, walls and named things have usual sizes in real houses; ``sizes.toml`` holds them, each with
its source. A scale makes the measured sizes more or less likely. The logarithms of these likelihoods add up, and so
does that of how often files have the scale.

E1  Each kind of measure is heard once: the mean over its distinct sizes, since a hundred doors are one author's.
    Openings of several widths are heard a little louder, and named things as three kinds at most.
E2  Of the heads, the one that fits best is heard: windows end at other heights.
E3  A scale is a known unit, a known unit by a power of ten, or free. Scales within ``LIKE`` of each other are one
    answer. A unit that the format lays down is likelier by ``LAID_DOWN``.
E4  The answer that the rules have given stays unless another one is likelier by ``CLEARLY``.
E5  Those rules have heard the storey, the heads and the extent. So openings or named things must speak for another
    answer, too: where none are found, it stays.
E6  Where nothing hangs over the openings, the walls may be cut off.
"""

from __future__ import annotations

import math
import tomllib
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

import numpy as np
import numpy.typing as npt

from pipeline.sources.storeys.surfaces import Surfaces, cut_faces_at_height
from pipeline.sources.tolerances import (
    CLEARLY,
    FEW,
    FREE_SCALE,
    JAMB,
    LAID_DOWN,
    LIKE,
    LINE_TURN,
    LINE_WIDE,
    OPENING,
    SAME_SIZE,
    SCALE_STEP,
    SCALES_RANGE,
    UNIT_ODDS,
)
from pipeline.tolerances import MANY_FACES, SAME, SOME
from pipeline.values import Mesh

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class UsualSize:
    """The sizes of one kind of thing: ``parts`` (share, middle in metres, spread of the logarithm).

    ``side`` is which side of a named thing is meant: "height" or "length".
    """

    parts: tuple[tuple[float, float, float], ...]
    side: str = ""

    def log_density(self, sizes: Floats) -> Floats:
        """Return the logarithm of the density over log size, for logarithms of sizes in metres."""
        density = np.full_like(sizes, (1 - sum(share for share, _, _ in self.parts)) / SCALES_RANGE)
        for share, middle, spread in self.parts:
            density += (
                share / (spread * math.sqrt(2 * math.pi)) * np.exp(-(((sizes - math.log(middle)) / spread) ** 2) / 2)
            )
        return np.log(density)


@dataclass(frozen=True)
class NamedThing:
    """A thing that a file names: its kind in ``sizes.toml``, its height and its longest side, in the file's unit."""

    kind: str
    height: float
    length: float


@dataclass(frozen=True)
class SizesFound:
    """What was measured, in the file's unit; ``storey`` is 0 if it is not known.

    ``may_be_cut``: nothing hangs over its openings.
    """

    storey: float
    extent: float
    heads: tuple[float, ...] = ()
    widths: tuple[float, ...] = ()
    thicknesses: tuple[float, ...] = ()
    things: tuple[NamedThing, ...] = ()
    may_be_cut: bool = False


@cache
def usual_sizes() -> Mapping[str, UsualSize]:
    """Return the kinds of ``sizes.toml``; a named thing's begins with "thing."."""
    tables = _tables()
    plain = {kind: table for kind, table in tables.items() if kind != "thing"}
    named = {f"thing.{kind}": table for kind, table in tables["thing"].items()}
    return {
        kind: UsualSize(tuple(tuple(part) for part in table["parts"]), table.get("side", ""))
        for kind, table in {**plain, **named}.items()
    }


@cache
def kinds_by_word() -> Mapping[str, str]:
    """Return the kinds of named things by the words for them."""
    return {word: f"thing.{kind}" for kind, table in _tables()["thing"].items() for word in table["words"].split()}


def _tables() -> dict[str, Any]:
    text = resources.files("pipeline.sources.storeys").joinpath("sizes.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)


def log_likelihood(found: SizesFound, log_metres: Floats) -> Floats:
    """Return how likely all measures are (E1, E2) for each logarithm of the metres in a unit."""
    usual = usual_sizes()
    storey = "bare_storey" if found.may_be_cut else "storey"  # E6
    total = (
        usual[storey].log_density(math.log(found.storey) + log_metres) if found.storey else np.zeros_like(log_metres)
    )
    total += usual["extent"].log_density(math.log(found.extent) + log_metres) + _things(found, log_metres)
    if found.heads:  # E2
        total += np.max([usual["head"].log_density(math.log(head) + log_metres) for head in found.heads], axis=0)
    return total


def _things(found: SizesFound, log_metres: Floats) -> Floats:
    """Return how likely openings, walls and named things are."""
    usual = usual_sizes()

    def mean(kind: str, sizes: Sequence[float]) -> Floats:
        each = [usual[kind].log_density(math.log(size) + log_metres) for size in sizes]
        return np.asarray(np.mean(each, axis=0)) if each else np.zeros_like(log_metres)

    widths = distinct_sizes(found.widths)
    total = mean("thickness", distinct_sizes(found.thicknesses))
    total += math.sqrt(min(len(widths), 3)) * mean("width", widths)
    named: dict[str, list[float]] = defaultdict(list)
    for thing in found.things:
        named[thing.kind].append(thing.height if usual[thing.kind].side == "height" else thing.length)
    for kind, sizes in sorted(named.items()):
        total += min(1.0, 3 / len(named)) * mean(kind, distinct_sizes(sizes))
    return total


def distinct_sizes(sizes: Sequence[float]) -> list[float]:
    """Return one size of each cluster of sizes that differ by less than ``SAME_SIZE``, rising."""
    kept: list[float] = []
    for size in sorted(sizes):
        if size > 0 and (not kept or size > kept[-1] * (1 + SAME_SIZE)):
            kept.append(size)
    return kept


def weigh_scale(
    found: SizesFound, metres: float, laid_down: float | None, least: float, most: float, *, is_heard: bool = True
) -> float:
    """Return the metres in a unit: ``metres``, or what is clearly likelier (E4) between ``least`` and ``most``.

    ``laid_down`` is the unit of the format, if it has one. Unless ``is_heard``, ``metres`` follow from the storey
    alone, and E5 does not count.
    """
    grid = np.arange(math.log(least), math.log(most), SCALE_STEP)
    if not len(grid):
        return metres
    units = {math.log(unit): odds for unit, odds in UNIT_ODDS if least <= unit <= most}
    if laid_down is not None and least <= laid_down <= most:
        units[math.log(laid_down)] = units.get(math.log(laid_down), min(units.values(), default=0.0)) + LAID_DOWN
    free = np.exp(log_likelihood(found, grid)) * FREE_SCALE * SCALE_STEP / SCALES_RANGE
    before = np.concatenate([[0.0], np.cumsum(free)])
    places = np.array(list(units))
    weight = np.exp(np.array(list(units.values())) + log_likelihood(found, places)) if units else np.zeros(0)

    def odds(place: float) -> float:  # E3
        start, end = np.searchsorted(grid, [place - LIKE, place + LIKE])
        return float(before[end] - before[start] + weight[np.abs(places - place) < LIKE].sum())

    answers = np.concatenate([places, grid])
    each = np.array([odds(place) for place in answers])
    best = int(each.argmax())
    given = odds(math.log(metres))
    if abs(answers[best] - math.log(metres)) < LIKE or each[best] < math.exp(CLEARLY) * given:
        return metres
    given_things, best_things = _things(found, np.array([math.log(metres), answers[best]]))
    if is_heard and best_things <= given_things:  # E5
        return metres
    near = np.flatnonzero(np.abs(places - answers[best]) < LIKE)
    if len(near):
        return float(math.exp(places[near[weight[near].argmax()]]))
    return float(f"{math.exp(answers[best]):.2g}")


def other_scales(found: SizesFound, metres: float) -> tuple[list[float], bool]:
    """Return what else a unit may be than ``metres``, and whether the first is clearly likelier (E4) by what was found.

    What was ``found`` is in metres as it was read. The others are known units, and those that make a storey or the
    middle one of the openings usual; the likeliest come first.
    """
    usual = usual_sizes()
    measured = ("storey", found.storey), ("width", float(np.median(found.widths)) if found.widths else 0.0)
    wanted = [usual[kind].parts[0][1] / size for kind, size in measured if size]
    factors = [1.0, *(unit / metres for unit, _ in UNIT_ODDS), *wanted]
    odds = log_likelihood(found, np.log(factors))
    kept = [0]
    for k in np.argsort(-odds, kind="stable").tolist():
        if all(abs(math.log(factors[k] / factors[other])) >= 2 * LIKE for other in kept):
            kept.append(k)
    others = [float(f"{factors[k] * metres:.3g}") for k in kept[1:]]
    return others, len(kept) > 1 and bool(odds[kept[1]] > odds[0] + CLEARLY)


# Openings: two short faces across from each other are the jambs of one, as long as its wall is thick. Where faces run
# from one to the other, they are the ends of a pier.


def measure_openings(surfaces: Surfaces, axis: int, foot: float, storey: float) -> tuple[list[float], list[float]]:
    """Return the widths of the openings at ``SOME`` of a storey over its foot, and how thick their walls are."""
    height = foot + SOME * storey
    crossed = surfaces.walls(axis) & (surfaces.low[:, axis] < height) & (surfaces.high[:, axis] > height)
    order = [*(i for i in range(3) if i != axis), axis]
    upright = Surfaces.of(Mesh(surfaces.mesh.vertices[:, order], surfaces.mesh.faces[crossed]))
    lines = _join_segments(cut_faces_at_height(upright, upright.walls(), height)[0], storey)
    long = lines[:, 3] - lines[:, 2]
    jambs = lines[(long > JAMB[0] * storey) & (long < JAMB[1] * storey)]
    if not 1 < len(jambs) <= MANY_FACES:  # a scan has more
        return [], []
    ways = _directions(lines[:, 0])
    along, across = _directions(jambs[:, 0])
    ends = along[:, None] * jambs[:, 2:, None] + (across * jambs[:, 1:2])[:, None]
    middle, long = ends.mean(axis=1), jambs[:, 3] - jambs[:, 2]
    widths, thicknesses = [], []
    for i in range(len(jambs)):
        way = middle - middle[i]
        apart = way @ across[i]
        faces = (np.abs(along @ across[i]) < LINE_TURN) & (np.abs(way @ along[i]) < FEW * long[i])
        faces &= np.abs(long - long[i]) < SOME * long[i]  # two jambs are about equally long
        faces &= (apart > OPENING[0] * storey) & (apart < OPENING[1] * storey)
        if not faces.any():
            continue
        width = float(apart[faces].min())
        if not any(_lies_on(end + across[i] * width / 2, lines, ways, 2 * LINE_WIDE * storey) for end in ends[i]):
            widths.append(width)
            thicknesses.append(float(long[i]))
    return widths, thicknesses


def _directions(turn: Floats) -> tuple[Floats, Floats]:
    """Return unit vectors (k, 2) along lines of these angles, and across them."""
    along = np.column_stack([np.cos(turn), np.sin(turn)])
    return along, np.column_stack([-along[:, 1], along[:, 0]])


def _lies_on(point: Floats, lines: Floats, ways: tuple[Floats, Floats], within: float) -> bool:
    """Tell whether a point lies within so much of one of the lines, which run these ways."""
    along, across = ways
    at = along @ point
    near = np.abs(across @ point - lines[:, 1]) < within
    return bool((near & (at > lines[:, 2]) & (at < lines[:, 3])).any())


def _join_segments(segments: Floats, storey: float) -> Floats:
    """Join segments (k, 2, 2) of one line that touch: rows of the line's angle and offset, its start and its end."""
    way = segments[:, 1] - segments[:, 0]
    long = np.linalg.norm(way, axis=1)
    segments, way = segments[long > SAME * storey], way[long > SAME * storey]
    turn = np.arctan2(way[:, 1], way[:, 0]) % math.pi
    turn = np.where(turn > math.pi - LINE_TURN / 2, turn - math.pi, turn)
    along, across = _directions(turn)
    offset = (segments.mean(axis=1) * across).sum(axis=1)
    spans = np.sort(np.einsum("kij,kj->ki", segments, along), axis=1)
    keys = np.round(np.column_stack([turn / LINE_TURN, offset / (LINE_WIDE * storey)]))
    line = np.unique(keys, axis=0, return_inverse=True)[1].ravel()
    rows: list[list[float]] = []
    last = -1
    for i in np.lexsort([spans[:, 0], line]):
        start, end = spans[i]
        if line[i] == last and start <= rows[-1][3] + 2 * LINE_WIDE * storey:
            rows[-1][3] = max(rows[-1][3], end)
        else:
            rows.append([turn[i], offset[i], start, end])
        last = line[i]
    return np.array(rows).reshape(-1, 4)
