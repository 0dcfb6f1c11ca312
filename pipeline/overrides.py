"""What people decided about single houses: ``overrides.toml``, with one table for each id.

A build reads up to two such files: the one that ``--overrides`` names, or else the one beside the manifest; and the one
in the data set itself, to which reviews write. Where they contradict each other, the data set's own counts: who wrote
it saw what the other file had led to.

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

import logging
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from houseexpo.configuration import config_from, of_file, read_toml
from houseexpo.dataset.manifest import is_bundled
from houseexpo.dataset.store.folders import overrides_file
from houseexpo.errors import ConfigError
from houseexpo.plan.overrides import LISTS, NAME, as_list
from houseexpo.tolerances import MIN_DOOR_M
from pipeline.config import PipelineConfig
from pipeline.config_file import checked

Point = tuple[float, float]
Segment = tuple[Point, Point]

_T = TypeVar("_T")
_LOG = logging.getLogger(__name__)


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


def load_overrides(
    manifest: Path | None, file: Path | None = None, data_set: Path | None = None
) -> Mapping[str, Override]:
    """Read what people decided, by id, or nothing if there is no file.

    Parameters
    ----------
    manifest
        The overrides beside it are read, unless ``file`` is given.
    file
        A file of overrides; it has to be there.
    data_set
        The folder of a data set; the overrides in it are read as well, and come first.

    Raises
    ------
    ConfigError
        A file cannot be read, a key is unknown, a value has the wrong type or is out of range, two values contradict
        each other, or the file in the data set is a link.
    """
    named = file or (None if manifest is None else beside(manifest))
    if named is not None and (file is not None or named.exists()):
        first = _read(named)
    else:
        named, first = None, {}
    own = overrides_file(data_set) if data_set is not None and data_set.is_dir() else None
    if own is None or (named is not None and own.exists() and own.samefile(named)):
        return first
    if own.is_symlink():
        raise ConfigError(f"{own}: expected a file, found a link, which is not followed; name it with --overrides")
    second = _read(own) if own.is_file() else {}
    for name in sorted(set(first) & set(second)):
        if (first[name].keep, first[name].drop) == (second[name].drop, second[name].keep) != (False, False):
            said = "drop" if second[name].drop else "keep"
            _LOG.warning("%s: %s and %s contradict each other; %s counts: %s", name, named, own, own, said)
    return {
        name: _both(first.get(name, Override()), second.get(name, Override())) for name in sorted({*first, *second})
    }


def _read(path: Path) -> Mapping[str, Override]:
    return {name: _override(name, table, path) for name, table in sorted(read_toml(path).items())}


def _both(first: Override, second: Override) -> Override:
    """Return what two files say of one id; the second counts where they contradict each other."""
    decided = second if second.keep or second.drop else first
    heights = second if second.h_g is not None or second.h_d is not None else first
    return Override(
        keep=decided.keep,
        drop=decided.drop,
        h_g=heights.h_g,
        h_d=heights.h_d,
        door=_each_once(first.door, second.door),
        no_room=_each_once(first.no_room, second.no_room),
        scale=first.scale if second.scale is None else second.scale,
        drop_nodes=_each_once(first.drop_nodes, second.drop_nodes),
        why=second.why or first.why,
    )


def _each_once(first: tuple[_T, ...], second: tuple[_T, ...]) -> tuple[_T, ...]:
    return tuple(dict.fromkeys((*first, *second)))


def _override(name: str, table: Any, path: Path) -> Override:
    if isinstance(table, Mapping):
        table = {key: as_list(value, key) if key in LISTS else value for key, value in table.items()}
    with of_file(path):
        override = config_from(Override, table, name, convert=checked)
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
