"""Drawing a cell of a kind from a raster."""

from __future__ import annotations

import numpy as np
import pytest

from houseexpo.pseudoslam.kernels.placement import count_before_rows as count_before_kernel
from houseexpo.pseudoslam.kernels.placement import nth_cell as nth_cell_kernel
from houseexpo.pseudoslam.kernels.types import as_read_only


@pytest.mark.parametrize("cols", [5, 700])
@pytest.mark.parametrize("value", [0, 1])
@pytest.mark.parametrize("compiled", [True, False])
def test_every_cell_of_a_kind_can_be_drawn(value: int, cols: int, compiled: bool) -> None:
    count_before, nth_cell = (
        kernel if compiled else getattr(kernel, "py_func", kernel) for kernel in (count_before_kernel, nth_cell_kernel)
    )
    raster = (np.random.default_rng(0).random((7, cols)) < 0.5).astype(np.uint8)
    raster[3] = 1 - value
    raster = as_read_only(raster)  # as starts hand it over
    before = count_before(raster, value)
    assert before.tolist() == [0, *np.cumsum((raster == value).sum(axis=1)).tolist()]
    found = [nth_cell(raster, value, before, n) for n in range(before[-1])]
    assert found == list(map(tuple, np.argwhere(raster == value).tolist()))
