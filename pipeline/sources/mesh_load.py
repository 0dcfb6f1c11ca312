"""A mesh file into plain triangles, as the file has them; whatever is wrong with it becomes a Rejection."""

from __future__ import annotations

import logging
import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh

from pipeline.rejection import Reason, Rejection
from pipeline.sources.mesh_count import HEAD_BYTES, declared_faces
from pipeline.sources.naming import check_file
from pipeline.values import Mesh

SUFFIXES = (".dae", ".glb", ".gltf", ".obj", ".off", ".ply", ".stl")
MAX_FACES = 5_000_000
"""A mesh with more ends as TOO_LARGE, before it is read where its header says so; 1.7 million need 0.5 GB here."""


@dataclass(frozen=True)
class Convention:
    """What a format, or the file itself, says of its frame: up axis, and metres in one unit (None: it does not say).

    ``binding``: the axis is laid down (glTF's specification, COLLADA's ``up_axis``), not mere custom.
    """

    up: str
    metres: float | None
    binding: bool = False


def convention(path: Path) -> Convention:
    """Return the format's convention; only COLLADA writes its own into the file."""
    suffix = path.suffix.lower()
    if suffix == ".dae":
        with path.open("rb") as stream:
            head = stream.read(HEAD_BYTES)
        up = re.search(rb"<up_axis>\s*([XYZ])_UP", head)
        unit = re.search(rb"<unit[^>]*\bmeter\s*=\s*[\"']([0-9.eE+-]+)[\"']", head)
        return Convention("z" if up and up[1] == b"Z" else "y", float(unit[1]) if unit else None, up is not None)
    if suffix in {".glb", ".gltf"}:
        return Convention("y", 1.0, binding=True)
    return Convention("y" if suffix == ".obj" else "z", None)


def load_triangles(path: Path, max_faces: int = MAX_FACES) -> Mesh:
    """Read the file's triangles, scenes put together with their transforms, in the file's own axes and unit.

    Raises
    ------
    Rejection
        MISSING_FILE, EMPTY, TOO_LARGE, NOT_FINITE, or UNREADABLE (garbage, truncated, broken indices).
    """
    check_file(path)
    declared = declared_faces(path)
    if declared is not None and declared > max_faces and _can_hold(path, declared):
        raise _too_large(path, declared, max_faces)
    try:
        with _quiet():
            scene = trimesh.load_scene(path, process=False, skip_materials=True)
            vertices, faces = _flatten(scene)
    except MemoryError:
        raise
    except Exception as error:  # the loaders raise whatever broken bytes lead them to
        detail = f"{path.name} cannot be read as {path.suffix[1:]}: {type(error).__name__}: {str(error)[:200]}"
        raise Rejection("source", Reason.UNREADABLE, detail, "export or copy the file again") from error
    return _checked(path, vertices, faces, declared, max_faces)


def _can_hold(path: Path, declared: int) -> bool:
    """Tell a large mesh from garbage where a header's count should be: a face takes at least 6 bytes."""
    return path.suffix.lower() == ".gltf" or path.stat().st_size >= 6 * declared


def _too_large(path: Path, found: int, limit: int) -> Rejection:
    detail = f"{path.name} has {found:,} faces; the limit is {limit:,}"
    return Rejection("source", Reason.TOO_LARGE, detail, "simplify the mesh, or leave its furniture out")


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep the readers' warnings and log lines to themselves: what matters comes back as a Rejection."""
    loggers = [logging.getLogger(name) for name in ("trimesh", "collada")]
    before = [logger.disabled for logger in loggers]
    for logger in loggers:
        logger.disabled = True
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            yield
    finally:
        for logger, disabled in zip(loggers, before, strict=True):
            logger.disabled = disabled


def _flatten(scene: trimesh.Scene) -> tuple[np.ndarray, np.ndarray]:
    """Unite the meshes of a scene, each at its place; a mirroring transform turns its faces over."""
    vertices, faces, offset = [np.empty((0, 3))], [np.empty((0, 3), np.int64)], 0
    for node in scene.graph.nodes_geometry:
        transform, name = scene.graph[node]
        part = scene.geometry[name]
        if not isinstance(part, trimesh.Trimesh):
            continue
        points = np.asarray(part.vertices, np.float64)
        corners = np.asarray(part.faces, np.int64)
        if not np.array_equal(transform, np.eye(4)):
            points = points @ transform[:3, :3].T + transform[:3, 3]
            corners = corners[:, ::-1] if np.linalg.det(transform[:3, :3]) < 0 else corners
        vertices.append(points)
        faces.append(corners + offset)
        offset += len(points)
    return np.concatenate(vertices), np.concatenate(faces)


def _checked(path: Path, vertices: np.ndarray, faces: np.ndarray, declared: int | None, max_faces: int) -> Mesh:
    if declared is not None and len(faces) < declared:
        detail = f"{path.name} announces {declared:,} faces and holds {len(faces):,}"
        raise Rejection("source", Reason.UNREADABLE, detail, "the file is truncated: copy it again")
    if len(faces) == 0:
        raise Rejection("source", Reason.EMPTY, f"{path.name} holds no face", "export the house as triangles")
    if len(faces) > max_faces:
        raise _too_large(path, len(faces), max_faces)
    if faces.min() < 0 or faces.max() >= len(vertices):
        detail = f"{path.name} names vertex {faces.max():,} of {len(vertices):,}"
        raise Rejection("source", Reason.UNREADABLE, detail, "the file is truncated or broken: export it again")
    bad = int((~np.isfinite(vertices).all(axis=1)).sum())
    if bad:
        detail = f"{path.name} has {bad:,} vertices that are NaN or infinite"
        raise Rejection("source", Reason.NOT_FINITE, detail, "repair the mesh, or export it again")
    return Mesh(vertices, faces)
