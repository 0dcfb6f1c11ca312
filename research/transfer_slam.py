"""Explorers that decide on the map that a real SLAM has drawn so far: ``icp-slam`` of Debian in the loop.

Protocol. The robot moves in the simulator, exactly as it is told. What it reads goes into a log: ranges with 1 cm of
noise, odometry that drifts as ``real_slam.DRIFT`` says. At the start and after every ``EVERY`` steps ``icp-slam`` draws
its map of the log so far. In between the robot goes by odometry from the last pose that the SLAM found, and adds its
scans to the last map where odometry has it (``add_scan``), as a robot's local map does. The explorer is shown that map
only, on a grid that ends ``MARGIN_M`` beyond the house. Coverage is what the sensor has seen in truth.
"""

from __future__ import annotations

import math
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from houseexpo.floorplan import FloorPlan
from houseexpo.pseudoslam.agents.protocol import Knowledge
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE, UNKNOWN
from houseexpo.pseudoslam.simulator import ACTIONS, Simulator
from houseexpo.pseudoslam.worlds.world import World
from research.carmen_logs import Pose, Reading, Scanner, simulate_readings
from research.transfer import CONFIG, RANGE_M, Exploration, Explorer, add_scan
from tests.builders.real_slam import CELL_M, DRIFT, LASER_M, SETTINGS, call, convert

EVERY, MARGIN_M = 20, 5.0
SCANNER = Scanner(180.0, 361, RANGE_M)
_FREE, _OCCUPIED = 140, 115
"""Shades of the SLAM's picture above and below which a cell is taken for one or the other."""


class SlamMap:
    """A robot's log, the map that the SLAM draws of it, and where the robot believes to be.

    ``known`` is that map as explorers are shown it: 0 unknown, 127 free, 255 obstacle.
    """

    def __init__(self, world: World, folder: Path, seed: int) -> None:
        self.known = np.zeros((0, 0), np.uint8)
        self._world, self._folder, self._seed = world, folder, seed
        self._noise = np.random.default_rng(seed)
        self._poses: list[Pose] = []
        self._ranges: list[npt.NDArray[np.float64]] = []
        self._found, self._before = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)

    def look(self, pose: Pose) -> None:
        """Read the laser from a place, into the log."""
        (reading,) = simulate_readings(self._world, SCANNER, [pose], self._noise, laser_m=LASER_M)
        self._poses.append(pose)
        self._ranges.append(reading.ranges_m)

    def draw(self) -> None:
        """Let the SLAM draw its map of the log so far, and find the robot's place."""
        log = [Reading(pose, ranges) for pose, ranges in zip(self._odometry(), self._ranges, strict=True)]
        convert(log if len(log) > 1 else log * 2, self._folder, SCANNER)  # two at least tell the times apart
        settings = SETTINGS.replace("maxDistanceInsertion = 10.0", f"maxDistanceInsertion = {RANGE_M}")
        (self._folder / "slam.ini").write_text(settings)
        call(self._folder, "icp-slam", "slam.ini", "run.rawlog")
        made = self._folder / "slam"
        picture = cv2.imread(str(next(made.glob("*OccupancyGridMap2D*.png"))), cv2.IMREAD_GRAYSCALE)
        bounds = np.loadtxt(next(made.glob("*_limits.txt")), comments="%").tolist()
        _, x, y, heading = np.loadtxt(made / "log_estimated_path.txt", comments="%", ndmin=2)[-1, :4].tolist()
        self.known = self._on_our_grid(np.asarray(picture, np.uint8), bounds)
        self._found, self._before = (x, y, heading), self._odometry()[-1]

    def add_last_scan(self) -> None:
        """Draw the last scan on the map, where odometry has the robot."""
        add_scan(self.known, self.pose_px(), self._ranges[-1])

    def pose(self) -> Pose:
        """Where the robot believes to be: odometry since the SLAM found its place; metres, radians."""
        right, up, turn = (b - a for a, b in zip(self._before, self._odometry()[-1], strict=True))
        off = self._found[2] - self._before[2]
        cos, sin = math.cos(off), math.sin(off)
        x, y, heading = self._found
        return x + right * cos - up * sin, y + right * sin + up * cos, heading + turn

    def pose_px(self) -> npt.NDArray[np.float64]:
        """Where the robot believes to be on ``known``."""
        x, y, heading = self.pose()
        margin = round(MARGIN_M / CELL_M)
        return np.array([*(self._world.frame.pixels_from_points([x, y]) + margin).tolist(), heading])

    def _odometry(self) -> list[Pose]:
        return list(DRIFT.walk(self._poses, np.random.default_rng(self._seed)))

    def _on_our_grid(self, picture: npt.NDArray[np.uint8], bounds_m: list[float]) -> npt.NDArray[np.uint8]:
        frame, margin = self._world.frame, round(MARGIN_M / CELL_M)
        rows, cols = np.mgrid[-margin : frame.shape[0] + margin, -margin : frame.shape[1] + margin] + 0.5
        points = frame.points_from_pixels(np.stack([cols, rows], axis=-1))
        left_m, right_m, _, high_m = bounds_m
        per_metre = picture.shape[1] / (right_m - left_m)
        x = ((points[..., 0] - left_m) * per_metre - 0.5).astype(np.float32)
        y = ((high_m - points[..., 1]) * per_metre - 0.5).astype(np.float32)
        shades = cv2.remap(picture, x, y, cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT, borderValue=127)
        known = np.full(shades.shape, UNKNOWN, np.uint8)
        known[shades > _FREE] = FREE
        known[shades < _OCCUPIED] = OBSTACLE
        return known


def explore_with_slam(plan: FloorPlan, policy: str, folder: Path, most: int, seed: int = 0) -> Exploration:
    """Explore with the SLAM in the loop, for at most so many steps."""
    simulator = Simulator.of(plan, CONFIG)
    state = simulator.start(np.random.default_rng(seed))
    acts, done = Explorer(policy, seed), Exploration([simulator.coverage(state)])
    slam = SlamMap(simulator.world, folder, seed)
    slam.look(simulator.pose(state))
    slam.draw()
    for step in range(most):
        info: Knowledge = {
            "map": slam.known.copy(),
            "pose_px": slam.pose_px(),
            "collided": state.blocked,
            "steps": step,
            "path_m": done.metres,
        }
        action = acts(info)
        if action is None:
            break
        simulator.step(state, ACTIONS[action])
        done.coverage.append(simulator.coverage(state))
        done.metres = float(state.episode.readings[0].path_length) * CELL_M
        slam.look(simulator.pose(state))
        if (step + 1) % EVERY == 0:
            slam.draw()
        else:
            slam.add_last_scan()
    done.collisions = int(state.counts.collisions)
    done.off_m = math.dist(slam.pose()[:2], simulator.pose(state)[:2])
    return done
