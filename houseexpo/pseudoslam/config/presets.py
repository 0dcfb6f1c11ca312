"""Named presets of laser and view, beyond the paper's 180 degrees and 5 m."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config.simulator import SimulatorConfig


@dataclass(frozen=True)
class Preset:
    """The laser's range and field of view, and the size of the views of the map in metres and pixels.

    Observations with several scales show the far and the whole map; ``dict`` observations also show the whole map.
    """

    range_m: float
    fov_deg: float
    size_m: float
    pixels: int | None
    far_size_m: float
    global_size_m: float


PRESETS: Final = {
    "paper": Preset(5.0, 180.0, size_m=4.0, pixels=None, far_size_m=16.0, global_size_m=32.0),
    "view-10m": Preset(5.0, 180.0, size_m=10.0, pixels=64, far_size_m=20.0, global_size_m=32.0),
    "round-10m": Preset(10.0, 360.0, size_m=20.0, pixels=80, far_size_m=40.0, global_size_m=48.0),
    "round-20m": Preset(20.0, 360.0, size_m=40.0, pixels=80, far_size_m=60.0, global_size_m=80.0),
}
"""The presets by name: the paper's; its laser with a view of everything that it can see; and lasers that see in all
directions, as is usual today, with views of their full range."""


def with_preset(name: str, config: SimulatorConfig) -> SimulatorConfig:
    """Return a configuration with the laser and the view of a preset.

    Raises
    ------
    ConfigError
        There is no preset of that name.

    Examples
    --------
    >>> with_preset("round-10m", SimulatorConfig()).laser.fov_deg
    360.0
    """
    if name not in PRESETS:
        raise ConfigError(f"config: expected a SimulatorConfig or one of {', '.join(PRESETS)}; found {name!r}")
    preset = PRESETS[name]
    laser = replace(config.laser, range_m=preset.range_m, fov_deg=preset.fov_deg)
    view = replace(
        config.observation,
        size_m=preset.size_m,
        pixels=preset.pixels,
        far_size_m=preset.far_size_m,
        global_size_m=preset.global_size_m,
    )
    return replace(config, laser=laser, observation=view)
