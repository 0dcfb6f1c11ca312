"""Read a ``SimulatorConfig`` from YAML: our own nested keys, or the published simulator's config.yaml, converted."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any, NamedTuple

from houseexpo.configuration import Config, check_number, config_from_mapping, mapping_entries
from houseexpo.errors import ConfigError
from houseexpo.files import decode_yaml, read_file

_DEEPEST = 20


class _Key(NamedTuple):
    """The conversion of a published key: our key, the value for a number of pixels per metre, and a note."""

    own: str
    convert: Callable[[Any, float], object]
    remark: str = ""


def _same(value: float, _: float) -> float:
    return value


def _metres(value: float, pixels_per_metre: float) -> float:
    return value / pixels_per_metre


def _double(value: float, _: float) -> float:
    return 2 * value


def _flag(value: float, _: float) -> bool:
    return value == 1


_HALF = "a half length; its simulator halves it again, so halve it for obstacles of the same size"
_FLAGS = {"mode", "resetRandomPose"}
_PUBLISHED: dict[str, _Key | None] = {
    "json_dir": None,
    "map_id_set": None,
    "meter2pixel": _Key("pixels_per_metre", _same),
    "mode": _Key("known_map", _flag),
    "obstacle.number": _Key("obstacles.random.number", _same),
    "obstacle.size.min": _Key("obstacles.random.size_m[0]", _double, _HALF),
    "obstacle.size.max": _Key("obstacles.random.size_m[1]", _double, _HALF),
    "robotRadius": _Key("robot.radius_m", _same),
    "stepLength.linear": _Key("robot.step_m", _same),
    "stepLength.angular": _Key("robot.turn_deg", _same),
    "startPose.x": _Key("start.x_m", _same, "from the centre of the house; its simulator takes whole metres"),
    "startPose.y": _Key("start.y_m", _same, "from the centre of the house; its simulator takes whole metres"),
    "startPose.theta": _Key("start.heading_deg", _same, "its simulator takes whole radians"),
    "resetRandomPose": _Key("start.random", _flag, "a start that does not fit is an error, and no random one"),
    "laser.range": _Key("laser.range_m", _same),
    "laser.fov": _Key("laser.fov_deg", _same),
    "laser.resolution": _Key("laser.resolution_deg", _same, 'laser.rule "rays" has its rays; "sector" leaves no gaps'),
    "laser.noiseSigma": _Key("noise.laser_m", _metres, "from pixels; along each ray, and not rounded to whole ones"),
    "slamError.linear": _Key("noise.registration_m", _metres, "from pixels; without its simulator's hidden factor 0.1"),
    "slamError.angular": _Key("noise.registration_deg", _same, "without its simulator's hidden factor 0.1"),
    "stateSize.x": _Key("observation.size_m", _same),
    "stateSize.y": _Key("observation.size_m", _same),
}
_SHAPES = ["rectangle", "ellipse", "circle"]  # the shapes that the published simulator draws at random


def read_yaml_config(kind: type[Config], path: str | os.PathLike[str]) -> tuple[Config, list[str]]:
    """Return the ``SimulatorConfig`` (``kind``) in a file, and a line for each published key, converted or ignored.

    Raises
    ------
    ConfigError
        The file cannot be read or is not YAML, a key is unknown, or a value is invalid; the error names file and key.
    """
    try:
        loaded = decode_yaml(read_file(Path(path)), _DEEPEST)
    except OSError as error:
        raise ConfigError(f"{path}: expected a readable file, found: {error.strerror}") from error
    except ValueError as error:
        raise ConfigError(f"{path}: expected YAML, found: {str(error).removeprefix('is no YAML: ')}") from error
    try:
        if not _is_published(kind, loaded):
            return config_from_mapping(kind, {} if loaded is None else loaded), []
        return _convert(kind, loaded)
    except ConfigError as error:
        raise ConfigError(f"{path}: {error}") from error


def _is_published(kind: type, loaded: object) -> bool:
    """Return whether a file has the published simulator's keys; raise ConfigError if it has both kinds."""
    if not isinstance(loaded, Mapping):
        return False
    laser = loaded.get("laser")
    inner = [f"laser.{name}" for name in laser] if isinstance(laser, Mapping) else []
    published = [key for key in (*loaded, *inner) if key != "laser" and key in {*_sections(""), *_PUBLISHED}]
    own = [key for key in loaded if key != "laser" and key in {f.name for f in fields(kind)}]
    if published and own:
        raise ConfigError(
            f"expected the published simulator's keys or those of SimulatorConfig, found both: {published[0]!r} is one "
            f"of the former, {own[0]!r} of the latter"
        )
    return bool(published)


