"""Write what a review has found out about real houses as labels, which ``research.weights_fit`` reads.

R1  A house that was kept is right as it is corrected: all of its rooms and ways are, and what of the uncorrected plan
    is gone is wrong. Spaces that it leaves out are no rooms.
R2  Of a house that was corrected and not kept, only what the corrections changed or named is told.
R3  A room that is gone is ``unlike`` where rooms of the corrected plan take most of it: it is several rooms, or a part
    of one. Otherwise it is none. A way is told by its middle. A cut is no evidence of a way.
R4  Nothing is told of a house that was dropped: nobody said which part of it is wrong.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
import shapely
from shapely import Polygon

from houseexpo.dataset.storey_labels import Place, Space, StoreyLabels
from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import source_points_from_plan
from houseexpo.plan import Frame
from houseexpo.service.collection import Collection
from houseexpo.service.review.session import Review
from houseexpo.service.review.sources import SourceView

_ALIKE_SHARE: Final = 0.9
"""Rooms with this share of their union in common are one."""
_MOST_OF_ROOM: Final = 0.5
_NEAR_WAY_M: Final = 0.35
"""Passages nearer to each other are one, metres: as where a passage is found of a drawn truth."""


def review_labels(collection: Collection) -> Iterator[StoreyLabels | str]:
    """Yield the labels of each reviewed storey, or a sentence why there are none of it, by id.

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
        told = review.told(view.plan, review.decisions.table(name), view).plan
        yield labels_of(view, told, is_kept="keep" in actions)


def labels_of(view: SourceView, told: FloorPlan, *, is_kept: bool) -> StoreyLabels:
    """Return what the corrected plan of a storey tells of it (R1 to R3)."""
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
        left = [_in_source(base, space.shape) for space in view.spaces]
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
    return StoreyLabels(
        file=view.record.id,
        level=frame.level,
        extent=view.level.extent,
        rooms=_spaces(now if is_kept else [*new, *(each for each in said if not _is_among(each, new))]),
        unlike=_spaces(unlike),
        no_rooms=_spaces(no_rooms),
        ways=sorted(ways if is_kept else spoken),
        no_ways=sorted(place for place in old if not _is_near(place, kept)),
        path=view.record.path,
    )


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
    return any(np.hypot(place[0] - x, place[1] - y) <= _NEAR_WAY_M for x, y in places)


def _is_among(room: Polygon, rooms: Sequence[Polygon]) -> bool:
    return any(room.intersection(other).area > _ALIKE_SHARE * room.union(other).area for other in rooms)


def _spaces(shapes: Sequence[Polygon]) -> list[Space]:
    points = [shape.representative_point() for shape in shapes]
    found = [
        (round(point.x, 2) + 0.0, round(point.y, 2) + 0.0, round(shape.area, 2))
        for point, shape in zip(points, shapes, strict=True)
    ]
    return sorted(found, key=lambda each: (-each[2], each))
