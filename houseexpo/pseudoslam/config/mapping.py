"""Conversion of configurations to and from nested mappings of plain values, as in YAML and JSON."""

from __future__ import annotations

import types
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, fields, is_dataclass
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config.shapes import Shape

Config = TypeVar("Config")
_SHAPES: dict[str, type] = {shape.__name__.lower(): shape for shape in get_args(Shape)}


def config_from(kind: type[Config], value: object, key: str = "") -> Config:
    """Return a configuration from nested mappings; missing keys keep their defaults.

    A shape is a mapping with one entry, such as ``{"circle": {"radius_m": 0.3}}``. ``key`` is the key of ``value`` in
    error messages.

    Raises
    ------
    ConfigError
        A key is unknown or missing, or a value is invalid; the error names the key.
    """
    names = [f.name for f in fields(kind)]  # type: ignore[arg-type]  # a dataclass
    hints = get_type_hints(kind)
    given = {name: _made(hints[name], part, _join(key, name)) for name, part in entries(value, key, names)}
    for f in fields(kind):  # type: ignore[arg-type]
        if f.name not in given and f.default is MISSING and f.default_factory is MISSING:
            raise ConfigError(f"{_join(key, f.name)}: expected a value, found none")
    return kind(**given)


def mapping_from(value: object) -> Any:  # a mapping for a configuration, a list for a tuple
    """Return plain values from which ``config_from`` makes the same configuration."""
    if is_dataclass(value):
        found = {f.name: mapping_from(getattr(value, f.name)) for f in fields(value)}
        return {type(value).__name__.lower(): found} if isinstance(value, get_args(Shape)) else found
    return [mapping_from(part) for part in value] if isinstance(value, tuple) else value


def entries(value: object, key: str, known: Iterable[str]) -> list[tuple[str, object]]:
    """Return the entries of a mapping; raise ConfigError if it is not a mapping or has an unknown key."""
    known = list(known)
    if not isinstance(value, Mapping):
        raise ConfigError(f"{key or 'configuration'}: expected a mapping of {', '.join(known)}; found {value!r}")
    for name in value:
        if name not in known:
            others = ", ".join(_join(key, one) for one in known)
            raise ConfigError(f"unknown key {_join(key, str(name))!r}; known: {others}")
    return list(value.items())


def _made(hint: Any, value: object, key: str) -> Any:  # any type of a field
    """Return the value of a field; the configuration itself checks numbers and names."""
    if hint == Shape:
        return _shape(value, key)
    if get_origin(hint) in {Union, types.UnionType}:
        return None if value is None else _made(get_args(hint)[0], value, key)
    if is_dataclass(hint):
        return config_from(hint, value, key)  # type: ignore[arg-type]  # a dataclass, not one of its objects
    if get_origin(hint) is tuple:
        if not isinstance(value, list | tuple):
            raise ConfigError(f"{key}: expected a list, found {value!r}")
        kind = get_args(hint)[0]
        return tuple(_made(kind, part, f"{key}[{i}]") for i, part in enumerate(value))
    if hint is bool and not isinstance(value, bool):
        raise ConfigError(f"{key}: expected true or false, found {value!r}")
    return value


def _shape(value: object, key: str) -> object:
    found = entries(value, key, _SHAPES)
    if len(found) != 1:
        raise ConfigError(f"{key}: expected one of {', '.join(_SHAPES)}; found {len(found)} of them")
    name, parts = found[0]
    return config_from(_SHAPES[name], parts, _join(key, name))


def _join(key: str, name: str) -> str:
    return f"{key}.{name}" if key else name
