"""A Gazebo file as bodies in the world: models within models, includes, poses and frames resolved.

R1  Of a link's visuals and collisions those count that are the fuller: fewer meshes missing, then more wall in them.
R2  A model that is included is read from its folder's newest ``.sdf``; one that is missing or damaged is named and left
    out, and so are a link and a mesh.
R3  A model is fixed where it, or one that contains it, is ``static``. Actors and lights are no bodies.
R4  Where the world was saved with its state, a model stands where the state says.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipeline.rejection import Reason, Rejection
from pipeline.sources.drawn_storeys import united
from pipeline.sources.gazebo_poses import Frames, Matrix, matrix_of, placed
from pipeline.sources.gazebo_shapes import Shapes, named
from pipeline.sources.left_out import LeftOut
from pipeline.sources.uris import Places
from pipeline.sources.xml_tree import Element, parse_xml
from pipeline.values import Mesh

MAX_MODELS = 5_000
MAX_FACES = 5_000_000
_ADVICE = "correct it, or leave the model out"


@dataclass(frozen=True, eq=False)
class Body:
    """A model's own links in world axes, metres; ``name`` is the model's, ``links`` are the links' names."""

    name: str
    fixed: bool
    mesh: Mesh
    links: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Place:
    """Where in the file, and in the world, a model is met."""

    folder: Path
    files: tuple[Path, ...]
    pose: Matrix
    fixed: bool


