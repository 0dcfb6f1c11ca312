"""Read an MJCF scene of MuJoCo: walls, floors, doors and furniture by the names of its bodies.

MolmoSpaces and our own export write such scenes.

Format: MuJoCo's XML reference. Names as MolmoSpaces writes them: ``room|...`` floors, ``door_...`` and ``doorway_...``
passages, ``wall...`` walls. Read are worldbody, bodies, frames, geoms and sites; boxes, and meshes whose corners are in
the file, or in a file of the same folder or one below it. Classes give what an element does not say itself.

R1  ``include`` is followed inside the folder, each file once; another one is left out, with a note.
R2  Geoms that only collide are read like the visible ones: what is there twice is one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt
import shapely

from houseexpo.file_kinds import format_suffix
from houseexpo.files import real_path
from pipeline.rejection import Reason, Rejection
from pipeline.sources.files import Element, LeftOutParts, file_inside, parse_xml
from pipeline.sources.tolerances import MOST_PARTS, TINY
from pipeline.sources.vector_plans.drawing import Drawing
from pipeline.sources.vector_plans.scene_bodies import (
    SceneBody,
    body_from_box,
    body_from_triangles,
    load_mesh_beside,
    storeys_from_bodies,
)

Matrix = npt.NDArray[np.float64]


def can_read(path: Path, head: bytes) -> bool:
    """By its root element."""
    return format_suffix(path, head) in {".xml", ".mjcf"} and b"<mujoco" in head


def read_drawing(path: Path) -> Drawing:
    """Read a scene; raise Rejection if it cannot be read or nothing of it is named as a wall or a room."""
    left_out = LeftOutParts()
    scene = _Scene(path, left_out)
    bodies = list(scene.bodies())
    wanted, advice = f"geoms named wall or room| among {len(bodies)}", "name the walls, or leave the file out"
    return Drawing("mjcf", tuple(storeys_from_bodies(bodies)), left_out, wanted=wanted, advice=advice)


class _Scene:
    def __init__(self, path: Path, left_out: LeftOutParts) -> None:
        self.path, self.folder, self.left_out = path, real_path(path.parent), left_out
        self._read: set[Path] = set()
        self._count = 0
        root = self._document(path)
        if root.tag != "mujoco":
            raise Rejection("source", Reason.UNREADABLE, f"{path.name}: expected a mujoco element", "copy it again")
        self.roots = list(self._with_included(root))
        compilers = [each for root in self.roots for each in root.iter("compiler")]
        self.degrees = not any(each.get("angle") == "radian" for each in compilers)
        self.sequence = next((each.get("eulerseq", "xyz") for each in compilers if each.get("eulerseq")), "xyz")
        self.mesh_folder = next((each.get("meshdir", "") for each in compilers if each.get("meshdir")), "")
        self.meshes = {self._mesh_name(each): each for root in self.roots for each in root.findall("asset/mesh")}
        self.classes: dict[str, dict[str, dict[str, str]]] = {}
        for root in self.roots:
            for default in root.findall("default"):
                self._class(default, {})

    def _document(self, path: Path) -> Element:
        self._read.add(real_path(path))
        return parse_xml(path.read_bytes(), path.name)

    def _with_included(self, root: Element) -> Iterator[Element]:
        """Yield the root and those of the files that it includes, R1."""
        waiting = [root]
        while waiting:
            root = waiting.pop()
            yield root
            inner = []
            for name in (each.get("file", "") for each in root.iter("include")):
                file = file_inside(self.folder, name)
                if file is None:
                    self.left_out.add(f"{name[:80]} is not in the folder of {self.path.name}")
                elif file in self._read:
                    self.left_out.add(f"{name[:80]} is included twice or by itself")
                else:
                    inner.append(self._document(file))
            waiting += reversed(inner)

    def _class(self, element: Element, inherited: Mapping[str, dict[str, str]], depth: int = 0) -> None:
        own = {kind: dict(values) for kind, values in inherited.items()}
        for child in element:
            if child.tag != "default":
                own.setdefault(child.tag, {}).update(child.attrib)
        self.classes[element.get("class", "main")] = own
        for child in element.findall("default"):
            self._class(child, own, depth + 1)

    def bodies(self) -> Iterator[SceneBody]:
        """Yield every geom, and every site that is named as a passage, at its place."""
        for root in self.roots:
            for world in root.findall("worldbody"):
                yield from self._inside(world, np.eye(4), (), "main")

    def _inside(self, element: Element, at: Matrix, names: tuple[str, ...], childclass: str) -> Iterator[SceneBody]:
        childclass = element.get("childclass", childclass)
        for child in element:
            if child.tag in {"body", "frame"}:
                name = (child.get("name", ""),) if child.get("name") else ()
                try:
                    place = at @ self._pose(child.attrib)
                except ValueError as error:
                    self.left_out.add(f"{child.tag} {child.get('name', '')[:60]}: {error}")
                    continue
                yield from self._inside(child, place, (*name, *names), childclass)
            elif child.tag in {"geom", "site"}:
                self._count += 1
                if self._count > MOST_PARTS:
                    detail = f"{self.path.name} has more than {MOST_PARTS:,} geoms"
                    raise Rejection("source", Reason.TOO_LARGE, detail, "leave its furniture out")
                found = self._one(child, at, names, childclass)
                if found is not None:
                    yield found

    def _one(self, child: Element, at: Matrix, names: tuple[str, ...], childclass: str) -> SceneBody | None:
        defaults = self.classes.get(child.get("class", childclass), self.classes.get("main", {})).get(child.tag, {})
        said = {**defaults, **child.attrib}
        name = child.get("name", "") or said.get("mesh", "")
        called = (name, *names) if name else names
        if child.tag == "site" and not name.lower().startswith("door"):
            return None
        kind = said.get("type", "mesh" if "mesh" in said else "sphere")
        try:
            place = at @ self._pose(said)
            if kind == "box":
                size = _numbers(said.get("size", ""), 3)
                made = body_from_box(called, place, np.array(size))
            elif kind == "mesh":
                points, faces = self._mesh(said.get("mesh", ""))
                made = body_from_triangles(called, points @ place[:3, :3].T + place[:3, 3], faces)
            else:
                return None
        except (ValueError, OverflowError, shapely.errors.ShapelyError) as error:
            self.left_out.add(f"{child.tag} {name[:60]}: {error}")
            return None
        return made

    def _pose(self, said: Mapping[str, str]) -> Matrix:
        from scipy.spatial.transform import Rotation

        pose = np.eye(4)
        pose[:3, 3] = _numbers(said.get("pos", "0 0 0"), 3)
        if "quat" in said:
            w, x, y, z = _numbers(said["quat"], 4)
            if not math.hypot(w, x, y, z) > 0:
                raise ValueError("its quat is 0")
            pose[:3, :3] = Rotation.from_quat([x, y, z, w]).as_matrix()
        elif "euler" in said:
            angles = _numbers(said["euler"], 3)
            pose[:3, :3] = Rotation.from_euler(self._euler(), angles, degrees=self.degrees).as_matrix()
        elif "axisangle" in said:
            x, y, z, angle = _numbers(said["axisangle"], 4)
            axis = np.array([x, y, z]) / max(math.hypot(x, y, z), TINY)
            pose[:3, :3] = Rotation.from_rotvec(axis * (math.radians(angle) if self.degrees else angle)).as_matrix()
        return pose

    def _euler(self) -> str:
        """MuJoCo's small letters turn with the frame, capital ones do not: the other way round than SciPy's."""
        return (
            self.sequence.swapcase() if set(self.sequence.lower()) <= set("xyz") and len(self.sequence) == 3 else "XYZ"
        )

    def _mesh_name(self, element: Element) -> str:
        return element.get("name") or Path(element.get("file", "")).stem

    def _mesh(self, name: str) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]:
        element = self.meshes.get(name)
        if element is None:
            raise ValueError(f"names a mesh {name[:60]!r} that is not there")
        scale = np.array(_numbers(element.get("scale", "1 1 1"), 3))
        if element.get("vertex"):
            flat = np.array([float(each) for each in element.get("vertex", "").split()])
            if len(flat) < 12 or len(flat) % 3 or not np.isfinite(flat).all():
                raise ValueError("its mesh has no triples of numbers")
            points = flat.reshape(-1, 3) * scale
            if element.get("face"):
                faces = np.array([int(each) for each in element.get("face", "").split()], np.int64).reshape(-1, 3)
                if faces.min() < 0 or faces.max() >= len(points):
                    raise ValueError("a face of its mesh names a vertex that is not there")
                return points, faces
            from scipy.spatial import ConvexHull, QhullError

            try:
                return points, ConvexHull(points).simplices.astype(np.int64)
            except QhullError:
                raise ValueError("its mesh is flat") from None
        name = element.get("file", "")
        place = f"{self.mesh_folder}/{name}" if self.mesh_folder else name
        points, faces = load_mesh_beside(self.folder, place, self.left_out)
        return points * scale, faces


def _numbers(text: str, count: int) -> list[float]:
    found = [float(each) for each in text.split()]
    if len(found) != count or not all(map(math.isfinite, found)):
        raise ValueError(f"expected {count} numbers, found {text[:60]!r}")
    return found
