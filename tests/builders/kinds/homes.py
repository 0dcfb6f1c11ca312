"""A random home as storeys: a layout, its walls, its openings; several storeys share their walls and a stair."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import shapely
from numpy.random import Generator
from shapely import Polygon, box

from tests.builders.kinds.parts.alterations import draft_home
from tests.builders.kinds.parts.layout import Draft
from tests.builders.kinds.parts.openings import HALLS, Heads, furnish_openings
from tests.builders.kinds.parts.topology import storey_of
from tests.builders.kinds.values import Cell, Storey

TRIES = 200


@dataclass(frozen=True)
class Style:
    """What a kind asks of its homes: ranges (low, high) in metres and shares (0 to 1)."""

    size: str = "home"
    outer_m: tuple[float, float] = (0.15, 0.42)
    inner_m: tuple[float, float] = (0.08, 0.2)
    height_m: tuple[float, float] = (2.3, 3.2)
    windows: float = 0.8
    merged: bool = True


def thicknesses(rng: Generator, style: Style) -> tuple[float, float]:
    """Outer and inner walls; every fifth house has one thickness throughout."""
    inner = round(float(rng.uniform(*style.inner_m)), 3)
    outer = (
        inner if rng.random() < 0.2 else round(float(rng.uniform(max(style.outer_m[0], inner), style.outer_m[1])), 3)
    )
    return outer, inner


def random_home(rng: Generator, style: Style | None = None) -> Storey:
    """One storey."""
    return random_storeys(rng, style or Style(), 1)[0]


def random_storeys(rng: Generator, style: Style, count: int) -> list[Storey]:
    """Storeys of one height over the same footprint; several have a stair in one place."""
    for _ in range(TRIES):
        draft = draft_home(rng, style.size)
        if not style.merged:
            draft.merged = []
        stair = stair_of(draft) if count > 1 else None
        if count > 1 and stair is None:
            continue
        outer, inner = thicknesses(rng, style)
        height = round(float(rng.uniform(*style.height_m)), 2)
        heads = Heads.draw(rng, height)
        storeys = []
        for level in range(count):
            made = one_storey(upper(draft, rng, stair) if level and stair is not None else ground(draft, stair), rng,
                              (outer, inner, height), heads, level, style.windows)  # fmt: skip
            if made is None:
                break
            storeys.append(made)
        if len(storeys) == count:
            return storeys
    raise RuntimeError("no layout found: the ranges of the style leave none")


def one_storey(
    draft: Draft, rng: Generator, sizes: tuple[float, float, float], heads: Heads, level: int, windows: float
) -> Storey | None:
    """Walls and openings for a layout; None where a room cannot be reached or is none."""
    outer, inner, height = sizes
    cells = [Cell(label, shape, 0, label != "Void") for label, shape in zip(draft.labels, draft.shapes, strict=True)]
    if any(not isinstance(shape, Polygon) for shape in draft.shapes):  # a line is left beside a room
        return None
    bare = storey_of(cells, draft.merged, outer, inner, height)
    if any(shapely.get_num_geometries(c.polygon.difference(bare.wall_area)) != 1 or r.area < 0.7
           for c, r in zip(cells, bare.rooms, strict=True)):  # fmt: skip
        return None
    if any(not whole(r) for r in bare.rooms):
        return None
    bare = with_pillars(bare, rng)
    return furnish_openings(bare, rng, draft.private, [draft.entrance] if level == 0 else [], heads, windows)


def with_pillars(storey: Storey, rng: Generator) -> Storey:
    """Every sixth house has pillars in its large rooms, some against a wall (as chimneys and shafts are)."""
    if rng.random() > 0.17:
        return storey
    pillars = []
    for k, room in enumerate(storey.rooms):
        if room.area < 14 or not storey.cells[k].floor:
            continue
        side = float(rng.uniform(0.2, 0.45))
        if rng.random() < 0.5:
            x, y = room.representative_point().coords[0]
        else:
            x, y = room.exterior.interpolate(float(rng.uniform(0, room.length))).coords[0]
        square = box(x - side / 2, y - side / 2, x + side / 2, y + side / 2)
        inside = room.difference(square)
        if inside.geom_type == "Polygon" and inside.buffer(-0.4).geom_type == "Polygon":
            pillars.append(square.intersection(storey.cells[k].polygon))
    return replace(storey, pillars=tuple(p for p in pillars if p.geom_type == "Polygon"))


def whole(room: shapely.Polygon) -> bool:
    """Whether a person can stand in most of a room and walk through all of it."""
    core = room.buffer(-0.3)
    return core.geom_type == "Polygon" and core.area > 0.05 and core.buffer(0.35).area > 0.75 * room.area


def stair_of(draft: Draft) -> int | None:
    """The room at the hall that is best fit to be a stair's: 2 to 3.2 m by 3 to 5 m."""
    halls = [s for label, s in zip(draft.labels, draft.shapes, strict=True) if label in HALLS]
    best: list[tuple[float, int]] = []
    for k, shape in enumerate(draft.shapes):
        x1, y1, x2, y2 = shape.bounds
        short, long = sorted((x2 - x1, y2 - y1))
        taken = k in draft.private.values() or k in draft.private or any(k in pair for pair in draft.merged)
        rectangular = shape.area > 0.999 * shape.envelope.area
        touches = any(shape.intersection(h).length > 1.4 for h in halls)
        common = draft.labels[k] in HALLS | {"Kitchen", "Living_Room"}
        if not taken and not common and rectangular and touches and 1.8 <= short <= 3.4 and 3.0 <= long <= 5.0:
            best.append((shape.area, k))
    return min(best)[1] if best else None


def ground(draft: Draft, stair: int | None) -> Draft:
    """The lowest storey: the stair's room under its name."""
    labels = list(draft.labels)
    if stair is not None:
        labels[stair] = "Stair"
    return replace(draft, labels=labels)


def upper(draft: Draft, rng: Generator, stair: int) -> Draft:
    """A storey above: other rooms between the same walls; a landing at the hall, and beyond it the stair's void."""
    labels, shapes = list(draft.labels), list(draft.shapes)
    for k, label in enumerate(labels):
        if label in {"Living_Room", "Kitchen", "Dining_Room", "Garage"}:
            labels[k] = str(rng.choice(["Bedroom", "Office", "Child_Room", "Bedroom"]))
    hall = shapely.union_all([s for label, s in zip(draft.labels, draft.shapes, strict=True) if label in HALLS])
    x1, y1, x2, y2 = shapes[stair].bounds
    deep = float(np.round(rng.uniform(1.1, 1.4), 2))
    options = [
        box(x1, y1, x2, y1 + deep),
        box(x1, y2 - deep, x2, y2),
        box(x1, y1, x1 + deep, y2),
        box(x2 - deep, y1, x2, y2),
    ]
    landing = max(options, key=lambda o: o.intersection(hall).length)
    labels[stair] = "Stair"
    well = shapes[stair].difference(landing)
    shapes[stair] = landing
    merged = [(stair, len(labels))]
    return Draft([*labels, "Void"], [*shapes, well], merged, dict(draft.private), draft.entrance)
