"""Read people's corrections of single houses from ``overrides.toml``, one table for each id, and apply them.

A build reads up to two such files. One is named by ``--overrides``, or else lies beside the manifest. The other lies in
the data set itself; reviews write to it. If the two contradict each other, the one in the data set takes precedence,
because its author saw the result of the other.

::

    [villa_L1]
    keep = true            # keep the plan, even if it is a duplicate or a rule rejects it
    door = [[2.0, 3.1], [2.0, 4.0]]   # a door, from jamb to jamb; for several, a list of these
    no_room = [5.5, 1.0]   # the region around this point is no room; for several, a list of these
    [fair_hall]
    drop = true
    why = "an exhibition hall"
    [old_barn]
    h_g = 0.4              # cut at these heights, metres above the floor
    h_d = 1.1
    [doll_house]           # of a whole file, under the id that the file has without a level
    scale = 20.0           # the model is 1:20
    drop_nodes = ["Lamp*", "Car"]     # leave these nodes, groups and materials out

Points are in metres along the source's plan axes, after units and scale: (X, Y) of a z-up source, (X, Z) of a y-up one.
A plan's ``frame`` converts to them. They remain valid when a plan changes. ``houseexpo inspect`` writes these
coordinates on the edges of its picture of the evidence.
"""

from __future__ import annotations

import difflib
import json
import logging
import math
import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, TypeVar

import numpy as np
import shapely
from shapely import LineString

from houseexpo.configuration import config_from_mapping, name_in_config_errors, read_toml
from houseexpo.dataset.manifest import is_bundled_manifest
from houseexpo.dataset.store.folders import overrides_path
from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import plan_points_from_source
from houseexpo.plan import Frame
from houseexpo.plan.overrides import LISTS, NAME, override_values
from houseexpo.tolerances import MIN_DOOR_M
from pipeline.config import PipelineConfig
from pipeline.config_file import convert_to_type
from pipeline.sources import OVERRIDABLE
from pipeline.values import Input, Level, SourceOpening

Point = tuple[float, float]
Segment = tuple[Point, Point]

_T = TypeVar("_T")
_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class Override:
    """The corrections of one id. Points are in metres along the source's plan axes; ``why`` is a note for people."""

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
        """Whether an override concerns a whole file rather than one of its levels."""
        return self.scale is not None or bool(self.drop_nodes)

    def apply_to(self, config: PipelineConfig) -> PipelineConfig:
        """Return the configuration with the heights given, and without the rule that a person overrules by keep."""
        ground = config.planes.ground_m if self.h_g is None else self.h_g
        door = config.planes.door_m if self.h_d is None else self.h_d
        planes = replace(config.planes, ground_m=ground, door_m=door)
        return replace(
            config, planes=planes, layout=replace(config.layout, characters=config.layout.characters and not self.keep)
        )


def find_overrides_file(manifest: Path) -> Path | None:
    """Return the overrides beside a manifest, ``houses.overrides.toml`` for ``houses.toml``; else ``NAME``.

    A folder may hold several manifests, and an id that belongs to no input of a build is an error. A manifest that
    comes with the project has its own overrides or None, so nobody's decisions go into the installed package.
    """
    own = manifest.with_name(f"{manifest.stem}.{NAME}")
    if own.exists():
        return own
    return None if is_bundled_manifest(manifest) else manifest.with_name(NAME)


def load_overrides(
    manifest: Path | None, file: Path | None = None, data_set: Path | None = None
) -> Mapping[str, Override]:
    """Read the corrections by id; return none if there is no file.

    Parameters
    ----------
    manifest
        The overrides beside it are read, unless ``file`` is given.
    file
        A file of overrides, which must exist.
    data_set
        The folder of a data set; the overrides in it are read as well, and take precedence.

    Raises
    ------
    ConfigError
        A file cannot be read, a key is unknown, a value has the wrong type or is out of range, two values contradict
        each other, or the file in the data set is a link.
    """
    named = file or (None if manifest is None else find_overrides_file(manifest))
    if named is not None and (file is not None or named.exists()):
        first = _read(named)
    else:
        named, first = None, {}
    own = overrides_path(data_set) if data_set is not None and data_set.is_dir() else None
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


