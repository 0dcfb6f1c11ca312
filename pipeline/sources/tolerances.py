"""Hold the numbers that readers of houses depend on, each with its unit and reason: tolerances, sizes, thresholds.

Names end in the unit: ``_M`` metres, ``_M2`` square metres, ``_RAD`` radians; shares, cosines, counts and weights
have none. A number that several readers use stands here once; those of the stages that mean the same here stand in
``pipeline.tolerances``. Limits on what is read stand here
where several readers share them. What ``homes`` and ``sound_homes`` draw at random stands there: it describes
the houses that they make, not what is true of houses. The stages have numbers of their own. Those that divide a
robot's map were fitted or chosen together and stand in ``occupancy_map``. What a format gives to a part of which a file
does not say it stands beside the reader of the format.
"""

from __future__ import annotations

import math
from typing import Final

# Numerics: below these, a difference comes from rounding and means nothing.

TINY: Final = 1e-9  # lengths, areas and weights are at least this where something is divided by them
# lengths that differ by less are equal; grid on which areas are united: files have tenths of a millimetre
FILE_GRID_M: Final = 1e-4
UPRIGHT_M2: Final = 1e-8  # a triangle with a smaller area stands upright
LOOP_M2: Final = 1e-4  # a smaller face between the lines of a drawing is a gap between their ends
TURN_RAD: Final = 1e-3  # a smaller turn counts as 0: a wall is not an arc, and two walls are in line
# coordinates beyond this lose tenths of a millimetre in single precision: the level is moved to the origin
FAR_FROM_ORIGIN_M: Final = 500.0
PARALLEL: Final = 0.01  # sine of the angle up to which two lines of a drawing are parallel
EARTH_M: Final = 6_371_008.8  # the mean radius of the Earth (IUGG), for coordinates in degrees

# What is read at most: more is damage or an attack, or takes more memory than a computer has.

LARGEST_BYTES: Final = 1 << 28  # the text of a plan, a scene or a mesh of one, where it is read in whole: 256 MB
LARGEST_TEXT_BYTES: Final = 1 << 26  # the same where each word becomes an object of Python: YAML, worlds
CHUNK_BYTES: Final = 1 << 24  # so much of a longer text is read at a time; a longer line is none
DEEPEST: Final = 100  # how deep documents, nodes, blocks, groups and placements may be nested; deeper is a circle
MOST_PARTS: Final = 1_000_000  # nodes, prims, bodies, entities of a drawing, each counted as often as it is shown
MOST_FILES: Final = 20_000  # files and folders that one scene takes in
LARGEST_GRID: Final = 30_000_000  # cells of a grid, voxels of a cloud
LARGEST_COORDINATE: Final = 1e15  # beyond this a square overflows, or says nothing

# What a house may measure at most. Larger things have another unit, or are no houses.

LONGEST_PLACEMENT_M: Final = 1e6  # an offset or a size in a robot's scene
LONGEST_SITE_M: Final = 2000.0  # a plan of lines and areas: an airport, a campus
LONGEST_LENGTH_M: Final = 1000.0  # a single length in a file
LONGEST_CLOUD_M: Final = 200.0  # from the middle of a cloud of points to its farthest point

# Dimensions of houses. Building codes ask for rooms of 2.1 to 2.5 m and for doors of 1.9 to 2.1 m clear height; where
# no other source is named, the value lies outside of all that was met in the models that tests and benchmarks list.

