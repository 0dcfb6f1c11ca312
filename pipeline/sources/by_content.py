"""Files whose reader is found by their content: ProcTHOR, 3D-FRONT, Gazebo, Sweet Home 3D, RoomPlan, point clouds.

R1  Every file of a folder is looked at; what a reader knows is its.
R2  The meshes in a Gazebo model's folder are parts of that model, and its models are parts of a world beside them: they
    are no houses by themselves.
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

from pipeline.sources.naming import files_in
from pipeline.sources.recognise import recognise
from pipeline.values import Input

TAKES: dict[str, tuple[str, ...]] = {
    "procthor": (),
    "front3d": (),
    "gazebo": ("model_path", "root"),
    "sweethome": (),
    "roomplan": (),
    "points": ("up", "units"),
    "vector_plans": (),
}
"""The readers, and which of a build's options each of them takes."""

_MODEL = "model.config"


def find(path: str, **options: str) -> Iterator[Input]:
    """List what the file holds, or the files of the folder, sorted by their names."""
    root = Path(path)
    options["root"] = str((root if root.is_dir() else root.parent).absolute())
    if not root.is_dir():
        yield from _inputs(root, recognise(root), f"{root.absolute().parent.name}/{root.name}".lstrip("/"), options)
        return
    files = sorted(files_in(root))
    kinds = {file: kind for file in files if (kind := recognise(file))}
    has_world = any(kind == "gazebo" and not _in_model(file, root) for file, kind in kinds.items())
    for file, kind in kinds.items():
        if not (kind == "gazebo" and has_world and _in_model(file, root)):  # R2
            yield from _inputs(file, kind, file.relative_to(root).as_posix(), options)


def is_claimed(file: Path, root: Path) -> bool:
    """Whether a mesh file of a folder is no house by itself: another reader's, or a part of a model (R2)."""
    return root.is_dir() and (_in_model(file, root) or recognise(file) is not None)


def _inputs(file: Path, kind: str | None, name: str, options: dict[str, str]) -> Iterator[Input]:
    if kind is not None:
        chosen = {key: value for key, value in options.items() if key in TAKES[kind]}
        yield from import_module(f"pipeline.sources.{kind}").find(str(file), **chosen, file=name)


def _in_model(file: Path, root: Path) -> bool:
    """Whether a file lies in the folder of a Gazebo model."""
    folders = [folder for folder in file.parents if folder == root or root in folder.parents]
    return any((folder / _MODEL).is_file() for folder in folders)
