"""List the export formats by name (``FORMATS``), and write plans in one of them to a folder (``export``)."""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from houseexpo.errors import ConfigError, PlanError
from houseexpo.exports.coco import coco
from houseexpo.exports.dxf import dxf
from houseexpo.exports.encoding import Files
from houseexpo.exports.geojson import geojson
from houseexpo.exports.graphml import graphml
from houseexpo.exports.ifc import ifc, ifc_building
from houseexpo.exports.mesh import glb, glb_building, obj, obj_building
from houseexpo.exports.mjcf import mjcf, mjcf_building
from houseexpo.exports.plan_bodies import BodyOptions
from houseexpo.exports.pol import pol
from houseexpo.exports.published_json import published_json
from houseexpo.exports.rasters import npz, png, ros_map
from houseexpo.exports.rmf import rmf, rmf_building
from houseexpo.exports.sdf import sdf, sdf_building
from houseexpo.exports.svg import svg
from houseexpo.exports.usd import usd, usd_building
from houseexpo.exports.worlds_2d import irsim, stage
from houseexpo.files import named_path
from houseexpo.floorplan import FloorPlan
from houseexpo.outputs import CommandOutput
from houseexpo.words import suggest_name


@dataclass(frozen=True)
class ExportFormat:
    """One format: a short description, and the function that makes its files.

    The function takes one plan or, if ``indexed``, all plans, for a format with a common index. ``building`` takes the
    plans of one house and its name, for a format that holds several storeys. ``leaves_ways_open``: a build reads the
    format, which cannot say that no way leads into a part of a plan.
    """

    what: str
    function: Callable[..., Any]
    indexed: bool = False
    leaves_ways_open: bool = False
    building: Callable[..., Any] | None = None

    @property
    def options(self) -> tuple[str, ...]:
        """The names of the format's options."""
        found = inspect.signature(self.function).parameters.values()
        named = tuple(parameter.name for parameter in found if parameter.kind is parameter.KEYWORD_ONLY)
        return named or tuple(BodyOptions.__annotations__)

    def files(self, plans: Iterable[FloorPlan], **options: Any) -> Iterator[tuple[str, bytes]]:
        """Yield the files of some plans one after the other: (name in the folder, content)."""
        if self.indexed:
            yield from self.function(plans, **options)
            return
        for plan in plans:
            yield from self.function(plan, **options).items()


FORMATS: Final = {
    "coco": ExportFormat("COCO instances: rooms and doors", coco, indexed=True),
    "dxf": ExportFormat("DXF layers in metres", dxf),
    "geojson": ExportFormat("GeoJSON features in metres", geojson),
    "glb": ExportFormat("glTF mesh, binary", glb, leaves_ways_open=True, building=glb_building),
    "graphml": ExportFormat("GraphML: rooms and doors", graphml),
    "ifc": ExportFormat("IFC 4 building with spaces and doors", ifc, leaves_ways_open=True, building=ifc_building),
    "irsim": ExportFormat("IR-SIM world", irsim),
    "json": ExportFormat("HouseExpo JSON as published", published_json),
    "mjcf": ExportFormat("MuJoCo world", mjcf, leaves_ways_open=True, building=mjcf_building),
    "npz": ExportFormat("NumPy grids", npz),
    "obj": ExportFormat("OBJ mesh", obj, leaves_ways_open=True, building=obj_building),
    "png": ExportFormat("picture of the free space", png, leaves_ways_open=True),
    "pol": ExportFormat("polygon with holes as fractions", pol),
    "rmf": ExportFormat("Open-RMF building for traffic_editor", rmf, leaves_ways_open=True, building=rmf_building),
    "ros": ExportFormat("ROS map_server: pgm and yaml", ros_map, leaves_ways_open=True),
    "sdf": ExportFormat("Gazebo world", sdf, leaves_ways_open=True, building=sdf_building),
    "stage": ExportFormat("Stage world", stage),
    "svg": ExportFormat("SVG to scale", svg),
    "usd": ExportFormat("USD world", usd, leaves_ways_open=True, building=usd_building),
}
ALIASES: Final = {
    "gazebo": "sdf",
    "gltf": "glb",
    "houseexpo": "json",
    "map_server": "ros",
    "mujoco": "mjcf",
    "nav2": "ros",
    "pgm": "ros",
    "ros2": "ros",
    "traffic_editor": "rmf",
}


