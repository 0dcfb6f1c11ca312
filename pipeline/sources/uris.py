"""Where the URIs of a Gazebo file lead: into the folder of the source and the given model folders, nowhere else.

R1  ``model://NAME/...`` and ``package://NAME/...`` mean the folder NAME: in the source's folder, at any depth, or in a
    model folder that was given (``--model-path``, ``GAZEBO_MODEL_PATH``, ``GZ_SIM_RESOURCE_PATH``).
R2  ``file://`` and bare paths are relative to the file that names them; an absolute one must lie in those folders.
R3  A host is never asked, and a path that leaves these folders, by ``..`` or by a link, is not opened.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from urllib.parse import unquote

MAX_FOLDERS = 20_000
VARIABLES = ("GAZEBO_MODEL_PATH", "GZ_SIM_RESOURCE_PATH")


def search_path(given: str, environment: Mapping[str, str]) -> str:
    """Return the folders to look in, those given first, as one text with the system's separator."""
    parts = [given, *(environment.get(name, "") for name in VARIABLES)]
    return os.pathsep.join(dict.fromkeys(part for text in parts for part in text.split(os.pathsep) if part))


class Places:
    """Finds files by URI; ``model_path`` as ``search_path`` returns it."""

    def __init__(self, root: Path, model_path: str) -> None:
        self._roots = [root.resolve(), *(Path(part).resolve() for part in model_path.split(os.pathsep) if part)]

    def find(self, uri: str, beside: Path) -> Path | None:
        """Return the file or folder that a URI means, or None if it is not there or may not be opened."""
        uri = uri.strip()
        scheme, found, path = uri.partition("://")
        if not found:
            return self._allowed(beside / uri) if uri else None
        if scheme in {"model", "package"}:  # R1
            name, _, rest = unquote(path).strip("/").partition("/")
            return next((p for folder in self._named(name) if (p := self._allowed(folder / rest))), None)
        return self._allowed(beside / unquote(path)) if scheme == "file" else None  # R2, R3

    def _named(self, name: str) -> list[Path]:
        if not name or name in {".", ".."}:
            return []
        near = [place for root in self._roots for place in (root / name, root / "models" / name)]
        same = [root for root in self._roots if root.name == name]
        return [*(place for place in near if place.is_dir()), *same, *self._models.get(name, [])]

    @cached_property
    def _models(self) -> dict[str, list[Path]]:
        """Folders below the source's by name, the highest first."""
        found: dict[str, list[Path]] = {}
        for count, (folder, inner, _) in enumerate(os.walk(self._roots[0])):
            inner.sort()
            if count >= MAX_FOLDERS:
                break
            found.setdefault(Path(folder).name, []).append(Path(folder))
        return {name: sorted(each, key=lambda p: (len(p.parts), p)) for name, each in found.items()}

    def _allowed(self, path: Path) -> Path | None:
        """R3."""
        try:
            real = path.resolve(strict=True)
        except (OSError, RuntimeError, ValueError):
            return None
        return real if any(real.is_relative_to(root) for root in self._roots) else None
