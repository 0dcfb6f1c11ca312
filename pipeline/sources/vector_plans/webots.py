"""Read a Webots world, ``.wbt``: walls, doors and windows by PROTO type, other solids by the names of their nodes.

Format: the Webots reference manual ("Nodes and Functions", "PROTO: apartment structure"). A world is a text of nodes,
``Type { field value ... }``, as in VRML97.

R1  ``Wall``, ``Door`` and ``Window`` stand on their translation; ``size`` is (thickness, width, height) where z is up,
    and (width, height, thickness) where y is up. A door has wall over its frame; a window is wall.
R2  z is up from R2021c on, y before that, but where ``WorldInfo.coordinateSystem`` says otherwise. In a world whose
    walls are mostly turned from the one to the other, the other is up: people drew so before R2021c for ROS.
R3  Boxes, planes, cylinders and face sets count by the names of the nodes around them, as bodies of MJCF do. A
    mesh beside the world is read where it is an .obj, an .stl or a .dae; nothing is fetched. One whose nodes have no
    name of a part of a house is called after its file.
R4  The shapes of other PROTO nodes lie in files of their own: such nodes are left out, with a note that counts them.
R6  A list that is not closed ends where its node does.
R5  A gap between walls is a passage, with a ``Door`` in it or without: robots drive through both.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt
import shapely

from houseexpo.files import real_path
from pipeline.rejection import Reason, Rejection
from pipeline.sources.files import LeftOutParts, read_bytes
from pipeline.sources.roles import labels_for
from pipeline.sources.tolerances import DEEPEST, LARGEST_TEXT_BYTES, MOST_PARTS, ROUND_SIDES
from pipeline.sources.vector_plans.drawing import Drawing
from pipeline.sources.vector_plans.scene_bodies import (
    SceneBody,
    bodies_from_sheets,
    body_from_triangles,
    body_kind,
    box_mesh,
    load_mesh_beside,
    storeys_from_bodies,
)

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

Z_UP_SINCE: Final = (2021, "c")
DEFAULT_WALL_M: Final = (0.2, 1.0, 2.4)
"""Thickness, width and height of a Wall or Door that does not say them."""
DEFAULT_WINDOW_M: Final = (0.2, 0.8, 2.4)
DEFAULT_FRAME_M: Final = 2.0
"""Height of a door's frame that is not said."""
STRUCTURE: Final = frozenset({"Wall", "Door", "Window"})
HIDDEN: Final = "hidden"
"""Stands before a field in which Webots saved the state of a node inside a PROTO; its name is never read."""
_TOKEN: Final = re.compile(r'"((?:[^"\\]|\\.)*)"|#[^\n]*|([{}\[\]])|([^\s,{}\[\]"#]+)')
_UNNAMED: Final = re.compile(r"(solid|robot)(\(\d+\))?")
"""What Webots calls a node to which nobody has given a name."""
_PLACES: Final = frozenset({"Group", "Transform", "Pose", "Solid", "Robot", "Slot", "Billboard", "SolidReference"})
_NOT_SHAPES: Final = frozenset(
    {"WorldInfo", "Viewpoint", "Background", "TexturedBackground", "TexturedBackgroundLight", "DirectionalLight"}
    | {"PointLight", "SpotLight", "Fog", "Sound", "PBRAppearance", "Appearance"}
)


