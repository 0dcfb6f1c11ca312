"""The numbers that several rules of ``geometry`` and ``stages`` share, in three kinds, each with its unit and reason.

Names end in the unit: ``_M`` metres, ``_M2`` square metres; shares and cosines have none. What only one rule knows
stands beside that rule. What a build may choose is in ``config.py``. ``python -m research.threshold_effects`` moves
each number alone and counts the houses that change.
"""

from __future__ import annotations

import math
from typing import Final

# Numerics: below these, a difference comes from rounding and means nothing.

OVERLAY_GRID_M: Final = 1e-6  # the grid of an overlay that fails without one
HAIR_M: Final = 1e-5  # areas that share an edge are grown by this, so that rounding leaves no crack between them
POINT_M: Final = 1e-4  # corners of a mesh and ends of segments that are closer are one point, as exports write them
MM_M: Final = 1e-3  # the grid of footprints and ceilings; shapes closer than this touch
LAP_M: Final = 0.002  # pieces lap so far over what they join; cuts keep so far from the heights of vertices
CM_M: Final = 0.01  # the grid of a plan: what is thinner is not there, and a filling goes so far into its wall

# Dimensions of houses.

CRACK_M: Final = 0.02  # walls that come closer touch; points so far before a face lie in the space that it looks into
STAND_M: Final = 0.03  # what stands within this of the end or the face of a wall stands at it; plaster and skirting
NOISE_M: Final = 0.03  # of a laser scanner and of a depth camera, one standard deviation with the drift of a house
SLIVER_M: Final = 0.04  # thinner than any wall, thicker than a baluster: what is left of two shapes, or a rim
SHEET_M: Final = 0.05  # a board, a leaf, a wall drawn as a sheet; parts that deviate less lie in line
HAND_M: Final = 0.1  # a hand's breadth: a thin partition, a frame, the play of a hinge, what a header hangs down
THIN_WALL_M: Final = 0.15  # a partition of brick: so far beside the end of a wall one sees whether it goes on
RUN_M: Final = 0.3  # a shorter stretch of wall has no direction of its own
WALL_M: Final = 0.38  # one and a half bricks: two faces that are closer are those of one wall; narrower than any door
THICK_WALL_M: Final = 0.6  # the thickest wall of most houses
BLOCK_M: Final = 2.5  # the deepest thing between two rooms: a block of cupboards, a chimney, the gap between houses
FOOT_M: Final = 0.3  # what stands on the floor begins lower, whatever plinth or threshold is under it
SHOULDERS_M: Final = 0.6  # a person's width: what is narrower nobody passes or stands in
STUB_M: Final = 0.5  # a wall that juts out by less is a pilaster; a passage that is shorter is none
SPECK_M2: Final = 0.05  # a smaller area between walls is a crack of them

# Decisions: how near is beside, how much is most.

BESIDE_M: Final = 0.3  # a leaf so near belongs to the doorway, a mouth to its row, a wall to what ends at it
PLACE_M: Final = 0.5  # two cuts, or two parts of one passage, that are closer are in one place
AROUND_M: Final = 1.0  # what is farther away has no influence on a strip, a leaf or a cut
SPECK: Final = 0.02  # a share that comes from rounding
QUARTER: Final = 0.25  # a share that is little: an open edge, a floor that reaches into a room, two widths' difference
SOME: Final = 0.3  # a share from which two things have to do with each other
STANDS: Final = 0.4  # a share from which something is seen although a part of it is hidden
MOST: Final = 0.5  # a share that is more than half
LARGELY: Final = 0.7  # a share that leaves room for what is missing in every drawing
MOSTLY: Final = 0.8  # a share that leaves room for a door or two
NEARLY_ALL: Final = 0.9  # a share that leaves room for rounded corners
TWICE: Final = 2.0  # a wall is so many times longer than thick; what is so many times deeper is another thing
IN_ONE_LINE: Final = math.cos(math.radians(4.0))  # cosine of the angle between parts of one line, drawn by hand
