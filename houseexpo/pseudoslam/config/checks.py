"""Check the values of a configuration when it is constructed. Every failure is a ConfigError that names the key."""

from __future__ import annotations

import math

import numpy as np

from houseexpo.errors import ConfigError


def check_number(
    value: object, key: str, *, above: float = -math.inf, at_least: float = -math.inf, at_most: float = math.inf
) -> None:
    """Raise ConfigError unless ``value`` is a finite number within the limits."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise ConfigError(f"{key}: expected a finite number, {describe_found(value)}")
    if value <= above:
        raise ConfigError(f"{key}: expected more than {above:g}, found {value!r}")
    if value < at_least:
        raise ConfigError(f"{key}: expected at least {at_least:g}, found {value!r}")
    if value > at_most:
        raise ConfigError(f"{key}: expected at most {at_most:g}, found {value!r}")


def check_whole_number(value: object, key: str, *, at_least: int, at_most: float = math.inf) -> None:
    """Raise ConfigError unless ``value`` is a whole number within the limits."""
    if isinstance(value, bool) or not isinstance(value, int) or value < at_least:
        raise ConfigError(f"{key}: expected a whole number of at least {at_least}, {describe_found(value)}")
    if value > at_most:
        raise ConfigError(f"{key}: expected a whole number of at most {at_most}, found {value!r}")


def describe_found(value: object) -> str:
    """Return the found value as text; for a number of numpy, which would look right, with advice to convert it."""
    strange = isinstance(value, np.number) and not isinstance(value, float)
    return f"found {value!r}" + ("; convert it to a Python number with .item()" if strange else "")


def check_above_zero(config: object, where: str, *names: str, at_most: float = math.inf) -> None:
    """Raise ConfigError unless the fields are numbers above 0 and at most ``at_most``."""
    for name in names:
        value = getattr(config, name)
        if not (type(value) is float and 0.0 < value < math.inf and value <= at_most):  # the common case
            check_number(value, f"{where}.{name}", above=0.0, at_most=at_most)


def check_one_of(value: object, key: str, known: tuple[str, ...]) -> None:
    """Raise ConfigError unless ``value`` is one of the known names."""
    if value not in known:
        raise ConfigError(f"{key}: expected one of {', '.join(known)}; found {value!r}")
