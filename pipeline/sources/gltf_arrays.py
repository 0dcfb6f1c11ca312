"""A glTF file's numbers: buffers, accessors (strided, sparse, quantised) and what Draco compressed."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

import DracoPy
import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


class Arrays:
    """Reads accessors of one file; each buffer is opened once."""

    def __init__(self, tree: dict[str, Any], binary: bytes, path: Path, max_faces: int) -> None:
        self._tree, self._path, self._most = tree, path, 3 * max_faces
        self._buffers: dict[int, bytes] = {0: binary} if binary else {}

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
            values = self._replaced(values, accessor["sparse"])
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

    def _replaced(self, values: npt.NDArray[Any], sparse: dict[str, Any]) -> npt.NDArray[Any]:
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
        start = int(view.get("byteOffset", 0)) + int(offset)
        data = self._buffer(view["buffer"])
        end = start + stride * (count - 1) + row if count else start
        if start < 0 or stride < row or end > len(data):
            raise ValueError(f"buffer view {index} needs {end:,} bytes of a buffer of {len(data):,}")
        if not count:
            return np.empty((0, width), kind)
        return np.ndarray((count, width), kind, data, start, (stride, kind.itemsize))

    def _buffer(self, index: int) -> bytes:
        if index not in self._buffers:
            buffer = self._tree["buffers"][_index(index)]
            self._buffers[index] = self._opened(str(buffer["uri"])) if "uri" in buffer else b""
        return self._buffers[index]

    def _opened(self, uri: str) -> bytes:
        """Return a buffer's bytes: from the text itself, or from a file in the glTF file's own folder."""
        if uri.startswith("data:"):
            return base64.b64decode(uri.partition(",")[2])
        return beside(self._path, uri).read_bytes()


def beside(path: Path, uri: str) -> Path:
    """Return the file that a relative address names, which must lie in the folder of ``path`` or below it.

    Raises
    ------
    ValueError
        Where it does not: nothing outside is opened, and nothing is fetched.
    """
    from urllib.parse import unquote

    folder = path.parent.resolve()
    file = (folder / unquote(uri)).resolve()
    if "://" in uri or not file.is_relative_to(folder):
        raise ValueError(f"it names the buffer {uri[:80]!r}, which is not in its folder")
    return file


def _index(value: int) -> int:
    if value < 0:
        raise ValueError(f"expected an index, found {value}")
    return value
