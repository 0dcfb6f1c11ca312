from __future__ import annotations

import gzip
from collections import Counter

import msgspec
import numpy as np
import pytest
import shapely

from houseexpo.errors import PlanError
from houseexpo.floorplan import FloorPlan, decode
from houseexpo.grids.raster import free_mask
from houseexpo.plan.json_codec import encode
from tests.builders.shared import DATA, needs_shared

SQUARE = np.array([(0.0, 0.0), (0.0, 4.0), (4.0, 4.0), (4.0, 0.0)])
BOW_TIE = [(0.0, 0.0), (2.0, 2.0), (2.0, 0.0), (0.0, 2.0)]
# two squares that share the corner (2, 2), walked as one ring
CORNER = [(0, 0), (0, 2), (2, 2), (2, 4), (4, 4), (4, 2), (2, 2), (2, 0)]
# a square whose wall hangs on by the corner (0, 2): a hole that touches the outline
HANGING = [(0, 0), (0, 2), (1, 1), (2, 2), (1, 3), (0, 2), (0, 4), (4, 4), (4, 0)]
# two rooms joined by a passage one pixel wide: the contour goes there and back on one line
LINE = [(0, 0), (0, 2), (2, 2), (2, 1), (3, 1), (3, 2), (5, 2), (5, 0), (3, 0), (3, 1), (2, 1), (2, 0)]


def plan_of(verts, holes=()) -> FloorPlan:
    return FloorPlan("ring", verts, 1, {}, holes=holes)


def test_a_sound_ring_needs_no_repair():
    plan = plan_of(SQUARE, (SQUARE[::-1] / 4 + 1,))
    assert plan.repair is None
    assert plan.area == pytest.approx(15.0)


@pytest.mark.parametrize(
    ("ring", "kind", "pieces", "area", "change"),
    [
        (BOW_TIE, "cross", 2, 2.0, 2.0),
        (CORNER, "touch", 2, 8.0, 0.0),
        (HANGING, "touch", 1, 14.0, 0.0),
        (LINE, "touch", 2, 8.0, 0.0),
    ],
)
def test_rings_that_touch_or_cross_are_mended_by_the_even_odd_rule(ring, kind, pieces, area, change):
    plan = plan_of(ring)
    assert plan.verts.tolist() == [list(map(float, point)) for point in ring]
    assert plan.repair is not None
    assert (plan.repair.kind, plan.repair.pieces, plan.repair.area_change_m2) == (kind, pieces, change)
    assert plan.free_space.is_valid
    assert plan.area == pytest.approx(area)
    mask, frame = free_mask(plan, 50)
    assert mask.sum() / frame.pixels_per_metre**2 == pytest.approx(area, rel=0.02)


def test_holes_that_touch_the_outline_or_each_other_are_mended_too():
    low, high = np.array([(1.0, 0.0), (2.0, 1.0), (3.0, 0.0)]), np.array([(1.5, 2.0), (2.5, 2.0), (2.0, 1.0)])
    plan = plan_of(SQUARE, (low, high))
    assert plan.repair is not None
    assert plan.free_space.is_valid
    assert plan.outline.area == 16.0
    assert plan.area == pytest.approx(14.5)


def test_a_ring_without_area_is_refused_by_name():
    plan = plan_of([(0, 0), (1, 0), (3, 0)])
    for name in ("outline", "free_space", "repair"):
        with pytest.raises(PlanError, match="plan 'ring': verts: expected a ring that encloses an area"):
            getattr(plan, name)


@needs_shared
@pytest.mark.slow
def test_every_published_ring_is_repaired_and_nothing_is_lost():
    kinds: Counter[str] = Counter()
    with gzip.open(DATA / "houseexpo" / "plans_33717.jsonl.gz") as lines:
        for line in lines:
            plan = decode(line)
            repair = plan.repair
            kinds[repair.kind if repair else "sound"] += 1
            if repair is None:
                continue
            assert plan.free_space.is_valid, plan.id
            assert repair.area_change_m2 == 0.0, plan.id
            assert repair.pieces == shapely.get_num_geometries(plan.free_space)
            assert msgspec.json.decode(encode(plan))["verts"] == msgspec.json.decode(line)["verts"]
    assert kinds == {"touch": 713, "cross": 572, "sound": 33717 - 1285}
