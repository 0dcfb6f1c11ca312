from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from itertools import combinations

import numpy as np
import pytest

from houseexpo.analysis.copies import choose_duplicates, find_duplicates
from houseexpo.analysis.similarity import (
    SYMMETRIES,
    THRESHOLD,
    PairSearchResult,
    SimilarPair,
    crop_mask,
    find_similar_pairs,
)
from houseexpo.floorplan import decode
from tests.builders.mask_twins import apply_symmetry, blob, compare_masks, comparison_mask


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


# ``find_similar_pairs`` against the obvious: every pair, under every symmetry, at every position.


@dataclass(frozen=True)
class Rules:
    threshold: float = 0.02
    symmetries: bool = True
    shift_px: int = 2


def mask(rows: int, cols: int, *bays: tuple[int, int]) -> np.ndarray:
    """A room with bays knocked off its corner, so that it is chiral."""
    found = np.ones((rows, cols), bool)
    found[:4, :9] = False
    for row, col in bays:
        found[row, col] = False
    return found


ROOM = mask(40, 60)
MASKS = {"a": np.rot90(ROOM), "b": ROOM, "c": mask(40, 60, (20, 20)), "d": mask(60, 60), "e": ROOM[::-1]}


def street(count: int, seed: int = 0) -> list[np.ndarray]:
    """Rooms of which some are nearly others, moved, turned and mirrored."""
    rng = np.random.default_rng(seed)
    found: list[np.ndarray] = []
    for _ in range(count):
        room = np.ones(rng.integers(18, 26, 2), bool)
        if found and rng.random() < 0.6:
            room = apply_symmetry(found[rng.integers(len(found))], list(SYMMETRIES)[rng.integers(8)]).copy()
        row, col = rng.integers(0, len(room)), rng.integers(0, room.shape[1])
        room[row : row + rng.integers(1, 4), col : col + rng.integers(1, 6)] ^= True
        found.append(crop_mask(np.pad(room, 1)))
    return found


def slow(one: np.ndarray, other: np.ndarray, config: Rules) -> float:
    """Paint both on a large canvas, at every position that counts."""
    best = 10**9
    for symmetry in SYMMETRIES if config.symmetries else ("identity",):
        moved = apply_symmetry(other, symmetry)
        shifts = range(-config.shift_px, config.shift_px + 1)
        for down in {end + by for end in (0, len(one) - len(moved)) for by in shifts}:
            for right in {end + by for end in (0, one.shape[1] - moved.shape[1]) for by in shifts}:
                canvas = np.zeros((2, 120, 120), bool)
                canvas[0, 40 : 40 + one.shape[0], 40 : 40 + one.shape[1]] = one
                canvas[1, 40 + down :, 40 + right :][: moved.shape[0], : moved.shape[1]] = moved
                best = min(best, int((canvas[0] ^ canvas[1]).sum()))
    return best / max(int(one.sum()), int(other.sum()))


def pairs(masks: list[np.ndarray], config: Rules, **options: object) -> tuple[SimilarPair, ...]:
    return find_similar_pairs(lambda i: masks[i], len(masks), **asdict(config), **options).pairs  # type: ignore[arg-type]


@pytest.mark.slow
@pytest.mark.parametrize("config", [Rules(), Rules(symmetries=False), Rules(threshold=0.1, shift_px=1)])
def test_every_pair_within_the_threshold_is_found_and_no_other(config: Rules) -> None:
    masks = street(24)
    differences = {(i, j): slow(masks[i], masks[j], config) for i, j in combinations(range(len(masks)), 2)}
    expected = {pair: d for pair, d in differences.items() if d <= config.threshold}
    assert {pair[:2]: pair.difference for pair in pairs(masks, config)} == pytest.approx(expected)
    assert expected


def test_the_symmetry_takes_the_second_onto_the_first() -> None:
    masks = [ROOM, np.rot90(ROOM)]
    [pair] = pairs(masks, Rules())
    assert pair.difference == 0.0
    np.testing.assert_array_equal(apply_symmetry(masks[1], pair.symmetry), masks[0])


@pytest.mark.parametrize(("shift", "same"), [(2, True), (3, False)])
def test_crops_may_lie_two_cells_apart_and_no_more(shift: int, same: bool) -> None:
    one = mask(80, 60)
    other = np.zeros((80 + shift, 60), bool)
    other[shift:] = one
    other[0, 30] = other[-1, 30] = True  # a single cell moves the crop at this end
    other = np.pad(other, ((0, shift), (0, 0)))
    other[-1, 30] = True  # and at the other
    config = Rules(threshold=5 / one.sum(), symmetries=False)
    assert bool(pairs([one, other], config)) is same


def test_threads_change_nothing() -> None:
    masks = street(40, seed=1)
    assert pairs(masks, Rules(), threads=3) == pairs(masks, Rules())


def test_plans_that_are_known_are_not_looked_at_again() -> None:
    masks = street(40, seed=2)
    config = Rules(threshold=0.05)
    whole = find_similar_pairs(lambda i: masks[i], len(masks), **asdict(config))
    old = [i for i in range(len(masks)) if i % 5]
    place = {i: k for k, i in enumerate(old)}
    first = find_similar_pairs(lambda k: masks[old[k]], len(old), **asdict(config))
    known = PairSearchResult(
        {i: first.fingerprints[place[i]] for i in old},
        tuple(pair._replace(first=old[pair.first], second=old[pair.second]) for pair in first.pairs),
    )
    asked: list[int] = []

    def load(i: int) -> np.ndarray:
        asked.append(i)
        return masks[i]

    again = find_similar_pairs(load, len(masks), **asdict(config), known=known)
    assert again.pairs == whole.pairs
    assert {i for i in range(len(masks)) if not i % 5} <= set(asked)
    assert len(set(asked)) < len(masks)


def found(masks: dict[str, np.ndarray], config: Rules, keep: set[str] = frozenset()) -> list[tuple[str, str]]:  # type: ignore[assignment]
    ids = sorted(masks)
    return [(d.id, d.kept_id) for d in choose_duplicates(ids, pairs([masks[i] for i in ids], config), keep)]


def test_the_first_of_each_group_is_kept_whatever_the_symmetry() -> None:
    assert found(MASKS, Rules()) == [("b", "a"), ("c", "a"), ("e", "a")]
