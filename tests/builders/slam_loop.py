"""Explorers that decide on the map that a real SLAM has drawn so far: ``icp-slam`` of Debian in the loop.

Protocol. The robot moves in the simulator, exactly as it is told. What it reads goes into a log: ranges with 1 cm of
noise, odometry that drifts as ``real_slam.DRIFT`` says. After every ``EVERY`` steps ``icp-slam`` draws its map of the
log so far; in between the explorer goes on with the last map, and with odometry from the last pose that the SLAM found.
It is shown that map only, on a grid that ends 5 m beyond the house. Coverage is what the sensor has seen in truth.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from houseexpo.floorplan import FloorPlan
from houseexpo.pseudoslam.agents.loading import load_policy
from houseexpo.pseudoslam.agents.protocol import Knowledge, Robot
from houseexpo.pseudoslam.config import LaserConfig, SimulatorConfig
from houseexpo.pseudoslam.io.carmen import Pose, Scanner, readings
from houseexpo.pseudoslam.kernels.mapping.merge import FREE, OBSTACLE, UNKNOWN
from houseexpo.pseudoslam.simulator import ACTIONS, Simulator
from tests.builders.real_slam import CELL_M, DRIFT, LASER_M, SETTINGS, SlamMap, call, convert

EVERY, MARGIN_M, RANGE_M = 8, 5.0, 5.0
SCANNER = Scanner(180.0, 361, RANGE_M)
_FREE, _OCCUPIED = 140, 115
CONFIG = SimulatorConfig(1 / CELL_M, laser=LaserConfig(range_m=RANGE_M))


@dataclass
class Loop:
    """What came of an exploration: coverage after each step, metres, collisions; how often the SLAM drew its map."""

    coverage: list[float] = field(default_factory=list)
    metres: float = 0.0
    collisions: int = 0
    maps: int = 0
    off_m: float = 0.0
    """How far off the SLAM's last pose is."""


def explore_with_slam(plan: FloorPlan, policy: str, folder: Path, most: int, seed: int = 0) -> Loop:
    """Explore with the SLAM in the loop."""
    simulator = Simulator.of(plan, CONFIG)
    state = simulator.start(np.random.default_rng(seed))
    acts = load_policy(policy).factory(Robot(CONFIG), seed)
    poses, done = [simulator.pose(state)], Loop([simulator.coverage(state)])
    known, slam_pose, odometry = _draw(simulator, poses, folder, seed, done)
    at = len(poses) - 1
    for step in range(most):
        *_, now = DRIFT.walk(poses, np.random.default_rng(seed))
        pose = _moved_on(slam_pose, odometry[at], now)
        info: Knowledge = {
            "map": known.copy(),
            "pose_px": _pixels(simulator, pose),
            "collided": state.blocked,
            "steps": step,
            "path_m": done.metres,
        }
        action = acts(None, info)
        if action is None:
            break
        simulator.step(state, ACTIONS[action])
        poses.append(simulator.pose(state))
        done.coverage.append(simulator.coverage(state))
        done.metres = float(state.episode.readings[0].path_length) * CELL_M
        if (step + 1) % EVERY == 0:
            known, slam_pose, odometry = _draw(simulator, poses, folder, seed, done)
            at = len(poses) - 1
    done.collisions = int(state.counts.collisions)
    return done


def explore_without(plan: FloorPlan, policy: str, most: int, seed: int = 0) -> Loop:
    """Explore on PseudoSLAM's own map, which has no errors."""
    from houseexpo.pseudoslam.agents.protocol import knowledge_of

    simulator = Simulator.of(plan, CONFIG)
    state = simulator.start(np.random.default_rng(seed))
    acts, done = load_policy(policy).factory(Robot(CONFIG), seed), Loop([simulator.coverage(state)])
    for _ in range(most):
        action = acts(None, knowledge_of(simulator, state))
        if action is None:
            break
        simulator.step(state, ACTIONS[action])
        done.coverage.append(simulator.coverage(state))
    done.metres = float(state.episode.readings[0].path_length) * CELL_M
    done.collisions = int(state.counts.collisions)
    return done


def _draw(
    simulator: Simulator, poses: list[Pose], folder: Path, seed: int, done: Loop
) -> tuple[npt.NDArray[np.uint8], Pose, list[Pose]]:
    """Let the SLAM draw its map of all readings; return it as a robot's map, where the SLAM is, and the odometry."""
    rng = np.random.default_rng(seed)
    odometry = list(DRIFT.walk(poses, np.random.default_rng(seed)))
    exact = readings(simulator.world, SCANNER, poses, rng, laser_m=LASER_M)
    log = [type(one)(pose, one.ranges_m) for one, pose in zip(exact, odometry, strict=True)]
    if len(log) == 1:  # a log of one reading has no two times to tell apart
        log = log * 2
    convert(log, folder, SCANNER)
    (folder / "slam.ini").write_text(
        SETTINGS.replace("maxDistanceInsertion = 10.0", f"maxDistanceInsertion = {RANGE_M}")
    )
    call(folder, "icp-slam", "slam.ini", "run.rawlog")
    done.maps += 1
    made = folder / "slam"
    picture = cv2.imread(str(next(made.glob("*OccupancyGridMap2D*.png"))), cv2.IMREAD_GRAYSCALE)
    bounds = np.loadtxt(next(made.glob("*_limits.txt")), comments="%").tolist()
    found = np.loadtxt(made / "log_estimated_path.txt", comments="%", ndmin=2)[-1]
    pose = float(found[1]), float(found[2]), float(found[4])
    done.off_m = math.dist(pose[:2], poses[-1][:2])
    return _as_known(simulator, SlamMap(np.asarray(picture, np.uint8), tuple(bounds), 0.0)), pose, odometry


def _as_known(simulator: Simulator, found: SlamMap) -> npt.NDArray[np.uint8]:
    """Return the SLAM's map on a grid that ends ``MARGIN_M`` beyond the house."""
    frame, margin = simulator.world.frame, round(MARGIN_M / CELL_M)
    rows, cols = np.mgrid[-margin : frame.shape[0] + margin, -margin : frame.shape[1] + margin] + 0.5
    points = frame.points_from_pixels(np.stack([cols, rows], axis=-1))
    left_m, right_m, _, high_m = found.bounds_m
    per_metre = found.picture.shape[1] / (right_m - left_m)
    x = ((points[..., 0] - left_m) * per_metre - 0.5).astype(np.float32)
    y = ((high_m - points[..., 1]) * per_metre - 0.5).astype(np.float32)
    shades = cv2.remap(found.picture, x, y, cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT, borderValue=127)
    known = np.full(shades.shape, UNKNOWN, np.uint8)
    known[shades > _FREE] = FREE
    known[shades < _OCCUPIED] = OBSTACLE
    return known


def _pixels(simulator: Simulator, pose: Pose) -> npt.NDArray[np.float64]:
    """Return a pose in metres on the grid of ``_as_known``."""
    x, y = simulator.world.frame.pixels_from_points(pose[:2]).tolist()
    margin = round(MARGIN_M / CELL_M)
    return np.array([x + margin, y + margin, pose[2]])


def _moved_on(slam: Pose, before: Pose, now: Pose) -> Pose:
    """Return where odometry has the robot now, from where the SLAM had it when odometry had it ``before``."""
    right, up, turn = (b - a for a, b in zip(before, now, strict=True))
    off = slam[2] - before[2]
    cos, sin = math.cos(off), math.sin(off)
    return slam[0] + right * cos - up * sin, slam[1] + right * sin + up * cos, slam[2] + turn
