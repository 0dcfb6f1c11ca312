"""A house as rooms and the ways between them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from houseexpo.plan import DoorKind
from pipeline.geometry.bridge import Bridge
from pipeline.geometry.regions import OUTSIDE


@dataclass(frozen=True, eq=False)
class Passage:
    """A way through a wall; the ``sides`` of its bridge are indices into the rooms of the same value, or OUTSIDE.

    ``why`` says of a cut what speaks for its place.
    """

    bridge: Bridge
    kind: DoorKind
    why: str = ""

    @property
    def leads_outside(self) -> bool:
        """Whether one side is the outside; such a passage stays closed in the outline."""
        return OUTSIDE in self.bridge.sides


@dataclass(frozen=True, eq=False)
class JoinedPair:
    """Two points (2, 2), metres, that a cut connected, and the radius of the disc that can go from one to the other."""

    points: npt.NDArray[np.float64]
    radius_m: float


@dataclass(frozen=True, eq=False)
class Spaces:
    """From stage ``doors`` on: a house as rooms and ways between them.

    ``walls`` is the closed plane. ``joins`` are pairs of rooms that meet without a wall and without a door (under a
    beam too wide for one). ``outlines`` are the outer contours, one a free-standing part of the house. ``joined`` are
    the pairs of points that cuts were made for. ``notes`` counts what the rules did, by rule.
    """

    walls: BaseGeometry
    rooms: tuple[Polygon, ...]
    passages: tuple[Passage, ...]
    joins: tuple[tuple[int, int], ...] = ()
    outlines: tuple[Polygon, ...] = ()
    joined: tuple[JoinedPair, ...] = ()
    notes: Mapping[str, int | str] = field(default_factory=dict)

    def keeping(self, keep: Sequence[int], **notes: int | str) -> Spaces:
        """Only these rooms, in this order, and the passages whose rooms are all kept or outside."""
        new = {old: k for k, old in enumerate(keep)} | {OUTSIDE: OUTSIDE}
        passages = []
        for p in self.passages:
            a, b = p.bridge.sides
            if a in new and b in new:
                passages.append(replace(p, bridge=replace(p.bridge, sides=(new[a], new[b]))))
        return replace(
            self,
            rooms=tuple(self.rooms[k] for k in keep),
            passages=tuple(passages),
            joins=tuple((new[a], new[b]) for a, b in self.joins if a in new and b in new),
            notes={**self.notes, **notes},
        )
