"""Robots' maps with known rooms: Bormann's, and maps made from these and from our own plans by furniture and noise."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import scipy.ndimage
from PIL import Image

Bools = npt.NDArray[np.bool_]
Labels = npt.NDArray[np.int32]

CELL_M = 0.05
WHITE = 250
"""Bormann's and ROSE2's maps are free where they are lighter."""
TRUE_PX = 200
_TRUTH = "_gt_segmentation"


@dataclass(frozen=True, eq=False)
class TrueMap:
    """A map (rows, cols) with the number of the true room of each cell, 0 for none."""

    name: str
    free: Bools
    rooms: Labels


def grey(path: Path) -> npt.NDArray[np.uint8]:
    """Return a picture as grey."""
    return np.asarray(Image.open(path).convert("L"))


def bormann_maps(folder: Path, kind: str = "") -> Iterator[TrueMap]:
    """Yield Bormann's maps with truth, by name; ``kind`` is "", "_furnitures", "_trashbins" or both."""
    for truth in sorted(folder.glob(f"*{_TRUTH}.png")):
        name = truth.stem.removesuffix(_TRUTH) + kind
        picture = folder / f"{name}.png"
        if not picture.is_file():
            continue
        free = grey(picture) > WHITE
        if free.shape == grey(truth).shape:  # one of the furnished maps has another scale
            _, rooms = cv2.connectedComponents((grey(truth) > WHITE).view(np.uint8), connectivity=4)
            sizes = np.bincount(rooms.ravel())
            sizes[0] = 0
            yield TrueMap(name, free, np.where(sizes[rooms] > TRUE_PX, rooms, 0).astype(np.int32))


def furnished(made: TrueMap, rng: np.random.Generator) -> TrueMap:
    """Put furniture into the rooms of a map: along walls, free in the room, and small things; doors stay passable."""
    taken = np.zeros_like(made.free)
    doors = made.free & (made.rooms == 0)
    from_door = scipy.ndimage.distance_transform_edt(~doors) * CELL_M
    from_wall = scipy.ndimage.distance_transform_edt(made.rooms > 0) * CELL_M
    for number, box in enumerate(scipy.ndimage.find_objects(made.rooms), 1):
        if box is None:
            continue
        room = made.rooms[box] == number
        if room.sum() * CELL_M**2 > 2.0:
            taken[box] |= _in_room(room, np.where(room, from_wall[box], 0.0), from_door[box], rng)
    return TrueMap(f"{made.name} furnished", made.free & ~taken, made.rooms)


def _in_room(room: Bools, from_wall: np.ndarray, from_door: np.ndarray, rng: np.random.Generator) -> Bools:
    down, right = np.gradient(from_wall)
    taken = np.zeros_like(room)
    row, col = np.nonzero(room)
    angle = rng.uniform(0, np.pi)
    corridor = from_wall.max() < 1.5 and len(row) * CELL_M**2 > 15.0  # people keep these clear
    wanted = rng.uniform(0.04, 0.2) * len(row) * (0.2 if corridor else 1.0)
    for _ in range(120):
        if taken.sum() > wanted:
            break
        k = rng.integers(len(row))
        middle = np.array([col[k], row[k]], float)
        turn = angle + rng.integers(4) * np.pi / 2
        if rng.random() < 0.2:
            long, deep = rng.uniform(0.1, 0.5, 2)
            turn = rng.uniform(0, np.pi)
        else:
            long, deep = rng.uniform(0.8, 2.4), rng.uniform(0.35, 0.9)
            if rng.random() < 0.2:
                long, deep = rng.uniform(1, 4), rng.uniform(0.3, 0.6)
            slope = np.array([right[row[k], col[k]], down[row[k], col[k]]])
            steep = np.hypot(*slope)
            if rng.random() < 0.75:  # against the wall
                if steep < 0.02:
                    continue
                middle -= slope / steep * (from_wall[row[k], col[k]] - deep / 2 - rng.choice([0, 0, 0, 0.1])) / CELL_M
                turn = np.arctan2(slope[1], slope[0]) + np.pi / 2
        box = cv2.boxPoints((tuple(middle.tolist()), (long / CELL_M, deep / CELL_M), float(np.degrees(turn))))
        piece = np.zeros(room.shape, np.uint8)
        cv2.fillPoly(piece, [np.rint(box).astype(np.int32)], 1)
        here = (piece > 0) & room
        if here.any() and from_door[here].min() > rng.choice([0.3, 0.6, 0.9]):
            taken |= here
    return taken


def noisy(made: TrueMap, rng: np.random.Generator) -> TrueMap:
    """Make walls rough, and sprinkle specks of obstacles and of free space, as a SLAM's map has them."""
    free = made.free.copy()
    rough = rng.choice([0.0, 0.6, 0.6, 1.2])
    if rough:
        inward = scipy.ndimage.distance_transform_edt(free) - scipy.ndimage.distance_transform_edt(~free)
        noise = scipy.ndimage.gaussian_filter(rng.normal(size=free.shape), rng.uniform(0.7, 3.0))
        free = inward + noise * (rough / noise.std()) > 0
    share = rng.choice([0.0, 1e-4, 1e-3])
    specks = rng.random(free.shape) < share
    free &= ~(scipy.ndimage.binary_dilation(specks) if rng.random() < 0.5 else specks)
    free |= rng.random(free.shape) < share / 3
    return TrueMap(f"{made.name} noisy", free, made.rooms)


def rose_maps(folder: Path) -> Iterator[TrueMap]:
    """Yield ROSE2's maps with truth, by name; as in ROSE2's evaluator, each colour but black is a room.

    The truth has the map's upper left corner; some are a pixel smaller or larger, and get the map's size here.
    """
    for truth in sorted(folder.glob("*_truth.png")):
        name = truth.stem.removesuffix("_truth")
        colours = np.asarray(Image.open(truth).convert("RGB")).astype(np.int32) @ (1 << 16, 1 << 8, 1)
        values, number = np.unique(colours, return_inverse=True)
        free = grey(folder / f"{name}.png") > WHITE
        rooms = np.zeros(free.shape, np.int32)
        rows, cols = np.minimum(free.shape, colours.shape)
        rooms[:rows, :cols] = (number.reshape(colours.shape) + int(values[0] != 0))[:rows, :cols]
        yield TrueMap(name, free, rooms)


def true_doors(made: TrueMap) -> npt.NDArray[np.float64]:
    """Return the middles (n, 2) of the free cells between two true rooms, (across, down) in cells: strokes."""
    _, pieces, stats, middles = cv2.connectedComponentsWithStats(
        (made.free & (made.rooms == 0)).view(np.uint8), connectivity=8
    )
    found = []
    for number in range(1, len(stats)):
        left, top, wide, high, _ = stats[number].tolist()
        part = np.s_[max(top - 2, 0) : top + high + 2, max(left - 2, 0) : left + wide + 2]
        near = cv2.dilate((pieces[part] == number).view(np.uint8), np.ones((3, 3), np.uint8)) > 0
        if len(np.unique(made.rooms[part][near & (made.rooms[part] > 0)])) > 1:
            found.append(middles[number])
    return np.array(found).reshape(-1, 2)
