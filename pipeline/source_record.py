"""Record what a person is shown of a house while they correct its plans (``houseexpo.dataset.source_records``).

R1  The plans are those that a build makes with what is said of the file, and without any word of a storey: words act on
    the finished plan (``stages.corrections``), so whoever holds it and its spaces can say what they do.
R2  Sections are at ``SECTIONS_M``: one below the heads of doors and windows, one above the sills and handles of most.
R3  The top view is without what lies above ``ROOF_M``, as if the roof were off.
R4  A robot's map is shown itself. What a drawing has as areas is shown in section.
R5  A mesh is shown in three dimensions too, the largest ``_MOST_TRIANGLES`` of it.
R6  A level that cannot become a plan is recorded as far as its stages came, an input as far as its file could be read.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np
import numpy.typing as npt
import shapely
from PIL import Image, ImageDraw
from shapely import LineString, Point, Polygon
from shapely.geometry.base import BaseGeometry

from houseexpo.corrections import Override
from houseexpo.dataset.source_records import (
    LevelSource,
    Picture,
    Place,
    PlanSource,
    Points,
    Rings,
    Solid,
    SourceRecord,
    Stroke,
)
from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan, decode
from houseexpo.grids.frame import plan_points_from_source, source_points_from_plan
from houseexpo.grids.robot_map import MapError, RobotMap
from houseexpo.plan import Box, Frame
from houseexpo.plan.ids import is_of_input
from houseexpo.plan.json_codec import encode
from houseexpo.tolerances import SAME_M2
from pipeline.algorithm import StageResult, run_stages
from pipeline.batch.file_records import InputFiles
from pipeline.batch.job import level_rng
from pipeline.batch.listing import list_inputs
from pipeline.config_file import BuildConfig
from pipeline.geometry.areas import Floats, ignore_division_warnings, polygons_of
from pipeline.geometry.mesh_slicing import MeshSlicer
from pipeline.geometry.meshes import Box as WallBox
from pipeline.geometry.meshes import Mesh, boxes_around_polygons, merge_meshes
from pipeline.geometry.prisms import Prisms
from pipeline.overrides import (
    LevelOverride,
    configure,
    correct_input,
    correct_level,
    level_without_walls,
    overrides_by_input,
    settle_override_ids,
)
from pipeline.png import encode_png, sample_mesh_points
from pipeline.rejection import Rejection
from pipeline.sources import OVERRIDABLE, reader
from pipeline.sources.files import displayable_name
from pipeline.sources.meshes.formats import load_scene
from pipeline.sources.meshes.scene import MeshScene
from pipeline.sources.occupancy_map import scaled_map
from pipeline.sources.points_file import read_blocks
from pipeline.sources.storeys.levels import other_floors
from pipeline.sources.storeys.scale import UNITS as _UNITS
from pipeline.sources.storeys.scale import said_size
from pipeline.sources.storeys.size_evidence import SizesFound, other_scales
from pipeline.sources.tolerances import NARROWEST_DOOR_M, VOXEL_M
from pipeline.sources.vector_plans import drawing_lines, lines_in_level, lines_without
from pipeline.sources.vector_plans.drawing import Line
from pipeline.sources.vector_plans.unread_lines import likely_units, main_part, rank_layers
from pipeline.stages.corrections import shown_walls, standing_walls
from pipeline.tolerances import AROUND_M, BESIDE_M, CM_M, SHEET_M
from pipeline.values import Evidence, Input, Layout, Level, RejectedLevel, Spaces

SECTIONS_M: Final = (1.1, 1.9)
_OFF_M: Final = 0.0007
"""Sections avoid round heights, at which a model has its corners, metres."""
ROOF_M: Final = 2.0
SOURCE_SIDE_PX: Final = 1400
"""The longer side of a section: 1.4 cm in a house of 20 m."""
TOP_PX: Final = SOURCE_SIDE_PX // 2
_TOP_SAMPLES: Final = 1_500_000
"""Three points a pixel of the top view."""
_COLOURS: Final = ((36, 90, 141), (196, 84, 30))
_MOST_NAMES: Final = 400
_MOST_TRIANGLES: Final = 60_000
"""Some two megabytes on their way to the browser."""
_SHOWN_HEIGHTS_M: Final = (-0.5, 3.5)
_MOST_FLOORS: Final = 2
"""Other floors that are asked about: a key for an answer each."""
_SIDE_PX: Final = 480
_SIDE_SAMPLES: Final = 100_000
"""The picture from the side: the width of the questions, and a point for one of its pixels."""
_SHARES: Final = (0.15, 0.35, 0.5, 0.65, 0.85)
"""Heights at which a mesh without a storey is cut, as shares of its own: not where its floors are likely."""
_ONWARD_M: Final = 0.3
"""Pieces of one wall's faces are at most this far apart, metres: the wall that ends at them."""
_SHORTEST_SEEN_M: Final = 0.8
"""A shorter line is a pillar, or the side of a cupboard, metres."""
_MOST_SEEN: Final = 400
"""Lines of a section; of a scan only the longest are looked at."""
_MOST_SNAP_CORNERS: Final = 40_000
"""A browser that snaps to more of them is slow."""


