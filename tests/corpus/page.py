"""Pictures of what came of a file: its source from two sides, and each plan over sections of its source.

A tile of a plan shows the source's sections at 1.1 m (blue) and 1.9 m (black) above the plan's floor, in the source's
metres; what the source names as door (red) and furniture (brown) apart. Below them lie the plan's rooms, and above them
its doors: blue doors, cyan openings, magenta entrances, red cuts. Of a robot's map, a tile shows the cells instead:
occupied ones black, unknown ones grey.
"""

from __future__ import annotations

import base64
import hashlib
import io
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import Any, Final

import cv2
import msgspec
import numpy as np
import numpy.typing as npt
import shapely
import trimesh
from PIL import Image

from houseexpo.errors import HouseExpoError
from houseexpo.grids.robot_map import RobotMap, read_map
from pipeline.geometry.meshes import Mesh
from pipeline.html_report import page_html, table_html
from pipeline.rejection import Rejection
from pipeline.sources import find, reader
from pipeline.sources.meshes.formats import SUFFIXES, frame_convention, load_scene
from pipeline.values import Level
from tests.corpus.manifest import Verdict
from tests.corpus.runs import Built

HEIGHTS_M: Final = (1.1, 1.9)
TILE: Final = 460
"""Pixels of a tile's side, its caption not counted."""

MOST_TILES: Final = 6
MOST_FACES: Final = 250_000
"""More are drawn as points."""

_CAPTION: Final = 22
_INK, _PAPER = (0, 0, 0), 255
_SECTIONS: Final = ((220, 130, 60), (0, 0, 0))
"""Colours here are BGR, as OpenCV has them."""
_LEAF, _FURNITURE = (40, 40, 220), (110, 160, 190)
_DOORS: Final = {"door": (220, 60, 20), "opening": (200, 190, 0), "entrance": (200, 0, 200), "cut": (0, 0, 255)}
_LIGHT: Final = np.array([0.35, -0.5, 0.79])

Floats = npt.NDArray[np.float64]
Picture = npt.NDArray[np.uint8]


@dataclass(frozen=True)
class Task:
    """A file to draw: where it lies, where its models are, and the plans (as JSON) that were made of it."""

    path: str
    models: str
    plans: tuple[dict[str, Any], ...]
    picture: str

    @classmethod
    def of(cls, built: Built, folder: Path, models: str, pictures: Path) -> Task:
        """The picture's name depends on all that it shows."""
        shown = msgspec.json.encode([built.file.sha256, built.outcome.lines, _VERSION])
        name = f"{built.file.key}-{hashlib.sha256(shown).hexdigest()[:8]}.jpg"
        return cls(str(built.file.place(folder)), models, built.plans, str(pictures / name))


def draw(task: Task) -> None:
    """Write the picture of a file, unless it is there already."""
    target = Path(task.picture)
    if target.is_file():
        return
    levels, raw, cells = levels_of(task.path, task.models), _raw(Path(task.path)), _map_of(task.path)
    whole = raw if raw is not None else _joined(levels)
    tiles = []
    if cells is not None:
        tiles.append(_map_tile(cells))
    elif whole is not None:
        tiles.append(_view(whole, "source", oblique=True))
        if levels:
            tiles.append(_cut_open(levels))
        else:
            z = whole.vertices[:, 2]
            tiles.append(_view(whole, "source from above, cut open halfway", below=float((z.min() + z.max()) / 2)))
    plans = sorted(task.plans, key=lambda plan: -sum(room["area"] for room in plan["rooms"]))
    tiles += [_plan_tile(plan, _level_of(plan, levels), cells) for plan in plans[: MOST_TILES - len(tiles)]]
    if not plans and cells is None:
        tiles += [_section_tile(level) for level in levels[: MOST_TILES - len(tiles)]]
    if not tiles:
        tiles.append(_titled(np.full((TILE, TILE, 3), _PAPER, np.uint8), "nothing of it can be read"))
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_bytes(_jpeg(_side_by_side(tiles)))


_VERSION: Final = 1
"""Counted up where pictures change."""


