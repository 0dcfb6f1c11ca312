"""Record a movie of a policy, or of several side by side, and a ROS bag with the robot's map and sensor data."""

from __future__ import annotations

import itertools
import os
import tempfile
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Literal, get_args

import cv2
import gymnasium
import numpy as np
import numpy.typing as npt

from houseexpo.configuration import check_one_of
from houseexpo.errors import ConfigError, MissingDependencyError
from houseexpo.files import PARTIAL, make_folder, name_in_os_errors
from houseexpo.pseudoslam.agents.policies import Policy, unwrap_env
from houseexpo.pseudoslam.io.bags import BagWriter
from houseexpo.pseudoslam.render import picture as render
from houseexpo.pseudoslam.render.canvas import Image
from houseexpo.pseudoslam.render.picture import ROBOT_COLOUR, Shows, draw_episode, draw_world_and_map, pad_picture

Panels = Literal["map", "both", "truth", "beside"]


@dataclass
class RecordedEpisode:
    """The result: numbers of actions and steps, the sum of rewards, the last ``info``, whether the episode ended."""

    actions: int = 0
    steps: int = 0
    reward: float = 0.0
    ended: bool = False
    info: dict[str, Any] = field(default_factory=dict)


def record_episode(
    env: gymnasium.Env[Any, Any],
    policy: Policy,
    path: str | os.PathLike[str] | None,
    steps: int = 200,
    *,
    seed: int | None = None,
    options: dict[str, Any] | None = None,
    fps: float = 15.0,
    every: int = 1,
    shows: Panels = "both",
    most_px: tuple[int, int] = (640, 480),
    bag: str | os.PathLike[str] | None = None,
) -> RecordedEpisode:
    """Write a movie of one episode, with a picture of the start and one after each action, or a ROS bag, or both.

    Parameters
    ----------
    env
        An environment of PseudoSLAM, wrapped or not, with any ``render_mode``.
    policy
        A function from an observation to an action, such as from ``policies.make_policy``.
    path
        File to write, .gif or .mp4; None for no movie.
    steps
        Largest number of steps; the movie ends earlier if the episode does.
    seed, options
        Arguments of ``reset``.
    every
        Number of actions between pictures.
    shows
        As in ``render.picture``, or "beside" for the truth and the map side by side.
    bag
        ROS bag to write, .mcap (see ``bags``); None for no bag. Its scans contain the laser's noise if the environment
        shows ranges (``observation="dict"``), and are exact otherwise.

    Raises
    ------
    ConfigError
        The environment is not one of ours, a number is too small, or there is nothing to write.
    MissingDependencyError
        A library for writing the file is not installed.
    """
    check_one_of(shows, "shows", get_args(Panels))
    if steps < 1 or every < 1:
        raise ConfigError(f"record: expected steps and every to be at least 1, found {steps} and {every}")
    if path is None and bag is None:
        raise ConfigError(
            "record: expected a movie or a bag to write, found neither; name it with --out run.gif or --bag run.mcap"
        )
    inner, done = unwrap_env(env), RecordedEpisode()
    trail: list[Any] = []

    def episode(writer: BagWriter | None) -> Iterator[bool]:
        """Run the episode; yield at the start and after each step whether that was the last one."""
        observation, done.info = env.reset(seed=seed, options=options)
        while True:
            trail.append(inner.state.poses_px.copy())
            if writer:
                writer.write(inner.simulator, inner.state)
            last = done.ended or done.steps >= steps
            yield last
            if last:
                return
            observation, reward, terminated, truncated, done.info = env.step(policy(observation))
            done.actions, done.steps = done.actions + 1, int(inner.state.counts.steps)
            done.reward, done.ended = done.reward + float(reward), terminated or truncated

    with (
        nullcontext() if bag is None else name_in_os_errors(Path(bag)),
        nullcontext() if bag is None else BagWriter(bag) as writer,
    ):
        moments = episode(writer)
        if path is None:
            deque(moments, maxlen=0)
        else:
            pictures = (
                _draw_frame(env, trail, shows, most_px) for last in moments if last or done.actions % every == 0
            )
            write_movie(pictures, path, fps)
    return done


def _draw_frame(env: gymnasium.Env[Any, Any], trail: list[Any], shows: Panels, most_px: tuple[int, int]) -> Image:
    inner = unwrap_env(env)
    if shows == "beside":
        return draw_world_and_map(inner.simulator, inner.state, trail, most_px=most_px)
    return draw_episode(inner.simulator, inner.state, trail, shows=shows, most_px=most_px)


