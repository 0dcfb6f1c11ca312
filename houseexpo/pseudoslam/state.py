"""What changes in a step."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from houseexpo.pseudoslam.config.shapes import Obstacle
from houseexpo.pseudoslam.kernels.episode import COUNTS, POSE, READINGS, Episode
from houseexpo.pseudoslam.kernels.motion.bodies import Bodies, Tracks
from houseexpo.pseudoslam.kernels.planning.distance_field import Field
from houseexpo.pseudoslam.kernels.planning.flow import Flow
from houseexpo.pseudoslam.kernels.planning.plan import new_graph, no_plans
from houseexpo.pseudoslam.kernels.types import Floats, Grid
from houseexpo.pseudoslam.pools import flatten, pool_of_one, unflatten
from houseexpo.pseudoslam.renamed import renamed


@dataclass(eq=False)
class State:
    """An episode so far; ``Simulator.step`` changes its arrays in place, ``copy`` keeps one.

    Parameters
    ----------
    episode
        All that changes, as arrays (``kernels.episode.Episode``), and what is the episode's own: equal bytes there are
        equal episodes.
    observable_cells
        How many cells coverage counts.
    obstacles
        What was set down at the start, those told and those drawn.
    goal_m
        (x, y) in the plan's metres, or None.
    shortest_path_m
        The way from the start to the goal, metres; 0 where there is none.
    """

    episode: Episode
    observable_cells: int
    obstacles: tuple[Obstacle, ...] = ()
    goal_m: tuple[float, float] | None = None
    shortest_path_m: float = 0.0

    @cached_property
    def pool(self) -> Episode:
        """A pool of this one episode, views."""
        return pool_of_one(self.episode)

    @cached_property
    def sizes(self) -> npt.NDArray[np.int64]:
        """(1, 2): rows and columns of the rasters, as the kernels take them for the episodes of ``pool``."""
        return np.array([self.episode.occupied.shape])

    @property
    def occupied(self) -> npt.NDArray[np.uint8]:
        """(rows, cols): bit 1 where something stands, bit 2 where something moves."""
        return self.episode.occupied

    @property
    def known(self) -> npt.NDArray[np.uint8]:
        """(rows, cols) map: 0 unknown, 127 free, 255 obstacle."""
        return self.episode.known

    @property
    def view(self) -> npt.NDArray[np.uint8]:
        """(side, side): the map round the robot, heading up."""
        return self.episode.shown

    @property
    def poses_px(self) -> npt.NDArray[np.float64]:
        """(6,): ``pose_px`` and ``believed_px``."""
        poses: npt.NDArray[np.float64] = self.episode.pose.view(np.float64)
        return poses

    @property
    def pose_px(self) -> npt.NDArray[np.float64]:
        """(3,): x across, y down in cells of the world's grid, heading in radians, counter-clockwise from x."""
        return self.poses_px[:3]

    @property
    def believed_px(self) -> npt.NDArray[np.float64]:
        """(3,): the pose that odometry reports; the map is drawn from there."""
        return self.poses_px[3:]

    @property
    def counts(self) -> Any:
        """What is counted, by name and by number: the row ``kernels.episode.COUNTS``."""
        return self.episode.counts[0]

    @property
    def blocked(self) -> bool:
        """Whether something was in the way of the last step."""
        return bool(self.counts.blocked)

    solid = renamed("solid", "occupied")
    countable_cells = renamed("countable_cells", "observable_cells")
    best_way_m = renamed("best_way_m", "shortest_path_m")

    def __getstate__(self) -> dict[str, object]:
        """Pickle and copy without ``pool``, which is views: the copy makes its own."""
        return {name: value for name, value in self.__dict__.items() if name != "pool"}

    def copy(self) -> State:
        """Return a state that shares nothing with this one."""
        return State(
            unflatten(self.episode, [leaf.copy() for leaf in flatten(self.episode)]),
            self.observable_cells,
            self.obstacles,
            self.goal_m,
            self.shortest_path_m,
        )


def new_episode(
    rasters: tuple[Grid, Grid, Grid],
    shown: tuple[int, int, int],
    pose: Floats,
    moving: tuple[Bodies, Tracks, Flow, Field],
    *,
    key: int,
    best_px: float,
) -> Episode:
    """Return an episode that has not begun and plans nothing.

    Parameters
    ----------
    rasters
        What is occupied, observable and known.
    shown
        Cells along the view's sides and along the overview's, and beams of the ranges; 0 for what nobody asks for.
    pose
        (3,) where the robot stands, and believes to stand.
    moving
        What moves, its ways, those of people, and the ways to the goal.
    key
        Of the episode's noise.
    best_px
        The shortest way to the goal, pixels.
    """
    side, cells, beams = shown
    bodies, tracks, flow, field = moving
    return Episode(
        *rasters, np.zeros((side, side), np.uint8), np.zeros((cells, cells), np.uint8), np.zeros(beams),
        np.array([(*pose, *pose)], POSE), np.array([(-1, 0, 0, 0, 0, 0, key)], COUNTS),
        np.array([(0.0, 0.0, best_px, pose[0], pose[1])], READINGS),
        bodies, tracks, flow, field, no_plans(), new_graph(0, 0),
    )  # fmt: skip
