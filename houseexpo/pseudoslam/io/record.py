"""A movie of a policy at work."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

import gymnasium

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.agents.policies import Policy, known_env
from houseexpo.pseudoslam.io.films import write_movie
from houseexpo.pseudoslam.render.canvas import Image
from houseexpo.pseudoslam.render.picture import beside, picture

Panels = Literal["map", "both", "truth", "beside"]


@dataclass
class Recorded:
    """What came of it: steps taken, the sum of rewards, the last ``info``, and whether the episode ended."""

    steps: int = 0
    reward: float = 0.0
    ended: bool = False
    info: dict[str, Any] = field(default_factory=dict)


def record(
    env: gymnasium.Env[Any, Any],
    policy: Policy,
    path: str | os.PathLike[str],
    steps: int = 200,
    *,
    seed: int | None = None,
    options: dict[str, Any] | None = None,
    fps: float = 15.0,
    every: int = 1,
    shows: Panels = "both",
    most_px: tuple[int, int] = (640, 480),
) -> Recorded:
    """Write a movie of one episode, a picture of the start and one after each step.

    Parameters
    ----------
    env
        One of PseudoSLAM's, wrapped or not; ``render_mode`` does not matter.
    policy
        Any function from an observation to an action; ``policies.policy_of`` makes some.
    path
        File to write, .gif or .mp4.
    steps
        At most; the movie is over where the episode is.
    seed, options
        Of ``reset``.
    every
        A picture after so many steps.
    shows
        As in ``render.picture``, or "beside": the truth and the map side by side.

    Raises
    ------
    ConfigError
        Where the environment is none of ours, or a number is too small.
    """
    if shows not in get_args(Panels):
        raise ConfigError(f"shows: expected one of {', '.join(get_args(Panels))}; found {shows!r}")
    if steps < 1 or every < 1:
        raise ConfigError(f"record: expected steps and every to be at least 1, found {steps} and {every}")
    known_env(env)
    done = Recorded()

    def pictures() -> Iterator[Image]:
        observation, done.info = env.reset(seed=seed, options=options)
        trail = []
        while True:
            trail.append(known_env(env).state.poses_px.copy())
            last = done.ended or done.steps == steps
            if done.steps % every == 0 or last:
                yield _drawn(env, trail, shows, most_px)
            if last:
                return
            observation, reward, terminated, truncated, done.info = env.step(policy(observation))
            done.steps, done.reward, done.ended = done.steps + 1, done.reward + float(reward), terminated or truncated

    write_movie(pictures(), path, fps)
    return done


def _drawn(env: gymnasium.Env[Any, Any], trail: list[Any], shows: Panels, most_px: tuple[int, int]) -> Image:
    inner = known_env(env)
    if shows == "beside":
        return beside(inner.simulator, inner.state, trail, most_px=most_px)
    return picture(inner.simulator, inner.state, trail, shows=shows, most_px=most_px)