_PANEL_GAP_PX: Final = 8
_CAPTION_PX: Final = 40
_FONT, _LARGE, _SMALL = cv2.FONT_HERSHEY_SIMPLEX, 0.45, 0.38


@dataclass
class Racer:
    """A policy in its own environment, and its progress.

    Parameters
    ----------
    env
        An environment of PseudoSLAM, wrapped or not; all must have the same plans.
    policy
        A function from an observation to an action.
    """

    name: str
    env: gymnasium.Env[Any, Any]
    policy: Policy
    steps: int = 0
    ended: bool = False
    info: dict[str, Any] = field(default_factory=dict)
    observation: Any = None
    trail: list[Any] = field(default_factory=list)

    def begin(self, seed: int | None, options: dict[str, Any] | None) -> None:
        """Start an episode."""
        self.observation, self.info = self.env.reset(seed=seed, options=options)
        self.trail = [unwrap_env(self.env).state.poses_px.copy()]

    def go(self, steps: int) -> None:
        """Continue until at least this number of steps is taken, or the episode has ended."""
        while not self.ended and self.steps < steps:
            self.observation, _, terminated, truncated, self.info = self.env.step(self.policy(self.observation))
            self.steps, self.ended = int(unwrap_env(self.env).state.counts.steps), terminated or truncated
            self.trail.append(unwrap_env(self.env).state.poses_px.copy())

    def caption(self) -> str:
        """Return a line on the progress."""
        env = unwrap_env(self.env)
        metres = float(env.state.episode.readings[0].path_length) / env.config.pixels_per_metre
        return f"{self.info['coverage']:.0%} seen, {self.steps} steps, {metres:.0f} m"


def record_race(
    racers: Sequence[Racer],
    path: str | os.PathLike[str],
    steps: int = 300,
    *,
    seed: int | None = None,
    options: dict[str, Any] | None = None,
    fps: float = 15.0,
    every: int = 1,
    shows: Shows = "both",
    most_px: tuple[int, int] = (960, 480),
) -> None:
    """Write a movie with a picture of the start and one after every ``every`` steps, until all episodes are over.

    Parameters
    ----------
    path
        File to write, .gif or .mp4.
    steps
        Largest number of steps.
    seed, options
        Arguments of ``reset``, the same for all, so that plan and start are the same.
    most_px
        Largest width and height of the whole picture.

    Raises
    ------
    ConfigError
        There is no policy, a number is too small, or the picture is too small for them.
    """
    if not racers or steps < 1 or every < 1:
        raise ConfigError(f"race: expected policies, steps and every to be at least 1, found {len(racers)} policies")
    for racer in racers:
        racer.begin(seed, options)

    def pictures() -> Iterator[Image]:
        yield _draw_race(racers, shows, most_px)
        for step in range(1, steps + 1):
            for racer in racers:
                racer.go(step)
            last = step == steps or all(racer.ended for racer in racers)
            if last or step % every == 0:
                yield _draw_race(racers, shows, most_px)
            if last:
                return

    write_movie(pictures(), path, fps)


def _draw_race(racers: Sequence[Racer], shows: Shows, most_px: tuple[int, int]) -> Image:
    """Draw all policies side by side, each below its name and progress."""
    wide = (most_px[0] - _PANEL_GAP_PX * (len(racers) - 1)) // len(racers)
    panels: list[Image] = []
    for racer in racers:
        env = unwrap_env(racer.env)
        drawn = draw_episode(
            env.simulator, env.state, racer.trail, shows=shows, most_px=(wide, most_px[1] - _CAPTION_PX)
        )
        panel = pad_picture(drawn, (wide, drawn.shape[0]))
        head = np.full((_CAPTION_PX, wide, 3), 255, np.uint8)
        cv2.putText(head, racer.name, (4, 15), _FONT, _LARGE, ROBOT_COLOUR, 1, cv2.LINE_AA)
        cv2.putText(head, racer.caption(), (4, 32), _FONT, _SMALL, (60, 60, 60), 1, cv2.LINE_AA)
        panels += [np.full((_CAPTION_PX + drawn.shape[0], _PANEL_GAP_PX, 3), 255, np.uint8), np.vstack([head, panel])]
    return np.hstack(panels[1:])


