"""Predict the parts of a robot's map that it has not seen: the probability of walls and of free space in each cell.

A small network looks at each unknown cell alone, through numbers that say which straight walls its row and its column
hold, how far away they are, and what is free around it. ``houseexpo train predictor`` trains it. It runs on NumPy.

R1  A straight wall is a run of ``_STRAIGHT`` or more wall cells in a row or column, one fewer at the map's border. For
    a row and for a column, the numbers are, to each side, the nearer side first: the distance to the next straight wall
    along it, the length of that wall, whether free cells lie before it, the distances to the next free cell and to the
    next wall cell; then the numbers of straight wall cells and of free cells within some metres, and the same number of
    walls in the two lines beside it; to each side, the distances to the next ``_CROSSINGS`` straight walls that cross
    it, and how many walls of this map are as thick as that would be of which the cell were the other surface; and
    whether the cell lies in a short gap between walls. Five more numbers count walls and free cells in squares around
    the cell, and walls whose thickness is seen. The rest is what lies around the cell: the shares of walls and free
    cells in squares of 0.1 m near by, 0.3 m farther off and 0.9 m beyond (``_FOVEA``), the nearer sides first.
R2  The answer is the mean of the network's answers for (row, column) and for (column, row). So the prediction of a
    turned or reflected map is the turned or reflected prediction.
R3  Known cells stay as they are.
R4  ``PredictedMap.to_map`` marks those unknown cells as walls with which the expected intersection over union of all
    walls is greatest, if cells were independent. So no threshold is tuned. A cell that is neither a wall that borders
    free space nor free, such as the inside of a solid wall, does not count.
    A measure that accepts a wall in a cell beside it forgives walls that are drawn too thick: for it, all cells are
    walls whose share of ``walls`` + ``free`` is ``_TOLERANT_SHARE`` or more.
R5  Drawings differ in how thick their lines are. Where ``_NEARLY_ALL`` of the lines that a map shows from both sides
    are two cells thick, not one, an unknown cell behind a surface, a wall cell that borders a free one on the other
    side, is a wall with the probability that a line has two cells, if the network gives it less.
R6  Maps of another resolution are predicted on cells of 0.1 m: each of these is a wall where one of the map's cells is,
    else free where one is, and each cell of the map gets the probabilities of the cell that it lies in.
"""

from __future__ import annotations

import io
import math
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any, Final

import cv2
import msgspec
import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.files import encode_json, read_file, write_atomically

Grid = npt.NDArray[np.uint8]
Bools = npt.NDArray[np.bool_]
Floats = npt.NDArray[np.float32]

UNKNOWN, FREE, OBSTACLE = 0, 127, 255
CELL_M: Final = 0.1
"""The side of the network's cells, metres."""
FORMAT: Final = "houseexpo predictor 1"
WEIGHTS: Final = "predictor.npz"
_TOLERANT_SHARE: Final = 0.15
"""Of shares from 0.15 to 0.6, the one with which PIPE's tolerant IoU on 30 made office floors was greatest (R4)."""
_TOLERANT_WALLS: Final = 0.02
"""Least probability of a wall in a cell that may be neither a wall nor free (R4)."""
_LARGEST: Final = 16 << 20
"""Largest size of a file of weights that is read, bytes; the project's has 80 kB."""
_STRAIGHT: Final = 3
"""Cells: what is seen of a wall through a door is short."""
_FAR: Final = 200
"""Cells beyond which nothing counts as near: the range of long lasers, 20 m."""
_LOOKS: Final = (21, 81, 161)
"""Lengths of a row or column, cells, in which straight walls are counted: one, four and eight metres to each side."""
_BOXES: Final = (21, 61)
"""Sides of squares, cells."""
_CROSSINGS: Final = 4
_THICKEST: Final = 10
"""Cells: the greatest thickness of walls that is counted."""
_FEW_WALLS: Final = 5
"""Seen thicknesses with which a map's own ones count half."""
_NEARLY_ALL: Final = 0.9
"""The share of lines of two cells with which a drawing has no others; plans, whose walls differ, seldom have it."""
_BESIDE: Final = ((0, 1), (0, -1), (1, 0), (-1, 0))
_GAP: Final = 16
"""Cells from wall to wall over a short gap."""
_FOVEA: Final = ((1, 9), (3, 7), (9, 5))
"""Squares around a cell: their side in cells, and how many stand in a row."""
_AROUND: Final = 23
"""Cells around a map, so that all squares lie within."""
_CELLS_AT_ONCE: Final = 1 << 14
_ORDER: Final = np.array([1.0, -1e-2, *(10.0**-k for k in range(3, 7 + _CROSSINGS))])
"""Which side is the nearer one: the distance decides, and of equal distances what follows it."""
LINE_NUMBERS: Final = 20 + 2 * _CROSSINGS
"""Numbers of a row, or of a column."""
_COUNTS: Final = 2 * len(_BOXES) + 1
_SQUARES: Final = sum(number**2 for _, number in _FOVEA)
NUMBERS: Final = 2 * LINE_NUMBERS + _COUNTS + 2 * _SQUARES