@dataclass
class _Node:
    kind: str
    name: str = ""
    fields: dict[str, Any] = field(default_factory=dict)

    def numbers(self, key: str, default: tuple[float, ...]) -> Floats:
        """Return the finite numbers of a field; the default where it has others, or another count of them."""
        try:
            found = [float(each) for each in self.fields.get(key, ())]
        except (TypeError, ValueError):
            found = []
        right = len(found) == len(default) and all(map(math.isfinite, found))
        return np.array(found if right else default, np.float64)

    def nodes(self, key: str) -> list[_Node]:
        """Return the nodes of a field."""
        return [each for each in self.fields.get(key, ()) if isinstance(each, _Node)]

    @cached_property
    def children(self) -> list[_Node]:
        """The nodes inside a node that gives them its place."""
        return self.nodes("children") + self.nodes("endPoint")

    @cached_property
    def count(self) -> int:
        """How many nodes it shows, itself and all in it, each as often as it is used."""
        return 1 + sum(child.count for child in self.children)

    @property
    def names(self) -> tuple[str, ...]:
        """What the node is called: by its DEF, and by its field ``name``."""
        said = [each for each in self.fields.get("name", ()) if isinstance(each, str)]
        return tuple(each for each in (self.name, *said) if each and not _UNNAMED.fullmatch(each))


def can_read(path: Path, head: bytes) -> bool:
    """By its suffix or its first line."""
    return path.suffix.lower() == ".wbt" or head.startswith(b"#VRML_SIM")


def read_drawing(path: Path) -> Drawing:
    """Read a world; raise Rejection if it cannot be read or nothing of it is named as a wall."""
    text = read_bytes(path, "leave what is no wall out of the world", LARGEST_TEXT_BYTES).decode("utf-8", "replace")
    left_out = LeftOutParts()
    nodes = _Parser(text, path.name).world()
    world = _World(path, text, nodes, left_out)
    storeys = [
        replace(storey, all_named=False, unnamed_gaps=True) for storey in storeys_from_bodies(list(world.bodies()))
    ]  # R5
    if world.unread:
        kinds = ", ".join(f"{count} {kind}" for kind, count in sorted(world.unread.items())[:8])
        left_out.add(f"{world.unread.total()} PROTO nodes whose shapes are not in the file: {kinds}"[:200])
    wanted, advice = (
        f"Wall nodes or solids named wall among {len(nodes)} nodes",
        "name the walls, or leave the file out",
    )
    y_up = world.z_up == world.is_turned
    return Drawing("webots", tuple(storeys), left_out, y_up=y_up, wanted=wanted, advice=advice)


class _Parser:
    """Reads the nodes of a world; an error names the line."""

    def __init__(self, text: str, name: str) -> None:
        self._text, self._file = text, name
        self._tokens = (m for m in _TOKEN.finditer(text) if m[0][0] != "#")
        self._next: re.Match[str] | None = next(self._tokens, None)
        self._defined: dict[str, _Node] = {}
        self._count = 0

    def world(self) -> list[_Node]:
        """Return the nodes of the file, one after the other."""
        found = []
        while self._next is not None:
            if self._word in {"EXTERNPROTO", "IMPORTABLE"} or self._next[1] is not None:  # a text is their address
                self._take()
            else:
                found.append(self._node(0))
        return found

    @property
    def _word(self) -> str | None:
        return self._next[3] if self._next is not None else None

    def _at(self, mark: str) -> bool:
        """Return whether a brace or bracket comes next."""
        return self._next is not None and self._next[2] == mark

    def _take(self) -> re.Match[str]:
        taken = self._next
        if taken is None:
            raise self._fault()
        self._next = next(self._tokens, None)
        return taken

    def _fault(self) -> Rejection:
        found = self._next[0] if self._next is not None else "the end of the file"
        at = self._next.start() if self._next is not None else len(self._text)
        line = self._text.count("\n", 0, at) + 1
        detail = f"{self._file}, line {line}: expected a node or a field, found {found[:40]}"
        return Rejection("source", Reason.UNREADABLE, detail, "open and save it with Webots")

    def _node(self, depth: int) -> _Node:
        name = ""
        if self._word == "USE":
            self._take()
            used = self._take()[0]
            return self._defined.get(used, _Node("USE", used))
        if self._word == "DEF":
            self._take()
            name = self._take()[0]
        kind = self._word
        if kind is None:
            raise self._fault()
        self._take()
        if not self._at("{"):
            raise self._fault()
        self._count += 1
        if self._count > MOST_PARTS or depth > DEEPEST:
            detail = f"{self._file} has more than {MOST_PARTS:,} nodes, or nodes more than {DEEPEST} deep"
            raise Rejection("source", Reason.TOO_LARGE, detail, "leave what is no wall out of the world")
        self._take()
        node = _Node(kind, name)
        while not self._at("}"):
            if self._word == HIDDEN:
                self._take()
            key = self._word
            if key is None:
                raise self._fault()
            self._take()
            node.fields[key] = self._values(depth)
        self._take()
        if name:
            self._defined[name] = node
        return node

    def _values(self, depth: int) -> list[Any]:
        """Return the values of a field: numbers, texts and nodes; a list may stand in brackets."""
        if self._at("["):
            self._take()
            found: list[Any] = []
            while not (self._at("]") or self._at("}")):  # R6
                found.append(self._scalar() if self._is_scalar else self._node(depth + 1))
            if self._at("]"):
                self._take()
            return found
        if self._word is not None and not self._is_scalar:
            return [self._node(depth + 1)]
        found = []
        while self._next is not None and self._is_scalar:
            found.append(self._scalar())
        return found

    @property
    def _is_scalar(self) -> bool:
        if self._next is None:
            return False
        word = self._next[3]
        return self._next[1] is not None or (
            word is not None and (word in {"TRUE", "FALSE", "NULL", "nan", "inf"} or word[0] in "+-.0123456789")
        )

    def _scalar(self) -> str:
        taken = self._take()
        return taken[1] if taken[1] is not None else taken[3]


