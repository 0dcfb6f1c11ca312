"""Read a Gazebo world or model (SDF) and what it includes: yield its building's levels, with door leaves and furniture.

Frame: x = X, y = Y, z = Z of the world, metres.

R1  A body that can move is furniture, and so is a fixed one that stands inside the building and ends below its walls,
    but what is called floor and is flat, and what lies under the building's foot and is as high as a storey.
    The building is the fixed body that covers most of what the fixed ones cover together; where none does, all of them
    are. Where nothing is fixed, as in a model's own file, everything is.
R2  What is called a door is a leaf: it may stand open or shut. A model called door whose links are called walls, as the
    building editor calls them, is a wall. What is called furniture is that, except the building. A link that is called
    a door, in a model that is called neither a door nor furniture, and that is shaped as one, is a leaf of its own.
R3  The building's levels are found as those of any mesh; furniture goes to the level where it stands.
R4  Worlds for small robots have low walls. Where nothing stands head high, and the highest fixed body reaches
    0.1 m (those for vacuum cleaners are 0.15 m high), everything is stretched upwards until that is a storey high; the
    plan counts it as a guess.
R5  A fixed flat body called floor, beside the name of a room, is the floor of that room; one called threshold is the
    floor in a doorway (``named_scene``, R6).
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from houseexpo.plan import Frame
from pipeline.geometry.meshes import merge_meshes
from pipeline.rejection import Reason, Rejection
from pipeline.sources.files import add_losses, check_file, input_from_file, level_id
from pipeline.sources.gazebo_scene import ModelBody, ModelFinder, SceneReader, join_search_path
from pipeline.sources.meshes.scene import PartNames
from pipeline.sources.named_scene import NamedBody, NamedScene, divide_among_levels, is_floor, may_be_door
from pipeline.sources.roles import Role, names_furniture_with_doors, part_room_words, role_from_name, split_words
from pipeline.sources.storeys.levels import FoundLevel, Shift, find_levels, shift_to_origin
from pipeline.sources.storeys.surfaces import Surfaces
from pipeline.sources.tolerances import WALL_HEIGHT_M
from pipeline.tolerances import BESIDE_M, HAND_M, HEAD_M, MOST
from pipeline.values import Input, Level, Mesh, SourceObject

_GROUND = (Role.FLOOR, Role.THRESHOLD)


def find(path: str, **options: str) -> Iterator[Input]:
    """List one world or model; ``model_path`` are further folders to look for models in, ``root`` is the source's."""
    root = options.get("root", str(Path(path).absolute().parent))
    model_path = join_search_path(options.get("model_path", ""), os.environ)
    yield input_from_file(path, "gazebo", {**options, "root": root, "model_path": model_path})


def read(item: Input) -> Iterator[Level]:
    """Yield the levels of the building, lowest first; raise Rejection if the file cannot be read or has none."""
    options = dict(item.options)
    name = options.get("file", Path(item.path).name)
    scene = _scene(item)
    parts = _sort_bodies(list(scene.bodies()))
    if not len(parts.building.faces):
        detail = f"{name} has no fixed body; left out as missing: {', '.join(scene.missing[:5]) or 'nothing'}"
        detail += f"; as damaged: {scene.left_out.note}" if scene.left_out else ""
        raise Rejection("source", Reason.EMPTY, detail, "give the models' folder with --model-path")
    shift = shift_to_origin(parts.building.vertices)
    provenance = {"source": "gazebo", "file": name, "sha256": _digest(scene)} | scene.left_out.provenance
    if scene.missing:
        provenance["missing"] = ", ".join(scene.missing)
    guesses: tuple[str, ...] = ()
    low, high = (float(z) for z in np.quantile(parts.building.vertices[:, 2], (0.0, 1.0)))
    if HAND_M <= high - low < HEAD_M:  # R4
        parts = _stretch_bodies(parts, low, WALL_HEIGHT_M / (high - low))
        guesses = ("wall height",)
        provenance["wall_height"] = f"stretched from {high - low:.2f} m to {WALL_HEIGHT_M} m"
    named = _named_scene(parts, shift)
    try:
        levels = find_levels(named.solid)
    except Rejection as rejection:
        raise add_losses(rejection, provenance) from None
    rooms = divide_among_levels(named, [level.floor_z for level in levels])
    for number, (level, share) in enumerate(zip(levels, rooms, strict=True)):
        yield Level(
            id=level_id(item.id, number, len(levels)),
            walls=level.walls,
            ceiling_m=level.ceiling_m,
            frame=Frame(((1.0, 0.0, shift[0]), (0.0, 1.0, shift[1])), "z", level.floor_z + shift[2], number),
            floor=level.floor,
            below=level.below,
            leaves=tuple(_on_level(parts.leaves, level, shift)),
            furniture=tuple(_on_level(parts.furniture, level, shift)),
            rooms=share.rooms,
            openings=share.over_thresholds,
            unnamed_gaps=bool(share.over_thresholds),
            n_objects=len(parts.furniture),
            guesses=guesses,
            provenance=provenance,
        )