_FORMS: Final = {"door": "[[x, y], [x, y]], or a list of these,", "no_room": "[x, y], or a list of these,"}


def _has_depth(value: Any, depth: int) -> bool:
    """Return whether a value is a point, a pair of numbers (depth 1), or a pair of what has one depth less."""
    if depth == 0:
        return isinstance(value, int | float) and not isinstance(value, bool)
    return isinstance(value, list) and len(value) == 2 and all(_has_depth(part, depth - 1) for part in value)


def _override(name: str, table: Any, path: Path) -> Override:
    if isinstance(table, Mapping):
        table = {key: override_values(value, key) if key in LISTS else value for key, value in table.items()}
        for key in sorted(LISTS.keys() & table.keys()):
            if not (isinstance(table[key], list) and all(_has_depth(value, LISTS[key]) for value in table[key])):
                raise ConfigError(f"{path}: {name}.{key}: expected {_FORMS[key]} in metres, found {table[key]!r}")
    with name_in_config_errors(path):
        override = config_from_mapping(Override, table, name, convert=convert_to_type)
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


# Apply overrides: find the inputs that they belong to, inform the reader, and change the level.
#
# R1  An id in ``overrides.toml`` is that of an input, or of a building (``_B2``) or a level (``_L1``) of one; eight
#     digits of a hash may follow.
# R2  ``scale`` and ``drop_nodes`` concern a whole file: they stand under the input's own id, and its reader must take
#     them.
# R3  A door and a point that a person gives are taken from the source's plan axes into the level's.
# R4  Doors and points under the id of a building belong to its level. An id that no level has is refused once the
#     levels are known.


DOOR_DEPTH_M: Final = 0.4
"""How deep a door is taken to be that a person gives as a line: through most walls, and into no room behind."""

ANSWERS_M: Final = 0.5
FAR_M: Final = 10.0

_BUILDING: Final = re.compile(r"_B\d+(?=_|$)")
_DIGITS: Final = re.compile(r"_[0-9a-f]{8}$")
_OF_AN_INPUT: Final = re.compile(r"(_B\d+)?(_L\d+)?(_[0-9a-f]{8})?")


def check_override_ids(overrides: Mapping[str, Override], inputs: Iterable[Input]) -> None:
    """Refuse overrides whose id no house has.

    Raises
    ------
    ConfigError
        An id belongs to no house; the message names the nearest one.
    """
    ids = [item.id for item in inputs]
    known = set(ids)
    for name in overrides:
        if known.isdisjoint(_inputs_of(name)):
            near = difflib.get_close_matches(name, ids, n=1, cutoff=0.0)
            hint = f"did you mean {near[0]!r}?" if near else "the build has no inputs"
            raise ConfigError(f"corrections: {name}: expected an id of this build, found no such input; {hint}")


def overrides_by_input(overrides: Mapping[str, Override]) -> Mapping[str, Mapping[str, Override]]:
    """Return the overrides of each input, by the input's id."""
    found: dict[str, dict[str, Override]] = {}
    for name in sorted(overrides):
        for known in _inputs_of(name):
            found.setdefault(known, {})[name] = overrides[name]
    return found


def correct_input(item: Input, overrides: Mapping[str, Override]) -> Input:
    """Return the input with the overrides that its reader needs, added as options.

    Raises
    ------
    ConfigError
        The overrides break R2.
    """
    own = {name: override for name, override in overrides.items() if override.of_file and is_id_of_input(name, item.id)}
    for name in own:
        if name != item.id:
            raise ConfigError(
                f"corrections: {name}: scale and drop_nodes are of a whole file; put them under [{item.id}]"
            )
    if not own:
        return item
    override = own[item.id]
    told = {"scale": override.scale and repr(override.scale), "drop_nodes": _patterns(override)}
    options = {key: value for key, value in told.items() if value}
    if unknown := sorted(set(options) - set(OVERRIDABLE.get(item.reader, ()))):
        raise ConfigError(f"corrections: {item.id}: its reader, {item.reader}, takes no {unknown[0]}; take it out")
    return replace(item, options=tuple(sorted({**dict(item.options), **options}.items())))


