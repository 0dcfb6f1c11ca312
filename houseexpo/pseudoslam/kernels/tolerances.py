"""Define the simulator's fixed numbers, tolerances and other thresholds, each with its unit and its reason.

There are three kinds. *Numerics* absorb rounding and change nothing that can be seen. *Dimensions* have a source: a
paper, the robot's geometry, or a measurement on the published plans. *Decisions* could be different; another value
gives another robot, but no wrong one. What a user configures is in ``config``; sizes of buffers, blocks and files are
beside the code that they serve. Kernels are compiled again when this file changes, as for any of their files.
"""

from __future__ import annotations

import math

# Numerics

TOUCH_PX = 1e-9
"""Pixels by which a disc may overlap a square because of rounding."""
REST_PX = 1e-6
"""Pixels before contact at which a disc stops, so that it does not touch after rounding."""
CORNER_PX = 1e-9
"""Distance along a beam, pixels, within which crossing both borders of a cell counts as crossing its corner."""
EDGE_RAD = 1e-9
"""Radians by which the fan is widened, so that rounding does not exclude cells on its edge."""
GAP_RAD = 1e-8
"""Angle between two directions, radians, below which there is nothing between them."""
GRAZE_PX = 1e-9
"""Pixels by which a line to a cell's centre may graze an obstacle's corner."""
GRAZE_SLOPE = 1e-6
"""Amount by which the slopes of lines through a window are widened, since a line may graze a corner."""
WINDOW_HALF_PX = 0.5 + 1e-6
"""Pixels from a cell's centre to slightly beyond its border, so that a line that grazes a window's corner meets it."""
FREE_HALF_PX = 0.5 - 1e-6
"""Half the side of a cell, pixels, slightly reduced: nothing can be between a standing cell and cells this close."""
STRIP_PX = 1e-4
"""Pixels to either side of a line that must be free, since a line that grazes a corner may be hidden in a scan."""
EDGE_TIE_PX = 1e-7
"""Pixels within which a centre counts as being on a shape's edge; sides on the 1 cm grid run through centres."""
THIN_SHARE = 1.0 - 1e-6
"""Factor on a thin shape's outline, so that one that only touches a cell's side does not cross the cell."""
WHOLE_PX = 1e-9
"""Pixels by which a pixel of a picture may be wider than a whole number of cells."""
ALIGNED = 1e-9
"""Radians off its target below which the robot looks at it, and pixels below which it is at a cell of its path."""
WALL_EPS_PX = 1e-6
"""Pixels by which a clearance may be below its limit because of rounding."""

PARALLEL_SINE = 1e-9
"""The sine of the angle between two half-planes of velocities below which they are parallel."""

# Dimensions

BETWEEN_M, BETWEEN_DEG = 0.3, 10.0
"""The largest distance between two scans during a step (section III-B: a map is built at each sub-pose)."""
PUSH_M_S2, PUSH_M = 7.0, 0.3
"""The social force of another person: V0 / sigma in m/s2, and sigma in metres (Helbing and Molnar, 1995)."""
NEXT_STEP_S = 1.0
"""Duration of another person's next step, seconds, as in that paper."""
BEHIND_SHARE, BEHIND_DEG = 0.5, 100.0
"""The weight of forces from more than this angle off the direction, degrees, as in that paper."""
FASTEST_SHARE = 1.3
"""The highest speed of a person as a multiple of the desired speed, as in that paper."""
NO_PUSH_M = 1.5
"""Distance beyond which the force of a person is less than 1%, metres: it is left out."""
GAIN_PER_M = 0.2
"""The factor exp(-0.2) of an explorer's gain for each metre of the path (Gonzalez-Banos and Latombe, 2002)."""
BEYOND_M = 10.0
"""Metres added to the path when the gain of each metre is computed, since a frontier leads on. With 2 and 5 m, less is
seen of made floors of offices."""
OFF_CENTRE_PX = 1.5
"""Pixels from the robot within which a line need not be in standing cells, since it need not be at a cell's centre."""
BESIDE_CELLS = 3
"""Cells around the robot, no more than its radius, among which its distance to the goal is looked up, likewise."""
SPARE_PX = 1.5
"""Pixels around a cell that an explorer gave up in which no cell is a frontier: its eight neighbours."""

# Decisions: how the robot goes

