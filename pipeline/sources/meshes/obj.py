"""Read a Wavefront file (.obj): any with its names (``load``), or strictly a plain one of SUNCG (``parse_plain_obj``).

There are two because their contracts differ. ``load`` keeps the names of objects, groups and materials, accepts what
programs write, and leaves out unused vertices. ``parse_plain_obj`` returns one mesh in file order, and refuses files
that break off, have no faces, or have coordinates that are not finite, each with a reason of its own.

R1  An object begins without a group: the last one belongs to the object before.
R2  A group that follows faces of an object outside any group stands beside that object, not inside it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from pipeline.rejection import Reason, Rejection
from pipeline.sources.meshes.scene import NamedPiece, PartNames, triangulate_polygons
from pipeline.values import Mesh

Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]


@dataclass
class _Lines:
    """What stands on the lines: vertices, and for each named piece its faces and the vertices before them."""

    vertices: list[bytes] = field(default_factory=list)
    faces: dict[PartNames, list[bytes]] = field(default_factory=dict)
    before: dict[PartNames, list[int]] = field(default_factory=dict)


def load(path: Path, max_faces: int) -> Iterator[NamedPiece]:
    """Yield the triangles of each object, group and material, in the order of their first faces.

    Raises
    ------
    ValueError
        Where the file is broken.
    """
    lines = _sort_lines(path.read_bytes())
    if len(lines.vertices) > 12 * max_faces:
        raise ValueError(f"it has {len(lines.vertices):,} vertices, more than its faces can use")
    vertices = _vertices(lines.vertices)
    for part, rows in lines.faces.items():
        corners, counts = _corners(rows, lines.before[part], len(vertices))
        faces = triangulate_polygons(vertices, corners, counts)[0]
        used, packed = np.unique(faces, return_inverse=True)
        yield NamedPiece(part, vertices[used], packed.reshape(-1, 3).astype(np.int64))


def _sort_lines(data: bytes, *, named: bool = True) -> _Lines:
    """Return what stands on the lines; if not ``named``, all faces are of one part."""
    found = _Lines()
    names = {b"o": "", b"g": "", b"usemtl": ""} if named else {}
    part, rows, before = PartNames(), None, None
    data = data.replace(b"\\\n", b" ").replace(b"\\\r\n", b" ").replace(b"\t", b" ")
    for line in data.splitlines():
        word, _, rest = line.lstrip().partition(b" ")
        if word == b"v":
            found.vertices.append(rest)
        elif word == b"f":
            if rows is None or before is None:
                rows, before = found.faces.setdefault(part, []), found.before.setdefault(part, [])
            rows.append(rest)
            before.append(len(found.vertices))
        elif word in names:
            if word == b"o" or (word == b"g" and rows is not None and not names[b"g"]):
                names[b"o"] = names[b"g"] = ""  # R1, R2
            names[word] = rest.strip().decode("utf-8", "replace")
            groups = tuple(name for name in (names[b"o"], names[b"g"]) if name)
            part, rows, before = PartNames(groups, "", names[b"usemtl"]), None, None
    return found


def _vertices(lines: list[bytes]) -> Floats:
    """Return (n, 3); a fourth number (weight) and colours are dropped."""
    if not lines:
        raise ValueError("expected vertices ('v' lines), found none")
    wide = len(lines[0].split())
    text = b" ".join(lines)
    numbers = _numbers(text, np.float64)
    if wide >= 3 and len(numbers) == wide * len(lines):
        return np.ascontiguousarray(numbers.reshape(-1, wide)[:, :3])
    rows = [line.split()[:3] for line in lines]
    if min(map(len, rows)) < 3:
        raise ValueError("expected 3 numbers on each 'v' line, found fewer")
    return np.array([[float(word) for word in row] for row in rows], np.float64)


def _numbers(text: bytes, kind: type[np.generic]) -> npt.NDArray[Any]:
    """Return the numbers of a text, or none where something else stands in it."""
    try:
        return np.fromstring(text, kind, sep=" ")
    except ValueError:
        return np.empty(0, kind)


def _corners(rows: list[bytes], before: list[int], n_vertices: int) -> tuple[Indices, Indices]:
    """Return vertex numbers from 0 (k,), and how many each polygon has (p,); negative ones count back."""
    text = b"\n".join(rows)
    if b"#" in text:
        rows = [row.partition(b"#")[0] for row in rows]
        text = b"\n".join(rows)
    counts = np.fromiter((len(row.split()) for row in rows), np.int64, len(rows))
    numbers = _numbers(re.sub(rb"/\S*", b"", text) if b"/" in text else text, np.int64)
    if len(numbers) != counts.sum():
        raise ValueError("expected vertex numbers on each 'f' line, found something else")
    so_far = np.repeat(np.array(before, np.int64), counts)
    corners = np.where(numbers < 0, numbers + so_far, numbers - 1)
    if len(corners) and not 0 <= corners.min() <= corners.max() < n_vertices:
        raise ValueError(f"a face names vertex {int(corners.max()) + 1:,} of {n_vertices:,}")
    return corners, counts


# The strict reader of SUNCG's files: vertices and faces, nothing else. A test compares it with trimesh's loader.


_ADVICE = "copy the file again from the data set"


def parse_plain_obj(data: bytes, name: str) -> Mesh:
    """Return the triangles of an OBJ file.

    Parameters
    ----------
    data : bytes
        The whole file. Texture and normal indices are passed over.
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
    lines = _sort_lines(data, named=False)
    rows, before = lines.faces.get(PartNames(), []), lines.before.get(PartNames(), [])
    try:
        vertices = _vertices(lines.vertices)
        corners, counts = _corners(rows, before, len(vertices))
    except ValueError as error:
        raise _unreadable(name, str(error)) from None
    if not rows:
        raise Rejection("source", Reason.EMPTY, f"{name} has no faces", _ADVICE)
    if counts.min() < 3:
        short = rows[int(counts.argmin())].decode()
        raise _unreadable(name, f"expected 3 corners or more in a face, found 'f {short}'")
    if not np.isfinite(vertices).all():
        row = int(np.flatnonzero(~np.isfinite(vertices).all(axis=1))[0])
        raise Rejection("source", Reason.NOT_FINITE, f"{name}: vertex {row + 1} is {vertices[row].tolist()}", _ADVICE)
    mesh = Mesh(vertices, triangulate_polygons(vertices, corners, counts)[0])
    if corners.max() + 1 < len(vertices) or (not data.endswith(b"\n") and not _is_closed(mesh)):
        raise _unreadable(name, "it breaks off before its last face")
    return mesh


def read_mtllib_name(data: bytes) -> str | None:
    """Return the file that the OBJ's first ``mtllib`` names, or None if it names none."""
    start = data.find(b"mtllib ")
    if start < 0 or (start > 0 and data[start - 1 : start] not in b"\r\n"):
        return None
    return data[start + 7 :].split(b"\n", 1)[0].strip().decode("utf-8", "replace")


def _is_closed(mesh: Mesh) -> bool:
    """Return whether every edge, by position, has as many faces one way as the other."""
    _, welded = np.unique(mesh.vertices.round(6), axis=0, return_inverse=True)
    faces = welded.reshape(-1)[mesh.faces]
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    key, turn = edges.max(axis=1) * len(mesh.vertices) + edges.min(axis=1), np.sign(edges[:, 1] - edges[:, 0])
    return not np.bincount(np.unique(key, return_inverse=True)[1], weights=turn).any()


def _unreadable(name: str, found: str) -> Rejection:
    return Rejection("source", Reason.UNREADABLE, f"{name}: {found}", _ADVICE)