class Scene:
    """Reads one file and all that it includes; ``missing`` names what was not to be had, ``files`` what was read.

    ``left_out`` has what was there and could not be read.
    """

    def __init__(self, path: Path, places: Places) -> None:
        self.left_out = LeftOut()
        self._places, self._shapes = places, Shapes(places, self.left_out)
        self._path = path.resolve()
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

    def bodies(self) -> Iterator[Body]:
        """Yield the bodies of the file's worlds, or of its models where it has no world."""
        root = self._tree(self._path)
        here = _Place(self._path.parent, (self._path,), np.eye(4), fixed=False)
        worlds = root.findall("world")
        for scope in worlds or [root]:
            state = {each.get("name", ""): each for each in scope.findall("state/model")}  # R4
            yield from self._inner(scope, here, Frames(scope, self._path.name), state)

    def _inner(self, scope: Element, place: _Place, frames: Frames, state: dict[str, Element]) -> Iterator[Body]:
        for child in scope:
            with self.left_out.part():  # R2
                if child.tag == "model":
                    saved = state.get(child.get("name", ""))
                    pose = matrix_of(saved.find("pose"), "state") if saved is not None else frames.pose(child)
                    yield from self._model(child, child.get("name", ""), place, place.pose @ pose)
                elif child.tag == "include":
                    yield from self._include(child, place, frames, state)

    def _model(self, model: Element, name: str, place: _Place, pose: Matrix) -> Iterator[Body]:
        self._met += 1
        if self._met > MAX_MODELS:
            detail = f"{self._path.name} holds more than {MAX_MODELS:,} models"
            raise Rejection("source", Reason.TOO_LARGE, detail, "leave models out")
        fixed = place.fixed or _is_true(model.findtext("static"))  # R3
        here = _Place(place.folder, place.files, placed(model, pose, name), fixed)
        frames = Frames(model, name)
        parts = []
        for link in model.findall("link"):
            with self.left_out.part():
                parts.append(self._link(link, here, frames, name))
        mesh = united(parts)
        self._faces += len(mesh.faces)
        if self._faces > MAX_FACES:
            detail = f"{self._path.name} has more than {MAX_FACES:,} faces"
            raise Rejection("source", Reason.TOO_LARGE, detail, "leave its furniture out")
        if len(mesh.faces):
            yield Body(name, fixed, mesh, tuple(link.get("name", "") for link in model.findall("link")))
        yield from self._inner(model, here, frames, {})

    def _include(self, include: Element, place: _Place, frames: Frames, state: dict[str, Element]) -> Iterator[Body]:
        """R2."""
        uri = (include.findtext("uri") or "").strip()
        file = self._model_file(uri, place.folder)
        model = self._tree(file).find("model") if file is not None else None
        if file is None or model is None:
            self._missing[named(uri)] = None
            return
        if file in place.files:
            detail = f"{self._path.name}: model {named(uri)} includes itself"
            raise Rejection("source", Reason.UNREADABLE, detail, _ADVICE)
        name = include.findtext("name") or model.get("name") or ""
        own = Frames(self._tree(file), name).pose(model) if include.find("pose") is None else frames.pose(include)
        saved = state.get(name)
        pose = matrix_of(saved.find("pose"), "state") if saved is not None else own
        fixed = place.fixed or _is_true(include.findtext("static"))
        inner = _Place(file.parent, (*place.files, file), place.pose, fixed)
        yield from self._model(model, name, inner, place.pose @ pose)

    def _model_file(self, uri: str, folder: Path) -> Path | None:
        if (uri, folder) not in self._included:
            self._included[uri, folder] = _model_file(self._places.find(uri, folder))
        return self._included[uri, folder]

    def _link(self, link: Element, place: _Place, frames: Frames, name: str) -> Mesh:
        """R1."""
        at = place.pose @ frames.pose(link)
        kinds = [self._shown(link.findall(tag), place, at, frames, name) for tag in ("visual", "collision")]
        return min(kinds, key=lambda kind: (kind[0], -_wall_area(kind[1])))[1]

    def _shown(self, things: list[Element], place: _Place, link: Matrix, frames: Frames, name: str) -> tuple[int, Mesh]:
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
                parts.append(_moved(mesh, self._thing_pose(thing, link, place, frames, name)))
        return missing, united(parts)

    @staticmethod
    def _thing_pose(thing: Element, link: Matrix, place: _Place, frames: Frames, name: str) -> Matrix:
        pose = thing.find("pose")
        base = (pose.get("relative_to") or "").strip() if pose is not None else ""
        start = place.pose @ frames.at(base) if base else link
        return start @ matrix_of(pose, f"{thing.tag} of {name}")

    def _tree(self, file: Path) -> Element:
        if file not in self._trees:
            try:
                data = file.read_bytes()
            except OSError as error:
                detail = f"{file.name}: {error.strerror}"
                raise Rejection("source", Reason.UNREADABLE, detail, "check its permissions") from None
            root = parse_xml(data, file.name)
            if root.tag != "sdf":
                detail = f"{file.name}: expected <sdf>, found <{root.tag[:40]}>"
                raise Rejection("source", Reason.UNREADABLE, detail, "give an SDF world or model")
            self._trees[file] = root
        return self._trees[file]


def _model_file(found: Path | None) -> Path | None:
    """R2: the ``.sdf`` of a model's folder that ``model.config`` names last, else ``model.sdf``."""
    if found is None or found.is_file():
        return found
    config = found / "model.config"
    names = ["model.sdf"]
    if config.is_file():
        with suppress(Rejection, OSError):  # one that cannot be read names no file; the usual one may be there
            listed = [(each.text or "").strip() for each in parse_xml(config.read_bytes(), config.name).findall("sdf")]
            names = [*reversed(listed), *names]
    files = [found / name for name in names if name and Path(name).name == name]
    return next((file.resolve() for file in files if file.is_file() and not file.is_symlink()), None)


def _moved(mesh: Mesh, pose: Matrix) -> Mesh:
    return Mesh(mesh.vertices @ pose[:3, :3].T + pose[:3, 3], mesh.faces)


def _wall_area(mesh: Mesh) -> float:
    corners = mesh.vertices[mesh.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return float(np.linalg.norm(normal[:, :2], axis=1).sum()) if len(normal) else 0.0


def _is_true(text: str | None) -> bool:
    return (text or "").strip().lower() in {"1", "true"}