class SourceReader:
    """Reads one input, and keeps what it read, so that a word of a house without a plan is answered without reading.

    R7  An input is read again if what is said of its file changed, or the file itself did.
    """

    def __init__(self, config: BuildConfig, name: str) -> None:
        """``name`` is an id of a plan, a level or an input; raise ConfigError if the build has no such input."""
        self._config = config
        self._inputs = list(list_inputs(config))
        known = [item for item in self._inputs if is_of_input(name, item.id)]
        if not known:
            raise ConfigError(f"{name}: expected an id of this build, found no such input")
        longest = max(len(item.id) for item in known)
        same = [item for item in known if len(item.id) == longest]
        self._found, self._is_alone = _input_by_content(name, same) if len(same) > 1 else same[0], len(same) == 1
        self._read_as: tuple[Any, ...] = ()
        self._levels: list[Level | RejectedLevel] = []
        self._why = ""
        self._whole, self._names = _Whole(), list[str]()
        self._made: dict[tuple[str, Any], _Searched] = {}
        self._shown: _Shown | None = None

    @ignore_division_warnings()
    def record(self, overrides: Mapping[str, Override]) -> SourceRecord:
        """Return the record with what is said of the input.

        Raises
        ------
        ConfigError
            What is said of the file is not for its reader.
        """
        said = overrides_by_input(settle_override_ids(overrides, self._inputs)).get(self._found.id, {})
        item = correct_input(self._found, said)
        sha256 = _sha256_of(item)
        if (now := (item, _state_of(Path(item.path)))) != self._read_as:
            self._read(item)
            self._read_as = now
        levels = [
            self._of_level(level, item, LevelOverride.of(level.id, said, _content_of(level, sha256)))
            for level in self._levels
        ]
        if not levels and not self._whole.is_empty:
            whole_said = LevelOverride.of(item.id, said, sha256)
            self._shown = self._shown or _file_as_shown(item, whole_said.own, self._whole, sha256)
            levels = [_of_file(whole_said, self._shown, self._config, self._why)]
            unit_m, others = next(iter(self._shown.units_m), None), (self._shown.units_m[1:], False)
        else:
            units = {level.unit_m for level in self._levels if isinstance(level, Level)}
            unit_m = next(iter(units)) if len(units) == 1 else None
            others = _other_units(self._found.reader, unit_m, levels)
        takes = {*OVERRIDABLE.get(self._found.reader, ()), "keep"} - (
            set() if self._names else {"drop_nodes", "wall_layers"}
        )
        takes = takes if self._is_alone else set()  # what is said under their id would be of all of them
        return SourceRecord(
            self._found.id,
            item.path,
            tuple(levels),
            self._why,
            tuple(sorted(takes)),
            unit_m,
            *others,
            tuple(map(displayable_name, self._names[:_MOST_NAMES])),
            *self._whole.floors,
            item.reader,
            item.key,
            item.options,
        )

    def _read(self, item: Input) -> None:
        self._levels, self._why, self._made, self._shown = [], "", {}, None
        try:
            self._levels.extend(reader(item.reader).read(item))
        except Rejection as rejection:
            self._why = str(rejection)
        self._whole, self._names = _contents(item, [each for each in self._levels if isinstance(each, Level)])

    def _of_level(self, level: Level | RejectedLevel, item: Input, said: LevelOverride) -> LevelSource:
        if isinstance(level, RejectedLevel):
            frame = Frame(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), "z", 0.0, 0)
            return LevelSource(level.id, frame, rejected=str(level.rejection))
        override = said.own
        key = level.id, (override.keep, override.h_g, override.h_d)
        found = self._made.get(key)
        if found is None:
            found = self._made[key] = _search_level(level, item, self._whole, override, self._config)
        results, why, is_founded = found.results, found.source.rejected, False
        if why and override.corrections:
            results, why = _stages(correct_level(level, said), override, self._config)
            is_founded = True
        plans = (_plan_source(level, plan, results, found.layout, is_founded=is_founded) for plan in _plans_of(results))
        return msgspec.structs.replace(found.source, plans=tuple(plans), rejected=why)


def _sha256_of(item: Input) -> str:
    return InputFiles(item).own_sha256()


def _input_by_content(name: str, same: Sequence[Input]) -> Input:
    """Return the one of inputs of one id whose content an id ends with: that of its file, else that of its levels."""
    own = (item for item in same if name.endswith(f"_{_sha256_of(item)[:8]}"))
    ends = ((item, _contents_of_levels(item)) for item in same)
    read = (item for item, found in ends if any(name.endswith(f"_{content[:8]}") for content in found))
    return next(chain(own, read), same[0])


