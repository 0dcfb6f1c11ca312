"""Read a Gazebo world or model (SDF) as bodies, one a model: its name, triangles (world axes, metres), fixed or not.

Poses and the files that URIs name are resolved here; ``gazebo`` makes levels of the bodies.

R1  Of a link's visuals and collisions those count that are the fuller: fewer meshes missing, then more wall in them.
R2  A model that is included is read from its folder's newest ``.sdf``; one that is missing or damaged is named and left
    out, and so are a link and a mesh.
R3  A model is fixed where it, or one that contains it, is ``static``. Actors and lights are no bodies.
R4  Where the world was saved with its state, a model stands where the state says.

**Poses**: numbers become 4 x 4 matrices, relative to frames.

P1  A pose is x y z roll pitch yaw (metres, radians; ``degrees`` says otherwise), or x y z and a quaternion x y z w.
P2  It is relative to the frame that it names (``relative_to``; ``frame`` in SDF 1.5 and 1.6), else to what contains it;
    a ``frame`` without a name for its pose is relative to what it is attached to.
P3  A name with ``::`` is looked up in the model of that name.

**Geometry** as triangles, in the frame of its visual or collision; metres.

S1  Planes and height maps are ground, and no part of a house.
S2  A mesh takes the scale that is given. COLLADA's own unit counts, its up axis does not: Gazebo's loader does not read
    it (gazebo-classic, issue 1305), and worlds are made to look right in Gazebo.
S3  A round body has ROUND_SIDES sides.
S4  Boxes, cylinders and polylines of a link that stand upright and are equally high are one body where they touch:
    worlds write a wall in convex pieces.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from urllib.parse import unquote

import numpy as np
import numpy.typing as npt
import shapely
import shapely.affinity

from houseexpo.file_kinds import format_suffix
from houseexpo.files import real_path
from pipeline.geometry.meshes import NO_MESH, merge_meshes
from pipeline.geometry.prisms import Prism, Prisms, make_prisms
from pipeline.rejection import Reason, Rejection
from pipeline.sources.drawn_storeys import polygon_from_ring
from pipeline.sources.files import Element, LeftOutParts, parse_xml
from pipeline.sources.meshes.formats import MAX_FACES, SUFFIXES, frame_convention, load_scene
from pipeline.sources.tolerances import FILE_GRID_M, LONGEST_PLACEMENT_M, MOST_FILES, ROUND_SIDES, TINY
from pipeline.tolerances import SAME
from pipeline.values import Mesh

Matrix = npt.NDArray[np.float64]
_ADVICE_POSE = "correct it, or leave the model out"
_OWN = frozenset({"", "__model__", "world", "__root__"})


def parse_numbers(text: str | None, count: int, what: str) -> list[float]:
    """Return the numbers of a text; raise Rejection if they are not ``count`` finite ones."""
    parts = (text or "").split()
    try:
        values = [float(part) for part in parts]
    except ValueError:
        values = []
    if len(values) != count or not all(math.isfinite(value) and abs(value) < LONGEST_PLACEMENT_M for value in values):
        detail = f"{what}: expected {count} finite numbers, found {' '.join(parts)[:80]!r}"
        raise Rejection("source", Reason.UNREADABLE, detail, _ADVICE_POSE)
    return values


def pose_matrix(pose: Element | None, what: str) -> Matrix:
    """P1; the identity where there is no pose."""
    if pose is None or not (pose.text or "").split():
        return np.eye(4)
    quaternion = pose.get("rotation_format") == "quat_xyzw"
    values = parse_numbers(pose.text, 7 if quaternion else 6, f"pose of {what}")
    matrix = np.eye(4)
    if quaternion:
        matrix[:3, :3] = _from_quaternion(values[3:], what)
    else:
        degrees = pose.get("degrees", "false").strip().lower() in {"true", "1"}
        matrix[:3, :3] = _from_angles([math.radians(v) if degrees else v for v in values[3:]])
    matrix[:3, 3] = values[:3]
    return matrix


class ModelFrames:
    """The frames of one model: its links, frames, joints and inner models, each at a place in the model."""

    def __init__(self, model: Element, name: str) -> None:
        self._name = name
        self._found: dict[str, Element] = {}
        for child in model:
            if child.tag in {"link", "frame", "model", "joint", "include"} and child.get("name"):
                self._found.setdefault(str(child.get("name")), child)

    def pose(self, element: Element, asked: tuple[str, ...] = ()) -> Matrix:
        """P2: the place in the model of something that it contains."""
        pose = element.find("pose")
        what = f"{element.tag} {element.get('name', '')!r} of {self._name}"
        base = (pose.get("relative_to") or pose.get("frame") or "") if pose is not None else ""
        if not base:
            base = {"frame": element.get("attached_to", ""), "joint": element.findtext("child", "")}.get(
                element.tag, ""
            )
        return self.at(base.strip(), asked) @ pose_matrix(pose, what)

    def at(self, name: str, asked: tuple[str, ...] = ()) -> Matrix:
        """Return a named frame's place in the model.

        Gazebo saves what was a model in a model as frames and links with names such as ``inner::link``: a whole name
        comes before its parts.
        """
        first, rest = (name, "") if name in self._found else name.partition("::")[::2]
        if first in _OWN:
            return np.eye(4)
        if name in asked:
            detail = f"{self._name}: frame {name!r} is relative to itself"
            raise Rejection("source", Reason.UNREADABLE, detail, _ADVICE_POSE)
        element = self._found.get(first)
        if element is None:
            detail = f"{self._name}: expected a frame {name!r}, found none of that name"
            raise Rejection("source", Reason.UNREADABLE, detail, _ADVICE_POSE)
        here = self.pose(element, (*asked, name))
        return here @ ModelFrames(element, first).at(rest) if rest and element.tag == "model" else here  # P3


def model_pose(model: Element, pose: Matrix, name: str) -> Matrix:
    """Return where a model's own frame is, given the pose of its placement frame."""
    frame = (model.get("placement_frame") or "").strip()
    return pose @ np.linalg.inv(ModelFrames(model, name).at(frame)) if frame else pose


