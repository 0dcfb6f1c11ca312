"""Read a glTF 2.0 file (.glb, .gltf): yield its triangles, placed as in the scene, named by node, mesh and material.

Only geometry is read: no picture is opened, no address is fetched, and a buffer beside the file must lie in its folder.
"""

from __future__ import annotations

import base64
import json
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import DracoPy
import numpy as np
import numpy.typing as npt

from houseexpo.files import real_path
from pipeline.rejection import Reason, Rejection
from pipeline.sources.meshes.meshopt import decode_view
from pipeline.sources.meshes.scene import NamedPiece, PartNames, transform_triangles
from pipeline.sources.tolerances import MOST_PARTS

Floats = npt.NDArray[np.float64]

MESHOPT = "EXT_meshopt_compression"
COMPRESSED = frozenset({"KHR_meshopt_compression"})
_UNPACK = "unpack it (gltfpack -noq -kn -km -i {name} -o plain.glb), or export it without compression or with Draco's"
"""gltfpack reads what it compressed; it writes plain floats (-noq), and keeps named nodes and materials (-kn -km)."""
TRIANGLES, STRIP, FAN = 4, 5, 6


def read_json_and_binary(path: Path) -> tuple[dict[str, Any], bytes]:
    """Return a file's JSON tree and its binary chunk (empty for .gltf).

    Raises
    ------
    ValueError, RecursionError, struct.error
        Where the bytes are no glTF.
    """
    data = path.read_bytes()
    binary = b""
    if is_binary(data):
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


def is_binary(head: bytes) -> bool:
    """Return whether a file that begins so is meant to be binary (GLB): it is no JSON."""
    return not head.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"{")


def load(path: Path, max_faces: int) -> Iterator[NamedPiece]:
    """Yield the triangles of the file's scene; what is no triangle (points, lines) is left out.

    Raises
    ------
    Rejection
        UNREADABLE for a compression that is not read here, TOO_LARGE beyond ``max_faces``.
    ValueError, LookupError, TypeError, struct.error, RecursionError
        Where the file is broken.
    """
    tree, binary = read_json_and_binary(path)
    _check_extensions(tree, path)
    arrays = AccessorReader(tree, binary, path, max_faces)
    count = 0
    for names, mesh, matrix in _nodes(tree):
        for primitive in mesh["primitives"]:
            found = _triangles(arrays, primitive)
            if found is None:
                continue
            vertices, faces = transform_triangles(*found, matrix)
            count += len(faces)
            if count > max_faces:
                detail = f"{path.name} has more than {max_faces:,} faces, instances counted"
                raise Rejection("source", Reason.TOO_LARGE, detail, "simplify the mesh, or leave its furniture out")
            yield NamedPiece(PartNames(names, _name(mesh), _material(tree, primitive)), vertices, faces)


def _check_extensions(tree: dict[str, Any], path: Path) -> None:
    required = set(tree.get("extensionsRequired", ()))
    compressed = required & COMPRESSED
    if compressed:
        detail = f"{path.name} is compressed with {', '.join(sorted(compressed))}, which is not read here"
        raise Rejection("source", Reason.UNREADABLE, detail, _UNPACK.format(name=path.name))


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
        if index in ancestors or seen > MOST_PARTS:
            raise ValueError(f"node {index} is its own ancestor, or there are more than {MOST_PARTS:,}")
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


def _triangles(arrays: AccessorReader, primitive: dict[str, Any]) -> tuple[Floats, npt.NDArray[np.int64]] | None:
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


# A glTF file's numbers: buffers, accessors (strided, sparse, quantised), and what Draco or meshoptimizer compressed.


TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