# Write a sequence of pictures as a GIF or MP4 file.


_HOLD_S = 1.5  # a GIF shows its last picture for this time


def write_movie(pictures: Iterable[Image], path: str | os.PathLike[str], fps: float) -> None:
    """Write pictures (rows, cols, 3) uint8 of one size to a movie; the file's extension determines the format.

    The file is replaced only when the movie is complete; if a picture cannot be made, the old file stays.

    Raises
    ------
    ConfigError
        The extension is neither .gif nor .mp4, or ``fps`` is not a valid number of pictures per second.
    MissingDependencyError
        OpenCV cannot write MP4 on this machine.
    """
    target = Path(path)
    writers = {".gif": _write_gif, ".mp4": _write_mp4}
    if target.suffix not in writers:
        raise ConfigError(f"movie: expected a file that ends in .gif or .mp4, found {target.name!r}")
    if not 0 < fps <= 100:
        raise ConfigError(f"fps: expected more than 0, at most 100, found {fps!r}")
    make_folder(target.parent)
    with name_in_os_errors(target), tempfile.TemporaryDirectory(dir=target.parent, prefix=PARTIAL) as folder:
        partial = Path(folder) / target.name
        writers[target.suffix](iter(pictures), partial, fps)
        partial.replace(target)


def _write_gif(pictures: Iterator[Image], path: Path, fps: float) -> None:
    from PIL import Image as Pillow

    palette = _palette()

    def frames() -> Iterator[Pillow.Image]:
        for image in pictures:
            frame = Pillow.fromarray(_numbers(image, palette))
            frame.putpalette(palette.tobytes())
            yield frame
        yield from [frame] * round(_HOLD_S * fps)  # equal pictures become one that is shown for longer

    first, *others = frames()
    first.save(
        path, save_all=True, append_images=others, duration=round(1000 / fps), loop=0, disposal=1, optimize=False
    )


def _numbers(image: Image, palette: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    """Return the index of the nearest colour of a palette for each pixel (rows, cols)."""
    packed = image.astype(np.uint32) @ np.array([65536, 256, 1], np.uint32)
    values, inverse = np.unique(packed, return_inverse=True)
    colours = np.stack([values >> 16, values >> 8 & 255, values & 255], axis=1).astype(int)
    nearest = ((colours[:, None] - palette) ** 2).sum(axis=2).argmin(axis=1)
    return np.asarray(nearest[inverse].reshape(image.shape[:2]), np.uint8)


def _palette() -> npt.NDArray[np.uint8]:
    """Return the palette (n, 3): the colours of ``render``, their tints in the field of view, and mixtures of two."""
    ground = np.array(
        [render.FREE_COLOUR, render.UNKNOWN_COLOUR, render.HIDDEN_COLOUR, render.HIDDEN_THING_COLOUR], float
    )
    seen = ground + render.SIGHT * (np.array(render.ROBOT_COLOUR) - ground)
    walls = np.array([render.WALL_COLOUR, render.MASS_COLOUR, render.THING_COLOUR], float)
    ground = np.concatenate([ground, seen])
    drawn = np.array(
        [render.ROBOT_COLOUR, render.TRAIL_COLOUR, render.BODY_COLOUR, render.HIDDEN_BODY_COLOUR, render.GOAL_COLOUR],
        float,
    )
    blends = [
        under + share * (over - under)
        for under, over in itertools.product(np.concatenate([ground[[0, 1, 4]], walls[:1]]), drawn)
        for share in (0.25, 0.5, 0.75)
    ]
    return np.asarray(np.rint(np.concatenate([ground, walls, drawn, blends])), np.uint8)


def _write_mp4(pictures: Iterator[Image], path: Path, fps: float) -> None:
    import cv2

    first = next(pictures)
    size = first.shape[1] + first.shape[1] % 2, first.shape[0] + first.shape[0] % 2  # the codec needs even sizes
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), fps, size)
    if not writer.isOpened():
        raise MissingDependencyError(f"{path.name}: this build of OpenCV cannot write MP4; write a .gif")
    try:
        for image in itertools.chain([first], pictures):
            below, right = size[1] - image.shape[0], size[0] - image.shape[1]
            writer.write(np.pad(image, ((0, below), (0, right), (0, 0)), mode="edge")[..., ::-1])
    finally:
        writer.release()
