"""Write the findings of a review about real houses as labels, which ``houseexpo fit`` reads.

R1  A kept house is right as corrected: all its rooms and passages exist, those that only the uncorrected plan has do
    not exist, and the spaces that it leaves out are not rooms, unless they are rooms of another building of the level.
R2  For a house that was corrected but not kept, labels cover only the parts that corrections changed or named.
R3  A removed room is labelled ``unlike`` if rooms of the corrected plan cover most of it: it is several rooms, or a
    part of one. Otherwise it is labelled as no room. A passage is labelled at its middle. A cut is no evidence of a
    passage.
R4  A plan was right as built if it was kept and no correction changed its rooms or passages, and not right if one did.
R5  A dropped house gives no labels: nobody said which part of it is wrong.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
import shapely
from shapely import Polygon

from houseexpo.dataset.storey_labels import NEAR_WAY_M, Place, Space, StoreyLabels
from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan, decode
from houseexpo.grids.frame import source_points_from_plan
from houseexpo.plan import Frame
from houseexpo.service.collection import Collection
from houseexpo.service.review.session import Review
from houseexpo.service.review.sources import SourceView

_ALIKE_SHARE: Final = 0.9
"""Two rooms that share at least this part of their union are the same room."""
_MOST_OF_ROOM: Final = 0.5


def review_labels(collection: Collection) -> Iterator[StoreyLabels | str]:
    """Yield the labels of each reviewed storey, in the order of ids, or a sentence that says why it has no labels.

    Raises
    ------
    ConfigError
        ``overrides.toml`` or its log cannot be read.
    """
    review = Review(collection)
    for name, judged in sorted(review.decisions.by_plan().items()):
        actions = set(judged.actions)
        if "drop" in actions or not actions - {"note", "file"}:
            continue
        try:
            view = review.source(name, wait=True)
        except ConfigError as error:
            yield str(error)
            continue
        if view is None or view.plan is None:
            yield f"{name}: it is no plan, so nothing is known of its parts"
            continue
        told = review.told(view.plan, review.said_of(name), view).plan
        yield labels_of(view, told, is_kept="keep" in actions)


def labels_of(view: SourceView, told: FloorPlan, *, is_kept: bool) -> StoreyLabels:
    """Return the labels of a storey, given its corrected plan (R1 to R3)."""
    base = told if view.plan is None or view.is_founded else view.plan
    frame, now = _frame(base), [_in_source(told, room.polygon) for room in told.rooms]
    before = [_in_source(base, room.polygon) for room in base.rooms]
    gone = [room for room in before if not _is_among(room, now)]
    new = [room for room in now if not _is_among(room, before)]
    said = [shape for room, shape in zip(told.rooms, now, strict=True) if room.confidence == 1.0]
    all_now = shapely.union_all(now)
    unlike = [room for room in gone if room.intersection(all_now).area > _MOST_OF_ROOM * room.area]
    no_rooms = [room for room in gone if not room.intersection(all_now).area > _MOST_OF_ROOM * room.area]
    if is_kept:
        beside = shapely.union_all(list(_rooms_of_other_buildings(view)))
        left = [_in_source(base, space.shape) for space in view.spaces]
        left = [space for space in left if not space.intersection(beside).area > _MOST_OF_ROOM * space.area]
        no_rooms += [
            s for s in left if s.intersection(all_now).area < (1 - _ALIKE_SHARE) * s.area and not _is_among(s, no_rooms)
        ]
    ways = [_middle(told, door.segment) for door in told.doors if door.kind != "cut"]
    old = [_middle(base, door.segment) for door in base.doors]
    spoken = [
        _middle(told, door.segment)
        for door in told.doors
        if door.kind != "cut" and (door.confidence == 1.0 or not _is_near(_middle(told, door.segment), old))
    ]
    kept = [_middle(told, door.segment) for door in told.doors]
    no_ways = sorted(place for place in old if not _is_near(place, kept))
    is_changed = view.is_founded or bool(gone or new or no_ways) or not all(_is_near(way, old) for way in ways)
    return StoreyLabels(
        file=view.record.id,
        level=frame.level,
        extent=view.level.extent,
        rooms=_spaces(now if is_kept else [*new, *(each for each in said if not _is_among(each, new))]),
        unlike=_spaces(unlike),
        no_rooms=_spaces(no_rooms),
        ways=sorted(ways if is_kept else spoken),
        no_ways=no_ways,
        path=view.record.path,
        reader=view.record.reader,
        key=view.record.key,
        options=dict(view.record.options),
        right=False if is_changed else True if is_kept else None,
    )


def _rooms_of_other_buildings(view: SourceView) -> Iterator[Polygon]:
    """Yield the rooms of the level's other plans: what this plan leaves out of the level may be a room of them."""
    for other in view.level.plans:
        if other is not view.found:
            plan = decode(bytes(other.plan))
            yield from (_in_source(plan, room.polygon) for room in plan.rooms)


def _frame(plan: FloorPlan) -> Frame:
    if plan.frame is None:
        raise ConfigError(f"{plan.id}: its position in the source is not recorded")
    return plan.frame


def _in_source(plan: FloorPlan, shape: Polygon) -> Polygon:
    frame = _frame(plan)
    found: Polygon = shapely.transform(shape, lambda points: source_points_from_plan(frame, points))
    return found


def _middle(plan: FloorPlan, segment: Sequence[Sequence[float]]) -> Place:
    x, y = source_points_from_plan(_frame(plan), np.array(segment).mean(axis=0)[None])[0].round(2).tolist()
    return x + 0.0, y + 0.0


def _is_near(place: Place, places: Sequence[Place]) -> bool:
    return any(np.hypot(place[0] - x, place[1] - y) <= NEAR_WAY_M for x, y in places)


def _is_among(room: Polygon, rooms: Sequence[Polygon]) -> bool:
    return any(room.intersection(other).area > _ALIKE_SHARE * room.union(other).area for other in rooms)


def _spaces(shapes: Sequence[Polygon]) -> list[Space]:
    points = [shape.representative_point() for shape in shapes]
    found = [
        (round(point.x, 2) + 0.0, round(point.y, 2) + 0.0, round(shape.area, 2))
        for point, shape in zip(points, shapes, strict=True)
    ]
    return sorted(found, key=lambda each: (-each[2], each))
