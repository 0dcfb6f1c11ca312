"""Bands between the ends of walls: the same as a plain loop over all pairs finds."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
import shapely

from pipeline.geometry.wall_gaps import WallEnd, wall_ends
from pipeline.stages.closings import LONGEST_SIDE_M, _bands_between_ends
from pipeline.tolerances import HAND_M


def slow(ends: list[WallEnd], ground: shapely.Geometry) -> list[shapely.Polygon]:
    found = []
    for first, second in combinations(ends, 2):
        line = shapely.linestrings([first.centre, second.centre])
        wide = (np.hypot(*(first.b - first.a)) + np.hypot(*(second.b - second.a))) / 2
        if 0.05 < line.length <= LONGEST_SIDE_M and shapely.intersection(line, ground).length <= wide + 0.05:
            found.append(shapely.buffer(line, HAND_M / 2, cap_style="square"))
    return found


@pytest.mark.parametrize("seed", range(4))
def test_bands_lie_between_ends_that_see_each_other(seed):
    rng = np.random.default_rng(seed)
    starts = rng.uniform(0, 18, (24, 2))
    sizes = np.where(rng.random((24, 1)) < 0.5, [2.0, 0.2], [0.2, 2.0])
    ground = shapely.union_all(shapely.box(*starts.T, *(starts + sizes).T))
    ends = list(wall_ends(ground))
    bands, same = _bands_between_ends(ends, ground), slow(ends, ground)
    assert len(bands) == len(same) > 10
    assert all(band.equals(other) for band, other in zip(bands, same, strict=True))
