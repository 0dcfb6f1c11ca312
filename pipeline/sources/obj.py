"""A small strict reader of the OBJ files of SUNCG: vertices and faces, nothing else.

Loading is the largest cost of a house, and trimesh takes 3 to 5 ms for a wall file of 300 faces where this takes 0.6 ms
(a median house has seven such files). It reads ``v`` and ``f`` only, and says of every line that it cannot take what is
wrong with it; a test holds it equal to trimesh's loader.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from pipeline.rejection import Reason, Rejection
from pipeline.values import Mesh

_ADVICE = "copy the file again from the data set"


def parse(data: bytes, name: str) -> Mesh:
    """Return the triangles of an OBJ file.

    Parameters
    ----------
    data : bytes
        The whole file. Polygons are cut into fans, texture and normal indices are passed over.
    name : str
        What messages call the file.

    Returns
    -------
    Mesh
        ``vertices`` (n, 3) in file units and axes, in file order, not welded; ``faces`` (m, 3).

    Raises
    ------
    Rejection
        Stage "source": EMPTY without bytes or without faces, NOT_FINITE for NaN or infinite coordinates, UNREADABLE for
        what is no OBJ file or breaks off.
    """
    if not data.strip():
        raise Rejection("source", Reason.EMPTY, f"{name} is empty", _ADVICE)
    if b"\0" in data:
        raise _unreadable(name, "expected text, found binary data")
    lines = data.replace(b"\t", b" ").splitlines()
    vertices = _vertices([line[2:] for line in lines if line[:2] == b"v "], name)
    faces = _faces([line[2:] for line in lines if line[:2] == b"f "], len(vertices), name)
    if not np.isfinite(vertices).all():
        row = int(np.flatnonzero(~np.isfinite(vertices).all(axis=1))[0])
        raise Rejection("source", Reason.NOT_FINITE, f"{name}: vertex {row + 1} is {vertices[row].tolist()}", _ADVICE)
    mesh = Mesh(vertices, faces)
    if faces.max() + 1 < len(vertices) or (not data.endswith(b"\n") and not _is_closed(mesh)):
        raise _unreadable(name, "it breaks off before its last face")
    return mesh


def material_file(data: bytes) -> str | None:
    """Return the file that the OBJ's first ``mtllib`` names, None where it names none."""
    start = data.find(b"mtllib ")
    if start < 0 or (start > 0 and data[start - 1 : start] not in b"\r\n"):
        return None
    return data[start + 7 :].split(b"\n", 1)[0].strip().decode("utf-8", "replace")


def _vertices(lines: list[bytes], name: str) -> npt.NDArray[np.float64]:
    """Return (n, 3) coordinates; a fourth number (weight) or colours after them are dropped."""
    if not lines:
        raise _unreadable(name, "expected vertices ('v' lines), found none")
    try:
        numbers = np.array(list(map(float, b" ".join(lines).split())), dtype=np.float64)
    except ValueError as error:
        raise _unreadable(name, f"expected numbers after 'v', found {error}") from None
    if len(numbers) % len(lines) or len(numbers) < 3 * len(lines):
        raise _unreadable(name, f"expected 3 numbers on each 'v' line, found {len(numbers)} on {len(lines)} lines")
    return np.ascontiguousarray(numbers.reshape(len(lines), -1)[:, :3])


def _faces(lines: list[bytes], n_vertices: int, name: str) -> npt.NDArray[np.int64]:
    """Return (m, 3) indices from 0; negative ones are refused (SUNCG has none)."""
    if not lines:
        raise Rejection("source", Reason.EMPTY, f"{name} has no faces", _ADVICE)
    rows = [line.split() for line in lines]
    counts = np.array(list(map(len, rows)))
    if counts.min() < 3:
        raise _unreadable(
            name, f"expected 3 corners or more in a face, found 'f {lines[int(counts.argmin())].decode()}'"
        )
    try:
        corners = np.array([int(word.partition(b"/")[0]) for row in rows for word in row], dtype=np.int64) - 1
    except ValueError as error:
        raise _unreadable(name, f"expected a vertex number, found {error}") from None
    outside = corners[(corners < 0) | (corners >= n_vertices)]
    if len(outside):
        raise _unreadable(name, f"a face names vertex {outside[0] + 1} of {n_vertices}")
    if counts.max() == 3:
        return corners.reshape(-1, 3)
    pieces = np.split(corners, np.cumsum(counts)[:-1])
    return np.array([(p[0], p[i], p[i + 1]) for p in pieces for i in range(1, len(p) - 1)], dtype=np.int64)


def _is_closed(mesh: Mesh) -> bool:
    """Whether every edge, by position, has as many faces one way as the other."""
    _, welded = np.unique(mesh.vertices.round(6), axis=0, return_inverse=True)
    faces = welded.reshape(-1)[mesh.faces]
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    key, turn = edges.max(axis=1) * len(mesh.vertices) + edges.min(axis=1), np.sign(edges[:, 1] - edges[:, 0])
    return not np.bincount(np.unique(key, return_inverse=True)[1], weights=turn).any()


def _unreadable(name: str, found: str) -> Rejection:
    return Rejection("source", Reason.UNREADABLE, f"{name}: {found}", _ADVICE)
