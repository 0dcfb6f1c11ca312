"""Decode and check messages (JSON) from a driver's browser, and derive the simulator configuration they ask for."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Final, Literal, TypeAlias

import msgspec
from msgspec import Meta

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.config.moving_obstacles import PeopleConfig
from houseexpo.pseudoslam.config.obstacles import ObstaclesConfig, RandomObstacles
from houseexpo.pseudoslam.config.robot import LaserConfig, NoiseConfig

YOU: Final = "you"
FRAMES_PER_S: Final = 30
MOST_STEPS_PER_S: Final = 120
"""Steps per second of an explorer: four per frame."""
LONGEST_MESSAGE: Final = 2_000
"""Characters of a message."""
MAX_STEPS: Final = 50_000
"""Steps of an episode in the browser: half an hour without a pause."""

_SPEEDS: Final = {"slow": (0.75, 45.0), "normal": (1.5, 90.0), "fast": (3.0, 150.0)}
"""Metres and degrees per second."""
_NOISE: Final = {
    "none": NoiseConfig(),
    "some": NoiseConfig(laser_m=0.02, odometry_way=0.02, odometry_turn=0.02, odometry_deg_per_m=0.5),
    "much": NoiseConfig(
        laser_m=0.05, odometry_way=0.08, odometry_turn=0.06, odometry_deg_per_m=2.0, drop_out=0.05, max_range=0.02
    ),
}

Share = Annotated[float, Meta(ge=-1, le=1)]


class StartDrive(
    msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True, tag="start", tag_field="do"
):
    """Place a robot; ``driver`` is "you", or the name of an explorer or of one of the server's policies."""

    plan: Annotated[str, Meta(min_length=1, max_length=300)]
    driver: Annotated[str, Meta(max_length=300)] = YOU
    range_m: Annotated[float, Meta(ge=1, le=20)] = 5.0
    fov_deg: Annotated[float, Meta(ge=30, le=360)] = 180.0
    noise: Literal["none", "some", "much"] = "none"
    people: Annotated[int, Meta(ge=0, le=20)] = 0
    obstacles: Annotated[int, Meta(ge=0, le=20)] = 0
    speed: Literal["slow", "normal", "fast"] = "normal"
    seed: Annotated[int, Meta(ge=0, lt=2**32)] = 0

    @property
    def config(self) -> SimulatorConfig:
        """The simulation: for a person, a step takes one frame; for an explorer, steps are those of the benchmark."""
        common = SimulatorConfig(
            laser=LaserConfig(range_m=self.range_m, fov_deg=self.fov_deg),
            noise=_NOISE[self.noise],
            people=PeopleConfig(self.people),
            obstacles=ObstaclesConfig(
                random=RandomObstacles((self.obstacles, self.obstacles)) if self.obstacles else None
            ),
            max_steps=MAX_STEPS,
        )
        if self.driver != YOU:
            return common
        way, turn = _SPEEDS[self.speed]
        robot = replace(common.robot, step_m=way / FRAMES_PER_S, turn_deg=turn / FRAMES_PER_S)
        return replace(common, robot=robot, step_s=1 / FRAMES_PER_S)


class MoveRobot(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="move", tag_field="do"):
    """Move until the next message, at shares of the full speed, forward and to the left."""

    linear: Share
    angular: Share


class SetPace(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="pace", tag_field="do"):
    """Set the steps per second of an explorer; 0 is a pause."""

    steps_per_s: Annotated[float, Meta(ge=0, le=MOST_STEPS_PER_S)]


class FrameDrawn(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="seen", tag_field="do"):
    """The browser has drawn this frame."""

    number: Annotated[int, Meta(ge=0, lt=2**32)]


class SendPathAndMap(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="save", tag_field="do"):
    """Send the path and the map."""


class FinishDrive(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="finish", tag_field="do"):
    """End the drive and send its results."""


Message: TypeAlias = StartDrive | MoveRobot | SetPace | FrameDrawn | SendPathAndMap | FinishDrive


def decode_message(text: str) -> Message:
    """Decode a message; raise ConfigError if it is not one."""
    if len(text) > LONGEST_MESSAGE:
        raise ConfigError(f"message: expected at most {LONGEST_MESSAGE} characters, found {len(text)}")
    try:
        found: Message = msgspec.json.decode(text, type=Message)
    except msgspec.DecodeError as error:
        raise ConfigError(f"message: {error}") from None
    return found
