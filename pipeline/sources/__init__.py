"""List the houses, files or maps in a SOURCE (``find``), and load the module that turns each into levels (``reader``).

A SOURCE is a path or ``procedural:COUNT``; builds list their inputs here, one Input each.
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import cast

from houseexpo.errors import ConfigError
from houseexpo.file_kinds import format_suffix
from houseexpo.files import is_device
from houseexpo.grids.robot_map import is_map_file
from pipeline.rejection import Rejection
from pipeline.sources.files import describe_links, links_left_out, walk_source_files
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
"""The readers that ``find`` asks, and which of a build's options each takes; ``reader_choice`` asks all others."""

OVERRIDABLE = {
    "mesh_file": ("drop_nodes", "floors", "keep", "scale", "storey_height", "units", "up"),
    "ifc": ("drop_nodes", "floors", "scale", "units"),
    "points": ("scale", "units", "up"),
    "vector_plans": ("drop_nodes", "scale", "units", "wall_layers"),
    "occupancy_map": ("scale", "units"),
}
"""The readers, and which options of one input a person may set in ``overrides.toml``. The other formats are in metres,
and have one axis, by definition."""


_READ = (
    "meshes (.ply .obj .glb .gltf .stl .dae .off), IFC buildings, files of ProcTHOR, 3D-FRONT, Gazebo, Sweet "
    "Home 3D and RoomPlan, point clouds (.ply .pcd .xyz .las .laz .e57), drawn plans (.dxf .geojson .building.yaml "
    ".wbt, USD, MJCF, IMDF and others), robots' maps (map.yaml), folders of these, SUNCG, and procedural:COUNT"
)
_DRAWN = {
    ".svg": "of SVG files it reads those of CubiCasa5k and its own; export other drawings as .dxf",
    ".pdf": "export the drawing as .dxf from the program that made it",
}
"""What to do about drawings that are no plans by themselves."""


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
        raise NoHouseError(f"source {source!r}: {_describe_no_house(Path(source))}")


def _describe_no_house(path: Path) -> str:
    """Say that a file, or all files of a folder, are no houses, and what to do: how to export it, or what is read."""
    if path.is_dir() and not any(path.iterdir()):
        return "the folder is empty"
    found = "no file in it is a house that houseexpo can read" if path.is_dir() else "houseexpo cannot read this file"
    if links := links_left_out(path):
        found += f"; {describe_links(links)}"
    if advice := how_to_export(file.suffix for file in (walk_source_files(path) if path.is_dir() else (path,))):
        return found + advice
    if not path.is_dir() and (drawn := _DRAWN.get(path.suffix.lower())):
        return f"{found}; {drawn}"
    return f"{found}; it reads {_READ}"


def is_path(source: str) -> bool:
    """Tell a file or folder from houses that are made."""
    return not source.startswith("procedural:")


def made_count(source: str) -> int | None:
    """Return how many houses ``procedural:COUNT`` stands for; None for any other source."""
    made = parse_made_houses(source)
    return None if made is None else made.count


def reader(name: str) -> Reader:
    """Return the reader of that name: it is loaded only where it is needed.

    Raises
    ------
    ConfigError
        There is no such reader: the name comes from a file of another version.
    """
    module = f"pipeline.sources.{name}"
    try:
        found = import_module(module)
    except ModuleNotFoundError as error:
        if not module.startswith(error.name or " "):  # a package that the reader needs
            raise
        found = None
    if not hasattr(found, "read") and name not in _OPTIONS:
        raise ConfigError(
            f"reader {name!r}: this version has no such reader; use the version that wrote the name, or review the "
            "house again"
        )
    return cast("Reader", found)


def _readers(source: str) -> tuple[str, ...]:
    if not is_path(source):
        return ("generated",)
    path = Path(source)
    if all((path / part).is_dir() for part in ("house", "room")):
        return ("suncg",)
    if path.is_dir():
        return ("reader_choice", "ifc", "mesh_file")
    if format_suffix(path) == ".ifc":
        return ("ifc",)
    return ("reader_choice",) if path.is_file() and (is_map_file(path) or reader_for_file(path)) else ("mesh_file",)
