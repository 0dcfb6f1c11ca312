"""What a person decided otherwise: ``overrides.toml`` beside a manifest, or ``--overrides``, one table for each id.

::

    [villa_L1]
    keep = true            # neither a rule that stands for a person nor a duplicate drops it
    door = [[2.0, 3.1], [2.0, 4.0]]   # there is a door, from jamb to jamb; several: a list of these
    no_room = [5.5, 1.0]   # the region that holds this point is no room; several: a list of these
    [fair_hall]
    drop = true
    why = "an exhibition hall"
    [old_barn]
    h_g = 0.4              # cut at these heights, metres above the floor
    h_d = 1.1
    [doll_house]           # of a whole file, under the id that the file has without a level
    scale = 20.0           # the model is 1:20
    drop_nodes = ["Lamp*", "Car"]     # leave these nodes, groups and materials out

Points are metres in the source's plan axes, to which a plan's ``frame`` leads: (X, Y) of a z-up source, (X, Z) of a
y-up one, after units and scale. They stay what they are when a plan changes. ``houseexpo inspect`` writes them on the
edges of its picture of the evidence.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from houseexpo.dataset.manifest import is_bundled
from houseexpo.errors import ConfigError
from houseexpo.plan.overrides import LISTS, MIN_DOOR_M, NAME, as_list
from pipeline.config import PipelineConfig
from pipeline.config_file import fill, load_toml

Point = tuple[float, float]
Segment = tuple[Point, Point]


@dataclass(frozen=True)
class Override:
    """A person's word on one id; points in metres of the source's plan axes, ``why`` is for people."""

    keep: bool = False
    drop: bool = False
    h_g: float | None = None
    h_d: float | None = None
    door: tuple[Segment, ...] = ()
    no_room: tuple[Point, ...] = ()
    scale: float | None = None
    drop_nodes: tuple[str, ...] = ()
    why: str = ""

    @property
    def of_file(self) -> bool:
        """Whether it says something that concerns a whole file, not one of its levels."""
        return self.scale is not None or bool(self.drop_nodes)

    def applied(self, config: PipelineConfig) -> PipelineConfig:
        """Return the configuration with the heights given, and without the rule that a person overrules by keep."""
        ground = config.planes.ground_m if self.h_g is None else self.h_g
        door = config.planes.door_m if self.h_d is None else self.h_d
        planes = replace(config.planes, ground_m=ground, door_m=door)
        return replace(
            config, planes=planes, layout=replace(config.layout, characters=config.layout.characters and not self.keep)
        )


def beside(manifest: Path) -> Path | None:
    """Return a manifest's own overrides, ``houses.overrides.toml`` for ``houses.toml``; where there are none, ``NAME``.

    A folder may hold several manifests, and an id that is of none of a build's inputs is an error. A manifest that
    comes with the project has its own overrides or None: nobody's decisions go into the installed package.
    """
    own = manifest.with_name(f"{manifest.stem}.{NAME}")
    if own.exists():
        return own
    return None if is_bundled(manifest) else manifest.with_name(NAME)


def load_overrides(manifest: Path | None, file: Path | None = None) -> Mapping[str, Override]:
    """Read the overrides of ``file``, else those beside a manifest, by id; none where neither is there.

    Raises
    ------
    ConfigError
        Where ``file`` cannot be read, a key is unknown, a value of the wrong type or out of range, or two of them
        contradict each other.
    """
    path = file or (None if manifest is None else beside(manifest))
    if path is None or (file is None and not path.exists()):
        return {}
    return {name: _override(name, table, path) for name, table in sorted(load_toml(path).items())}


def _override(name: str, table: Any, path: Path) -> Override:
    if isinstance(table, Mapping):
        table = {key: as_list(value, key) if key in LISTS else value for key, value in table.items()}
    override = fill(Override, table, path, name)
    place = f"{path}: {name}"
    if override.keep and override.drop:
        raise ConfigError(f"{place}: expected keep or drop, found both; take one out")
    if override.h_g is not None and override.h_d is not None and override.h_d <= override.h_g:
        raise ConfigError(f"{place}: expected h_d above h_g, found {override.h_d:g} and {override.h_g:g}")
    if override.scale == 0:
        raise ConfigError(f"{place}: scale: expected more than 0, found 0")
    points = [*override.no_room, *(end for segment in override.door for end in segment)]
    if not all(math.isfinite(number) for point in points for number in point):
        raise ConfigError(f"{place}: expected finite metres in door and no_room, found {points}")
    for segment in override.door:
        if math.dist(*segment) < MIN_DOOR_M:
            ends = [list(end) for end in segment]
            raise ConfigError(f"{place}: door: expected jambs {MIN_DOOR_M} m apart or more, found {ends}")
    return override
