"""Simulate one robot in a plan, driven by a person, an explorer or a server's policy, and make its frames.

It does not know the socket.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from typing import Any, Final

import numpy as np

from houseexpo.errors import ConfigError, PolicyError
from houseexpo.files import zip_bytes
from houseexpo.floorplan import FloorPlan
from houseexpo.pseudoslam.agents.driving import DriveSession
from houseexpo.pseudoslam.agents.loading import NAMES, NamedPolicy, load_policy
from houseexpo.pseudoslam.agents.protocol import Interface, make_knowledge
from houseexpo.pseudoslam.benchmark.episodes import start_policy
from houseexpo.pseudoslam.envs.single import ExplorationEnv
from houseexpo.pseudoslam.render.sight import measure_sight
from houseexpo.pseudoslam.simulator import ACTIONS
from houseexpo.service.drive.messages import (
    COLLIDED,
    ENDED,
    SUCCESS,
    YOU,
    RobotReport,
    SentMap,
    StartDrive,
    encode_frame,
)

BEAMS: Final = 181
"""Beams of the laser that the browser draws."""
_ALL_SEEN: Final = 0.99
"""The coverage at which a drive ends: specks behind walls stay unseen."""
_MOVED_M: Final = 1e-6
"""A shorter way is a turn on the spot, metres."""


class BumpCounter:
    """Counts contacts: a robot that keeps pushing against a wall has bumped once, until it moves freely again."""

    def __init__(self) -> None:
        self.count = 0
        self._touches = False

    def step(self, *, blocked: bool, moved_m: float) -> None:
        """Add a step: whether the robot was blocked, and how far it moved."""
        if blocked:
            self.count += not self._touches
            self._touches = True
        elif moved_m > _MOVED_M:  # turning on the spot leaves no wall
            self._touches = False


class DrivenRobot:
    """A robot in a plan; one thread at a time.

    Parameters
    ----------
    policies
        The server's own policies: the names of files or functions, by the names of drivers.

    Raises
    ------
    ConfigError, PlanError
        There is no such driver, or the house cannot take what was asked for: it is too narrow, or has no room for it.
    PolicyError
        The policy cannot be started.
    """

    def __init__(
        self,
        plan: FloorPlan,
        start: StartDrive,
        policies: Mapping[str, str] | None = None,
    ) -> None:
        self._start = start
        self._by_hand = start.driver == YOU
        policy = None if self._by_hand else _load(start.driver, policies or {})
        shown = Interface("continuous") if self._by_hand else policy.interface if policy else Interface()
        config = start.config if shown.view is None else replace(start.config, observation=shown.view)
        self._env = ExplorationEnv(
            [plan], config, success_coverage=_ALL_SEEN, actions=shown.actions, observation=shown.observation,
            action_mask=shown.action_mask,
        )  # fmt: skip
        self._drive = DriveSession(self._env, start.seed)
        self._mind = self._ask(lambda: start_policy(policy, self._env)) if policy else None
        self._done = False
        self._sent = SentMap(self._env.state.known.shape)
        self._number, self._steps, self._bumps = 0, 0, BumpCounter()

    def hello(self) -> dict[str, Any]:
        """Return the values that the browser needs before the first frame."""
        world, config = self._env.simulator.world, self._env.config
        rows, cols = self._env.state.known.shape
        return {
            "rows": rows,
            "cols": cols,
            "cell_m": world.frame.cell_m,
            "radius_px": config.robot.radius_m * config.pixels_per_metre,
            "fov_deg": config.laser.fov_deg,
            "beams": BEAMS,
            "step_s": config.step_s,
        }

    @property
    def goes_by_itself(self) -> bool:
        """Whether an explorer moves it, not a person."""
        return not self._by_hand

    @property
    def ended(self) -> bool:
        """Whether the episode has ended, the explorer is done, or the drive is finished."""
        return self._done or self._drive.ended

    def move(self, linear: float, angular: float) -> bool:
        """Move at shares of the full speed for a frame; return whether a step was taken: at rest, time stands still.

        Where there are people, it goes on.
        """
        if self.ended or (not linear and not angular and not self._start.people):
            return False
        self._act((linear, angular))
        return True

    def advance(self) -> bool:
        """Take the next step of the explorer, and return whether there was one.

        Raises
        ------
        PolicyError
            The explorer failed.
        """
        if self.ended:
            return False
        action = self._decide()
        if action is None:
            self._done = True
        else:
            self._act(action)
        return True

    def take_over(self, linear: float, angular: float) -> bool:
        """Take a step by a person's keys in place of the explorer's, and return whether there was one.

        Of discrete steps, forward comes before turning. The explorer goes on from where the robot is.
        """
        keys = ("forward", linear > 0), ("left", angular > 0), ("right", angular < 0)
        pressed = [ACTIONS.index(name) for name, is_down in keys if is_down]
        if self.ended:
            return False
        if self._env.actions == "continuous":
            self._act(np.array([linear, angular]))
        elif pressed:
            self._act(pressed[0])
        else:
            return False
        return True

    def _decide(self) -> Any:
        """Return an action of the environment, or None when the policy is done."""
        mind = self._mind
        assert mind is not None  # noqa: S101  # only explorers are asked
        known = make_knowledge(self._env.simulator, self._env.state)
        return self._ask(lambda: mind(self._drive.observation, known))

    def _ask(self, question: Callable[[], Any]) -> Any:
        try:
            return question()
        except (Exception, SystemExit) as error:
            raise PolicyError(f"policy {self._start.driver!r} failed: {type(error).__name__}: {error}") from error

    def _act(self, action: Any) -> None:
        before_m = self._path_m
        if self._by_hand:
            self._drive.act(np.array(action), _name(*action))
        else:
            self._ask(lambda: self._drive.act(action, str(action)))
        self._steps += 1
        self._bumps.step(blocked=bool(self._drive.info["collided"]), moved_m=self._path_m - before_m)

    @property
    def _path_m(self) -> float:
        return float(self._env.state.episode.readings[0].path_length) / self._env.config.pixels_per_metre

    def frame(self) -> bytes:
        """Return the changes since the last frame."""
        state, info = self._env.state, self._drive.info
        flags = COLLIDED * bool(info["collided"]) | ENDED * self.ended | SUCCESS * bool(info["is_success"])
        x, y, heading = state.believed_px.tolist()
        self._number += 1
        report = RobotReport(
            self._number, flags, self._bumps.count, self._steps, (x, y, heading), info["explored_m2"],
            info["coverage"], self._path_m,
        )  # fmt: skip
        return encode_frame(report, self._sent.update(state.known), measure_sight(self._env.simulator, state, BEAMS))

    def finish(self) -> dict[str, Any]:
        """End the drive, and return its results.

        ``why`` says how it ended: "seen" (all of the house), "steps" (the most that an episode has), "done" (the
        explorer has no more to do) or "you".
        """
        info = self._drive.info
        ended_before, self._done = self.ended, True
        why = "seen" if info["is_success"] else "steps" if self._drive.ended else "done" if ended_before else "you"
        return {
            "why": why,
            "coverage": info["coverage"],
            "explored_m2": info["explored_m2"],
            "steps": self._steps,
            "path_m": self._path_m,
            "bumps": self._bumps.count,
            "time_s": self._steps * self._env.config.step_s,
        }

    def archive(self) -> bytes:
        """Return a zip archive of the files that ``houseexpo play --out`` writes."""
        return zip_bytes(self._drive.files())


@cache
def explorer_names() -> tuple[str, ...]:
    """Return the names of the benchmark's explorers."""
    return tuple(name for name in NAMES if "exploration" in (load_policy(name).interface.tasks or ("exploration",)))


def _load(name: str, policies: Mapping[str, str]) -> NamedPolicy:
    """Return an explorer or a policy of the server; files and modules, which only its command may name, are refused."""
    if name in policies:
        return load_policy(policies[name])
    if name not in explorer_names():
        known = ", ".join([*explorer_names(), *policies])
        raise ConfigError(f"driver: expected {YOU} or one of {known}; found {name!r}")
    return load_policy(name)


def _name(linear: float, angular: float) -> str:
    ahead = "forward" if linear > 0 else "back" if linear < 0 else ""
    aside = "left" if angular > 0 else "right" if angular < 0 else ""
    return f"{ahead} {aside}".strip() or "wait"
