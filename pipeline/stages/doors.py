"""Algorithm 1, line 3: doors are where the two planes differ, L = {u : P_g(u) != P_d(u)}.

R1  A strip of L between two rooms is a passage if a robot may fit (``narrowest_m``); a narrower one stays wall.
R2  It is a ``door`` under a lintel or over a sill, an ``opening`` in a gap of full height. Where the source names its
    openings (IFC), it decides: with a door, or without.
R3  Under a lintel wider than ``widest_m`` two rooms meet without a door: each gets half of the strip.
R4  A strip between a room and the outside is an ``entrance``; it stays closed. A railing or a boundary is none.
"""

from __future__ import annotations

from dataclasses import replace

from shapely import Polygon

from houseexpo.plan import DoorKind
from pipeline.config import DoorsConfig
from pipeline.geometry.bridges import Bridge
from pipeline.geometry.closers import LAP_M
from pipeline.geometry.overlay import overlap, polygons_of, subtract, united
from pipeline.geometry.regions import OUTSIDE
from pipeline.values import Closer, Layout, Level, Passage, SourceOpening, Spaces


def find_doors(level: Level, layout: Layout, config: DoorsConfig) -> Spaces:
    """The rooms of a layout and the passages between them."""
    rooms = list(layout.rooms)
    passages: list[Passage] = []
    joins: set[tuple[int, int]] = set()
    for closer in layout.closers:
        bridge = closer.bridge
        if bridge is None or closer.kind in ("rail", "boundary") or bridge.width < config.narrowest_m:  # R1, R4
            continue
        a, b = sorted(bridge.sides)
        if a == OUTSIDE:
            passages.append(Passage(bridge, "entrance"))
        elif bridge.width > config.widest_m:  # R3
            rooms[bridge.sides[0]], rooms[bridge.sides[1]] = _shared(bridge, rooms)
            joins.add((a, b))
        else:
            passages.append(Passage(bridge, _kind(closer, bridge, level.openings)))  # R2
    notes: dict[str, int | str] = {"boundary": layout.boundary} if layout.boundary else {}
    return Spaces(layout.ground, tuple(rooms), tuple(passages), tuple(sorted(joins)), notes=notes)


def _kind(closer: Closer, bridge: Bridge, openings: tuple[SourceOpening, ...]) -> DoorKind:
    strip = bridge.strip()
    for opening in openings:
        if overlap(strip, opening.polygon).area > 0.5 * min(strip.area, opening.polygon.area):
            return "door" if opening.has_door else "opening"
    return "opening" if closer.kind == "gap" else "door"


def _shared(bridge: Bridge, rooms: list[Polygon]) -> tuple[Polygon, Polygon]:
    """The two rooms of a wide bridge, each with its half of the strip."""
    half = replace(bridge, depth=bridge.depth / 2)
    to_second = bridge.across * bridge.depth / 4
    near = replace(half, centre=bridge.centre - to_second).strip(deeper_m=LAP_M)
    far = replace(half, centre=bridge.centre + to_second).strip(deeper_m=LAP_M)
    first = polygons_of(united([rooms[bridge.sides[0]], near]))[0]
    second = polygons_of(subtract(united([rooms[bridge.sides[1]], far]), first))[0]
    return first, second
