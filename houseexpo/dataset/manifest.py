"""Read the TOML manifest that says where to download a data set and how to verify it, by default the published one."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from houseexpo.configuration import config_from_mapping, convert_value, read_config
from houseexpo.errors import ConfigError

_HOMES: Final = tuple(Path(__file__).parents[up] / "data_manifests" for up in (1, 2))
"""The folder is part of the package in the wheel, and lies beside it in the repository."""


@dataclass(frozen=True)
class DownloadFile:
    """A file to download; ``git_blob`` is the SHA-1 of ``blob <size>``, a zero byte and its bytes."""

    file: str
    url: str
    git_blob: str

    def __post_init__(self) -> None:
        _check_name(self.file, "file")
        if not re.fullmatch("[0-9a-f]{40}", self.git_blob):
            raise ConfigError(f"git_blob: expected 40 hex digits, found {self.git_blob!r}")


@dataclass(frozen=True)
class DownloadManifest:
    """A published data set: an archive of plans, lists of ids, and ids of subsets by name."""

    name: str
    licence: str
    source: str
    paper: str
    plans: int
    archive: DownloadFile
    lists: tuple[DownloadFile, ...] = ()
    subsets: dict[str, tuple[str, ...]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        _check_name(self.name, "name")


def _check_name(name: str, key: str) -> None:
    """Raise an error unless ``name`` is the name of a file or folder, without a path."""
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._ -]{0,99}", name):
        raise ConfigError(f"{key}: expected a plain name of letters, digits, '.', '_' and '-', found {name!r}")


def load_manifest(path: Path | None = None) -> DownloadManifest:
    """Read a manifest, by default that of the published data set; raise ConfigError if it is invalid."""
    return read_config(DownloadManifest, manifest_path("houseexpo") if path is None else path, convert=_convert)


def _convert(value: Any, hint: Any, key: str) -> Any:
    """Return a value of a manifest: files to download in a list, or another value as its type."""
    if hint == tuple[DownloadFile, ...] and isinstance(value, list):
        return tuple(
            config_from_mapping(DownloadFile, each, f"{key}[{i}]", convert=convert_value)
            for i, each in enumerate(value)
        )
    return convert_value(value, hint, key)


def manifest_path(name: str) -> Path:
    """Return the path of a manifest that comes with the project: "benchmark", "demo", "houseexpo" or "suncg"."""
    for home in _HOMES:
        if (file := home / f"{name}.toml").exists():
            return file
    known = sorted(file.stem for home in _HOMES for file in home.glob("*.toml"))
    raise ConfigError(f"no manifest {name!r}; known: {', '.join(known)}")


def is_bundled_manifest(file: Path) -> bool:
    """Return whether a file is a manifest that comes with the project, in the wheel or in a clone."""
    return file.absolute().parent in {home.absolute() for home in _HOMES}
