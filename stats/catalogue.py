"""The measures of a summary, in one table: their names, units, steps and texts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from houseexpo.floorplan import FloorPlan
from stats import measures


@dataclass(frozen=True)
class Measure:
    """A number for a plan, or for each of its rooms or doors.

    ``step`` is the precision to which numbers are stored, ``bin_width`` the width of the histogram's bins.
    """

    name: str
    title: str
    of: Callable[[FloorPlan], float | Sequence[float] | None]
    unit: str = ""
    step: float = 1.0
    bin_width: float = 1.0
    about: str = ""

    def numbers(self, plan: FloorPlan) -> Sequence[float]:
        """Return the numbers of a plan, none if it has nothing to measure."""
        found = self.of(plan)
        if found is None:
            return ()
        return (found,) if isinstance(found, int | float) else found


MEASURES: tuple[Measure, ...] = (
    Measure("rooms", "Rooms in a house", measures.rooms, about="As the source counts them, unlabelled ones included."),
    Measure(
        *("area_m2", "Free area", measures.area_m2, "m²", 0.01, 20.0),
        about="Floor inside the walls; furniture is not taken out.",
    ),
    Measure(
        *("long_side_m", "Longer side", measures.long_side_m, "m", 0.01, 1.0),
        about="Of the box around the plan.",
    ),
    Measure(
        *("short_side_m", "Shorter side", measures.short_side_m, "m", 0.01, 1.0),
        about="Of the box around the plan.",
    ),
    Measure("vertices", "Vertices", measures.vertices, bin_width=20, about="Corners of the outline and of the holes."),
    Measure("holes", "Holes", measures.holes, about="Walls and pillars that stand free inside the outline."),
    Measure("label_boxes", "Label boxes", measures.label_boxes, about="One room may carry several labels."),
    Measure("rooms_found", "Room polygons", measures.rooms_found, about="Rooms that the plan has as geometry."),
    Measure(
        *("room_area_m2", "Room area", measures.room_areas_m2, "m²", 0.01, 2.0),
        about="Of every room.",
    ),
    Measure("furniture", "Furniture", measures.furniture, about="Pieces in a plan that records some."),
    Measure(
        *("quality", "Quality", measures.quality, "", 0.01, 0.05),
        about="How sure the pipeline is of a plan, 0 to 1.",
    ),
    Measure("doors", "Doors in a house", measures.doors, about="Of every kind."),
    Measure(
        *("door_width_m", "Door width", measures.door_widths_m, "m", 0.01, 0.1),
        about="Clear, from jamb to jamb.",
    ),
    Measure(
        "doors_per_room", "Doors of a room", measures.doors_per_room, about="A door between two rooms counts for both."
    ),
    Measure("degree", "Neighbours of a room", measures.neighbours, about="Other rooms that a door leads to: degree."),
    Measure("loops", "Loops", measures.loops, about="Independent ways round the house; 0 where it is a tree."),
    Measure("depth", "Depth from the entrance", measures.depth, about="Doors to pass on the way to the last room."),
)
BY_NAME = {measure.name: measure for measure in MEASURES}