def write_page(built: Sequence[Built], notes: Mapping[str, Sequence[str]], tables: Iterable[str], out: Path) -> None:
    """Write a page that needs no other file: tables, then each file with its picture, those with changes first.

    Parameters
    ----------
    notes
        By the files' names, lines on what has changed.
    tables
        HTML, for the top of the page.
    """
    order = [*Verdict]
    ordered = sorted(built, key=lambda each: (not notes.get(each.file.name), order.index(each.verdict), each.file.name))
    parts = [*tables, _STYLE, *(_card(each, notes.get(each.file.name, ()), out) for each in ordered)]
    out.write_text(page_html("The corpus of real houses", parts), encoding="utf-8")


def outcomes_table(heading: str, rows: Sequence[Sequence[str]], columns: Sequence[str]) -> str:
    """A table with a heading."""
    return f"<h2>{escape(heading)}</h2>{table_html(columns, rows)}"


_STYLE: Final = """<style>
body { max-width: none } .file { border-top: 1px solid #8884; padding: .5rem 0 } .file img { max-width: 100% }
.file p { margin: .2rem 0 } .file code { white-space: pre-wrap }
</style>"""


def _card(built: Built, notes: Sequence[str], out: Path) -> str:
    file = built.file
    quality = "" if built.outcome.quality is None else f", quality {built.outcome.quality:.2f}"
    verdict = str(built.verdict) or "to be judged"
    lines = list(built.outcome.lines)
    for number, plan in enumerate(built.outcome.plans):
        lines[number] += f" (quality {plan.quality:.2f})"
    picture = next(iter(sorted((out.parent / "pictures").glob(f"{file.key}-*.jpg"))), None)
    image = ""
    if picture is not None:
        coded = base64.b64encode(picture.read_bytes()).decode()
        image = f'<img src="data:image/jpeg;base64,{coded}" alt="" loading="lazy">'
    where = f"{file.repository} {file.path} @ {file.commit[:10] or 'commit unknown'}; {file.licence}"
    return (
        f'<section class="file" id="{escape(file.name)}"><h3>{escape(file.name)}: {escape(verdict)}{quality}</h3>'
        f"<p>{escape(file.kind)}: {escape(file.shows)}. <small>{escape(where)}</small></p>"
        f"<p>{escape(file.why)}</p><p><code>{escape(chr(10).join(lines))}</code></p>"
        + (f"<p><b>changed</b> <code>{escape(chr(10).join(notes))}</code></p>" if notes else "")
        + f"{image}</section>"
    )


def levels_of(path: str, models: str) -> list[Level]:
    """All levels of a file that can be read, as far as they can; ``models`` are folders of models, as in a build."""
    found: list[Level] = []
    try:
        for item in find(path, model_path=models):
            found += [level for level in reader(item.reader).read(item) if isinstance(level, Level)]
    except Exception:  # noqa: BLE001 - a picture shows what there is; the build says what is wrong
        return found
    return found


def _raw(path: Path) -> Mesh | None:
    """A mesh as its file has it, turned upright by its format's convention; None where it is no mesh."""
    if path.suffix.lower() not in SUFFIXES:
        return None
    try:
        mesh = load_scene(path).mesh
        up = frame_convention(path).up
    except Rejection:
        return None
    x, y, z = mesh.vertices.T
    return Mesh(np.column_stack([x, -z, y]) if up == "y" else mesh.vertices, mesh.faces)


def _bodies(level: Level) -> list[tuple[Mesh, tuple[int, int, int]]]:
    """What stands in a level, each with its colour."""
    return [
        (level.walls, (170, 170, 170)),
        *((each.mesh, _FURNITURE) for each in level.furniture),
        *((each.mesh, _LEAF) for each in level.leaves),
    ]


def _map_of(path: str) -> RobotMap | None:
    """The cells of a robot's map; None where the file is none, or cannot be read."""
    try:
        return read_map(path) if any(item.reader == "occupancy_map" for item in find(path)) else None
    except HouseExpoError:
        return None