def export(
    plans: FloorPlan | Iterable[FloorPlan],
    to: str,
    out: str | os.PathLike[str],
    *,
    refused: Callable[[PlanError], object] | None = None,
    replace: bool = False,
    sources: Iterable[str | os.PathLike[str]] = (),
    building: str | None = None,
    **options: Any,
) -> list[Path]:
    """Write plans in another format.

    Parameters
    ----------
    plans
        One plan or several. They are read one at a time, so that a generator over a data set needs little memory.
    to
        The name of the format: a key of ``FORMATS`` or of ``ALIASES``.
    out
        The output folder, created if it does not exist. It must not lie in the data set that the plans come from.
    refused
        A function that is called with the error of each plan that the format cannot represent; the plan is then left
        out. By default, the first such error is raised.
    replace
        Whether to overwrite files that ``export`` did not write or that were changed since.
    sources
        Files and folders that the plans come from, if ``plans`` is not a ``Dataset``; nothing is written into them.
    building
        The name of a building whose storeys are the plans: one file holds all of them. The formats are ``glb``,
        ``ifc``, ``mjcf``, ``obj``, ``rmf``, ``sdf`` and ``usd``. ``stack_storeys`` finds the order and the poses of
        the storeys.
    **options
        Options of the format's function, such as ``resolution``, ``wall_thickness``, ``door_height``, ``orientation``,
        and ``frame``: "source" or "plan", by default ``default_frame`` of each plan.

    Returns
    -------
    The paths of the files that were written.

    Raises
    ------
    ConfigError
        There is no such format or option, ``out`` lies in the input, or an existing file must not be overwritten.
    PlanError
        The format cannot represent a plan, or two plans have the same id; files written before are complete.
    """
    chosen = FORMATS.get(ALIASES.get(to, to))
    if chosen is None:
        raise ConfigError(
            f"export: expected one of {', '.join([*FORMATS, *ALIASES])} to export to, found {to!r}"
            + suggest_name(to, [*FORMATS, *ALIASES])
        )
    unknown = sorted(set(options) - set(chosen.options))
    if unknown:
        raise ConfigError(f"export: {to} takes {', '.join(chosen.options)}; found {', '.join(unknown)}")
    folder = named_path(out, "export: out")
    written = []
    distinct = _distinct([plans] if isinstance(plans, FloorPlan) else plans)
    if building is not None:
        made = _files_of_building(chosen, to, distinct, building, options)
    elif refused is None or chosen.indexed:
        made = chosen.files(distinct, **options)
    else:
        made = _files_of_plans(chosen, distinct, refused, options)
    read = [*(os.fspath(each) for each in sources), getattr(plans, "path", None)]
    with CommandOutput(folder, read, replace=replace, folder=True) as output:
        for name, content in made:
            output.write(folder / name, content)
            written.append(folder / name)
    return written


def _files_of_building(
    chosen: ExportFormat, to: str, plans: Iterable[FloorPlan], name: str, options: dict[str, Any]
) -> Iterator[tuple[str, bytes]]:
    """Yield the files of one building; all plans are read first."""
    if chosen.building is None:
        able = ", ".join(key for key, each in FORMATS.items() if each.building is not None)
        raise ConfigError(f"export: expected one of {able} for a building of several storeys, found {to}")
    found: Files = chosen.building(list(plans), name, **options)
    return iter(found.items())


def _files_of_plans(
    chosen: ExportFormat, plans: Iterable[FloorPlan], refused: Callable[[PlanError], object], options: dict[str, Any]
) -> Iterator[tuple[str, bytes]]:
    """Yield the files of the plans that the format can represent."""
    for plan in plans:
        try:
            files = chosen.function(plan, **options)
        except PlanError as error:
            refused(error)
            continue
        yield from files.items()


def _distinct(plans: Iterable[FloorPlan]) -> Iterator[FloorPlan]:
    """Yield the plans; raise an error if two have the same id, since the second would replace the first one's files."""
    seen: set[str] = set()
    for plan in plans:
        if plan.id in seen:
            raise PlanError("expected ids that differ, found this one twice; rename one", "id", plan.id)
        seen.add(plan.id)
        yield plan
