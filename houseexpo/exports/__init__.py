r"""Export plans for other programs: one function for each format, and ``export``, which writes any of them.

Formats for viewers and simulators show the house as seen from above, x right and y up; mirrored plans are mirrored
back. ``npz`` and ``json`` keep the plan's own axes. The option ``orientation`` ("world" or "plan") changes this. The
option ``frame`` ("source" or "plan") chooses whose coordinates a file has: those of a robot's map, a drawing, a scan or
a simulator's world by default, if the plan was made of one (``houseexpo.exports.placement``).

Examples
--------
>>> from houseexpo import FloorPlan
>>> from houseexpo.exports import pol
>>> pol(FloorPlan("square", [(0.1, 0.1), (0.1, 2.1), (2.1, 2.1), (2.1, 0.1)], 1, {}))["square.pol"]
b'4 1/10 1/10 21/10 1/10 21/10 21/10 1/10 21/10\n'
"""

from houseexpo.exports.coco import coco
from houseexpo.exports.dxf import dxf
from houseexpo.exports.formats import ALIASES, FORMATS, ExportFormat, export
from houseexpo.exports.geojson import geojson
from houseexpo.exports.graphml import graphml
from houseexpo.exports.ifc import ifc
from houseexpo.exports.mesh import glb, obj
from houseexpo.exports.mjcf import mjcf
from houseexpo.exports.placement import default_frame, is_mirrored, orient_plan, world_from_plan
from houseexpo.exports.pol import pol
from houseexpo.exports.published_json import published_json
from houseexpo.exports.rasters import npz, png, ros_map
from houseexpo.exports.rmf import rmf
from houseexpo.exports.sdf import sdf
from houseexpo.exports.svg import svg
from houseexpo.exports.usd import usd
from houseexpo.exports.worlds_2d import irsim, stage

__all__ = [
    "ALIASES",
    "FORMATS",
    "ExportFormat",
    "coco",
    "default_frame",
    "dxf",
    "export",
    "geojson",
    "glb",
    "graphml",
    "ifc",
    "irsim",
    "is_mirrored",
    "mjcf",
    "npz",
    "obj",
    "orient_plan",
    "png",
    "pol",
    "published_json",
    "rmf",
    "ros_map",
    "sdf",
    "stage",
    "svg",
    "usd",
    "world_from_plan",
]