@dataclass(frozen=True, eq=False)
class PredictedMap:
    """A prediction of a map, in the cells of that map; row 0 as there.

    Parameters
    ----------
    known
        (rows, cols) uint8, the map: 0 unknown, 127 free, 255 obstacle.
    walls
        (rows, cols) float32, the probability that a cell is an obstacle that borders free space; 0 or 1 where known.
    free
        (rows, cols) float32, the probability that a cell is free space, in the building or inside of a drawn wall; 0 or
        1 where known.
    """

    known: Grid
    walls: Floats
    free: Floats

    @property
    def doubt(self) -> Floats:
        """The entropy of ``walls`` in bits (rows, cols), 0 (sure) to 1 (either is equally likely)."""
        p = np.clip(self.walls, 1e-6, 1 - 1e-6)
        found: Floats = np.where(self.known == UNKNOWN, -p * np.log2(p) - (1 - p) * np.log2(1 - p), 0.0)
        return found.astype(np.float32)

    def to_map(self, *, tolerant: bool = False) -> Grid:
        """Return the most useful map (rows, cols) uint8 of 127 and 255: walls by R4, all other unknown cells free.

        ``tolerant``: for a measure to which a wall in one of the cells around is right, such as PIPE's tolerant IoU.
        More cells are walls then (R4).
        """
        unknown = self.known == UNKNOWN
        walls, free = (each[unknown].astype(np.float64) for each in (self.walls, self.free))
        share = walls / np.maximum(walls + free, 1e-12)
        if tolerant:
            found = np.where(self.known == OBSTACLE, np.uint8(OBSTACLE), np.uint8(FREE))
            is_wall = (share >= _TOLERANT_SHARE) & (walls > _TOLERANT_WALLS)
            found[unknown] = np.where(is_wall, np.uint8(OBSTACLE), np.uint8(FREE))
            return found
        order = np.argsort(-share, kind="stable")
        seen = int(np.count_nonzero(self.known == OBSTACLE))
        hits, false = (np.concatenate([[0.0], np.cumsum(each[order])]) for each in (walls, free))
        iou = (seen + hits) / np.maximum(seen + hits[-1] + false, 1e-9)
        best = int(np.argmax(iou))
        found = np.where(self.known == OBSTACLE, np.uint8(OBSTACLE), np.uint8(FREE))
        if best:
            found[unknown] = np.where(share >= share[order[best - 1]], np.uint8(OBSTACLE), np.uint8(FREE))
        return found


def predict_map(known: npt.ArrayLike, resolution_m: float = CELL_M, network: Network | None = None) -> PredictedMap:
    """Predict the unknown cells of a robot's map of a building.

    Parameters
    ----------
    known
        (rows, cols) uint8, the map: 0 unknown, 127 free, 255 obstacle. Its axes lie along most walls.
    resolution_m
        The side of a cell, metres, at most 0.1.
    network
        A network from a file (``read_network``); by default, the network that comes with the project.

    Raises
    ------
    ConfigError
        The map has another type or shape or other values, or a number is out of range.

    Examples
    --------
    >>> import numpy as np
    >>> known = np.zeros((60, 80), np.uint8)
    >>> known[20:40, 20:40] = 127
    >>> known[19, 20:40] = 255
    >>> predict_map(known, 0.1).walls.shape
    (60, 80)
    """
    cells = _check_map(known)
    if not 0.0 < resolution_m <= CELL_M * (1 + 1e-9):
        raise ConfigError(
            f"predict_map: expected cells of at most {CELL_M} m, found resolution_m={resolution_m!r}; "
            "the network was trained on cells of that size"
        )
    scale = resolution_m / CELL_M
    coarse = cells if abs(scale - 1.0) < 1e-9 else _coarsen(cells, scale)
    found = _predict_cells(shipped_network() if network is None else network, coarse)
    if coarse is not cells:
        rows, cols = (
            np.minimum((np.arange(n) * scale).astype(int), m - 1)
            for n, m in zip(cells.shape, coarse.shape, strict=True)
        )
        found = found[:, rows[:, None], cols[None]]
    unknown = cells == UNKNOWN
    walls = np.where(unknown, found[0], cells == OBSTACLE).astype(np.float32)
    free = np.where(unknown, found[1], cells == FREE).astype(np.float32)
    return PredictedMap(cells, walls, free)


