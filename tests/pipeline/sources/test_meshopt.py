"""Meshoptimizer's streams, which an encoder of our own writes (``tests.builders.formats.meshopt``)."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.sources.meshes.meshopt import decode_attributes, decode_indices, decode_triangles, decode_view
from tests.builders.formats.meshopt import TriangleEncoder, encode_attributes, variable, zigzag


def with_least_corner_first(triangles):
    """Turn each triangle, as the queue of edges does; its winding stays."""
    first = triangles.argmin(axis=1)[:, None]
    return np.take_along_axis(triangles, (first + np.arange(3)) % 3, axis=1)


def grid_of_triangles(side):
    corner = np.arange(side * side).reshape(side, side)
    a, b, c, d = corner[:-1, :-1].ravel(), corner[1:, :-1].ravel(), corner[1:, 1:].ravel(), corner[:-1, 1:].ravel()
    return np.stack([a, b, c, a, c, d], axis=1).reshape(-1, 3)


@pytest.mark.parametrize(("count", "stride"), [(1, 4), (16, 8), (17, 12), (700, 16), (300, 64)])
def test_attributes_of_smooth_and_rough_numbers_come_back(count, stride):
    rng = np.random.default_rng(count)
    smooth = np.cumsum(rng.integers(-1, 2, (count, stride)), axis=0)
    steps = rng.choice([0, 1, 5, 100], (count, stride), p=[0.6, 0.2, 0.15, 0.05])
    for elements in (smooth, smooth + steps, rng.integers(0, 256, (count, stride)), np.full((count, stride), 7)):
        of_bytes = elements.astype(np.uint8)
        assert (decode_attributes(encode_attributes(of_bytes), count, stride) == of_bytes).all()


@pytest.mark.parametrize("version", [0, 1])
def test_triangles_of_every_code_come_back(version):
    rng = np.random.default_rng(version)
    order = rng.permutation(2000)
    meshes = [grid_of_triangles(20), rng.integers(1, 2000, (400, 3)), order[grid_of_triangles(40)]]
    ordered = np.arange(1, 200)
    meshes.append(np.stack([ordered, ordered + 1, np.full(199, 0)], axis=1))  # a fan
    for triangles in meshes:
        stream = TriangleEncoder(version).write(triangles)
        found = decode_triangles(stream, triangles.size).reshape(-1, 3)
        assert (with_least_corner_first(found) == with_least_corner_first(triangles)).all()


def test_indices_with_two_bases_come_back():
    wanted, last, stream = [5, 6, 9000, 9001, 7, 9002, 1], [0, 0], bytearray([0xD1])
    for value in wanted:
        base = int(value > 4000)
        stream += variable(zigzag(value - last[base]) << 1 | base)
        last[base] = value
    assert decode_indices(bytes(stream) + bytes(4), len(wanted)).tolist() == wanted


def test_numbers_with_an_exponent_become_floats():
    wanted = np.array([[1.5, -0.25, 1024.0], [0.0, 3.0, -7.5]])
    exponents, mantissas = np.array([[-1, -2, 10], [0, 0, -1]]), np.array([[3, -1, 1], [0, 3, -15]])
    words = (exponents & 255) << 24 | (mantissas & 0xFFFFFF)
    data = encode_attributes(words.astype("<u4").view(np.uint8).reshape(2, 12))
    extension = {"mode": "ATTRIBUTES", "filter": "EXPONENTIAL", "count": 2, "byteStride": 12}
    assert np.frombuffer(decode_view(data, extension), "<f4").reshape(2, 3) == pytest.approx(wanted)


@pytest.mark.parametrize("cut", [1, 3, 20])
def test_a_stream_that_ends_early_is_refused(cut):
    triangles = np.random.default_rng(0).integers(1, 9000, (30, 3))
    stream = TriangleEncoder(1).write(triangles)
    with pytest.raises(ValueError, match="end early"):
        decode_triangles(stream[: len(stream) - 16 - cut] + stream[-16:], triangles.size)
    elements = np.random.default_rng(0).integers(0, 256, (40, 8)).astype(np.uint8)
    packed = encode_attributes(elements)
    with pytest.raises(ValueError, match="end early"):
        decode_attributes(packed[: -32 - cut] + packed[-32:], 40, 8)
    with pytest.raises(ValueError, match="version 0"):
        decode_attributes(b"\xa1" + packed[1:], 40, 8)
