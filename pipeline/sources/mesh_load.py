"""A mesh file into named triangles, as the file has them; whatever is wrong with it becomes a Rejection."""

from __future__ import annotations

import logging
import math
import re
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import trimesh

from pipeline.rejection import Reason, Rejection
from pipeline.sources import dae_file, gltf_file, obj_file, off_file, ply_header, roomplan_usd
from pipeline.sources.mesh_count import HEAD_BYTES, declared_faces
from pipeline.sources.named_scene import without_starting_cube
from pipeline.sources.naming import check_file
from pipeline.sources.scene import Part, Piece, Scene

SUFFIXES = (".dae", ".glb", ".gltf", ".obj", ".off", ".ply", ".stl")
MAX_FACES = 5_000_000
"""A mesh with more ends as TOO_LARGE, before it is read where its header says so; 1.7 million need 0.5 GB here."""

FEW_FACES = 0.02
"""Share of the faces that may have no place: more than that, and it is not known what is missing."""

LARGEST = 1e15
"""In any unit: with larger coordinates areas and volumes are no numbers any more."""


@dataclass(frozen=True)
class Convention:
    """What a format, or the file itself, says of its frame: up axis, and metres in one unit (None: it does not say).

    ``binding``: the axis is laid down (glTF's specification, COLLADA's ``up_axis``), not mere custom; ``declared``: by
    the file itself.
    """

    up: str
    metres: float | None
    binding: bool = False
    declared: bool = False


def convention(path: Path) -> Convention:
    """Return the format's convention; COLLADA and USDZ write their own into the file."""
    suffix = path.suffix.lower()
    if suffix == ".dae":
        with path.open("rb") as stream:
            head = stream.read(HEAD_BYTES)
        up = re.search(rb"<up_axis>\s*([XYZ])_UP", head)
        unit = re.search(rb"<unit\b[^>]{0,200}?\bmeter\s*=\s*[\"']([^\"']{0,80})[\"']", head)
        metres = _metres(unit[1].decode("utf-8", "replace"), path) if unit else None
        return Convention("z" if up and up[1] == b"Z" else "y", metres, up is not None, up is not None)
    if suffix in {".glb", ".gltf"}:
        return Convention("y", 1.0, binding=True)
    if suffix == ".usdz":
        up_axis, stated = roomplan_usd.frame_of(path)
        return Convention(up_axis, stated, binding=True, declared=True)
    return Convention("y" if suffix == ".obj" else "z", None)


def _metres(text: str, path: Path) -> float:
    try:
        metres = float(text)
    except ValueError:
        metres = math.nan
    if not (math.isfinite(metres) and metres > 0):
        detail = f"{path.name} says that its unit is {text!r} metres; expected a number above 0"
        raise Rejection("source", Reason.UNREADABLE, detail, "correct <unit meter>, or export the file again")
    return metres


def load_scene(path: Path, max_faces: int = MAX_FACES) -> Scene:
    """Read the file's triangles with their names, each at its place, in the file's own axes and unit.

    Raises
    ------
    Rejection
        MISSING_FILE, EMPTY, TOO_LARGE, NOT_FINITE, or UNREADABLE (garbage, truncated, broken indices).
    """
    check_file(path)
    declared = declared_faces(path)
    if declared is not None and declared > max_faces and _can_hold(path, declared):
        raise _too_large(path, declared, max_faces)
    _check_size(path)
    try:
        with _quiet():
            scene = Scene.of(_reader(path)(path, max_faces))
    except (MemoryError, Rejection):
        raise
    except Exception as error:  # the loaders raise whatever broken bytes lead them to
        found = " ".join(str(error).replace(f"{path.parent}/", "").split())[:200]
        detail = f"{path.name} cannot be read as {path.suffix[1:]}: {type(error).__name__}: {found}"
        raise Rejection("source", Reason.UNREADABLE, detail, "export or copy the file again") from error
    return without_starting_cube(_checked(path, scene, declared, max_faces))


def _reader(path: Path) -> Callable[[Path, int], Iterator[Piece]]:
    suffix = path.suffix.lower()
    if suffix in {".glb", ".gltf"}:
        return gltf_file.load
    known = {".dae": dae_file.load, ".obj": obj_file.load, ".off": off_file.load, ".usdz": roomplan_usd.load}
    return known.get(suffix, _load_plain)


def _load_plain(path: Path, _max_faces: int) -> Iterator[Piece]:
    """Yield the one mesh of a format that holds no names."""
    scene = trimesh.load_scene(path, process=False, skip_materials=True)
    for part in scene.geometry.values():
        if isinstance(part, trimesh.Trimesh):
            yield Piece(Part(), np.asarray(part.vertices, np.float64), np.asarray(part.faces, np.int64))


def _can_hold(path: Path, declared: int) -> bool:
    """Tell a large mesh from garbage where a header's count should be: a face takes at least 6 bytes."""
    return path.suffix.lower() == ".gltf" or path.stat().st_size >= 6 * declared


def _check_size(path: Path) -> None:
    """Refuse a PLY whose header announces more than the file can hold, before room is made for it."""
    if path.suffix.lower() == ".ply":
        with path.open("rb") as stream:
            found = ply_header.declared(stream.read(HEAD_BYTES))
        if found and found[1] > path.stat().st_size:
            detail = f"{path.name} announces at least {found[1]:,} bytes and has {path.stat().st_size:,}"
            raise Rejection("source", Reason.UNREADABLE, detail, "the file is truncated: copy it again")


def _too_large(path: Path, found: int, limit: int) -> Rejection:
    detail = f"{path.name} has {found:,} faces; the limit is {limit:,}"
    return Rejection("source", Reason.TOO_LARGE, detail, "simplify the mesh, or leave its furniture out")


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep the readers' warnings and log lines to themselves: what matters comes back as a Rejection."""
    log = logging.getLogger("trimesh")  # its modules' loggers hand on to it
    handlers, hands_on = log.handlers, log.propagate
    log.handlers, log.propagate = [logging.NullHandler()], False
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            yield
    finally:
        log.handlers, log.propagate = handlers, hands_on


def _checked(path: Path, scene: Scene, declared: int | None, max_faces: int) -> Scene:
    vertices, faces = scene.mesh.vertices, scene.mesh.faces
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
    good: npt.NDArray[np.bool_] = np.asarray((np.abs(vertices) < LARGEST).all(axis=1))
    if good.all():
        return scene
    keep: npt.NDArray[np.bool_] = np.asarray(good[faces].all(axis=1))
    detail = f"{path.name} has {int((~good).sum()):,} vertices that are NaN, infinite or beyond {LARGEST:g}"
    if (~keep).sum() > FEW_FACES * len(faces):
        raise Rejection("source", Reason.NOT_FINITE, detail, "repair the mesh, or export it again")
    return scene.of_faces(keep, "" if keep.all() else f"{detail}; {int((~keep).sum()):,} faces are left out")
