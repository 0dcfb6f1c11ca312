"""Convert people and trajectories to the kernels' arrays: paths to rooms, walking, starts, and bodies on tracks."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import GridFrame
from houseexpo.grids.raster import distance_field, room_ids
from houseexpo.pseudoslam.config.moving_obstacles import PeopleConfig, Trajectory
from houseexpo.pseudoslam.config.obstacles import Circle, Ellipse, Shape
from houseexpo.pseudoslam.kernels.body_tracks import (
    SHAPE,
    BodyTracks,
    Tracks,
    find_track_collision,
    mark_track_cells,
    track_pose_at,
)
from houseexpo.pseudoslam.kernels.collision import HALF_DIAGONAL, MOVING, PERSON, Disc
from houseexpo.pseudoslam.kernels.people import FEELER, WalkParams, place_people
from houseexpo.pseudoslam.kernels.planning import fields as kernels
from houseexpo.pseudoslam.kernels.planning.fields import FAR, FLOW_SIZES, FlowField
from houseexpo.pseudoslam.kernels.tolerances import (
    FEELER_RINGS_M,
    FEELERS,
    HORIZON_S,
    PATH_BLOCK_M,
    WALL_PUSH_M,
    WALL_PUSH_M_S2,
)
from houseexpo.pseudoslam.kernels.types import as_read_only
from houseexpo.pseudoslam.worlds.maps import House
from houseexpo.pseudoslam.worlds.world import traversable_cells

_MIN_GOALS, _MAX_GOALS = 4, 24  # if a plan has no rooms to go to

Ints = npt.NDArray[np.int32]
Floats = npt.NDArray[np.float64]
Grid = npt.NDArray[np.uint8]


def make_flow_field(occupied: Grid, frame: GridFrame, radius_m: float, plan: House) -> FlowField:
    """Return the paths to all rooms of a plan for a disc of a person's radius.

    The goal in a room is its widest place. If the plan records fewer than two rooms that can be reached, goals are
    places far from each other; there are ``room_num`` of them, but at least 4 and at most 24.

    Raises
    ------
    ConfigError
        A person of this radius does not fit anywhere.
    """
    traversable = traversable_cells(occupied, radius_m * frame.pixels_per_metre)
    if not traversable.any():
        raise ConfigError(
            f"people.radius_m: people of radius {radius_m:g} m fit nowhere in plan {plan.id!r} at "
            f"{frame.pixels_per_metre:g} px/m; make them smaller, or set people.number to 0"
        )
    side = max(round(PATH_BLOCK_M * frame.pixels_per_metre), 1)
    ways = _Ways(traversable, side)
    cells: list[tuple[int, int]] = []
    if isinstance(plan, FloorPlan) and len(plan.rooms) > 1:
        cells = _room_cells(plan, frame, occupied, traversable)
    goals = ways.reachable_blocks(cells)
    if len(goals) < 2:
        rooms = plan.room_num if isinstance(plan, FloorPlan) else 0
        goals = ways.spread(min(max(rooms, _MIN_GOALS), _MAX_GOALS))
    toward = np.stack([ways.toward(goal) for goal in goals])
    sizes = np.array([(*ways.links.shape, side, len(goals))], FLOW_SIZES)
    return FlowField(sizes, toward.ravel(), ways.spots.reshape(-1, 2), np.array(goals, np.int32))


def _room_cells(plan: FloorPlan, frame: GridFrame, occupied: Grid, traversable: Grid) -> list[tuple[int, int]]:
    """Return the cell (row, col) with the largest clearance in each room."""
    ids = room_ids(plan, frame)
    room_m = np.where(traversable != 0, distance_field(occupied == 0, 1.0), -1.0)
    found = []
    for room in plan.rooms:
        inside = np.where(ids == room.id, room_m, -1.0)
        cell = int(inside.argmax())
        if inside.flat[cell] >= 0:
            found.append(divmod(cell, traversable.shape[1]))
    return found


class _Ways:
    """Blocks of cells, their links, and their largest connected component."""

    def __init__(self, traversable: Grid, side: int) -> None:
        shape = math.ceil(traversable.shape[0] / side), math.ceil(traversable.shape[1] / side)
        self.side = side
        self.spots: Ints = np.empty((*shape, 2), np.int32)
        self.links: Grid = np.empty(shape, np.uint8)
        self._queue, self._queued = np.empty(self.links.size, np.int32), np.empty(self.links.size, np.uint8)
        kernels.find_block_spots(traversable, side, self.spots)
        kernels.find_block_links(traversable, self.spots, self.links)
        self.joined = self._biggest()

    def distances(self, goal: int) -> Ints:
        """Return the distance from each block to a goal."""
        found = np.empty(self.links.shape, np.int32)
        kernels.find_block_distances(self.links, goal, found, self._queue, self._queued)
        return found

    def toward(self, goal: int) -> Grid:
        """Return the next block on the path from each block to a goal."""
        found = np.empty(self.links.shape, np.uint8)
        kernels.find_next_blocks(self.links, self.distances(goal), found)
        return found

    def reachable_blocks(self, cells: list[tuple[int, int]]) -> list[int]:
        """Return the blocks of cells that can be reached, each once."""
        blocks = [row // self.side * self.links.shape[1] + col // self.side for row, col in cells]
        return [block for block in dict.fromkeys(blocks) if self.joined.flat[block]]

    def spread(self, number: int) -> list[int]:
        """Return blocks, each as far as possible from the earlier ones; these are mostly at the ends of rooms."""
        roomy = self.joined & (np.bitwise_count(self.links) == 8)
        candidates = roomy if roomy.any() else self.joined
        nearest = self.distances(int(candidates.argmax()))
        goals: list[int] = []
        for _ in range(min(number, int(candidates.sum()))):
            goals.append(int(np.where(candidates, nearest, -1).argmax()))
            reach = self.distances(goals[-1])
            nearest = reach if len(goals) == 1 else np.minimum(nearest, reach)
        return goals

    def _biggest(self) -> npt.NDArray[np.bool_]:
        left = self.spots[..., 0] >= 0
        best = np.zeros_like(left)
        while left.sum() > best.sum():
            part = self.distances(int(left.argmax())) < FAR
            best = part if part.sum() > best.sum() else best
            left &= ~part
        return best


def make_walk_params(config: PeopleConfig, pixels_per_metre: float) -> WalkParams:
    """Return the parameters of people's walking on a grid."""
    radius_px = max(config.radius_m * pixels_per_metre, HALF_DIAGONAL)
    feelers = [
        _feeler(2 * math.pi * k / FEELERS, ring_m, radius_px, pixels_per_metre)
        for k in range(FEELERS)
        for ring_m in FEELER_RINGS_M
    ]
    return WalkParams(
        float(pixels_per_metre),
        radius_px,
        float(config.relaxation_s),
        2 * radius_px,
        np.array(feelers, FEELER),
        radius_px + max(FEELER_RINGS_M) * pixels_per_metre + 1e-6,
        HORIZON_S if config.model == "orca" else 0.0,
    )


