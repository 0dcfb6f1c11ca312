"""Read mesh files (.ply .obj .glb .gltf .stl .dae .off): find up axis, unit and floors of each, and yield its levels.

A source is one file or a folder of them. What the names in a file say (doors, rooms, furniture) goes to the levels.

Frames: a z-up mesh keeps x = X, y = Y. A y-up one is turned upright by a quarter turn about X: x = X, y = -Z, height Y,
so that a chiral house stays what it is. A model that stands far from its origin is moved near; the way back is in the
level's frame.
"""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

import numpy as np

from houseexpo.errors import ConfigError
from houseexpo.files import sha256_of
from houseexpo.plan import Frame
from pipeline.png import draw_top_view
from pipeline.rejection import Reason, Rejection
from pipeline.sources.files import KEY as LEFT_OUT
from pipeline.sources.files import id_from_file_name, level_id, list_files_of_format
from pipeline.sources.meshes.formats import SUFFIXES, frame_convention, load_scene
from pipeline.sources.meshes.scene import MeshScene, PartNames
from pipeline.sources.named_scene import divide_among_levels, named_door_heights, sort_faces_by_role, structural_mesh
from pipeline.sources.roles import is_romance_word, split_words, word_role
from pipeline.sources.storeys.axis_and_unit import (
    TRIED,
    UPS,
    AxisAndUnit,
    SizeOptions,
    find_axis_and_unit,
    reject_exterior,
    scale_rejection,
)
from pipeline.sources.storeys.interior import check_interior
from pipeline.sources.storeys.levels import FoundLevel, Shift, find_levels, shift_to_origin
from pipeline.sources.storeys.scale import metres_per_unit, parse_positive_option
from pipeline.sources.storeys.size_evidence import NamedThing, kinds_by_word
from pipeline.sources.tolerances import COVER_MARGIN_M, USUAL_STOREY_M
from pipeline.values import IDLE, KEPT_FROM, Input, Level, Mesh

OPTIONS = ("up", "units", "scale", "storey_height")


def find(path: str, **options: str) -> Iterator[Input]:
    """List the mesh files at or under a path.

    Options: ``up`` (auto, y, z); ``units`` (auto, m, cm, mm, in, ft, or metres in a unit); ``scale`` (20 for a model at
    1:20); ``storey_height`` (metres, or "" if it is not given).

    Raises
    ------
    ConfigError
        Where an option or its value is unknown.
    Rejection
        MISSING_FILE where the path does not exist.
    """
    _requested_size(options)
    for file, name in list_files_of_format(path, SUFFIXES):
        yield Input(
            id_from_file_name(name), "mesh_file", str(file), options=tuple(sorted({**options, "file": name}.items()))
        )


def read(item: Input) -> Iterator[Level]:
    """Yield the levels of one mesh file, from the lowest to the highest.

    Options ``drop_nodes`` and ``floors`` (JSON lists) and ``keep`` come from ``overrides.toml``, and others may.

    Raises
    ------
    Rejection
        Where the file cannot be read, is no house in any known unit, or has no level.
    """
    options = dict(item.options)
    path = Path(item.path)
    whole, dropped = load_scene(path), json.loads(options.get("drop_nodes", "[]"))
    idle = [f"drop_nodes {name!r}: nothing in {path.name} has this name" for name in whole.unknown_names(dropped)]
    raw = whole.without(dropped).without_sky()
    if not len(raw.mesh.faces):
        detail = f"{path.name} holds nothing but what {options['drop_nodes']} names"
        raise Rejection("source", Reason.EMPTY, detail, "take a pattern out of drop_nodes")
    up = frame_convention(path)
    wish, keeps = _requested_size(options), options.get("keep") == "true"
    try:
        doors, things = named_door_heights(raw), measure_named_things(raw)
        found = find_axis_and_unit(structural_mesh(raw), up, wish, path.name, doors, things=things)
    except Rejection as rejection:
        shell = None if wish.is_about_size or keeps else reject_exterior(_turn_upright(raw.mesh, up.up), path.name)
        raise (shell or rejection).with_picture(draw_top_view(raw.mesh, UPS[up.up])) from None
    upright = _turn_upright(Mesh(raw.mesh.vertices * found.metres, raw.mesh.faces), found.up)
    if found.cut_off:
        upright = _raise_walls(upright, *found.cut_off)
    shift, kept_from = shift_to_origin(upright.vertices), ""
    named = sort_faces_by_role(MeshScene(Mesh(upright.vertices - shift, upright.faces), raw.owner, raw.parts))
    try:
        asked = [height - shift[2] for height in json.loads(options.get("floors", "[]"))]
        levels = find_levels(named.solid, named.floor, named.ceiling, asked)
        shares = divide_among_levels(named, [level.floor_z for level in levels])
        if TRIED in found.guesses or not any(share.leaves or share.rooms or share.openings for share in shares):
            inside = (level.walls for level in levels)
            kept_from = _reject_outside(inside, path.name, is_sized=TRIED not in found.guesses, keeps=keeps)
    except Rejection as rejection:
        why = rejection
        if TRIED in found.guesses:
            why = reject_exterior(upright, path.name) or scale_rejection(structural_mesh(raw), found, path.name)
        raise why.with_picture(draw_top_view(upright)) from None
    provenance = {
        "source": "mesh",
        "file": options.get("file", path.name),
        "sha256": sha256_of(path),
        "units": found.units,
        "up": found.up,
        **({LEFT_OUT: raw.left_out} if raw.left_out else {}),
        **({"wall_height": _describe_raising(*found.cut_off)} if found.cut_off else {}),
        **({"scale": float(options["scale"])} if options.get("scale", "1") != "1" else {}),
        **({IDLE: idle} if idle else {}),
        **({KEPT_FROM: kept_from} if kept_from else {}),
    }
    for number, (level, share) in enumerate(zip(levels, shares, strict=True)):
        yield Level(
            id=level_id(item.id, number, len(levels)),
            walls=level.walls,
            ceiling_m=level.ceiling_m,
            frame=_frame(level, found, shift, number),
            floor=level.floor,
            below=level.below,
            leaves=share.leaves,
            furniture=share.furniture,
            rooms=share.rooms,
            room_count=share.room_count,
            openings=share.openings + share.over_thresholds,
            windows=share.windows,
            unnamed_gaps=bool(share.over_thresholds) and not share.openings,
            n_objects=len(share.furniture),
            guesses=found.guesses,
            unit_m=found.metres,
            provenance=provenance,
        )