def _convert(kind: type[Config], loaded: Mapping[str, object]) -> tuple[Config, list[str]]:
    """Return the configuration for published keys, and a line on the conversion of each."""
    given = dict(_leaves(loaded, ""))
    if given.get("stateSize.x", given.get("stateSize.y")) != given.get("stateSize.y", given.get("stateSize.x")):
        raise ConfigError(f"stateSize.y: expected x's {given['stateSize.x']!r}, found {given['stateSize.y']!r}")
    ppm: Any = given.get("meter2pixel", kind.pixels_per_metre)  # type: ignore[attr-defined]  # a SimulatorConfig
    check_number(ppm, "meter2pixel", above=0.0)
    own, notes = {}, []
    for name, value in given.items():
        key = _PUBLISHED[name]
        if key is None:
            notes.append(f"{name}: {value!r} is left out; the houses are an argument, `dataset`")
            continue
        if name in _FLAGS and value not in (0, 1):
            raise ConfigError(f"{name}: expected 0 or 1, found {value!r}")
        if name not in _FLAGS:
            check_number(value, name)
        own[key.own] = key.convert(value, ppm)
        notes.append(f"{name}: {value!r} -> {key.own}: {own[key.own]!r}" + (f" ({key.remark})" if key.remark else ""))
    if any(name.startswith("startPose") for name in given):
        own.setdefault("start.random", False)
    try:
        return config_from_mapping(kind, _nest(own)), notes
    except ConfigError as error:
        published = [name for name, key in _PUBLISHED.items() if key and str(error).startswith(key.own.split("[")[0])]
        raise ConfigError(f"{' and '.join(published)}: {error}" if published else str(error)) from error


def _leaves(value: object, section: str) -> Iterator[tuple[str, object]]:
    """Yield published keys in dotted form with their values; raise ConfigError if a key is unknown."""
    for name, part in mapping_entries(value, section, [key.rpartition(".")[2] for key in _sections(section)]):
        key = f"{section}.{name}" if section else name
        if key in _PUBLISHED:
            yield key, part
        else:
            yield from _leaves(part, key)


def _sections(section: str) -> list[str]:
    """Return the published keys directly below a section."""
    depth = section.count(".") + 1 if section else 0
    below = [key for key in _PUBLISHED if not section or key.startswith(f"{section}.")]
    return list(dict.fromkeys(".".join(key.split(".")[: depth + 1]) for key in below))


def _nest(own: dict[str, object]) -> dict[str, Any]:
    """Return dotted keys as nested mappings, with random obstacles only if there are any."""
    many = own.pop("obstacles.random.number", 0)
    size = [own.pop(f"obstacles.random.size_m[{i}]", default) for i, default in enumerate((0.2, 0.8))]
    found: dict[str, Any] = {"start": {"origin": "centre"}}
    if many != 0:
        found["obstacles"] = {"random": {"number": [many, many], "size_m": size, "shapes": _SHAPES}}
    for key, value in own.items():
        *sections, name = key.split(".")
        into = found
        for section in sections:
            into = into.setdefault(section, {})
        into[name] = value
    return found
