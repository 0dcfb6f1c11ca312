"""List the measures of a plan, or of its rooms or doors, in one table: name, unit, texts, and the function of each.

The index of a data set, its statistics, its release and its service take names, units, texts and numbers from
``MEASURES``. Measures of rooms and doors are None, or empty, for a plan that records no rooms (a published one); such a
plan is not counted. ``houseexpo.inference.with_rooms`` finds rooms and doors. *Rooms* are the rooms of the plan;
``source_rooms`` is the number that its source states (``room_num`` in the plan's JSON).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from houseexpo.analysis.audit import lit_rooms
from houseexpo.analysis.navigability import navigability
from houseexpo.plan import Navigability, NavigabilityByRadius, PlanData
from houseexpo.tolerances import ROBOT_M

_SUFFIXES: Final = {"m²": "_m2", "m": "_m"}


@dataclass(frozen=True)
class Measure:
    """A measure and everything that tables and pages say about it.

    Parameters
    ----------
    name
        Its name in addresses and options; ``key`` adds the unit.
    title
        Its heading on pages.
    of
        The function that measures a plan. It returns None if the plan lacks the measured parts, and a sequence if each
        room or door has a number.
    unit
        "m²", "m", or "" for counts and shares.
    step
        The precision to which numbers are stored.
    bin_width
        The width of a histogram's bins.
    column
        Its column in the index of a data set, "" without a column.
    about
        One sentence that describes the measure.
    is_of_robot
        Whether it depends on a robot's radius; ``of`` measures for ``ROBOT_M``.
    """

    name: str
    title: str
    of: Callable[[PlanData], float | Sequence[float] | None]
    unit: str = ""
    step: float = 1.0
    bin_width: float = 1.0
    column: str = ""
    about: str = ""
    is_of_robot: bool = False

    @property
    def key(self) -> str:
        """The name with the unit, as in ``stats.json``: ``area_m2``."""
        return self.name + _SUFFIXES.get(self.unit, "")

    @property
    def is_count(self) -> bool:
        """Whether the numbers are whole."""
        return self.step == 1.0

    def numbers(self, plan: PlanData) -> Sequence[float]:
        """Return the numbers of a plan; the list is empty if the plan lacks the measured parts."""
        found = self.of(plan)
        if found is None:
            return ()
        return (found,) if isinstance(found, int | float) else found


def label_counts(plan: PlanData) -> Counter[str]:
    """Return the number of rooms of each label; for a plan without rooms, the number of label boxes."""
    if plan.rooms:
        return Counter(room.label for room in plan.rooms)
    return Counter({label: len(boxes) for label, boxes in plan.room_category.items()})


def door_kind_counts(plan: PlanData) -> Counter[str]:
    """Return the number of doors of each kind."""
    return Counter(door.kind for door in plan.doors)


def navigability_by_radius(plan: PlanData) -> NavigabilityByRadius:
    """Return the navigability by radius: as the plan records it, otherwise measured."""
    return plan.navigability or navigability(plan)


def _rooms(plan: PlanData) -> int | None:
    return len(plan.rooms) or None


def _source_rooms(plan: PlanData) -> int:
    return plan.room_num


def _label_boxes(plan: PlanData) -> int:
    return sum(map(len, plan.room_category.values()))


def _area(plan: PlanData) -> float:
    return plan.area


def _width(plan: PlanData) -> float:
    x1, _, x2, _ = plan.bbox
    return x2 - x1


def _height(plan: PlanData) -> float:
    _, y1, _, y2 = plan.bbox
    return y2 - y1


def _long_side(plan: PlanData) -> float:
    return max(_width(plan), _height(plan))


def _short_side(plan: PlanData) -> float:
    return min(_width(plan), _height(plan))


def _vertices(plan: PlanData) -> int:
    return len(plan.verts) + sum(map(len, plan.holes))


def _holes(plan: PlanData) -> int:
    return len(plan.holes)


def _quality(plan: PlanData) -> float | None:
    return None if plan.quality is None else plan.quality.score


def _furniture(plan: PlanData) -> int | None:
    return len(plan.furniture) or None


def _doors(plan: PlanData) -> int | None:
    return len(plan.doors) if plan.rooms else None


def _cuts(plan: PlanData) -> int | None:
    return door_kind_counts(plan)["cut"] if plan.rooms else None


def _door_widths(plan: PlanData) -> list[float]:
    return [door.width for door in plan.doors]


def _room_areas(plan: PlanData) -> list[float]:
    return [room.area for room in plan.rooms]


def _doors_per_room(plan: PlanData) -> list[int]:
    """Return the number of doors of each room, entrances included."""
    if not plan.rooms:
        return []
    ends = Counter(room for door in plan.doors for room in door.rooms)
    return [ends[room.id] for room in plan.rooms]


def _room_windows(plan: PlanData) -> list[int]:
    """Return the number of windows of each habitable room, if the plan has windows."""
    count = Counter(room for window in plan.windows for room in window.rooms)
    return [count[room] for room in lit_rooms(plan)]


def _lit_share(plan: PlanData) -> float | None:
    lit = lit_rooms(plan)
    return sum(lit.values()) / len(lit) if lit else None


def _neighbours(plan: PlanData) -> list[int]:
    """Return the number of other rooms that the doors of each room lead to: its degree."""
    return [len(others) for others in _rooms_beside(plan).values()]


def _loops(plan: PlanData) -> int | None:
    """Return the number of independent cycles: doors minus rooms plus connected components."""
    if not plan.rooms:
        return None
    beside, found, pieces = _rooms_beside(plan), set[int](), 0
    for room in beside:
        if room not in found:
            found.update(_steps_from([room], beside))
            pieces += 1
    return sum(None not in door.rooms for door in plan.doors) - len(beside) + pieces


def _depth(plan: PlanData) -> int | None:
    """Return the number of doors between the entrance and the farthest room, None if the entrance is unknown.

    The entrance is a door of kind "entrance" or, since published outlines hide those, a room labelled Entryway. Rooms
    that cannot be reached do not count.
    """
    entered = [room for door in plan.doors if None in door.rooms for room in door.rooms if room is not None]
    starts = entered or [room.id for room in plan.rooms if room.label == "Entryway"]
    return max(_steps_from(starts, _rooms_beside(plan)).values(), default=None)


def _rooms_beside(plan: PlanData) -> dict[int, set[int]]:
    """Return for each room the other rooms that its doors lead to."""
    found: dict[int, set[int]] = {room.id: set() for room in plan.rooms}
    for one, other in (door.rooms for door in plan.doors):
        if one is not None and other is not None and one != other:
            found[one].add(other)
            found[other].add(one)
    return found


def _steps_from(starts: Sequence[int], beside: Mapping[int, set[int]]) -> dict[int, int]:
    """Return each room that can be reached from some rooms, and through how many doors at least."""
    found, ahead = dict.fromkeys(starts, 0), list(starts)
    for room in ahead:
        fresh = [other for other in beside[room] if other not in found]
        found.update(dict.fromkeys(fresh, found[room] + 1))
        ahead += fresh
    return found


def _reach_of_robot(plan: PlanData) -> Navigability:
    return (plan.navigability or navigability(plan, (ROBOT_M,)))(ROBOT_M)


def _narrowest_passage(plan: PlanData) -> float:
    return _reach_of_robot(plan).narrowest


def _reachable_share(plan: PlanData) -> float:
    return _reach_of_robot(plan).largest_share


MEASURES: Final = (
    Measure("rooms", "Rooms", _rooms, column="rooms", about="Rooms that the plan has."),
    Measure(
        *("source_rooms", "Rooms in the source", _source_rooms),
        column="source_rooms",
        about="As the source counts them, including unlabelled ones; if it counts none, those that were found.",
    ),
    Measure(
        *("area", "Free area", _area, "m²", 0.01, 20.0),
        column="area",
        about="Floor inside the walls, without obstacles.",
    ),
    Measure("width", "Width", _width, "m", 0.01, 1.0, column="width", about="Extent along x."),
    Measure("height", "Height", _height, "m", 0.01, 1.0, column="height", about="Extent along y."),
    Measure("long_side", "Longer side", _long_side, "m", 0.01, 1.0, about="Of the bounding box."),
    Measure("short_side", "Shorter side", _short_side, "m", 0.01, 1.0, about="Of the bounding box."),
    Measure("vertices", "Vertices", _vertices, bin_width=20.0, about="Corners of the outline and of the holes."),
    Measure("holes", "Holes", _holes, about="Free-standing walls and pillars inside the outline."),
    Measure("label_boxes", "Label boxes", _label_boxes, about="A room may have several labels."),
    Measure("room_area", "Room area", _room_areas, "m²", 0.01, 2.0, about="Of each room."),
    Measure("furniture", "Furniture", _furniture, about="Pieces, in a plan that records some."),
    Measure(
        *("quality", "Quality", _quality, "", 0.01, 0.05),
        column="quality",
        about="The pipeline's confidence in the plan, 0 to 1.",
    ),
    Measure("doors", "Doors", _doors, column="doors", about="Doors of all kinds."),
    Measure("cuts", "Cuts", _cuts, column="cuts", about="Doors that were cut so that a robot can pass."),
    Measure("door_width", "Door width", _door_widths, "m", 0.01, 0.1, about="Clear width, from jamb to jamb."),
    Measure("doors_per_room", "Doors of a room", _doors_per_room, about="A door between two rooms counts for both."),
    Measure("degree", "Neighbours of a room", _neighbours, about="Other rooms that its doors lead to: the degree."),
    Measure("loops", "Loops", _loops, about="Independent cycles of rooms and doors; 0 for a tree."),
    Measure("depth", "Depth from the entrance", _depth, about="Doors between the entrance and the farthest room."),
    Measure("room_windows", "Windows of a room", _room_windows, about="Of habitable rooms, in a plan with windows."),
    Measure(
        *("lit", "Rooms with daylight", _lit_share, "", 0.01, 0.05),
        about="Share of the habitable rooms of a plan with windows that have daylight (houseexpo stats --audit).",
    ),
    Measure(
        *("narrowest", "Narrowest passage", _narrowest_passage, "m", 0.01, 0.1),
        about="Width of the narrowest passage that a robot has to use.",
        is_of_robot=True,
    ),
    Measure(
        *("reach", "Reached by a robot", _reachable_share, "", 0.01, 0.05),
        about="Share of its floor that a robot can reach.",
        is_of_robot=True,
    ),
)
"""All measures."""

BY_NAME: Final = {measure.name: measure for measure in MEASURES}
