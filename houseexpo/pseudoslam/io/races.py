"""A movie of several policies in one house, from one start, side by side."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import cv2
import gymnasium
import numpy as np

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.agents.policies import Policy, known_env
from houseexpo.pseudoslam.io.films import write_movie
from houseexpo.pseudoslam.render.canvas import Image
from houseexpo.pseudoslam.render.picture import ROBOT_COLOUR, Shows, framed, picture

_GAP_PX: Final = 8
_CAPTION_PX: Final = 40
_FONT, _LARGE, _SMALL = cv2.FONT_HERSHEY_SIMPLEX, 0.45, 0.38


@dataclass
class Racer:
    """A policy in an environment of its own, and how far it is.

    Parameters
    ----------
    env
        One of PseudoSLAM's, wrapped or not; all have the same plans.
    policy
        From an observation to an action.
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
        """Begin an episode."""
        self.observation, self.info = self.env.reset(seed=seed, options=options)
        self.trail = [known_env(self.env).state.poses_px.copy()]

    def go(self, steps: int) -> None:
        """Go on until so many steps are taken, or some more where an action is many, or all is over."""
        while not self.ended and self.steps < steps:
            self.observation, _, terminated, truncated, self.info = self.env.step(self.policy(self.observation))
            self.steps, self.ended = int(known_env(self.env).state.counts.steps), terminated or truncated
            self.trail.append(known_env(self.env).state.poses_px.copy())

    def caption(self) -> str:
        """How far it is, in a line."""
        env = known_env(self.env)
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
    """Write a movie: a picture of the start, and one after every so many steps, until all episodes are over.

    Parameters
    ----------
    path
        File to write, .gif or .mp4.
    steps
        At most.
    seed, options
        Of ``reset``, the same for all: one plan, one start.
    most_px
        Width and height of the whole, at most.

    Raises
    ------
    ConfigError
        Where there is nobody, a number is too small, or there is no room.
    """
    if not racers or steps < 1 or every < 1:
        raise ConfigError(f"race: expected policies, steps and every to be at least 1, found {len(racers)} policies")
    for racer in racers:
        racer.begin(seed, options)

    def pictures() -> Iterator[Image]:
        yield _drawn(racers, shows, most_px)
        for step in range(1, steps + 1):
            for racer in racers:
                racer.go(step)
            last = step == steps or all(racer.ended for racer in racers)
            if last or step % every == 0:
                yield _drawn(racers, shows, most_px)
            if last:
                return

    write_movie(pictures(), path, fps)


def _drawn(racers: Sequence[Racer], shows: Shows, most_px: tuple[int, int]) -> Image:
    """Draw all, side by side, each under its name and how far it is."""
    wide = (most_px[0] - _GAP_PX * (len(racers) - 1)) // len(racers)
    panels: list[Image] = []
    for racer in racers:
        env = known_env(racer.env)
        drawn = picture(env.simulator, env.state, racer.trail, shows=shows, most_px=(wide, most_px[1] - _CAPTION_PX))
        panel = framed(drawn, (wide, drawn.shape[0]))
        head = np.full((_CAPTION_PX, wide, 3), 255, np.uint8)
        cv2.putText(head, racer.name, (4, 15), _FONT, _LARGE, ROBOT_COLOUR, 1, cv2.LINE_AA)
        cv2.putText(head, racer.caption(), (4, 32), _FONT, _SMALL, (60, 60, 60), 1, cv2.LINE_AA)
        panels += [np.full((_CAPTION_PX + drawn.shape[0], _GAP_PX, 3), 255, np.uint8), np.vstack([head, panel])]
    return np.hstack(panels[1:])