def _contents_of_levels(item: Input) -> Iterator[str]:
    """Yield what tells the levels of an input from others: a robot's world is all the files that it consists of."""
    with suppress(Rejection):
        yield from (level.content for level in reader(item.reader).read(item) if isinstance(level, Level))


def _content_of(level: Level | RejectedLevel, sha256: str) -> str:
    """Return what tells a level from another of the same id; ``sha256`` is that of its input."""
    return level.content if isinstance(level, Level) else sha256


def _state_of(path: Path) -> tuple[int, int]:
    try:
        found = path.stat()
    except OSError:
        return 0, 0
    return found.st_mtime_ns, found.st_size


@dataclass(frozen=True, eq=False)
class _Whole:
    """What a file holds, whatever is made of it: triangles or points, a drawing's lines by storeys, a robot's map.

    ``floors`` are the other floors of a file of which levels were made, and its picture from the side; ``parts`` are
    the bounds (2, 3) of all that has a name, in the file's axes and unit.
    """

    mesh: Mesh | None = None
    lines: Sequence[Sequence[tuple[str, Any]]] = ()
    cells: RobotMap | None = None
    floors: tuple[tuple[float, ...], Picture | None] = ((), None)
    parts: Mapping[str, Floats] = field(default_factory=dict)

    @property
    def is_empty(self) -> bool:
        return self.mesh is None and not self.lines and self.cells is None


@dataclass(frozen=True, eq=False)
class _Searched:
    """A level without any word of its storey: its record without plans, and the results of the stages."""

    source: LevelSource
    results: list[StageResult]

    @property
    def layout(self) -> Layout | None:
        return next((each.value for each in self.results if isinstance(each.value, Layout)), None)


def _contents(item: Input, levels: Sequence[Level]) -> tuple[_Whole, list[str]]:
    """Return what a file holds, in its own axes and unit, and the names of its parts.

    Of a file of which ``levels`` were made, only the names, a drawing's lines and a mesh's floors are wanted.
    """
    path, options, is_read = Path(item.path), dict(item.options), bool(levels)
    try:
        if item.reader == "mesh_file":
            scene = load_scene(path)
            names = {name for part in scene.parts for name in (*part.groups, part.mesh, part.material) if name}
            mesh = scene.without_sky().mesh
            whole = (
                _Whole(floors=_floors(mesh, levels), parts=_boxes(_scene_parts(scene)))
                if is_read
                else _Whole(scene.mesh)
            )
            return whole, sorted(names)
        if item.reader == "points" and not is_read:
            points = np.concatenate([block[:, :3] for block in read_blocks(path)]).astype(np.float64)
            return _Whole(Mesh(points, np.zeros((0, 3), np.int64))), []
        if item.reader == "ifc":
            return _ifc_contents(path, levels)
        if item.reader == "vector_plans":
            lines, parts = drawing_lines(item)
            return _Whole(lines=lines), parts
        if item.reader == "occupancy_map" and not is_read:
            units, scale = said_size(options)
            given = float(options["resolution"]) if options.get("resolution") else None
            return _Whole(cells=scaled_map(path, given, units, scale).trimmed()), []
    except (Rejection, ValueError, MapError):
        pass
    return _Whole(), []


def _scene_parts(scene: MeshScene) -> Iterator[tuple[set[str], Floats]]:
    for part, low, high in zip(scene.parts, *scene.part_boxes, strict=True):
        yield {*part.groups, part.mesh, part.material} - {""}, np.array([low, high])


def _boxes(parts: Iterable[tuple[set[str], Floats]]) -> dict[str, Floats]:
    """Return the bounds (2, 3) of all parts of each name, of parts with their names and bounds."""
    found: dict[str, list[Floats]] = {}
    for names, box in parts:
        for name in names:
            found.setdefault(name, []).append(box)
    return {name: np.array([np.min(boxes, axis=0)[0], np.max(boxes, axis=0)[1]]) for name, boxes in found.items()}


def _bounds_of_parts(parts: Mapping[str, Floats], level: Level) -> Iterator[tuple[str, Box]]:
    """Yield the name of each part at the height of a level's rooms, and its bounds in the level's frame."""
    wide, high = ([0, 2], 1) if level.frame.up == "y" else ([0, 1], 2)
    for name, box in sorted(parts.items())[:_MOST_NAMES]:
        low, top = box[:, high] * (level.unit_m or 1.0) - level.frame.floor
        if low < ROOF_M and top > CM_M:
            (x1, y1), (x2, y2) = box[:, wide] * (level.unit_m or 1.0)
            corners = plan_points_from_source(level.frame, [(x1, y1), (x1, y2), (x2, y1), (x2, y2)]).round(2)
            yield displayable_name(name), (*corners.min(axis=0).tolist(), *corners.max(axis=0).tolist())


