"""Simulate one robot in a plan, driven by a person, a benchmark's explorer or a recording, and make its frames.

It does not know the socket.
"""

from __future__ import annotations

from functools import cache
from typing import Any, Final

import numpy as np

from houseexpo.errors import ConfigError, PolicyError
from houseexpo.files import zip_bytes
from houseexpo.floorplan import FloorPlan
from houseexpo.pseudoslam.agents.driving import DriveSession
from houseexpo.pseudoslam.agents.loading import NAMES, NamedPolicy, load_policy
from houseexpo.pseudoslam.agents.protocol import make_knowledge, make_robot
from houseexpo.pseudoslam.envs.single import ExplorationEnv
from houseexpo.pseudoslam.render.sight import measure_sight
from houseexpo.service.drive.frames import COLLIDED, ENDED, SUCCESS, RobotReport, SentMap, encode_frame
from houseexpo.service.drive.messages import YOU, StartDrive
from houseexpo.service.drive.recordings import FULL, Action, DriveEnd, Recorder, Recording, hash_geometry

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
    replayed
        What it does, where it replays a drive; ``start`` is the recording's then.

    Raises
    ------
    ConfigError, PlanError
        There is no such driver, or the house cannot take what was asked for: it is too narrow, or has no room for it.
    """

    def __init__(self, plan: FloorPlan, start: StartDrive, replayed: Recording | None = None) -> None:
        self._start, self._replayed = start, replayed
        self._by_hand = start.driver == YOU
        policy = None if self._by_hand else _explorer(start.driver)
        spaces: dict[str, Any] = {"actions": "continuous"}
        if policy is not None:
            spaces = {"actions": policy.interface.actions, "observation": policy.interface.observation}
        self._env = ExplorationEnv([plan], start.config, success_coverage=_ALL_SEEN, **spaces)
        self._drive = DriveSession(self._env, start.seed)
        self._script = replayed.actions() if replayed else iter(())
        self._mind = None
        if policy is not None and replayed is None:
            self._mind = policy.factory(make_robot(self._env, policy.interface), start.seed)
        self._is_same_house = replayed is None or replayed.shape == hash_geometry(plan)
        self._recorder = Recorder(start, plan)
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
            "replay": self._describe_replay(),
        }

    def _describe_replay(self) -> dict[str, Any] | None:
        if self._replayed is None:
            return None
        options = {name: getattr(self._start, name) for name in self._start.__struct_fields__}
        return {"options": options, "steps": self._replayed.steps, "same_house": self._is_same_house}

    @property
    def goes_by_itself(self) -> bool:
        """Whether an explorer or a recording moves it, not a person."""
        return not self._by_hand or self._replayed is not None

    @property
    def ended(self) -> bool:
        """Whether the episode has ended, the explorer is done, or the drive is finished."""
        return self._done or self._drive.ended

    def move(self, linear: float, angular: float) -> bool:
        """Move at shares of the full speed for a frame; return whether a step was taken: at rest, time stands still.

        Where there are people, it goes on. Shares are taken to the nearest 127th, so that a recording holds them.
        """
        if self.ended or (not linear and not angular and not self._start.people):
            return False
        self._act((round(linear * FULL), round(angular * FULL)))
        return True

    def advance(self) -> bool:
        """Take the next step of the explorer or the recording, and return whether there was one.

        Raises
        ------
        PolicyError
            The explorer failed.
        """
        if self.ended:
            return False
        action = next(self._script, None) if self._mind is None else self._decide()
        if action is None:
            self._done = True
        else:
            self._act(action)
        return True

    def _decide(self) -> Action | None:
        assert self._mind is not None  # noqa: S101  # only explorers are asked
        try:
            action = self._mind(self._drive.observation, make_knowledge(self._env.simulator, self._env.state))
        except Exception as error:
            raise PolicyError(f"the explorer failed: {type(error).__name__}: {error}") from error
        return None if action is None else (int(action), 0)

    def _act(self, action: Action) -> None:
        before_m = self._path_m
        if self._by_hand:
            linear, angular = action[0] / FULL, action[1] / FULL
            self._drive.act(np.array([linear, angular]), _name(linear, angular))
        else:
            self._drive.act(action[0], str(action[0]))
        self._recorder.add(action)
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
        """End the drive; return its results, and its recording as text ("" if it is too long for a link).

        ``why`` says how it ended: "seen" (all of the house), "steps" (the most that an episode has), "done" (the
        explorer or the recording has no more to do) or "you". ``replay`` is None, or whether a recording ended where it
        had ended before: "same", "another place", or "not yet".
        """
        info = self._drive.info
        ended_before, self._done = self.ended, True
        why = "seen" if info["is_success"] else "steps" if self._drive.ended else "done" if ended_before else "you"
        x, y, _ = self._env.simulator.pose(self._env.state)
        end = DriveEnd(x, y, info["coverage"])
        replay = None
        if self._replayed is not None:
            whole = self._steps >= self._replayed.steps
            replay = ("same" if end.is_near(self._replayed.end) else "another place") if whole else "not yet"
        return {
            "why": why,
            "coverage": info["coverage"],
            "explored_m2": info["explored_m2"],
            "steps": self._steps,
            "path_m": self._path_m,
            "bumps": self._bumps.count,
            "time_s": self._steps * self._env.config.step_s,
            "recording": self._recorder.recording(end).as_text() if replay is None else "",
            "replay": replay,
        }

    def archive(self) -> bytes:
        """Return a zip archive of the files that ``houseexpo play --out`` writes."""
        return zip_bytes(self._drive.files())


@cache
def explorer_names() -> tuple[str, ...]:
    """Return the names of the benchmark's explorers."""
    return tuple(name for name in NAMES if "exploration" in (load_policy(name).interface.tasks or ("exploration",)))


def _explorer(name: str) -> NamedPolicy:
    """Return an explorer by its name; files and modules, which other commands accept, are refused here."""
    if name not in explorer_names():
        raise ConfigError(f"driver: expected {YOU} or one of {', '.join(explorer_names())}; found {name!r}")
    return load_policy(name)


def _name(linear: float, angular: float) -> str:
    ahead = "forward" if linear > 0 else "back" if linear < 0 else ""
    aside = "left" if angular > 0 else "right" if angular < 0 else ""
    return f"{ahead} {aside}".strip() or "wait"
