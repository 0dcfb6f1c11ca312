"""The floor plan: frozen values, checked when made."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from shapely import Polygon

Ring: TypeAlias = npt.NDArray[np.float64]
"""(n, 2) vertices in metres, unclosed (the first is not repeated)."""

DoorKind: TypeAlias = Literal["door", "opening", "entrance", "cut"]
Box: TypeAlias = tuple[float, float, float, float]


@dataclass(frozen=True, eq=False)
class Room:
    """A room: refined free space with the doors closed."""

    id: int
    label: str
    polygon: Ring
    holes: tuple[Ring, ...] = ()
    source_labels: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Door:
    """A passage between two rooms, or a closed one to the outside (kind "entrance", ``rooms[1]`` is None)."""

    id: int
    kind: DoorKind
    segment: tuple[tuple[float, float], tuple[float, float]]
    width: float
    polygon: Ring
    rooms: tuple[int | None, int | None]


@dataclass(frozen=True)
class Frame:
    """Where a plan stands in its source: ``matrix`` takes plan metres (x, y, 1) to the source's plan axes in metres."""

    matrix: tuple[tuple[float, float, float], tuple[float, float, float]]
    up: Literal["y", "z"]
    floor: float
    level: int


@dataclass(frozen=True)
class Navigability:
    """What a disc robot of one radius can reach (FORMAT.md section 2)."""

    components: int
    largest_share: float
    narrowest: float


@dataclass(frozen=True, eq=False)
class FloorPlan:
    """One floor plan of the data set (FORMAT.md)."""

    id: str
    verts: Ring
    room_num: int
    room_category: Mapping[str, tuple[Box, ...]]
    holes: tuple[Ring, ...] = ()
    rooms: tuple[Room, ...] = ()
    doors: tuple[Door, ...] = ()
    frame: Frame | None = None
    navigability: Mapping[str, Navigability] | None = None
    provenance: Mapping[str, Any] | None = field(default=None, repr=False)

    @cached_property
    def free_space(self) -> Polygon:
        """The outline less the holes."""
        from shapely import Polygon

        return Polygon(self.verts, self.holes)
