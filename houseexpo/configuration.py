"""Read configurations: TOML files and nested mappings, made into frozen dataclasses and back; check their values.

A dataclass describes a table: its fields are the keys, with their types and defaults. Fields may be dataclasses, which
are tables in it. Unknown keys are refused. Every error names the key with its tables: ``planes.door_m``.
"""

from __future__ import annotations

import math
import tomllib
import types
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import MISSING, fields, is_dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

import msgspec
import numpy as np

from houseexpo.errors import ConfigError
from houseexpo.files import read_text

Config = TypeVar("Config")
Convert = Callable[[Any, Any, str], Any]
"""A function that converts a value to a type, given the value, the type and the key."""


def read_toml(file: Path) -> dict[str, Any]:
    """Return the contents of a TOML file; raise ConfigError if it cannot be read or is not TOML."""
    try:
        return tomllib.loads(read_text(file))
    except OSError as error:
        raise ConfigError(f"{file}: cannot be read ({error.strerror}); check the path") from None
    except UnicodeDecodeError:
        raise ConfigError(f"{file}: expected TOML, found bytes that are no text in UTF-8") from None
    except (ValueError, RecursionError) as error:  # also numbers of thousands of digits, and nesting as deep
        raise ConfigError(f"{file}: expected TOML, found {error}") from None


def read_config(kind: type[Config], file: Path, *, convert: Convert | None = None) -> Config:
    """Return the configuration in a TOML file (``config_from_mapping``); errors name the file."""
    found = read_toml(file)
    with name_in_config_errors(file):
        return config_from_mapping(kind, found, convert=convert)


@contextmanager
def name_in_config_errors(file: object) -> Iterator[None]:
    """Put the name of a file before the message of a ConfigError."""
    try:
        yield
    except ConfigError as error:
        raise ConfigError(f"{file}: {error}") from None


def config_from_mapping(
    kind: type[Config], value: object, key: str = "", *, convert: Convert | None = None, beside: Iterable[str] = ()
) -> Config:
    """Return a configuration from nested mappings; missing keys keep their defaults.

    Parameters
    ----------
    kind
        A dataclass. A field whose type is a union of dataclasses is a mapping with one entry, named after one of them:
        ``{"circle": {"radius_m": 0.3}}``.
    key
        The key of ``value``, for messages.
    convert
        A function for the values of fields that are not dataclasses, such as ``convert_value``. By default, lists
        become tuples, true and false are checked, and everything else is left to the dataclass.
    beside
        Keys that may stand beside those of the dataclass and are read elsewhere.

    Raises
    ------
    ConfigError
        A key is unknown or missing, or a value is invalid.
    """
    names = [f.name for f in fields(kind)]  # type: ignore[arg-type]  # a dataclass
    hints = get_type_hints(kind)
    given = {
        name: _field_value(hints[name], part, _join(key, name), convert)
        for name, part in mapping_entries(value, key, names, beside)
    }
    for f in fields(kind):  # type: ignore[arg-type]
        if f.name not in given and f.default is MISSING and f.default_factory is MISSING:
            raise ConfigError(f"{_join(key, f.name)}: expected a value, found none")
    return kind(**given)


def config_to_mapping(value: object) -> Any:  # a mapping for a configuration, a list for a tuple
    """Return plain values from which ``config_from_mapping`` makes the same configuration."""
    if is_dataclass(value):
        hints = get_type_hints(type(value))
        return {f.name: _plain(getattr(value, f.name), hints[f.name]) for f in fields(value)}
    return [config_to_mapping(part) for part in value] if isinstance(value, tuple) else value


def mapping_entries(
    value: object, key: str, known: Iterable[str], beside: Iterable[str] = ()
) -> list[tuple[str, object]]:
    """Return the entries of a mapping; raise ConfigError if it is not a mapping or has an unknown key."""
    known = list(known)
    if not isinstance(value, Mapping):
        raise ConfigError(f"{key or 'configuration'}: expected a mapping of {', '.join(known)}; found {value!r}")
    for name in value:
        if name not in known:
            near = get_close_matches(str(name), [*known, *beside], n=1, cutoff=0.5)
            advice = f"did you mean {_join(key, near[0])!r}? Known: " if near else "known: "
            every = ", ".join(_join(key, one) for one in [*known, *beside])
            raise ConfigError(f"unknown key {_join(key, str(name))!r}; {advice}{every}")
    return list(value.items())


def convert_value(value: Any, hint: Any, key: str) -> Any:
    """Return a value converted to a type; raise ConfigError if it has another one."""
    try:
        return msgspec.convert(value, hint)
    except msgspec.ValidationError as error:
        text = str(error)
        raise ConfigError(f"{key} = {value!r}: {text[0].lower()}{text[1:]}") from None


def _field_value(hint: Any, value: object, key: str, convert: Convert | None) -> Any:
    """Return the value of a field."""
    if is_dataclass(hint):
        return config_from_mapping(hint, value, key, convert=convert)  # type: ignore[arg-type]  # a dataclass, no object
    if convert is not None:
        return convert(value, hint, key)
    if kinds := _alternatives(hint):
        return None if value is None and type(None) in get_args(hint) else _one_of(kinds, value, key)
    if get_origin(hint) in {Union, types.UnionType}:
        return None if value is None else _field_value(get_args(hint)[0], value, key, None)
    if get_origin(hint) is tuple:
        if not isinstance(value, list | tuple):
            raise ConfigError(f"{key}: expected a list, found {value!r}")
        kind = get_args(hint)[0]
        return tuple(_field_value(kind, part, f"{key}[{i}]", None) for i, part in enumerate(value))
    if hint is bool and not isinstance(value, bool):
        raise ConfigError(f"{key}: expected true or false, found {value!r}")
    return value


def _alternatives(hint: Any) -> dict[str, type]:
    """Return the dataclasses of a union by their names in a mapping, none if the type is something else."""
    kinds = get_args(hint) if get_origin(hint) in {Union, types.UnionType} else ()
    kinds = tuple(kind for kind in kinds if kind is not type(None))
    return {kind.__name__.lower(): kind for kind in kinds} if len(kinds) > 1 and all(map(is_dataclass, kinds)) else {}


def _one_of(kinds: Mapping[str, type], value: object, key: str) -> object:
    found = mapping_entries(value, key, kinds)
    if len(found) != 1:
        raise ConfigError(f"{key}: expected one of {', '.join(kinds)}; found {len(found)} of them")
    name, parts = found[0]
    return config_from_mapping(kinds[name], parts, _join(key, name))


def _plain(value: object, hint: Any) -> Any:
    """Return the value of a field as plain values; one of several dataclasses is named."""
    named = value is not None and _alternatives(hint)
    return {type(value).__name__.lower(): config_to_mapping(value)} if named else config_to_mapping(value)


def _join(key: str, name: str) -> str:
    return f"{key}.{name}" if key else name


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