def _from_angles(angles: list[float]) -> Matrix:
    (cr, cp, cy), (sr, sp, sy) = np.cos(angles), np.sin(angles)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def _from_quaternion(values: list[float], what: str) -> Matrix:
    length = math.hypot(*values)
    if length < TINY:
        raise Rejection("source", Reason.UNREADABLE, f"pose of {what}: a quaternion of length 0", _ADVICE_POSE)
    x, y, z, w = (value / length for value in values)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


class GeometryMeshes:
    """Makes geometry into triangles; ``missing`` names the meshes that were not to be had."""

    def __init__(self, places: ModelFinder, left_out: LeftOutParts) -> None:
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
        return NO_MESH  # S1

    def _mesh(self, shape: Element, folder: Path, what: str) -> Mesh | None:
        """S2."""
        uri = (shape.findtext("uri") or "").strip()
        scale = parse_numbers(shape.findtext("scale") or "1 1 1", 3, f"scale of {what}")
        path = self._places.find(uri, folder)
        if path is None or not path.is_file() or format_suffix(path) not in SUFFIXES:
            self.missing[uri_without_folders(uri)] = None
            return None
        if path not in self._meshes:
            self.files[path] = None
            self._meshes[path] = None
            with self._left_out.part():
                self._meshes[path] = self._in_metres(path)
        mesh = self._meshes[path]
        if mesh is None:
            return None
        return Mesh(mesh.vertices * scale, mesh.faces[:, ::-1] if np.prod(scale) < 0 else mesh.faces)

    def _in_metres(self, path: Path) -> Mesh:
        scene = load_scene(path)
        if scene.left_out:
            self._left_out.add(f"{path.name}: {scene.left_out}")
        metres = frame_convention(path).metres if format_suffix(path) == ".dae" else None
        return scene.mesh if metres is None else Mesh(scene.mesh.vertices * metres, scene.mesh.faces)