def override_for_level(level_id: str, overrides: Mapping[str, Override]) -> Override:
    """Return the override of a level, with the doors and points given for its buildings (R4)."""
    own = overrides.get(level_id, Override())
    parts = [overrides[name] for name in sorted(overrides) if name != level_id and level_id_from(name) == level_id]
    doors = (each for part in parts for each in part.door)
    points = (each for part in parts for each in part.no_room)
    return replace(own, door=(*own.door, *doors), no_room=(*own.no_room, *points))


def level_id_from(name: str) -> str:
    """Return the id of the level to which an id of a level or of a building belongs."""
    return _BUILDING.sub("", name)


def ids_without_level(overrides: Mapping[str, Override], levels: Collection[str]) -> list[str]:
    """Return the overridden ids of an input that belong to none of its levels."""
    found = []
    for name in sorted(overrides):
        of_level = replace(overrides[name], scale=None, drop_nodes=(), why="") != Override()
        known = {level_id_from(name), _DIGITS.sub("", level_id_from(name))} & set(levels)
        if of_level and not known:
            found.append(name)
    return found


def correct_level(level: Level, override: Override) -> Level:
    """Return the level with the doors and no-room points of an override added (R3)."""
    doors = tuple(
        SourceOpening(
            LineString([_at(level.frame, end) for end in segment]).buffer(DOOR_DEPTH_M / 2, cap_style="flat"),
            has_door=True,
        )
        for segment in override.door
    )
    no_rooms = tuple(_at(level.frame, point) for point in override.no_room)
    return replace(level, openings=(*level.openings, *doors), no_rooms=(*level.no_rooms, *no_rooms))


def corrections_without_effect(override: Override, plans: Iterable[FloorPlan]) -> list[str]:
    """Return the doors and points of an override that had no effect on the level's plans.

    A door had an effect if the plan has a door within ``ANSWERS_M`` of its middle. A no-room point had none if a room
    still contains it, or if it is far from the house (``FAR_M``).
    """
    placed = [plan for plan in plans if plan.frame is not None]
    if not placed:
        return []
    found = []
    for segment in override.door:
        ends = [[_at(plan.frame, end) for end in segment] for plan in placed if plan.frame is not None]
        middles = [LineString(line).centroid for line in ends]
        if not any(
            door.polygon.distance(middle) <= ANSWERS_M
            for plan, middle in zip(placed, middles, strict=True)
            for door in plan.doors
        ):
            found.append(f"door {[list(end) for end in segment]}: the plan has no door there; is it in a wall?")
    for point in override.no_room:
        places = [shapely.Point(_at(plan.frame, point)) for plan in placed if plan.frame is not None]
        inside = any(
            room.polygon.contains(place) for plan, place in zip(placed, places, strict=True) for room in plan.rooms
        )
        if inside:
            found.append(f"no_room {list(point)}: a room still holds this point")
        elif min(plan.outline.distance(place) for plan, place in zip(placed, places, strict=True)) > FAR_M:
            found.append(f"no_room {list(point)}: it lies more than {FAR_M:g} m from the house")
    return found


def is_id_of_input(name: str, known: str) -> bool:
    """Return whether a name is the id of this input, or of one of its levels or buildings (R1)."""
    return name.startswith(known) and _OF_AN_INPUT.fullmatch(name, len(known)) is not None


def _inputs_of(name: str) -> list[str]:
    """Return the ids of all inputs that a name concerns, whether there are such inputs or not."""
    starts = [name[: mark.start()] for mark in re.finditer("_", name)]
    return [known for known in (*starts, name) if is_id_of_input(name, known)]


def _patterns(override: Override) -> str:
    return json.dumps(override.drop_nodes) if override.drop_nodes else ""


def _at(frame: Frame, point: Point) -> Point:
    x, y = plan_points_from_source(frame, np.array(point)).tolist()
    return x, y
