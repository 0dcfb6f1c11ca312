"""Apply overrides: find the inputs that they belong to, inform the reader, and change the level.

R1  An id in ``overrides.toml`` is an input's, or that of a building (``_B2``) or a level (``_L1``) of one; eight digits
    of a hash may follow.
R2  ``scale`` and ``drop_nodes`` concern a whole file: they stand under the input's own id, and its reader must take
    them.
R3  A door and a point that a person gives are taken from the source's plan axes into the level's.
R4  Doors and points under the id of a building are of its level. What stands under an id that no level has is refused,
    once the levels are known.
"""

from __future__ import annotations

import difflib
import json
import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace
from typing import Final

import numpy as np
import shapely
from shapely import LineString

from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import plan_from_source
from houseexpo.plan import Frame
from houseexpo.plan.overrides import NAME
from pipeline.overrides import Override, Point
from pipeline.sources import OVERRIDABLE
from pipeline.values import Input, Level, SourceOpening

DOOR_DEPTH_M: Final = 0.4
"""How deep a door is taken to be that a person gives as a line: through most walls, and into no room behind."""

ANSWERS_M: Final = 0.5
FAR_M: Final = 10.0

_BUILDING: Final = re.compile(r"_B\d+(?=_|$)")
_DIGITS: Final = re.compile(r"_[0-9a-f]{8}$")
_OF_AN_INPUT: Final = re.compile(r"(_B\d+)?(_L\d+)?(_[0-9a-f]{8})?")


def check_ids(overrides: Mapping[str, Override], inputs: Iterable[Input]) -> None:
    """Refuse overrides whose id no house has.

    Raises
    ------
    ConfigError
        It names the nearest id that there is.
    """
    ids = [item.id for item in inputs]
    known = set(ids)
    for name in overrides:
        if known.isdisjoint(_inputs_of(name)):
            near = difflib.get_close_matches(name, ids, n=1, cutoff=0.0)
            hint = f"did you mean {near[0]!r}?" if near else "the build has no inputs"
            raise ConfigError(f"{NAME}: {name}: expected an id of this build, found no such input; {hint}")


def by_input(overrides: Mapping[str, Override]) -> Mapping[str, Mapping[str, Override]]:
    """Return the overrides of each input, by its id: thousands of houses do not look through thousands of overrides."""
    found: dict[str, dict[str, Override]] = {}
    for name in sorted(overrides):
        for known in _inputs_of(name):
            found.setdefault(known, {})[name] = overrides[name]
    return found


def corrected_input(item: Input, overrides: Mapping[str, Override]) -> Input:
    """Return the input with the overrides that its reader needs, as options.

    Raises
    ------
    ConfigError
        R2 is not kept.
    """
    own = {name: override for name, override in overrides.items() if override.of_file and concerns(name, item.id)}
    for name in own:
        if name != item.id:
            raise ConfigError(f"{NAME}: {name}: scale and drop_nodes are of a whole file; put them under [{item.id}]")
    if not own:
        return item
    override = own[item.id]
    told = {"scale": override.scale and repr(override.scale), "drop_nodes": _patterns(override)}
    options = {key: value for key, value in told.items() if value}
    if unknown := sorted(set(options) - set(OVERRIDABLE.get(item.reader, ()))):
        raise ConfigError(f"{NAME}: {item.id}: its reader, {item.reader}, takes no {unknown[0]}; take it out")
    return replace(item, options=tuple(sorted({**dict(item.options), **options}.items())))


def word_on(level_id: str, overrides: Mapping[str, Override]) -> Override:
    """Return the override of a level, with the doors and points given for its buildings (R4)."""
    own = overrides.get(level_id, Override())
    parts = [overrides[name] for name in sorted(overrides) if name != level_id and level_of(name) == level_id]
    doors = (each for part in parts for each in part.door)
    points = (each for part in parts for each in part.no_room)
    return replace(own, door=(*own.door, *doors), no_room=(*own.no_room, *points))


def level_of(name: str) -> str:
    """Return the id of the level of which this is the id, or that of a building."""
    return _BUILDING.sub("", name)


def without_level(overrides: Mapping[str, Override], levels: Collection[str]) -> list[str]:
    """Return the overridden ids of an input that no level of it has."""
    found = []
    for name in sorted(overrides):
        of_level = replace(overrides[name], scale=None, drop_nodes=(), why="") != Override()
        known = {level_of(name), _DIGITS.sub("", level_of(name))} & set(levels)
        if of_level and not known:
            found.append(name)
    return found


def corrected_level(level: Level, override: Override) -> Level:
    """Return the level with the doors and no-room points of an override (R3)."""
    doors = tuple(
        SourceOpening(
            LineString([_at(level.frame, end) for end in segment]).buffer(DOOR_DEPTH_M / 2, cap_style="flat"),
            has_door=True,
        )
        for segment in override.door
    )
    no_rooms = tuple(_at(level.frame, point) for point in override.no_room)
    return replace(level, openings=(*level.openings, *doors), no_rooms=(*level.no_rooms, *no_rooms))


def without_effect(override: Override, plans: Iterable[FloorPlan]) -> list[str]:
    """Return the doors and points of an override that matched nothing in the level's plans.

    A door answers where the plan has one within ``ANSWERS_M`` of its middle. A point of no room does not where a room
    still holds it, or where it lies far from the house (``FAR_M``).
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


def concerns(name: str, known: str) -> bool:
    """Whether a name is that of this input, or of a level or building of it (R1)."""
    return name.startswith(known) and _OF_AN_INPUT.fullmatch(name, len(known)) is not None


def _inputs_of(name: str) -> list[str]:
    """Return the ids of all inputs that a name concerns, whether there are such inputs or not."""
    starts = [name[: mark.start()] for mark in re.finditer("_", name)]
    return [known for known in (*starts, name) if concerns(name, known)]


def _patterns(override: Override) -> str:
    return json.dumps(override.drop_nodes) if override.drop_nodes else ""


def _at(frame: Frame, point: Point) -> Point:
    x, y = plan_from_source(frame, np.array(point)).tolist()
    return x, y