def _floors(mesh: Mesh, levels: Sequence[Level]) -> tuple[tuple[float, ...], Picture]:
    """Return heights that may be floors beside those of the levels, and a picture from the side with all of them."""
    vertices = mesh.vertices * (levels[0].unit_m or 1.0)
    if levels[0].frame.up == "y":
        vertices = np.column_stack([vertices[:, 0], -vertices[:, 2], vertices[:, 1]])
    upright, taken = Mesh(vertices, mesh.faces), [level.frame.floor for level in levels]
    others = other_floors(upright, taken)[:_MOST_FLOORS]
    return tuple(others), _side_view(upright, taken, others)


def _side_view(mesh: Mesh, taken: Sequence[float], others: Sequence[float] = ()) -> Picture:
    """Return a picture of a mesh (metres, z up) from the side, with the floors at these heights."""
    points = sample_mesh_points(mesh, _SIDE_SAMPLES)
    wide = int(np.ptp(points[:, 1]) > np.ptp(points[:, 0]))
    low, high = np.quantile(points[:, [wide, 2]], [0.001, 0.999], axis=0)
    sheet = _Sheet((float(low[0]), float(low[1]) - AROUND_M, float(high[0]), float(high[1]) + AROUND_M), _SIDE_PX)
    columns, rows = np.floor(sheet.pixels(points[:, [wide, 2]])).astype(np.int64).T
    inside = (columns >= 0) & (rows >= 0) & (columns < sheet.size[0]) & (rows < sheet.size[1])
    grey = np.full((sheet.size[1], sheet.size[0]), 255, np.uint8)
    grey[rows[inside], columns[inside]] = 150
    image = Image.fromarray(grey).convert("RGB")
    pen = ImageDraw.Draw(image)
    for heights, colour in ((taken, _COLOURS[0]), (others, _COLOURS[1])):
        for height in heights:
            y = float(sheet.pixels(np.array([low[0], height]))[1])
            pen.line([(0, y), (image.width, y)], fill=colour, width=2)
            pen.text((4, y - 12), f"{height:.2f} m", fill=colour)
    return sheet.picture("side", "From the side", np.asarray(image))


def _other_units(reader: str, unit_m: float | None, levels: Sequence[LevelSource]) -> tuple[tuple[float, ...], bool]:
    """Return what else a unit may be by the sizes of the plans, and whether one is likelier; a map states its own."""
    doors = [door for level in levels for plan in level.plans for door in decode(bytes(plan.plan)).doors]
    extents = [math.sqrt(math.prod(level.extent)) for level in levels if min(level.extent) > 0]
    if unit_m is None or not extents or reader == "occupancy_map":
        return (), False
    storeys = [level.ceiling_m for level in levels if level.ceiling_m]
    widths = tuple(door.width for door in doors if door.kind != "cut")
    found = SizesFound(float(np.median(storeys)) if storeys else 0.0, max(extents), widths=widths)
    others, is_odd = other_scales(found, unit_m)
    return tuple(others), is_odd


def _ifc_contents(path: Path, levels: Sequence[Level]) -> tuple[_Whole, list[str]]:
    from pipeline.sources.ifc.elements import element_names
    from pipeline.sources.ifc.model import load_building
    from pipeline.sources.ifc.step_file import open_model

    names = element_names(open_model(path)[0])
    building = load_building(path)
    if levels:
        bodies = [*building.walls, *building.loose, *building.beams, *building.slabs, *building.roofs, *building.spaces]
        bodies += [*building.outdoors, *building.leaves, *building.furniture, *building.stairs]
        boxes = (np.array([each.mesh.vertices.min(axis=0), each.mesh.vertices.max(axis=0)]) for each in bodies)
        of_bodies = (({*each.words, each.kind}, box / building.unit_m) for each, box in zip(bodies, boxes, strict=True))
        whole = merge_meshes([each.mesh for each in (*building.walls, *building.slabs, *building.stairs)])
        metres = Mesh(whole.vertices / building.unit_m * (levels[0].unit_m or building.unit_m), whole.faces)
        side = None if whole.is_empty else _side_view(metres, [level.frame.floor for level in levels])
        return _Whole(floors=((), side), parts=_boxes(of_bodies)), names
    parts = [*building.walls, *building.loose, *building.spaces, *building.slabs, *building.beams]
    return _Whole(merge_meshes([part.mesh for part in parts]) if parts else None), names


@dataclass(frozen=True, eq=False)
class _Shown:
    """What can be shown of a file whose levels could not be found, and an empty level in its place.

    ``units_m`` are the metres that the unit of a drawing may have, what is shown first.
    """

    source: LevelSource
    level: Level
    units_m: tuple[float, ...] = ()