def uri_without_folders(uri: str) -> str:
    """Return a URI as a note may show it: without the folders of somebody's machine."""
    return uri if "://" in uri and not uri.startswith("file:") else Path(uri).name


def _box(shape: Element, what: str) -> Mesh:
    x, y, z = _sizes(shape.findtext("size"), 3, what)
    return Prisms([Prism(shapely.box(-x / 2, -y / 2, x / 2, y / 2), -z / 2, z / 2)])


def _cylinder(shape: Element, what: str) -> Mesh:
    (radius,), (length,) = _sizes(shape.findtext("radius"), 1, what), _sizes(shape.findtext("length"), 1, what)
    return Prisms([Prism(_round(radius), -length / 2, length / 2)])


def _capsule(shape: Element, what: str) -> Mesh:
    (radius,), (length,) = _sizes(shape.findtext("radius"), 1, what), _sizes(shape.findtext("length"), 1, what)
    return make_prisms(_round(radius), -length / 2 - radius, length / 2 + radius)


def _sphere(shape: Element, what: str) -> Mesh:
    (radius,) = _sizes(shape.findtext("radius"), 1, what)
    return _ball(np.full(3, radius))


def _ellipsoid(shape: Element, what: str) -> Mesh:
    return _ball(np.array(_sizes(shape.findtext("radii"), 3, what)))


def _polyline(shape: Element, what: str) -> Mesh:
    """Rings inside the first are holes in it."""
    (height,) = _sizes(shape.findtext("height"), 1, what)
    ring = polygon_from_ring(parse_numbers(point.text, 2, f"polyline of {what}") for point in shape.findall("point"))
    return NO_MESH if ring is None else Prisms([Prism(ring, 0.0, height)])


def _round(radius: float) -> shapely.Polygon:  # S3
    angles = np.linspace(0.0, 2.0 * np.pi, ROUND_SIDES, endpoint=False)
    return shapely.Polygon(radius * np.column_stack([np.cos(angles), np.sin(angles)]))


def _ball(radii: np.ndarray) -> Mesh:
    """Rings of ROUND_SIDES points from pole to pole, as faces between each two."""
    rings = ROUND_SIDES // 2
    theta, phi = np.meshgrid(
        np.linspace(0.0, np.pi, rings + 1), np.arange(ROUND_SIDES) * 2 * np.pi / ROUND_SIDES, indexing="ij"
    )
    unit = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
    i, j = (each.ravel() for each in np.meshgrid(np.arange(rings), np.arange(ROUND_SIDES), indexing="ij"))
    a, b = i * ROUND_SIDES + j, i * ROUND_SIDES + (j + 1) % ROUND_SIDES
    faces = np.concatenate(
        [np.column_stack([a, a + ROUND_SIDES, b]), np.column_stack([b, a + ROUND_SIDES, b + ROUND_SIDES])]
    )
    return Mesh((unit * radii).reshape(-1, 3), faces.astype(np.int64))


def _sizes(text: str | None, count: int, what: str) -> list[float]:
    values = parse_numbers(text, count, f"size of {what}")
    if min(values) < 0:
        detail = f"size of {what}: expected 0 m or more, found {values}"
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

_ADVICE = "correct it, or leave the model out"


@dataclass(frozen=True, eq=False)
class ModelBody:
    """A model's own links in world axes, metres; ``name`` is the model's, ``links`` and ``parts`` are those of each."""

    name: str
    fixed: bool
    mesh: Mesh
    links: tuple[str, ...] = ()
    parts: tuple[Mesh, ...] = ()


@dataclass(frozen=True)
class _Place:
    """Where in the file, and in the world, a model is met."""

    folder: Path
    files: tuple[Path, ...]
    pose: Matrix
    fixed: bool


