"""Geometry of SDF as triangles, in the frame of its visual or collision; metres.

R1  Planes and height maps are ground, and no part of a house.
R2  A mesh takes the scale that is given; COLLADA's own unit and up axis count, as they do in Gazebo.
R3  A round body has SIDES sides.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import shapely

from pipeline.rejection import Reason, Rejection
from pipeline.sources.drawn_storeys import NOTHING, clean, prism
from pipeline.sources.gazebo_poses import numbers
from pipeline.sources.left_out import LeftOut
from pipeline.sources.mesh_load import SUFFIXES, convention, load_scene
from pipeline.sources.uris import Places
from pipeline.sources.xml_tree import Element
from pipeline.values import Mesh

SIDES = 24
LARGEST_M = 10_000.0


class Shapes:
    """Makes geometry into triangles; ``missing`` names the meshes that were not to be had."""

    def __init__(self, places: Places, left_out: LeftOut) -> None:
        self._places, self._left_out = places, left_out
        self._meshes: dict[Path, Mesh | None] = {}
        self.missing: dict[str, None] = {}
        self.files: dict[Path, None] = {}

    def of(self, geometry: Element, folder: Path, what: str) -> Mesh | None:
        """Return a geometry's triangles, or None if its mesh cannot be had. ``folder`` holds its file."""
        for shape in geometry:
            if shape.tag == "mesh":
                return self._mesh(shape, folder, what)
            maker = _MAKERS.get(shape.tag)
            if maker is not None:
                return maker(shape, what)
        return NOTHING  # R1

    def _mesh(self, shape: Element, folder: Path, what: str) -> Mesh | None:
        """R2."""
        uri = (shape.findtext("uri") or "").strip()
        scale = numbers(shape.findtext("scale") or "1 1 1", 3, f"scale of {what}")
        path = self._places.find(uri, folder)
        if path is None or not path.is_file() or path.suffix.lower() not in SUFFIXES:
            self.missing[named(uri)] = None
            return None
        if path not in self._meshes:
            self.files[path] = None
            self._meshes[path] = None
            with self._left_out.part():
                self._meshes[path] = _in_metres(path)
        mesh = self._meshes[path]
        if mesh is None:
            return None
        return Mesh(mesh.vertices * scale, mesh.faces[:, ::-1] if np.prod(scale) < 0 else mesh.faces)


def named(uri: str) -> str:
    """Return a URI as a note may show it: without the folders of somebody's machine."""
    return uri if "://" in uri and not uri.startswith("file:") else Path(uri).name


def _in_metres(path: Path) -> Mesh:
    mesh = load_scene(path).mesh
    if path.suffix.lower() == ".dae":
        said = convention(path)
        x, y, z = (mesh.vertices * (said.metres or 1.0)).T
        mesh = Mesh(np.column_stack([x, -z, y] if said.up == "y" else [x, y, z]), mesh.faces)
    return mesh


def _box(shape: Element, what: str) -> Mesh:
    x, y, z = _sizes(shape.findtext("size"), 3, what)
    return prism(shapely.box(-x / 2, -y / 2, x / 2, y / 2), -z / 2, z / 2)


def _cylinder(shape: Element, what: str) -> Mesh:
    (radius,), (length,) = _sizes(shape.findtext("radius"), 1, what), _sizes(shape.findtext("length"), 1, what)
    return prism(_round(radius), -length / 2, length / 2)


def _capsule(shape: Element, what: str) -> Mesh:
    (radius,), (length,) = _sizes(shape.findtext("radius"), 1, what), _sizes(shape.findtext("length"), 1, what)
    return prism(_round(radius), -length / 2 - radius, length / 2 + radius)


def _sphere(shape: Element, what: str) -> Mesh:
    (radius,) = _sizes(shape.findtext("radius"), 1, what)
    return _ball(np.full(3, radius))


def _ellipsoid(shape: Element, what: str) -> Mesh:
    return _ball(np.array(_sizes(shape.findtext("radii"), 3, what)))


def _polyline(shape: Element, what: str) -> Mesh:
    """Rings inside the first are holes in it."""
    (height,) = _sizes(shape.findtext("height"), 1, what)
    ring = clean(numbers(point.text, 2, f"polyline of {what}") for point in shape.findall("point"))
    return NOTHING if ring is None else prism(ring, 0.0, height)


def _round(radius: float) -> shapely.Polygon:  # R3
    angles = np.linspace(0.0, 2.0 * np.pi, SIDES, endpoint=False)
    return shapely.Polygon(radius * np.column_stack([np.cos(angles), np.sin(angles)]))


def _ball(radii: np.ndarray) -> Mesh:
    """Rings of SIDES points from pole to pole, as faces between each two."""
    rings = SIDES // 2
    theta, phi = np.meshgrid(np.linspace(0.0, np.pi, rings + 1), np.arange(SIDES) * 2 * np.pi / SIDES, indexing="ij")
    unit = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
    i, j = (each.ravel() for each in np.meshgrid(np.arange(rings), np.arange(SIDES), indexing="ij"))
    a, b = i * SIDES + j, i * SIDES + (j + 1) % SIDES
    faces = np.concatenate([np.column_stack([a, a + SIDES, b]), np.column_stack([b, a + SIDES, b + SIDES])])
    return Mesh((unit * radii).reshape(-1, 3), faces.astype(np.int64))


def _sizes(text: str | None, count: int, what: str) -> list[float]:
    values = numbers(text, count, f"size of {what}")
    if not all(0 <= value <= LARGEST_M for value in values):
        detail = f"size of {what}: expected 0 to {LARGEST_M:.0f} m, found {values}"
        raise Rejection("source", Reason.BAD_UNITS, detail, "SDF is in metres: correct it, or leave the model out")
    return values


_MAKERS: dict[str, Callable[[Element, str], Mesh]] = {
    "box": _box,
    "cylinder": _cylinder,
    "capsule": _capsule,
    "sphere": _sphere,
    "ellipsoid": _ellipsoid,
    "polyline": _polyline,
}
