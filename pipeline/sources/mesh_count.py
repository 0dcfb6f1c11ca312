"""How many faces a mesh file declares, read from its header before anything is loaded."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

from pipeline.sources import off_file, ply_header

HEAD_BYTES = 65_536
CHUNK_BYTES = 1 << 24


def declared_faces(path: Path) -> int | None:
    """Return the number of faces that the file itself announces, or None if its format announces none.

    Polygons count once here, so the loaded triangles may be more, but never fewer.
    """
    suffix = path.suffix.lower()
    with path.open("rb") as stream:
        if suffix == ".obj":
            return _count_obj(path)
        head = stream.read(HEAD_BYTES)
    counters = {".ply": _count_ply, ".off": _count_off, ".stl": _count_stl}
    if suffix in counters:
        return counters[suffix](head, path)
    return _count_gltf(path, head) if suffix in {".glb", ".gltf"} else None


def _count_ply(head: bytes, _path: Path) -> int | None:
    found = ply_header.declared(head)
    return found[0] if found else None


def _count_off(head: bytes, _path: Path) -> int | None:
    return off_file.declared(head)


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
        if path.suffix.lower() == ".glb":
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
