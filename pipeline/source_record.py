"""Record what a person is shown of a house while they correct its plans (``houseexpo.dataset.source_records``).

R1  The plans are those that a build makes with what is said of the file, and without any word of a storey: words act on
    the finished plan (``stages.corrections``), so whoever holds it and its spaces can say what they do.
R2  Sections are at ``SECTIONS_M``: one below the heads of doors and windows, one above the sills and handles of most.
R3  The top view is without what lies above ``ROOF_M``, as if the roof were off.
R4  A robot's map is shown itself. What a drawing has as areas is shown in section.
R5  A level that cannot become a plan is recorded as far as its stages came, an input as far as its file could be read.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np
import numpy.typing as npt
import shapely
from PIL import Image, ImageDraw
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from houseexpo.corrections import Override
from houseexpo.dataset.source_records import LevelSource, Picture, Place, PlanSource, Rings, SourceRecord
from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import source_points_from_plan
from houseexpo.grids.robot_map import read_map
from houseexpo.plan import Box, Frame
from houseexpo.plan.json_codec import encode
from houseexpo.tolerances import SAME_M2
from pipeline.algorithm import StageResult, run_stages
from pipeline.batch.job import level_rng
from pipeline.batch.listing import list_inputs
from pipeline.config_file import BuildConfig
from pipeline.geometry.areas import Floats, ignore_division_warnings, polygons_of
from pipeline.geometry.mesh_slicing import MeshSlicer
from pipeline.geometry.meshes import Mesh, boxes_around_polygons, merge_meshes
from pipeline.geometry.prisms import Prisms
from pipeline.overrides import (
    configure,
    correct_input,
    correct_level,
    is_id_of_input,
    level_without_walls,
    override_for_level,
    overrides_by_input,
    settle_override_ids,
)
from pipeline.png import encode_png, sample_points
from pipeline.rejection import Rejection
from pipeline.sources import OVERRIDABLE, reader
from pipeline.sources.meshes.formats import load_scene
from pipeline.sources.points_file import read_blocks
from pipeline.values import Evidence, Input, Layout, Level, RejectedLevel, Spaces

SECTIONS_M: Final = (1.1, 1.9)
_OFF_M: Final = 0.0007
"""Sections avoid round heights, at which a model has its corners, metres."""
_SLAB_M: Final = 0.05
"""Points this near to a section's height are in it, metres: a scan has one each centimetre or two."""
ROOF_M: Final = 2.0
SOURCE_SIDE_PX: Final = 1400
"""The longer side of a section: 1.4 cm in a house of 20 m."""
TOP_PX: Final = 700
_TOP_SAMPLES: Final = 1_500_000
"""Three points a pixel of the top view."""
_ROUND_M: Final = 1.0
"""What lies so near to the walls is shown too, metres."""
_FINE_M: Final = 0.01
_SAME_PLACE_M: Final = 0.3
"""Places nearer to each other are one."""
_LEAST_M: Final = 0.3
_COLOURS: Final = ((36, 90, 141), (196, 84, 30))
_MOST_NAMES: Final = 400
_MOST_SNAP_CORNERS: Final = 40_000
"""A browser that snaps to more of them is slow."""
_UNITS: Final = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}


@ignore_division_warnings()
def source_record(config: BuildConfig, overrides: Mapping[str, Override], name: str) -> SourceRecord:
    """Return the record of the input to which an id of a plan, a level or an input belongs.

    Raises
    ------
    ConfigError
        The build has no such input.
    """
    inputs = list(list_inputs(config))
    known = [item for item in inputs if is_id_of_input(name, item.id)]
    if not known:
        raise ConfigError(f"{name}: expected an id of this build, found no such input")
    found = max(known, key=lambda item: len(item.id))
    said = overrides_by_input(settle_override_ids(overrides, inputs)).get(found.id, {})
    item, takes = correct_input(found, said), tuple(sorted(OVERRIDABLE.get(found.reader, ())))
    levels: list[LevelSource] = []
    units: set[float | None] = set()
    why = ""
    try:
        for level in reader(item.reader).read(item):
            levels.append(_of_level(level, item, override_for_level(level.id, said), config))
            if isinstance(level, Level):
                units.add(_unit_of(level.provenance))
    except Rejection as rejection:
        why = str(rejection)
    whole, names = _contents(item)
    if not levels and whole is not None:
        levels = [_of_file(item, said.get(item.id, Override()), whole, why, config)]
    unit_m = next(iter(units)) if len(units) == 1 else None
    return SourceRecord(found.id, item.path, tuple(levels), why, takes, unit_m, tuple(names[:_MOST_NAMES]))