def _joined(levels: Sequence[Level]) -> Mesh | None:
    """All levels as one mesh, in the source's axes upright."""
    vertices, faces, offset = [], [], 0
    for level in levels:
        for mesh, _ in _bodies(level):
            vertices.append(mesh.vertices + np.array([0.0, 0.0, level.frame.floor]))
            faces.append(mesh.faces + offset)
            offset += len(mesh.vertices)
    if not vertices:
        return None
    return Mesh(np.concatenate(vertices), np.concatenate(faces).astype(np.int64))


def _cut_open(levels: Sequence[Level]) -> Picture:
    """The largest level from above, what is higher than 1.9 m taken off."""
    level = max(levels, key=lambda each: len(each.walls.vertices))
    parts, colours = [], []
    for mesh, colour in _bodies(level):
        parts.append(mesh)
        colours.append(np.tile(colour, (max(len(mesh.faces), 1 if mesh.is_cloud else 0), 1)))
    whole = trimesh.util.concatenate([trimesh.Trimesh(part.vertices, part.faces, process=False) for part in parts])
    mesh = Mesh(np.asarray(whole.vertices), np.asarray(whole.faces, np.int64))
    painted = None if mesh.is_cloud else np.concatenate([colour for colour in colours if len(colour)])
    return _view(mesh, f"level {level.frame.level}, cut open at {HEIGHTS_M[1]} m", below=HEIGHTS_M[1], colours=painted)