def _file_as_shown(item: Input, override: Override, whole: _Whole, sha256: str) -> _Shown:
    """Return all of a file, from above (R6)."""
    level = level_without_walls(item, override, sha256)
    if whole.mesh is not None:
        mesh = whole.mesh
        if level.frame.up == "y":
            x, y, z = mesh.vertices.T
            mesh = Mesh(np.column_stack([x, -z, y]), mesh.faces)
        size = _UNITS.get(override.units or "") or 1.0
        mesh = Mesh(mesh.vertices * size * (override.scale or 1.0), mesh.faces)
        top = _top_view(mesh, _bounds_of([mesh]), np.inf)
        strokes = tuple(_outlines(mesh))
        layers = tuple({each.kind: None for each in strokes})
        pictures = () if top is None else (top,)
        return _Shown(LevelSource(item.id, level.frame, pictures, strokes=strokes, layers=layers), level)
    if whole.cells is not None:
        level = replace(level, frame=_map_frame(level, whole.cells))
        return _Shown(LevelSource(item.id, level.frame, (_map_picture(whole.cells, level),)), level)
    (unit_m, scale), lines = said_size(dict(item.options)), whole.lines[0]
    units_m = [each * scale for each in ([unit_m] if unit_m else _units_of(lines, scale))]
    lines = lines_without(lines, _left_out(item)) or lines
    main = main_part(lines)
    strokes, corners = _strokes(lines, level, units_m[0]), np.reshape(main, (2, 2)) * units_m[0]
    source = LevelSource(
        item.id,
        level.frame,
        (_lines_picture(strokes, plan_points_from_source(level.frame, corners)),),
        guesses=() if unit_m or scale != 1.0 else ("units",),
        extent=tuple(np.ptp(corners, axis=0).round(2).tolist()),
        strokes=strokes,
        layers=_ranked_names(lines, units_m[0]),
    )
    return _Shown(source, level, tuple(units_m))


def _of_file(said: LevelOverride, shown: _Shown, config: BuildConfig, why: str) -> LevelSource:
    """Return what is shown of a file whose levels could not be found, and the plan of what is said of it."""
    override, level = said.own, shown.level
    results, again = _stages(correct_level(level, said), override, config) if override.corrections else ([], why)
    plans = tuple(_plan_source(level, plan, results, None, is_founded=True) for plan in _plans_of(results))
    return msgspec.structs.replace(shown.source, plans=plans, rejected=again)


def _search_level(level: Level, item: Input, whole: _Whole, override: Override, config: BuildConfig) -> _Searched:
    results, why = _stages(level, override, config)
    evidence = next((each.value for each in results if isinstance(each.value, Evidence)), None)
    layout = next((each.value for each in results if isinstance(each.value, Layout)), None)
    number = level.frame.level
    lines = lines_without(whole.lines[number], _left_out(item)) if number < len(whole.lines) else []
    walls = [] if evidence is None else [*polygons_of(evidence.walls), *polygons_of(evidence.rails)]
    source = LevelSource(
        id=level.id,
        frame=level.frame,
        pictures=tuple(_pictures(level, item, walls, is_plan=not why)),
        edges=tuple(_rings(wall) for wall in _simplify_walls(walls)),
        places=tuple(_places(evidence, layout, is_map=item.reader == "occupancy_map")),
        rejected=why,
        guesses=level.guesses,
        extent=extent_of(level),
        strokes=_strokes(lines, level, level.unit_m),
        solid=_solid(level),
        seen=tuple(_lines_at(SECTIONS_M[1], level, walls)),
        seen_low=tuple(_lines_at(SECTIONS_M[0], level)),
        parts=tuple(_bounds_of_parts(whole.parts, level)),
        layers=_layers_asked(lines, level, why, _plans_of(results)),
        ceiling_m=0.0 if item.reader in {"vector_plans", "occupancy_map"} else round(level.ceiling_m, 2),
    )
    return _Searched(source, results)


def _outlines(mesh: Mesh) -> Iterator[Stroke]:
    """Yield the lines of a mesh that was not understood, to draw along: its longest section, or its outline if flat."""
    low, high = np.quantile(mesh.vertices[:, 2], [0.002, 0.998]) if len(mesh.faces) else (0.0, 0.0)
    slicer = MeshSlicer(mesh)
    cuts = [slicer.cut(low + share * (high - low)).ends for share in _SHARES] if high > low else []
    ends = max(cuts, key=lambda cut: float(np.linalg.norm(cut[:, 1] - cut[:, 0], axis=1).sum()), default=())
    if len(ends):
        kind, lines = "section", shapely.line_merge(shapely.multilinestrings(shapely.linestrings(ends)))
    else:
        kind, lines = "outline", shapely.union_all(shapely.polygons(mesh.vertices[mesh.faces, :2])).boundary
    for line in shapely.get_parts(shapely.simplify(lines, CM_M)).tolist():
        yield Stroke(kind, tuple((round(x, 4), round(y, 4)) for x, y in line.coords))


def _units_of(lines: Sequence[Line], scale: float) -> list[float]:
    """Return metres that a unit of a drawing may have that nobody can read, the likeliest first, before a scale."""
    main = main_part(lines)
    size, (_, thick) = max(main[2] - main[0], main[3] - main[1]), rank_layers(lines, main)[0]
    return likely_units(size, thick, scale) or likely_units(size, 0.0, scale) or [1.0]


