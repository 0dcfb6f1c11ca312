"""The unit of a mesh that declares none, told by the heights of its storeys and of the heads of its doors.

R1  Doors are 2 to 2.1 m high in most houses, 1.8 to 2.75 m in all: a house that has openings, but none with its head
    there, is not in metres.
R2  A model is to one of the usual scales of one of the usual units. The one is taken that brings a head nearest to
    2.06 m and the storey, less strictly, to 2.7 m. Where a bare unit does so nearly as well it is that: inches are no
    millimetres at 1:25. And inches to a scale count for a little less than metres: 1:20 in inches is 1:50 in
    centimetres but for 1.6%.
R3  Where no unit fits and no head is seen, the usual scale of a model in metres is taken that brings its storey nearest
    to 2.65 m.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
SCALES = (10.0, 15.0, 20.0, 25.0, 50.0, 100.0)
USUAL_STOREY_M = 2.7
USUAL_HEAD_M = 2.06
HEADS_M = (1.8, 2.75)
HIGHEST_STOREY_M = 4.5
STOREY_M = (2.1, HIGHEST_STOREY_M)
LIKELY_M = (2.2, 3.3)
NEAR = 0.09  # of a head's height, in the logarithm
INCHES = 0.02  # more than the heads and the storey of two such models differ
SCALED = 0.03  # how much nearer a scaled unit must come than a bare one
SLACK = 6.0  # how much more freely storeys differ than heads


def is_usual(heads: Sequence[float], metres: float) -> bool:
    """R1: tell whether the heads of openings, in file units above the floor, speak for a unit of so many metres."""
    return not heads or any(HEADS_M[0] <= head * metres <= HEADS_M[1] for head in heads)


def has_usual_head(heads: Sequence[float], metres: float) -> bool:
    """Tell whether an opening ends as high as doors do in most houses (R1), in a unit of so many metres."""
    return any(abs(math.log(head * metres / USUAL_HEAD_M)) < NEAR for head in heads)


def model_scale(storey: float, heads: Sequence[float]) -> float | None:
    """R2: return metres in a file's unit, or None if no head fits any usual scale."""
    candidates = [(unit, 0.0) for name, unit in UNITS.items() if name != "ft"]
    candidates += [
        (unit * scale, SCALED + INCHES if name == "in" else SCALED)
        for name, unit in UNITS.items()
        if name != "ft"
        for scale in SCALES
    ]
    fitting = [each for each in candidates if STOREY_M[0] <= storey * each[0] <= STOREY_M[1]]
    best = min(((unlikely + _misfit(storey, heads, metres), metres) for metres, unlikely in fitting), default=None)
    return best[1] if best and best[0] < NEAR * 2 + SCALED else None


def storey_scale(storey: float) -> float | None:
    """R3: return metres in a file's unit, or None if no usual scale gives a usual storey."""
    fitting = [scale for scale in SCALES if LIKELY_M[0] <= storey * scale <= LIKELY_M[1]]
    return min(fitting, key=lambda scale: abs(math.log(storey * scale / 2.65)), default=None)


def _misfit(storey: float, heads: Sequence[float], metres: float) -> float:
    head = min((abs(math.log(head * metres / USUAL_HEAD_M)) for head in heads), default=math.inf)
    return (head if head < NEAR else math.inf) + abs(math.log(storey * metres / USUAL_STOREY_M)) / SLACK