# passages end higher: doors of old houses and cellars are low, and no window that starts at the knee ends lower
LOWEST_HEAD_M: Final = 1.6
IFC_DOOR_M: Final = (0.9, 2.0, 0.1)  # width, height and depth of an IFC door with neither a body nor a size
DOOR_HEIGHT_M: Final = 2.1  # height of a door of which the file says nothing
# the median width of doors in a plan without a scale: ISO and national series of leaves lie around it
DOOR_WIDTH_M: Final = 0.8
OBJECT_HEIGHT_M: Final = 1.0  # of furniture whose height is not known: more than a robot's laser
NARROWEST_DOOR_M: Final = 0.3  # a narrower line or body is no door
WIDEST_DOOR_BODY_M: Final = 4.0  # a wider body is no door: gates of garages are narrower
SWING_M: Final = (0.4, 2.0)  # radius of the arc that a door's leaf draws
WAIST_M: Final = 1.1  # height at which nothing may stand over a threshold; lower doors of IFC files are hatches
DOOR_SHAPE: Final = (1.5, 4.5)  # height over width of doors that stand upright on an axis
WALL_HEIGHT_M: Final = 2.5  # height of a wall of which the file says nothing
STOREY_HEIGHT_M: Final = 3.0  # from floor to floor where the file only counts its floors
STOREYS_APART_M: Final = 1.5  # floors that lie farther apart in height are two storeys
SPLIT_LEVEL_M: Final = 0.9  # in meshes and IFC files: floors that lie closer are one storey with steps
OFF_FLOOR_M: Final = 0.6  # what lies farther from the elevation of an IFC storey does not belong to its floor
THICKEST_SLAB_M: Final = 0.65  # the thickest slab between two storeys
STOREY_M: Final = (1.9, 6.6)  # a storey of a mesh: cellars to halls
LOWEST_CUT_M: Final = 0.8  # walls that are cut off to show a plan: lower ones are a plinth, a kerb, a fence
CLOUD_STOREY_M: Final = (1.9, 6.0)  # a storey of a cloud of points
COMMON_STOREY_M: Final = (2.2, 3.3)  # a storey of a dwelling, where a scale is chosen
HIGHEST_STOREY_M: Final = 4.5  # the highest storey of a dwelling
MODEL_STOREY_M: Final = (2.1, HIGHEST_STOREY_M)  # a storey of a model to a scale
USUAL_STOREY_M: Final = 2.7  # the usual storey: 2.4 to 2.6 m of room and a slab
HIGHEST_BUILDING_M: Final = 60.0  # a building whose storeys nothing divides
WIDTH_M: Final = (1.5, 200.0)  # the narrower and the longer side of a house
LONGEST_AT_LEAST_M: Final = 2.0  # the longer side of a house, and all its walls, at least
# the length of a house in a drawing without a unit; a stated unit is believed up to ``LONGEST_SITE_M``
DRAWING_M: Final = (2.0, 200.0)
NAMED_DOOR_M: Final = (1.5, 3.2)  # height of the doors that a file names
USUAL_DOOR_M: Final = 2.05  # usual height of such doors
USUAL_HEAD_M: Final = 2.06  # usual height at which openings end: doors of 2.0 to 2.1 m
HEADS_M: Final = (1.8, 2.75)  # heights at which openings end in a file in metres
HIGHEST_LINTEL_M: Final = 3.0  # a beam that starts lower closes an opening
WALL_THICKNESS_M: Final = (0.06, 0.6)  # from a panel to old masonry: walls that are drawn by their two faces
MASSIVE_WALL_M: Final = 1.5  # a drawn wall that is wider, with something in it, is the outline of a house
DEEPEST_WALL_M: Final = 0.7  # an opening goes through no thicker wall; the two faces of a wall are no farther apart
LINE_WALL_M: Final = 0.1  # thickness of a wall that is drawn as a line without one, or not at all: around rooms
DRAWN_SHEET_M: Final = 0.02  # thickness of a wall that is drawn as a sheet, or as a line in a plan with other walls
SWEETHOME_WALL_CM: Final = 7.5  # thickness that Sweet Home 3D gives to a wall without one
ROOMPLAN_WALL_M: Final = 0.06  # thickness of the walls of a RoomPlan scan, which are sheets
USUAL_ROOM_M2: Final = 20.0  # the median of rooms in a plan without a scale; this much area of a slab votes as one door
SHED_M2: Final = 10.0  # a smaller block that stands apart is a shed
HOUSE_M2: Final = 40.0  # this much upright area is a house, however much else was left out
SPACE_HEIGHT_M: Final = (1.8, 12.0)  # height of a body that the source calls a space
CABIN_M: Final = 7.0  # the cabin of a vehicle is shorter