class _World:
    def __init__(self, path: Path, text: str, nodes: list[_Node], left_out: LeftOutParts) -> None:
        self.folder, self.nodes, self.left_out = real_path(path.parent), nodes, left_out
        self.unread: Counter[str] = Counter()
        said = next((node.fields.get("coordinateSystem") for node in nodes if node.kind == "WorldInfo"), None)
        version = re.match(r"#VRML_SIM R(\d{4})([a-z]?)", text)
        newer = version is None or (int(version[1]), version[2]) >= Z_UP_SINCE
        self.z_up = str(said[0]).upper().endswith("U") if said else newer  # R2: ENU, or NUE
        self.is_turned = self._are_walls_turned()
        z_is_up = self.z_up != self.is_turned
        self._upright = np.eye(3) if z_is_up else np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])

    def _are_walls_turned(self) -> bool:
        """Return whether most walls, doors and windows stand along the other axis (R2)."""
        up, other = (2, 1) if self.z_up else (1, 2)
        stand = [_pose(node)[:3, up] for node in self.nodes if node.kind in STRUCTURE]
        return bool(sum(abs(way[other]) > abs(way[up]) for way in stand) > len(stand) / 2)

    def bodies(self) -> Iterator[SceneBody]:
        """Every body of the world, z up."""
        shown = sum(node.count for node in self.nodes)
        if shown > MOST_PARTS:  # nodes that are used again and again
            detail = f"the world shows {shown:,} nodes, expected {MOST_PARTS:,} at most"
            raise Rejection("source", Reason.TOO_LARGE, detail, "leave what is no wall out of the world")
        waiting: list[tuple[_Node, Floats, tuple[str, ...]]] = [(node, np.eye(4), ()) for node in reversed(self.nodes)]
        while waiting:
            node, at, names = waiting.pop()
            own = (*node.names, *names)
            if node.kind in STRUCTURE:
                yield from self._structure(node, at @ _pose(node), own)
            elif node.kind in {"SolidBox", "Floor", "RectangleArena"}:
                yield from self._proto_bodies(node, at @ _pose(node), own)
            elif node.kind == "Shape":
                for shape in node.nodes("geometry"):
                    yield from self._shape(shape, at, own)
            elif node.kind in _PLACES:
                place = at @ _pose(node)
                waiting += [(child, place, own) for child in reversed(node.children)]
            elif node.kind not in _NOT_SHAPES:
                self.unread[node.kind] += 1  # R4

    def _structure(self, node: _Node, at: Floats, names: tuple[str, ...]) -> Iterator[SceneBody]:
        """Yield a ``Wall``, ``Door`` or ``Window`` as bodies that stand on their translation."""
        default = DEFAULT_WINDOW_M if node.kind == "Window" else DEFAULT_WALL_M
        size = self._by_axes(node.numbers("size", self._in_order(default)))
        if not (size > 0).all():
            size = np.array(default)
        thick, width, height = size.tolist()
        if node.kind != "Door":
            yield from self._box(("wall", *names), at, (thick, width, height), 0.0)
            return
        frame = min(float(node.numbers("frameHeight", (DEFAULT_FRAME_M,))[0]), height)
        yield from self._box(("door", *names), at, (thick, width, frame), 0.0)
        if height > frame:
            yield from self._box(("lintel", *names), at, (thick, width, height - frame), frame)

    def _in_order(self, size: tuple[float, ...]) -> tuple[float, ...]:
        """Thickness, width and height in the order of the file."""
        return size if self.z_up else (size[1], size[2], size[0])

    def _by_axes(self, size: Floats) -> Floats:
        """Thickness, width and height of a size as the file has it."""
        return size if self.z_up else size[[2, 0, 1]]

    def _box(
        self, names: tuple[str, ...], at: Floats, size: tuple[float, float, float], foot: float
    ) -> Iterator[SceneBody]:
        """A box of this thickness, width and height that stands so high over its place."""
        half = np.array(self._in_order(size)) / 2
        lift = np.eye(4)
        lift[2 if self.z_up else 1, 3] = foot + size[2] / 2
        yield from self._body(names, *box_mesh(at @ lift, half))

    def _proto_bodies(self, node: _Node, at: Floats, names: tuple[str, ...]) -> Iterator[SceneBody]:
        """PROTO nodes of one box, a floor, or a floor with four walls."""
        if node.kind == "SolidBox":
            yield from self._body(names, *box_mesh(at, node.numbers("size", (2.0, 2.0, 2.0)) / 2))
            return
        x, y = node.numbers("floorSize" if node.kind == "RectangleArena" else "size", (1.0, 1.0))
        yield from self._body(("floor", *names), *self._plane(at, x, y))
        if node.kind == "RectangleArena":
            thick, height = (
                float(node.numbers(*each)[0]) for each in (("wallThickness", (0.01,)), ("wallHeight", (0.1,)))
            )
            for side in (-1.0, 1.0):
                for size, aside in (((thick, y), (x + thick) / 2), ((x + 2 * thick, thick), (y + thick) / 2)):
                    move = np.eye(4)
                    move[0 if size[0] == thick else (1 if self.z_up else 2), 3] = side * aside
                    yield from self._box(("wall", *names), at @ move, self._flat(size, height), 0.0)

    def _flat(self, size: tuple[float, float], height: float) -> tuple[float, float, float]:
        """A box's thickness, width and height that reaches so far along x and along the other level axis."""
        return (size[0], size[1], height) if self.z_up else (size[1], size[0], height)

    def _shape(self, shape: _Node, at: Floats, names: tuple[str, ...]) -> Iterator[SceneBody]:
        """Yield a box, plane, cylinder or face set under the names of the nodes around it."""
        try:
            if shape.kind == "Box":
                yield from self._body(names, *box_mesh(at, shape.numbers("size", (2.0, 2.0, 2.0)) / 2))
            elif shape.kind == "Plane":
                yield from self._body(names, *self._plane(at, *shape.numbers("size", (1.0, 1.0))))
            elif shape.kind == "Cylinder":
                radius, height = (float(shape.numbers(*each)[0]) for each in (("radius", (1.0,)), ("height", (2.0,))))
                yield from self._body(names, *self._cylinder(at, radius, height))
            elif shape.kind == "IndexedFaceSet":
                yield from self._body(names, *_faces_of(shape, at))
            elif shape.kind == "Mesh":
                yield from self._mesh(" ".join(map(str, shape.fields.get("url", [])[:1])), at, names)
        except (ValueError, OverflowError, shapely.errors.ShapelyError) as error:
            self.left_out.add(f"{shape.kind} {' '.join(names)[:60]}: {error}")

    def _mesh(self, url: str, at: Floats, names: tuple[str, ...]) -> Iterator[SceneBody]:
        points, faces = load_mesh_beside(self.folder, url, self.left_out)
        if url.lower().endswith(".dae") and not self.z_up:
            points = points[:, [0, 2, 1]] * (1.0, 1.0, -1.0)
        yield from self._body((*names, Path(url).stem), _move(at, points), faces)

    def _plane(self, at: Floats, x: float, y: float) -> tuple[Floats, Ints]:
        corners = np.array([(-x, -y, 0), (x, -y, 0), (x, y, 0), (-x, y, 0)], np.float64) / 2
        if not self.z_up:
            corners = corners[:, [0, 2, 1]]
        return _move(at, corners), np.array([(0, 1, 2), (0, 2, 3)], np.int64)

    def _cylinder(self, at: Floats, radius: float, height: float) -> tuple[Floats, Ints]:
        import trimesh

        mesh: Any = trimesh.creation.cylinder(radius, height, sections=ROUND_SIDES)  # sides of a cylinder
        points = np.asarray(mesh.vertices) if self.z_up else np.asarray(mesh.vertices)[:, [0, 2, 1]]
        return _move(at, points), np.asarray(mesh.faces, np.int64)

    def _body(self, names: tuple[str, ...], points: Floats, faces: Ints) -> Iterator[SceneBody]:
        if not np.isfinite(points).all():
            self.left_out.add(f"{' '.join(names)[:60]}: its place is not finite")
            return
        kind = body_kind(names)
        upright = points @ self._upright.T
        made = body_from_triangles(names, upright, faces)
        if made is None:
            if kind == "wall":
                yield from bodies_from_sheets(names, upright, faces)
            return
        word = re.sub(r"[_\d()]+", " ", names[0]).strip().capitalize() if names else ""
        if kind == "floor" and labels_for((word,)):
            made = SceneBody(made.names, made.shape, made.low_m, made.high_m, word)
        yield made


