"""At which height people stand on a storey.

R1  A storey's elevation stands unless its walls' feet lie off it (elevations that an exporter left at 0): then those.
R2  Doors' sills, the floors of spaces and the tops of slabs vote; where more of them agree on another height near the
    elevation than on the elevation, that is the floor: a screed that nobody drew, doors that start a step above it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pipeline.sources.ifc_file import Building, Part, Storey
from pipeline.sources.ifc_rooms import is_room
from pipeline.sources.ifc_shapes import footprint

OFF_M = 0.6  # what lies farther from a storey's elevation is not of its floor
AGREE_M = 0.08
SLAB_M2 = 20.0  # so much of a slab votes as one door
SLAB_VOTES = 3.0
TALL_M = 1.8


@dataclass(frozen=True)
class _Vote:
    height: float
    weight: float


def floor_height(building: Building, storey: Storey) -> float:
    """Height of the storey's floor in project axes, metres."""
    given = _grounded(building.walls, storey)
    votes = [_Vote(given, 1.0)]
    votes += [_Vote(float(hole.mesh.vertices[:, 2].min()), 1.0) for hole in building.holes if hole.has_door]
    votes += [_Vote(space.bottom, 1.0) for space in building.spaces if space.storey == storey.key and is_room(space)]
    near = [vote for vote in votes if abs(vote.height - given) <= OFF_M]
    near += [_slab(slab) for slab in building.slabs if abs(slab.top - given) <= OFF_M]
    best = max(near, key=lambda vote: (_support(near, vote.height), -abs(vote.height - given)))
    if _support(near, best.height) <= _support(near, given):
        return given
    agreeing = [vote.height for vote in near if abs(vote.height - best.height) <= AGREE_M]
    return float(np.median(agreeing))  # R2


def _grounded(walls: Sequence[Part], storey: Storey) -> float:
    """R1."""
    feet = [part.bottom for part in walls if part.storey == storey.key and part.top - part.bottom >= TALL_M]
    middle = float(np.median(feet)) if feet else storey.elevation_m
    return middle if abs(middle - storey.elevation_m) > OFF_M else storey.elevation_m


def _slab(slab: Part) -> _Vote:
    return _Vote(slab.top, min(footprint(slab.mesh).area / SLAB_M2, SLAB_VOTES))


def _support(votes: Sequence[_Vote], height: float) -> float:
    return sum(vote.weight for vote in votes if abs(vote.height - height) <= AGREE_M)
