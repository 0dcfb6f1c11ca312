"""Door leaves, frames, handles, windows: what stands in a wall's openings.

R1  A leaf fills its opening but for small gaps; it turns about its hinge at the face of the wall on its swing's side.
R2  A frame lines jambs and head, as deep as the wall or a little deeper; now and then it has an architrave.
R3  A window is a frame with a pane; a French window is glazed to the floor.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely
import trimesh
from numpy.random import Generator

from tests.builders.kinds.parts.solids3d import joined, prism
from tests.builders.kinds.values import Leaf, Opening, Part, Storey, Wall


@dataclass(frozen=True)
class Joinery:
    """How a house's openings are filled: ``doors`` "none", "closed", "ajar", "open" or "mixed"."""

    doors: str = "none"
    frames: bool = False
    handles: bool = False
    windows: bool = False
    entrance_closed: bool = True

    @staticmethod
    def draw(rng: Generator) -> Joinery:
        """Leaves in every state, equally often; frames and windows mostly where there are leaves."""
        doors = str(rng.choice(["none", "closed", "ajar", "open", "mixed", "closed"]))
        there = doors != "none"
        frames = bool(rng.random() < (0.6 if there else 0.1))
        return Joinery(doors, frames, there and bool(rng.random() < 0.6), bool(rng.random() < (0.7 if there else 0.3)))

    def angle(self, rng: Generator, entrance: bool) -> float:
        """A leaf's angle in degrees; front doors stay closed."""
        state = str(rng.choice(["closed", "ajar", "open"])) if self.doors == "mixed" else self.doors
        if entrance and self.entrance_closed:
            state = "closed"
        return {"closed": 0.0, "ajar": float(rng.uniform(10, 60)), "open": float(rng.uniform(75, 100))}[state]


def fitted(storey: Storey, joinery: Joinery, rng: Generator, names: dict[str, str] | None = None) -> list[Part]:
    """All parts that stand in the openings; ``names`` gives words for door, frame, handle, window."""
    words = {"door": "door", "frame": "frame", "handle": "handle", "window": "window"} | (names or {})
    parts = []
    for number, o in enumerate(storey.openings):
        wall = storey.walls[o.wall]
        glazed = o.kind in {"window", "french"}
        if glazed and joinery.windows:
            parts.append(Part(f"{words['window']}_{number:02d}", window(wall, o), "window", words["window"]))
        if o.kind not in {"door", "entrance"} or joinery.doors == "none":
            continue
        lining = 0.0
        if joinery.frames:
            lining = float(rng.uniform(0.02, 0.045))
            made = frame(wall, o, lining, bool(rng.random() < 0.4))
            parts.append(Part(f"{words['door']}_{words['frame']}_{number:02d}", made, "frame", words["frame"]))
        angle = joinery.angle(rng, o.kind == "entrance")
        for leaf in o.leaves:
            made = leaf_area(wall, o, leaf, angle, lining)
            low = float(rng.choice([0.0, 0.005, 0.01]))
            body = prism(made, low, o.head - lining - 0.004)
            if joinery.handles:
                body = joined([body, handle(made)])
            parts.append(Part(f"{words['door']}_{number:02d}", body, "leaf", words["door"]))
    return parts


def leaf_area(wall: Wall, opening: Opening, leaf: Leaf, angle: float, lining: float) -> shapely.Polygon:
    """R1: the plan of a leaf that stands at an angle (degrees)."""
    span = (opening.width - 2 * lining) / len(opening.leaves) - 0.006
    thick = min(leaf.thickness, wall.thickness * 0.8)
    at = opening.start + lining + 0.003 if leaf.hinge == 0 else opening.end - lining - 0.003
    face = leaf.swing * (wall.thickness / 2 - (0.0 if wall.thickness < 0.3 else 0.05))
    hinge = wall.at(at, face)
    way = wall.along * (1 if leaf.hinge == 0 else -1)
    out = wall.across * leaf.swing
    radians = math.radians(angle)
    along = way * math.cos(radians) + out * math.sin(radians)
    deep = way * math.sin(radians) - out * math.cos(radians)
    corners = [hinge, hinge + span * along, hinge + span * along + thick * deep, hinge + thick * deep]
    return shapely.Polygon(corners)


def handle(area: shapely.Polygon) -> trimesh.Trimesh:
    """A lever on both faces of a leaf, near the end away from the hinge."""
    ring = np.asarray(area.exterior.coords)
    along = (ring[1] - ring[0]) / np.hypot(*(ring[1] - ring[0]))
    deep = ring[3] - ring[0]
    end = ring[1] - 0.07 * along
    across = deep / np.hypot(*deep)
    rod = [end - 0.05 * across, end - 0.05 * across - 0.02 * along, end + deep + 0.05 * across - 0.02 * along,
           end + deep + 0.05 * across]  # fmt: skip
    lever = [end - 0.05 * across, end - 0.05 * across - 0.11 * along, end - 0.035 * across - 0.11 * along,
             end - 0.035 * across]  # fmt: skip
    other = [p + deep + 0.085 * across for p in lever]
    return joined(
        [prism(shapely.Polygon(rod), 1.0, 1.02), *(prism(shapely.Polygon(p), 1.0, 1.02) for p in (lever, other))]
    )


def frame(wall: Wall, o: Opening, lining: float, architrave: bool) -> trimesh.Trimesh:
    """R2."""
    deep = wall.thickness + 0.01
    parts = [
        prism(wall.strip(o.start, o.start + lining, deep), 0.0, o.head),
        prism(wall.strip(o.end - lining, o.end, deep), 0.0, o.head),
        prism(wall.strip(o.start, o.end, deep), o.head - lining, o.head),
    ]
    if architrave:
        for side in (1, -1):
            shift = side * (wall.thickness / 2 + 0.008)
            parts += [prism(wall.strip(a, b, 0.016, shift), 0.0, o.head + 0.06)
                      for a, b in ((o.start - 0.06, o.start), (o.end, o.end + 0.06))]  # fmt: skip
            parts.append(prism(wall.strip(o.start, o.end, 0.016, shift), o.head, o.head + 0.06))
    return joined(parts)


def window(wall: Wall, o: Opening) -> trimesh.Trimesh:
    """R3."""
    border, deep = 0.05, min(0.07, wall.thickness)
    parts = [
        prism(wall.strip(o.start, o.start + border, deep), o.sill, o.head),
        prism(wall.strip(o.end - border, o.end, deep), o.sill, o.head),
        prism(wall.strip(o.start + border, o.end - border, deep), o.sill, o.sill + border),
        prism(wall.strip(o.start + border, o.end - border, deep), o.head - border, o.head),
        prism(wall.strip(o.start + border, o.end - border, 0.02), o.sill + border, o.head - border),
    ]
    if o.width > 1.3:
        middle = o.centre
        parts.append(prism(wall.strip(middle - 0.04, middle + 0.04, deep), o.sill, o.head))
    return joined(parts)
