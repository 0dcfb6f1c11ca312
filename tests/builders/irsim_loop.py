"""Explorers in another simulator: IR-SIM, in the world that we export, with its lidar and its differential drive.

Protocol. IR-SIM moves the robot and casts its lidar's 180 beams, half round, 5 m. A beam makes the cells on its way
free and the cell that it ends in an obstacle, unless it ends in the open; the robot's place is the one that IR-SIM
says. A step of 0.3 m is three of 0.1 s at 1 m/s, a turn of 10 degrees two of 0.1 s. Coverage is that of our own world:
the share of the cells that can be seen which the map shows free.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import numpy.typing as npt

from houseexpo.export import irsim as exported
from houseexpo.floorplan import FloorPlan
from houseexpo.pseudoslam.agents.loading import load_policy
from houseexpo.pseudoslam.agents.protocol import Knowledge, Robot
from houseexpo.pseudoslam.kernels.mapping.merge import FREE, OBSTACLE, UNKNOWN
from houseexpo.pseudoslam.simulator import Simulator
from tests.builders.slam_loop import CONFIG, Loop

_BEAMS, _RANGE_M = 180, 5.0
_MOTIONS = {0: (3, (1.0, 0.0)), 1: (2, (0.0, math.radians(50.0))), 2: (2, (0.0, -math.radians(50.0)))}
"""Times, and metres and radians a second, of each action."""
_SHORT_M = 0.02


def explore_in_irsim(plan: FloorPlan, policy: str, folder: Path, most: int) -> Loop:
    """Explore from where the exported world puts the robot."""
    import irsim

    file = folder / "world.yaml"
    file.write_bytes(exported(plan)[f"{plan.id}.irsim.yaml"])
    other = irsim.make(str(file), headless=True, log_level="ERROR")
    ours = Simulator.of(plan, CONFIG)
    frame, observable = ours.world.frame, ours.world.observable != 0
    known = np.zeros(frame.shape, np.uint8)
    acts, done = load_policy(policy).factory(Robot(CONFIG), 0), Loop()
    collided = False
    for step in range(most + 1):
        x, y, heading = other.robot.state[:3, 0].tolist()
        _draw(known, frame.pixels_from_points([x, y]).tolist(), heading, other.get_lidar_scan()["ranges"])
        done.coverage.append(float(np.count_nonzero(observable & (known == FREE)) / ours.world.observable_cells))
        info: Knowledge = {
            "map": known.copy(),
            "pose_px": np.array([*frame.pixels_from_points([x, y]).tolist(), heading]),
            "collided": collided,
            "steps": step,
            "path_m": done.metres,
        }
        action = acts(None, info) if step < most else None
        if action is None:
            break
        times, speeds = _MOTIONS[action]
        for _ in range(times):
            other.step(np.array(speeds)[:, None])
        collided = bool(other.robot.collision)
        done.collisions += collided
        done.metres += math.dist((x, y), other.robot.state[:2, 0].tolist())
    other.end(0)
    return done


def _draw(known: npt.NDArray[np.uint8], place: list[float], heading: float, ranges: npt.ArrayLike) -> None:
    """Draw a scan on the map: free cells first, so that no beam that passes by takes a wall away."""
    ppm = CONFIG.pixels_per_metre
    metres = np.asarray(ranges, np.float64)
    angles = heading + np.linspace(-math.pi / 2, math.pi / 2, _BEAMS)
    samples = np.arange(0.0, _RANGE_M * ppm, 0.5)
    passed = samples[None] < np.maximum(metres * ppm - 0.5, 0.0)[:, None]
    rows, cols = (place[1] - samples * np.sin(angles)[:, None]), (place[0] + samples * np.cos(angles)[:, None])
    _set(known, rows[passed], cols[passed], FREE, only=UNKNOWN)
    hit = metres < _RANGE_M - _SHORT_M
    far = metres[hit] * ppm + 0.1
    _set(known, place[1] - far * np.sin(angles[hit]), place[0] + far * np.cos(angles[hit]), OBSTACLE, only=None)


def _set(
    known: npt.NDArray[np.uint8], rows: npt.NDArray[np.float64], cols: npt.NDArray[np.float64], value: int,
    only: int | None,
) -> None:  # fmt: skip
    inside = (rows >= 0) & (rows < known.shape[0]) & (cols >= 0) & (cols < known.shape[1])
    at = np.floor(rows[inside]).astype(int), np.floor(cols[inside]).astype(int)
    if only is not None:
        wanted = known[at] == only
        at = at[0][wanted], at[1][wanted]
    known[at] = value