def _ranked_names(lines: Sequence[Line], unit_m: float) -> tuple[str, ...]:
    return tuple(displayable_name(name) for name, _ in rank_layers(lines, main_part(lines), unit_m))


def _layers_asked(lines: Sequence[Line], level: Level, why: str, plans: Sequence[FloorPlan]) -> tuple[str, ...]:
    """Return the layers that may be the walls of a drawing: of one with plans, the one that draws walls in rooms.

    Where the layers of the walls are known, none is.
    """
    if why and lines:
        return _ranked_names(lines, level.unit_m)
    if "layers" not in level.guesses or not plans:
        return ()
    frames = [(plan.frame, room.polygon) for plan in plans if plan.frame for room in plan.rooms]
    there = [
        Polygon(plan_points_from_source(level.frame, source_points_from_plan(frame, np.array(room.exterior.coords))))
        for frame, room in frames
    ]
    rooms = shapely.union_all([room.buffer(-BESIDE_M) for room in there])
    drawn = lines_in_level(lines, level.frame, level.unit_m)
    shapes = [LineString(points) for _, points in drawn]
    inside = [k for k, shape in enumerate(shapes) if shape.intersects(rooms)]
    long = dict.fromkeys((drawn[k][0] for k in inside), 0.0)
    for k in inside:
        long[drawn[k][0]] += shapely.intersection(shapes[k], rooms).length
    longest_side = max(extent_of(level))
    ranked = rank_layers([drawn[k] for k in inside], rooms.bounds, 1.0) if inside else ()
    return tuple(displayable_name(name) for name, thick in ranked[:1] if thick and long[name] > longest_side)


def _left_out(item: Input) -> list[str]:
    """Return the patterns of the names of parts that somebody leaves out."""
    found: list[str] = json.loads(dict(item.options).get("drop_nodes", "[]"))
    return found


def _strokes(lines: Sequence[tuple[str, Any]], level: Level, unit_m: float) -> tuple[Stroke, ...]:
    """Return the lines of a drawing in the level frame."""
    found = lines_in_level(lines, level.frame, unit_m)
    return tuple(Stroke(displayable_name(kind), tuple(map(tuple, points.tolist()))) for kind, points in found)


def _lines_picture(strokes: Sequence[Stroke], corners: Floats) -> Picture:
    """Return the lines of a drawing from which no level was made, as a layer around an area of these corners."""
    # what lies so near to the walls is shown too
    low, high = corners.min(axis=0) - AROUND_M, corners.max(axis=0) + AROUND_M
    sheet = _Sheet((float(low[0]), float(low[1]), float(high[0]), float(high[1])), SOURCE_SIDE_PX)
    mask = Image.new("L", sheet.size, 0)
    pen = ImageDraw.Draw(mask)
    for stroke in strokes:
        pen.line([tuple(at) for at in sheet.pixels(np.asarray(stroke.points)).tolist()], fill=255, width=2)
    return sheet.masked("lines", "All lines of the drawing", mask, _COLOURS[0])


def _lines_at(height_m: float, level: Level, walls: Sequence[Polygon] = ()) -> Iterator[Points]:
    """Yield the straight lines in which something stands at a height, from end to end, the longest first.

    The faces of one wall are one line, in its middle; pieces a step apart are one too. Where no mesh is cut, ``walls``
    are what stands.
    """
    is_cut = not (isinstance(level.walls, Prisms) or level.walls.is_cloud or level.walls.is_empty)
    if is_cut:
        ends = shapely.linestrings(MeshSlicer(level.walls).cut(height_m + _OFF_M).ends)
        outlines = shapely.line_merge(shapely.multilinestrings(ends))
    else:
        outlines = shapely.MultiLineString([ring.coords for ring in shapely.get_rings(list(walls)).tolist()])
    merged = shapely.simplify(outlines, BESIDE_M / 2)
    points, line = shapely.get_coordinates(shapely.get_parts(merged), return_index=True)
    pairs = np.stack([points[:-1], points[1:]], axis=1)[line[:-1] == line[1:]]
    pairs = pairs[np.argsort(-np.hypot(*(pairs[:, 1] - pairs[:, 0]).T), kind="stable")][:_MOST_SEEN]
    while len(pairs):
        start, end = pairs[0]
        way = (end - start) / max(float(np.hypot(*(end - start))), CM_M)
        across = np.array([-way[1], way[0]])
        along, aside = np.sort((pairs - start) @ way, axis=1), (pairs - start) @ across
        is_own = np.arange(len(pairs)) == 0
        while True:
            low, high = along[is_own, 0].min() - _ONWARD_M, along[is_own, 1].max() + _ONWARD_M
            more = (np.abs(aside).max(axis=1) <= BESIDE_M) & (along[:, 0] <= high) & (along[:, 1] >= low)
            if more.sum() == is_own.sum():
                break
            is_own = more
        low, high = along[is_own, 0].min(), along[is_own, 1].max()
        if high - low >= _SHORTEST_SEEN_M:
            middle = start + across * (aside[is_own].min() + aside[is_own].max()) / 2
            (ax, ay), (bx, by) = np.round([middle + way * low, middle + way * high], 3).tolist()
            yield (ax, ay), (bx, by)
        pairs = pairs[~is_own]


