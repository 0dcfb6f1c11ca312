"""Read a COLLADA file (.dae): yield its triangles, placed as in the scene, named by node, geometry and material.

``PrimitiveMesh`` is the step before: the triangles of one material, still in the frame of their geometry.

Only geometry is read, so that odd effects, inputs and pictures do no harm.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree as Xml

import numpy as np
import numpy.typing as npt

from houseexpo.file_kinds import HEAD_BYTES
from pipeline.rejection import Reason, Rejection
from pipeline.sources.meshes.scene import NamedPiece, PartNames, transform_triangles, triangulate_polygons
from pipeline.sources.tolerances import DEEPEST, MOST_PARTS

Floats = npt.NDArray[np.float64]


def load(path: Path, max_faces: int) -> Iterator[NamedPiece]:
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
    by_id = ElementsById(root)
    materials = {each.get("id", ""): each.get("name", each.get("id", "")) for each in root.iter() if _is_material(each)}
    count = 0
    for names, geometry, symbols, matrix in _instances(root, by_id):
        for mesh in read_geometry(geometry, by_id):
            vertices, faces = transform_triangles(mesh.vertices, mesh.faces, matrix)
            count += len(faces)
            if count > max_faces:
                detail = f"{path.name} has more than {max_faces:,} faces, instances counted"
                raise Rejection("source", Reason.TOO_LARGE, detail, "simplify the mesh, or leave its furniture out")
            target = symbols.get(mesh.material, mesh.material)
            name = geometry.get("name") or geometry.get("id") or ""
            yield NamedPiece(PartNames(names, name, materials.get(target, target)), vertices, faces)


def _instances(
    root: Xml.Element, by_id: ElementsById
) -> Iterator[tuple[tuple[str, ...], Xml.Element, dict[str, str], Floats]]:
    """Yield (names from the root, geometry, material ids by symbol, place) of each instance in the scene."""
    instance = root.find(".//{*}scene/{*}instance_visual_scene")
    scene = by_id.target_of(instance, "visual_scene") if instance is not None else root.find(".//{*}visual_scene")
    if scene is None:  # a library of shapes that nobody places
        for each in root.iter():
            if tag_without_namespace(each) == "geometry":
                yield (), each, {}, np.eye(4)
        return
    stack: list[tuple[Xml.Element, tuple[str, ...], Floats]] = [
        (node, (), np.eye(4)) for node in reversed(children_by_tag(scene, "node"))
    ]
    seen = 0
    while stack:
        node, names, above = stack.pop()
        seen += 1
        if len(names) > DEEPEST or seen > MOST_PARTS:
            raise ValueError(f"its nodes are nested more than {DEEPEST} deep, or more than {MOST_PARTS:,}")
        matrix = above @ _matrix(node)
        path = (*names, node.get("name") or node.get("id") or "")
        for placed_here in children_by_tag(node, "instance_geometry", "instance_controller"):
            geometry = _geometry(by_id.target_of(placed_here, "geometry", "controller"), by_id)
            if geometry is not None:
                yield path, geometry, _symbols(placed_here), matrix
        inner = [by_id.target_of(each, "node") for each in children_by_tag(node, "instance_node")] + children_by_tag(
            node, "node"
        )
        stack += [(each, path, matrix) for each in reversed(inner) if each is not None]


def _geometry(element: Xml.Element | None, by_id: ElementsById) -> Xml.Element | None:
    """Return the geometry itself, or the one that a controller bends."""
    if element is None or tag_without_namespace(element) == "geometry":
        return element
    skin = first_child(element, "skin", "morph")
    return None if skin is None else by_id.target_of(skin, "geometry", key="source")


def _is_material(element: Xml.Element) -> bool:
    return tag_without_namespace(element) == "material" and bool(element.get("id"))


def _symbols(instance: Xml.Element) -> dict[str, str]:
    bound = (each for each in instance.iter() if tag_without_namespace(each) == "instance_material")
    return {each.get("symbol", ""): each.get("target", "").removeprefix("#") for each in bound}


def _matrix(node: Xml.Element) -> Floats:
    """Return a node's place in its parent: its transforms in their order, the first outermost."""
    matrix = np.eye(4)
    for element in node:
        step = np.eye(4)
        match tag_without_namespace(element):
            case "matrix":
                step = parse_floats(element, 16).reshape(4, 4)
            case "translate":
                step[:3, 3] = parse_floats(element, 3)
            case "scale":
                step[:3, :3] = np.diag(parse_floats(element, 3))
            case "rotate":
                step[:3, :3] = _turn(parse_floats(element, 4))
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


