"""What a house is like, for telling made houses from published ones: both are looked at as published plans are.

A published plan has one ring of pixels and boxes. A made one is brought to that form first (``as_published``), then
rooms and doors of both are found from the outline, so that both are seen through the same glasses.

Outlines are straightened before corners are counted: published ones are contours of pictures, with steps of 1 cm along
oblique walls.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
import shapely

from houseexpo.analysis.measures import BY_NAME, label_counts, navigability_by_radius
from houseexpo.floorplan import FloorPlan
from houseexpo.inference import with_rooms
from houseexpo.plan.room_labels import UNLABELLED

RADII = ("0.10", "0.20", "0.35")
IN_STEPS = ("door_width_m", "narrowest_m")
LEFT_OUT = ("wall_m", "clear_m")
"""Measured for the table of statistics only: `stats` has no such measures."""
PX_PER_M, BORDER_PX = 100, 2
STRAIGHT_M = 0.03
JAMB_M = 0.06
FLANK_M, BAY_M, NOTCH_M = 1.2, 4.0, 1.5
OBLIQUE_RAD, OBLIQUE_M = np.radians(3.0), 0.3
"""A wall is oblique from this angle on; shorter pieces are what a contour of pixels leaves at corners."""


@dataclass(frozen=True)
class Seen:
    """One house: numbers by name, a list for each; label -> rooms; label -> areas of rooms (m2), and their doors."""

    id: str
    numbers: dict[str, list[float]]
    labels: dict[str, int]
    areas: dict[str, list[float]]
    degrees: dict[str, list[int]]


def as_published(plan: FloorPlan) -> FloorPlan:
    """Return the plan in the published form: five keys only, the ring a contour of pixels; what stood free is lost.

    Published rings are contours that OpenCV found at 100 px/m: where a wall ends they cut its corners by a pixel, and
    oblique walls have steps. A published plan comes back as it is.
    """
    pixels = np.round((plan.verts - plan.verts.min(axis=0)) * PX_PER_M).astype(np.int32) + BORDER_PX
    image = np.zeros(pixels.max(axis=0)[::-1] + 1 + BORDER_PX, dtype=np.uint8)
    cv2.fillPoly(image, [pixels], 1)
    found = cv2.findContours(image, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)[-2]
    ring = max(found, key=cv2.contourArea)[:, 0]
    verts = np.round((ring - BORDER_PX) / PX_PER_M + plan.verts.min(axis=0), 2)
    return FloorPlan(plan.id, verts, room_num=plan.room_num, room_category=plan.room_category)


def measure_plan(plan: FloorPlan) -> Seen:
    """Measure a plan that has the published keys."""
    found = with_rooms(plan)
    per_room = _numbers(found, "doors_per_room")
    areas: defaultdict[str, list[float]] = defaultdict(list)
    degrees: defaultdict[str, list[int]] = defaultdict(list)
    for room, degree in zip(found.rooms, per_room, strict=True):
        areas[room.label].append(room.area)
        degrees[room.label].append(int(degree))
    [long], [short] = _numbers(plan, "long_side"), _numbers(plan, "short_side")
    numbers = {
        "area_m2": [plan.area],
        "long_side_m": [long],
        "short_side_m": [short],
        "rooms": [float(plan.room_num)],
        "extent": [plan.area / (long * short)],
        "label_boxes": _numbers(plan, "label_boxes"),
        "rooms_found": [float(len(found.rooms))],
        "unlabelled": [float(sum(room.label == UNLABELLED for room in found.rooms))],
        "room_area_m2": [room.area for room in found.rooms],
        "doors": [float(len(found.doors))],
        "door_width_m": _numbers(found, "door_width"),
        "doors_per_room": per_room,
        "degree": _numbers(found, "degree"),
        "loops": _numbers(found, "loops") or [0.0],
        "depth": _numbers(found, "depth"),
        "wall_m": _walls_m(found),
        "clear_m": _clear_m(found),
        **_reach(plan),
        **outline_numbers(plan),
    }
    return Seen(plan.id, numbers, dict(label_counts(plan)), dict(areas), dict(degrees))


def _numbers(plan: FloorPlan, measure: str) -> list[float]:
    return [float(number) for number in BY_NAME[measure].numbers(plan)]


def _reach(plan: FloorPlan) -> dict[str, list[float]]:
    """Pieces that robots of three radii find, and the narrowest passage of the middle one."""
    found = navigability_by_radius(plan)
    pieces = {f"pieces at {radius} m": [float(found[radius].components)] for radius in RADII}
    return pieces | {"narrowest_m": [found["0.20"].narrowest] if found["0.20"].components else []}


def _walls_m(found: FloorPlan) -> list[float]:
    """Thickness of the walls that doors go through."""
    return [door.polygon.area / max(door.width, 0.1) for door in found.doors]


def _clear_m(found: FloorPlan) -> list[float]:
    """How far the jambs of each door are apart in the middle of the wall, to the centimetre.

    The width of a door, as inference finds it, is up to 2 cm more where the corners of the walls' ends are cut.
    """
    widths = []
    for door in found.doors:
        ends = np.array(door.segment)
        over = (ends[1] - ends[0]) / max(door.width, 0.1) * JAMB_M
        sight = shapely.LineString([ends[0] - over, ends[1] + over])
        parts = shapely.get_parts(shapely.intersection(sight, found.free_space))
        widths.append(round(max(float(part.length) for part in parts), 2))
    return widths


def outline_numbers(plan: FloorPlan) -> dict[str, list[float]]:
    """Corners, share of oblique walls, bays and notches of the straightened outline.

    A bay is a bulge of a room: an edge of up to 4 m with convex corners, flanks of up to 1.2 m that begin at reflex
    ones. A notch is the reverse, a wall of up to 1.5 m that juts into a room.
    """
    corners, oblique, total, bays, notches = 0, 0.0, 0.0, 0, 0
    for part in shapely.get_parts(shapely.orient_polygons(shapely.simplify(plan.free_space, STRAIGHT_M))):
        for ring in (part.exterior, *part.interiors):
            points = shapely.get_coordinates(ring)[:-1]
            step = np.roll(points, -1, axis=0) - points
            length, heading = np.hypot(*step.T), np.arctan2(step[:, 1], step[:, 0])
            off = np.abs((heading + np.pi / 4) % (np.pi / 2) - np.pi / 4)
            corners += len(points)
            oblique += float(length[(off > OBLIQUE_RAD) & (length >= OBLIQUE_M)].sum())
            total += float(length.sum())
            bulges = _bulges(length, heading)
            bays += int((bulges[0] & (length <= BAY_M)).sum())
            notches += int((bulges[1] & (length <= NOTCH_M)).sum())
    return {
        "corners": [float(corners)],
        "oblique_share": [oblique / total],
        "bays": [float(bays)],
        "notches": [float(notches)],
    }


def _bulges(length: npt.NDArray[np.float64], heading: npt.NDArray[np.float64]) -> npt.NDArray[np.bool_]:
    """Tell which edges are tips of bulges outward (row 0) and inward (row 1)."""
    turn = (heading - np.roll(heading, 1) + np.pi) % (2 * np.pi) - np.pi  # at an edge's start
    short = (np.roll(length, 1) <= FLANK_M) & (np.roll(length, -1) <= FLANK_M)
    before, start, end, after = np.roll(turn, 1), turn, np.roll(turn, -1), np.roll(turn, -2)
    out = short & (before < 0) & (start > 0) & (end > 0) & (after < 0)
    into = short & (before > 0) & (start < 0) & (end < 0) & (after > 0)
    return np.stack([out, into])


def features(houses: list[Seen], step_m: float = 0.0) -> tuple[npt.NDArray[np.float64], list[str]]:
    """Return one row a house for a classifier, and the columns' names: numbers, of lists their spread, labels.

    With ``step_m`` widths are rounded to it, and corners to even numbers: a contour of pixels has jogs of 1 cm.
    """
    words = sorted({word for house in houses for word in house.labels})
    names: list[str] = []
    columns = []
    for name in (name for name in houses[0].numbers if name not in LEFT_OUT):
        lists = [_round_to_step(name, house.numbers[name], step_m) for house in houses]
        if max(map(len, lists)) <= 1:
            names.append(name)
            columns.append([row[0] if row else np.nan for row in lists])
            continue
        for word, of in (("mean", np.mean), ("least", np.min), ("most", np.max), ("spread", np.std)):
            names.append(f"{name}, {word}")
            columns.append([float(of(row)) if row else np.nan for row in lists])
    for word in words:
        names.append(f"label {word}")
        columns.append([house.labels.get(word, 0) for house in houses])
    return np.array(columns, dtype=np.float64).T, names


def _round_to_step(name: str, values: list[float], step_m: float) -> list[float]:
    if step_m and name in IN_STEPS:
        return [round(value / step_m) * step_m for value in values]
    return [value // 2 * 2 for value in values] if step_m and name == "corners" else values


def pooled_labels(houses: list[Seen]) -> Counter[str]:
    """Count the labels of all houses."""
    counts: Counter[str] = Counter()
    for house in houses:
        counts.update(house.labels)
    return counts