def check_cells(cells: Grid, what: str) -> None:
    """Raise ConfigError, which begins with ``what``, if cells have other values than unknown, free and obstacle."""
    strange = set(np.unique(cells).tolist()) - {UNKNOWN, FREE, OBSTACLE}
    if strange:
        raise ConfigError(
            f"{what}: expected {UNKNOWN} (unknown), {FREE} (free) or {OBSTACLE} (obstacle), found {min(strange)}"
        )


def _check_map(known: npt.ArrayLike) -> Grid:
    cells = np.asarray(known)
    if cells.dtype != np.uint8 or cells.ndim != 2 or not cells.size:
        raise ConfigError(f"predict_map: expected a map (rows, cols) uint8, found {cells.dtype} {cells.shape}")
    check_cells(cells, "predict_map")
    return cells


def _coarsen(cells: Grid, scale: float) -> Grid:
    """Return the map on the network's cells (R6)."""
    shape = tuple(max(math.ceil(n * scale - 1e-9), 1) for n in cells.shape)
    rows, cols = (
        np.minimum((np.arange(n) * scale).astype(int), m - 1) for n, m in zip(cells.shape, shape, strict=True)
    )
    flat = (rows[:, None] * shape[1] + cols[None]).ravel()
    found = np.zeros(shape[0] * shape[1], np.uint8)
    for value in (FREE, OBSTACLE):
        found[flat[cells.ravel() == value]] = value
    return found.reshape(shape)


# ---------------------------------------------------------------------------------------------------------------------
# What the network sees of a cell.
# ---------------------------------------------------------------------------------------------------------------------


def describe_cells(known: Grid, cells: npt.NDArray[np.intp]) -> Floats:
    """Return the numbers of unknown cells (R1), (n, NUMBERS) float32; ``cells`` are flat indices (n,)."""
    walls, free = known == OBSTACLE, known == FREE
    found = np.empty((len(cells), NUMBERS), np.float32)
    rows, cols = np.divmod(cells, known.shape[1])
    thicknesses = _count_thicknesses(walls, free) + _count_thicknesses(walls.T, free.T)
    total = thicknesses.sum()
    shares = np.append(0.0, thicknesses / (total + _FEW_WALLS)).astype(np.float32)
    turned = []
    for n, (wall, open_, at) in enumerate(((walls, free, cells), (walls.T, free.T, cols * known.shape[0] + rows))):
        found[:, n * LINE_NUMBERS : (n + 1) * LINE_NUMBERS], other = _describe_lines(
            np.ascontiguousarray(wall), np.ascontiguousarray(open_), at, shares
        )
        turned.append(other)
    at_end = 2 * LINE_NUMBERS
    for side in _BOXES:
        for what in (walls, free):
            share = cv2.boxFilter(what.astype(np.float32), -1, (side, side), borderType=cv2.BORDER_CONSTANT)
            found[:, at_end] = np.sqrt(share).ravel()[cells]
            at_end += 1
    found[:, at_end] = np.log1p(total)
    _look_around(walls, free, cells, (turned[1], turned[0]), found[:, at_end + 1 :])
    return found