def _unit_of(provenance: Mapping[str, Any]) -> float | None:
    units, scale = provenance.get("units"), float(provenance.get("scale", 1.0))
    try:
        return None if units is None else scale * (_UNITS.get(units) or float(units))
    except (TypeError, ValueError):
        return None


def _contents(item: Input) -> tuple[Mesh | None, list[str]]:
    """Return what a mesh file or a scan holds, in its own axes and unit, and the names of its parts."""
    try:
        if item.reader == "mesh_file":
            scene = load_scene(Path(item.path))
            names = {name for part in scene.parts for name in (*part.groups, part.mesh, part.material) if name}
            return scene.mesh, sorted(names)
        if item.reader == "points":
            points = np.concatenate([block[:, :3] for block in read_blocks(Path(item.path))]).astype(np.float64)
            return Mesh(points, np.zeros((0, 3), np.int64)), []
    except (Rejection, ValueError):
        pass
    return None, []


def _of_file(item: Input, override: Override, mesh: Mesh, why: str, config: BuildConfig) -> LevelSource:
    """Return what can be shown of a file whose levels could not be found: all of it, from above (R5)."""
    level = level_without_walls(item, override)
    if level.frame.up == "y":
        x, y, z = mesh.vertices.T
        mesh = Mesh(np.column_stack([x, -z, y]), mesh.faces)
    size = _UNITS.get(override.units or "") or 1.0
    mesh = Mesh(mesh.vertices * size * (override.scale or 1.0), mesh.faces)
    picture = _top_view(mesh, _bounds_of([mesh]), np.inf)
    results, again = _stages(correct_level(level, override), override, config) if override.corrections else ([], why)
    plans = tuple(_plan_source(plan, results, None, is_founded=True) for plan in _plans_of(results))
    return LevelSource(item.id, level.frame, () if picture is None else (picture,), plans=plans, rejected=again)


def _of_level(level: Level | RejectedLevel, item: Input, override: Override, config: BuildConfig) -> LevelSource:
    if isinstance(level, RejectedLevel):
        frame = Frame(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), "z", 0.0, 0)
        return LevelSource(level.id, frame, rejected=str(level.rejection))
    results, why = _stages(level, override, config)
    evidence = next((each.value for each in results if isinstance(each.value, Evidence)), None)
    layout = next((each.value for each in results if isinstance(each.value, Layout)), None)
    walls = [] if evidence is None else [*polygons_of(evidence.walls), *polygons_of(evidence.rails)]
    is_founded = bool(why and override.corrections)
    if is_founded:
        results, why = _stages(correct_level(level, override), override, config)
    return LevelSource(
        id=level.id,
        frame=level.frame,
        pictures=tuple(_pictures(level, item, walls, is_plan=not (why or is_founded))),
        edges=tuple(_rings(wall) for wall in _simplified(walls)),
        places=tuple(_places(evidence, layout)),
        plans=tuple(_plan_source(plan, results, layout, is_founded=is_founded) for plan in _plans_of(results)),
        rejected=why,
        guesses=level.guesses,
        extent=extent_of(level),
    )


def _simplified(walls: Sequence[Polygon]) -> list[BaseGeometry]:
    """Return walls to snap to, as fine as a browser takes them."""
    fine_m = _FINE_M
    found = [shapely.simplify(wall, fine_m) for wall in walls]
    while sum(shapely.get_num_coordinates(found)) > _MOST_SNAP_CORNERS and fine_m < _SAME_PLACE_M:
        fine_m *= 2
        found = [shapely.simplify(wall, fine_m) for wall in walls]
    return found


def extent_of(level: Level) -> tuple[float, float]:
    """Return how far a level's walls reach, metres, along the source's plan axes; robust against stray parts."""
    if level.walls.is_empty:
        return 0.0, 0.0
    there = source_points_from_plan(level.frame, level.walls.vertices[:, :2])
    low, high = np.quantile(there, [0.002, 0.998], axis=0)
    return round(float(high[0] - low[0]), 2), round(float(high[1] - low[1]), 2)


def _stages(level: Level, override: Override, config: BuildConfig) -> tuple[list[StageResult], str]:
    """Return the results of the stages (R1), and why there is no plan (R5)."""
    results: list[StageResult] = []
    try:
        results.extend(run_stages(level, configure(config.planning, override), level_rng(level, config.build.seed)))
    except Rejection as rejection:
        return results, str(rejection)
    return results, ""


def _plans_of(results: Sequence[StageResult]) -> list[FloorPlan]:
    return [each.value for each in results if isinstance(each.value, FloorPlan)]


