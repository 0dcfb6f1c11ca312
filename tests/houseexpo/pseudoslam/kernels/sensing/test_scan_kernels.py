"""The two scans against their slow twins, and what must hold of any scan."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from houseexpo.floorplan import decode
from houseexpo.grids.raster import free_mask
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE, UNKNOWN, merge_cells, merge_runs
from houseexpo.pseudoslam.kernels.sensing.rays import find_free_rectangle, merge_ray_scan, ray_scan
from houseexpo.pseudoslam.kernels.sensing.sector import sector_scan
from houseexpo.pseudoslam.worlds.world import new_scan_buffers
from tests.builders.scans import UNASKED, Cells, slow_rays, slow_sector

QUARTER = math.pi / 2
UNCOMPILED = "NUMBA_DISABLE_JIT" in os.environ


def cells_of(flat: np.ndarray, count: int, cols: int) -> Cells:
    return {divmod(cell, cols) for cell in flat[:count].tolist()}


def sector(
    occupied: np.ndarray, x: float, y: float, heading: float, half: float, range_px: float
) -> tuple[Cells, Cells]:
    runs, hit, slopes = new_scan_buffers(range_px)
    n_runs, n_hit = sector_scan(occupied, x, y, heading, half, range_px, runs, hit, slopes)
    free = np.concatenate([[], *(np.arange(first, last + 1) for first, last in runs[:n_runs].tolist())]).astype(int)
    return cells_of(free, len(free), occupied.shape[1]), cells_of(hit, n_hit, occupied.shape[1])


def rays(
    occupied: np.ndarray, x: float, y: float, heading: float, fov: float, resolution: float, range_px: float
) -> tuple[Cells, Cells]:
    fan = np.arange(-fov / 2, fov / 2, resolution)
    runs = np.empty((len(fan) * (round(range_px) + 1), 2), np.int32)
    hit = np.empty(len(fan), np.int32)
    n_runs, n_hit = ray_scan(occupied, x, y, heading, np.cos(fan), np.sin(fan), range_px, runs, hit)
    assert (runs[:n_runs, 0] == runs[:n_runs, 1]).all()
    return cells_of(runs[:, 0], n_runs, occupied.shape[1]), cells_of(hit, n_hit, occupied.shape[1])


def grid(*lines: str) -> np.ndarray:
    return np.array([[cell == "#" for cell in line] for line in lines]).astype(np.uint8)


def cluttered(rng: np.random.Generator, share: float, rows: int = 22, cols: int = 29) -> np.ndarray:
    occupied = (rng.random((rows, cols)) < share).astype(np.uint8)
    occupied[[0, -1]] = 1
    occupied[:, [0, -1]] = 1
    return occupied


def test_a_sector_is_what_its_twin_says() -> None:
    rng = np.random.default_rng(1)
    for half in (QUARTER, math.pi, 0.3, 2.9, 1.2):
        for share in (0.02, 0.1, 0.3):
            occupied = cluttered(rng, share)
            x, y, heading, range_px = rng.uniform((1, 1, -4, 3), (28, 21, 4, 13))
            assert sector(occupied, x, y, heading, half, range_px) == slow_sector(
                occupied, x, y, heading, half, range_px
            )


@pytest.mark.slow
def test_every_cell_of_an_open_sector_is_decided() -> None:
    """The published scan leaves 15% of it between its rays, 30% of the outer metre."""
    occupied = np.zeros((301, 301), np.uint8)
    rows, cols = np.mgrid[:301, :301]
    across, up = cols - 150, 150 - rows
    wanted = (np.hypot(across, up) <= 125) & (up >= 0)
    free, hit = sector(occupied, 150.5, 150.5, QUARTER, QUARTER, 125.0)
    assert free == set(map(tuple, np.argwhere(wanted).tolist()))
    assert not hit
    assert len(rays(occupied, 150.5, 150.5, QUARTER, math.pi, math.radians(0.7), 125.0)[0]) < 0.9 * len(free)


@pytest.mark.parametrize("turns", [1, 2, 3])
@pytest.mark.parametrize("mirrored", [False, True])
def test_turning_and_mirroring_the_world_turns_and_mirrors_the_sector(turns: int, mirrored: bool) -> None:
    rng = np.random.default_rng(5)
    for _ in range(12):
        occupied = cluttered(rng, 0.12)
        side_y, side_x = occupied.shape
        x, y = rng.integers(2 * 64, (27 * 64, 20 * 64)) / 64  # 64ths: turning them rounds nothing
        heading = math.radians(int(rng.integers(-18, 18)) * 10)
        seen = np.zeros(occupied.shape, np.uint8)
        for value, cells in enumerate(sector(occupied, x, y, heading, QUARTER, 9.0), start=1):
            for cell in cells:
                seen[cell] = value
        if mirrored:
            occupied, seen, x, heading = occupied[:, ::-1], seen[:, ::-1], side_x - x, math.pi - heading
        for _ in range(turns):
            occupied, seen, (x, y), heading = np.rot90(occupied), np.rot90(seen), (y, side_x - x), heading + QUARTER
            side_x, side_y = side_y, side_x
        free, hit = sector(np.ascontiguousarray(occupied), x, y, heading, QUARTER, 9.0)
        assert free == set(map(tuple, np.argwhere(seen == 1).tolist()))
        assert hit == set(map(tuple, np.argwhere(seen == 2).tolist()))


def test_a_diagonal_wall_of_single_cells_does_not_leak() -> None:
    """The published scan looks through between two cells that share a corner."""
    occupied = np.zeros((40, 40), np.uint8)
    occupied[np.arange(40), np.arange(40)] = 1
    rows, cols = np.mgrid[:40, :40]
    beyond = set(map(tuple, np.argwhere(cols < rows).tolist()))
    for x, y in ((25.5, 10.5), (30.25, 4.0), (21.7, 17.3)):
        free, hit = sector(occupied, x, y, -3 * math.pi / 4, math.pi, 30.0)
        assert not free & beyond
        assert {row for row, _ in hit} == {col for _, col in hit}
        assert len(hit) > 10
    leaking = rays(occupied, 25.5, 10.5, -3 * math.pi / 4, math.pi, math.radians(0.7), 30.0)
    assert leaking[0] & beyond


def test_inside_an_obstacle_nothing_is_seen() -> None:
    occupied = grid("#####", "#...#", "#.#.#", "#...#", "#####")
    assert sector(occupied, 2.4, 2.6, 0.0, math.pi, 5.0) == (set(), set())
    assert rays(occupied, 2.4, 2.6, 0.0, math.pi, 0.1, 5.0) == (set(), set())


def test_a_small_sector_by_hand() -> None:
    occupied = grid("#######", "#.....#", "#.....#", "#..#..#", "#.....#", "#######")
    free, hit = sector(occupied, 1.5, 3.5, 0.0, 0.1, 10.0)
    assert (free, hit) == ({(3, 1), (3, 2)}, {(3, 3)})
    free, _ = sector(occupied, 3.5, 1.5, -QUARTER, QUARTER, 10.0)
    assert (4, 3) not in free
    assert {(4, 1), (4, 5), (1, 1), (1, 5)} <= free  # the fan's edge belongs to it


@pytest.mark.slow
@pytest.mark.parametrize("pixels_per_metre", [10, 16, 25, 40])
def test_rays_are_the_published_ones_on_real_plans(published_lines: list[bytes], pixels_per_metre: int) -> None:
    rng = np.random.default_rng(pixels_per_metre)
    for line in published_lines[: 1 if UNCOMPILED else 50]:
        free, _ = free_mask(decode(line), pixels_per_metre, y_up=True)
        occupied = (~free).view(np.uint8)
        row, col = rng.choice(np.argwhere(free))
        x, y, heading = rng.uniform((col, row, -math.pi), (col + 1, row + 1, math.pi))
        scan = (occupied, x, y, heading, math.pi, math.radians(0.7 if pixels_per_metre > 16 else 2.0))
        range_px = 2.0 * pixels_per_metre
        assert rays(*scan, range_px) == slow_rays(*scan, range_px)


@pytest.mark.parametrize(("settled", "seen"), [(False, 0.5), (True, 0.5), (True, 0.99)])
def test_rays_merged_at_once_are_rays_scanned_and_merged(settled: bool, seen: float) -> None:
    rng, fan = np.random.default_rng(6), np.arange(-QUARTER, QUARTER, 0.1)
    for _ in range(12):
        occupied = cluttered(rng, 0.1)
        observable = rng.integers(0, 2, occupied.shape).astype(np.uint8)
        known = (rng.random(occupied.shape) < seen).astype(np.uint8)
        known *= FREE * (1 - occupied if settled else 1)  # settled: nothing that is known for free is solid
        x, y, heading, range_px = rng.uniform((-2, -2, -4, 3), (31, 24, 4, 70))
        scan = (x, y, heading, np.cos(fan), np.sin(fan), range_px)
        runs, hit, expected = np.empty((len(fan) * 72, 2), np.int32), np.empty(len(fan), np.int32), known.copy()
        n_runs, n_hit = ray_scan(occupied, *scan, runs, hit)
        counted = merge_runs(expected, observable, runs, n_runs, FREE, UNASKED)
        merge_cells(expected, observable, hit, n_hit, OBSTACLE, UNASKED)
        ends = np.empty(len(fan), np.int32)
        new, covered, n_ends = merge_ray_scan(occupied, observable, known, *scan, ends, settled, UNASKED)
        assert (new, covered) == counted
        assert ends[:n_ends].tolist() == hit[:n_hit].tolist()
        merge_cells(known, observable, ends, n_ends, OBSTACLE, UNASKED)
        assert np.array_equal(known, expected)
        assert (known == UNKNOWN).any()


def test_the_free_corner_is_the_biggest_rectangle() -> None:
    rng = np.random.default_rng(8)
    for across, along in ((1, 1), (-1, 1), (1, -1), (-1, -1)):
        for share in (0.0, 0.02, 0.1, 1.0):
            known = np.where(rng.random((14, 17)) < share, UNKNOWN, FREE).astype(np.uint8)
            row, col, far = *rng.integers((14, 17)).tolist(), 9
            corner = known[row::along, col::across][: far + 1, : far + 1] == FREE  # from the cell outwards
            sizes = [
                (high * wide if corner[:high, :wide].all() else 0)
                for high in range(1, corner.shape[0] + 1)
                for wide in range(1, corner.shape[1] + 1)
            ]
            wide, high = find_free_rectangle(known, col, row, across, along, far)
            assert (wide + 1) * (high + 1) == max(sizes)
            assert corner[: high + 1, : wide + 1].all()


def test_sectors_hold_on_real_plans(published_lines: list[bytes]) -> None:
    rng = np.random.default_rng(3)
    for line in published_lines[: 1 if UNCOMPILED else 4]:
        free, _ = free_mask(decode(line), 10, y_up=True)
        occupied = (~free).view(np.uint8)
        row, col = rng.choice(np.argwhere(free))
        x, y, heading = rng.uniform((col, row, -math.pi), (col + 1, row + 1, math.pi))
        assert sector(occupied, x, y, heading, QUARTER, 25.0) == slow_sector(occupied, x, y, heading, QUARTER, 25.0)


@pytest.mark.skipif(UNCOMPILED, reason="this is that run")
@pytest.mark.slow
def test_all_kernels_hold_uncompiled_too() -> None:
    here = Path(__file__).resolve()
    files = sorted(str(path) for path in here.parent.glob("test_*kernels.py"))
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *files],
        cwd=here.parents[5],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout
