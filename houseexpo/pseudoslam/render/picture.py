"""The picture of an episode: the map, and on it the robot, its way, what it sees, and whoever moves beside it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, Literal, NamedTuple, get_args

import cv2
import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.kernels.mapping.merge import FREE, OBSTACLE
from houseexpo.pseudoslam.kernels.motion.bodies import MOVING, STATIC, pose_at
from houseexpo.pseudoslam.kernels.sensing.ranges import cast
from houseexpo.pseudoslam.render.canvas import Canvas, Colour, Image, Points, scale_for, scaled
from houseexpo.pseudoslam.simulator import Simulator
from houseexpo.pseudoslam.state import State

Shows = Literal["map", "both", "truth"]

UNKNOWN_COLOUR: Final[Colour] = (215, 221, 229)
HIDDEN_COLOUR: Final[Colour] = (196, 203, 213)
FREE_COLOUR: Final[Colour] = (255, 255, 255)
WALL_COLOUR: Final[Colour] = (47, 52, 59)
MASS_COLOUR: Final[Colour] = (134, 143, 155)
THING_COLOUR: Final[Colour] = (138, 104, 66)
HIDDEN_THING_COLOUR: Final[Colour] = (205, 190, 170)
ROBOT_COLOUR: Final[Colour] = (31, 98, 200)
TRAIL_COLOUR: Final[Colour] = (122, 166, 228)
BODY_COLOUR: Final[Colour] = (227, 139, 31)
HIDDEN_BODY_COLOUR: Final[Colour] = (240, 205, 160)
GOAL_COLOUR: Final[Colour] = (26, 150, 100)
"""Told apart by the colour-blind too, and in print."""
SIGHT: Final = 0.13
"""How much of the robot's colour lies over what it sees."""

_COLOURS = np.array(
    [UNKNOWN_COLOUR, FREE_COLOUR, HIDDEN_COLOUR, HIDDEN_THING_COLOUR, WALL_COLOUR, MASS_COLOUR, THING_COLOUR], np.uint8
)
_UNKNOWN, _FREE, _HIDDEN, _HIDDEN_THING, _WALL, _MASS, _THING = range(7)
_PRIORITY = np.array([0, 2, 1, 3, 5, 4, 6], np.uint8)  # which colour a pixel has that stands for several cells
_SKIN = np.ones((3, 3), np.uint8)
_GAP_PX = 12
_BEAMS = 721  # the sector's edge is drawn with so many corners


class _Body(NamedTuple):
    """What moves: a polygon grown by a radius, both in pixels, and whether the robot sees it."""

    corners: Points
    round_px: float
    seen: bool


def picture(
    simulator: Simulator,
    state: State,
    trail: Sequence[npt.ArrayLike] = (),
    *,
    most_px: tuple[int, int] = (960, 720),
    shows: Shows = "map",
) -> Image:
    """Draw an episode as it stands.

    Parameters
    ----------
    trail
        Where the robot was, as ``State.poses_px`` has it, one after another.
    most_px
        Width and height that the picture is not to pass. A cell becomes a square of whole pixels, the biggest that do;
        where cells are more than pixels, a pixel stands for a square of cells, and a wall among them wins.
    shows
        "map": what the robot knows, where it believes to be, and of what moves only what it sees; "truth": the world as
        it is; "both": the map, over a pale truth.

    Returns
    -------
    (rows, cols, 3) uint8, RGB, row 0 at the highest y.

    Raises
    ------
    ConfigError
        Where there is no room for a picture, or ``shows`` is none of those.
    """
    if shows not in get_args(Shows):
        raise ConfigError(f"shows: expected one of {', '.join(get_args(Shows))}; found {shows!r}")
    scale, colours = scaled(_colours(simulator, state, shows), _PRIORITY, most_px)
    canvas = Canvas(_COLOURS[colours], scale)
    true, seen_from = state.pose_px, state.pose_px if shows == "truth" else state.believed_px
    ends = _sight(simulator, state)
    canvas.tint(_moved(np.vstack([true[None, :2], ends]), true, seen_from), ROBOT_COLOUR, SIGHT, colours < _WALL)
    metre = simulator.config.pixels_per_metre
    _draw_goal(canvas, simulator, state)
    if len(trail) > 1:
        canvas.line(
            np.asarray(trail, np.float64)[:, slice(2) if shows == "truth" else slice(3, 5)], 0.05 * metre, TRAIL_COLOUR
        )
    _draw_bodies(canvas, _bodies(simulator, state, ends), true, seen_from, shows)
    _draw_robot(canvas, seen_from, simulator.config.robot.radius_m * metre)
    return canvas.image


