"""Two SLAMs, Debian's icp-slam and GMapping, run on the log of a simulated run; their maps compared with ours.

Protocol. A robot explores a house by ``yield_frontier_actions``; PseudoSLAM draws its map without noise. The same path
is written as a CARMEN log: ranges with 1 cm of noise, odometry that drifts by 1 cm and 0.5 degrees in a metre and 1
degree in a full turn (adding up as random walks do). Both have cells of 5 cm and see 10 m, half round.
Both SLAMs start at the robot's start, and are told how much odometry errs.

``carmen2rawlog`` converts the log, ``icp-slam`` matches each scan against the points that it has and draws its map.
``make gmapping`` builds GMapping, which reads the log itself (``tests/builders/gmapping``).
"""

from __future__ import annotations

import gzip
import math
import struct
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import pytest
from scipy.ndimage import binary_fill_holes

from houseexpo.floorplan import FloorPlan
from houseexpo.pseudoslam.config import LaserConfig, SimulatorConfig
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE
from houseexpo.pseudoslam.simulator import Action, Simulator
from research.carmen_logs import OdometryDrift, Pose, Reading, Scanner, simulate_readings, write_log
from tests.builders.needs import need
from tests.builders.simulations import yield_frontier_actions

CELL_M, RANGE_M, LASER_M = 0.05, 10.0, 0.01
SCANNER = Scanner(180.0, 361, RANGE_M)
DRIFT = OdometryDrift(metres_per_sqrt_metre=0.01, degrees_per_sqrt_metre=0.5, degrees_per_sqrt_turn=1.0)
SECONDS = 0.2
_PROGRAMS = ("carmen2rawlog", "rawlog-edit", "icp-slam")
_GMAPPING = Path(sys.prefix) / "gmapping"
_BEYOND_M = 1.0  # the map of GMapping is larger than the house by so much on each side: it may lie askew
_SCAN = b"mrpt::obs::CObservation2DRangeScan"

SETTINGS = f"""
[MappingApplication]
rawlog_offset = 0
logOutput_dir = slam
LOG_FREQUENCY = 0
SAVE_3D_SCENE = 0
SAVE_POSE_LOG = 0
CAMERA_3DSCENE_FOLLOWS_ROBOT = 0
SHOW_PROGRESS_3D_REAL_TIME = 0
SHOW_PROGRESS_3D_REAL_TIME_DELAY_MS = 0
SHOW_LASER_SCANS_3D = 0
# every scan is matched; one enters the map where the robot has moved a little
localizationLinDistance = 0.1
localizationAngDistance = 3
insertionLinDistance = 0.3
insertionAngDistance = 20
minICPgoodnessToAccept = 0.4
matchAgainstTheGrid = 0
occupancyGrid_count = 1
pointsMap_count = 1
gasGrid_count = 0
landmarksMap_count = 0
beaconMap_count = 0
likelihoodMapSelection = -1

[ICP]
ICP_algorithm = icpClassic
maxIterations = 80
minAbsStep_trans = 1e-6
minAbsStep_rot = 1e-6
# odometry is off by less than this from scan to scan
thresholdDist = 0.1
thresholdAng_DEG = 0.5
smallestThresholdDist = 0.03
ALFA = 0.8
onlyClosestCorrespondences = true
onlyUniqueRobust = false
corresponding_points_decimation = 2

[MappingApplication_pointsMap_00_insertOpts]
minDistBetweenLaserPoints = 0.01
fuseWithExisting = false
isPlanarMap = 1

[MappingApplication_occupancyGrid_00_creationOpts]
resolution = {CELL_M}

[MappingApplication_occupancyGrid_00_insertOpts]
mapAltitude = 0
useMapAltitude = 0
maxDistanceInsertion = {RANGE_M}
maxOccupancyUpdateCertainty = 0.6
considerInvalidRangesAsFreeSpace = 1
minLaserScanNoiseStd = 0.001
wideningBeamsWithDistance = 0
"""


@dataclass(frozen=True, eq=False)
class Run:
    """What PseudoSLAM made of an exploration; ``ms_per_scan`` is processor time of a whole step, view included."""

    simulator: Simulator
    known: npt.NDArray[np.uint8]
    poses: list[Pose]
    ms_per_scan: float


@dataclass(frozen=True, eq=False)
class SlamMap:
    """What the SLAM made of it: a picture, row 0 at the top, dark where occupied; ``bounds_m`` left, right, low, high.

    ``ms_per_scan`` is the program's own record of the time that it spent on a scan; of GMapping, on one that it used.
    """

    picture: npt.NDArray[np.uint8]
    bounds_m: tuple[float, float, float, float]
    ms_per_scan: float


def need_icp_slam() -> None:
    """Skip where the programs are not installed; fail where CI should have installed them."""
    need(programs=_PROGRAMS, how="on Debian and Ubuntu: apt-get install mrpt-apps")


def need_gmapping() -> None:
    """Skip where GMapping is not built, in CI too: its source comes from a public repository, not from a registry."""
    if not _GMAPPING.is_dir():
        pytest.skip("not there: gmapping; make gmapping")


