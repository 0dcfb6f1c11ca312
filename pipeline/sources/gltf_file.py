"""glTF 2.0 files (.glb, .gltf): triangles at their places, with the names of nodes, meshes and materials.

Only geometry is read: no picture is opened, no address is fetched, and a buffer beside the file must lie in its folder.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from pipeline.rejection import Reason, Rejection
from pipeline.sources.gltf_arrays import Arrays
from pipeline.sources.scene import Part, Piece, placed

Floats = npt.NDArray[np.float64]

COMPRESSED = frozenset({"EXT_meshopt_compression", "KHR_meshopt_compression"})
MAX_NODES = 1_000_000
TRIANGLES, STRIP, FAN = 4, 5, 6


def read_tree(path: Path) -> tuple[dict[str, Any], bytes]:
    """Return a file's JSON tree and its binary chunk (empty for .gltf).

    Raises
    ------
    ValueError, RecursionError, struct.error
        Where the bytes are no glTF.
    """
    data = path.read_bytes()
    binary = b""
    if path.suffix.lower() == ".glb":
        magic, version, length = struct.unpack_from("<4sII", data)
        if magic != b"glTF" or version != 2:
            raise ValueError(f"expected glTF 2, found {magic!r} version {version}")
        if length > len(data):
            raise ValueError(f"it announces {length:,} bytes and has {len(data):,}: it is truncated")
        (size,) = struct.unpack_from("<I", data, 12)
        if 20 + size > len(data):
            raise ValueError(f"its first chunk announces {size:,} bytes and has {len(data) - 20:,}: it is truncated")
        text, rest = data[20 : 20 + size], data[20 + size :]
        if len(rest) >= 8:
            (size,) = struct.unpack_from("<I", rest)
            binary = rest[8 : 8 + size]
    else:
        text = data
    tree = json.loads(text)
    if not isinstance(tree, dict):
        raise ValueError(f"expected an object, found {type(tree).__name__}")  # noqa: TRY004 - one kind for bad bytes
    return tree, binary


def load(path: Path, max_faces: int) -> Iterator[Piece]:
    """Yield the triangles of the file's scene; what is no triangle (points, lines) is left out.

    Raises
    ------
    Rejection
        UNREADABLE for a compression that is not read here, TOO_LARGE beyond ``max_faces``.
    ValueError, LookupError, TypeError, struct.error, RecursionError
        Where the file is broken.
    """
    tree, binary = read_tree(path)
    _check_extensions(tree, path)
    arrays = Arrays(tree, binary, path, max_faces)
    count = 0
    for names, mesh, matrix in _nodes(tree):
        for primitive in mesh["primitives"]:
            found = _triangles(arrays, primitive)
            if found is None:
                continue
            vertices, faces = placed(*found, matrix)
            count += len(faces)
            if count > max_faces:
                detail = f"{path.name} has more than {max_faces:,} faces, instances counted"
                raise Rejection("source", Reason.TOO_LARGE, detail, "simplify the mesh, or leave its furniture out")
            yield Piece(Part(names, _name(mesh), _material(tree, primitive)), vertices, faces)


def _check_extensions(tree: dict[str, Any], path: Path) -> None:
    required = set(tree.get("extensionsRequired", ()))
    compressed = required & COMPRESSED
    if compressed:
        detail = f"{path.name} is compressed with {', '.join(sorted(compressed))}, which is not read here"
        raise Rejection("source", Reason.UNREADABLE, detail, "export it without mesh compression, or with Draco's")


def _nodes(tree: dict[str, Any]) -> Iterator[tuple[tuple[str, ...], dict[str, Any], Floats]]:
    """Yield (names from the root, mesh, place) of each node with a mesh, in the file's order."""
    nodes = tree.get("nodes", [])
    if not nodes:
        return
    scenes = tree.get("scenes") or [{"nodes": sorted(set(range(len(nodes))) - _children(nodes))}]
    roots = scenes[tree.get("scene", 0)].get("nodes", [])
    stack: list[tuple[int, tuple[str, ...], Floats, frozenset[int]]] = [
        (index, (), np.eye(4), frozenset()) for index in reversed(roots)
    ]
    seen = 0
    while stack:
        index, names, above, ancestors = stack.pop()
        seen += 1
        if index in ancestors or seen > MAX_NODES:
            raise ValueError(f"node {index} is its own ancestor, or there are more than {MAX_NODES:,}")
        node = nodes[index]
        matrix = above @ _matrix(node)
        path = (*names, _name(node))
        if "mesh" in node:
            yield path, tree["meshes"][node["mesh"]], matrix
        inner = ancestors | {index}
        stack += [(child, path, matrix, inner) for child in reversed(node.get("children", ()))]


def _children(nodes: list[dict[str, Any]]) -> set[int]:
    return {child for node in nodes for child in node.get("children", ())}


def _matrix(node: dict[str, Any]) -> Floats:
    """Return a node's place in its parent: its matrix, or translation x rotation x scale."""
    if "matrix" in node:
        return np.array(node["matrix"], np.float64).reshape(4, 4).T
    matrix = np.eye(4)
    x, y, z, w = np.array(node.get("rotation", (0.0, 0.0, 0.0, 1.0)), np.float64)
    turn = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    matrix[:3, :3] = np.array(turn) * np.array(node.get("scale", (1.0, 1.0, 1.0)), np.float64)
    matrix[:3, 3] = node.get("translation", (0.0, 0.0, 0.0))
    return matrix


def _triangles(arrays: Arrays, primitive: dict[str, Any]) -> tuple[Floats, npt.NDArray[np.int64]] | None:
    mode = primitive.get("mode", TRIANGLES)
    if mode not in {TRIANGLES, STRIP, FAN} or "POSITION" not in primitive["attributes"]:
        return None
    if "KHR_draco_mesh_compression" in primitive.get("extensions", {}):
        return arrays.draco(primitive["extensions"]["KHR_draco_mesh_compression"])
    vertices = arrays.numbers(primitive["attributes"]["POSITION"], 3)
    if "indices" in primitive:
        corners = arrays.numbers(primitive["indices"], 1).astype(np.int64).ravel()
    else:
        corners = np.arange(len(vertices))
    if mode == TRIANGLES:
        return vertices, corners[: len(corners) // 3 * 3].reshape(-1, 3)
    first = corners[:-2] if mode == STRIP else np.repeat(corners[:1], max(len(corners) - 2, 0))
    faces = np.column_stack([first, corners[1:-1], corners[2:]])
    if mode == STRIP:
        faces[1::2] = faces[1::2, ::-1]
    return vertices, faces


def _material(tree: dict[str, Any], primitive: dict[str, Any]) -> str:
    return _name(tree["materials"][primitive["material"]]) if "material" in primitive else ""


def _name(thing: dict[str, Any]) -> str:
    return str(thing.get("name") or "")
