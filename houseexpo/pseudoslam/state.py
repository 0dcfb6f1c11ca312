"""Hold the state of an episode, which a step changes, and give views of episodes in pools of many episodes' arrays.

Some arrays of ``kernels.episode.Episode`` are its own fields, others are in tuples of arrays that are its fields. There
is no deeper nesting. In a pool, each array has an additional first axis.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from typing import Any

import numpy as np
import numpy.typing as npt

from houseexpo.pseudoslam.config.obstacles import Obstacle
from houseexpo.pseudoslam.kernels.body_tracks import BodyTracks, Tracks
from houseexpo.pseudoslam.kernels.bound_pool import PoolBinding
from houseexpo.pseudoslam.kernels.episode import COUNTS, NO_CELL, POSE, READINGS, Blocks, Episode
from houseexpo.pseudoslam.kernels.planning.fields import FlowField
from houseexpo.pseudoslam.kernels.planning.goal_paths import GoalPaths
from houseexpo.pseudoslam.kernels.planning.planner_types import no_planner_memory
from houseexpo.pseudoslam.kernels.types import Floats, Grid

Array = npt.NDArray[Any]

RASTERS, MAP, SHOWN = 3, Episode._fields.index("known"), Episode._fields.index("shown")
"""The number of arrays of the house's size, which are flat in a pool; and the indices of the map and of the views."""


def flatten_episode(episode: Episode) -> list[Array]:
    """Return the arrays of an episode as a flat list."""
    found: list[Array] = []
    for part in episode:
        if isinstance(part, np.ndarray):
            found.append(part)
        else:
            found.extend(part)
    return found


def unflatten_episode(episode: Episode, arrays: Iterable[Array]) -> Episode:
    """Return an episode with the same structure but other arrays."""
    rest = iter(arrays)
    parts: Iterable[Any] = (
        next(rest) if isinstance(part, np.ndarray) else type(part)(*islice(rest, len(part))) for part in episode
    )
    return Episode(*parts)


def pool_of_one(episode: Episode) -> Episode:
    """Return a pool with one episode, as views of its arrays."""
    return _each(episode, lambda raster: raster.reshape(1, -1), lambda array: array[None])


def view_episode(pool: Episode, i: int, shape: tuple[int, int]) -> Episode:
    """Return episode ``i`` of a pool as views of the pool's arrays; ``shape`` is (rows, cols) of the house."""
    cells = shape[0] * shape[1]
    return _each(pool, lambda raster: raster[i, :cells].reshape(shape), lambda array: array[i])


def _each(episode: Episode, of_raster: Callable[[Array], Array], of_other: Callable[[Array], Array]) -> Episode:
    """Return an episode with the functions applied to each array."""
    parts: tuple[Any, ...] = episode
    rasters: Iterable[Any] = map(of_raster, parts[:RASTERS])
    others = (
        of_other(part) if isinstance(part, np.ndarray) else type(part)(*map(of_other, part)) for part in parts[RASTERS:]
    )
    return Episode(*rasters, *others)