ARRIVED_PX = 0.5
"""Pixels from the end of a path at which the robot has arrived."""
SHORTEST_STEP_PX = 0.5
"""Pixels that a step towards a cell of the path must be able to go, or the robot aims at another cell."""
AIM_M = 1.5
"""How far ahead on its path the robot aims, metres."""
LEAST_GAIN_PX = 0.5
"""Pixels by which a step must reduce the distance to the goal."""
ENOUGH = 0.95
"""A step with this share of the best progress is taken if it needs fewer turns: 18 degrees cost 5% of the way."""
ENOUGH_GOING = 0.7
"""The same for a robot that turns while it goes, whose course is right a few steps later: chosen by the area of 800
steps in 50 plans of the train list: 0.85 has 0.15 points less, 0.5 has 0.1 less."""
TURN_PARTS = 4
"""Parts of a turn of 10 degrees; a robot that turns while it goes takes some, and its course errs by 1.25 degrees."""
GOAL_LINE_M = 20.0
"""Longest straight part of a path to a goal between two corners, metres: longer than most houses. In a hall, a longer
one passes corners beside it, which lengthens it by much less than 1%."""
FOLLOWED_M = 0.4
"""Largest distance between the robot's rim and the wall that the policy ``wall`` follows, metres."""
ARC_RAD = math.pi / 6
"""The angle between two steps of the circle in which that policy looks for the wall again, radians."""

LOOK_ROUND_M = 0.12
"""Length of the unknown cells in sight for which an explorer turns round, metres: three cells at 25 px/m."""

# Decisions: which frontier it chooses

LARGE_M = 0.4
"""Frontiers of this length, metres, come before shorter ones."""
NEAR_GOAL_M = 1.0
"""Distance from a frontier, metres, within which goals are tried before all others that see it."""
MAX_FRONTIERS, MAX_BUMPS = 64, 4
"""The number of frontiers that an explorer considers, and how often it may be blocked on its way to one."""
MOST_LINES = 32
"""Largest number of standing cells whose lines to a frontier's middle are checked."""
FEATURE_FAR_M, FEATURE_BOX_M, FEATURE_RINGS_M, FEATURE_BESIDE_M = 10.0, 5.0, (1.0, 2.5), 3.0
"""Metres: the unit of long features of frontiers, the half sides of boxes around one, and the distance of those beside
it. The published weights of choosers belong to these values."""
FEATURE_BEAMS, FEATURE_SAMPLES_PER_M = 32, 4
"""Directions in which unknown cells are counted from a place, and samples per metre of a box, likewise."""
LATTICE_M, MAX_PLACES, PLACE_CELLS = 0.5, 600, 4
"""The oracle's places: their distance in metres, their largest number, and the cells that each must add to the view."""
TOUR_AGAIN_M, SERVED_SHARE = 1.0, 0.99
"""Metres after which the oracle plans its tour again, and the share of a place's purpose that counts as fulfilled."""

# Decisions: how drives are followed

SAGITTA_PX = 0.05
"""Largest distance of an arc of the robot's path from the chord along which collisions are looked for, pixels: a
twentieth of a cell."""
SLICE_S = 0.05
"""Longest time for which a velocity that changes is taken as its mean, seconds: the period of a controller at 20 Hz."""

# Decisions: how people walk

SUBSTEP_S = 0.1
"""Longest time for which forces are taken as constant, seconds."""
FEELERS, FEELER_RINGS_M = 12, (0.07, 0.2)
"""The directions in which a person feels walls, and the distances of the feelers from the person's rim, metres."""
WALL_PUSH_M_S2, WALL_PUSH_M = 6.0, 0.15
"""The acceleration at a wall, m/s2, and the distance over which it falls to 37%, metres."""
HORIZON_S, WALL_HORIZON_S = 2.0, 0.3
"""How far ahead people by ORCA avoid each other and walls, seconds: two steps of both, and three of ``SUBSTEP_S``."""
LOOK_AHEAD_BLOCKS = 2
"""Blocks of its path that a person looks ahead."""
ROAMED_M, TIMEOUT_S = 0.5, 3.0
"""Who stays within this distance for so long, or up to twice as long, gives up the goal: metres, seconds."""
PATH_BLOCK_M = 0.2
"""Side of the blocks of people's paths, metres: a door has several."""
SWEEP_PX = 0.5
"""Largest distance of a body's fastest point between two samples of its track, pixels."""

# Decisions: how often something is tried

PERSON_TRIES, START_TRIES, GOAL_TRIES, OBSTACLE_TRIES, OBSTACLE_ROUNDS = 64, 200, 200, 100, 3
"""Draws of a place for a person, for the robot, for its goal and for an obstacle, and rounds in which all obstacles are
drawn."""
