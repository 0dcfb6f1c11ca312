"""A robot on show: driven from outside, or by an explorer of the benchmark; it knows no socket."""

from __future__ import annotations

from functools import cache
from typing import Any, Final

import numpy as np

from houseexpo.errors import ConfigError, PolicyError
from houseexpo.files import as_zip
from houseexpo.floorplan import FloorPlan
from houseexpo.pseudoslam.agents.driving import Drive
from houseexpo.pseudoslam.agents.loading import NAMES, NamedPolicy, load_policy
from houseexpo.pseudoslam.agents.protocol import knowledge_of, robot_of
from houseexpo.pseudoslam.envs.single import ExplorationEnv
from houseexpo.pseudoslam.render.sight import sight
from houseexpo.service.drive.frames import COLLIDED, ENDED, SUCCESS, Report, SentMap, frame_of
from houseexpo.service.drive.messages import YOU, Start

BEAMS: Final = 181
_ALL_SEEN: Final = 0.99


class Robot:
    """A robot in a plan; one thread at a time.

    Raises
    ------
    ConfigError, PlanError
        There is no such driver, or the house cannot take what was asked for: it is too narrow, or has no room for it.
    """

    def __init__(self, plan: FloorPlan, start: Start) -> None:
        self._policy = None if start.driver == YOU else _explorer(start.driver)
        spaces: dict[str, Any] = {"actions": "continuous"}
        if self._policy is not None:
            interface = self._policy.interface
            spaces = {"actions": interface.actions, "observation": interface.observation}
        self._env = ExplorationEnv([plan], start.config, success_coverage=_ALL_SEEN, **spaces)
        self._drive = Drive(self._env, start.seed)
        self._people = start.people > 0
        self._done = False
        if self._policy is not None:
            self._mind = self._policy.factory(robot_of(self._env, self._policy.interface), start.seed)
        self._sent = SentMap(self._env.state.known.shape)
        self._number = 0

    def hello(self) -> dict[str, Any]:
        """Return what a browser has to know before the first frame."""
        world, config = self._env.simulator.world, self._env.config
        rows, cols = self._env.state.known.shape
        return {
            "rows": rows,
            "cols": cols,
            "cell_m": world.frame.cell_m,
            "radius_px": config.robot.radius_m * config.pixels_per_metre,
            "fov_deg": config.laser.fov_deg,
            "beams": BEAMS,
        }

    @property
    def ended(self) -> bool:
        """Whether the episode has ended, or the explorer is done."""
        return self._done or self._drive.ended

    def move(self, linear: float, angular: float) -> bool:
        """Move by shares of the full speed for a frame; return whether anything was done: at rest time stands still.

        Where there are people, it goes on.
        """
        if self.ended or (not linear and not angular and not self._people):
            return False
        self._drive.act(np.array([linear, angular]), _name(linear, angular))
        return True

    def explore(self) -> bool:
        """Let the explorer take a step; return whether it did. PolicyError where it fails."""
        if self.ended:
            return False
        try:
            action = self._mind(self._drive.observation, knowledge_of(self._env.simulator, self._env.state))
        except Exception as error:
            raise PolicyError(f"the explorer failed: {type(error).__name__}: {error}") from error
        if action is None:
            self._done = True
        else:
            self._drive.act(action, str(action))
        return True

    def frame(self) -> bytes:
        """Return what changed since the last frame."""
        state, info = self._env.state, self._drive.info
        flags = COLLIDED * bool(info["collided"]) | ENDED * self.ended | SUCCESS * bool(info["is_success"])
        x, y, heading = state.believed_px.tolist()
        path_m = float(state.episode.readings[0].path_length) / self._env.config.pixels_per_metre
        self._number += 1
        report = Report(
            self._number, flags, int(info["collisions"]), (x, y, heading), info["explored_m2"], info["coverage"], path_m
        )
        return frame_of(report, self._sent.update(state.known), sight(self._env.simulator, state, BEAMS))

    def saved(self) -> bytes:
        """Return a zip archive of the files that ``houseexpo play --out`` writes."""
        return as_zip(self._drive.files())


@cache
def explorers() -> tuple[str, ...]:
    """Return the names of the benchmark's explorers."""
    return tuple(name for name in NAMES if "exploration" in (load_policy(name).interface.tasks or ("exploration",)))


def _explorer(name: str) -> NamedPolicy:
    """Return an explorer by its name; files and modules, which other commands take, are none here."""
    if name not in explorers():
        raise ConfigError(f"driver: expected {YOU} or one of {', '.join(explorers())}; found {name!r}")
    return load_policy(name)


def _name(linear: float, angular: float) -> str:
    ahead = "forward" if linear > 0 else "back" if linear < 0 else ""
    aside = "left" if angular > 0 else "right" if angular < 0 else ""
    return f"{ahead} {aside}".strip() or "wait"