class SceneReader:
    """Reads one file and all that it includes; ``missing`` names what was not to be had, ``files`` what was read.

    ``left_out`` has what was there and could not be read.
    """

    def __init__(self, path: Path, places: ModelFinder) -> None:
        self.left_out = LeftOutParts()
        self._places, self._shapes = places, GeometryMeshes(places, self.left_out)
        self._path = real_path(path)
        self._trees: dict[Path, Element] = {}
        self._included: dict[tuple[str, Path], Path | None] = {}
        self._met, self._faces = 0, 0
        self._missing: dict[str, None] = {}

    @property
    def missing(self) -> tuple[str, ...]:
        """Models and meshes that are left out, by name, sorted."""
        return tuple(sorted({**self._missing, **self._shapes.missing}))

    @property
    def files(self) -> tuple[Path, ...]:
        """All files that were read, sorted."""
        return tuple(sorted({**dict.fromkeys(self._trees), **self._shapes.files}))

    def bodies(self) -> Iterator[ModelBody]:
        """Yield the bodies of the file's worlds, or of its models where it has no world."""
        root = self._tree(self._path)
        here = _Place(self._path.parent, (self._path,), np.eye(4), fixed=False)
        worlds = root.findall("world")
        for scope in worlds or [root]:
            state = {each.get("name", ""): each for each in scope.findall("state/model")}  # R4
            yield from self._inner(scope, here, ModelFrames(scope, self._path.name), state)

    def _inner(
        self, scope: Element, place: _Place, frames: ModelFrames, state: dict[str, Element]
    ) -> Iterator[ModelBody]:
        for child in scope:
            with self.left_out.part():  # R2
                if child.tag == "model":
                    saved = state.get(child.get("name", ""))
                    pose = pose_matrix(saved.find("pose"), "state") if saved is not None else frames.pose(child)
                    yield from self._model(child, child.get("name", ""), place, place.pose @ pose)
                elif child.tag == "include":
                    yield from self._include(child, place, frames, state)

    def _model(self, model: Element, name: str, place: _Place, pose: Matrix) -> Iterator[ModelBody]:
        self._met += 1
        if self._met > MOST_FILES:
            detail = f"{self._path.name} holds more than {MOST_FILES:,} models"
            raise Rejection("source", Reason.TOO_LARGE, detail, "leave models out")
        fixed = place.fixed or _is_true(model.findtext("static"))  # R3
        here = _Place(place.folder, place.files, model_pose(model, pose, name), fixed)
        frames = ModelFrames(model, name)
        links = {}
        for k, link in enumerate(model.findall("link")):
            with self.left_out.part():
                links[k] = self._link(link, here, frames, name)
        mesh = merge_meshes(list(links.values()))
        self._faces += len(mesh.faces)
        if self._faces > MAX_FACES:
            detail = f"{self._path.name} has more than {MAX_FACES:,} faces"
            raise Rejection("source", Reason.TOO_LARGE, detail, "leave its furniture out")
        if len(mesh.faces):
            names = tuple(link.get("name", "") for link in model.findall("link"))
            yield ModelBody(name, fixed, mesh, names, tuple(links.get(k, NO_MESH) for k in range(len(names))))
        yield from self._inner(model, here, frames, {})

    def _include(
        self, include: Element, place: _Place, frames: ModelFrames, state: dict[str, Element]
    ) -> Iterator[ModelBody]:
        """Yield the bodies of an included model; one that is missing or damaged is named and left out."""
        uri = (include.findtext("uri") or "").strip()
        file = self._model_file(uri, place.folder)
        model = self._tree(file).find("model") if file is not None else None
        if file is None or model is None:
            self._missing[uri_without_folders(uri)] = None
            return
        if file in place.files:
            detail = f"{self._path.name}: model {uri_without_folders(uri)} includes itself"
            raise Rejection("source", Reason.UNREADABLE, detail, _ADVICE)
        name = include.findtext("name") or model.get("name") or ""
        own = ModelFrames(self._tree(file), name).pose(model) if include.find("pose") is None else frames.pose(include)
        saved = state.get(name)
        pose = pose_matrix(saved.find("pose"), "state") if saved is not None else own
        fixed = place.fixed or _is_true(include.findtext("static"))
        inner = _Place(file.parent, (*place.files, file), place.pose, fixed)
        yield from self._model(model, name, inner, place.pose @ pose)

    def _model_file(self, uri: str, folder: Path) -> Path | None:
        if (uri, folder) not in self._included:
            self._included[uri, folder] = _model_file(self._places.find(uri, folder))
        return self._included[uri, folder]

    def _link(self, link: Element, place: _Place, frames: ModelFrames, name: str) -> Mesh:
        """Return the fuller of a link's visuals and collisions: fewer meshes missing, then more wall in them."""
        at = place.pose @ frames.pose(link)
        kinds = [self._triangles_of(link.findall(tag), place, at, frames, name) for tag in ("visual", "collision")]
        return min(kinds, key=lambda kind: (kind[0], -_wall_area(kind[1])))[1]

    def _triangles_of(
        self, things: list[Element], place: _Place, link: Matrix, frames: ModelFrames, name: str
    ) -> tuple[int, Mesh]:
        """Return how many meshes are missing, and the triangles of the others in world axes."""
        parts, missing = [], 0
        for thing in things:
            geometry = thing.find("geometry")
            if geometry is None:
                continue
            mesh = self._shapes.of(geometry, place.folder, f"{thing.tag} {thing.get('name', '')!r} of {name}")
            if mesh is None:
                missing += 1
            elif len(mesh.faces):
                parts.append(_move(mesh, self._thing_pose(thing, link, place, frames, name)))
        return missing, merge_meshes(_unite_upright(parts))

    @staticmethod
    def _thing_pose(thing: Element, link: Matrix, place: _Place, frames: ModelFrames, name: str) -> Matrix:
        pose = thing.find("pose")
        base = (pose.get("relative_to") or "").strip() if pose is not None else ""
        start = place.pose @ frames.at(base) if base else link
        return start @ pose_matrix(pose, f"{thing.tag} of {name}")

    def _tree(self, file: Path) -> Element:
        if file not in self._trees:
            try:
                data = file.read_bytes()
            except OSError as error:
                detail = f"{file.name}: {error.strerror}"
                raise Rejection("source", Reason.UNREADABLE, detail, "check its permissions") from None
            root = parse_xml(data, file.name, self.left_out)
            if root.tag != "sdf":
                detail = f"{file.name}: expected <sdf>, found <{root.tag[:40]}>"
                raise Rejection("source", Reason.UNREADABLE, detail, "give an SDF world or model")
            self._trees[file] = root
        return self._trees[file]


