"""Explorers in another simulator: IR-SIM, in the world that we export, with its lidar and its differential drive.

Protocol. IR-SIM moves the robot and casts its lidar's 180 beams, half round, 5 m, which ``add_scan`` draws on the map;
the robot's place is the one that IR-SIM says. A step of 0.3 m is three of 0.1 s at 1 m/s, a turn of 10 degrees two of
0.1 s. A robot that touches a wall moves no more there, so that this ends the run. Coverage is that of our own world:
the share of the cells that can be seen which the map shows free.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from houseexpo.exports import irsim as exported
from houseexpo.floorplan import FloorPlan
from houseexpo.pseudoslam.agents.protocol import Knowledge
from houseexpo.pseudoslam.kernels.mapping import FREE
from houseexpo.pseudoslam.simulator import Simulator
from research.transfer import CONFIG, Exploration, Explorer, add_scan

_MOTIONS = {0: (3, (1.0, 0.0)), 1: (2, (0.0, math.radians(50.0))), 2: (2, (0.0, -math.radians(50.0)))}
"""Times, and metres and radians a second, of each action."""


def explore_in_irsim(plan: FloorPlan, policy: str, folder: Path, most: int) -> Exploration:
    """Explore from where the exported world puts the robot."""
    import irsim

    file = folder / "world.yaml"
    file.write_bytes(exported(plan)[f"{plan.id}.irsim.yaml"])
    other = irsim.make(str(file), headless=True, log_level="ERROR")
    ours = Simulator.of(plan, CONFIG)
    frame, observable = ours.world.frame, ours.world.observable != 0
    known = np.zeros(frame.shape, np.uint8)
    acts, done = Explorer(policy, 0), Exploration()
    for step in range(most + 1):
        x, y, heading = other.robot.state[:3, 0].tolist()
        place = np.array([*frame.pixels_from_points([x, y]).tolist(), heading])
        add_scan(known, place, other.get_lidar_scan()["ranges"])
        done.coverage.append(float(np.count_nonzero(observable & (known == FREE)) / ours.world.observable_cells))
        info: Knowledge = {
            "map": known.copy(),
            "pose_px": place,
            "collided": False,
            "steps": step,
            "path_m": done.metres,
        }
        action = acts(info) if step < most else None
        if action is None:
            break
        times, speeds = _MOTIONS[action]
        for _ in range(times):
            other.step(np.array(speeds)[:, None])
        done.metres += math.dist((x, y), other.robot.state[:2, 0].tolist())
        if other.robot.collision:
            done.collisions = 1
            break
    other.end(0)
    return done
