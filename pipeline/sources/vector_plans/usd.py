"""Read a USD scene (``.usd .usda .usdc``): walls, floors, doors and furniture by semantic labels and names.

Format: OpenUSD, read by usd-core; references, payloads, instances, units and the up axis are the library's. Labels are
taken from ``semantics:labels:*``, ``semantic:*:params:semanticData`` and ``semanticLabel``, of the prim or the nearest
one above it, as Isaac Sim, GRScenes and InternScenes write them. USDZ archives have a reader of their own (RoomPlan).

R1  Every layer lies in the file's folder or below it. One that names a layer elsewhere, on a network, or that is not
    there, is refused before the scene is put together.
R2  A text in which more than ``DEEPEST`` braces stand within each other is refused before the library reads it.
R3  A scene in which no prim is called a wall or a room is refused with that reason.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from houseexpo.errors import MissingDependencyError, install_command
from houseexpo.file_kinds import format_suffix
from houseexpo.files import real_path
from houseexpo.plan.room_labels import canonical
from pipeline.rejection import Reason, Rejection
from pipeline.sources.files import LeftOutParts, quiet_usd, record_file, usd_fault
from pipeline.sources.meshes.scene import triangulate_polygons
from pipeline.sources.tolerances import DEEPEST, MANY_BODY_FACES, MOST_FILES, MOST_PARTS
from pipeline.sources.vector_plans.drawing import Drawing
from pipeline.sources.vector_plans.scene_bodies import (
    SceneBody,
    body_from_many_triangles,
    body_from_triangles,
    body_kind,
    box_mesh,
    storeys_from_bodies,
)

MOST_FACES = 200_000_000
"""Instances counted as often as they stand. They are read one mesh at a time; a file of 1 GB may have 60 million."""
_LAYERS = (".usd", ".usda", ".usdc")
_ADVICE = "export the scene again, with all its layers beside it"
_BRACE = re.compile(rb"[{}]")
_LABEL = re.compile(r"semantics:labels:\w+|semantic:\w+:params:semanticData|semanticLabel")


def can_read(path: Path, head: bytes) -> bool:
    """By what the file begins with, or its name."""
    return format_suffix(path, head) in _LAYERS and (head.startswith((b"#usda", b"PXR-USDC")) or not head)


def read_drawing(path: Path) -> Drawing:
    """Read a scene.

    Raises
    ------
    Rejection
        Where it cannot be read, names a layer that is not there or elsewhere, or has no named wall or room.
    MissingDependencyError
        Where usd-core is not installed.
    """
    quiet_usd()
    try:
        from pxr import Sdf, Tf, Usd, UsdGeom
    except ImportError:
        said = f"{path.name} needs usd-core, which is not installed: {install_command('scans')}"
        raise MissingDependencyError(said) from None
    left_out = LeftOutParts()
    try:
        _check_layers(Sdf, path)
        stage = Usd.Stage.Open(str(real_path(path)), Usd.Stage.LoadAll)
        stage.Reload()  # the library keeps what it has read under the same name
        bodies = list(_bodies(Usd, UsdGeom, stage, path, left_out))
    except (Tf.ErrorException, RuntimeError, ValueError, TypeError) as error:
        detail = f"{path.name} cannot be read as USD{usd_fault(error)}"
        raise Rejection("source", Reason.UNREADABLE, detail, _ADVICE) from None
    wanted, advice = "prims that are named or labelled as walls", "label the walls, or save the scene as .usdz or .glb"
    return Drawing("usd", tuple(storeys_from_bodies(bodies)), left_out, wanted=wanted, advice=advice)


def _check_layers(sdf: Any, path: Path) -> None:
    """Raise Rejection if a layer lies outside the file's folder or on a network."""
    folder = real_path(path).parent
    waiting, seen = [real_path(path)], set()
    while waiting:
        file = waiting.pop()
        if file in seen:
            continue
        seen.add(file)
        if len(seen) > MOST_FILES:
            raise Rejection("source", Reason.TOO_LARGE, f"{path.name} has more than {MOST_FILES:,} layers", _ADVICE)
        if _depth(file) > DEEPEST:  # R2
            told = f"has more than {DEEPEST:,} prims within each other"
            raise Rejection("source", Reason.TOO_LARGE, f"{path.name}: {file.name} {told}", _ADVICE)
        layer = sdf.Layer.OpenAsAnonymous(str(file))
        if layer is None:
            raise ValueError(file.name)
        for asset in sorted(filter(None, layer.GetCompositionAssetDependencies())):  # "" is the layer itself
            inner = real_path(file.parent / asset)
            record_file(inner)
            if ":" in asset or folder not in inner.parents or not inner.is_file():
                told = f"refers to {Path(asset).name[:80]!r}, which is not beside it"
                raise Rejection("source", Reason.UNREADABLE, f"{path.name}: {file.name} {told}", _ADVICE)
            if format_suffix(inner) in _LAYERS:
                waiting.append(inner)
            else:
                told = f"refers to {Path(asset).name[:80]!r}, which is no layer that can be checked"
                raise Rejection("source", Reason.UNREADABLE, f"{path.name}: {file.name} {told}", _ADVICE)


