"""Read a Habitat scene (``*.scene_instance.json``): yield the levels of its stage's mesh, as ``mesh_file`` reads it.

HSSD, ReplicaCAD and HM3D publish such scenes.

Format: Habitat-Sim's attribute JSON files ("SceneInstanceAttributes", "StageAttributes").

R1  ``stage_instance.template_name`` names the stage: a mesh of this name, or a ``.stage_config.json`` whose
    ``render_asset`` is the mesh. It is looked for in the scene's folder and the ``MOST_FOLDERS`` above it, also in
    their folders ``stages`` and ``configs``, and never outside of them.
R2  The stage is read as a mesh file is; its axis is that of the stage's configuration, where it says one.
R3  Objects are furniture, which the stage's walls do not need: they are counted, and their models are not opened.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import msgspec

from houseexpo.file_kinds import format_suffix
from houseexpo.files import sha256_of
from pipeline.rejection import Reason, Rejection
from pipeline.sources import mesh_file
from pipeline.sources.files import KEY, check_file, decode_document, file_inside, input_from_file
from pipeline.sources.tolerances import LARGEST_BYTES
from pipeline.values import Input, Level

MOST_FOLDERS: Final = 3
_CONFIG: Final = ".stage_config.json"
_MESHES: Final = (".glb", ".gltf", ".ply", ".obj")
_ADVICE: Final = "copy the data set's folder stages beside the scenes, or build the stage's mesh itself"


class _Stage(msgspec.Struct):
    template_name: str = ""


class _Scene(msgspec.Struct):
    stage_instance: _Stage
    object_instances: list[msgspec.Raw] = []
    articulated_object_instances: list[msgspec.Raw] = []


class _StageConfig(msgspec.Struct):
    render_asset: str = ""
    up: list[float] | None = None


_SCENE = msgspec.json.Decoder(_Scene)
_STAGE = msgspec.json.Decoder(_StageConfig)


def find(path: str, **options: str) -> Iterator[Input]:
    """List one scene."""
    yield input_from_file(path, "habitat", options)


def read(item: Input) -> Iterator[Level]:
    """Yield the levels of a scene's stage, lowest first.

    Raises
    ------
    Rejection
        MISSING_FILE if the stage is not there; otherwise as for a mesh file.
    """
    path = Path(item.path)
    check_file(path)
    scene = decode_document(_SCENE, _bytes_of(path), path.name, "expected a scene instance of Habitat")
    mesh, up = _stage_of(path, scene.stage_instance.template_name)
    name = dict(item.options).get("file", path.name)
    options = {"file": mesh.name, **({"up": up} if up else {})}
    stage = Input(item.id, "mesh_file", str(mesh), options=tuple(sorted(options.items())))
    objects = len(scene.object_instances) + len(scene.articulated_object_instances)
    told = {"source": "habitat", "file": name, "stage": mesh.name, "sha256": sha256_of(path)}
    for level in mesh_file.read(stage):
        provenance = {**level.provenance, "stage_sha256": level.provenance["sha256"], **told}
        if objects:
            note = f"{objects} objects of the scene, whose models are not opened"
            provenance[KEY] = "; ".join(filter(None, [str(provenance.get(KEY, "")), note]))
        yield replace(level, provenance=provenance)


def _bytes_of(path: Path) -> bytes:
    if path.stat().st_size > LARGEST_BYTES:
        detail = f"{path.name} has {path.stat().st_size >> 20} MB, expected {LARGEST_BYTES >> 20} MB at most"
        raise Rejection("source", Reason.TOO_LARGE, detail, "copy it again from the data set")
    return path.read_bytes()


def _stage_of(path: Path, template: str) -> tuple[Path, str]:
    """R1, R2: return the mesh of a stage, and its axis, or "" if nothing says it."""
    for folder in path.resolve().parents[: MOST_FOLDERS + 1]:
        for start in (folder, folder / "stages", folder / "configs", folder / "configs" / "stages"):
            config = file_inside(folder, f"{template}{_CONFIG}", start)
            if config is not None:
                said = decode_document(_STAGE, _bytes_of(config), config.name, "copy it again from the data set")
                mesh = file_inside(folder, said.render_asset, config.parent)
                if mesh is not None:
                    return mesh, _axis(said.up)
            for name in (template, *(template + suffix for suffix in _MESHES)):
                mesh = file_inside(folder, name, start)
                if mesh is not None and format_suffix(mesh) in _MESHES:
                    return mesh, ""
    detail = f"{path.name}: its stage {template[:80]!r} is not in its folder or the {MOST_FOLDERS} above it"
    raise Rejection("source", Reason.MISSING_FILE, detail, _ADVICE)


def _axis(up: Any) -> str:
    if not up or len(up) != 3:
        return ""
    return "z" if abs(up[2]) > abs(up[1]) else "y"
