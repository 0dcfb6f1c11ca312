"""Predict the parts of a robot's map that it has not seen: the probability of walls and of free space in each cell.

A small network looks at each unknown cell alone, through numbers that say which straight walls its row and its column
hold, how far away they are, and what is free around it. ``houseexpo train predictor`` trains it. It runs on NumPy.

R1  A straight wall is a run of ``_STRAIGHT`` or more wall cells in a row or column, one fewer at the map's border. For
    a row and for a column, the numbers are, to each side, the nearer side first: the distance to the next straight wall
    along it, the length of that wall, whether free cells lie before it, the distances to the next free cell and to the
    next wall cell; then the numbers of straight wall cells and of free cells within some metres, and the same number of
    walls in the two lines beside it. Four more numbers count walls and free cells in squares around the cell.
R2  The answer is the mean of the network's answers for (row, column) and for (column, row). So the prediction of a
    turned or reflected map is the turned or reflected prediction.
R3  What is known stays as it is known.
R4  ``PredictedMap.to_map`` marks those unknown cells as walls with which the expected intersection over union of all
    walls is greatest, if cells were independent. So no threshold is tuned.
R5  Maps of another resolution are predicted on cells of 0.1 m: each of these is a wall where one of the map's cells is,
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
from houseexpo.files import encode_json, write_atomically

Grid = npt.NDArray[np.uint8]
Bools = npt.NDArray[np.bool_]
Floats = npt.NDArray[np.float32]

UNKNOWN, FREE, OBSTACLE = 0, 127, 255
CELL_M: Final = 0.1
"""The side of the network's cells, metres."""
FORMAT: Final = "houseexpo predictor 1"
WEIGHTS: Final = "predictor.npz"
_STRAIGHT: Final = 3
"""Cells: what is seen of a wall through a door is short."""
_FAR: Final = 200
"""Cells beyond which nothing counts as near: the range of long lasers, 20 m."""
_LOOKS: Final = (21, 81, 161)
"""Lengths of a row or column, cells, in which straight walls are counted: one, four and eight metres to each side."""
_BOXES: Final = (21, 61)
"""Sides of squares, cells."""
_ORDER: Final = np.array([1.0, -1e-2, 1e-3, 1e-4, 1e-5], np.float32)
"""Which side is the nearer one: the distance decides, and of equal distances what follows it."""
LINE_NUMBERS: Final = 17
"""Numbers of a row, or of a column."""
NUMBERS: Final = 2 * LINE_NUMBERS + 2 * len(_BOXES)


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
        (rows, cols) float32, the probability that a cell is free space inside of the building; 0 or 1 where known.
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

    def to_map(self) -> Grid:
        """Return the most useful map (rows, cols) uint8 of 127 and 255: walls by R4, all other unknown cells free."""
        unknown = self.known == UNKNOWN
        likely = np.sort(self.walls[unknown])[::-1].astype(np.float64)
        seen = int(np.count_nonzero(self.known == OBSTACLE))
        hits = np.concatenate([[0.0], np.cumsum(likely)])
        marked = np.arange(len(hits))
        iou = (seen + hits) / np.maximum(seen + hits[-1] + marked - hits, 1e-9)
        best = int(np.argmax(iou))
        found = np.where(self.known == OBSTACLE, np.uint8(OBSTACLE), np.uint8(FREE))
        if best:
            found[unknown & (self.walls >= likely[best - 1])] = OBSTACLE
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
        The network of another file (``read_network``); None for the one that comes with the project.

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
    """Return the map on the network's cells (R5)."""
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
    for n, (wall, open_, at) in enumerate(((walls, free, cells), (walls.T, free.T, cols * known.shape[0] + rows))):
        found[:, n * LINE_NUMBERS : (n + 1) * LINE_NUMBERS] = _describe_lines(
            np.ascontiguousarray(wall), np.ascontiguousarray(open_), at
        )
    at_end = 2 * LINE_NUMBERS
    for side in _BOXES:
        for what in (walls, free):
            share = cv2.boxFilter(what.astype(np.float32), -1, (side, side), borderType=cv2.BORDER_CONSTANT)
            found[:, at_end] = np.sqrt(share).ravel()[cells]
            at_end += 1
    return found


def swap_lines(numbers: Floats) -> Floats:
    """Return the numbers with those of the row and of the column exchanged."""
    found: Floats = np.concatenate(
        [
            numbers[:, LINE_NUMBERS : 2 * LINE_NUMBERS],
            numbers[:, :LINE_NUMBERS],
            numbers[:, 2 * LINE_NUMBERS :],
        ],
        axis=1,
    )
    return found


def _describe_lines(walls: Bools, free: Bools, cells: npt.NDArray[np.intp]) -> Floats:
    """Return what rows say about cells (n, LINE_NUMBERS)."""
    straight = cv2.morphologyEx(walls.astype(np.uint8), cv2.MORPH_OPEN, np.ones((1, _STRAIGHT), np.uint8)) != 0
    rows, cols = np.divmod(cells, walls.shape[1])
    left = _look_left(straight, walls, free, cells)
    mirrored = rows * walls.shape[1] + walls.shape[1] - 1 - cols
    right = _look_left(straight[:, ::-1], walls[:, ::-1], free[:, ::-1], mirrored)
    swapped = (right @ _ORDER < left @ _ORDER)[:, None]
    found = [np.where(swapped, right, left), np.where(swapped, left, right)]
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
    return np.concatenate(found, axis=1).astype(np.float32)


def _look_left(straight: Bools, walls: Bools, free: Bools, cells: npt.NDArray[np.intp]) -> Floats:
    """Return what lies to the left of cells (n, 5): see R1."""
    along = np.arange(straight.shape[1], dtype=np.int32)
    rows, cols = np.divmod(cells, straight.shape[1])

    def last(mask: Bools) -> npt.NDArray[np.int32]:
        found: npt.NDArray[np.int32] = np.maximum.accumulate(np.where(mask, along, np.int32(-_FAR)), axis=1)
        return found

    begins = straight.copy()
    begins[:, 1:] &= ~straight[:, :-1]
    wall_at, begin_at = last(straight)[rows, cols], last(begins)
    length = np.where(wall_at >= 0, wall_at - begin_at[rows, np.maximum(wall_at, 0)] + 1, 0)
    free_at, any_at = last(free)[rows, cols], last(walls)[rows, cols]
    away = [np.log1p(np.minimum(cols - at, _FAR)) for at in (wall_at, free_at, any_at)]
    found: Floats = np.stack([away[0], np.log1p(length), free_at > wall_at, away[1], away[2]], axis=1)
    return found.astype(np.float32)


# ---------------------------------------------------------------------------------------------------------------------
# The network.
# ---------------------------------------------------------------------------------------------------------------------

_CELLS_AT_ONCE: Final = 1 << 14


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

    def __call__(self, numbers: Floats) -> Floats:
        """Return the logits of walls and of free space (n, 2) for the numbers of cells (n, NUMBERS)."""
        x = (numbers - self.arrays["mean"]) / self.arrays["spread"]
        for k in range(self.layers):
            x = x @ self.arrays[f"w.{k}"] + self.arrays[f"b.{k}"]
            if k < self.layers - 1:
                x = np.maximum(x, 0.0)
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
        with np.load(io.BytesIO(file.read_bytes()), allow_pickle=False) as found:
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
        both = [1.0 / (1.0 + np.exp(-np.clip(network(one), -30.0, 30.0))) for one in (part, swap_lines(part))]
        found[:, cells[start : start + _CELLS_AT_ONCE]] = (0.5 * (both[0] + both[1])).T
    return found.reshape(2, *known.shape)