def _model_file(found: Path | None) -> Path | None:
    """Return the ``.sdf`` of a model's folder that ``model.config`` names last, else ``model.sdf``."""
    if found is None or found.is_file():
        return found
    config = found / "model.config"
    names = ["model.sdf"]
    if config.is_file():
        with suppress(Rejection, OSError):  # one that cannot be read names no file; the usual one may be there
            listed = [(each.text or "").strip() for each in parse_xml(config.read_bytes(), config.name).findall("sdf")]
            names = [*reversed(listed), *names]
    files = [found / name for name in names if name and Path(name).name == name]
    return next((real_path(file) for file in files if file.is_file() and not file.is_symlink()), None)


def _move(mesh: Mesh, pose: Matrix) -> Mesh:
    if isinstance(mesh, Prisms) and abs(pose[2, 2] - 1.0) < SAME:  # neither tilted nor upside down
        plan = [*pose[:2, :2].ravel(), *pose[:2, 3]]
        return Prisms(
            Prism(
                shapely.affinity.affine_transform(each.area, plan), each.bottom_m + pose[2, 3], each.top_m + pose[2, 3]
            )
            for each in mesh.bodies
        )
    return Mesh(mesh.vertices @ pose[:3, :3].T + pose[:3, 3], mesh.faces)