def _pose(node: _Node) -> Floats:
    """Return the place (4, 4) that a node gives its children."""
    from scipy.spatial.transform import Rotation

    pose = np.eye(4)
    x, y, z, angle = node.numbers("rotation", (0.0, 0.0, 1.0, 0.0))
    length = math.hypot(x, y, z)
    if length > 0:
        pose[:3, :3] = Rotation.from_rotvec(np.array([x, y, z]) / length * angle).as_matrix()
    pose[:3, :3] = pose[:3, :3] * node.numbers("scale", (1.0, 1.0, 1.0))
    pose[:3, 3] = node.numbers("translation", (0.0, 0.0, 0.0))
    return pose


def _move(at: Floats, points: Floats) -> Floats:
    return np.asarray(points @ at[:3, :3].T + at[:3, 3])


def _faces_of(shape: _Node, at: Floats) -> tuple[Floats, Ints]:
    """Return the points and triangles of an IndexedFaceSet; a face ends at -1."""
    coordinates = next(iter(shape.nodes("coord")), _Node("Coordinate"))
    points = np.array([float(each) for each in coordinates.fields.get("point", ())]).reshape(-1, 3)
    index = [int(each) for each in shape.fields.get("coordIndex", ())]
    if not index or min(index) < -1 or max(index) >= len(points):
        raise ValueError("a face names a point that is not there")
    faces: list[tuple[int, int, int]] = []
    ring: list[int] = []
    for each in [*index, -1]:
        if each >= 0:
            ring.append(each)
            continue
        faces += [(ring[0], ring[k], ring[k + 1]) for k in range(1, len(ring) - 1)]
        ring = []
    if not faces:
        raise ValueError("it has no face of three points")
    return _move(at, points), np.array(faces, np.int64)
