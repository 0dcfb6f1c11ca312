"""Two maps of one house, compared as the paper does: by the region that the walls enclose."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
from scipy.ndimage import binary_fill_holes

from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE
from tests.builders.real_slam import CELL_M, Run, SlamMap

Mask = npt.NDArray[np.bool_]
Picture = npt.NDArray[np.uint8]
Move = tuple[float, float, float]

_WALL_M = 0.35  # walls up to so thick between rooms belong to the region
_SURE = 140  # of 255: brighter is free
_MAX_M, _MAX_RAD = 0.3, math.radians(3.0)


@dataclass(frozen=True, eq=False)
class Comparison:
    """Intersection over union of the regions as they lie, and after the small move (m, m, rad) that fits them best.

    ``theirs`` is the SLAM's picture on our grid after that move; the regions are masks on it.
    """

    iou_as_is: float
    iou: float
    move: Move
    theirs: Picture
    our_region: Mask
    their_region: Mask


def compare(run: Run, found: SlamMap) -> Comparison:
    """Compare a run's map with the SLAM's; moves are tried up to 0.3 m and 3 degrees about the start."""
    x, y = run.simulator.world.frame.pixels_from_points(run.poses[0][:2]).tolist()
    start = int(y), int(x)
    ours = enclosed(run.known == FREE, start)

    def fit(move: Move) -> float:
        return iou(ours, enclosed(on_our_grid(run, found, move) > _SURE, start))

    as_is = fit((0.0, 0.0, 0.0))
    best, move = as_is, (0.0, 0.0, 0.0)
    step = np.array([CELL_M, CELL_M, math.radians(0.5)])
    for _ in range(4):
        better = True
        while better:
            better = False
            for change in np.concatenate([np.diag(step), -np.diag(step)]):
                tried = tuple(np.add(move, change).tolist())
                if max(abs(tried[0]), abs(tried[1])) > _MAX_M or abs(tried[2]) > _MAX_RAD:
                    continue
                if (found_iou := fit(tried)) > best:
                    best, move, better = found_iou, tried, True
        step /= 2
    theirs = on_our_grid(run, found, move)
    return Comparison(as_is, best, move, theirs, ours, enclosed(theirs > _SURE, start))


def enclosed(free: Mask, start: tuple[int, int]) -> Mask:
    """The piece of free cells that holds the start, with the walls between its rooms and all that lies within."""
    _, labels = cv2.connectedComponents(free.astype(np.uint8), connectivity=4)
    piece = np.pad((labels == labels[start]) & free, width := round(_WALL_M / CELL_M)).astype(np.uint8)
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (width, width))
    closed = cv2.morphologyEx(piece, cv2.MORPH_CLOSE, disc)[width:-width, width:-width]
    return np.asarray(binary_fill_holes(closed), bool)


def iou(a: Mask, b: Mask) -> float:
    return float(np.count_nonzero(a & b) / np.count_nonzero(a | b))


def on_our_grid(run: Run, found: SlamMap, move: Move) -> Picture:
    """The SLAM's picture at the middles of our cells, moved and turned about the start; gray where it has none."""
    frame = run.simulator.world.frame
    rows, cols = np.mgrid[: frame.shape[0], : frame.shape[1]] + 0.5
    points = frame.points_from_pixels(np.stack([cols, rows], axis=-1))
    x, y, _ = run.poses[0]
    cos, sin = math.cos(move[2]), math.sin(move[2])
    right, up = points[..., 0] - x, points[..., 1] - y
    left_m, right_m, _, high_m = found.bounds_m
    per_metre = found.picture.shape[1] / (right_m - left_m)
    at_x = (x + right * cos - up * sin + move[0] - left_m) * per_metre - 0.5
    at_y = (high_m - (y + right * sin + up * cos + move[1])) * per_metre - 0.5
    moved = cv2.remap(
        found.picture, at_x.astype(np.float32), at_y.astype(np.float32), cv2.INTER_LINEAR, borderValue=127
    )
    return np.asarray(moved, np.uint8)


def overlay(known: Picture, seen: Comparison) -> Picture:
    """Both regions light, ours alone blue, theirs alone orange; their walls red under ours; (rows, cols, 3)."""
    picture = np.full((*known.shape, 3), 255, np.uint8)
    picture[seen.our_region & seen.their_region] = (230, 234, 238)
    picture[seen.our_region & ~seen.their_region] = (31, 119, 180)
    picture[seen.their_region & ~seen.our_region] = (255, 127, 14)
    picture[seen.our_region & (seen.theirs < 255 - _SURE)] = (214, 39, 40)
    picture[known == OBSTACLE] = (40, 40, 40)
    return picture
