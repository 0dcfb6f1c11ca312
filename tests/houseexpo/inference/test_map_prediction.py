"""Predicted maps: what goes in, what stays as it was known, which cells are marked as walls, and what is refused."""

from __future__ import annotations

import itertools
from importlib.resources import as_file, files
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

import houseexpo
from houseexpo.errors import ConfigError
from houseexpo.inference.map_prediction import (
    FREE,
    LINE_NUMBERS,
    NUMBERS,
    OBSTACLE,
    UNKNOWN,
    WEIGHTS,
    Network,
    PredictedMap,
    describe_cells,
    find_cells_behind_surfaces,
    find_share_of_thick_lines,
    predict_map,
    read_network,
    shipped_network,
    swap_lines,
    write_network,
)

Grid = npt.NDArray[np.uint8]


def half_seen_room(rows: int = 64, cols: int = 96) -> Grid:
    """A room of 4 x 6 m, of which the left half is seen: its floor and its walls."""
    known = np.full((rows, cols), UNKNOWN, np.uint8)
    known[12:52, 20:50] = FREE
    known[11, 19:50] = known[52, 19:50] = OBSTACLE
    known[11:53, 19] = OBSTACLE
    return known


def test_what_is_known_stays_and_the_rest_are_probabilities() -> None:
    known = half_seen_room()
    found = houseexpo.predict_map(known)
    assert found.walls.dtype == found.free.dtype == np.float32
    assert found.walls.shape == found.free.shape == known.shape
    seen = known != UNKNOWN
    np.testing.assert_array_equal(found.walls[seen], known[seen] == OBSTACLE)
    np.testing.assert_array_equal(found.free[seen], known[seen] == FREE)
    assert 0.0 <= found.walls.min() <= found.walls.max() <= 1.0
    assert not found.doubt[seen].any()
    assert 0.0 < found.doubt[~seen].max() <= 1.0


def test_walls_are_expected_to_go_on() -> None:
    found = predict_map(half_seen_room())
    ahead = found.walls[11, 50:56].mean(), found.walls[52, 50:56].mean()
    inside, outside = found.walls[30:34, 50:56].mean(), found.walls[2:6, 50:56].mean()
    assert min(ahead) > 3 * max(inside, outside)
    assert found.free[30:34, 50:56].mean() > 0.5
    marked = found.to_map()
    assert (marked[11, 50:53] == OBSTACLE).all() and (marked[52, 50:53] == OBSTACLE).all()  # noqa: PT018
    assert set(np.unique(marked)) == {FREE, OBSTACLE}
    tolerant = found.to_map(tolerant=True)
    assert (tolerant == OBSTACLE).sum() > (marked == OBSTACLE).sum()
    seen = half_seen_room() != UNKNOWN
    np.testing.assert_array_equal(tolerant[seen], half_seen_room()[seen])


def test_the_cells_behind_surfaces_are_those_that_are_looked_up_slowly() -> None:
    known = np.random.default_rng(0).choice(np.array([UNKNOWN, FREE, OBSTACLE], np.uint8), (30, 40))
    slow = np.zeros(known.shape, bool)
    for row, col in np.argwhere(known == UNKNOWN):
        for down, right in ((0, 1), (0, -1), (1, 0), (-1, 0)):
            far = row + 2 * down, col + 2 * right
            if 0 <= far[0] < known.shape[0] and 0 <= far[1] < known.shape[1]:
                slow[row, col] |= known[row + down, col + right] == OBSTACLE and known[far] == FREE
    np.testing.assert_array_equal(find_cells_behind_surfaces(known), slow)


@pytest.mark.parametrize(("cells", "share"), [(1, 0.0), (2, 60 / 65), (3, 0.0)])
def test_what_lies_behind_a_surface_follows_the_lines_of_the_drawing(cells: int, share: float) -> None:
    """Lines that stand in the seen half of the room show how thick lines are."""
    known = half_seen_room()
    known[17:47, 28 : 28 + cells] = known[17:47, 38 : 38 + cells] = OBSTACLE
    assert find_share_of_thick_lines(known) == pytest.approx(share)
    behind = predict_map(known).walls[10, 22:48]
    plain = predict_map(half_seen_room()).walls[10, 22:48]
    assert (behind >= share - 1e-6).all()
    assert bool((behind > plain + 0.2).all()) == (cells == 2)


def test_a_turned_map_has_a_turned_prediction() -> None:
    known = half_seen_room()
    straight = predict_map(known)
    for turn in (np.rot90, np.fliplr, np.transpose):
        other = predict_map(np.ascontiguousarray(turn(known)))
        np.testing.assert_allclose(other.walls, turn(straight.walls), atol=1e-5)


def test_a_finer_map_has_the_prediction_of_the_cells_in_which_its_cells_lie() -> None:
    known = half_seen_room()
    fine = predict_map(np.repeat(np.repeat(known, 2, axis=0), 2, axis=1), 0.05)
    np.testing.assert_array_equal(fine.walls, np.repeat(np.repeat(predict_map(known).walls, 2, axis=0), 2, axis=1))
    odd = predict_map(known[:37, :41], 0.04)
    assert odd.walls.shape == (37, 41)


