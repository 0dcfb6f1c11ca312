"""Drawing a cell of a kind from a raster."""

from __future__ import annotations

import numpy as np
import pytest

from houseexpo.pseudoslam.cells import count_before, nth_cell


@pytest.mark.parametrize("value", [0, 1])
def test_every_cell_of_a_kind_can_be_drawn(value: int) -> None:
    raster = (np.random.default_rng(0).random((7, 5)) < 0.5).astype(np.uint8)
    raster[3] = 1 - value
    before = count_before(raster, value)
    assert before.tolist() == [0, *np.cumsum((raster == value).sum(axis=1)).tolist()]
    cells = [nth_cell(raster, value, before, n) for n in range(before[-1])]
    assert cells == list(map(tuple, np.argwhere(raster == value).tolist()))
