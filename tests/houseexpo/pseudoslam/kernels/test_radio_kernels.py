"""Exchanges of maps beside a slow twin, and marks of what a merge has made known."""

from __future__ import annotations

import numpy as np

from houseexpo.pseudoslam.kernels.episode import COUNTS
from houseexpo.pseudoslam.kernels.mapping import CHUNK, FREE, OBSTACLE, UNKNOWN, merge_cells, merge_runs
from houseexpo.pseudoslam.kernels.radio import _exchange
from houseexpo.pseudoslam.kernels.team_step import EVERYONE

ROBOTS, CELLS = 4, 70 * CHUNK + 17
CHUNKS = -(-CELLS // CHUNK)
GROUPS = -(-CHUNKS // CHUNK)


def slow_exchange(maps: np.ndarray, heard: np.ndarray) -> None:
    """All cells of all pairs, row by row, of what each robot knew before."""
    before = maps.copy()
    for i, j in np.argwhere(heard).tolist():
        missing = np.flatnonzero((maps[i] == UNKNOWN) & (before[j] != UNKNOWN))
        maps[i, missing] = before[j, missing]


def test_an_exchange_of_what_is_pending_is_an_exchange_of_all() -> None:
    rng = np.random.default_rng(0)
    maps, counts = np.zeros((ROBOTS, CELLS), np.uint8), np.zeros((ROBOTS, 1), COUNTS)
    observable = rng.integers(0, 2, CELLS).astype(np.uint8)
    pending = np.full((ROBOTS, CHUNKS), EVERYONE, np.uint16)
    waiting = np.full((ROBOTS, GROUPS), EVERYONE, np.uint16)
    expected = maps.copy()
    for _ in range(60):
        for k in range(ROBOTS):  # each sees a piece, and each differently, as with noise
            low = int(rng.integers(CELLS))
            piece = np.arange(low, min(low + int(rng.integers(1, 90)), CELLS))
            value = int(rng.choice([FREE, OBSTACLE]))
            piece = piece[maps[k, piece] == UNKNOWN]
            maps[k, piece] = value
            expected[k, piece] = value
            counts[k, 0]["known"] += len(piece)
            counts[k, 0]["covered"] += observable[piece].sum()
            changed = np.unique(piece // CHUNK)
            pending[k, changed] = waiting[k, changed // CHUNK] = EVERYONE
        heard = np.triu(rng.integers(0, 2, (ROBOTS, ROBOTS)), 1)
        heard = (heard | heard.T).astype(np.uint8)
        _exchange(maps, observable, counts, CELLS, heard, pending, waiting)
        groups = [np.bitwise_or.reduce(pending[:, at : at + CHUNK], axis=1) for at in range(0, CHUNKS, CHUNK)]
        assert ((np.stack(groups, axis=1) | waiting) == waiting).all()
        slow_exchange(expected, heard)
        np.testing.assert_array_equal(maps, expected)
        np.testing.assert_array_equal(counts["known"][:, 0], (maps != UNKNOWN).sum(axis=1))
        np.testing.assert_array_equal(counts["covered"][:, 0], ((maps != UNKNOWN) * observable).sum(axis=1))


def test_merges_mark_the_chunks_of_new_cells() -> None:
    known, ones = np.zeros((2, 2 * CHUNK), np.uint8), np.ones((2, 2 * CHUNK), np.uint8)
    fresh = np.zeros(4, np.uint8)
    merge_runs(known, ones, np.array([[CHUNK - 2, CHUNK + 1]], np.int32), 1, FREE, fresh)
    assert fresh.tolist() == [1, 1, 0, 0]
    fresh[:] = 0
    merge_cells(known, ones, np.array([CHUNK, 3 * CHUNK], np.int32), 2, OBSTACLE, fresh)
    assert fresh.tolist() == [0, 0, 0, 1]
