"""Small worlds in which things move, and what must hold of them at any time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import GridFrame
from houseexpo.pseudoslam.config.obstacles import PeopleConfig, Trajectory
from houseexpo.pseudoslam.kernels.collision import (
    MOVING,
    STATIC,
    Bodies,
    Disc,
    Tracks,
    disc_is_free,
    gap_to,
    placed_people,
)
from houseexpo.pseudoslam.kernels.people import Walk, advance, stamp_bodies
from houseexpo.pseudoslam.kernels.planning.fields import Flow, no_flow
from houseexpo.pseudoslam.worlds.moving import make_flow, make_tracks, new_bodies, start_people, walk_of

NOBODY = Disc(-1e6, -1e6, 1.0)


@dataclass
class Scene:
    """A world with bodies in it; ``occupied`` has their bits, ``static`` has not."""

    static: np.ndarray
    occupied: np.ndarray
    frame: GridFrame
    bodies: Bodies
    tracks: Tracks
    flow: Flow
    walk: Walk
    key: int

    def step(self, robot: Disc = NOBODY, seconds: float = 0.5) -> None:
        """Let everything move."""
        advance(self.occupied, self.bodies, self.tracks, self.flow, self.walk, self.key, robot, seconds)

    @property
    def places(self) -> np.ndarray:
        """(P, 2) where people are, pixels."""
        return np.stack([self.bodies.people["x"], self.bodies.people["y"]], axis=1)

    def check(self, robot: Disc) -> None:
        """Nothing overlaps, and the grid shows the bodies and nothing else."""
        radius = self.walk.radius_px
        for p, (x, y) in enumerate(self.places.tolist()):
            assert disc_is_free(self.static, x, y, radius)
            assert math.hypot(x - robot.x, y - robot.y) >= radius + robot.radius - 1e-9
            for other_x, other_y in self.places[:p].tolist():
                assert math.hypot(x - other_x, y - other_y) >= 2 * radius
            for k, clock in enumerate(self.bodies.clocks.tolist()):
                assert gap_to(self.tracks, k, clock, x, y) >= radius - 1e-9
        assert disc_is_free(self.occupied, *robot) or not on_grid(self.occupied, robot)
        np.testing.assert_array_equal(self.occupied & STATIC, self.static)
        drawn = self.static.copy()
        stamp_bodies(drawn, self.bodies, self.tracks, self.walk)
        np.testing.assert_array_equal(self.occupied, drawn)


def on_grid(grid: np.ndarray, disc: Disc) -> bool:
    """Whether a disc's centre lies on a grid."""
    return 0 <= disc.x < grid.shape[1] and 0 <= disc.y < grid.shape[0]


def room(rows: int, cols: int) -> np.ndarray:
    """Free cells within walls of one."""
    occupied = np.ones((rows, cols), np.uint8)
    occupied[1:-1, 1:-1] = 0
    return occupied


def frame_of(occupied: np.ndarray, ppm: float) -> GridFrame:
    """A frame whose lower left corner is (0, 0), row 0 at the highest y."""
    return GridFrame((0.0, 0.0), ppm, occupied.shape, y_up=True)


def plan_of(occupied: np.ndarray, ppm: float, room_num: int = 4) -> FloorPlan:
    """The bounding box of a grid as a plan."""
    height, width = occupied.shape[0] / ppm, occupied.shape[1] / ppm
    return FloorPlan("box", [(0, 0), (0, height), (width, height), (width, 0)], room_num, {})


def scene(
    occupied: np.ndarray,
    people: PeopleConfig | None = None,
    trajectories: Sequence[Trajectory] = (),
    *,
    ppm: float = 10.0,
    robot: Disc = NOBODY,
    key: int = 1,
    plan: FloorPlan | None = None,
) -> Scene:
    """Put things into a grid of what stands still."""
    people = people or PeopleConfig()
    frame, plan = frame_of(occupied, ppm), plan or plan_of(occupied, ppm)
    walk, tracks = walk_of(people, ppm), make_tracks(trajectories, occupied, frame, "box")
    flow = make_flow(occupied, frame, people.radius_m, plan) if people.number else no_flow()
    bodies = new_bodies(len(trajectories), people.number)
    start_people(people, occupied, bodies, tracks, flow, walk, key, robot, "box")
    bodies = Bodies(bodies.clocks, placed_people(bodies.people))  # a small room takes fewer than it is asked to
    drawn = occupied.copy()
    stamp_bodies(drawn, bodies, tracks, walk)
    assert (drawn & MOVING).any() == (len(bodies.people) + len(trajectories) > 0)
    return Scene(occupied, drawn, frame, bodies, tracks, flow, walk, key)