def _reject_outside(inside: Iterable[Mesh], name: str, *, is_sized: bool, keeps: bool) -> str:
    """Raise Rejection where no level has an inside; if a person ``keeps`` the house, return the reason instead."""
    try:
        check_interior(inside, name, is_sized=is_sized)
    except Rejection as rejection:
        if not keeps:
            raise
        return str(rejection.reason)
    return ""


def _requested_size(options: Mapping[str, str]) -> SizeOptions:
    """Return what the user says; raise ConfigError if that is unknown."""
    unknown = sorted(set(options) - {*OPTIONS, "file", "drop_nodes", "floors", "keep"})
    if unknown:
        raise ConfigError(f"mesh files: {unknown[0]} is unknown; expected one of {', '.join(OPTIONS)}")
    up, units = options.get("up", "auto"), options.get("units", "auto")
    if up not in {"auto", *UPS}:
        raise ConfigError(f"mesh files: up={up!r} is unknown; expected one of auto, {', '.join(UPS)}")
    scale = parse_positive_option("scale", options.get("scale", "1"))
    storey = options.get("storey_height", "")
    return SizeOptions(
        up, metres_per_unit(units), scale, parse_positive_option("storey_height", storey) if storey else None
    )


def _raise_walls(mesh: Mesh, foot: float, top: float) -> Mesh:
    """Draw walls that are cut off (``axis_and_unit``, R10) up to the usual height; what ends elsewhere stays."""
    z = mesh.vertices[:, 2]
    raised = np.where(np.abs(z - top) < COVER_MARGIN_M, foot + USUAL_STOREY_M, z)
    return Mesh(np.column_stack([mesh.vertices[:, :2], raised]), mesh.faces)


def _describe_raising(foot: float, top: float) -> str:
    return f"drawn up from {top - foot:.2f} m to {USUAL_STOREY_M} m"


def _turn_upright(mesh: Mesh, up: str) -> Mesh:
    if up != "y":
        return mesh
    x, y, z = mesh.vertices.T
    return Mesh(np.column_stack([x, -z, y]), mesh.faces)


def _frame(level: FoundLevel, found: AxisAndUnit, shift: Shift, number: int) -> Frame:
    x, y, z = shift
    floor = level.floor_z + z
    if found.up == "y":
        return Frame(((1.0, 0.0, x), (0.0, -1.0, -y)), "y", floor, number)
    return Frame(((1.0, 0.0, x), (0.0, 1.0, y)), "z", floor, number)


# Measure the things that a mesh file names: chairs, beds, doors and others whose usual sizes are known.
#
# T1  A thing is all that hangs on the innermost node whose name says what it is: a chair's legs have their own names.
# T2  The head noun decides, as in ``roles``; a word in the plural may be a group of things and says nothing.
# T3  Materials say nothing of sizes.


_AXES = {"y": 1, "z": 2}


def measure_named_things(scene: MeshScene) -> dict[str, tuple[NamedThing, ...]]:
    """Return the named things with their sizes in the file's unit, by up axis."""
    parts: dict[tuple[str, tuple[str, ...]], list[int]] = defaultdict(list)
    for index, part in enumerate(scene.parts):
        for kind, place in _kinds(part):
            parts[kind, place].append(index)
            break
    if not parts:
        return {}
    low, high = scene.part_boxes
    sizes = [(kind, high[which].max(axis=0) - low[which].min(axis=0)) for (kind, _), which in parts.items()]
    sizes = [(kind, size) for kind, size in sizes if np.isfinite(size).all()]
    return {
        up: tuple(NamedThing(kind, float(size[axis]), float(size.max())) for kind, size in sizes)
        for up, axis in _AXES.items()
    }


def _kinds(part: PartNames) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield what each name of a part says, its own first (T1), and where it hangs."""
    for depth in range(len(part.groups), 0, -1):
        if kind := _kind(part.groups[depth - 1]):
            yield kind, part.groups[:depth]
    if kind := _kind(part.mesh):
        yield kind, (*part.groups, part.mesh)


def _kind(name: str) -> str | None:
    """T2."""
    kinds = kinds_by_word()
    known = [word for word in split_words(name) if word in kinds or word_role(word)]
    if not known:
        return None
    return kinds.get(known[0] if is_romance_word(known[0]) else known[-1])
