"""What a person says of a house's size: its unit, its scale, the height of a storey."""

from __future__ import annotations

import math

from houseexpo.errors import ConfigError
from pipeline.sources.scale import UNITS


def check_sizes(units: str = "auto", scale: str = "1", storey_height: str = "", **_others: str) -> None:
    """Raise ConfigError if one of a build's options is impossible, whether or not its sources have a use for it."""
    metres_of(units)
    above_zero("scale", scale)
    if storey_height:
        above_zero("storey_height", storey_height)


def metres_of(units: str) -> float | None:
    """Return the metres in one unit (m, cm, mm, in, ft, or a number of metres), None for "auto"."""
    if units == "auto":
        return None
    return UNITS.get(units) or above_zero("units", units, f" or one of auto, {', '.join(UNITS)}")


def above_zero(option: str, text: str, also: str = "") -> float:
    """Return an option's number; ``also`` is what else it may be, for the error."""
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not (math.isfinite(number) and number > 0):
        raise ConfigError(f"{option}={text!r}: expected a number above 0{also}")
    return number