# One COLLADA geometry into triangles, material by material.


Indices = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class PrimitiveMesh:
    """Triangles of one material, in the geometry's own frame; ``material`` is the symbol that an instance binds."""

    vertices: Floats
    faces: Indices
    material: str


def tag_without_namespace(element: Xml.Element) -> str:
    """Tag without its namespace."""
    return element.tag.rpartition("}")[2]


def children_by_tag(element: Xml.Element, *kinds: str) -> list[Xml.Element]:
    """Direct children of these kinds, in order."""
    return [each for each in element if tag_without_namespace(each) in kinds]


def first_child(element: Xml.Element, *kinds: str) -> Xml.Element | None:
    """Return the first direct child of these kinds, or None."""
    return next(iter(children_by_tag(element, *kinds)), None)


def parse_floats(element: Xml.Element, count: int | None = None) -> Floats:
    """Return the numbers in an element's text; raise ValueError unless there are ``count`` numbers."""
    words = (element.text or "").split()
    if count is not None and len(words) != count:
        raise ValueError(f"<{tag_without_namespace(element)}> holds {len(words)} numbers; expected {count}")
    return np.array(list(map(float, words)), np.float64)


class ElementsById:
    """The elements of a file by kind and id: files use an id for a node and its geometry alike.

    Of two elements of one kind and id the first counts.
    """

    def __init__(self, root: Xml.Element) -> None:
        self._found: dict[tuple[str, str], Xml.Element] = {}
        for element in root.iter():
            if name := element.get("id"):
                self._found.setdefault((tag_without_namespace(element), name), element)

    def of(self, name: str, *kinds: str) -> Xml.Element | None:
        """Return the element of an id that is of the first of these kinds, or None."""
        return next((found for each in kinds if (found := self._found.get((each, name))) is not None), None)

    def target_of(self, instance: Xml.Element, *kinds: str, key: str = "url") -> Xml.Element | None:
        """Return the element that another one names, or None if it is in another file, which is not opened."""
        return self.of(instance.get(key, "").removeprefix("#"), *kinds)


def read_geometry(geometry: Xml.Element, by_id: ElementsById) -> Iterator[PrimitiveMesh]:
    """Yield the triangles of each primitive; lines, points and splines are left out.

    Raises
    ------
    ValueError, LookupError
        Where indices or sources are broken.
    """
    mesh = first_child(geometry, "mesh")
    if mesh is None:
        return
    positions: dict[str, Floats] = {}
    for primitive in mesh:
        found = _polygons(primitive)
        if found is None:
            continue
        rows, counts = found
        offset, source = _position(primitive, mesh, by_id)
        if source not in positions:
            positions[source] = _source(_inside(mesh, source, by_id, "source"))
        vertices = positions[source]
        corners = rows[:, offset]
        if len(corners) and not 0 <= corners.min() <= corners.max() < len(vertices):
            raise ValueError(f"a face names vertex {int(corners.max()):,} of {len(vertices):,}")
        faces = triangulate_polygons(vertices, corners, counts)[0]
        used, packed = np.unique(faces, return_inverse=True)
        yield PrimitiveMesh(vertices[used], packed.reshape(-1, 3).astype(np.int64), primitive.get("material", ""))


