"""Turn a scanned mesh or a point cloud into columns: a raster that says at which heights something stands in a cell."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from pipeline.geometry.meshes import Mesh
from pipeline.tolerances import (
    ALMOST_ALL,
    AROUND_M,
    BLUR_PX,
    CM_M,
    HAND_M,
    HARDLY,
    LARGELY,
    MANY_FACES,
    MOSTLY,
    NEARLY_ALL,
    RUN_M,
    SOME,
    STAND_M,
    THIN_WALL_M,
)

# ---------------------------------------------------------------------------------------------------------------------
# What stands over each spot of a scanned surface, height by height: a raster of columns.
#
# A scan is a surface of small faces, seen from inside: it is noisy, a part of it is missing, and furniture has grown
# together with the walls. One section through it says little; what persists over many heights is a wall.
#
# R1  The raster lies along the house's main direction, so that most walls run along its rows and columns.
# R2  Each face that does not lie flat is cut at every plane of a stack, a few centimetres apart, and marks the cells
#     that the cut touches, and their neighbours: noise moves a wall from height to height.
# ---------------------------------------------------------------------------------------------------------------------

SAMPLE = 30000
CLOSE_DEG = np.arange(-4.0, 4.1, 0.25)
MAX_SCAN_CELLS = 4_000_000
CUT_SPREAD_CELLS = 1
"""The number of cells on each side of a cut that are marked with it."""

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]
Shares = npt.NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Raster:
    """Where cells lie: ``origin`` (2,) metres in the turned frame, ``cell_m``, (rows, columns), ``along`` the rows."""

    origin: Floats
    cell_m: float
    shape: tuple[int, int]
    along: Floats

    @property
    def axes(self) -> Floats:
        """(2, 2): the unit vectors of rows' direction and columns' direction, in the level frame."""
        return np.array([self.along, [-self.along[1], self.along[0]]])

    def cells(self, points: Floats) -> npt.NDArray[np.int64]:
        """Return the flat index of the cell of each point (n, 2) of the level frame."""
        at = np.floor((points @ self.axes.T - self.origin) / self.cell_m).astype(np.int64)
        return np.asarray(at[:, 1] * self.shape[1] + at[:, 0])

    def level_points(self, pixels: Floats) -> Floats:
        """Level-frame points of (column, row) pixel centres (n, 2)."""
        return np.asarray(((pixels + 0.5) * self.cell_m + self.origin) @ self.axes)

    def size(self, metres: float) -> int:
        """Return a length in cells, at least 1."""
        return max(1, round(metres / self.cell_m))


@dataclass(frozen=True, eq=False)
class Columns:
    """``stands`` (planes, rows, columns) at ``heights`` (planes,) metres above the floor.

    ``ground`` (rows, columns) is where floor or the top of something low is seen, ``ceiling_m`` where the walls end, if
    a ceiling was seen.
    """

    raster: Raster
    heights: Floats
    stands: Bools
    ground: Bools
    ceiling_m: float | None = None

    def share(self, low_m: float, high_m: float) -> Shares:
        """Return for each cell the share of the planes between two heights in which something stands."""
        chosen = (self.heights >= low_m) & (self.heights <= high_m)
        return np.asarray(self.stands[chosen].mean(axis=0, dtype=np.float32))

    @property
    def amount(self) -> npt.NDArray[np.int64]:
        """How many cells are marked at each height."""
        return np.asarray(self.stands.sum(axis=(1, 2)), np.int64)


def is_scan(mesh: Mesh) -> bool:
    """Return whether a mesh follows a scanned surface: most of its upright area lies in faces of short edges."""
    if len(mesh.faces) < MANY_FACES:
        return False
    corners = mesh.vertices[mesh.faces]
    edges = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).max(axis=1)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normal, axis=1)
    upright = np.abs(normal[:, 2]) < 0.5 * area
    # the faces of a scan have shorter edges
    return bool(area[upright & (edges < RUN_M)].sum() > LARGELY * area[upright].sum() > 0)


def columns_of_mesh(mesh: Mesh, low_m: float, high_m: float, cell_m: float) -> Columns:
    """Return the columns of a mesh between two heights above the floor."""
    corners = mesh.vertices[mesh.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normal, axis=1)
    flat = np.abs(normal[:, 2]) > MOSTLY * area  # floor, ceiling or the top of something
    heights = np.arange(low_m, high_m, STAND_M)
    ends, plane = _cuts(corners[~flat], heights)
    along = sharpest_direction(ends.mean(axis=1), _main_direction(ends))
    raster = raster_around_points(ends.reshape(-1, 2), along, cell_m)
    stands = np.zeros((len(heights), *raster.shape), bool)
    if len(ends):
        points, at = _points(ends, plane, raster.cell_m)
        stands.reshape(len(heights), -1)[at, raster.cells(points)] = True
    square = np.ones((2 * CUT_SPREAD_CELLS + 1, 2 * CUT_SPREAD_CELLS + 1), np.uint8)
    for layer in stands:
        layer[:] = cv2.dilate(layer.view(np.uint8), square).view(bool)
    low = flat & (corners[:, :, 2].max(axis=1) < 1.2)
    return Columns(raster, heights, stands, _ground(corners[low], raster))


def _cuts(corners: Floats, heights: Floats) -> tuple[Floats, npt.NDArray[np.int64]]:
    """Return the segments (n, 2, 2) of all faces at all planes, and the plane of each."""
    order = np.argsort(corners[:, :, 2], axis=1)
    a, b, c = np.moveaxis(np.take_along_axis(corners, order[:, :, None], axis=1), 1, 0)
    first, last = np.searchsorted(heights, a[:, 2]), np.searchsorted(heights, c[:, 2])
    count = last - first
    face = np.repeat(np.arange(len(corners)), count)
    plane = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count) + first[face]
    z = heights[plane]
    a, b, c = a[face], b[face], c[face]
    lower = z < b[:, 2]
    return np.stack([_at(a, c, z), np.where(lower[:, None], _at(a, b, z), _at(b, c, z))], axis=1), plane


def _at(low: Floats, high: Floats, z: Floats) -> Floats:
    rise = high[:, 2] - low[:, 2]
    share = np.clip((z - low[:, 2]) / np.where(rise > 0, rise, 1.0), 0.0, 1.0)
    return np.asarray(low[:, :2] + share[:, None] * (high - low)[:, :2])


def raster_around_points(plan: Floats, along: Floats, cell_m: float) -> Raster:
    """A raster over plan points (n, 2) with a margin, its cells larger where they would be too many."""
    axes = np.array([along, [-along[1], along[0]]])
    turned = plan @ axes.T
    low = turned.min(axis=0, initial=0.0 if not len(turned) else np.inf) - AROUND_M
    high = turned.max(axis=0, initial=0.0 if not len(turned) else -np.inf) + AROUND_M
    while np.prod((high - low) / cell_m) > MAX_SCAN_CELLS:
        cell_m *= 1.25
    columns, rows = (np.ceil((high - low) / cell_m).astype(int) + 1).tolist()
    return Raster(low, cell_m, (rows, columns), along)


def _main_direction(ends: Floats) -> Floats:
    """Return the direction that most of the segments' length follows, modulo a right angle."""
    import scipy.ndimage

    d = ends[:, 1] - ends[:, 0]
    length = np.hypot(*d.T)
    turns = 4.0 * np.arctan2(d[:, 1], d[:, 0])
    angle = np.rad2deg(turns % (2 * np.pi)) / 4.0
    histogram = np.bincount(np.floor(angle).astype(int) % 90, length, 90)
    smooth = scipy.ndimage.convolve1d(histogram, np.hanning(13)[1:-1], mode="wrap")
    peak = np.deg2rad(4.0 * (float(np.argmax(smooth)) + 0.5))
    near = np.cos(turns - peak) > np.cos(np.deg2rad(4 * 10.0))
    mean = np.angle(np.sum(length[near] * np.exp(1j * turns[near]))) / 4.0 if near.any() else 0.0
    return np.array([np.cos(mean), np.sin(mean)])


