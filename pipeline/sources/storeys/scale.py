"""Read the unit, scale and storey height that a person gives, or guess the unit from storeys and door heads."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from houseexpo.corrections.vocabulary import UNITS_M
from houseexpo.errors import ConfigError
from pipeline.sources.tolerances import (
    COMMON_STOREY_M,
    HEADS_M,
    MODEL_STOREY_M,
    NEAR_HEAD,
    SCALED,
    SCALES,
    SLACK,
    USUAL_HEAD_M,
    USUAL_STOREY_M,
)
from pipeline.tolerances import SPECK

UNITS = UNITS_M


def do_opening_heads_fit_unit(heads: Sequence[float], metres: float) -> bool:
    """Tell whether the heads of openings, in file units above the floor, speak for a unit of so many metres."""
    return not heads or any(HEADS_M[0] <= head * metres <= HEADS_M[1] for head in heads)


def has_head_at_door_height(heads: Sequence[float], metres: float) -> bool:
    """Tell whether an opening ends as high as doors do in most houses (R1), in a unit of so many metres."""
    return any(abs(math.log(head * metres / USUAL_HEAD_M)) < NEAR_HEAD for head in heads)


def unit_from_opening_heads(storey: float, heads: Sequence[float]) -> float | None:
    """Return metres in a file's unit, or None if no head fits any usual scale."""
    candidates = [(unit, 0.0) for name, unit in UNITS.items() if name != "ft"]
    candidates += [
        # more than heads and storey of such models differ, so that inches come last
        (unit * scale, SCALED + SPECK if name == "in" else SCALED)
        for name, unit in UNITS.items()
        if name != "ft"
        for scale in SCALES
    ]
    fitting = [each for each in candidates if MODEL_STOREY_M[0] <= storey * each[0] <= MODEL_STOREY_M[1]]
    best = min(((unlikely + _misfit(storey, heads, metres), metres) for metres, unlikely in fitting), default=None)
    return best[1] if best and best[0] < NEAR_HEAD * 2 + SCALED else None


def unit_from_storey(storey: float) -> float | None:
    """Return metres in a file's unit, or None if no usual scale gives a usual storey."""
    fitting = [scale for scale in SCALES if COMMON_STOREY_M[0] <= storey * scale <= COMMON_STOREY_M[1]]
    return min(fitting, key=lambda scale: abs(math.log(storey * scale / USUAL_STOREY_M)), default=None)


def _misfit(storey: float, heads: Sequence[float], metres: float) -> float:
    head = min((abs(math.log(head * metres / USUAL_HEAD_M)) for head in heads), default=math.inf)
    return (head if head < NEAR_HEAD else math.inf) + abs(math.log(storey * metres / USUAL_STOREY_M)) / SLACK


# What a person says of a house's size: its unit, its scale, the height of a storey.


def check_size_options(
    units: str = "auto", scale: str = "1", storey_height: str = "", resolution: str = "", **_others: str
) -> None:
    """Raise ConfigError if one of a build's options is impossible, whether or not its sources have a use for it.

    So are two of them that say how large a house is, each by itself.
    """
    metres_per_unit(units)
    parse_positive_option("scale", scale)
    for option, text in (("storey_height", storey_height), ("resolution", resolution)):
        if text:
            parse_positive_option(option, text)
    other = "units" if units != "auto" else "scale" if float(scale) != 1.0 else ""
    if storey_height and other:
        raise ConfigError(f"expected one of storey_height and {other}, found both; each says how large the model is")


def metres_per_unit(units: str) -> float | None:
    """Return the metres in one unit (m, cm, mm, in, ft, or a number of metres), None for "auto"."""
    if units == "auto":
        return None
    return UNITS.get(units) or parse_positive_option("units", units, f" or one of auto, {', '.join(UNITS)}")


def said_size(options: Mapping[str, str]) -> tuple[float | None, float]:
    """Return the metres in the file's own unit that a person gives, None if nobody does, and the scale besides."""
    return metres_per_unit(options.get("units", "auto")), parse_positive_option("scale", options.get("scale", "1"))


def parse_positive_option(option: str, text: str, also: str = "") -> float:
    """Return an option's number; ``also`` is what else it may be, for the error."""
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not (math.isfinite(number) and number > 0):
        raise ConfigError(f"{option}={text!r}: expected a number above 0{also}")
    return number
