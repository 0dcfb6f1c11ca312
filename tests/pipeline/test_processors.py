"""A plan is the same on every processor: the linear algebra library has kernels for each, which round differently."""

from __future__ import annotations

import hashlib
import os
import platform
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from pipeline.geometry.areas import dot_product
from tests.builders.houses import gap, level, stage_values, three_rooms, window
from tests.builders.houses import wall as wall_of
from tests.builders.meshes import joined, turned

OLD_PROCESSOR = "Nehalem"
"""A kernel of OpenBLAS that each x86-64 processor can run, and that does not fuse multiplying with adding."""


def test_dot_is_the_sum_of_the_products() -> None:
    rng = np.random.default_rng(0)
    points, way = rng.normal(size=(50, 2)), rng.normal(size=2)
    expected = [x * way[0] + y * way[1] for x, y in points.tolist()]
    assert dot_product(points, way).tolist() == expected
    assert float(dot_product(points[0], way)) == expected[0]


@pytest.mark.slow
@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="kernels of another family")
def test_a_turned_house_has_the_same_spaces_on_an_old_processor() -> None:
    environment = {**os.environ, "OPENBLAS_CORETYPE": OLD_PROCESSOR}
    line = "from tests.pipeline.test_processors import digest; print(digest())"
    root = Path(__file__).parents[2]
    run = [sys.executable, "-c", line]
    old = subprocess.run(run, env=environment, cwd=root, capture_output=True, text=True, check=True)
    assert old.stdout.split() == [digest()]


def digest(degrees: float = 31.0) -> str:
    """Return a hash of the outlines and the passages that a house with its walls at 31 degrees has."""
    mesh = joined(
        [
            *three_rooms([gap(0.7, 1.6)], [gap(1.1, 2.0), window(2.3, 2.8)]),
            *wall_of((9.3, 3.2, 9.5, 7.0)),
            *wall_of((-0.2, 3.2, 0.0, 7.0)),
            *wall_of((-0.2, 7.0, 9.5, 7.2), gap(2.0, 3.0)),
            *wall_of((4.0, 3.2, 4.1, 7.0), gap(1.9, 3.6)),
        ]
    )
    spaces = stage_values(level(turned(mesh, degrees)))["refine"]
    outlines = [room.wkb for room in spaces.rooms]
    middles = [np.asarray(passage.centre).tobytes() for passage in spaces.passages]
    return hashlib.sha256(b"".join([*outlines, *middles])).hexdigest()
