"""Hold the constants of geometry in this package: numerics, dimensions of houses, decisions; each with its unit.

Names end in the unit: ``_M`` metres, ``_M2`` square metres, ``_PX`` cells; shares and cosines have none. Sizes that a
caller can choose, such as the height of walls in an export, are defaults of that function and stand beside it, as do
limits on the size of files. The pipeline and the simulator have files of their own.
"""

from __future__ import annotations

import math
from typing import Final

# Numerics: below these, a difference comes from rounding and means nothing.

GRID_M: Final = 0.01  # coordinates of plans are whole centimetres, in published files and in ours
SAME_M: Final = 1e-6  # lengths and coordinates that differ by less are equal: double precision at 20 km has 4e-12
TINY: Final = 1e-9  # lengths, areas and weights are at least this where something is divided by them
SAME_PX: Final = 1e-6  # sizes in cells that differ by less are equal, so that rounding adds no row
SAME_M2: Final = 1e-6  # a smaller area is a leftover of a Boolean operation on polygons
CRUMB_M2: Final = 1e-4  # in an export, a smaller piece of wall or floor is left over where shapes meet: 1 cm by 1 cm
SLIVER_M2: Final = 1e-7  # a smaller piece of a convex decomposition is a line
WELD_M: Final = 1e-4  # vertices of a mesh that are closer are one: a tenth of a millimetre, as exports write them
TIE_PX: Final = 1e-7  # walls on the grid run through cell centres; this decides on which side of a wall they lie
FINER_GRID: Final = 1e-4  # share by which a grid for comparison is finer, so that no wall runs through cell centres
ROUND: Final = 0.01  # arcs of a buffer are polygons: a passage may appear wider by half this share
SPLIT_M: Final = 0.0025  # precision of the radius at which an area splits: half a centimetre of width
SLACK_M: Final = 0.005  # a shortest path may run along a wall: half of the grid

# Published walls that are oblique have steps of 1 cm. They are straightened before a computation, by at most:

STRAIGHTEN_AREA_M: Final = 0.01  # for areas and meshes: one step; buffering then takes a twentieth of the time
STRAIGHTEN_WALLS_M: Final = 0.012  # for rooms: one step and rounding; the thinnest walls, of 2 cm, remain
STRAIGHTEN_PATH_M: Final = 0.02  # for paths: two steps, so that no step counts as a corner
STRAIGHTEN_LARGE_M: Final = (STRAIGHTEN_PATH_M, 0.05, 0.1, 0.2, 0.4)  # for paths: more if there are too many corners

# Dimensions of houses.

ROBOT_SPECK_M2: Final = 0.1  # a robot's area that is smaller is not counted: it is less than a disc of 18 cm radius
SMALLEST_ROOM_M2: Final = 0.8  # a smaller space is part of the room behind its least likely door
SMALLEST_SAID_ROOM_M2: Final = 0.2  # a closet that a person says is a room: 0.4 m x 0.5 m
TILE_M2: Final = 0.05  # rooms and doors cover the free space up to this area (docs/format.md)
ROUNDED_M2: Final = 0.01  # the area that rounding to the grid moves along a wall
ROBOT_M: Final = 0.20  # the radius of a robot unless another is given; the pipeline connects plans for it
MIN_DOOR_M: Final = 0.3  # a door that is added by hand is at least this wide; a narrower one is a slip of the hand

DOOR_M: Final = (0.4, 2.2)  # the width of doors in outlines: from hatches to double doors
COMMON_DOOR_M: Final = 1.1  # most doors are narrower; wider ones need better evidence
COMMON_OPENING_M: Final = 1.2  # wider openings may be part of one room; most areas also split at a narrower passage
SHALLOW_M: Final = 0.3  # a partition: a narrow passage through it is a door even if little widens behind it
USUAL_DEPTH_M: Final = 0.5  # most walls are thinner; deeper passages need better evidence
DEEPEST_DOOR_M: Final = 0.8  # the thickest wall that a door goes through
SHALLOWEST_DOOR_M: Final = 0.005  # half of the grid: two faces of one wall are at least this far apart

# Decisions of the search for rooms in an outline (``houseexpo.inference``).
# ``tests/benchmarks/test_bench_inference.py`` measures what they find in plans with known rooms.

CORNER: Final = math.sin(math.radians(35.0))  # a wall ends where the outline turns by more
AXIS_STEP_M: Final = 0.025  # an edge that deviates less from an axis is parallel to it, because of steps of 1 cm
INWARD_M: Final = 0.012  # rays start this far inside an opening: along the face itself, they would graze the other side
RAY_START_M: Final = 0.02  # rays start this far past the end of a wall, beyond its steps
FRONT_SNAP_M: Final = 0.08  # the end of a front that is closer to a corner ends there
LOOKS_M: Final = (0.15, 0.3)  # how far in front of a front the width of the space is measured
FRONT_DEPTH_M: Final = 0.4  # the space in front of a front is at least this deep
FARTHEST_LOOK_M: Final = 10.0  # wider spaces are equally wide
FRONTS_FACING: Final = -0.95  # cosine: two fronts face each other within 18 degrees
ASIDE: Final = 0.35  # share of the width by which two fronts may be displaced
WIDER_M: Final = 0.12  # the space on both sides of a door is wider than the door by this
HINT_M: Final = 0.015  # or, on one side of a narrow door, by this: a closet hardly wider than its door
OPEN_ALONE: Final = 0.65  # share of a wall from which one opening joins two rooms
OPEN_ROW: Final = 0.6  # share of a wall from which several openings in a row join two rooms
IN_LINE_M: Final = 0.3  # doors that are displaced less are in one wall
APART_M: Final = 0.02  # candidates for doors that are closer overlap
BEFORE_DOOR_M: Final = 0.03  # a point this far in front of a door lies in the room there
OVERLAP_M: Final = 0.02  # lines across doors extend into walls by this, which straightening may have removed
JAGS_M2: Final = 0.02  # area by which steps of walls may change the area of a door
BOX_FITS: Final = 0.3  # intersection over union from which a label's box is that of a room
BOX_COVERS: Final = 0.8  # share of a room from which a box covers it
BOX_INSIDE: Final = 0.5  # share of a box from which it lies in a room

# Decisions elsewhere.

ENTRANCE_REACH_M: Final = 0.6  # an entrance goes through an outer wall that is drawn up to this thick
ENTRANCE_TOUCH_M: Final = 0.011  # and through parts of it this near to its door: the grid of rings, and rounding
MITRE: Final = 2.0  # limit of mitred corners of walls: right angles keep their corner, acute ones do not extend far
SPLIT_STEP_M: Final = 0.05  # step of radii in the search for a split; smaller parts that appear between are ignored
MAX_CORNERS: Final = (
    800  # corners of a space for one shortest path; more are simplified away, since work grows as their square
)