def _simplify_walls(walls: Sequence[Polygon]) -> list[BaseGeometry]:
    """Return walls to snap to, as fine as a browser takes them."""
    fine_m = CM_M
    found = [shapely.simplify(wall, fine_m) for wall in walls]
    while sum(shapely.get_num_coordinates(found)) > _MOST_SNAP_CORNERS and fine_m < BESIDE_M:
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
    """Return the results of the stages (R1), and why there is no plan (R6)."""
    results: list[StageResult] = []
    try:
        results.extend(run_stages(level, configure(config.planning, override), level_rng(level, config.build.seed)))
    except Rejection as rejection:
        return results, str(rejection)
    return results, ""


def _plans_of(results: Sequence[StageResult]) -> list[FloorPlan]:
    return [each.value for each in results if isinstance(each.value, FloorPlan)]


def _plan_source(
    level: Level, plan: FloorPlan, results: Sequence[StageResult], layout: Layout | None, *, is_founded: bool
) -> PlanSource:
    doors = next((each.value for each in results if each.stage == "doors"), None)
    rooms = doors.rooms if isinstance(doors, Spaces) else ()
    spaces = layout.spaces if layout is not None else ()
    evidence = next((each.value for each in results if isinstance(each.value, Evidence)), None)
    standing = standing_walls(evidence, layout) if layout is not None and evidence is not None else []
    walls = shown_walls(level, evidence) if evidence is not None else []
    return PlanSource(
        plan.id,
        msgspec.Raw(encode(plan)),
        tuple(map(_rings, spaces)),
        tuple(map(_rings, rooms)),
        tuple(map(_rings, standing)),
        tuple(map(_rings, walls)),
        is_founded,
    )


def _rings(polygon: BaseGeometry) -> Rings:
    parts = polygons_of(polygon)
    if not parts:
        return ()
    rings = (parts[0].exterior, *parts[0].interiors)
    return tuple(tuple((round(x, 4), round(y, 4)) for x, y in ring.coords[:-1]) for ring in rings)


def _line_of_place(part: WallBox, lintels: BaseGeometry) -> Floats:
    """Return the ends (2, 2) of the middle line of what may close, as far as lintels go on along it."""
    half = part.along * part.width / 2
    axis = LineString([part.centre - half, part.centre + half])
    if not lintels.is_empty:
        x1, y1, x2, y2 = lintels.bounds
        beyond = part.along * math.hypot(x2 - x1, y2 - y1)
        there = shapely.intersection(LineString([part.centre - beyond, part.centre + beyond]), lintels)
        pieces = [each for each in shapely.get_parts(there).tolist() if each.distance(Point(part.centre)) < CM_M]
        axis = max([axis, *pieces], key=lambda each: float(each.length))
    return np.asarray(shapely.get_coordinates(axis)[[0, -1]])


def _places(evidence: Evidence | None, layout: Layout | None, *, is_map: bool) -> Iterator[Place]:
    """Yield what may close, once each: what is named first, then what closes for the layout.

    A robot's map names nothing: all that its walls show are gaps. What goes round corners, as the rim of a roof, is no
    place. Parts of a lintel that lies in one line, which beams cross, are one place.
    """
    lintels: BaseGeometry = Polygon() if evidence is None else evidence.lintels
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
    for (kind, polygon), box in zip(kinds, boxes_around_polygons([polygon for _, polygon in kinds]), strict=True):
        if box.width < NARROWEST_DOOR_M or polygon.area < box.width * box.thickness / 2:
            continue
        line = _line_of_place(box, lintels if kind == "lintel" else Polygon())
        centre = line.mean(axis=0)
        if any(np.hypot(*(centre - other)) < BESIDE_M for other in seen):
            continue
        seen.append(centre)
        ends = np.round(line, 3).tolist()
        yield Place("gap" if is_map else kind, ((ends[0][0], ends[0][1]), (ends[1][0], ends[1][1])))


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
        options = dict(item.options)
        (units, scale), given = said_size(options), options.get("resolution")
        yield _map_picture(scaled_map(Path(item.path), float(given) if given else None, units, scale).trimmed(), level)
        return
    whole = _mesh_of(level)
    if whole.is_empty:
        return
    shown = [*walls, *polygons_of(level.floor)] if level.floor is not None and not is_plan else walls
    around = [each for area in shown for each in (area.bounds[:2], area.bounds[2:])]
    if around:
        low, high = np.min(around, axis=0) - AROUND_M, np.max(around, axis=0) + AROUND_M
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


def _mesh_of(level: Level) -> Mesh:
    """Return all triangles of a level; its walls alone if they are prisms or points."""
    if isinstance(level.walls, Prisms) or level.walls.is_cloud:
        return level.walls
    return merge_meshes([level.walls, *level.door_meshes, *(each.mesh for each in level.furniture)])


