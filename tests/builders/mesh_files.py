"""Mesh files on disk and the levels that are read from them."""

from pathlib import Path

from pipeline.sources import mesh_file
from pipeline.values import Level, Mesh
from tests.builders.meshes import (
    as_trimesh,
    y_up,
)

Y_UP = (".obj", ".glb", ".gltf")


def write(mesh: Mesh, path: Path) -> Path:
    """Write a z-up mesh in the axes that the file's format stands for."""
    turned_mesh = y_up(mesh) if path.suffix in Y_UP else mesh
    as_trimesh(turned_mesh).export(path)
    return path


def read(path: Path, **options: str) -> list[Level]:
    return [level for item in mesh_file.find(str(path), **options) for level in mesh_file.read(item)]