def sharpest_direction(plan: Floats, along: Floats, turns_deg: Floats = CLOSE_DEG) -> Floats:
    """Return ``along``, turned so that points (n, 2) projected along the walls fall on the fewest places."""
    points = plan[:: max(1, len(plan) // SAMPLE)]
    best, most = along, 0.0
    for turn in np.deg2rad(turns_deg):
        c, s = np.cos(turn), np.sin(turn)
        tried = np.array([c * along[0] - s * along[1], s * along[0] + c * along[1]])
        seen = 0.0
        for axis in (tried, np.array([-tried[1], tried[0]])):
            at = np.floor(points @ axis / STAND_M).astype(np.int64)
            seen += float((np.bincount(at - at.min()) ** 2.0).sum()) if len(at) else 0.0
        if seen > most:
            best, most = tried, seen
    return best


def _points(ends: Floats, plane: npt.NDArray[np.int64], cell_m: float) -> tuple[Floats, npt.NDArray[np.int64]]:
    """Points along segments, less than a cell apart, and the plane of each."""
    length = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
    count = np.ceil(length / (0.8 * cell_m)).astype(np.int64) + 1
    segment = np.repeat(np.arange(len(ends)), count)
    step = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    share = (step / np.maximum(count[segment] - 1, 1))[:, None]
    return ends[segment, 0] + share * (ends[segment, 1] - ends[segment, 0]), plane[segment]


def _ground(corners: Floats, raster: Raster) -> Bools:
    """Return the cells under or close to faces, each sampled at points a quarter of an edge apart at most."""
    weights = np.array([[i, j, 4 - i - j] for i in range(5) for j in range(5 - i)]) / 4.0
    points = (weights @ corners[:, :, :2]).reshape(-1, 2)
    at = raster.cells(points)
    inside = (at >= 0) & (at < raster.shape[0] * raster.shape[1])
    seen = np.zeros(raster.shape, bool)
    seen.reshape(-1)[at[inside]] = True
    return cv2.dilate(seen.view(np.uint8), np.ones((3, 3), np.uint8)).view(bool)


# ---------------------------------------------------------------------------------------------------------------------
# A cloud of points without most of its noise: each point is drawn to the middle of those about it.
#
# Walls stand upright, so the points above and below a point show where its wall is.
#
# R1  Each band of heights is handled by itself. Seen from above, each point moves STEPS times to the mean of the points
#     around it, weighted by a Gaussian: to the ridge of its wall.
# R2  A point with far fewer points around it than those of walls is an outlier, and is dropped.
# ---------------------------------------------------------------------------------------------------------------------

STEPS = 4
MAX_PIXELS = 16_000_000


def denoise_points(points: Floats) -> Floats:
    """Return the points (n, 3) that stand, each moved to the ridge of its wall by mean shift; outliers are dropped."""
    if not len(points):
        return points
    band = np.floor((points[:, 2] - points[:, 2].min()) / RUN_M).astype(np.int64)
    found = [_of_band(points[band == k]) for k in range(int(band.max()) + 1)]
    return np.concatenate(found)


def _of_band(points: Floats) -> Floats:
    if not len(points):
        return points
    low = points[:, :2].min(axis=0) - 4 * STAND_M
    size = points[:, :2].max(axis=0) + 4 * STAND_M - low
    pixel = max(CM_M, float(np.sqrt(np.prod(size) / MAX_PIXELS)))
    columns, rows = (np.ceil(size / pixel).astype(int) + 1).tolist()
    at = (points[:, :2] - low) / pixel
    cell = np.floor(at).astype(np.int64)
    flat = cell[:, 1] * columns + cell[:, 0]
    sums = [np.bincount(flat, weight, rows * columns) for weight in (None, at[:, 0], at[:, 1])]
    mass, x, y = (_blur(each.reshape(rows, columns).astype(np.float64), STAND_M / pixel) for each in sums)
    middle = np.stack([x, y], axis=2) / np.maximum(mass, 1e-6)[:, :, None]
    for _ in range(STEPS):  # R1
        cell = np.floor(at).astype(np.int64)
        at = middle[cell[:, 1], cell[:, 0]]
    cell = np.floor(at).astype(np.int64)
    close = mass[cell[:, 1], cell[:, 0]]
    kept = close > HARDLY * np.quantile(close, NEARLY_ALL)  # R2
    return np.column_stack([at[kept] * pixel + low, points[kept, 2]])


def _blur(image: Floats, sigma_px: float) -> Floats:
    return np.asarray(cv2.GaussianBlur(image, (0, 0), sigma_px), np.float64)


# ---------------------------------------------------------------------------------------------------------------------
# The columns of a point cloud: what stands over each spot of it, height by height, as of a scanned surface.
#
# R1  The raster lies in the direction in which the points above the floor fall on the fewest rows and columns.
# R2  A layer of heights is thick enough that a wall has three points in each of its cells: a sparse cloud has
#     few and thick layers.
# R3  Ground is where the points near the floor's height are as dense as most of them; outliers lie far apart.
# ---------------------------------------------------------------------------------------------------------------------

TURNS_DEG = np.arange(0.0, 90.0, 1.5)


def columns_of_points(points: Floats, low_m: float, high_m: float, cell_m: float) -> Columns:
    """Return the columns of points (n, 3) between two heights above the floor; ``high_m`` is the ceiling's height."""
    inside = (points[:, 2] >= low_m) & (points[:, 2] < high_m)
    standing = denoise_points(points[inside])
    raster = _raster(standing[:, :2], cell_m)
    cells = raster.cells(standing[:, :2])
    step = _step(cells, float(np.ptp(standing[:, 2])) if len(standing) else 0.0)
    count = max(1, int((high_m - low_m) / step))
    step = (high_m - low_m) / count
    layer = np.minimum(((standing[:, 2] - low_m) / step).astype(np.int64), count - 1)
    stands = np.zeros((count, *raster.shape), bool)
    stands.reshape(count, -1)[layer, cells] = True
    square = np.ones((2 * CUT_SPREAD_CELLS + 1, 2 * CUT_SPREAD_CELLS + 1), np.uint8)
    for each in stands:
        each[:] = cv2.dilate(each.view(np.uint8), square).view(bool)
    floor = points[np.abs(points[:, 2]) < HAND_M, :2]
    heights = np.asarray(low_m + (np.arange(count) + 0.5) * step, np.float64)
    return Columns(raster, heights, stands, _ground_points(floor, raster), high_m)


def _raster(plan: Floats, cell_m: float) -> Raster:
    """Return the raster; points that lie on a grid of their own are sharpest in its direction."""
    off = np.random.default_rng(0).uniform(-cell_m / 2, cell_m / 2, plan.shape)
    along = sharpest_direction(plan + off, np.array([1.0, 0.0]), TURNS_DEG)
    return raster_around_points(plan, sharpest_direction(plan + off, along), cell_m)


def _step(cells: npt.NDArray[np.int64], height_m: float) -> float:
    """Return the distance of the planes at which faces are cut, metres."""
    mass = np.bincount(cells)
    if not len(cells):
        return STAND_M
    beside = 2 * CUT_SPREAD_CELLS + 1
    per_metre = beside * float(np.quantile(mass[mass > 0], ALMOST_ALL)) / max(height_m, STAND_M)
    return float(np.clip(3 / per_metre, STAND_M, THIN_WALL_M))  # three points in each cell


def _ground_points(floor: Floats, raster: Raster) -> Bools:
    """Return where points near the floor's height are as dense as most of them; outliers lie far apart."""
    rows, columns = raster.shape
    at = np.floor((floor @ raster.axes.T - raster.origin) / raster.cell_m).astype(np.int64)
    at = at[((at >= 0) & (at < (columns, rows))).all(axis=1)]
    if not len(at):
        return np.zeros(raster.shape, bool)
    mass = np.bincount(at[:, 1] * columns + at[:, 0], minlength=rows * columns).reshape(raster.shape)
    close = np.asarray(cv2.blur(mass.astype(np.float32), (BLUR_PX, BLUR_PX)), np.float32)
    usual = float(np.median(close[at[:, 1], at[:, 0]]))
    return np.asarray(close > SOME * usual)
