"""Erase a small part of the house that stands far from the main one, as the authors did with garages (section II).

Both must hold: its wall outline stands more than ``distance_m`` from the main part's, and its rooms have less than
``share`` of the main part's area. What is nearer or larger stays, and is a plan of its own (``stages.buildings``), or,
wall to wall with the main part, is joined by stage ``connectivity``.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pipeline.config import IsolatedConfig
from pipeline.geometry.rooms_and_passages import rooms_inside
from pipeline.values import Spaces


def erase_isolated(spaces: Spaces, config: IsolatedConfig) -> Spaces:
    """Drop the rooms of parts that stand apart."""
    outline_of, room_in = rooms_inside(spaces.outlines, spaces.rooms)
    inside = [np.sort(room_in[outline_of == k]).tolist() for k in range(len(spaces.outlines))]
    area = [sum(spaces.rooms[k].area for k in rooms) for rooms in inside]
    main = max(range(len(area)), key=lambda k: area[k])
    apart = {
        k
        for k, outline in enumerate(spaces.outlines)
        if k != main
        and outline.distance(spaces.outlines[main]) > config.distance_m
        and area[k] < config.share * area[main]
    }
    if not apart:
        return spaces
    keep = sorted(room for k, rooms in enumerate(inside) if k not in apart for room in rooms)
    left = spaces.keeping(keep, erased_parts=len(apart))
    return replace(left, outlines=tuple(o for k, o in enumerate(spaces.outlines) if k not in apart))
