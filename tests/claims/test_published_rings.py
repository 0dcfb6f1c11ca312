"""docs/format.md: what one finds in the published rings."""

from __future__ import annotations

import gzip

import msgspec
import numpy as np
import pytest

from tests.builders.shared import DATA, needs_shared


@pytest.mark.slow
@needs_shared
def test_the_rings_are_as_the_page_on_the_format_says() -> None:
    points = []
    with gzip.open(DATA / "houseexpo" / "plans_33717.jsonl.gz") as lines:
        for line in lines:
            ring = np.array(msgspec.json.decode(line)["verts"], float)
            along, up = np.abs(np.roll(ring, -1, axis=0) - ring).T
            assert ((along < 1e-9) | (up < 1e-9) | (np.abs(along - up) < 1e-6)).all()
            assert not np.array_equal(ring[0], ring[-1])
            np.testing.assert_allclose(ring.min(axis=0), 0.1)
            points.append(len(ring))
    assert (min(points), max(points), np.median(points)) == (4, 12249, 99)
