from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from houseexpo.analysis.copies import find_duplicates
from houseexpo.analysis.similarity import (
    SYMMETRIES,
    THRESHOLD,
    apply_symmetry,
    compare_masks,
    comparison_mask,
    crop_mask,
)
from houseexpo.floorplan import decode


def slow_difference(one: np.ndarray, other: np.ndarray) -> float:
    """The obvious twin: paint both on a large canvas, at every position that counts, under every symmetry."""
    canvas = np.zeros((200, 200), dtype=bool)
    fixed = canvas.copy()
    fixed[60 : 60 + one.shape[0], 60 : 60 + one.shape[1]] = one
    best = np.inf
    for symmetry in SYMMETRIES:
        moved = apply_symmetry(other, symmetry)
        rows = {end + by for end in (0, one.shape[0] - moved.shape[0]) for by in (-2, -1, 0, 1, 2)}
        cols = {end + by for end in (0, one.shape[1] - moved.shape[1]) for by in (-2, -1, 0, 1, 2)}
        for down in rows:
            for right in cols:
                painted = canvas.copy()
                painted[60 + down : 60 + down + moved.shape[0], 60 + right : 60 + right + moved.shape[1]] = moved
                best = min(best, int((painted ^ fixed).sum()))
    return best / max(one.sum(), other.sum())


def blob(rng: np.random.Generator, rows: int, cols: int) -> np.ndarray:
    mask = np.ones((rows, cols), dtype=bool)
    for _ in range(4):
        r, c = rng.integers(0, rows), rng.integers(0, cols)
        mask[r : r + 6, c : c + 9] = False
    return crop_mask(mask)


def test_agrees_with_the_slow_twin_and_is_symmetric():
    rng = np.random.default_rng(3)
    for _ in range(12):
        one, other = blob(rng, *rng.integers(15, 40, 2)), blob(rng, *rng.integers(15, 40, 2))
        expected = slow_difference(one, other)
        assert compare_masks(one, other).difference == expected == compare_masks(other, one).difference


def test_names_mean_what_they_say_in_the_plan():
    mask = np.zeros((3, 2), dtype=bool)  # rows are y, upwards
    mask[0, 1] = True  # the lower right
    where = {name: np.argwhere(apply_symmetry(mask, name)).tolist()[0] for name in SYMMETRIES}
    assert where["mirror_x"] == [0, 0]
    assert where["mirror_y"] == [2, 1]
    assert where["rotate_90"] == [1, 2]  # counter-clockwise: the upper right
    assert where["rotate_180"] == [2, 0]
    assert where["rotate_270"] == [0, 0]  # the lower left


def test_a_limit_leaves_out_what_exceeds_it():
    one = np.ones((20, 20), dtype=bool)
    other = one.copy()
    other[:2, :2] = False
    assert compare_masks(one, other).difference == pytest.approx(4 / 400)
    assert compare_masks(one, other, limit=0.01) == compare_masks(one, other)
    assert compare_masks(one, other, limit=0.0099) is None
    assert compare_masks(crop_mask(np.zeros((3, 3), dtype=bool)), crop_mask(np.zeros((5, 5), dtype=bool))) is None


@pytest.mark.parametrize("swap", [False, True])
@pytest.mark.parametrize("signs", [(1, 1), (-1, 1), (1, -1), (-1, -1)])
def test_a_plan_moved_turned_or_mirrored_gives_the_same_mask_so(published_lines, swap, signs):
    for plan in map(decode, published_lines[:15]):
        verts = (plan.verts[:, ::-1] if swap else plan.verts) * signs + [3.33, -7.01]
        symmetry = next(n for n, (s, r, c) in SYMMETRIES.items() if (s, c, r) == (swap, signs[0] < 0, signs[1] < 0))
        moved = comparison_mask(replace(plan, verts=verts))
        np.testing.assert_array_equal(moved, apply_symmetry(comparison_mask(plan), symmetry))


def test_finds_exact_moved_mirrored_and_jittered_copies(published_lines):
    rng = np.random.default_rng(0)
    plans = list({plan.id: plan for plan in map(decode, published_lines[:40]) if plan.area > 20}.values())
    known = {d.id for d in find_duplicates(plans)}
    original = next(p for p in plans if p.id not in known and p.area > 60)
    jitter = rng.uniform(-0.01, 0.01, original.verts.shape)
    copies = [
        replace(original, id="zz_exact"),
        replace(original, id="zz_shifted").moved(5.123, 0.004),
        replace(original, id="zz_mirrored", verts=original.verts * [-1, 1]),
        replace(original, id="zz_turned", verts=original.verts[:, ::-1] * [-1, 1]),
        replace(original, id="zz_jittered", verts=original.verts + jitter),
    ]
    found = {d.id: d for d in find_duplicates([*copies, *plans]) if d.id.startswith("zz")}
    assert sorted(found) == sorted(c.id for c in copies)
    assert {d.kept_id for d in found.values()} == {original.id}
    assert [found[f"zz_{k}"].difference for k in ("exact", "shifted", "mirrored", "turned")] == [0.0] * 4
    assert 0 < found["zz_jittered"].difference <= THRESHOLD


def test_a_duplicate_of_a_dropped_plan_alone_is_kept():
    a = np.ones((40, 40), dtype=bool)
    b, c = a.copy(), a.copy()
    b[0, :30] = False
    c[0, :30] = c[39, :30] = False
    found = find_duplicates({"a": a, "b": b, "c": c})
    assert [(d.id, d.kept_id) for d in found] == [("b", "a")]
