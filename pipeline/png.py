"""Encode pictures (grey or RGB arrays) as PNG files, and draw a mesh from above as a small PNG for rejections."""

from __future__ import annotations

import io
from typing import Final

import numpy as np
import numpy.typing as npt

from pipeline.values import Mesh

Picture = npt.NDArray[np.uint8]
"""Rows from the top, (rows, cols) grey or (rows, cols, 3) RGB."""


def encode_png(image: Picture, *, smallest: bool = True) -> bytes:
    """Return the file of a picture, (rows, cols) grey or (rows, cols, 3) RGB; equal pictures give equal bytes.

    Not the ``smallest`` one is larger by a third, and takes an eighth of the time.
    """
    from PIL import Image

    stream = io.BytesIO()
    Image.fromarray(image).save(stream, "PNG", optimize=smallest, compress_level=9 if smallest else 1)
    return stream.getvalue()


PNG_SIDE_PX: Final = 200
SAMPLES: Final = 120_000
_PAPER: Final = 255
_LOWEST, _HIGHEST = 190, 30  # grey of the lowest and of the highest place
_SHADES: Final = 8  # few, so that the file is small


def draw_top_view(mesh: Mesh, up: int = 2) -> bytes:
    """Return a PNG, 8 bits grey, at most ``PNG_SIDE_PX`` wide and high: the higher, the darker; nothing is white.

    Points are spread evenly over the faces, always the same ones. ``up`` is the axis of ``mesh`` that points up; the
    picture's x runs right and its y up, as in a plan. A mesh without area gives no bytes.
    """
    from scipy.ndimage import minimum_filter

    points = sample_mesh_points(mesh)
    if not len(points):
        return b""
    if up == 1:
        points = np.column_stack([points[:, 0], -points[:, 2], points[:, 1]])
    low, high = points.min(axis=0), points.max(axis=0)
    extent = np.maximum(high - low, 1e-9)
    cells = np.floor((points[:, :2] - low[:2]) / extent[:2].max() * (PNG_SIDE_PX - 1)).astype(np.int64)
    tallest = np.full(np.ceil(extent[:2] / extent[:2].max() * PNG_SIDE_PX).astype(int).clip(8, PNG_SIDE_PX), -1.0)
    cells = np.minimum(cells, np.array(tallest.shape) - 1)
    np.maximum.at(tallest, (cells[:, 0], cells[:, 1]), (points[:, 2] - low[2]) / extent[2])
    shade = np.round(tallest * _SHADES) / _SHADES
    grey = np.where(tallest < 0, _PAPER, _LOWEST + (_HIGHEST - _LOWEST) * shade).astype(np.uint8)
    return encode_png(minimum_filter(grey.T[::-1], 3))  # between the points, the highest place beside


def sample_mesh_points(mesh: Mesh, count: int = SAMPLES) -> npt.NDArray[np.float64]:
    """Return points (count, 3) spread evenly over the faces by area, always the same ones."""
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    total = float(areas.sum())
    if not (np.isfinite(total) and total > 0):
        return np.empty((0, 3))
    steps = (np.arange(count) + 0.5) * (total / count)
    face = np.minimum(np.searchsorted(np.cumsum(areas), steps), len(areas) - 1)
    u, v = np.random.default_rng(0).random((2, count))
    over = u + v > 1
    u, v = np.where(over, 1 - u, u)[:, None], np.where(over, 1 - v, v)[:, None]
    spread: npt.NDArray[np.float64] = a[face] + u * (b - a)[face] + v * (c - a)[face]
    return spread
