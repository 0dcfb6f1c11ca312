"""Re-export the frozen dataclasses that sources pass to stages, and stages to each other, for import from one place.

``source`` holds what a source hands over, ``stages`` what the stages hand to each other. Values that geometry works on
(meshes, openings, spaces) are its own and are named here too.
"""

from pipeline.geometry.meshes import Mesh
from pipeline.geometry.openings import Opening
from pipeline.geometry.rooms_and_passages import JoinedPoints, Spaces
from pipeline.values.source import (
    CUT_OFF,
    EDGE,
    IDLE,
    KEPT_FROM,
    MADE,
    Input,
    Level,
    Reader,
    RejectedLevel,
    SourceObject,
    SourceRoom,
)
from pipeline.values.stages import Evidence, Layout, NamedRoom, Obstacle, Planes

__all__ = [
    "CUT_OFF",
    "EDGE",
    "IDLE",
    "KEPT_FROM",
    "MADE",
    "Evidence",
    "Input",
    "JoinedPoints",
    "Layout",
    "Level",
    "Mesh",
    "NamedRoom",
    "Obstacle",
    "Opening",
    "Planes",
    "Reader",
    "RejectedLevel",
    "SourceObject",
    "SourceRoom",
    "Spaces",
]