def _scene(item: Input) -> SceneReader:
    path, options = Path(item.path), dict(item.options)
    check_file(path)
    places = ModelFinder(Path(options.get("root") or path.absolute().parent), options.get("model_path", ""))
    return SceneReader(path, places)


def _digest(scene: SceneReader) -> str:
    digest = hashlib.sha256()
    for file in scene.files:
        digest.update(file.name.encode() + b"\0" + hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()


@dataclass(frozen=True, eq=False)
class _Parts:
    """What a scene consists of."""

    building: Mesh
    leaves: list[ModelBody]
    furniture: list[ModelBody]
    floors: list[ModelBody]
    thresholds: list[ModelBody]


def _sort_bodies(bodies: list[ModelBody]) -> _Parts:
    """Divide bodies into the building, leaves and furniture: what moves or ends below the walls is furniture."""
    bodies = [part for body in bodies for part in _without_leaves(body)]
    roles = {id(body): role for body in bodies if (role := _role(body))}
    leaves = [body for body in bodies if roles.get(id(body)) is Role.DOOR]
    flat = [body for body in bodies if body.fixed and roles.get(id(body)) in _GROUND and _says_where(body)]  # R5
    others = [body for body in bodies if roles.get(id(body)) is not Role.DOOR and body not in flat]
    fixed = [body for body in others if body.fixed] or others
    main = _building(fixed)
    furniture = [
        body
        for body in others
        if body is not main
        and (
            body not in fixed or roles.get(id(body)) is Role.FURNITURE or (main is not None and _stands_in(body, main))
        )
    ]
    building = merge_meshes([body.mesh for body in fixed if body not in furniture])
    furniture = [body for body in furniture if not (roles.get(id(body)) is Role.FLOOR and _is_flat(body))]  # a rug
    floors, thresholds = ([body for body in flat if roles[id(body)] is role] for role in _GROUND)
    return _Parts(building, leaves, furniture, floors, thresholds)


def _says_where(body: ModelBody) -> bool:
    """Tell whether a body is a room's floor, or a doorway's."""
    named = role_from_name(body.name)
    is_ground = named is not None and (named.role is Role.THRESHOLD or bool(part_room_words(PartNames((body.name,)))))
    return is_ground and _is_flat(body)


def _is_flat(body: ModelBody) -> bool:
    return is_floor(Surfaces.of(body.mesh), np.arange(len(body.mesh.faces)))


def _named_scene(parts: _Parts, shift: Shift) -> NamedScene:
    """Return the building with the floors of rooms and doorways (R5), moved near."""

    def near(mesh: Mesh) -> Mesh:
        return Mesh(mesh.vertices - shift, mesh.faces)

    return replace(
        NamedScene.plain(near(parts.building)),
        floors=tuple(NamedBody(part_room_words(PartNames((body.name,))), near(body.mesh)) for body in parts.floors),
        thresholds=tuple(NamedBody(tuple(split_words(body.name)), near(body.mesh)) for body in parts.thresholds),
    )


def _role(body: ModelBody) -> Role | None:
    """Return what the names of a body say that it is; what is called a door is a leaf."""
    named = role_from_name(body.name)
    if named and named.role is Role.DOOR:
        links = [role_from_name(link) for link in body.links]
        if any(link and link.role is Role.WALL for link in links):
            return Role.WALL
    return named.role if named else None


def _without_leaves(body: ModelBody) -> Iterator[ModelBody]:
    """Yield the links of a model that are leaves, each as a body, then the rest of it."""
    is_thing = _role(body) in {Role.DOOR, Role.FURNITURE, Role.LEFT_OUT} or names_furniture_with_doors(body.name)
    links = [] if is_thing else list(zip(body.links, body.parts, strict=True))
    leaves = [link for link in links if _is_leaf(*link)]
    rest = [link for link in links if not any(link is leaf for leaf in leaves)]
    if leaves and sum(len(mesh.faces) for _, mesh in rest):
        yield from (ModelBody(name, body.fixed, mesh) for name, mesh in leaves)
        names, parts = zip(*rest, strict=True)
        yield replace(body, mesh=merge_meshes(list(parts)), links=names, parts=parts)
    else:
        yield body


def _is_leaf(name: str, mesh: Mesh) -> bool:
    named = role_from_name(name)
    is_door = named is not None and named.role is Role.DOOR and named.sure
    return is_door and len(mesh.faces) > 0 and may_be_door(mesh, np.arange(len(mesh.faces)), sure=True)


def _stretch_bodies(parts: _Parts, floor_z: float, factor: float) -> _Parts:
    """Return all bodies so many times as high over the floor."""

    def stretch(mesh: Mesh) -> Mesh:
        return Mesh((mesh.vertices - (0.0, 0.0, floor_z)) * (1.0, 1.0, factor) + (0.0, 0.0, floor_z), mesh.faces)

    groups = (parts.leaves, parts.furniture, parts.floors, parts.thresholds)
    stretched = ([replace(body, mesh=stretch(body.mesh)) for body in group] for group in groups)
    return _Parts(stretch(parts.building), *stretched)


def _building(fixed: list[ModelBody]) -> ModelBody | None:
    if not fixed:
        return None
    low, high = _box(merge_meshes([body.mesh for body in fixed]))
    areas = [float(np.prod(np.diff(_box(body.mesh), axis=0)[0, :2])) for body in fixed]
    best = int(np.argmax(areas))
    # the building covers most of the plan box of all that is fixed
    return fixed[best] if areas[best] >= MOST * np.prod((high - low)[:2]) else None


def _stands_in(body: ModelBody, main: ModelBody) -> bool:
    (low, high), (floor, top) = _box(body.mesh), _box(main.mesh)
    if _is_storey_below(body, main):
        return False
    # what stands in the building hardly reaches outside, and stays under its top
    inside = bool((low[:2] >= floor[:2] - BESIDE_M).all() and (high[:2] <= top[:2] + BESIDE_M).all())
    return body is not main and inside and bool(high[2] < top[2] - BESIDE_M)


def _is_storey_below(body: ModelBody, main: ModelBody) -> bool:
    """Head high, and all of it under the building's foot."""
    (low, high), (floor, _) = _box(body.mesh), _box(main.mesh)
    return bool(high[2] - low[2] >= HEAD_M and high[2] <= floor[2] + BESIDE_M)


def _box(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    return mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)


def _on_level(bodies: list[ModelBody], level: FoundLevel, shift: Shift) -> Iterator[SourceObject]:
    """Yield the furniture that stands on a level."""
    floor = level.floor_z + shift[2]
    for body in bodies:
        low, high = body.mesh.vertices[:, 2].min(), body.mesh.vertices[:, 2].max()
        if low < floor + level.ceiling_m and high > floor:
            moved = body.mesh.vertices - (shift[0], shift[1], floor)
            yield SourceObject((body.name,), Mesh(moved, body.mesh.faces))