def _feeler(angle: float, ring_m: float, radius_px: float, ppm: float) -> tuple[float, float, float, float]:
    """Return the point of a feeler and its push away, scaled so that walls in half of all directions give all of it."""
    right, down = math.cos(angle), math.sin(angle)
    reach, push = radius_px + ring_m * ppm, WALL_PUSH_M_S2 * ppm * math.exp(-ring_m / WALL_PUSH_M) * math.pi / FEELERS
    return right * reach, down * reach, -right * push, -down * push


def new_bodies(tracks: int, people: int) -> BodyTracks:
    """Return the state of a number of bodies at the start, before people are placed."""
    return BodyTracks(np.zeros(tracks), np.zeros(people, PERSON), np.zeros((0, 2)))


def start_people(  # noqa: PLR0917  # the kernel's arguments, in its order
    config: PeopleConfig,
    occupied: npt.NDArray[np.uint8],
    bodies: BodyTracks,
    tracks: Tracks,
    flow: FlowField,
    walk: WalkParams,
    key: int,
    robot: Disc,
    plan_id: str,
) -> None:
    """Place people at random and give them speeds and goals, without drawing them in ``occupied`` (static bits only).

    People without a place remain zeros.

    Raises
    ------
    ConfigError
        There is space for fewer than ``config.least`` people.
    """
    ppm = walk.pixels_per_metre
    placed = place_people(
        occupied,
        bodies,
        tracks,
        flow,
        walk,
        key,
        robot,
        config.away_m * ppm,
        config.speed_m_s * ppm,
        config.speed_sd * ppm,
    )
    bodies.people[placed:] = 0
    if placed < config.least:
        raise ConfigError(
            f"people.least: {config.least} people of radius {config.radius_m:g} m do not fit in plan "
            f"{plan_id!r}, which has room for {placed}; ask for fewer, or for smaller ones"
        )


_CORNERS = 32  # of an ellipse, with an error of 0.5%