def _solid(level: Level) -> Solid | None:
    """Return the largest triangles of a mesh, to be shown in three dimensions."""
    mesh = _mesh_of(level)
    if isinstance(mesh, Prisms) or mesh.is_cloud:
        return None
    low, high = _SHOWN_HEIGHTS_M
    heights = mesh.vertices[mesh.faces, 2]
    faces = mesh.faces[(heights.max(axis=1) > low) & (heights.min(axis=1) < high)]
    if not len(faces):
        return None
    if len(faces) > _MOST_TRIANGLES:
        a, b, c = mesh.vertices[faces].swapaxes(0, 1)
        areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
        faces = faces[np.argpartition(-areas, _MOST_TRIANGLES)[:_MOST_TRIANGLES]]
    used, faces = np.unique(faces, return_inverse=True)
    return Solid(mesh.vertices[used].astype("<f4").tobytes(), faces.astype("<u4").tobytes())


def _bounds_of(meshes: Iterable[Mesh]) -> Box:
    vertices = np.concatenate([mesh.vertices for mesh in meshes])
    if not len(vertices):
        return (0.0, 0.0, 1.0, 1.0)
    low, high = np.quantile(vertices[:, :2], [0.001, 0.999], axis=0)
    return (float(low[0]) - CM_M, float(low[1]) - CM_M, float(high[0]) + CM_M, float(high[1]) + CM_M)


def _section(mesh: Mesh, height: float, sheet: _Sheet) -> Image.Image:
    """Return where something stands at a height, as a mask."""
    mask = Image.new("L", sheet.size, 0)
    pen = ImageDraw.Draw(mask)
    if isinstance(mesh, Prisms):
        for body in mesh.bodies_at(height):
            for fill, ring in ((255, body.exterior), *((0, hole) for hole in body.interiors)):
                pen.polygon([tuple(at) for at in sheet.pixels(shapely.get_coordinates(ring)).tolist()], fill=fill)
        return mask
    if mesh.is_cloud:
        from scipy.ndimage import maximum_filter

        near = mesh.vertices[np.abs(mesh.vertices[:, 2] - height) < SHEET_M]
        columns, rows = np.floor(sheet.pixels(near[:, :2])).astype(np.int64).T
        inside = (columns >= 0) & (rows >= 0) & (columns < mask.width) & (rows < mask.height)
        image = np.zeros((mask.height, mask.width), np.uint8)
        image[rows[inside], columns[inside]] = 255
        return Image.fromarray(
            maximum_filter(image, max(round(VOXEL_M * sheet.scale), 1))
        )  # points are voxels' middles
    segments = sheet.pixels(MeshSlicer(mesh).cut(height).ends)
    for (ax, ay), (bx, by) in segments.tolist():
        pen.line((ax, ay, bx, by), fill=255, width=2)
    return mask


_FLOOR, _HIGH = 225, 70
"""Grey of what lies at the floor, and of what ends at ``ROOF_M``."""


def _top_view(mesh: Mesh, bounds: Box, roof_m: float) -> Picture | None:
    """Return what is visible from above: the higher, the darker; None if nothing is."""
    from scipy.ndimage import grey_dilation

    points = mesh.vertices if mesh.is_cloud else sample_mesh_points(mesh, _TOP_SAMPLES)
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
    shade = np.clip((np.where(seen, tallest, low) - low) / max(high - low, CM_M), 0.0, 1.0)
    grey = (_FLOOR + (_HIGH - _FLOOR) * shade).astype(np.uint8)
    image = np.dstack([grey, grey, grey, np.where(seen, 255, 0).astype(np.uint8)])
    return sheet.picture("top", "From above, without roof" if np.isfinite(roof_m) else "From above", image)


def _map_frame(level: Level, found: RobotMap) -> Frame:
    """Return the frame of a level that lies in a map's own."""
    (a, b, x), (c, d, y) = found.affine
    return replace(level.frame, matrix=((a, b, x), (c, d, y)))


def _map_picture(found: RobotMap, level: Level) -> Picture:
    """Return the map itself; what nobody saw is clear."""
    grid, own = np.array([*found.affine, (0.0, 0.0, 1.0)]), np.array([*level.frame.matrix, (0.0, 0.0, 1.0)])
    (x, y) = (np.linalg.inv(own) @ grid)[:2, 2].tolist()
    rows, columns = found.occupancy.shape
    shade = np.where(found.occupancy < 0, 128, 255 - found.occupancy.astype(np.int64) * 255 // 100).astype(np.uint8)
    image = np.dstack([shade, shade, shade, np.where(found.occupancy < 0, 60, 255).astype(np.uint8)])
    bounds = (x, y, x + columns * found.resolution_m, y + rows * found.resolution_m)
    return _Sheet(bounds, max(rows, columns)).picture("map", "The map", image)
