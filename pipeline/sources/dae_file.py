"""COLLADA files (.dae): triangles at their places, with the names of nodes, geometries and materials.

Only geometry is read, so that odd effects, inputs and pictures do no harm.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree as Xml

import numpy as np
import numpy.typing as npt

from pipeline.rejection import Reason, Rejection
from pipeline.sources.dae_mesh import Ids, children, first, floats, kind, read_mesh
from pipeline.sources.scene import Part, Piece, placed

Floats = npt.NDArray[np.float64]

HEAD_BYTES = 1 << 16
MAX_NODES = 1_000_000
MAX_DEEP = 200


def load(path: Path, max_faces: int) -> Iterator[Piece]:
    """Yield the triangles of the file's visual scene.

    Raises
    ------
    Rejection
        UNREADABLE where it declares a document type (entities of its own), TOO_LARGE beyond ``max_faces``.
    ValueError, LookupError, xml.etree.ElementTree.ParseError
        Where the file is broken.
    """
    with path.open("rb") as stream:
        if b"<!DOCTYPE" in (head := stream.read(HEAD_BYTES)) or b"<!ENTITY" in head:
            detail = f"{path.name} declares a document type, which COLLADA does not have"
            raise Rejection("source", Reason.UNREADABLE, detail, "export it again")
    root = Xml.parse(path).getroot()  # noqa: S314 - without a document type there are no entities to expand
    by_id = Ids(root)
    materials = {each.get("id", ""): each.get("name", each.get("id", "")) for each in root.iter() if _is_material(each)}
    count = 0
    for names, geometry, symbols, matrix in _instances(root, by_id):
        for mesh in read_mesh(geometry, by_id):
            vertices, faces = placed(mesh.vertices, mesh.faces, matrix)
            count += len(faces)
            if count > max_faces:
                detail = f"{path.name} has more than {max_faces:,} faces, instances counted"
                raise Rejection("source", Reason.TOO_LARGE, detail, "simplify the mesh, or leave its furniture out")
            target = symbols.get(mesh.material, mesh.material)
            name = geometry.get("name") or geometry.get("id") or ""
            yield Piece(Part(names, name, materials.get(target, target)), vertices, faces)


def _instances(root: Xml.Element, by_id: Ids) -> Iterator[tuple[tuple[str, ...], Xml.Element, dict[str, str], Floats]]:
    """Yield (names from the root, geometry, material ids by symbol, place) of each instance in the scene."""
    instance = root.find(".//{*}scene/{*}instance_visual_scene")
    scene = by_id.named(instance, "visual_scene") if instance is not None else root.find(".//{*}visual_scene")
    if scene is None:  # a library of shapes that nobody places
        for each in root.iter():
            if kind(each) == "geometry":
                yield (), each, {}, np.eye(4)
        return
    stack: list[tuple[Xml.Element, tuple[str, ...], Floats]] = [
        (node, (), np.eye(4)) for node in reversed(children(scene, "node"))
    ]
    seen = 0
    while stack:
        node, names, above = stack.pop()
        seen += 1
        if len(names) > MAX_DEEP or seen > MAX_NODES:
            raise ValueError(f"its nodes are nested more than {MAX_DEEP} deep, or more than {MAX_NODES:,}")
        matrix = above @ _matrix(node)
        path = (*names, node.get("name") or node.get("id") or "")
        for placed_here in children(node, "instance_geometry", "instance_controller"):
            geometry = _geometry(by_id.named(placed_here, "geometry", "controller"), by_id)
            if geometry is not None:
                yield path, geometry, _symbols(placed_here), matrix
        inner = [by_id.named(each, "node") for each in children(node, "instance_node")] + children(node, "node")
        stack += [(each, path, matrix) for each in reversed(inner) if each is not None]


def _geometry(element: Xml.Element | None, by_id: Ids) -> Xml.Element | None:
    """Return the geometry itself, or the one that a controller bends."""
    if element is None or kind(element) == "geometry":
        return element
    skin = first(element, "skin", "morph")
    return None if skin is None else by_id.named(skin, "geometry", key="source")


def _is_material(element: Xml.Element) -> bool:
    return kind(element) == "material" and bool(element.get("id"))


def _symbols(instance: Xml.Element) -> dict[str, str]:
    bound = (each for each in instance.iter() if kind(each) == "instance_material")
    return {each.get("symbol", ""): each.get("target", "").removeprefix("#") for each in bound}


def _matrix(node: Xml.Element) -> Floats:
    """Return a node's place in its parent: its transforms in their order, the first outermost."""
    matrix = np.eye(4)
    for element in node:
        step = np.eye(4)
        match kind(element):
            case "matrix":
                step = floats(element, 16).reshape(4, 4)
            case "translate":
                step[:3, 3] = floats(element, 3)
            case "scale":
                step[:3, :3] = np.diag(floats(element, 3))
            case "rotate":
                step[:3, :3] = _turn(floats(element, 4))
            case _:
                continue
        matrix = matrix @ step
    return matrix


def _turn(axis_angle: Floats) -> Floats:
    """Rotation (3, 3) about an axis by degrees (x, y, z, angle); none about no axis."""
    length = float(np.linalg.norm(axis_angle[:3]))
    if length == 0.0:
        return np.eye(3)
    x, y, z = axis_angle[:3] / length
    angle = math.radians(axis_angle[3])
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turn: Floats = np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross
    return turn
