"""What a person decided otherwise: ``overrides.toml`` beside a manifest, one table for each id.

::

    [villa_L1]
    keep = true            # neither a rule that stands for a person nor a duplicate drops it
    [fair_hall]
    drop = true
    why = "an exhibition hall"
    [old_barn]
    h_g = 0.4              # cut at these heights, metres above the floor
    h_d = 1.1
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from houseexpo.errors import ConfigError
from pipeline.config import PipelineConfig
from pipeline.config_file import fill, load_toml

NAME = "overrides.toml"


@dataclass(frozen=True)
class Override:
    """A person's word on one id; ``why`` is for people."""

    keep: bool = False
    drop: bool = False
    h_g: float | None = None
    h_d: float | None = None
    why: str = ""

    def applied(self, config: PipelineConfig) -> PipelineConfig:
        """Return the configuration with the heights given, and without the rule that a person overrules by keep."""
        ground = config.planes.ground_m if self.h_g is None else self.h_g
        door = config.planes.door_m if self.h_d is None else self.h_d
        planes = replace(config.planes, ground_m=ground, door_m=door)
        return replace(
            config, planes=planes, layout=replace(config.layout, characters=config.layout.characters and not self.keep)
        )


def load_overrides(manifest: Path | None) -> Mapping[str, Override]:
    """Read the overrides beside a manifest, by id; none where there is no such file.

    Raises
    ------
    ConfigError
        Where a key is unknown, a value of the wrong type, or two of them contradict each other.
    """
    path = None if manifest is None else manifest.with_name(NAME)
    if path is None or not path.exists():
        return {}
    return {name: _override(name, table, path) for name, table in sorted(load_toml(path).items())}


def _override(name: str, table: object, path: Path) -> Override:
    override = fill(Override, table, path, name)
    if override.keep and override.drop:
        raise ConfigError(f"{path}: {name}: expected keep or drop, found both; take one out")
    if override.h_g is not None and override.h_d is not None and override.h_d <= override.h_g:
        raise ConfigError(f"{path}: {name}: expected h_d above h_g, found {override.h_d:g} and {override.h_g:g}")
    return override