def _plan_source(
    plan: FloorPlan, results: Sequence[StageResult], layout: Layout | None, *, is_founded: bool
) -> PlanSource:
    doors = next((each.value for each in results if each.stage == "doors"), None)
    rooms = doors.rooms if isinstance(doors, Spaces) else ()
    spaces = layout.spaces if layout is not None else ()
    return PlanSource(
        plan.id, msgspec.Raw(encode(plan)), tuple(map(_rings, spaces)), tuple(map(_rings, rooms)), is_founded
    )


def _rings(polygon: BaseGeometry) -> Rings:
    parts = polygons_of(polygon)
    if not parts:
        return ()
    rings = (parts[0].exterior, *parts[0].interiors)
    return tuple(tuple((round(x, 4), round(y, 4)) for x, y in ring.coords[:-1]) for ring in rings)


def _places(evidence: Evidence | None, layout: Layout | None) -> Iterator[Place]:
    """Yield what may close, once each: what is named first, then what closes for the layout."""
    kinds: list[tuple[str, Polygon]] = []
    if evidence is not None:
        kinds += [(each.closed_by or "opening", each.polygon) for each in evidence.doorways]
        kinds += [("lintel", part) for part in polygons_of(evidence.lintels)]
    if layout is not None:
        kinds += [(each.closed_by, each.polygon) for each in (*layout.candidates, *layout.ways)]
    kinds = [(kind, polygon) for kind, polygon in kinds if polygon.area > SAME_M2]
    if not kinds:
        return
    seen: list[Floats] = []
    for (kind, _), box in zip(kinds, boxes_around_polygons([polygon for _, polygon in kinds]), strict=True):
        centre = box.centre
        if box.width < _LEAST_M or any(np.hypot(*(centre - other)) < _SAME_PLACE_M for other in seen):
            continue
        seen.append(centre)
        half = box.along * box.width / 2
        ends = np.round([centre - half, centre + half], 3).tolist()
        yield Place(kind, ((ends[0][0], ends[0][1]), (ends[1][0], ends[1][1])))


# ---------------------------------------------------------------------------------------------------------------------
# The layers.
# ---------------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Sheet:
    """A picture of an area of the level, clear where nothing is drawn."""

    bounds: Box
    side_px: int

    @property
    def scale(self) -> float:
        """Pixels of a metre."""
        x1, y1, x2, y2 = self.bounds
        return self.side_px / max(x2 - x1, y2 - y1)

    @property
    def size(self) -> tuple[int, int]:
        """Columns and rows."""
        x1, y1, x2, y2 = self.bounds
        return max(round((x2 - x1) * self.scale), 1), max(round((y2 - y1) * self.scale), 1)

    def pixels(self, points: Floats) -> Floats:
        """Return points (..., 2) in columns and rows."""
        return (points - (self.bounds[0], self.bounds[3])) * (self.scale, -self.scale)

    def picture(self, name: str, title: str, image: npt.NDArray[np.uint8]) -> Picture:
        """Return a layer of an image (rows, cols, 4)."""
        return Picture(name, title, tuple(round(v, 4) for v in self.bounds), encode_png(image, smallest=False))  # type: ignore[arg-type]  # four numbers

    def masked(self, name: str, title: str, mask: Image.Image, colour: tuple[int, int, int]) -> Picture:
        """Return a layer of one colour."""
        image = Image.new("RGBA", self.size, (*colour, 0))
        image.putalpha(mask)
        return self.picture(name, title, np.asarray(image, np.uint8))


def _pictures(level: Level, item: Input, walls: Sequence[Polygon], *, is_plan: bool) -> Iterator[Picture]:
    """Yield the layers: what the walls cover, with all of the floor if no rooms were found on it."""
    if item.reader == "occupancy_map":
        yield from _map_picture(level, item)
        return
    meshes = [level.walls, *level.door_meshes, *(each.mesh for each in level.furniture)]
    whole = merge_meshes(meshes) if not isinstance(level.walls, Prisms) else level.walls
    if whole.is_empty:
        return
    shown = [*walls, *polygons_of(level.floor)] if level.floor is not None and not is_plan else walls
    around = [each for area in shown for each in (area.bounds[:2], area.bounds[2:])]
    if around:
        low, high = np.min(around, axis=0) - _ROUND_M, np.max(around, axis=0) + _ROUND_M
        bounds = (float(low[0]), float(low[1]), float(high[0]), float(high[1]))
    else:
        bounds = _bounds_of([whole])
    if (top := _top_view(whole, bounds, ROOF_M)) is not None and not isinstance(whole, Prisms):
        yield top
    for height, colour in zip(SECTIONS_M, _COLOURS, strict=True):
        sheet = _Sheet(bounds, SOURCE_SIDE_PX)
        mask = _section(whole, height + _OFF_M, sheet)
        name, title = f"section_{height:g}".replace(".", "_"), f"Section at {height:g} m"
        yield sheet.masked(name, title, mask, colour)


