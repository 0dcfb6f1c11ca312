"""OFF files: triangles; colours and normals are passed over."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from pipeline.sources.polygons import triangulated
from pipeline.sources.scene import Part, Piece

WORDS = frozenset({b"OFF", b"COFF", b"NOFF", b"STOFF", b"CNOFF", b"STCNOFF"})


def load(path: Path, _max_faces: int) -> Iterator[Piece]:
    """Yield the file's one mesh.

    Raises
    ------
    ValueError
        Where the file is broken, or is the binary variant.
    """
    lines = _lines(path.read_bytes())
    n_vertices, n_faces = _counts(lines)
    rows = lines[1:]
    if len(rows) < n_vertices + n_faces:
        raise ValueError(f"it announces {n_vertices:,} vertices and {n_faces:,} faces and holds {len(rows):,} lines")
    points = [row.split()[:3] for row in rows[:n_vertices]]
    if any(len(point) < 3 for point in points):
        raise ValueError("expected 3 numbers for each vertex, found fewer")
    vertices = np.array([[float(word) for word in point] for point in points], np.float64).reshape(-1, 3)
    polygons = [[int(word) for word in _corners(row)] for row in rows[n_vertices : n_vertices + n_faces]]
    corners = np.array([corner for polygon in polygons for corner in polygon], np.int64)
    if len(corners) and not 0 <= corners.min() <= corners.max() < n_vertices:
        raise ValueError(f"a face names vertex {int(corners.max()):,} of {n_vertices:,}")
    yield Piece(Part(), vertices, triangulated(vertices, corners, np.array([len(each) for each in polygons]))[0])


def declared(head: bytes) -> int | None:
    """Return the number of faces that the first lines announce, or None if they are no OFF header."""
    try:
        return _counts(_lines(head))[1]
    except ValueError:
        return None


def _lines(data: bytes) -> list[bytes]:
    """Lines without comments and blanks; the first holds the counts, whether the word OFF stood before them or not."""
    lines = [line for raw in data.splitlines() if (line := raw.partition(b"#")[0].strip())]
    if not lines or lines[0].split()[0] not in WORDS:
        raise ValueError("expected OFF on its first line")
    rest = lines[0].split()[1:]
    return [b" ".join(rest), *lines[1:]] if rest else lines[1:]


def _counts(lines: list[bytes]) -> tuple[int, int]:
    words = lines[0].split() if lines else []
    if len(words) < 2 or not all(word.isdigit() and len(word) < 15 for word in words[:2]):
        raise ValueError("expected the numbers of vertices and faces after OFF")
    return int(words[0]), int(words[1])


def _corners(row: bytes) -> list[bytes]:
    words = row.split()
    count = int(words[0])
    if count < 0 or len(words) <= count:
        raise ValueError(f"a face announces {count} corners and holds {len(words) - 1}")
    return words[1 : count + 1]
