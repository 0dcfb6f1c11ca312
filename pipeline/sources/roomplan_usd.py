"""USDZ: RoomPlan's scans, in which the meshes' names say what each is, and other people's models, as plain meshes.

R1  The names on the way to a mesh decide, the nearest first: Wall, Door, Opening, Window, Floor; what else is in the
    scene is an object of its name. Windows are part of their wall.
R2  All layers lie in the archive: a scene that names a file elsewhere is refused before it is put together.
"""

from __future__ import annotations

import posixpath
import re
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from houseexpo.errors import MissingDependencyError, installing
from pipeline.geometry.overlay import polygons_of
from pipeline.rejection import Reason, Rejection
from pipeline.sources.archives import members
from pipeline.sources.json_house import check_lengths
from pipeline.sources.polygons import triangulated
from pipeline.sources.roomplan_scan import Floor, Scan, Thing, box_thing
from pipeline.sources.scene import Part, Piece, placed

LARGEST_BYTES = 1 << 28
MAX_MESHES = 20_000
_KINDS = ("wall", "door", "opening", "window", "floor")
_ADVICE = "export the scan again"


def load_usdz(path: Path) -> Scan:
    """Read the meshes of a USDZ file.

    Raises
    ------
    Rejection
        Where it is no whole archive, names a file outside of it, or cannot be read.
    MissingDependencyError
        Where usd-core is not installed.
    """
    with _stage(path) as (stage, geometry):
        return _read(stage, geometry, path.name)


def frame_of(path: Path) -> tuple[str, float | None]:
    """Return the up axis of a USDZ file and metres in its unit, or None if it states none; raises as ``load_usdz``."""
    with _stage(path) as (stage, geometry):
        metres = geometry.GetStageMetersPerUnit(stage) if geometry.StageHasAuthoredMetersPerUnit(stage) else None
        return "z" if geometry.GetStageUpAxis(stage) == geometry.Tokens.z else "y", metres


def load(path: Path, max_faces: int) -> Iterator[Piece]:
    """Yield the triangles of every mesh at its place, in the file's axes and unit; raises as ``load_usdz``."""
    with _stage(path) as (stage, geometry):
        cache, count = geometry.XformCache(), 0
        for prim in stage.Traverse():
            if not prim.IsA(geometry.Mesh):
                continue
            mesh = geometry.Mesh(prim)
            local = np.array(mesh.GetPointsAttr().Get() or [], np.float64).reshape(-1, 3)
            counts = np.array(mesh.GetFaceVertexCountsAttr().Get() or [], np.int64)
            corners = np.array(mesh.GetFaceVertexIndicesAttr().Get() or [], np.int64)
            if counts.sum() != len(corners) or (len(corners) and not 0 <= corners.min() <= corners.max() < len(local)):
                raise ValueError(f"the faces of {prim.GetName()} name vertices that it does not have")
            faces = triangulated(local, corners, counts)[0]
            count += len(faces)
            if count > max_faces:
                detail = f"{path.name} has more than {max_faces:,} faces"
                raise Rejection("source", Reason.TOO_LARGE, detail, "simplify the mesh, or leave its furniture out")
            matrix = np.array(cache.GetLocalToWorldTransform(prim), np.float64).T  # rows there, columns here
            vertices, faces = placed(local, faces, matrix)
            names = tuple(part for part in str(prim.GetPath()).split("/") if part)
            yield Piece(Part(names[:-1], names[-1]), vertices, faces)


@contextmanager
def _stage(path: Path) -> Iterator[tuple[Any, Any]]:
    """Open a file whose layers all lie in it, with the module that knows geometry; raises as ``load_usdz``."""
    try:
        from pxr import Sdf, Tf, Usd, UsdGeom
    except ImportError:
        said = f"{path.name} needs usd-core, which is not installed: {installing('scans')}"
        raise MissingDependencyError(said) from None
    _check_whole(path)
    try:
        _check_layers(Sdf, path, members(path))
        stage = Usd.Stage.Open(str(path))
        stage.Reload()  # the library keeps what it has read under the same name
        yield stage, UsdGeom
    except (Tf.ErrorException, RuntimeError, ValueError, TypeError) as error:
        detail = f"{path.name} cannot be read as USD: {type(error).__name__}"
        raise Rejection("source", Reason.UNREADABLE, detail, _ADVICE) from None