def _make_exchange() -> npt.NDArray[np.intp]:
    """Return the places of the numbers after the exchange of row and column."""
    order = np.arange(NUMBERS)
    lines = order[: 2 * LINE_NUMBERS].reshape(2, LINE_NUMBERS)[::-1].ravel()
    at, parts = 2 * LINE_NUMBERS + _COUNTS, [lines, order[2 * LINE_NUMBERS : 2 * LINE_NUMBERS + _COUNTS]]
    for _ in range(2):
        for _, number in _FOVEA:
            parts.append(order[at : at + number**2].reshape(number, number).T.ravel())
            at += number**2
    return np.concatenate(parts)


_EXCHANGE: Final = _make_exchange()


def swap_lines(numbers: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return the numbers with those of the row and of the column exchanged."""
    return numbers[:, _EXCHANGE]


def _describe_lines(walls: Bools, free: Bools, cells: npt.NDArray[np.intp], shares: Floats) -> tuple[Floats, Bools]:
    """Return the numbers of cells' rows (n, LINE_NUMBERS), and for which cells the right side is nearer (n,)."""
    wall_bytes = walls.astype(np.uint8)
    straight = cv2.morphologyEx(wall_bytes, cv2.MORPH_OPEN, np.ones((1, _STRAIGHT), np.uint8)) != 0
    across = cv2.morphologyEx(wall_bytes, cv2.MORPH_OPEN, np.ones((_STRAIGHT, 1), np.uint8)) != 0
    rows, cols = np.divmod(cells, walls.shape[1])
    left, gap_left = _look_left(straight, across, walls, free, cells, shares)
    mirrored = rows * walls.shape[1] + walls.shape[1] - 1 - cols
    right, gap_right = _look_left(straight[:, ::-1], across[:, ::-1], walls[:, ::-1], free[:, ::-1], mirrored, shares)
    order = (right - left) @ _ORDER
    weighed = (4 * walls + free).astype(np.float32)
    ramp = np.arange(-_AROUND, _AROUND + 1, dtype=np.float32)
    lean = cv2.sepFilter2D(weighed, -1, ramp, np.ones_like(ramp), borderType=cv2.BORDER_CONSTANT).ravel()[cells]
    turned: Bools = (order < 0) | ((order == 0) & (lean > 0))
    swapped = turned[:, None]
    near, far = np.where(swapped, right, left), np.where(swapped, left, right)
    first = right.shape[1] - _CROSSINGS - 1
    found = [near[:, :first], far[:, :first]]
    counted = straight.astype(np.float32)
    for n, length in enumerate(_LOOKS):
        count = cv2.boxFilter(counted, -1, (length, 1), normalize=False, borderType=cv2.BORDER_CONSTANT)
        found.append(np.log1p(count.ravel()[cells])[:, None])
        if n == 1:
            padded = np.log1p(np.pad(count, ((1, 1), (0, 0))))
            beside = np.stack([padded[rows, cols], padded[rows + 2, cols]], axis=1)
            found.append(np.sort(beside, axis=1))
    for length in _LOOKS[:2]:
        count = cv2.boxFilter(free.astype(np.float32), -1, (length, 1), normalize=False, borderType=cv2.BORDER_CONSTANT)
        found.append(np.log1p(count.ravel()[cells])[:, None])
    found += [near[:, first:], far[:, first:], (gap_left + gap_right <= _GAP)[:, None]]
    return np.concatenate(found, axis=1).astype(np.float32), turned


def _look_left(  # noqa: PLR0917
    straight: Bools, across: Bools, walls: Bools, free: Bools, cells: npt.NDArray[np.intp], shares: Floats
) -> tuple[Floats, npt.NDArray[np.int32]]:
    """Return the numbers to the left of cells (n, 6 + _CROSSINGS), see R1, and the distance to the next wall (n,)."""
    along = np.arange(straight.shape[1], dtype=np.int32)
    rows, cols = np.divmod(cells, straight.shape[1])

    def last(mask: Bools) -> npt.NDArray[np.int32]:
        found: npt.NDArray[np.int32] = np.maximum.accumulate(np.where(mask, along, np.int32(-_FAR)), axis=1)
        return found

    def begins(mask: Bools) -> npt.NDArray[np.int32]:
        first = mask.copy()
        first[:, 1:] &= ~mask[:, :-1]
        return last(first)

    wall_at, begin_at = last(straight)[rows, cols], begins(straight)
    length = np.where(wall_at >= 0, wall_at - begin_at[rows, np.maximum(wall_at, 0)] + 1, 0)
    free_at, any_at = last(free)[rows, cols], last(walls)[rows, cols]
    away = [np.log1p(np.minimum(cols - at, _FAR)) for at in (wall_at, free_at, any_at)]
    found = [away[0], np.log1p(length), free_at > wall_at, away[1], away[2]]
    crossing_at, crossing_begin, at = last(across), begins(across), cols.astype(np.int32)
    for _ in range(_CROSSINGS):
        at = np.where(at > 0, crossing_at[rows, np.maximum(at - 1, 0)], np.int32(-_FAR))
        found.append(np.log1p(np.minimum(cols - at, _FAR)))
        at = np.where(at > 0, crossing_begin[rows, np.maximum(at, 0)], np.int32(-_FAR))
    thick = cols - any_at + 1
    found.append(shares[np.where((any_at > free_at) & (thick <= _THICKEST), thick, 0)])
    return np.stack(found, axis=1).astype(np.float32), cols - any_at


def _count_thicknesses(walls: Bools, free: Bools) -> npt.NDArray[np.int64]:
    """Return how many walls of 1, ..., ``_THICKEST`` cells the rows show, from free cell to free cell."""
    at = np.flatnonzero(free.ravel())
    across = np.diff(at) - 1
    within = (across >= 1) & (across <= _THICKEST) & (at[1:] % free.shape[1] > across)
    first, across = at[:-1][within], across[within]
    cells = np.ascontiguousarray(walls).ravel()
    real = cells[first + 1] & cells[first + across]
    return np.bincount(across[real], minlength=_THICKEST + 1)[1:]


def _look_around(
    walls: Bools, free: Bools, cells: npt.NDArray[np.intp], turned: tuple[Bools, Bools], found: Floats
) -> None:
    """Write the shares of walls and free cells in squares around cells (R1) to ``found`` (n, 2 * squares).

    ``turned`` says of which cells the lower, and the right, side comes first.
    """
    pad = _AROUND
    width = walls.shape[1] + 2 * pad
    rows, cols = np.divmod(cells, walls.shape[1])
    at = (rows + pad) * width + cols + pad
    down, right = (np.where(each, -1, 1)[:, None] for each in turned)
    first = 0
    for what in (walls, free):
        padded = np.pad(what.astype(np.float32), pad)
        for side, number in _FOVEA:
            shares = cv2.boxFilter(padded, -1, (side, side), borderType=cv2.BORDER_CONSTANT).ravel()
            offset = side * (np.arange(number) - number // 2)
            row, col = (each.ravel() for each in np.meshgrid(offset * width, offset, indexing="ij"))
            for start in range(0, len(cells), _CELLS_AT_ONCE):
                part = slice(start, start + _CELLS_AT_ONCE)
                where = at[part, None] + down[part] * row + right[part] * col
                found[part, first : first + number**2] = shares[where]
            first += number**2


# ---------------------------------------------------------------------------------------------------------------------
# The network.
# ---------------------------------------------------------------------------------------------------------------------


class Network:
    """A network of dense layers with ReLU between them.

    Parameters
    ----------
    arrays
        By name: ``mean`` and ``spread`` (NUMBERS,) of the numbers in training; for layer k = 0, 1, ...: ``w.k``
        (in, out) and ``b.k`` (out,). The last layer has two outputs, the logits of walls and of free space.
    name
        The name of the weights, for messages.

    Raises
    ------
    ConfigError
        Arrays are missing, or do not fit to each other.
    """

    def __init__(self, arrays: Mapping[str, npt.NDArray[Any]], name: str = "weights") -> None:
        self.arrays = {key: np.asarray(value, np.float32) for key, value in arrays.items()}
        self.layers = sum(key.startswith("w.") for key in arrays)
        try:
            fits = self(np.zeros((1, NUMBERS), np.float32)).shape == (1, 2)
        except (KeyError, ValueError) as error:
            raise ConfigError(f"{name}: expected the layers of a predictor, found others: {error}") from None
        if not fits or not self.layers:
            raise ConfigError(f"{name}: expected a predictor of walls and free space, found another number of outputs")

    def __call__(self, numbers: Floats, *, exchanged: bool = False) -> Floats:
        """Return the logits of walls and of free space (n, 2) for the numbers of cells (n, NUMBERS).

        ``exchanged`` gives those for ``swap_lines(numbers)``.
        """
        first = self.arrays["w.0"] / self.arrays["spread"][:, None]  # no copy of the numbers is scaled or exchanged
        x = numbers @ (first[np.argsort(_EXCHANGE)] if exchanged else first)
        x += self.arrays["b.0"] - self.arrays["mean"] @ first
        for k in range(1, self.layers):
            x = np.maximum(x, 0.0, out=x)
            x = x @ self.arrays[f"w.{k}"] + self.arrays[f"b.{k}"]
        return x


class _Card(msgspec.Struct, frozen=True):
    """What a file of weights says of itself."""

    format: str
    about: dict[str, Any]


def write_network(file: Path, arrays: Mapping[str, npt.NDArray[Any]], about: dict[str, Any]) -> None:
    """Write the weights of a network, with a description of their training."""
    content: dict[str, Any] = {**arrays, "card": np.frombuffer(encode_json(_Card(FORMAT, about)), np.uint8)}
    packed = io.BytesIO()
    np.savez_compressed(packed, **content)
    write_atomically(file, packed.getvalue(), durable=True)


def read_network(file: Path) -> tuple[Network, dict[str, Any]]:
    """Return a network and the description of its training.

    Raises
    ------
    ConfigError
        The file cannot be read, holds no weights of a predictor, or those of another layout.
    """
    try:
        with np.load(io.BytesIO(read_file(file, _LARGEST)), allow_pickle=False) as found:
            arrays = {name: found[name] for name in found.files}
        card = msgspec.json.decode(arrays.pop("card").tobytes(), type=_Card)
    except (OSError, KeyError, ValueError, EOFError, zipfile.BadZipFile, zlib.error, msgspec.MsgspecError) as error:
        raise ConfigError(
            f"{file}: expected weights of a predictor, made by `houseexpo train predictor`: {error}"
        ) from None
    if card.format != FORMAT:
        raise ConfigError(f"{file}: expected weights of the layout {FORMAT!r}, found {card.format!r}; train them again")
    return Network(arrays, str(file)), card.about


@cache
def shipped_network() -> Network:
    """Return the network that comes with the project."""
    with as_file(files("houseexpo.inference") / WEIGHTS) as file:
        return read_network(file)[0]


def _predict_cells(network: Network, known: Grid) -> Floats:
    """Return the probabilities of walls and free space in all cells (2, rows, cols), 0 where known (R2)."""
    cells = np.flatnonzero(known == UNKNOWN)
    numbers = describe_cells(known, cells)
    found = np.zeros((2, known.size), np.float32)
    for start in range(0, len(cells), _CELLS_AT_ONCE):
        part = numbers[start : start + _CELLS_AT_ONCE]
        logits = [network(part, exchanged=exchanged) for exchanged in (False, True)]
        both = [1.0 / (1.0 + np.exp(-np.clip(each, -30.0, 30.0))) for each in logits]
        found[:, cells[start : start + _CELLS_AT_ONCE]] = (0.5 * (both[0] + both[1])).T
    found = found.reshape(2, *known.shape)
    if (two_cells := find_share_of_thick_lines(known)) > _NEARLY_ALL:
        behind = find_cells_behind_surfaces(known)
        found[0, behind] = np.maximum(found[0, behind], two_cells)
        found[1, behind] = np.minimum(found[1, behind], 1.0 - found[0, behind])
    return found


def find_share_of_thick_lines(known: Grid) -> float:
    """Return the share of lines of two cells among those of one or two that a map shows from both sides (R5)."""
    walls, free = known == OBSTACLE, known == FREE
    one, two, *_ = _count_thicknesses(walls, free) + _count_thicknesses(walls.T, free.T)
    return float(two / (one + two + _FEW_WALLS))


def find_cells_behind_surfaces(known: Grid) -> Bools:
    """Return which unknown cells (rows, cols) lie behind a wall cell that borders a free one (R5)."""
    padded = np.pad(known, 2)
    found = np.zeros(padded.shape, bool)
    for row, col in _BESIDE:
        surface = np.roll(padded, (row, col), (0, 1)) == OBSTACLE
        found |= surface & (np.roll(padded, (2 * row, 2 * col), (0, 1)) == FREE)
    behind: Bools = found[2:-2, 2:-2] & (known == UNKNOWN)
    return behind