# Decisions about any mesh: what stands, what lies level (``storeys``).

SCARCELY: Final = 0.1  # a share that counts as nothing
FEW: Final = 0.2  # a share that is the smaller part by far
QUARTER: Final = 0.25  # a share from which a part tells of the whole
VERTICAL: Final = 0.2  # vertical part of a wall's unit normal, at most: within 11.5 degrees, as scans lean
HORIZONTAL: Final = 0.985  # vertical part of a floor's unit normal, at least: within 10 degrees
GRID_CELL_M: Final = 0.1  # side of the cells of a grid over a plan
COVER_MARGIN_M: Final = 0.05  # measures over a floor, under a cover, beside a door's ends keep off by so much
MANY_BODY_FACES: Final = 20_000  # more are looked at by cells, or a part of them

# Decisions about floors and levels (``storeys.levels``).

# walls are also cut at this height, since lintels over wide windows stand for the wall there
LINTEL_CUT_M: Final = 2.15
LAYER_HALF_M: Final = 0.06  # half the range of heights in which faces make one level surface: coverings, scans
FLOOR_FACES: Final = (0.1, 0.9)  # shares of a level surface's area that tell its underside and its top
OUTSIDE_SHARE: Final = 0.005  # share of the wall area that may stand outside of the house on each side

# Decisions about the up axis and the unit (``storeys.axis_and_unit``, ``storeys.scale``). Evidence adds up; its unit
# is that of flatness, the logarithm of width over height.

FLATNESS_WEIGHT: Final = 1.5  # for flatness: a house is flatter than it is wide
SQUARE_WEIGHT: Final = 3.0  # for the share of faces that stand upright or lie level
# for a format's usual axis: a house outweighs it that is 1.5 times as deep as high when stood on the other axis
CUSTOM_WEIGHT: Final = 0.9
DECLARED_WEIGHT: Final = 6.0  # for an axis that the file declares
# where a format has no unit: for each e-fold by which the nearest unit's storey differs from the usual one, ...
ODD_STOREY_WEIGHT: Final = 2.0
NO_UNIT_WEIGHT: Final = 3.0  # ... and at most this: one in twenty such models is in no known unit
PLINTH: Final = 0.04  # share of the upright area that the side of the base adds on which a model stands
PROFILE_BINS: Final = 400  # steps of the profile over the whole height
HEAD_GROWTH: Final = 0.03  # share of the usual wall length that a door or two of a house add over their heads
HEADS_AT: Final = (0.5, 0.96)  # shares of a storey's height between which openings end
HEAD_LEVEL: Final = 0.002  # share of the plan: the undersides of a lintel or two
MAX_HEADS: Final = 2  # heights of heads that are looked at
SCALES: Final = (10.0, 15.0, 20.0, 25.0, 50.0, 100.0)  # scales of models
NEAR_HEAD: Final = 0.09  # difference in the logarithm up to which an opening ends at the usual height
SCALED: Final = 0.03  # how much nearer a scaled unit must come than a bare one, in the same measure
SLACK: Final = 6.0  # how much more freely storeys differ than heads

# Decisions about the scale by the sizes of things (``storeys.size_evidence``). Odds are natural logarithms.

