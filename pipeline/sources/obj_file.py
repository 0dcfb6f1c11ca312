"""Wavefront files (.obj): triangles with the names of their objects, groups and materials; nothing else is opened.

SUNCG's files, which are many and plain, have a reader of their own (``obj``).

R1  An object begins without a group: the last one belongs to the object before.
R2  A group that follows faces of an object outside any group stands beside that object, not inside it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt

from pipeline.sources.polygons import triangulated
from pipeline.sources.scene import Part, Piece

Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]


@dataclass
class _Lines:
    """What stands on the lines: vertices, and for each named piece its faces and the vertices before them."""

    vertices: list[bytes] = field(default_factory=list)
    faces: dict[Part, list[bytes]] = field(default_factory=dict)
    before: dict[Part, list[int]] = field(default_factory=dict)


def load(path: Path, max_faces: int) -> Iterator[Piece]:
    """Yield the triangles of each object, group and material, in the order of their first faces.

    Raises
    ------
    ValueError
        Where the file is broken.
    """
    lines = _sorted(path)
    if len(lines.vertices) > 12 * max_faces:
        raise ValueError(f"it has {len(lines.vertices):,} vertices, more than its faces can use")
    if not lines.vertices:
        raise ValueError("expected vertices ('v' lines), found none")
    vertices = _vertices(lines.vertices)
    for part, rows in lines.faces.items():
        corners, counts = _corners(rows, lines.before[part])
        if len(corners) and not 0 <= corners.min() <= corners.max() < len(vertices):
            raise ValueError(f"a face names vertex {int(corners.max()) + 1:,} of {len(vertices):,}")
        faces = triangulated(vertices, corners, counts)[0]
        used, packed = np.unique(faces, return_inverse=True)
        yield Piece(part, vertices[used], packed.reshape(-1, 3).astype(np.int64))


def _sorted(path: Path) -> _Lines:
    found = _Lines()
    names = {b"o": "", b"g": "", b"usemtl": ""}
    part, rows, before = Part(), None, None
    data = path.read_bytes().replace(b"\\\n", b" ").replace(b"\\\r\n", b" ").replace(b"\t", b" ")
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
            part, rows, before = Part(groups, "", names[b"usemtl"]), None, None
    return found


def _vertices(lines: list[bytes]) -> Floats:
    """Return (n, 3); a fourth number (weight) and colours are dropped."""
    wide = len(lines[0].split())
    text = b" ".join(lines)
    numbers = np.fromstring(text, np.float64, sep=" ")  # stops at what is no number
    if wide >= 3 and len(numbers) == wide * len(lines):
        return np.ascontiguousarray(numbers.reshape(-1, wide)[:, :3])
    rows = [line.split()[:3] for line in lines]
    if min(map(len, rows)) < 3:
        raise ValueError("expected 3 numbers on each 'v' line, found fewer")
    return np.array([[float(word) for word in row] for row in rows], np.float64)


def _corners(rows: list[bytes], before: list[int]) -> tuple[Indices, Indices]:
    """Return vertex numbers from 0 (k,), and how many each polygon has (p,); negative ones count back."""
    text = b"\n".join(rows)
    if b"#" in text:
        rows = [row.partition(b"#")[0] for row in rows]
        text = b"\n".join(rows)
    counts = np.fromiter((len(row.split()) for row in rows), np.int64, len(rows))
    numbers = np.fromstring(re.sub(rb"/\S*", b"", text) if b"/" in text else text, np.int64, sep=" ")
    if len(numbers) != counts.sum():
        raise ValueError("expected vertex numbers on each 'f' line, found something else")
    so_far = np.repeat(np.array(before, np.int64), counts)
    return np.where(numbers < 0, numbers + so_far, numbers - 1), counts
