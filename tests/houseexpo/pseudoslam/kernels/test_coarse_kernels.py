"""Maps at any scale: the kernel beside a slow twin, and what it must not lose."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pytest

from houseexpo.pseudoslam.kernels.mapping import (
    FREE,
    OBSTACLE,
    UNKNOWN,
    crop_view,
    draw_coarse_view,
    draw_disc,
    max_of_blocks,
)

VALUES = np.array([UNKNOWN, FREE, OBSTACLE], np.uint8)
Grid = npt.NDArray[np.uint8]


def slow_blocks(known: Grid, size: int) -> Grid:
    rows, cols = (-(-cells // size) for cells in known.shape)
    padded = np.zeros((rows * size, cols * size), np.uint8)
    padded[: known.shape[0], : known.shape[1]] = known
    return padded.reshape(rows, size, cols, size).max(axis=(1, 3))


def slow_coarse(known: Grid, x: float, y: float, heading: float, pixel: float, side: int) -> Grid:
    """Each pixel the block that holds its middle, one after the other."""
    size = max(math.ceil(pixel - 1e-9), 1)
    blocks = slow_blocks(known, size)
    ahead, right = np.array([math.cos(heading), -math.sin(heading)]), np.array([math.sin(heading), math.cos(heading)])
    out = np.zeros((side, side), np.uint8)
    for i in range(side):
        for j in range(side):
            up, aside = (side - 1) / 2 - i, j - (side - 1) / 2
            col, row = np.floor((np.array([x, y]) + pixel * (up * ahead + aside * right)) / size).astype(int)
            if 0 <= row < blocks.shape[0] and 0 <= col < blocks.shape[1]:
                out[i, j] = blocks[row, col]
    return out


@pytest.mark.parametrize("size", [1, 2, 3, 7, 40])
def test_blocks_hold_the_most_of_their_cells(size: int) -> None:
    known = np.random.default_rng(size).choice(VALUES, (23, 31), p=[0.7, 0.25, 0.05])
    expected = slow_blocks(known, size)
    found = np.full_like(expected, 9)
    max_of_blocks(known, size, np.array([0, 23, 0, 31]), found)
    assert np.array_equal(found, expected)


@pytest.mark.parametrize("size", [1, 2, 3, 7])
@pytest.mark.parametrize(
    "changed", [(0, 1, 0, 1), (5, 9, 30, 31), (22, 23, 3, 17), (7, 7, 0, 31), (1 << 40, 0, 1 << 40, 0)]
)
def test_only_blocks_of_changed_cells_are_computed(size: int, changed: tuple[int, int, int, int]) -> None:
    known = np.random.default_rng(size).choice(VALUES, (23, 31), p=[0.7, 0.25, 0.05])
    expected = slow_blocks(known, size)
    found, touched = np.full_like(expected, 9), np.zeros(known.shape, bool)
    touched[changed[0] : changed[1], changed[2] : changed[3]] = True
    max_of_blocks(known, size, np.array(changed), found)
    blocks = slow_blocks(touched.view(np.uint8), size) != 0
    assert np.array_equal(found, np.where(blocks, expected, 9))


@pytest.mark.parametrize("pixel", [0.4, 1.0, 1.3, 2.0, 2.5, 3.9, 8.0])
def test_a_picture_is_what_its_twin_says(pixel: float) -> None:
    rng = np.random.default_rng(0)
    known = rng.choice(VALUES, (60, 47), p=[0.7, 0.25, 0.05])
    for side in (2, 9, 24):
        for heading in (0.3, -2.2, 0.785, 3.0):
            x, y = rng.uniform((-9, -9), (56, 69))
            out = np.full((side, side), 9, np.uint8)
            draw_coarse_view(known, x, y, math.cos(heading), math.sin(heading), pixel, out)
            expected = slow_coarse(known, x, y, heading, pixel, side)
            assert (out != expected).mean() <= 0.01  # where a sample lies between two cells, rounding decides


def test_a_cell_a_pixel_is_the_plain_view() -> None:
    rng = np.random.default_rng(3)
    known = rng.choice(VALUES, (60, 47))
    plain, coarse = np.empty((2, 32, 32), np.uint8)
    for heading in (0.3, -2.2, 1.9):
        crop_view(known, 20.3, 31.7, heading, plain)
        draw_coarse_view(known, 20.3, 31.7, math.cos(heading), math.sin(heading), 1.0, coarse)
        assert (plain != coarse).mean() <= 0.01  # the plain view counts in parts of 2**-16 of a cell


@pytest.mark.parametrize("pixel", [1.7, 2.0, 3.3, 6.0, 9.9])
@pytest.mark.parametrize("heading", [0.0, 0.4, 1.2, -2.7])
def test_no_wall_vanishes(pixel: float, heading: float) -> None:
    """A wall of one cell is seen all along, within a pixel of its place, and a block thicker than it is at most."""
    known, side, x, y = np.full((400, 400), FREE, np.uint8), 25, 203.3, 203.9
    known[200] = OBSTACLE
    out = np.empty((side, side), np.uint8)
    draw_coarse_view(known, x, y, math.cos(heading), math.sin(heading), pixel, out)
    ahead, right = np.array([math.cos(heading), -math.sin(heading)]), np.array([math.sin(heading), math.cos(heading)])
    along = np.stack([np.arange(50.0, 350.0, 0.5), np.full(600, 200.5)], axis=1) - (x, y)
    pixels = np.floor(np.stack([side / 2 - along @ ahead / pixel, side / 2 + along @ right / pixel], axis=1)).astype(
        int
    )
    inside = pixels[((pixels >= 1) & (pixels < side - 1)).all(axis=1)]
    assert len(inside) > 20
    assert all((out[row - 1 : row + 2, col - 1 : col + 2] == OBSTACLE).any() for row, col in inside)
    row, col = np.nonzero(out == OBSTACLE)
    up, aside = (side / 2 - 0.5 - row) * pixel, (col - side / 2 + 0.5) * pixel
    off = np.abs(y + up * ahead[1] + aside * right[1] - 200.5)
    assert off.max() <= 0.5 + math.ceil(pixel)


def test_marks_are_discs_and_stay_on_the_picture() -> None:
    picture = np.zeros((9, 9), np.uint8)
    draw_disc(picture, 4.5, 4.5, 1.0, OBSTACLE)
    assert np.argwhere(picture).tolist() == [[3, 4], [4, 3], [4, 4], [4, 5], [5, 4]]
    picture[:] = 0
    draw_disc(picture, -50.0, 4.5, 1.0, FREE)
    assert np.argwhere(picture).tolist() == [[3, 0], [4, 0], [4, 1], [5, 0]]
