"""Mesh files (.ply .obj .glb .gltf .stl .dae .off): one file or a folder of them, each the levels of a house.

Frames: a z-up mesh keeps x = X, y = Y. A y-up one is turned upright by a quarter turn about X: x = X, y = -Z, height Y,
so that a chiral house stays what it is. A model that stands far from its origin is moved near; the way back is in the
level's frame.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from houseexpo.errors import ConfigError
from houseexpo.plan import Frame
from pipeline.rejection import Reason, Rejection
from pipeline.sources.level_names import share_out
from pipeline.sources.levels import FoundLevel, find_levels
from pipeline.sources.mesh_load import SUFFIXES, convention, load_scene
from pipeline.sources.named_scene import sort_faces, structural
from pipeline.sources.naming import base_id, level_id, list_files, sha256
from pipeline.sources.placing import Shift, near_shift
from pipeline.sources.scene import Scene
from pipeline.sources.units import UNITS, UPS, Frame3D, detect
from pipeline.top_view import top_view
from pipeline.values import Input, Level, Mesh

CHOICES = {"up": ("auto", *UPS), "units": ("auto", *UNITS)}


def find(path: str, **options: str) -> Iterator[Input]:
    """List the mesh files at or under a path; options ``up`` (auto, y, z) and ``units`` (auto, m, cm, mm, in, ft).

    Raises
    ------
    ConfigError
        Where an option or its value is unknown.
    Rejection
        MISSING_FILE where the path does not exist.
    """
    for option, value in options.items():
        if option not in CHOICES or value not in CHOICES[option]:
            known = ", ".join(CHOICES.get(option, tuple(CHOICES)))
            raise ConfigError(f"mesh files: {option}={value!r} is unknown; expected one of {known}")
    for file, name in list_files(path, SUFFIXES):
        yield Input(base_id(name), "mesh_file", str(file), options=tuple(sorted({**options, "file": name}.items())))


def read(item: Input) -> Iterator[Level]:
    """Yield the levels of one mesh file, from the lowest to the highest.

    Options ``scale`` (a number) and ``drop_nodes`` (a JSON list of patterns) come from ``overrides.toml``.

    Raises
    ------
    Rejection
        Where the file cannot be read, is no house in any known unit, or has no level.
    """
    options = dict(item.options)
    path = Path(item.path)
    scale = float(options.get("scale", "1"))  # a person's word: the unit is looked for in a house of true size
    raw = load_scene(path).without(json.loads(options.get("drop_nodes", "[]"))).scaled(scale)
    if not len(raw.mesh.faces):
        detail = f"{path.name} holds nothing but what {options['drop_nodes']} names"
        raise Rejection("source", Reason.EMPTY, detail, "take a pattern out of drop_nodes")
    up = convention(path)
    try:
        found = detect(structural(raw), up, options.get("up", "auto"), options.get("units", "auto"), path.name)
    except Rejection as rejection:
        raise rejection.pictured(top_view(raw.mesh, UPS[up.up])) from None
    upright = _upright(raw.mesh, found)
    shift = near_shift(upright.vertices)
    named = sort_faces(Scene(Mesh(upright.vertices - shift, upright.faces), raw.owner, raw.parts))
    try:
        levels = find_levels(named.solid, named.floor, named.ceiling)
    except Rejection as rejection:
        raise rejection.pictured(top_view(upright)) from None
    shares = share_out(named, [level.floor_z for level in levels])
    provenance = {
        "source": "mesh",
        "file": options.get("file", path.name),
        "sha256": sha256(path),
        "units": found.units,
        "up": found.up,
        **({"scale": scale} if scale != 1.0 else {}),
    }
    for number, (level, share) in enumerate(zip(levels, shares, strict=True)):
        yield Level(
            id=level_id(item.id, number, len(levels)),
            walls=level.walls,
            ceiling_m=level.ceiling_m,
            frame=_frame(level, found, shift, number),
            floor=level.floor,
            leaves=share.leaves,
            furniture=share.furniture,
            rooms=share.rooms,
            room_count=share.room_count,
            openings=share.openings,
            n_objects=len(share.furniture),
            provenance=provenance,
        )


def _upright(raw: Mesh, found: Frame3D) -> Mesh:
    """Turn a mesh z-up and scale it to metres."""
    points = raw.vertices * found.metres
    if found.up == "y":
        points = np.column_stack([points[:, 0], -points[:, 2], points[:, 1]])
    return Mesh(points, raw.faces)


def _frame(level: FoundLevel, found: Frame3D, shift: Shift, number: int) -> Frame:
    x, y, z = shift
    floor = level.floor_z + z
    if found.up == "y":
        return Frame(((1.0, 0.0, x), (0.0, -1.0, -y)), "y", floor, number)
    return Frame(((1.0, 0.0, x), (0.0, 1.0, y)), "z", floor, number)
