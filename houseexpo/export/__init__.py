r"""Plans for other programs: one function a format, and ``export``, which writes any of them.

Formats to be looked at or driven in show the house as seen from above, x right and y up, mirrored plans put right;
``npz`` and ``json`` keep the plan's own axes. ``orientation="world"`` or ``"plan"`` chooses the other
(``houseexpo.export.orientation`` holds the one transform).

Examples
--------
>>> from houseexpo import FloorPlan
>>> from houseexpo.export import pol
>>> pol(FloorPlan("square", [(0.1, 0.1), (0.1, 2.1), (2.1, 2.1), (2.1, 0.1)], 1, {}))["square.pol"]
b'4 1/10 1/10 21/10 1/10 21/10 21/10 1/10 21/10\n'
"""

from houseexpo.export.coco import coco
from houseexpo.export.formats import ALIASES, FORMATS, Format, export
from houseexpo.export.geojson import geojson
from houseexpo.export.graphml import graphml
from houseexpo.export.irsim import irsim
from houseexpo.export.mesh import glb, obj
from houseexpo.export.npz import npz
from houseexpo.export.orientation import is_mirrored, oriented, world_from_plan
from houseexpo.export.png import png
from houseexpo.export.pol import pol
from houseexpo.export.published import published
from houseexpo.export.ros import ros
from houseexpo.export.sdf import sdf
from houseexpo.export.stage import stage
from houseexpo.export.svg import svg

__all__ = [
    "ALIASES",
    "FORMATS",
    "Format",
    "coco",
    "export",
    "geojson",
    "glb",
    "graphml",
    "irsim",
    "is_mirrored",
    "npz",
    "obj",
    "oriented",
    "png",
    "pol",
    "published",
    "ros",
    "sdf",
    "stage",
    "svg",
    "world_from_plan",
]