def test_the_marked_walls_are_those_with_the_greatest_expected_overlap() -> None:
    rng = np.random.default_rng(0)
    for seen in (0, 1, 4):
        known = np.zeros((1, 6 + seen), np.uint8)
        known[0, 6:] = OBSTACLE
        walls = np.where(known == OBSTACLE, 1.0, np.round(rng.random(known.shape), 2)).astype(np.float32)
        found = PredictedMap(known, walls, 1 - walls).to_map()

        def overlap(marked: tuple[int, ...], p: npt.NDArray[np.float32] = walls, seen: int = seen) -> float:
            """The expected walls in both, as a share of the expected walls in one of them."""
            hits = float(p[0, list(marked)].sum())
            return (seen + hits) / max(seen + float(p[0, :6].sum()) + len(marked) - hits, 1e-9)

        every = [marked for n in range(7) for marked in itertools.combinations(range(6), n)]
        best = max(overlap(marked) for marked in every)
        assert overlap(tuple(np.flatnonzero(found[0, :6] == OBSTACLE).tolist())) == pytest.approx(best)


def describe_slowly(known: Grid, row: int, col: int) -> list[float]:  # noqa: PLR0915  # each number is looked up
    """The numbers of a cell by R1, each looked up cell by cell."""

    def in_straight_wall(line: list[int], at: int) -> tuple[int, int] | None:
        """The first and last place of the run of walls at a place, if it is long enough."""
        first = last = at
        while first > 0 and line[first - 1] == OBSTACLE:
            first -= 1
        while last < len(line) - 1 and line[last + 1] == OBSTACLE:
            last += 1
        enough = 2 if first == 0 or last == len(line) - 1 else 3
        return (first, last) if line[at] == OBSTACLE and last - first + 1 >= enough else None

    def thicknesses(cells: Grid) -> list[int]:
        """The thicknesses of walls that rows show, from free cell to free cell."""
        found = []
        for line in cells.tolist():
            open_ = [k for k, value in enumerate(line) if value == FREE]
            for one, other in itertools.pairwise(open_):
                if line[one + 1] == line[other - 1] == OBSTACLE and other - one - 1 <= 10:
                    found.append(other - one - 1)
        return found

    shown = thicknesses(known) + thicknesses(known.T)

    def look(cells: Grid, row: int, at: int) -> tuple[float, ...]:
        """To lower places; the numbers, and the distance to the next wall."""
        line = cells[row].tolist()
        straight = next((k for k in range(at - 1, -1, -1) if in_straight_wall(line, k)), None)
        free = next((k for k in range(at - 1, -1, -1) if line[k] == FREE), None)
        wall = next((k for k in range(at - 1, -1, -1) if line[k] == OBSTACLE), None)
        length = 0
        if straight is not None:
            first, _ = in_straight_wall(line, straight) or (0, 0)
            length = straight - first + 1
        far = [200 if k is None else min(at - k, 200) for k in (straight, free, wall)]
        before = free is not None and (straight is None or free > straight)
        across = [k for k in range(at) if in_straight_wall(cells[:, k].tolist(), row)]
        ends = [k for k in across if k + 1 not in across or k == at - 1][::-1][:4]
        crossings = [at - k for k in ends] + [200] * (4 - len(ends))
        surface = wall is not None and (free is None or wall > free) and far[2] + 1 <= 10
        share = shown.count(far[2] + 1) / (len(shown) + 5) if surface else 0.0
        numbers = np.log1p(far[0]), np.log1p(length), float(before), np.log1p(far[1]), np.log1p(far[2])
        return *numbers, *np.log1p(crossings), share, at - (-200 if wall is None else wall)

    def count(line: list[int], at: int, length: int, *, of_walls: bool) -> float:
        around = range(max(at - length // 2, 0), min(at + length // 2 + 1, len(line)))
        return float(np.log1p(sum(bool(in_straight_wall(line, k)) if of_walls else line[k] == FREE for k in around)))

    def lean(cells: Grid, row: int, col: int) -> float:
        """Above 0 if more is known to the right."""
        part = cells[max(row - 23, 0) : row + 24, max(col - 23, 0) : col + 24]
        away = np.arange(max(col - 23, 0), min(col + 24, cells.shape[1])) - col
        return float(((4 * (part == OBSTACLE) + (part == FREE)) * away).sum())

    def lines(cells: Grid, row: int, col: int) -> tuple[list[float], bool]:
        line = cells[row].tolist()
        left, right = look(cells, row, col), look(np.fliplr(cells), row, len(line) - 1 - col)
        order = (1, -1e-2, *(10.0**-k for k in range(3, 11)))
        keys = [float(np.dot(side[:-1], order)) for side in (left, right)]
        turned = keys[1] < keys[0] - 1e-12 or (abs(keys[1] - keys[0]) <= 1e-12 and lean(cells, row, col) > 0)
        near, far = (right, left) if turned else (left, right)
        walls = [count(line, col, length, of_walls=True) for length in (21, 81, 161)]
        beside = sorted(
            count(cells[r].tolist(), col, 81, of_walls=True) if 0 <= r < len(cells) else 0.0 for r in (row - 1, row + 1)
        )
        free = [count(line, col, length, of_walls=False) for length in (21, 81)]
        gap = float(near[-1] + far[-1] <= 16)
        return [*near[:5], *far[:5], *walls[:2], *beside, walls[2], *free, *near[5:10], *far[5:10], gap], turned

    along_row, right_first = lines(known, row, col)
    along_col, down_first = lines(known.T, col, row)
    squares = []
    for what, (side, number) in itertools.product((OBSTACLE, FREE), ((1, 9), (3, 7), (9, 5))):
        for i, j in itertools.product(range(-(number // 2), number // 2 + 1), repeat=2):
            top = row + side * (-i if down_first else i) - side // 2
            left = col + side * (-j if right_first else j) - side // 2
            part = known[max(top, 0) : max(top + side, 0), max(left, 0) : max(left + side, 0)]
            squares.append(float((part == what).sum() / side**2))
    return [*along_row, *along_col, float(np.log1p(len(shown))), *squares]


def test_the_numbers_of_cells_are_those_that_are_looked_up_slowly() -> None:
    rng = np.random.default_rng(0)
    for _ in range(3):
        known = rng.choice(np.array([UNKNOWN, FREE, OBSTACLE], np.uint8), (14, 19), p=(0.6, 0.15, 0.25))
        known[4, 3:9] = known[2:12, 15] = OBSTACLE
        cells = np.flatnonzero(known == UNKNOWN)
        found = describe_cells(known, cells)
        assert found.shape == (len(cells), NUMBERS)
        slow = np.array([describe_slowly(known, *divmod(cell, 19)) for cell in cells.tolist()])
        boxes = slice(2 * LINE_NUMBERS, 2 * LINE_NUMBERS + 4)
        np.testing.assert_allclose(np.delete(found, boxes, axis=1), slow, atol=1e-5)
        turned = describe_cells(
            np.ascontiguousarray(known.T), np.ravel_multi_index(np.divmod(cells, 19)[::-1], (19, 14))
        )
        np.testing.assert_allclose(swap_lines(turned), found, atol=1e-6)


@pytest.mark.parametrize(
    ("known", "options", "said"),
    [
        (np.zeros((4, 4), int), {}, "uint8"),
        (np.zeros(4, np.uint8), {}, "(rows, cols)"),
        (np.zeros((0, 4), np.uint8), {}, "(rows, cols)"),
        (np.full((4, 4), 7, np.uint8), {}, "found 7"),
        (np.zeros((4, 4), np.uint8), {"resolution_m": 0.2}, "at most 0.1 m"),
        (np.zeros((4, 4), np.uint8), {"resolution_m": float("nan")}, "at most 0.1 m"),
    ],
)
def test_what_is_no_map_is_refused(known: Grid, options: dict[str, float], said: str) -> None:
    with pytest.raises(ConfigError) as error:
        predict_map(known, **options)  # type: ignore[arg-type]
    assert said in str(error.value)


def test_weights_are_read_as_they_were_written(tmp_path: Path) -> None:
    shipped = shipped_network()
    write_network(tmp_path / "own.npz", shipped.arrays, {"seed": 3})
    network, about = read_network(tmp_path / "own.npz")
    assert about == {"seed": 3}
    known = half_seen_room()
    np.testing.assert_array_equal(predict_map(known, network=network).walls, predict_map(known).walls)


def test_weights_of_another_layout_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "own.npz"
    with pytest.raises(ConfigError, match="expected weights of a predictor"):
        read_network(file)
    for content in (b"", b"PK\x03\x04", b"weights"):
        file.write_bytes(content)
        with pytest.raises(ConfigError, match="expected weights of a predictor"):
            read_network(file)
    np.savez(file, something=np.zeros(3))
    with pytest.raises(ConfigError, match="expected weights of a predictor"):
        read_network(file)
    arrays = dict(shipped_network().arrays)
    for name, other in (("w.0", arrays["w.0"][:12]), ("w.1", arrays["w.1"].T), ("mean", arrays["mean"][:5])):
        write_network(file, {**arrays, name: other}, {})
        with pytest.raises(ConfigError, match=r"own\.npz: expected the layers of a predictor"):
            read_network(file)
    write_network(file, {**arrays, "w.2": arrays["w.2"][:, :1], "b.2": arrays["b.2"][:1]}, {})
    with pytest.raises(ConfigError, match="another number of outputs"):
        read_network(file)
    del arrays["w.0"]
    with pytest.raises(ConfigError, match=r"w\.0"):
        Network(arrays)


def test_the_network_that_comes_with_the_project_is_small_and_says_what_made_it() -> None:
    with as_file(files("houseexpo.inference") / WEIGHTS) as file:
        network, about = read_network(file)
        assert file.stat().st_size < 150_000
    assert [network.arrays[f"w.{k}"].shape for k in range(network.layers)] == [(NUMBERS, 96), (96, 48), (48, 2)]
    made = (about["seed"], about["houses"], about["thick"], about["floors"], about["steps"])
    assert made == (0, 500, 250, 200, 4000)
    assert about["commit"]
