"""Draw an episode as an RGB image: the map or the truth, robot, trail, field of view, goal and moving obstacles."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from typing import Final, Literal, get_args

import cv2
import numpy as np
import numpy.typing as npt

from houseexpo.configuration import check_one_of
from houseexpo.errors import MissingDependencyError, install_command
from houseexpo.pseudoslam.kernels.collision import STATIC
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE
from houseexpo.pseudoslam.render.canvas import Canvas, Colour, Image, Points, scale_cells, scale_for
from houseexpo.pseudoslam.render.sight import MovingBody, beam_ends, find_bodies, move_to_belief
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
"""Colours that colour-blind readers can distinguish, also in print."""
SIGHT: Final = 0.13
"""Opacity of the robot's colour over its field of view."""

_COLOURS = np.array(
    [UNKNOWN_COLOUR, FREE_COLOUR, HIDDEN_COLOUR, HIDDEN_THING_COLOUR, WALL_COLOUR, MASS_COLOUR, THING_COLOUR], np.uint8
)
_UNKNOWN, _FREE, _HIDDEN, _HIDDEN_THING, _WALL, _MASS, _THING = range(7)
_PRIORITY = np.array([0, 2, 1, 3, 5, 4, 6], np.uint8)  # the cell that a pixel for several cells shows
_SKIN = np.ones((3, 3), np.uint8)
_VIEW_GAP_PX = 12


def draw_episode(
    simulator: Simulator,
    state: State,
    trail: Sequence[npt.ArrayLike] = (),
    *,
    most_px: tuple[int, int] = (960, 720),
    shows: Shows = "map",
) -> Image:
    """Draw the current state of an episode.

    Parameters
    ----------
    trail
        The robot's former poses in order, in the form of ``State.poses_px``.
    most_px
        Largest width and height of the picture. Cells become the largest possible squares of whole pixels. If there
        are more cells than pixels, a pixel stands for a square of cells, and shows a wall if one of them is a wall.
    shows
        "map": the robot's map, its pose by odometry, and those moving obstacles that it sees; "truth": the true world;
        "both": the map over a pale picture of the truth.

    Returns
    -------
    The picture, (rows, cols, 3) uint8, RGB, row 0 at the highest y.

    Raises
    ------
    ConfigError
        There is no space for a picture, or ``shows`` is none of these.
    """
    check_one_of(shows, "shows", get_args(Shows))
    scale, colours = scale_cells(_colours(simulator, state, shows), _PRIORITY, most_px)
    canvas = Canvas(_COLOURS[colours], scale)
    true, seen_from = state.pose_px, state.pose_px if shows == "truth" else state.believed_px
    ends = beam_ends(simulator, state)
    canvas.tint(
        move_to_belief(np.vstack([true[None, :2], ends]), true, seen_from), ROBOT_COLOUR, SIGHT, colours < _WALL
    )
    metre = simulator.config.pixels_per_metre
    _draw_goal(canvas, simulator, state)
    if len(trail) > 1:
        canvas.line(
            np.asarray(trail, np.float64)[:, slice(2) if shows == "truth" else slice(3, 5)], 0.05 * metre, TRAIL_COLOUR
        )
    _draw_bodies(canvas, find_bodies(simulator, state, ends), true, seen_from, shows)
    _draw_robot(canvas, seen_from, simulator.config.robot.radius_m * metre)
    return canvas.image


def draw_world_and_map(
    simulator: Simulator, state: State, trail: Sequence[npt.ArrayLike] = (), *, most_px: tuple[int, int] = (960, 720)
) -> Image:
    """Draw the world and, to its right (or below it, if that makes them larger), the map, like ``draw_episode``."""
    wide, high = most_px
    sizes = (wide, (high - _VIEW_GAP_PX) // 2), ((wide - _VIEW_GAP_PX) // 2, high)
    below, right = (scale_for(state.known.shape, size) for size in sizes)
    axis = 0 if below > right else 1
    truth = draw_episode(simulator, state, trail, most_px=sizes[axis], shows="truth")
    known = draw_episode(simulator, state, trail, most_px=sizes[axis], shows="map")
    strip = np.full((len(truth), _VIEW_GAP_PX, 3) if axis else (_VIEW_GAP_PX, truth.shape[1], 3), 255, np.uint8)
    return np.concatenate([truth, strip, known], axis=axis)


def pad_picture(image: Image, size_px: tuple[int, int]) -> Image:
    """Return a picture centred in one of this width and height, surrounded by the colour of unknown cells."""
    wide, high = size_px
    found = np.full((high, wide, 3), UNKNOWN_COLOUR, np.uint8)
    rows, cols = image.shape[:2]
    top, left = (high - rows) // 2, (wide - cols) // 2
    found[top : top + rows, left : left + cols] = image
    return found


def _colours(simulator: Simulator, state: State, shows: Shows) -> npt.NDArray[np.uint8]:
    """Return the number of each cell's colour (rows, cols)."""
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
    found[cv2.erode(wall, _SKIN, iterations=2, borderValue=1) != 0] = _MASS  # walls as lines, not as dark areas
    found[things & (wall != 0)] = _THING
    return found


def _draw_robot(canvas: Canvas, pose: Points, radius_px: float) -> None:
    ahead = np.array([math.cos(pose[2]), -math.sin(pose[2])])
    radius = max(radius_px, 1.2 / canvas.scale)
    if radius * canvas.scale < 4:  # too small for a line inside: draw it beyond the rim
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


def _draw_bodies(canvas: Canvas, bodies: list[MovingBody], true: Points, seen_from: Points, shows: Shows) -> None:
    """Draw moving obstacles; on the map, only those that a beam hits, where the robot believes them to be."""
    for body in bodies:
        if not body.seen and shows == "map":
            continue
        corners = move_to_belief(body.corners, true, seen_from) if body.seen else body.corners
        canvas.blob(corners, body.round_px + 1.5 / canvas.scale, FREE_COLOUR)
        canvas.blob(corners, body.round_px, BODY_COLOUR if body.seen or shows == "truth" else HIDDEN_BODY_COLOUR)


class PictureWindow:
    """A window, which opens with the first picture.

    Raises
    ------
    MissingDependencyError
        pygame is not installed.
    """

    def __init__(self, title: str) -> None:
        os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
        try:
            import pygame
        except ImportError as error:
            raise MissingDependencyError(f"a window needs pygame: {install_command('play')}") from error
        self._pygame, self._title = pygame, title
        self._clock = pygame.time.Clock()
        self._screen: pygame.Surface | None = None

    def show(self, image: npt.NDArray[np.uint8], caption: str = "", fps: float = 0.0) -> None:
        """Show a picture (rows, cols, 3), at most ``fps`` per second (0 for no limit)."""
        pygame, size = self._pygame, image.shape[1::-1]
        if self._screen is None or self._screen.get_size() != size:
            pygame.display.init()
            self._screen = pygame.display.set_mode(size)
        pygame.display.set_caption(caption or self._title)
        self._screen.blit(pygame.surfarray.make_surface(image.swapaxes(0, 1)), (0, 0))
        pygame.event.pump()
        pygame.display.flip()
        if fps > 0:
            self._clock.tick(fps)

    def close(self) -> None:
        """Close the window."""
        self._pygame.display.quit()
        self._screen = None
