"""Load a mesh file of any format as a ``MeshScene`` of named triangles; whatever is wrong with it becomes a Rejection.

Axes and unit stay the file's own; ``frame_convention`` returns what the format or the file says of them.

Files of PLY, STL and OFF hold no names. The other formats have modules of their own.
"""

from __future__ import annotations

import json
import logging
import math
import re
import struct
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from houseexpo.file_kinds import HEAD_BYTES, format_suffix
from pipeline.rejection import Reason, Rejection
from pipeline.sources import roomplan_scan
from pipeline.sources.files import check_file
from pipeline.sources.meshes import collada, gltf, obj
from pipeline.sources.meshes.scene import MeshScene, NamedPiece, PartNames
from pipeline.sources.named_scene import drop_default_cube
from pipeline.sources.tolerances import CHUNK_BYTES, LARGEST_COORDINATE
from pipeline.tolerances import SPECK

SUFFIXES = (".dae", ".glb", ".gltf", ".obj", ".off", ".ply", ".stl")
MAX_FACES = 5_000_000
"""A mesh with more ends as TOO_LARGE, before it is read where its header says so; 1.7 million need 0.5 GB here."""

GLTF = frozenset({".glb", ".gltf"})


@dataclass(frozen=True)
class FrameConvention:
    """What a format, or the file itself, says of its frame: up axis, and metres in one unit (None: it does not say).

    ``binding``: the axis is laid down (glTF's specification, COLLADA's ``up_axis``), not mere custom; ``declared``: by
    the file itself.
    """

    up: str
    metres: float | None
    binding: bool = False
    declared: bool = False


def frame_convention(path: Path) -> FrameConvention:
    """Return the format's convention; COLLADA and USDZ write their own into the file."""
    suffix = format_suffix(path)
    if suffix == ".dae":
        with path.open("rb") as stream:
            head = stream.read(HEAD_BYTES)
        up = re.search(rb"<up_axis>\s*([XYZ])_UP", head)
        unit = re.search(rb"<unit\b[^>]{0,200}?\bmeter\s*=\s*[\"']([^\"']{0,80})[\"']", head)
        metres = _metres(unit[1].decode("utf-8", "replace"), path) if unit else None
        return FrameConvention("z" if up and up[1] == b"Z" else "y", metres, up is not None, up is not None)
    if suffix in {".glb", ".gltf"}:
        return FrameConvention("y", 1.0, binding=True)
    if suffix == ".usdz":
        up_axis, stated = roomplan_scan.usdz_up_and_unit(path)
        return FrameConvention(up_axis, stated, binding=True, declared=True)
    return FrameConvention("y" if suffix == ".obj" else "z", None)


def _metres(text: str, path: Path) -> float:
    try:
        metres = float(text)
    except ValueError:
        metres = math.nan
    if not (math.isfinite(metres) and metres > 0):
        detail = f"{path.name} says that its unit is {text!r} metres; expected a number above 0"
        raise Rejection("source", Reason.UNREADABLE, detail, "correct <unit meter>, or export the file again")
    return metres


def load_scene(path: Path, max_faces: int = MAX_FACES) -> MeshScene:
    """Read the file's triangles with their names, each at its place, in the file's own axes and unit.

    Faces that reach far away from all others are left out (``Scene.without_strays``).

    Raises
    ------
    Rejection
        MISSING_FILE, EMPTY, TOO_LARGE, NOT_FINITE, or UNREADABLE (garbage, truncated, broken indices).
    """
    check_file(path)
    declared = declared_face_count(path)
    if declared is not None and declared > max_faces and _can_hold(path, declared):
        raise _too_large(path, declared, max_faces)
    _check_size(path)
    try:
        with _silence_readers():
            scene = MeshScene.of(_reader(path)(path, max_faces))
    except (MemoryError, Rejection):
        raise
    except Exception as error:  # the loaders raise whatever broken bytes lead them to
        found = " ".join(str(error).replace(f"{path.parent}/", "").split())[:200]
        detail = f"{path.name} cannot be read as {format_suffix(path)[1:]}: {type(error).__name__}: {found}"
        raise Rejection("source", Reason.UNREADABLE, detail, "export or copy the file again") from error
    return drop_default_cube(_check_scene(path, scene, declared, max_faces)).without_strays()