def _view(mesh: Mesh, title: str, *, oblique: bool = False, below: float | None = None, colours: Any = None) -> Picture:
    """Draw a mesh from above, or obliquely; what lies ``below`` a height only; the farthest first."""
    points = mesh.vertices
    extent = np.ptp(points, axis=0) if len(points) else np.zeros(3)
    title = f"{title}; {extent[0]:.4g} x {extent[1]:.4g} x {extent[2]:.4g}"
    turn = np.array([[0.87, 0.5, 0.0], [-0.25, 0.43, 0.87], [0.43, -0.75, 0.5]]) if oblique else np.eye(3)
    seen = points @ turn.T
    image = np.full((TILE, TILE, 3), _PAPER, np.uint8)
    faces = mesh.faces
    if below is not None:
        points_kept = points[:, 2] < below
        faces = faces[points_kept[faces].any(axis=1)] if len(faces) else faces
        if len(faces):  # what reaches over the cut ends at it
            seen = np.column_stack([seen[:, :2], np.minimum(seen[:, 2], below)])
    else:
        points_kept = np.ones(len(points), np.bool_)
    used = np.unique(faces) if len(faces) else np.flatnonzero(points_kept)
    if not len(used):
        return _titled(image, title)
    low, high = np.quantile(seen[used, :2], [0.001, 0.999], axis=0)
    scale = (TILE - 20) / max(float((high - low).max()), 1e-9)
    middle = (low + high) / 2
    pixels = (seen[:, :2] - middle) * [scale, -scale] + TILE / 2
    pixels = np.clip(np.nan_to_num(pixels), -2 * TILE, 3 * TILE)
    if not len(faces):
        _splat(image, pixels[used], seen[used, 2], None)
        return _titled(image, title)
    corners = points[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    shade = 0.4 + 0.6 * np.abs(normals @ _LIGHT)
    base = np.full((len(faces), 3), 215.0) if colours is None else _kept_colours(mesh, colours, faces, below) * 1.25
    painted = np.clip(base * shade[:, None], 0, 255)
    depth = seen[faces][:, :, 2].mean(axis=1)
    if len(faces) > MOST_FACES:
        _splat(image, pixels[faces].mean(axis=1), depth, painted)
    else:
        rounded = np.round(pixels[faces] * 16).astype(np.int32)
        for k in np.argsort(depth):
            cv2.fillConvexPoly(image, rounded[k], painted[k].tolist(), cv2.LINE_8, 4)
    return _titled(image, title)


def _kept_colours(mesh: Mesh, colours: Any, faces: Any, below: float | None) -> Floats:
    kept = (mesh.vertices[:, 2] < below)[mesh.faces].any(axis=1) if below is not None else slice(None)
    return np.asarray(colours, np.float64)[kept]


def _splat(image: Picture, pixels: Floats, depth: Floats, painted: Floats | None) -> None:
    """Draw points, those that are nearest last; without colours the higher are the darker."""
    order = np.argsort(depth)
    at = np.round(pixels[order]).astype(np.int64)
    inside = ((at >= 1) & (at < TILE - 1)).all(axis=1)
    at, order = at[inside], order[inside]
    if painted is None:
        low, high = np.quantile(depth, [0.02, 0.98])
        grey = 210 - 190 * np.clip((depth[order] - low) / max(high - low, 1e-9), 0, 1)
        painted_here = np.repeat(grey[:, None], 3, axis=1)
    else:
        painted_here = painted[order]
    image[at[:, 1], at[:, 0]] = painted_here.astype(np.uint8)


@dataclass
class _Sheet:
    """A drawing of plan areas, x right and y up; metres of the level frame."""

    bounds: tuple[float, float, float, float]
    image: Picture = field(default_factory=lambda: np.full((TILE, TILE, 3), _PAPER, np.uint8))

    def pixels(self, points: Any) -> Floats:
        """Where points (n, 2) are drawn."""
        return np.clip(self._moved(points), -4 * TILE, 5 * TILE)

    def _moved(self, points: Any) -> Floats:
        x1, y1, x2, y2 = self.bounds
        scale = (TILE - 24) / max(x2 - x1, y2 - y1, 1e-6)
        moved: Floats = (np.asarray(points, np.float64) - [(x1 + x2) / 2, (y1 + y2) / 2]) * [scale, -scale] + TILE / 2
        return moved

    def cells(self, found: RobotMap, level: Level | None) -> None:
        """Draw the cells of a map over what there is; without a level, the drawing is in the map's frame."""
        corners = np.float32([[0, 0], [1, 0], [0, 1]])
        at = self._moved(_from_source(level)(found.points_from_pixels(corners)))
        shrunk = max(int(1 / max(np.hypot(*(at[1] - at[0])), 1e-6)), 1)  # else thin walls would fall between pixels
        matrix = np.column_stack([(at[1] - at[0]) * shrunk, (at[2] - at[0]) * shrunk, at[0]])
        matrix[:, 2] += (matrix[:, 0] + matrix[:, 1]) / 2 - 0.5  # from corners of cells to their middles
        rows, cols = (-(-side // shrunk) * shrunk for side in found.occupancy.shape)
        for chosen, grey, weight, beyond in ((found.occupancy < 0, 128, 0.4, 1), (found.occupied, 0, 1.0, 0)):
            whole = np.full((rows, cols), beyond, np.float32)
            whole[: chosen.shape[0], : chosen.shape[1]] = chosen
            blocks = whole.reshape(rows // shrunk, shrunk, cols // shrunk, shrunk)
            share = blocks.mean(axis=(1, 3)) if grey else blocks.max(axis=(1, 3))
            share = cv2.warpAffine(share, matrix, (TILE, TILE), flags=cv2.INTER_LINEAR, borderValue=beyond)
            share = share[..., None] * weight
            self.image[:] = np.round(self.image * (1 - share) + grey * share)

    def fill(self, rings: Sequence[Any], colour: tuple[int, int, int]) -> None:
        """Fill a polygon, the outer ring first."""
        cv2.fillPoly(self.image, [self._fixed(ring) for ring in rings], colour, cv2.LINE_AA, 4)

    def segments(self, segments: Floats, colour: tuple[int, int, int], width: int = 1) -> None:
        """Draw segments (n, 2, 2)."""
        if len(segments):
            fixed = self._fixed(segments.reshape(-1, 2)).reshape(-1, 2, 2)
            cv2.polylines(self.image, list(fixed), False, colour, width, cv2.LINE_AA, 4)

    def dots(self, points: Floats, colour: tuple[int, int, int]) -> None:
        """Draw points (n, 2)."""
        at = np.round(self.pixels(points)).astype(np.int64)
        at = at[((at >= 0) & (at < TILE)).all(axis=1)]
        self.image[at[:, 1], at[:, 0]] = colour

    def sections(self, level: Level) -> None:
        """Draw what stands in a level at both heights."""
        for height, colour in zip(HEIGHTS_M, _SECTIONS, strict=True):
            for mesh, own in _bodies(level):
                chosen = colour if mesh is level.walls else own
                if mesh.is_cloud:
                    near = np.abs(mesh.vertices[:, 2] - height) < 0.05
                    self.dots(mesh.vertices[near, :2], chosen)
                else:
                    self.segments(section(mesh, height), chosen)

    def write(self, at: Any, words: str) -> None:
        """Write a few words about a point."""
        (x, y), *_ = self.pixels([at])
        (width, _), _ = cv2.getTextSize(words, cv2.FONT_HERSHEY_SIMPLEX, 0.36, 1)
        place = (int(x) - width // 2, int(y))
        cv2.putText(self.image, words, place, cv2.FONT_HERSHEY_SIMPLEX, 0.36, (255, 255, 255), 3, cv2.LINE_AA)
        cv2.putText(self.image, words, place, cv2.FONT_HERSHEY_SIMPLEX, 0.36, (60, 60, 0), 1, cv2.LINE_AA)

    def _fixed(self, points: Any) -> npt.NDArray[np.int32]:
        return np.round(self.pixels(points) * 16).astype(np.int32)


def _map_tile(found: RobotMap) -> Picture:
    """The cells of a map, as far as they are known."""
    rows, cols = np.nonzero(found.occupancy >= 0)
    known = found.points_from_pixels(np.column_stack([cols, rows]) + 0.5)
    low, high = known.min(axis=0) - 0.3, known.max(axis=0) + 0.3
    sheet = _Sheet((*low.tolist(), *high.tolist()))
    sheet.cells(found, None)
    rows, cols = found.occupancy.shape
    return _titled(sheet.image, f"map, {cols} x {rows} cells of {found.resolution_m:.3g} m; {_size(sheet)}")


def _plan_tile(plan: Mapping[str, Any], level: Level | None, cells: RobotMap | None) -> Picture:
    """A plan over the sections of its level, or over a map's cells."""
    to_level = _into(plan["frame"]["matrix"], level)
    rooms = [(to_level(room["polygon"]), [to_level(hole) for hole in room["holes"]], room) for room in plan["rooms"]]
    outline = to_level(plan["verts"])
    sheet = _Sheet(_bounds(level, outline))
    for number, (ring, holes, _) in enumerate(rooms):
        sheet.fill([ring, *holes], _PASTELS[number % len(_PASTELS)])
    if cells is not None:
        sheet.cells(cells, level)
    elif level is not None:
        sheet.sections(level)
    for door in plan["doors"]:
        sheet.segments(np.asarray(to_level(door["segment"]))[None], _DOORS[door["kind"]], 4)
    for ring, _, room in rooms:
        label = "" if room["label"] == "Unlabelled" else room["label"][:10] + " "
        if len(rooms) <= 30:
            sheet.write(shapely.Polygon(ring).buffer(0).representative_point().coords[0], f"{label}{room['area']:.0f}")
    cuts = sum(door["kind"] == "cut" for door in plan["doors"])
    quality = (plan.get("quality") or {}).get("score", 1.0)
    count = f"{len(rooms)} rooms, {len(plan['doors'])} doors, {cuts} cuts"
    return _titled(sheet.image, f"L{plan['frame']['level']} q {quality:.2f}: {count}, {_size(sheet)}")


def _section_tile(level: Level) -> Picture:
    """The sections of a level of which no plan was made."""
    sheet = _Sheet(_bounds(level, None))
    sheet.sections(level)
    return _titled(sheet.image, f"L{level.frame.level}, no plan, {_size(sheet)}")


def _size(sheet: _Sheet) -> str:
    x1, y1, x2, y2 = sheet.bounds
    return f"{x2 - x1:.3g} x {y2 - y1:.3g} m"


def _bounds(level: Level | None, outline: Any) -> tuple[float, float, float, float]:
    """What a tile shows: the plan with a margin, and of what stands around it as much again; or all that stands."""
    points = np.empty((0, 2)) if level is None else level.walls.vertices[:, :2]
    if len(points):
        points = points[np.isfinite(points).all(axis=1)]
    if outline is None:
        low, high = np.quantile(points, [0.002, 0.998], axis=0) if len(points) else (np.zeros(2), np.ones(2))
    else:
        low, high = np.min(outline, axis=0), np.max(outline, axis=0)
        if len(points):
            reach = max(1.0, 0.5 * float((high - low).max()))
            all_low, all_high = np.quantile(points, [0.002, 0.998], axis=0)
            low = np.minimum(low, np.maximum(all_low, low - reach))
            high = np.maximum(high, np.minimum(all_high, high + reach))
    return float(low[0]) - 0.3, float(low[1]) - 0.3, float(high[0]) + 0.3, float(high[1]) + 0.3


def _into(matrix: Any, level: Level | None) -> Any:
    """A function that takes a plan's points to the level frame; to the source's plan axes where there is no level."""
    from_plan, to_level = np.asarray(matrix, np.float64), _from_source(level)
    return lambda points: to_level(np.asarray(points, np.float64) @ from_plan[:, :2].T + from_plan[:, 2])


def _from_source(level: Level | None) -> Any:
    """A function that takes points of the source's plan axes to the level frame, and leaves them without a level."""
    whole = np.eye(3) if level is None else np.linalg.inv(np.vstack([level.frame.matrix, [0, 0, 1]]))
    return lambda points: points @ whole[:2, :2].T + whole[:2, 2]


def _level_of(plan: Mapping[str, Any], levels: Sequence[Level]) -> Level | None:
    """The level that a plan was made of."""
    name = plan["id"]
    own = [level for level in levels if level.frame.level == plan["frame"]["level"]]
    exact = [level for level in own if name.startswith(level.id)]
    return next(iter(exact or own), None)


def section(mesh: Mesh, height: float) -> Floats:
    """Where a mesh meets a height, (n, 2, 2)."""
    if not len(mesh.faces):
        return np.empty((0, 2, 2))
    whole = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    found = trimesh.intersections.mesh_plane(whole, plane_normal=[0, 0, 1], plane_origin=[0, 0, height + 0.0013])
    return np.asarray(found, np.float64).reshape(-1, 2, 3)[:, :, :2]


_PASTELS: Final = (
    (200, 235, 255),
    (215, 245, 210),
    (245, 225, 205),
    (225, 210, 250),
    (250, 245, 200),
    (205, 225, 235),
    (235, 215, 235),
)


def _titled(image: Picture, words: str) -> Picture:
    head = np.full((_CAPTION, image.shape[1], 3), _PAPER, np.uint8)
    cv2.putText(head, words[:72], (4, 15), cv2.FONT_HERSHEY_SIMPLEX, 0.4, _INK, 1, cv2.LINE_AA)
    framed = cv2.copyMakeBorder(image, 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=(200, 200, 200))
    return np.vstack([cv2.copyMakeBorder(head, 0, 0, 1, 1, cv2.BORDER_CONSTANT, value=(255, 255, 255)), framed])


def _side_by_side(tiles: Sequence[Picture]) -> Picture:
    columns = 3 if len(tiles) > 4 else len(tiles)
    rows = []
    for start in range(0, len(tiles), columns):
        row = np.hstack(list(tiles[start : start + columns]))
        missing = tiles[0].shape[1] * columns - row.shape[1]
        rows.append(cv2.copyMakeBorder(row, 0, 0, 0, missing, cv2.BORDER_CONSTANT, value=(255, 255, 255)))
    return np.vstack(rows)


def _jpeg(image: Picture) -> bytes:
    stream = io.BytesIO()
    Image.fromarray(image[:, :, ::-1]).save(stream, "JPEG", quality=72, optimize=True)
    return stream.getvalue()