def _unite_upright(parts: list[Mesh]) -> Iterator[Mesh]:
    """S4."""
    standing: dict[tuple[float, float], list[Prism]] = {}
    for part in parts:
        if not isinstance(part, Prisms):
            yield part
            continue
        for each in part.bodies:
            standing.setdefault((round(each.bottom_m / FILE_GRID_M), round(each.top_m / FILE_GRID_M)), []).append(each)
    for same in standing.values():
        area = shapely.union_all([each.area for each in same], grid_size=FILE_GRID_M) if len(same) > 1 else same[0].area
        yield make_prisms(area, same[0].bottom_m, same[0].top_m)


def _wall_area(mesh: Mesh) -> float:
    corners = mesh.vertices[mesh.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return float(np.linalg.norm(normal[:, :2], axis=1).sum()) if len(normal) else 0.0


def _is_true(text: str | None) -> bool:
    return (text or "").strip().lower() in {"1", "true"}


# Where the URIs of a Gazebo file lead: into the folder of the source and the given model folders, nowhere else.
#
# R1  ``model://NAME/...`` and ``package://NAME/...`` mean the folder NAME: in the source's folder, at any depth, or in
#     a model folder that was given (``--model-path``, ``GAZEBO_MODEL_PATH``, ``GZ_SIM_RESOURCE_PATH``).
# R2  ``file://`` and bare paths are relative to the file that names them, ``file://`` also to those folders, and may
#     begin with the name of one of them (as Gazebo looks in its resource paths); an absolute one must lie in them.
# R3  A host is never asked, and a path that leaves these folders, by ``..`` or by a link, is not opened.


VARIABLES = ("GAZEBO_MODEL_PATH", "GZ_SIM_RESOURCE_PATH")


def join_search_path(given: str, environment: Mapping[str, str]) -> str:
    """Return the folders to look in, those given first, as one text with the system's separator."""
    parts = [given, *(environment.get(name, "") for name in VARIABLES)]
    return os.pathsep.join(dict.fromkeys(part for text in parts for part in text.split(os.pathsep) if part))


class ModelFinder:
    """Finds files by URI; ``model_path`` as ``join_search_path`` returns it."""

    def __init__(self, root: Path, model_path: str) -> None:
        self._roots = [real_path(root), *(real_path(part) for part in model_path.split(os.pathsep) if part)]

    def find(self, uri: str, beside: Path) -> Path | None:
        """Return the file or folder that a URI means, or None if it is not there or may not be opened."""
        uri = uri.strip()
        scheme, found, path = uri.partition("://")
        if not found:
            return self._inside_roots(beside / uri) if uri else None
        if scheme in {"model", "package"}:  # R1
            name, _, rest = unquote(path).strip("/").partition("/")
            return next((p for folder in self._folders_of(name) if (p := self._inside_roots(folder / rest))), None)
        if scheme != "file":  # R3
            return None
        path = unquote(path)
        name, _, rest = path.partition("/")
        places = [beside / path, *(root / path for root in self._roots)]  # R2
        places += [root / rest for root in self._roots if rest and root.name == name]
        return next((real for place in places if (real := self._inside_roots(place))), None)

    def _folders_of(self, name: str) -> list[Path]:
        if not name or name in {".", ".."}:
            return []
        near = [place for root in self._roots for place in (root / name, root / "models" / name)]
        same = [root for root in self._roots if root.name == name]
        return [*(place for place in near if place.is_dir()), *same, *self._models.get(name, [])]

    @cached_property
    def _models(self) -> dict[str, list[Path]]:
        """Folders below the source's by name, the highest first."""
        found: dict[str, list[Path]] = {}
        for count, (folder, inner, _) in enumerate(os.walk(self._roots[0])):
            inner.sort()
            if count >= MOST_FILES:
                break
            found.setdefault(Path(folder).name, []).append(Path(folder))
        return {name: sorted(each, key=lambda p: (len(p.parts), p)) for name, each in found.items()}

    def _inside_roots(self, path: Path) -> Path | None:
        """Return a path if it lies in one of the folders that may be read, else None."""
        try:
            real = path.resolve(strict=True)
        except (OSError, RuntimeError, ValueError):
            return None
        return real if any(real.is_relative_to(root) for root in self._roots) else None
