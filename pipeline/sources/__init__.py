"""List the houses, files or maps in a SOURCE (``find``), and load the module that turns each into levels (``reader``).

A SOURCE is a path or ``procedural:COUNT``; builds list their inputs here, one Input each.
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import cast

from houseexpo.errors import ConfigError
from houseexpo.files import is_device
from houseexpo.grids.robot_map import is_map_file
from pipeline.rejection import Rejection
from pipeline.sources.files import walk_source_files
from pipeline.sources.reader_choice import belongs_to_another_file, how_to_export, parse_made_houses, reader_for_file
from pipeline.sources.storeys.scale import check_size_options
from pipeline.values import Input, Reader

_OPTIONS = {
    "mesh_file": ("up", "units", "scale", "storey_height"),
    "ifc": (),
    "suncg": ("furniture",),
    "generated": ("seed",),
    "reader_choice": ("model_path", "up", "units", "resolution"),
}
"""The readers, and which of a build's options each of them takes."""

OVERRIDABLE = {"mesh_file": ("drop_nodes", "scale")}
"""The readers, and which options of one input a person may set in ``overrides.toml``."""


class NoHouseError(ConfigError):
    """A source is there, and nothing in it is a house that a reader knows."""


def find(source: str, **options: str) -> Iterator[Input]:
    """List what there is to read at a SOURCE; each reader gets those of the options that it takes.

    A SUNCG root is a folder with ``house`` and ``room`` in it; any other folder may hold mesh and IFC files side by
    side.

    Raises
    ------
    NoHouseError
        Where no reader knows the source, or a folder holds nothing that one does.
    ConfigError
        Where an option is impossible, or the source does not exist.
    """
    check_size_options(**options)
    if is_path(source) and not Path(source).exists():
        raise ConfigError(f"source {source!r} does not exist; check the path")
    if is_path(source) and is_device(Path(source)):
        raise ConfigError(
            f"source {source!r}: expected a file or a folder, found a device or a pipe; save its content to a file"
        )
    found = False
    for name in _readers(source):
        chosen = {key: value for key, value in options.items() if key in _OPTIONS[name]}
        try:
            for item in reader(name).find(source, **chosen):
                if name == "mesh_file" and belongs_to_another_file(Path(item.path), Path(source)):
                    continue
                found = True
                yield item
        except Rejection as rejection:
            raise ConfigError(f"source {source!r}: {rejection.detail}; {rejection.advice}") from None
    if not found:
        expected = (
            "a mesh (.ply .obj .glb .gltf .stl .dae .off), an .ifc file, a file of ProcTHOR, 3D-FRONT, Gazebo, Sweet "
            "Home 3D, RoomPlan, a drawn plan (.dxf, .geojson, .building.yaml, USD, MJCF, IMDF, ...), a point cloud, "
            "a robot's map (map.yaml), a folder of these, a SUNCG root"
        )
        found_ = "nothing of the kind in it" if Path(source).is_dir() else "none of them"
        advice = how_to_export(file.suffix for file in _files_at(source))
        raise NoHouseError(f"source {source!r}: expected {expected} or procedural:COUNT, found {found_}{advice}")


def is_path(source: str) -> bool:
    """Tell a file or folder from houses that are made."""
    return not source.startswith("procedural:")


def made_count(source: str) -> int | None:
    """Return how many houses ``procedural:COUNT`` stands for; None for any other source."""
    made = parse_made_houses(source)
    return None if made is None else made.count


def reader(name: str) -> Reader:
    """Return the reader of that name: it is loaded only where it is needed."""
    return cast("Reader", import_module(f"pipeline.sources.{name}"))


def _files_at(source: str) -> Iterator[Path]:
    path = Path(source)
    return walk_source_files(path) if path.is_dir() else iter((path,))


def _readers(source: str) -> tuple[str, ...]:
    if not is_path(source):
        return ("generated",)
    path = Path(source)
    if all((path / part).is_dir() for part in ("house", "room")):
        return ("suncg",)
    if path.is_dir():
        return ("reader_choice", "ifc", "mesh_file")
    if path.suffix.lower() == ".ifc":
        return ("ifc",)
    return ("reader_choice",) if path.is_file() and (reader_for_file(path) or is_map_file(path)) else ("mesh_file",)