def _reader(path: Path) -> Callable[[Path, int], Iterator[NamedPiece]]:
    suffix = format_suffix(path)
    if suffix in GLTF:
        return gltf.load
    known = {".dae": collada.load, ".obj": obj.load, ".usdz": roomplan_scan.load_usdz_pieces}
    return known.get(suffix, _load_plain)


def _load_plain(path: Path, _max_faces: int) -> Iterator[NamedPiece]:
    """Yield the one mesh of a format that holds no names."""
    import trimesh

    scene = trimesh.load_scene(path, file_type=format_suffix(path)[1:], process=False, skip_materials=True)
    for part in scene.geometry.values():
        if isinstance(part, trimesh.Trimesh):
            yield NamedPiece(PartNames(), np.asarray(part.vertices, np.float64), np.asarray(part.faces, np.int64))


def _can_hold(path: Path, declared: int) -> bool:
    """Tell a large mesh from garbage where a header's count should be: a face takes at least 6 bytes."""
    return format_suffix(path) == ".gltf" or path.stat().st_size >= 6 * declared


def _check_size(path: Path) -> None:
    """Refuse a PLY whose header announces more than the file can hold, before room is made for it."""
    if format_suffix(path) == ".ply":
        with path.open("rb") as stream:
            found = parse_ply_header(stream.read(HEAD_BYTES))
        if found and found[1] > path.stat().st_size:
            detail = f"{path.name} announces at least {found[1]:,} bytes and has {path.stat().st_size:,}"
            raise Rejection("source", Reason.UNREADABLE, detail, "the file is truncated: copy it again")


def _too_large(path: Path, found: int, limit: int) -> Rejection:
    detail = f"{path.name} has {found:,} faces; the limit is {limit:,}"
    return Rejection("source", Reason.TOO_LARGE, detail, "simplify the mesh, or leave its furniture out")


@contextmanager
def _silence_readers() -> Iterator[None]:
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


def _check_scene(path: Path, scene: MeshScene, declared: int | None, max_faces: int) -> MeshScene:
    vertices, faces = scene.mesh.vertices, scene.mesh.faces
    if declared is not None and len(faces) < declared and format_suffix(path) not in GLTF:
        detail = f"{path.name} announces {declared:,} faces and holds {len(faces):,}"
        raise Rejection("source", Reason.UNREADABLE, detail, "the file is truncated: copy it again")
    if len(faces) == 0:
        raise Rejection("source", Reason.EMPTY, f"{path.name} holds no face", "export the house as triangles")
    if len(faces) > max_faces:
        raise _too_large(path, len(faces), max_faces)
    if faces.min() < 0 or faces.max() >= len(vertices):
        detail = f"{path.name} names vertex {faces.max():,} of {len(vertices):,}"
        raise Rejection("source", Reason.UNREADABLE, detail, "the file is truncated or broken: export it again")
    good: npt.NDArray[np.bool_] = np.asarray((np.abs(vertices) < LARGEST_COORDINATE).all(axis=1))
    if good.all():
        return scene
    keep: npt.NDArray[np.bool_] = np.asarray(good[faces].all(axis=1))
    detail = f"{path.name} has {int((~good).sum()):,} vertices that are NaN, infinite or beyond {LARGEST_COORDINATE:g}"
    if (~keep).sum() > SPECK * len(faces):  # if more have no place, it is not known what is missing
        raise Rejection("source", Reason.NOT_FINITE, detail, "repair the mesh, or export it again")
    return scene.of_faces(keep, "" if keep.all() else f"{detail}; {int((~keep).sum()):,} faces are left out")


# How many faces a mesh file declares, read from its header before anything is loaded.