SCALES_RANGE: Final = 7.0  # the logarithm of the largest over the smallest scale that is likely at all
SCALE_STEP: Final = 0.02  # steps of the logarithm in which free scales are tried
# how often files without a unit have one of these, as against metres; fewer than one in ten has another unit
UNIT_ODDS: Final = (
    (1.0, 0.0),
    (0.01, -1.0),
    (0.001, -2.0),
    (0.0254, -2.5),
    (0.1, -3.0),
    (0.3048, -3.5),
    (10.0, -3.5),
    (100.0, -4.0),
    (1 / 0.0254, -4.5),  # inches, stated twice
)
FREE_SCALE: Final = 0.5  # how often they have any other scale, as a multiple of metres
LAID_DOWN: Final = 0.5  # how much likelier a unit is that the format lays down
LIKE: Final = 0.12  # difference of the logarithm up to which scales are one answer
CLEARLY: Final = 1.0  # by how much another scale must be likelier
SAME_SIZE: Final = 0.06  # share by which sizes differ at least if they count apart
OPENING: Final = (0.15, 0.9)  # width of an opening as a share of the storey's height
JAMB: Final = (0.012, 0.25)  # thickness of a wall as a share of the storey's height
LINE_TURN: Final = 0.05  # radians: faces of one line, and the two jambs of one opening, differ by less
LINE_WIDE: Final = 0.002  # share of a storey's height: faces of one line lie apart by less

# Decisions on whether there is an inside (``storeys.interior``).

CHEST_AND_HEAD_M: Final = (1.1, 1.7)  # heights at which walls are cut: nearer to the floor other things stand too
SAMPLE_M: Final = 0.2  # distance of sample points along walls
MANY_BLOCKS: Final = 5  # blocks that stand apart and make a city
MAX_SAMPLES: Final = 2_000  # points of an outline, or lines of a drawing, that are looked at
FACES_FACING: Final = 0.7  # cosine of the angle between two faces of one wall; the most that the walls of a scan lean
SKY_HEIGHTS: Final = 3.0  # so many times as high as all in it is the radius of a sky; a dome is lower
STRAY_REACH: Final = 1000.0  # so many times as far as the rest reaches no part of a house, nor the ground around it
INNER_M: Final = 1.5  # length of inner walls in a house, at least
TABLE_M2: Final = 1.0  # area of furniture, at least, that speaks for a room
INNER_SHARE: Final = 0.05  # the same, as a share of the outline's length
INNER_PER_M2: Final = 0.08  # the same, for each square metre; dwellings have 0.2 m and more

# Decisions about names in meshes (``named_scene``).

MIN_DOORS: Final = 2  # named doors that are sure of their height
TERRAIN_BEYOND: Final = 1.15  # a ground this many times as long as the rest is terrain

# Decisions about lines and areas (``vector_plans``).

THICKEST_LINE_M: Final = 2.0  # a thicker wall has no stated thickness
DRAWN_UNITS_M: Final = (0.001, 1.0, 0.01, 0.0254, 0.3048)  # units of a DXF file that states none, the likeliest first

# Decisions about IFC files (``ifc``, ``rooms_and_openings``).

SLABS_M: Final = (1.0, 0.3)  # slabs this far under and over a floor are steps of it, or its structure
STOREY_WALLS_M: Final = 4.0  # a storey without spaces has walls of this length at least

# Decisions about scenes of robots, Sweet Home 3D and RoomPlan.

ROUND_SIDES: Final = 24  # sides of a round body
SLOPE_STEPS: Final = 40  # a wall with a sloping top goes up in this many steps at most
ARC_STEP_RAD: Final = math.radians(7.5)  # angle of each chord of a round wall
SHARPEST: Final = 3.0  # a corner is filled up to this many times the walls' thickness
ALONG: Final = math.cos(math.radians(20))  # a door lies along a wall if their directions differ by less

# Decisions about clouds of points (``points``).

VOXEL_M: Final = 0.02  # side of a voxel: the noise of sensors
FEWEST_VOXELS: Final = 500  # a cloud that fills fewer shows no room
STRAY: Final = 0.002  # share of the points, or of the voxels, that a sensor saw through windows and in mirrors
STRAY_M: Final = 4.0  # what lies farther than this from the rest was seen so
FULLER: Final = 1.4  # y is up, and a cloud is turned, where its fullest layer then holds this many times as much
CEILING_EDGE: Final = 1.6  # a ceiling's noise begins where a layer holds this many times as much as the walls do
WALLS_ONLY_M: Final = 0.4  # layers this far from floor and ceiling hold walls, and no noise of either
CLOUD_TOP: Final = 0.995  # share of the voxels under the top of a cloud without a ceiling
