"""Hold the numbers that rules of ``geometry`` and ``stages`` share: numerics, dimensions of houses, decisions.

Names end in the unit: ``_M`` metres, ``_M2`` square metres; shares and cosines have none. What only one rule knows
stands beside that rule. What a build may choose is in ``config.py``. ``python -m research.threshold_effects`` moves
each number alone and counts the houses that change.
"""

from __future__ import annotations

import math
from typing import Final

from houseexpo import tolerances

# Numerics: below these, a difference comes from rounding and means nothing.

OVERLAY_GRID_M: Final = tolerances.SAME_M  # the grid of an overlay that fails without one
SAME: Final = 1e-6  # numbers that differ by less are equal: shares, sines, metres; a smaller area is left over
HAIR_M: Final = 1e-5  # areas that share an edge are grown by this, so that rounding leaves no crack between them
POINT_M: Final = tolerances.WELD_M  # corners of a mesh and ends of segments that are closer are one point
MM_M: Final = 1e-3  # the grid of footprints and ceilings; shapes closer than this touch
LAP_M: Final = 0.002  # pieces lap so far over what they join; cuts keep so far from the heights of vertices
HALF_CM_M: Final = 0.005  # rounding to the grid of a plan: slits are closed, and cuts shifted, by as much
CM_M: Final = tolerances.GRID_M  # what is thinner is not in a plan; a filling goes so far into its wall
TINY_M2: Final = 1e-3  # a smaller area is left over from a cut, and no robot stands in it
BLUR_PX: Final = 5  # cells that a scan's masks are smoothed over
LOOKS: Final = 5  # places along a thing at which one looks
MANY_FACES: Final = 3_000  # a scan has more; of a body with more the footprint is its convex hull

# Dimensions of houses.

CRACK_M: Final = 0.02  # walls that come closer touch; points so far before a face lie in the space that it looks into
STAND_M: Final = 0.03  # what is so near the face of a wall is at it: plaster, skirting, the scatter of a scan
SLIVER_M: Final = 0.04  # thinner than any wall, thicker than a baluster: what is left of two shapes, or a rim
SHEET_M: Final = 0.05  # a board, a leaf, a wall drawn as a sheet; parts that deviate less lie in line
HAND_M: Final = 0.1  # a hand's breadth: a thin partition, a frame, the play of a hinge, what a header hangs down
THIN_WALL_M: Final = 0.15  # a partition of brick: so far beside the end of a wall one sees whether it goes on
PARTITION_M: Final = 0.2  # a wall between two rooms, with plaster; parts of a row have no larger gap
EDGE_BAND_M: Final = 0.2  # so much of a scanned wall is hidden at the floor, or frayed at its top
RUN_M: Final = 0.3  # a shorter stretch of wall has no direction of its own
RAIL_M: Final = 0.3  # a railing or a parapet is thinner, a cupboard deeper
WALL_M: Final = 0.38  # one and a half bricks: faces that are closer are those of one wall; a closet is deeper
PASSABLE_M: Final = 0.45  # nobody walks through less; so much free floor is before a door and behind it
THICK_WALL_M: Final = 0.6  # the thickest wall of most houses
STONE_WALL_M: Final = 1.2  # the thickest wall that a door goes through, in old houses
BLOCK_M: Final = 2.5  # the longest thing between two rooms: a block of cupboards, a chimney, what hides a wall
HOLE_M: Final = 1.4  # the widest hole in a scanned wall that is closed without a trace; straight walls are longer
SINGLE_DOOR_M: Final = (0.5, 1.25)  # the width of a doorway with one leaf, from a toilet's to a hospital's
UNNAMED_WAY_M: Final = 1.5  # a hole in a wall beside named openings is a way; through a wider one two rooms meet
DOORWAY_M: Final = (0.5, 2.5)  # the width of any doorway: ``DoorsConfig.widest_m``
HALL_M: Final = 8.0  # the widest place at which two rooms meet, or that is the open front of one
FOOT_M: Final = 0.3  # what stands on the floor begins lower, whatever plinth or threshold is under it
KNEE_M: Final = 0.5  # an opening that starts higher is a window; a part that starts higher does not stand on the floor
HEAD_M: Final = 1.8  # a person's height, that of a room at least; where lintels begin: ``EvidenceConfig.head_m``
SHOULDERS_M: Final = 0.6  # a person's width: what is narrower nobody passes or stands in
STUB_M: Final = 0.5  # a wall that juts out by less is a pilaster; a passage that is shorter is none
SPECK_M2: Final = 0.05  # a smaller area between walls is a crack of them
PATCH_M2: Final = 0.5  # a smaller face is bedding and not a roof, a smaller part of a floor belongs to its neighbour
ROOMY_M2: Final = 4.0  # a smaller level surface is a landing, a table or a bed, a smaller room has no mouths

# Decisions: how near is beside, how much is most.

BESIDE_M: Final = 0.3  # a leaf so near belongs to the doorway, a mouth to its row, a wall to what ends at it
PLACE_M: Final = 0.5  # two cuts, or two parts of one passage, that are closer are in one place
AROUND_M: Final = 1.0  # what is farther away has no influence on a strip, a leaf or a cut
SPECK: Final = 0.02  # a share that comes from rounding
HARDLY: Final = 0.15  # a share of noise: a place is free, or a shape ragged, with less than this
SOME: Final = 0.3  # a share from which two things have to do with each other
THIRD: Final = 0.35  # a share: about a third; three walls seldom leave more edge free, two walls and their diagonal do
STANDS: Final = 0.4  # a share from which something is seen although a part of it is hidden
MOST: Final = 0.5  # a share that is more than half
LARGELY: Final = 0.7  # a share that leaves room for what every drawing lacks
MOSTLY: Final = 0.8  # a share that leaves room for a door or two
NEARLY_ALL: Final = 0.9  # a share that leaves room for rounded corners
ALMOST_ALL: Final = 0.97  # a share that leaves room for rounding only
PARALLEL: Final = math.cos(math.radians(15.0))  # cosine of the angle between things that run the same way
SKEW: Final = math.sin(math.radians(15.0))  # its sine: what turns by less runs along a wall or square to it
IN_ONE_LINE: Final = math.cos(math.radians(4.0))  # cosine of the angle between parts of one line, drawn by hand