def declared_face_count(path: Path) -> int | None:
    """Return the number of faces that the file itself announces, or None if its format announces none.

    Polygons count once here, so the loaded triangles may be more, but never fewer. The meshes of a glTF may be fewer:
    its scene shows some of them, and its reader tells by itself when bytes are missing.
    """
    suffix = format_suffix(path)
    with path.open("rb") as stream:
        if suffix == ".obj":
            return _count_obj(path)
        head = stream.read(HEAD_BYTES)
    counters = {".ply": _count_ply, ".off": _count_off, ".stl": _count_stl}
    if suffix in counters:
        return counters[suffix](head, path)
    return _count_gltf(path, head) if suffix in GLTF else None


def _count_ply(head: bytes, _path: Path) -> int | None:
    found = parse_ply_header(head)
    return found[0] if found else None


def _count_off(head: bytes, _path: Path) -> int | None:
    found = re.match(rb"\s*(?:ST)?C?N?OFF\s+\d+\s+(\d{1,14})\b", re.sub(rb"#.*", b"", head))
    return int(found[1]) if found else None


def _count_stl(head: bytes, path: Path) -> int | None:
    """Count a binary file's triangles; only one whose size fits (or exceeds the text of a header) is binary."""
    if len(head) < 84 or (head.lstrip().startswith(b"solid") and b"facet" in head):
        return None
    (count,) = struct.unpack("<I", head[80:84])
    return int(count) if path.stat().st_size >= 84 else None


def _count_obj(path: Path) -> int:
    count, tail = 0, b"\n"
    with path.open("rb") as stream:
        while chunk := stream.read(CHUNK_BYTES):
            count += (tail + chunk).count(b"\nf ")
            tail = chunk[-2:]
    return count


def _count_gltf(path: Path, head: bytes) -> int | None:
    try:
        if gltf.is_binary(head):
            (length,) = struct.unpack("<I", head[12:16])
            if 20 + length > path.stat().st_size:
                return None  # it is cut off, or says so of itself; the loader says what is wrong
            with path.open("rb") as stream:
                tree = json.loads(stream.read(20 + length)[20:])
        else:
            tree = json.loads(path.read_bytes())
        return sum(_primitive_faces(tree, part) for mesh in tree["meshes"] for part in mesh["primitives"])
    except (ValueError, KeyError, IndexError, TypeError, AttributeError, RecursionError, struct.error):
        return None  # the loader says what is wrong with it


def _primitive_faces(tree: dict[str, Any], primitive: dict[str, Any]) -> int:
    if primitive.get("mode", 4) != 4:
        return 0
    accessor = primitive["indices"] if "indices" in primitive else primitive["attributes"]["POSITION"]
    return int(tree["accessors"][accessor]["count"]) // 3


# What a PLY file's header announces, and whether the file can hold it.


SIZES = {
    **dict.fromkeys((b"char", b"uchar", b"int8", b"uint8"), 1),
    **dict.fromkeys((b"short", b"ushort", b"int16", b"uint16"), 2),
    **dict.fromkeys((b"int", b"uint", b"int32", b"uint32", b"float", b"float32"), 4),
    **dict.fromkeys((b"double", b"float64"), 8),
}
ASCII_BYTES = 2  # a digit and what divides it from the next


def parse_ply_header(head: bytes) -> tuple[int, int] | None:
    """Return (faces, bytes that all elements need at least) from the first bytes of a file; None without a header."""
    if not head.startswith(b"ply") or (end := head.find(b"end_header")) < 0:
        return None
    text, faces, needed, count = b"format ascii" in head[:end], 0, end, 0
    for line in head[:end].splitlines():
        words = line.split()
        if len(words) >= 3 and words[0] == b"element":
            count = int(words[2]) if words[2].isdigit() else 0
            faces += count if words[1] == b"face" else 0
        elif len(words) >= 3 and words[0] == b"property":
            kind = words[2] if words[1] == b"list" else words[1]
            needed += count * (ASCII_BYTES if text else SIZES.get(kind, 1))
    return faces, needed