def make_tracks(trajectories: Sequence[Trajectory], occupied: Grid, frame: GridFrame, plan_id: str) -> Tracks:
    """Return trajectories on the grid of a world; ``occupied`` are the static obstacles.

    Raises
    ------
    ConfigError
        A shape runs into a wall or off the grid; the error says which trajectory, when and where.
    """
    tracks, occupied = _tracks(trajectories, frame), as_read_only(occupied)
    for k in range(len(trajectories)):
        time, row, col = find_track_collision(occupied, tracks, k)
        if time >= 0.0:
            x, y = frame.points_from_pixels(track_pose_at(tracks, k, time)[:2]).tolist()
            at_x, at_y = frame.points_from_cells([row, col]).tolist()
            raise ConfigError(
                f"trajectories[{k}]: at {time:.2f} s, at ({x:.2f}, {y:.2f}) m, its shape meets a wall or an obstacle "
                f"at ({at_x:.2f}, {at_y:.2f}) m of plan {plan_id!r}; move the trajectory, or make the shape smaller"
            )
    return tracks


def find_track_cells(tracks: Tracks, shape: tuple[int, int]) -> npt.NDArray[np.bool_]:
    """Return the cells (rows, cols) that trajectories pass, where nothing else may be placed."""
    swept = np.zeros(shape, np.uint8)
    for k in range(len(tracks.times_s)):
        mark_track_cells(swept, tracks, k)
    found: npt.NDArray[np.bool_] = swept == MOVING
    return found


def _tracks(trajectories: Sequence[Trajectory], frame: GridFrame) -> Tracks:
    ppm = frame.pixels_per_metre
    shapes = [_corners(one.shape) for one in trajectories]
    n = len(trajectories)
    most = max((len(one.times_s) for one in trajectories), default=1)
    tracks = Tracks(
        np.zeros((n, most)),
        np.zeros((n, most, 3)),
        np.zeros((n, max((len(corners) for corners, _ in shapes), default=1), 2)),
        np.zeros(n, SHAPE),
    )
    for k, (one, (corners, round_m)) in enumerate(zip(trajectories, shapes, strict=True)):
        keys = len(one.times_s)
        poses = np.array(one.poses)
        poses[:, :2] = frame.pixels_from_points(poses[:, :2])
        poses[:, 2] = np.unwrap(np.radians(poses[:, 2]))
        tracks.times_s[k, :keys], tracks.poses[k, :keys] = one.times_s, poses
        tracks.corners[k, : len(corners)] = corners * ppm
        # a shape thinner than a cell's diagonal is enlarged to it, so that it always covers cells, and connected ones
        grown_px = round_m * ppm + max(HALF_DIAGONAL - one.shape.thickness_m * ppm / 2, 0.0)
        reach_px = float(np.hypot(*corners.T).max()) * ppm + grown_px
        core_px, fastest = max(_core(corners) * ppm + grown_px, 0.0), _fastest(one.times_s, poses, reach_px)
        tracks.shapes[k] = keys, len(corners), one.loop, grown_px, core_px, reach_px, fastest
    return tracks


def _corners(shape: Shape) -> tuple[Floats, float]:
    """Return corners (n, 2), metres ahead and to the left, and the radius around them; a circle is one corner."""
    if isinstance(shape, Circle):
        return np.zeros((1, 2)), shape.radius_m
    if isinstance(shape, Ellipse):
        angles = np.arange(_CORNERS) * (2 * math.pi / _CORNERS)
        halves = shape.width_m / 2, shape.height_m / 2
        return np.stack([halves[0] * np.cos(angles), halves[1] * np.sin(angles)], axis=1), 0.0
    return np.array(shape.outline_m, dtype=np.float64), 0.0


def _core(corners: Floats) -> float:
    """Return the radius of the largest disc around the position in a polygon; if outside, minus the distance."""
    along = np.roll(corners, -1, axis=0) - corners
    length = (along**2).sum(axis=1)
    part = np.clip(-(corners * along).sum(axis=1) / np.where(length > 0, length, 1.0), 0.0, 1.0)
    rim = float(np.hypot(*(corners + part[:, None] * along).T).min())
    inside = False
    for (x1, y1), (x2, y2) in zip(corners.tolist(), np.roll(corners, -1, axis=0).tolist(), strict=True):
        if (y1 > 0) != (y2 > 0) and x1 - y1 * (x2 - x1) / (y2 - y1) > 0:
            inside = not inside
    return rim if inside else -rim


def _fastest(times_s: Sequence[float], poses: Floats, reach_px: float) -> float:
    """Return the speed of the fastest point of a body, pixels per second."""
    moved = np.diff(poses, axis=0)
    speeds = (np.hypot(moved[:, 0], moved[:, 1]) + reach_px * np.abs(moved[:, 2])) / np.diff(times_s)
    return float(speeds.max())
