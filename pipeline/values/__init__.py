"""Re-export the frozen dataclasses that sources pass to stages, and stages to each other, for import from one place.

``source`` holds what a source hands over, ``stages`` what the stages hand to each other. Values that geometry works on
(meshes, closing candidates, doorways, spaces) are its own and are named here too.
"""

from pipeline.geometry.closing_candidates import CandidateKind, ClosingCandidate
from pipeline.geometry.doorways import Doorway
from pipeline.geometry.meshes import Mesh
from pipeline.geometry.rooms_and_passages import JoinedPoints, Passage, Spaces
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
    SourceOpening,
    SourceRoom,
)
from pipeline.values.stages import Evidence, Layout, NamedRoom, Obstacle, Planes

__all__ = [
    "CUT_OFF",
    "EDGE",
    "IDLE",
    "KEPT_FROM",
    "MADE",
    "CandidateKind",
    "ClosingCandidate",
    "Doorway",
    "Evidence",
    "Input",
    "JoinedPoints",
    "Layout",
    "Level",
    "Mesh",
    "NamedRoom",
    "Obstacle",
    "Passage",
    "Planes",
    "Reader",
    "RejectedLevel",
    "SourceObject",
    "SourceOpening",
    "SourceRoom",
    "Spaces",
]