def beside(
    simulator: Simulator, state: State, trail: Sequence[npt.ArrayLike] = (), *, most_px: tuple[int, int] = (960, 720)
) -> Image:
    """Draw the world and, right of it (or below, where that makes them bigger), the map, as ``picture`` does."""
    wide, high = most_px
    sizes = (wide, (high - _GAP_PX) // 2), ((wide - _GAP_PX) // 2, high)
    below, right = (scale_for(state.known.shape, size) for size in sizes)
    axis = 0 if below > right else 1
    truth = picture(simulator, state, trail, most_px=sizes[axis], shows="truth")
    known = picture(simulator, state, trail, most_px=sizes[axis], shows="map")
    strip = np.full((len(truth), _GAP_PX, 3) if axis else (_GAP_PX, truth.shape[1], 3), 255, np.uint8)
    return np.concatenate([truth, strip, known], axis=axis)


class Sight(NamedTuple):
    """What a robot sees now, pixels: how far beams (n,) go, from the right of the fan to the left, and who moves there.

    ``bodies`` (k, 3) are x, y and radius of each, where the robot believes them to be.
    """

    ranges: Points
    bodies: Points


def sight(simulator: Simulator, state: State, beams: int) -> Sight:
    """Return what the robot sees, along so many of the beams that pictures are drawn with, evenly."""
    ends, true = _sight(simulator, state), state.pose_px
    ranges = np.hypot(*(ends[np.linspace(0, len(ends) - 1, beams).round().astype(int)] - true[:2]).T)
    found = []
    for body in _bodies(simulator, state, ends):
        if body.seen:
            corners = _moved(body.corners, true, state.believed_px)
            centre = corners.mean(axis=0)
            found.append((*centre, np.hypot(*(corners - centre).T).max() + body.round_px))
    return Sight(ranges, np.array(found).reshape(-1, 3))


def framed(image: Image, size_px: tuple[int, int]) -> Image:
    """Return a picture in the middle of one of this width and height, which it does not pass; the rest is unknown."""
    wide, high = size_px
    found = np.full((high, wide, 3), UNKNOWN_COLOUR, np.uint8)
    rows, cols = image.shape[:2]
    top, left = (high - rows) // 2, (wide - cols) // 2
    found[top : top + rows, left : left + cols] = image
    return found


def _colours(simulator: Simulator, state: State, shows: Shows) -> npt.NDArray[np.uint8]:
    """Return (rows, cols): the number of each cell's colour."""
    still = state.occupied & STATIC
    wall = (state.known == OBSTACLE).view(np.uint8) if shows != "truth" else still
    found = np.full(wall.shape, _FREE, np.uint8)
    things = np.zeros(wall.shape, bool)
    for obstacle in state.obstacles:
        things |= obstacle.mask(simulator.world.frame)
    if shows != "truth":
        unknown = (state.known != FREE) & (wall == 0)
        found[unknown] = _UNKNOWN
        if shows == "both":
            found[unknown & (still != 0)] = _HIDDEN
            found[unknown & things] = _HIDDEN_THING
    found[wall != 0] = _WALL
    found[cv2.erode(wall, _SKIN, iterations=2, borderValue=1) != 0] = _MASS  # walls as lines, not as a dark page
    found[things & (wall != 0)] = _THING
    return found


def _sight(simulator: Simulator, state: State) -> Points:
    """Return (n, 2) where the beams of a fan end, pixels, from the right to the left."""
    laser = simulator.config.laser
    half = math.radians(laser.fov_deg) / 2
    angles = np.linspace(-half, half, _BEAMS)
    x, y, heading = state.pose_px
    ranges = np.empty(_BEAMS)
    range_px = laser.range_m * simulator.config.pixels_per_metre
    cast(state.occupied, x, y, heading, np.cos(angles), np.sin(angles), range_px, ranges)
    return np.stack([x + ranges * np.cos(heading + angles), y - ranges * np.sin(heading + angles)], axis=1)


def _moved(points: Points, true: Points, believed: Points) -> Points:
    """Return points seen from a pose as they lie seen from another."""
    turn = believed[2] - true[2]
    right, down = (points - true[:2]).T
    cos, sin = math.cos(turn), math.sin(turn)
    return np.stack([believed[0] + right * cos + down * sin, believed[1] - right * sin + down * cos], axis=1)


def _draw_robot(canvas: Canvas, pose: Points, radius_px: float) -> None:
    ahead = np.array([math.cos(pose[2]), -math.sin(pose[2])])
    radius = max(radius_px, 1.2 / canvas.scale)
    if radius * canvas.scale < 4:  # too small to hold a line: it sticks out
        canvas.line(np.array([pose[:2], pose[:2] + 3 * radius * ahead]), 0.0, ROBOT_COLOUR)
        canvas.blob(pose[None, :2], radius, ROBOT_COLOUR)
        return
    canvas.blob(pose[None, :2], radius + 1.5 / canvas.scale, FREE_COLOUR)
    canvas.blob(pose[None, :2], radius, ROBOT_COLOUR)
    canvas.line(np.array([pose[:2], pose[:2] + 0.75 * radius * ahead]), 0.3 * radius, FREE_COLOUR)


def _draw_goal(canvas: Canvas, simulator: Simulator, state: State) -> None:
    if state.goal_m is None or simulator.config.goal is None:
        return
    place = simulator.world.frame.pixels_from_points(state.goal_m)[None]
    radius = max(simulator.config.goal.radius_m * simulator.config.pixels_per_metre, 2 / canvas.scale)
    for share, colour in ((1.0, GOAL_COLOUR), (0.75, FREE_COLOUR), (0.4, GOAL_COLOUR)):
        canvas.blob(place, share * radius, colour)


def _draw_bodies(canvas: Canvas, bodies: list[_Body], true: Points, seen_from: Points, shows: Shows) -> None:
    """Draw who moves; in what the robot knows, only whom a beam meets, where the robot believes that to be."""
    for body in bodies:
        if not body.seen and shows == "map":
            continue
        corners = _moved(body.corners, true, seen_from) if body.seen else body.corners
        canvas.blob(corners, body.round_px + 1.5 / canvas.scale, FREE_COLOUR)
        canvas.blob(corners, body.round_px, BODY_COLOUR if body.seen or shows == "truth" else HIDDEN_BODY_COLOUR)


def _bodies(simulator: Simulator, state: State, ends: Points) -> list[_Body]:
    """Return people and what goes on tracks; ``ends`` are ``_sight``'s."""
    episode, radius = state.episode, simulator.params.walk.radius_px
    met = _met(state, ends)
    places = np.stack([episode.bodies.people["x"], episode.bodies.people["y"]], axis=1)
    found = [_Body(place[None], radius, _is_met(met, place, radius)) for place in places]
    tracks = episode.tracks
    for k, clock in enumerate(episode.bodies.clocks):
        x, y, heading = pose_at(tracks, k, clock)
        shape = tracks.shapes[k]
        ahead, left = tracks.corners[k, : shape.corners].T
        cos, sin = math.cos(heading), math.sin(heading)
        corners = np.stack([x + ahead * cos - left * sin, y - ahead * sin - left * cos], axis=1)
        seen = _is_met(met, np.array([x, y]), float(shape.reach))
        found.append(_Body(corners, float(shape.grown), seen))
    return found


def _met(state: State, ends: Points) -> Points:
    """Return the ends (n, 2) of those beams that meet something that moves."""
    way = ends - state.pose_px[:2]
    within = ends + 0.5 * way / np.maximum(np.hypot(*way.T), 1e-9)[:, None]  # half a cell beyond the rim
    rows, cols = state.occupied.shape
    col, row = np.floor(within).astype(int).T
    met: Points = ends[(state.occupied[row.clip(0, rows - 1), col.clip(0, cols - 1)] & MOVING) != 0]
    return met


def _is_met(met: Points, centre: Points, reach: float) -> bool:
    return bool((np.hypot(*(met - centre).T) <= reach + 1.0).any())