class AccessorReader:
    """Reads accessors of one file; each buffer is opened once."""

    def __init__(self, tree: dict[str, Any], binary: bytes, path: Path, max_faces: int) -> None:
        self._tree, self._path, self._most = tree, path, 3 * max_faces
        self._buffers: dict[int, bytes] = {0: binary} if binary else {}
        self._unpacked: dict[int, bytes] = {}

    def numbers(self, index: int, width: int) -> Floats:
        """Return an accessor as (count, width) floats; normalised integers become fractions.

        Raises
        ------
        ValueError
            Where it is not of this width, or reaches over the end of its buffer.
        """
        accessor = self._tree["accessors"][_index(index)]
        count, kind = int(accessor["count"]), np.dtype(TYPES[accessor["componentType"]])
        if WIDTHS.get(accessor["type"]) != width or not 0 <= count <= self._most:
            raise ValueError(f"accessor {index} holds {count:,} {accessor['type']}; expected {width} numbers each")
        if "bufferView" in accessor:
            values = self._view(accessor["bufferView"], accessor.get("byteOffset", 0), count, width, kind)
        else:
            values = np.zeros((count, width), kind)
        if "sparse" in accessor:
            values = self._put_sparse(values, accessor["sparse"])
        floats = values.astype(np.float64)
        if accessor.get("normalized") and kind.kind in "iu":
            floats = np.maximum(floats / np.iinfo(kind).max, -1.0)
        return floats

    def draco(self, extension: dict[str, Any]) -> tuple[Floats, npt.NDArray[np.int64]]:
        """Return vertices (n, 3) and faces (m, 3) of a primitive that Draco compressed."""
        view = self._tree["bufferViews"][_index(extension["bufferView"])]
        start = int(view.get("byteOffset", 0))
        data = self._buffer(view["buffer"])[start : start + int(view["byteLength"])]
        found = DracoPy.decode(data)
        return np.asarray(found.points, np.float64).reshape(-1, 3), np.asarray(found.faces, np.int64).reshape(-1, 3)

    def _put_sparse(self, values: npt.NDArray[Any], sparse: dict[str, Any]) -> npt.NDArray[Any]:
        """Put a sparse accessor's own values in."""
        count = int(sparse["count"])
        where, what = sparse["indices"], sparse["values"]
        kind = np.dtype(TYPES[where["componentType"]])
        rows = self._view(where["bufferView"], where.get("byteOffset", 0), count, 1, kind).ravel()
        changed = values.copy()
        changed[rows] = self._view(what["bufferView"], what.get("byteOffset", 0), count, values.shape[1], values.dtype)
        return changed

    def _view(self, index: int, offset: int, count: int, width: int, kind: np.dtype[Any]) -> npt.NDArray[Any]:
        view = self._tree["bufferViews"][_index(index)]
        row = width * kind.itemsize
        stride = int(view.get("byteStride", row))
        start, data = int(view.get("byteOffset", 0)) + int(offset), b""
        if MESHOPT in view.get("extensions", {}):
            start, data = int(offset), self._meshopt(index, view["extensions"][MESHOPT])
        else:
            data = self._buffer(view["buffer"])
        end = start + stride * (count - 1) + row if count else start
        if start < 0 or stride < row or end > len(data):
            raise ValueError(f"buffer view {index} needs {end:,} bytes of a buffer of {len(data):,}")
        if not count:
            return np.empty((0, width), kind)
        return np.ndarray((count, width), kind, data, start, (stride, kind.itemsize))

    def _meshopt(self, index: int, extension: dict[str, Any]) -> bytes:
        """Return the bytes of a buffer view that meshoptimizer compressed; each is unpacked once."""
        if index not in self._unpacked:
            if int(extension["count"]) > self._most:
                raise ValueError(f"buffer view {index} announces {int(extension['count']):,} elements")
            start = int(extension.get("byteOffset", 0))
            end = start + int(extension["byteLength"])
            data = self._buffer(extension["buffer"])
            if start < 0 or end > len(data):
                raise ValueError(f"buffer view {index} needs {end:,} bytes of a buffer of {len(data):,}")
            self._unpacked[index] = decode_view(data[start:end], extension)
        return self._unpacked[index]

    def _buffer(self, index: int) -> bytes:
        if index not in self._buffers:
            buffer = self._tree["buffers"][_index(index)]
            self._buffers[index] = self._buffer_bytes(str(buffer["uri"])) if "uri" in buffer else b""
        return self._buffers[index]

    def _buffer_bytes(self, uri: str) -> bytes:
        """Return a buffer's bytes: from the text itself, or from a file in the glTF file's own folder."""
        if uri.startswith("data:"):
            return base64.b64decode(uri.partition(",")[2])
        return resolve_file(self._path, uri).read_bytes()


def resolve_file(path: Path, uri: str) -> Path:
    """Return the file that a relative address names, which must lie in the folder of ``path`` or below it.

    Raises
    ------
    ValueError
        Where it does not: nothing outside is opened, and nothing is fetched.
    """
    from urllib.parse import unquote

    folder = real_path(path.parent)
    file = real_path(folder / unquote(uri))
    if "://" in uri or not file.is_relative_to(folder):
        raise ValueError(f"it names the buffer {uri[:80]!r}, which is not in its folder")
    return file


def _index(value: int) -> int:
    if value < 0:
        raise ValueError(f"expected an index, found {value}")
    return value
