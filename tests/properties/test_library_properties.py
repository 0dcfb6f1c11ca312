"""What must hold for any plan, not only for those that somebody thought of."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from houseexpo.analysis.navigability import navigability
from houseexpo.analysis.similarity import SYMMETRIES, crop_mask, difference_lower_bound
from houseexpo.floorplan import FloorPlan, decode
from houseexpo.grids.raster import free_mask
from houseexpo.plan import Door, Frame, Navigability, PlanObject, Quality, Room
from houseexpo.plan.json_codec import encode
from houseexpo.plan.room_labels import LABELS, UNLABELLED
from tests.builders.mask_twins import apply_symmetry, compare_masks, mask_fingerprint
from tests.builders.tries import tries

coordinate = st.floats(-1e4, 1e4) | st.integers(-500, 500).map(lambda cm: cm / 100)
point = st.tuples(coordinate, coordinate)
ring = st.lists(point, min_size=3, max_size=12).filter(lambda points: points[0] != points[-1])
box = st.tuples(coordinate, coordinate, coordinate, coordinate)
words = st.text(st.characters(exclude_categories=["Cs"]), max_size=8)
names = words.filter(str.strip)
qualities = st.builds(Quality, st.floats(0, 1), st.dictionaries(names, coordinate, max_size=3))


@st.composite
def plans(draw: st.DrawFn) -> FloorPlan:
    rooms = tuple(
        Room(
            i, draw(st.sampled_from([*LABELS, UNLABELLED])), draw(ring), tuple(draw(st.lists(ring, max_size=2))), ("a",)
        )
        for i in range(draw(st.integers(0, 3)))
    )
    ids = st.sampled_from([room.id for room in rooms]) if rooms else st.nothing()
    doors = tuple(
        Door(
            i, kind, (draw(point), draw(point)), 0.8, draw(ring), (draw(ids), None if kind == "entrance" else draw(ids))
        )
        for i, kind in enumerate(
            draw(st.lists(st.sampled_from(["door", "cut", "entrance"]), max_size=2)) if rooms else []
        )
    )
    objects = tuple(
        PlanObject(i, draw(names), draw(st.none() | ids), draw(ring), draw(st.floats(0, 3)))
        for i in range(draw(st.integers(0, 2)))
    )
    heights = draw(st.sampled_from([(None, None), (0.9, None), (0.0, 2.1), (None, 2.0)]))
    windows = tuple(
        Door(
            i, "window", (draw(point), draw(point)), 1.2, draw(ring), (draw(ids), draw(st.none() | ids)), None, *heights
        )
        for i in range(draw(st.integers(0, 2)) if rooms else 0)
    )
    reach = st.builds(Navigability, st.integers(0, 9), st.floats(0, 1), st.floats(0, 5))
    frame = st.just(Frame(((1.0, 0.0, 0.25), (0.0, -1.0, 1 / 3)), "y", -2.8, -1))
    return FloorPlan(
        draw(st.text("abcdef0123456789_-é", min_size=1, max_size=9)),
        draw(ring),
        draw(st.integers(0, 99)),
        draw(st.dictionaries(words, st.lists(box, max_size=2).map(tuple), max_size=3)),
        tuple(draw(st.lists(ring, max_size=2))),
        rooms,
        doors,
        draw(st.none() | frame),
        draw(st.none() | st.dictionaries(st.sampled_from(["0.10", "0.20"]), reach)),
        draw(st.none() | st.dictionaries(words, words | st.integers(-9, 9) | st.booleans(), max_size=2)),
        draw(st.none() | qualities),
        objects,
        windows,
    )


@given(plans())
@tries(40)
def test_json_keeps_every_plan(plan):
    data = encode(plan)
    again = decode(data)
    assert again == plan
    assert encode(again) == data


@st.composite
def star(draw: st.DrawFn) -> shapely.Polygon:
    """A simple polygon of 3 to 12 m, seen from its middle."""
    radii = draw(st.lists(st.floats(1.5, 6.0), min_size=4, max_size=14))
    angles = np.linspace(0, 2 * np.pi, len(radii), endpoint=False) + draw(st.floats(0, 1))
    return shapely.Polygon(np.column_stack([radii * np.cos(angles), radii * np.sin(angles)]))


@given(star(), st.sampled_from([10.0, 25.0, 33.0]))
@tries(60)
def test_a_raster_and_its_complement_share_every_cell(shape, scale):
    mask, frame = free_mask(shape, scale, margin_px=3)
    around = shapely.box(*shape.buffer(9).bounds).difference(shape)
    assert (free_mask(around, frame=frame)[0] == ~mask).all()
    # a cell is wrong by at most half of itself, and only on the boundary
    assert mask.sum() / scale**2 == pytest.approx(shape.area, abs=0.75 * shape.length / scale)


masks = arrays(bool, st.tuples(st.integers(2, 14), st.integers(2, 14))).filter(np.any).map(crop_mask)
symmetries = st.sampled_from(sorted(SYMMETRIES))


@given(masks, symmetries)
@tries(100)
def test_a_fingerprint_knows_no_symmetry(mask, symmetry):
    np.testing.assert_array_equal(mask_fingerprint(apply_symmetry(mask, symmetry)), mask_fingerprint(mask))
    assert compare_masks(mask, apply_symmetry(mask, symmetry)).difference == 0.0


@given(masks, masks, symmetries)
@tries(100)
def test_difference_is_symmetric_and_never_below_the_bound(one, other, symmetry):
    difference = compare_masks(one, other).difference
    assert compare_masks(other, one).difference == difference
    assert compare_masks(one, apply_symmetry(other, symmetry)).difference == difference
    cells = round(difference * max(one.sum(), other.sum()))
    assert difference_lower_bound(mask_fingerprint(one), mask_fingerprint(other)[None])[0] <= cells


@given(star())
@tries(40)
def test_a_wider_robot_passes_only_where_it_is_wider(shape):
    found = navigability(shape)
    for radius, result in found.items():
        if result.components:
            assert result.narrowest >= 2 * float(radius) - 0.01
        assert 0 <= result.largest_share <= 1
    standing = [shape.buffer(-float(radius)).area for radius in found]
    assert standing == sorted(standing, reverse=True)