def _depth(file: Path) -> int:
    """Return how many braces of a text layer stand within each other, up to the limit; 0 for a binary one."""
    deepest = depth = 0
    with file.open("rb") as stream:
        if stream.read(5) != b"#usda":
            return 0
        while (data := stream.read(1 << 20)) and deepest <= DEEPEST:
            for brace in _BRACE.findall(data):
                depth += 1 if brace == b"{" else -1
                deepest = max(deepest, depth)
    return deepest


def _bodies(usd: Any, geometry: Any, stage: Any, path: Path, left_out: LeftOutParts) -> Iterator[SceneBody]:
    metres = float(geometry.GetStageMetersPerUnit(stage)) if geometry.StageHasAuthoredMetersPerUnit(stage) else 0.01
    z_up = geometry.GetStageUpAxis(stage) == geometry.Tokens.z
    cache, count = geometry.XformCache(), 0
    for number, prim in enumerate(stage.Traverse(usd.TraverseInstanceProxies())):
        if number >= MOST_PARTS:
            detail = f"{path.name} has more than {MOST_PARTS:,} prims, instances counted as often as they stand"
            raise Rejection("source", Reason.TOO_LARGE, detail, "leave its furniture out")
        if not (prim.IsA(geometry.Mesh) or prim.IsA(geometry.Cube)):
            continue
        if str(geometry.Imageable(prim).ComputeVisibility()) == "invisible":
            continue
        try:
            points, faces = _triangles(geometry, prim)
        except ValueError as error:
            left_out.add(f"{prim.GetName()[:60]}: {error}")
            continue
        count += len(faces)
        if count > MOST_FACES:
            detail = f"{path.name} has more than {MOST_FACES:,} faces"
            raise Rejection("source", Reason.TOO_LARGE, detail, "leave its furniture out")
        if not len(faces):
            continue
        matrix = np.array(cache.GetLocalToWorldTransform(prim), np.float64)
        x, y, z = ((points @ matrix[:3, :3] + matrix[3, :3]) * metres).T
        placed = np.column_stack([x, y, z] if z_up else [x, -z, y])
        if not np.isfinite(placed).all():
            left_out.add(f"{prim.GetName()[:60]} has coordinates that are not finite")
            continue
        names = tuple(part for part in reversed(str(prim.GetPath()).split("/")) if part)
        label, words = _label(prim)
        kind = body_kind((label, *names) if label else names)
        if kind == "skipped":
            continue
        is_dense = kind == "furniture" and not canonical(label) and len(faces) > MANY_BODY_FACES
        made = (body_from_many_triangles if is_dense else body_from_triangles)(names, placed, faces)
        if made is not None:
            yield SceneBody(names, made.shape, made.low_m, made.high_m, label, words)


def _triangles(geometry: Any, prim: Any) -> tuple[np.ndarray, np.ndarray]:
    if prim.IsA(geometry.Cube):
        size = geometry.Cube(prim).GetSizeAttr().Get()
        return box_mesh(np.eye(4), np.full(3, float(size or 2.0) / 2))
    mesh = geometry.Mesh(prim)
    points = np.array(mesh.GetPointsAttr().Get() or [], np.float64).reshape(-1, 3)
    counts = np.array(mesh.GetFaceVertexCountsAttr().Get() or [], np.int64)
    corners = np.array(mesh.GetFaceVertexIndicesAttr().Get() or [], np.int64)
    if (
        (counts < 0).any()
        or counts.sum() != len(corners)
        or (len(corners) and not 0 <= corners.min() <= corners.max() < len(points))
    ):
        raise ValueError("its faces name vertices that it does not have")
    return points, triangulate_polygons(points, corners, counts)[0]


def _label(prim: Any) -> tuple[str, tuple[str, ...]]:
    """Return the semantic label of a prim or the nearest one above it, and our own export's words of a room."""
    each = prim
    while each and not each.IsPseudoRoot():
        for attribute in each.GetAuthoredAttributes():
            if _LABEL.fullmatch(attribute.GetName()):
                value = attribute.Get()
                listed = [value] if isinstance(value, str) else value if isinstance(value, Iterable) else ()
                text = next((each for each in listed if isinstance(each, str)), "")
                words = each.GetAttribute("houseexpo:words")
                said = tuple(str(word) for word in (words.Get() or ())) if words else ()
                return text, said
        each = each.GetParent()
    return "", ()