def _polygons(primitive: Xml.Element) -> tuple[Indices, Indices] | None:
    """Return index rows (k, inputs), one a corner, and the corners of each polygon (p,); None for no surface."""
    name = tag_without_namespace(primitive)
    if name not in {"triangles", "polylist", "polygons", "trifans", "tristrips"}:
        return None
    width = 1 + max((int(each.get("offset", 0)) for each in children_by_tag(primitive, "input")), default=0)
    lists = [_indices(each, width) for each in primitive.iter() if tag_without_namespace(each) == "p"]
    rows = np.concatenate([np.empty((0, width), np.int64), *lists])
    if name == "triangles":
        return rows, np.full(len(rows) // 3, 3)
    if name == "polylist":
        vcount = first_child(primitive, "vcount")
        counts = np.array(list(map(int, ((vcount.text if vcount is not None else "") or "").split())), np.int64)
        if counts.sum() != len(rows):
            raise ValueError(f"<vcount> asks for {counts.sum():,} corners; <p> holds {len(rows):,}")
        return rows, counts
    if name == "polygons":
        return rows, np.array([len(each) for each in lists], np.int64)
    turns = [_strip(each) if name == "tristrips" else _fan(each) for each in lists if len(each) >= 3]
    rows = np.concatenate([np.empty((0, width), np.int64), *turns])
    return rows, np.full(len(rows) // 3, 3)


def _indices(element: Xml.Element, width: int) -> Indices:
    numbers = np.array(list(map(int, (element.text or "").split())), np.int64)
    if len(numbers) % width:
        raise ValueError(f"<p> holds {len(numbers):,} indices; expected a multiple of {width}")
    return numbers.reshape(-1, width)


def _fan(rows: Indices) -> Indices:
    middle = np.stack([np.repeat(rows[:1], len(rows) - 2, axis=0), rows[1:-1], rows[2:]], axis=1)
    return middle.reshape(-1, rows.shape[1])


def _strip(rows: Indices) -> Indices:
    faces = np.stack([rows[:-2], rows[1:-1], rows[2:]], axis=1)
    faces[1::2] = faces[1::2, ::-1]
    return faces.reshape(-1, rows.shape[1])


def _inside(mesh: Xml.Element, name: str, by_id: ElementsById, wanted: str) -> Xml.Element:
    """Return a mesh's own element of an id, or the file's; raise LookupError if there is none."""
    own = next((each for each in mesh if each.get("id") == name and tag_without_namespace(each) == wanted), None)
    found = own if own is not None else by_id.of(name, wanted)
    if found is None:
        raise LookupError(f"no <{wanted}> of id {name[:60]!r}")
    return found


def _position(primitive: Xml.Element, mesh: Xml.Element, by_id: ElementsById) -> tuple[int, str]:
    """Return which index of a corner is its position's, and the id of the source of positions."""
    for each in children_by_tag(primitive, "input"):
        if each.get("semantic") == "VERTEX":
            vertices = _inside(mesh, each.get("source", "").removeprefix("#"), by_id, "vertices")
            for inner in children_by_tag(vertices, "input"):
                if inner.get("semantic") == "POSITION":
                    return int(each.get("offset", 0)), inner.get("source", "").removeprefix("#")
    raise ValueError(f"<{tag_without_namespace(primitive)}> has no positions")


def _source(source: Xml.Element) -> Floats:
    """Positions (n, 3) of a source, by its accessor's stride and offset."""
    array = first_child(source, "float_array")
    if array is None:
        raise ValueError(f"the source {source.get('id')!r} holds no numbers")
    values = parse_floats(array)
    accessor = source.find("./{*}technique_common/{*}accessor")
    stride = int(accessor.get("stride", 1)) if accessor is not None else 3
    start = int(accessor.get("offset", 0)) if accessor is not None else 0
    if stride < 3 or start < 0:
        raise ValueError(f"the source {source.get('id')!r} has {stride} numbers a vertex; expected 3 or more")
    rows = (len(values) - start) // stride
    return values[start : start + rows * stride].reshape(-1, stride)[:, :3]
