"""Hash what an input's plans depend on besides its files: parameters, corrections, code, versions of libraries."""

from __future__ import annotations

import hashlib
import platform
import re
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from functools import cache, lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import msgspec

import houseexpo
import pipeline
from houseexpo.corrections import Override
from pipeline.batch.disk import path_to_text
from pipeline.config_file import BuildConfig
from pipeline.stages.logistic import WEIGHTS
from pipeline.values import Input

LIBRARIES = (
    "ifcopenshell",
    "manifold3d",
    "networkx",
    "numba",
    "numpy",
    "opencv-python-headless",
    "scipy",
    "shapely",
    "trimesh",
)
"""Libraries whose versions may show in a plan."""

_ROOTS = ("pipeline.batch.job", "pipeline.algorithm")
_FOR_TYPES_ONLY = re.compile(r"^if TYPE_CHECKING:.*\n(?:(?: .*)?\n)*", re.MULTILINE)
_IMPORT = re.compile(r"^ *(?:from ([\w.]+) import (\([^)]*\)|.*)|import (.*))$", re.MULTILINE)
_BESIDE_NAMES = re.compile(r"#.*|[()]")
_OURS = {package.__name__: Path(package.__path__[0]) for package in (houseexpo, pipeline)}


def recipe_digest(item: Input, config: BuildConfig, overrides: Mapping[str, Override]) -> str:
    """Return a hash of everything that an input's outcomes depend on, except the files that its reader reads.

    ``overrides`` are those of the input. Where it lies is no part of it: the same files elsewhere give the same plans.
    """
    own = {name: asdict(override) for name, override in overrides.items()}
    parts = (
        item.id,
        item.reader,
        path_to_text(item.key),
        item.options,
        _parameters(config),
        own,
        code_digest(),
        library_versions(),
    )
    return hashlib.sha256(msgspec.json.encode(parts, order="deterministic")).hexdigest()


@lru_cache(maxsize=4)
def _parameters(config: BuildConfig) -> str:
    return config.digest()


@cache
def library_versions() -> dict[str, str]:
    """Return the versions of Python and of the installed libraries that compute geometry."""
    found = {"python": ".".join(platform.python_version_tuple()[:2])}
    for name in LIBRARIES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:  # an extra that is not installed made no plan
            continue
    return found


@cache
def code_digest() -> str:
    """Return a hash of what a worker runs: the job, every reader, what they import of ours, and the models' weights."""
    readers = (file.relative_to(_OURS["pipeline"].parent) for file in (_OURS["pipeline"] / "sources").rglob("*.py"))
    modules = modules_digest(*_ROOTS, *(".".join(file.with_suffix("").parts) for file in readers))
    return hashlib.sha256(modules.encode() + WEIGHTS.read_bytes()).hexdigest()


@cache
def modules_digest(*names: str) -> str:
    """Return a hash of modules and of what they import of ours, except imports for types only."""
    digest = hashlib.sha256()
    for name, file in sorted(_modules(names).items()):
        digest.update(name.encode() + b"\0" + hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()


def _modules(names: Iterable[str]) -> dict[str, Path]:
    """Return the files of those modules by name."""
    waiting = list(names)
    found: dict[str, Path] = {}
    while waiting:
        name = waiting.pop()
        if name in found or (file := _file(name)) is None:
            continue
        found[name] = file
        waiting.extend([name.rpartition(".")[0], *_imports(file)])
    return found


def _file(name: str) -> Path | None:
    """Return a module's file, without importing it, or None if the name is no module of ours."""
    package, *parts = name.split(".")
    if package not in _OURS:
        return None
    place = _OURS[package].joinpath(*parts)
    return next((file for file in (place.with_suffix(".py"), place / "__init__.py") if file.is_file()), None)


@cache
def _imports(file: Path) -> tuple[str, ...]:
    """Return the modules that a module imports anywhere; ``from a import b`` may mean a and a.b.

    The lines that begin an import are looked for: to parse all modules takes half a second at the start of each build.
    """
    text = _FOR_TYPES_ONLY.sub("", file.read_text(encoding="utf-8"))
    found: list[str] = []
    for package, members, modules in _IMPORT.findall(text):
        names = [each.split()[0] for each in _BESIDE_NAMES.sub("", members or modules).split(",") if each.strip()]
        found += [package, *(f"{package}.{name}" for name in names)] if package else names
    return tuple(found)