def explore(plan: FloorPlan, seed: int = 0) -> Run:
    """Explore a house; the time is that of the same actions taken again, warm."""
    config = SimulatorConfig(1 / CELL_M, laser=LaserConfig(range_m=RANGE_M))
    simulator = Simulator.of(plan, config)
    state = simulator.start(np.random.default_rng(seed))
    poses, actions = [simulator.pose(state)], list[Action]()
    for action in yield_frontier_actions(simulator, state):
        simulator.step(state, action)
        poses.append(simulator.pose(state))
        actions.append(action)
    again = simulator.start(np.random.default_rng(seed))
    start = time.process_time()
    for action in actions:
        simulator.step(again, action)
    ms = 1000 * (time.process_time() - start) / len(actions)
    assert np.array_equal(again.known, state.known)
    return Run(simulator, state.known, poses, ms)


def simulate_log(run: Run, seed: int = 0) -> list[Reading]:
    """Return what the robot's laser and odometry say on the way of a run."""
    world, rng = run.simulator.world, np.random.default_rng(seed)
    return list(simulate_readings(world, SCANNER, run.poses, rng, drift=DRIFT, laser_m=LASER_M))


def run_icp_slam(run: Run, folder: Path) -> SlamMap:
    """Write the log of a run, convert it, check the conversion, and let icp-slam draw its map."""
    log = simulate_log(run)
    convert(log, folder)
    (folder / "slam.ini").write_text(SETTINGS)
    call(folder, "icp-slam", "slam.ini", "run.rawlog")
    made = folder / "slam"
    picture = cv2.imread(str(next(made.glob("*OccupancyGridMap2D*.png"))), cv2.IMREAD_GRAYSCALE)
    bounds = np.loadtxt(next(made.glob("*_limits.txt")), comments="%").tolist()
    ms = np.loadtxt(made / "log_times.txt")[:, 0].sum() / len(log)
    return SlamMap(np.asarray(picture, np.uint8), tuple(bounds), float(ms))


def run_gmapping(run: Run, folder: Path) -> SlamMap:
    """Write the log of a run, and let GMapping draw its map."""
    write_log(folder / "run.log", SCANNER, simulate_log(run), SECONDS)
    frame = run.simulator.world.frame
    rows, cols = frame.shape
    (left, low), _ = frame.points_from_pixels(np.array([[0, rows], [cols, 0]], float)) - _BEYOND_M
    width, height = (side * CELL_M + 2 * _BEYOND_M for side in (cols, rows))
    bounds = (left, low, left + width, low + height)
    said = call(folder, str(_GMAPPING / "gmapping_log"), "run.log", "map.pgm", *map(str, (*bounds, CELL_M)))
    picture = cv2.imread(str(folder / "map.pgm"), cv2.IMREAD_GRAYSCALE)
    seconds, scans = said.split()
    return SlamMap(np.asarray(picture, np.uint8), (left, bounds[2], low, bounds[3]), 1000 * float(seconds) / int(scans))


def convert(log: list[Reading], folder: Path, scanner: Scanner = SCANNER) -> None:
    """Write ``run.log`` and ``run.rawlog``, and check that the SLAM will read what was meant.

    carmen2rawlog 2.5.8 takes the log's seconds for 1e-12 of a second: all scans would lie at one time, and the SLAM
    stand still. Where it does, the log is written again with times in that unit.
    """
    for second in (1.0, 1e12):
        write_log(folder / "run.log", scanner, log, SECONDS * second)
        call(folder, "carmen2rawlog", "-q", "-w", "-i", "run.log", "-o", "run.rawlog")
        call(folder, "rawlog-edit", "-q", "-w", "--export-2d-scans-txt", "-i", "run.rawlog")
        scans = np.loadtxt(folder / "run_ROBOTLASER1.txt", comments="%")
        if scans[-1, 0] > scans[0, 0]:
            break
    assert scans.shape == (len(log), 1 + 2 * scanner.beams)
    np.testing.assert_allclose(np.diff(scans[:, 0]), SECONDS, atol=1e-3)
    first, ranges, valid = log[0].ranges_m, scans[0, 1 : 1 + scanner.beams], scans[0, 1 + scanner.beams :]
    np.testing.assert_allclose(ranges, first, atol=1e-3)
    np.testing.assert_array_equal(valid != 0, first < scanner.range_m)
    raw = gzip.decompress((folder / "run.rawlog").read_bytes())
    at = raw.index(_SCAN) + len(_SCAN) + 1  # after the name and a byte of its version
    aperture, to_the_left, range_m = struct.unpack_from("<f?f", raw, at)
    assert (np.float32(np.pi), True, scanner.range_m) == (np.float32(aperture), to_the_left, range_m)


def call(folder: Path, *command: str) -> str:
    """Run a program in a folder; return what it prints."""
    done = subprocess.run(command, cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{' '.join(command)}: {done.stdout[-2000:]}{done.stderr[-2000:]}"
    return done.stdout


# Two maps of one house, compared as the paper does: by the region that the walls enclose.


Mask = npt.NDArray[np.bool_]
Picture = npt.NDArray[np.uint8]
Move = tuple[float, float, float]

_WALL_M = 0.35  # walls up to so thick between rooms belong to the region
_SURE = 140  # of 255: brighter is free
_MAX_M, _MAX_RAD = 0.5, math.radians(10.0)  # GMapping turned one map of five by more than 3 degrees


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
    """Compare a run's map with the SLAM's; moves are tried up to ``_MAX_M`` and ``_MAX_RAD`` about the start."""
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