def _bounds_of(meshes: Iterable[Mesh]) -> Box:
    vertices = np.concatenate([mesh.vertices for mesh in meshes])
    if not len(vertices):
        return (0.0, 0.0, 1.0, 1.0)
    low, high = np.quantile(vertices[:, :2], [0.001, 0.999], axis=0)
    return (float(low[0]) - _FINE_M, float(low[1]) - _FINE_M, float(high[0]) + _FINE_M, float(high[1]) + _FINE_M)


def _section(mesh: Mesh, height: float, sheet: _Sheet) -> Image.Image:
    """R2: return where something stands at a height, as a mask."""
    mask = Image.new("L", sheet.size, 0)
    pen = ImageDraw.Draw(mask)
    if isinstance(mesh, Prisms):
        for body in mesh.bodies_at(height):
            for fill, ring in ((255, body.exterior), *((0, hole) for hole in body.interiors)):
                pen.polygon([tuple(at) for at in sheet.pixels(shapely.get_coordinates(ring)).tolist()], fill=fill)
        return mask
    if mesh.is_cloud:
        near = mesh.vertices[np.abs(mesh.vertices[:, 2] - height) < _SLAB_M]
        columns, rows = np.floor(sheet.pixels(near[:, :2])).astype(np.int64).T
        inside = (columns >= 0) & (rows >= 0) & (columns < mask.width) & (rows < mask.height)
        image = np.zeros((mask.height, mask.width), np.uint8)
        image[rows[inside], columns[inside]] = 255
        return Image.fromarray(image)
    segments = sheet.pixels(MeshSlicer(mesh).cut(height).ends)
    for (ax, ay), (bx, by) in segments.tolist():
        pen.line((ax, ay, bx, by), fill=255, width=2)
    return mask


_FLOOR, _HIGH = 225, 70
"""Grey of what lies at the floor, and of what ends at ``ROOF_M``."""


def _top_view(mesh: Mesh, bounds: Box, roof_m: float) -> Picture | None:
    """R3: return what is visible from above: the higher, the darker; None if nothing is."""
    from scipy.ndimage import grey_dilation

    points = mesh.vertices if mesh.is_cloud else sample_points(mesh, _TOP_SAMPLES)
    x1, y1, x2, y2 = bounds
    x, y, z = points.T if len(points) else np.zeros((3, 0))
    kept = points[(x > x1) & (x < x2) & (y > y1) & (y < y2) & (z < roof_m)]
    if not len(kept):
        return None
    sheet = _Sheet(bounds, TOP_PX)
    columns, rows = np.floor(sheet.pixels(kept[:, :2])).astype(np.int64).T
    size = sheet.size
    tallest = np.full((size[1], size[0]), -np.inf)
    np.maximum.at(tallest, (rows.clip(0, size[1] - 1), columns.clip(0, size[0] - 1)), kept[:, 2])
    tallest = grey_dilation(tallest, (3, 3))  # between the points, and where none fell on the highest face
    seen = np.isfinite(tallest)
    low, high = (0.0, roof_m) if np.isfinite(roof_m) else np.quantile(tallest[seen], [0.02, 0.98]).tolist()
    shade = np.clip((np.where(seen, tallest, low) - low) / max(high - low, _FINE_M), 0.0, 1.0)
    grey = (_FLOOR + (_HIGH - _FLOOR) * shade).astype(np.uint8)
    image = np.dstack([grey, grey, grey, np.where(seen, 255, 0).astype(np.uint8)])
    return sheet.picture("top", "From above, without roof" if np.isfinite(roof_m) else "From above", image)


def _map_picture(level: Level, item: Input) -> Iterator[Picture]:
    """R4: yield the map itself; what nobody saw is clear."""
    options = dict(item.options)
    found = read_map(Path(item.path), float(options["resolution"]) if options.get("resolution") else None).trimmed()
    grid, own = np.array([*found.affine, (0.0, 0.0, 1.0)]), np.array([*level.frame.matrix, (0.0, 0.0, 1.0)])
    (x, y) = (np.linalg.inv(own) @ grid)[:2, 2].tolist()
    rows, columns = found.occupancy.shape
    shade = np.where(found.occupancy < 0, 128, 255 - found.occupancy.astype(np.int64) * 255 // 100).astype(np.uint8)
    image = np.dstack([shade, shade, shade, np.where(found.occupancy < 0, 60, 255).astype(np.uint8)])
    bounds = (x, y, x + columns * found.resolution_m, y + rows * found.resolution_m)
    yield _Sheet(bounds, max(rows, columns)).picture("map", "The map", image)