@dataclass(eq=False)
class State:
    """The state of an episode. ``Simulator.step`` changes its arrays in place; use ``copy`` to keep one.

    Parameters
    ----------
    episode
        Everything that changes or is specific to the episode, as arrays (``kernels.episode.Episode``). Episodes with
        equal bytes are equal.
    observable_cells
        Number of cells that coverage counts.
    obstacles
        The obstacles that were placed at the start, both configured and random ones.
    goal_m
        (x, y) in the plan's metres, or None.
    shortest_path_m
        Length of the shortest path from the start to the goal, metres; 0 if there is none.
    goal_number
        The index of the goal's kind of room or furniture in ``config.goal.names``; -1 if it is a place.
    """

    episode: Episode
    observable_cells: int
    obstacles: tuple[Obstacle, ...] = ()
    goal_m: tuple[float, float] | None = None
    shortest_path_m: float = 0.0
    goal_number: int = -1

    @cached_property
    def pool(self) -> Episode:
        """A pool with this one episode, as views."""
        return pool_of_one(self.episode)

    @cached_property
    def sizes(self) -> npt.NDArray[np.int64]:
        """Rows and columns of the rasters (1, 2), in the form that kernels take for the episodes of ``pool``."""
        return np.array([self.episode.occupied.shape])

    @cached_property
    def binding(self) -> PoolBinding:
        """The pool in the form in which the last step took it."""
        return PoolBinding()

    @property
    def occupied(self) -> npt.NDArray[np.uint8]:
        """The occupied cells (rows, cols): bit 1 for static obstacles, bit 2 for moving ones."""
        return self.episode.occupied

    @property
    def known(self) -> npt.NDArray[np.uint8]:
        """The robot's map (rows, cols): 0 unknown, 127 free, 255 obstacle."""
        return self.episode.known

    @property
    def view(self) -> npt.NDArray[np.uint8]:
        """The map around the robot (side, side), with its heading up."""
        return self.episode.shown

    @property
    def poses_px(self) -> npt.NDArray[np.float64]:
        """``pose_px`` and ``believed_px`` side by side (6,)."""
        poses: npt.NDArray[np.float64] = self.episode.pose.view(np.float64)
        return poses

    @property
    def pose_px(self) -> npt.NDArray[np.float64]:
        """The pose (3,): x across and y down in cells of the world's grid, heading in radians, counter-clockwise."""
        return self.poses_px[:3]

    @property
    def believed_px(self) -> npt.NDArray[np.float64]:
        """The pose that odometry reports (3,), from which the map is drawn."""
        return self.poses_px[3:]

    def note_new_map(self) -> None:
        """Have the overview and the pictures redrawn, after something other than a scan has changed the map."""
        rows, cols = self.known.shape
        self.episode.changed[:] = 0, rows, 0, cols
        self.counts.low, self.counts.high = 0, self.known.size

    @property
    def counts(self) -> Any:
        """The counters, a record ``kernels.episode.COUNTS``."""
        return self.episode.counts[0]

    @property
    def blocked(self) -> bool:
        """Whether something was in the way of the last step."""
        return bool(self.counts.blocked)

    def __getstate__(self) -> dict[str, object]:
        """Pickle and copy without ``pool``, which is views, and ``binding``: the copy makes its own."""
        return {name: value for name, value in self.__dict__.items() if name not in {"pool", "binding"}}

    def copy(self) -> State:
        """Return a copy that shares no memory with this state."""
        return State(
            unflatten_episode(self.episode, [leaf.copy() for leaf in flatten_episode(self.episode)]),
            self.observable_cells,
            self.obstacles,
            self.goal_m,
            self.shortest_path_m,
            self.goal_number,
        )


def new_episode(
    rasters: tuple[Grid, Grid, Grid],
    shown: tuple[int, int, int],
    pose: Floats,
    moving: tuple[BodyTracks, Tracks, FlowField, GoalPaths],
    *,
    key: int,
    best_px: float,
    blocks_px: tuple[int, int, int] = (0, 0, 0),
) -> Episode:
    """Return an episode that has not begun and plans nothing.

    Parameters
    ----------
    rasters
        The occupied, the observable and the known cells.
    shown
        The side of the view and of the overview, cells, and the number of beams; 0 if not observed.
    pose
        (3,), the robot's pose, which is also its believed pose.
    moving
        Moving bodies and their tracks, the paths of people, and the paths to the goal.
    key
        The key of the episode's noise.
    best_px
        Length of the shortest path to the goal, pixels.
    blocks_px
        The side of the blocks of each picture, cells; 0 for none.
    """
    side, cells, beams = shown
    rows, cols = rasters[0].shape
    blocks = (np.zeros(math.ceil(rows / px) * math.ceil(cols / px) if px else 0, np.uint8) for px in blocks_px)
    changed = np.tile(np.array([NO_CELL, 0]), (2, 2)) if cells or any(blocks_px) else np.zeros((0, 4), np.int64)
    bodies, tracks, flow, goal_paths = moving
    return Episode(
        *rasters, np.zeros((side, side), np.uint8), np.zeros((cells, cells), np.uint8), np.zeros(beams),
        np.zeros(0, np.uint8),
        np.array([(*pose, *pose)], POSE), _row(COUNTS, steps=-1, key=key, low=NO_CELL),
        _row(READINGS, to_goal=best_px, start_x=pose[0], start_y=pose[1]),
        bodies, tracks, flow, goal_paths, no_planner_memory(), changed, Blocks(*blocks),
    )  # fmt: skip


def _row(dtype: np.dtype[Any], **values: float) -> Array:
    """Return one record (1,) with these values, and 0 for the others."""
    row = np.zeros(1, dtype)
    for name, value in values.items():
        row[name] = value
    return row