def _check_whole(path: Path) -> None:
    """The library reads a damaged archive as it comes; this one is compared with its own checksums first."""
    try:
        with zipfile.ZipFile(path) as archive:
            total = sum(info.file_size for info in archive.infolist())
            stored = all(info.compress_type == zipfile.ZIP_STORED for info in archive.infolist())
            broken = archive.testzip() if stored and total <= LARGEST_BYTES else None
    except (OSError, zipfile.BadZipFile, EOFError, RuntimeError, ValueError) as error:
        detail = f"{path.name} is damaged: {str(error)[:120]}"
        raise Rejection("source", Reason.UNREADABLE, detail, _ADVICE) from None
    if total > LARGEST_BYTES:
        raise Rejection("source", Reason.TOO_LARGE, f"{path.name} holds {total >> 20} MB", "leave its textures out")
    if not stored or broken is not None:
        what = f"{broken} is damaged" if broken else "its members are packed, USDZ has them stored"
        raise Rejection("source", Reason.UNREADABLE, f"{path.name}: {what}", _ADVICE)


def _check_layers(sdf: Any, path: Path, names: tuple[str, ...]) -> None:
    """R2."""
    layers = [name for name in names if name.lower().endswith((".usd", ".usda", ".usdc"))]
    for name in layers:
        layer = sdf.Layer.OpenAsAnonymous(f"{path}[{name}]")
        for asset in layer.GetCompositionAssetDependencies():
            inner = posixpath.normpath(posixpath.join(posixpath.dirname(name), asset))
            if inner not in layers:
                told = f"refers to {posixpath.basename(asset)[:80]!r}, which is not in the archive"
                detail = f"{path.name}: {name} {told}"
                raise Rejection("source", Reason.UNREADABLE, detail, "pack all layers into the USDZ")


def _read(stage: Any, geometry: Any, name: str) -> Scan:
    metres = float(geometry.GetStageMetersPerUnit(stage))
    z_up = geometry.GetStageUpAxis(stage) == geometry.Tokens.z
    found: dict[str, list[Thing]] = {kind: [] for kind in (*_KINDS, "object")}
    floors = []
    cache = geometry.XformCache()
    for count, prim in enumerate(prim for prim in stage.Traverse() if prim.IsA(geometry.Mesh)):
        if count >= MAX_MESHES:
            raise Rejection("source", Reason.TOO_LARGE, f"{name} has more than {MAX_MESHES:,} meshes", _ADVICE)
        mesh = geometry.Mesh(prim)
        local = np.array(mesh.GetPointsAttr().Get() or [], np.float64).reshape(-1, 3)
        matrix = np.array(cache.GetLocalToWorldTransform(prim), np.float64)
        x, y, z = ((local @ matrix[:3, :3] + matrix[3, :3]) * metres).T
        points = np.column_stack([x, y, z] if z_up else [x, -z, y])
        if len(points) < 3:
            continue
        check_lengths(points, f"{name}: {prim.GetName()}", _ADVICE)
        kind, word = _kind(str(prim.GetPath()))
        if kind == "floor":
            floors += _floors(mesh, points)
        elif (thing := box_thing(word, points)) is not None:
            found[kind].append(thing)
    walls, doors, gaps = (tuple(found[kind]) for kind in ("wall", "door", "opening"))
    return Scan(walls, doors, gaps, tuple(found["object"]), tuple(floors))


def _kind(path: str) -> tuple[str, str]:
    """R1."""
    parts = [re.sub(r"[\d_]+(grp)?$", "", part) for part in reversed(path.split("/")) if part]
    for part in parts:
        for kind in _KINDS:
            if part.lower().startswith(kind):
                return kind, part
    return "object", parts[0]


def _floors(mesh: Any, points: np.ndarray) -> list[Floor]:
    """The plan area of a floor's faces."""
    counts = np.array(mesh.GetFaceVertexCountsAttr().Get() or [], np.int64)
    corners = np.array(mesh.GetFaceVertexIndicesAttr().Get() or [], np.int64)
    if counts.sum() != len(corners) or (len(corners) and not (corners.min() >= 0 and corners.max() < len(points))):
        raise ValueError("faces")
    rings = np.split(points[corners][:, :2], np.cumsum(counts)[:-1])
    faces = [shapely.make_valid(shapely.Polygon(ring)) for ring in rings if len(ring) > 2]
    area = shapely.union_all([face for face in faces if face.area > 1e-8], grid_size=1e-4)
    return [Floor(part, float(np.median(points[:, 2]))) for part in polygons_of(area)]
