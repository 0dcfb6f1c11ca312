"""Read a DXF drawing by ezdxf: walls, rooms, doors and names by words in the names of its layers.

R1  The unit is ``$INSUNITS``, unless it states none, or one in which the drawing is no house (U1, U2).
R2  Layers are told by words in their names (wall, door, room, text and their like in other languages), inserts by
    their own layer, or by the block's. What is on other layers is passed over.
R3  Inserts are taken apart as deep as they go; a block that holds itself is left out, with a note.
R4  Where no layer says wall or room, or such layers hold only texts, the lines of the layers that say nothing are
    walls, but those in blocks and on layers with the words of ``_OTHERS``; the plan says that its layers are a guess.
    An arc among them as wide as a door is a door, and a line from about its hinge to about its end the leaf.
    Where all lines stand in blocks (a drawing that was inserted as a whole), those of the blocks count.
    Where a person says which layers hold the walls, nothing is guessed but such doors.
R5  Arcs, bulges and splines are lines of short pieces. What is filled (hatches) on a layer called wall is wall, and so
    is a polyline with a width.
R6  An arc on a layer called door or opening is a swing: also one of a polyline, and of a block that was stretched.
R7  On a layer called both door and window, what lies around the hinge of a swing is a door, and the rest is a window.
R8  A polyline without marks of subclasses, as people write by hand, is read as if it had them.
"""

from __future__ import annotations

import io
import logging
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import count, pairwise
from pathlib import Path, PurePosixPath
from typing import Any, Final

import numpy as np
import shapely
from shapely import LineString, Polygon

from houseexpo.errors import MissingDependencyError, install_command
from houseexpo.file_kinds import STATES_WAYS, format_suffix
from pipeline.rejection import Reason, Rejection
from pipeline.sources.drawn_storeys import polygon_from_ring
from pipeline.sources.files import LeftOutParts, archive_members, displayable_name, read_bytes, read_member
from pipeline.sources.tolerances import (
    DEEPEST,
    DRAWING_M,
    DRAWN_UNITS_M,
    LARGEST_BYTES,
    LONGEST_SITE_M,
    MAX_SAMPLES,
    MOST_PARTS,
    PARALLEL,
    SWING_M,
    WALL_THICKNESS_M,
)
from pipeline.sources.vector_plans.drawing import Drawing, DrawnStorey, Feature, Point, is_named
from pipeline.sources.vector_plans.named_features import (
    kind_from_name,
    names_doors_and_windows,
    nest_rings,
    storey_from_features,
)
from pipeline.tolerances import HARDLY, MOST, SAME

MOST_WALL_LINES = 20_000
"""Letters and patterns that a program took apart have more; the walls of a hospital have some thousand."""
_UNITS: Final = {1: 0.0254, 2: 0.3048, 4: 0.001, 5: 0.01, 6: 1.0, 14: 0.1}
_ADVICE = "save it again as DXF (R2010 or later)"
_TEXTS: Final = frozenset({"TEXT", "MTEXT"})
_CURVES: Final = frozenset({"ARC", "CIRCLE", "ELLIPSE", "SPLINE"})
_POLYLINES: Final = frozenset({"LWPOLYLINE", "POLYLINE"})
_ZIP: Final = b"PK\x03\x04"
_BINARY: Final = b"AutoCAD Binary DXF"
AJAR_DEG: Final = 12
"""A leaf is drawn this far open, at least."""
_PIECES: Final = 8
"""Of a quarter of a circle."""
_BOTH: Final = "door or window"
_AROUND_HINGE: Final = 1.2
"""A leaf, its frame and its sill reach this far from the hinge, in widths of the leaf."""
_MOST_GUESSED: Final = 5_000
_OTHERS = re.compile(
    r"dim|defpoint|text|note|anno|title|frame|border|viewport|grid|axis|achse|cote|hatch|furn|equip|elec|plumb|sanit|"
    r"light|detail|legend|schedule|wire|site|plot|landscap|topo|tree|plant|roof|section|elev|stair|level|water|fire|"
    r"graph|node|edge|point|coord|beam|viga|poutre|travi|балк|[梁轴軸]|尺寸|标注|標註|文字|填充|图框|楼梯|給排水|给排水|配电",
    re.IGNORECASE,
)


_FAULTS: Final = (
    OSError,
    ValueError,
    TypeError,
    KeyError,
    IndexError,
    AttributeError,
    ArithmeticError,
    RecursionError,
)
"""What damaged entities lead ezdxf to, besides its own errors."""


def can_read(path: Path, head: bytes) -> bool:
    """By its name; a zip by the names in it."""
    if path.suffix.lower() == ".zip" and head.startswith(_ZIP):
        return bool(_drawings_in_zip(path))
    return format_suffix(path, head) == ".dxf" and bool(head)


def list_plan_names(path: Path) -> list[str]:
    """Return the names of the drawings in a zip; none for a file that is a drawing itself."""
    return _drawings_in_zip(path) if path.suffix.lower() == ".zip" else []


def _drawings_in_zip(path: Path) -> list[str]:
    try:
        names = archive_members(path)
    except Rejection:
        return []
    if any(PurePosixPath(name).name == "unit.geojson" for name in names):
        return []  # an indoor map
    return sorted(name for name in names if name.lower().endswith(".dxf") and not name.startswith("__MACOSX/"))


TAKES: Final = ("unit_m", "without", "walls")


def read_drawing(
    path: Path,
    key: str = "",
    *,
    unit_m: float | None = None,
    without: Sequence[str] = (),
    walls: Sequence[str] = (),
) -> Drawing:
    """Read a drawing, or the one of this name in a zip, in a unit that is given.

    Layers with a name of ``without`` are left out; the lines of those with a name of ``walls`` are walls.

    Raises
    ------
    Rejection
        Where it cannot be read, or has nothing on layers that are called wall or room.
    MissingDependencyError
        Where ezdxf is not installed.
    """
    try:
        from ezdxf.lldxf.const import DXFError
    except ImportError:
        said = f"{path.name} needs ezdxf, which is not installed: {install_command('cad')}"
        raise MissingDependencyError(said) from None
    data = _content(path, key)
    left_out = LeftOutParts()
    try:
        document = _document(data)
        every = list(_entities(document.modelspace(), document, left_out, (), count()))
        layers = [displayable_name(str(entity.dxf.layer)) for _, entity, _ in every]
        every = [
            ("wall" if is_named(layer, walls) and each[1].dxftype() not in _TEXTS else each[0], *each[1:])
            for each, layer in zip(every, layers, strict=True)
            if not is_named(layer, without)
        ]
        found = [(kind, entity) for kind, entity, _ in every if kind or entity.dxftype() in _TEXTS]
        found = _doors_or_windows(_drop_damaged(found, left_out))  # R7
        is_guessed = not any(kind in {"wall", "room"} and entity.dxftype() not in _TEXTS for kind, entity in found)
        if is_guessed or walls:
            unnamed = _drop_damaged(_unnamed_lines(every), left_out)  # R4
            found += [each for each in unnamed if is_guessed or each[0] == "door"]
        outlines = [points for kind, entity in found if kind in {"wall", "room"} and (points := _points(entity))]
        swings = [
            math.dist(swing[0], swing[1])
            for kind, entity in found
            if kind in {"door", "opening"}
            for swing in _swings(entity)
        ]
        stated = _UNITS.get(int(document.header.get("$INSUNITS", 0)))
        letters = _letters(entity for _, entity in found)
        scale, is_stated = (
            (unit_m, True) if unit_m else find_metres_per_unit(outlines, swings, letters, stated, path.name)
        )
    except (DXFError, *_FAULTS) as error:
        detail = f"{path.name} cannot be read as DXF: {type(error).__name__}: {str(error)[:120]}"
        raise Rejection("source", Reason.UNREADABLE, detail, _ADVICE) from None
    features: list[Feature] = []
    del every
    for kind, entity in found:
        try:
            features += _features(kind, entity, scale)
        except (DXFError, ValueError, TypeError, AttributeError, ArithmeticError) as error:
            left_out.add(f"{entity.dxftype()} on {str(entity.dxf.layer)[:40]}: {type(error).__name__}")
    lines = sum(
        len(each.shape.coords) - 1 for each in features if each.kind == "wall" and isinstance(each.shape, LineString)
    )
    if lines > MOST_WALL_LINES:
        detail = f"{path.name}: its layers of walls hold {lines:,} lines, "
        detail += f"expected {MOST_WALL_LINES:,} at most"
        raise Rejection("source", Reason.TOO_LARGE, detail, "leave texts, patterns and furniture out of them")
    storey = storey_from_features(features, to_metres=scale)
    layers = sorted(displayable_name(str(layer.dxf.name)) for layer in document.layers)
    _check_storey(storey, path.name, layers, is_whole=data.rstrip().endswith((b"EOF", b"EOF\0")), is_guessed=is_guessed)
    guesses = (*(() if is_stated else ("units",)), *(("layers",) if is_guessed else ()))
    all_ways = (STATES_WAYS, "true") in document.header.custom_vars
    return Drawing("dxf", (storey,), left_out, guesses, unit_m=scale, all_ways=all_ways, names=tuple(layers))


def drawn_lines(path: Path, key: str = "") -> list[tuple[str, list[Point]]]:
    """Return the layer and the points of each line that a drawing shows, in the file's unit; none if it is damaged."""
    from ezdxf.lldxf.const import DXFError

    try:
        document = _document(_content(path, key))
        every = list(_entities(document.modelspace(), document, LeftOutParts(), (), count()))
    except (DXFError, Rejection, *_FAULTS):
        return []
    found = []
    for _, entity, _ in every:
        try:
            points = _points(entity)
            if points and getattr(entity, "closed", False):
                points = [*points, points[0]]
        except (DXFError, *_FAULTS):
            continue
        if len(points) > 1 and np.isfinite(points).all():
            found.append((str(entity.dxf.get("layer", "0")), points))
    return found


def _document(data: bytes) -> Any:
    from ezdxf.document import Drawing as Document
    from ezdxf.lldxf.tagger import binary_tags_loader

    logging.getLogger("ezdxf").setLevel(logging.ERROR)  # it warns of each thing that it mends, of which plans need none
    return Document.load(binary_tags_loader(data)) if data.startswith(_BINARY) else _text_document(data)


def _check_storey(storey: DrawnStorey, name: str, layers: Sequence[str], *, is_whole: bool, is_guessed: bool) -> None:
    """Raise Rejection where nothing was found, or a tangle; ``layers`` are the names of all layers."""
    advice = "rename the layer that holds the walls to WALL"
    if not storey.walls and not storey.rooms:
        if not is_whole:
            raise Rejection("source", Reason.UNREADABLE, f"{name} breaks off before its end (EOF)", _ADVICE)
        detail = f"{name}: expected layers that are called wall or room, found {', '.join(layers[:8]) or 'none'}"
        raise Rejection("source", Reason.NO_LEVEL, detail, advice)
    corners = sum(shapely.get_num_coordinates(wall.shape) for wall in storey.walls)
    if is_guessed and corners > _MOST_GUESSED:
        detail = f"{name}: no layer is called wall or room, and the lines of the others are a tangle of "
        detail += f"{corners:,} corners, expected {_MOST_GUESSED:,} at most"
        raise Rejection("source", Reason.NO_LEVEL, detail, advice)


def _text_document(data: bytes) -> Any:
    """Return a drawing, mended where that is needed."""
    from ezdxf import recover
    from ezdxf.lldxf.const import DXFStructureError

    document = _sound_document(data)
    if document is not None:
        return document
    try:
        return recover.read(io.BytesIO(data))[0]
    except DXFStructureError:
        if b"LWPOLYLINE" not in data:
            raise
        return recover.read(io.BytesIO(_with_old_polylines(data)))[0]


def _with_old_polylines(data: bytes) -> bytes:
    """Return a drawing whose polylines without marks are of the old form, which has none."""
    lines = [line.strip() for line in data.splitlines()]
    entities: list[list[tuple[bytes, bytes]]] = [[]]
    for tag in zip(lines[::2], lines[1::2], strict=False):
        if tag[0] == b"0":
            entities.append([])
        entities[-1].append(tag)
    tags = [tag for entity in entities for tag in _old_polyline(entity)]
    return b"".join(b"%s\n%s\n" % tag for tag in tags)


def _old_polyline(tags: list[tuple[bytes, bytes]]) -> list[tuple[bytes, bytes]]:
    """Return the tags of a polyline with its vertices apart; any other entity, or one with marks, stays the same."""
    if not tags or tags[0] != (b"0", b"LWPOLYLINE") or any(code == b"100" for code, _ in tags):
        return tags
    layer = next((value for code, value in tags if code == b"8"), b"0")
    found = [(b"0", b"POLYLINE"), (b"8", layer), (b"66", b"1")]
    found += [tag for tag in tags if tag[0] == b"70"]
    for code, value in tags:
        found += [(b"0", b"VERTEX"), (b"8", layer)] if code == b"10" else []
        found += [(code, value)] if code in {b"10", b"20", b"42"} else []
    return [*found, (b"0", b"SEQEND")]


def _sound_document(data: bytes) -> Any:
    """Return a drawing of plain letters in which nothing needs to be mended, twice as fast; None for any other."""
    from ezdxf.document import Drawing as Document
    from ezdxf.lldxf.const import DXFError

    if not data.isascii():
        return None
    try:
        document = Document.read(io.TextIOWrapper(io.BytesIO(data), "ascii"))
        auditor = document.audit()
    except (DXFError, *_FAULTS):
        return None
    return None if auditor.has_errors or auditor.has_fixes else document


def _content(path: Path, key: str) -> bytes:
    """Return the bytes of a drawing, or of the one of this name in a zip."""
    return (read_member(path, [key], LARGEST_BYTES) if key else read_bytes(path, "expected a plan")) or b""


def _entities(
    space: Any, document: Any, left_out: LeftOutParts, within: tuple[str, ...], numbers: Iterator[int]
) -> Iterator[tuple[str, Any, bool]]:
    """Yield the kind of an entity, the entity, and whether it stands in a block."""
    for entity in space:
        if next(numbers) >= MOST_PARTS:
            detail = (
                f"the drawing has more than {MOST_PARTS:,} entities, blocks within blocks counted as often as drawn"
            )
            raise Rejection("source", Reason.TOO_LARGE, detail, "leave its furniture out")
        if entity.dxftype() != "INSERT":
            kind = _kind(str(entity.dxf.get("layer", "0"))) or (_kind(within[-1]) if within else "")
            yield kind, entity, bool(within)
            continue
        block = str(entity.dxf.name)
        if block in within or len(within) >= DEEPEST:
            left_out.add(f"block {block[:60]} holds itself")
            continue
        if document.blocks.get(block) is None:
            left_out.add(f"block {block[:60]} is not there")
            continue
        layer = str(entity.dxf.get("layer", "0"))
        name = block if kind_from_name(block) or not kind_from_name(layer) else layer
        for kind, part, _ in _entities(_parts(entity, left_out), document, left_out, (*within, block), numbers):
            yield kind or _kind(name), part, True


def _kind(name: str) -> str:
    """Return the kind of a name; _BOTH where it says door and window."""
    kind = kind_from_name(name)
    return _BOTH if kind == "door" and names_doors_and_windows(name) else kind


def _parts(insert: Any, left_out: LeftOutParts) -> list[Any]:
    """Return what an insert draws; nothing where it is scaled to a line or is damaged."""
    from ezdxf.lldxf.const import DXFError

    try:
        return list(insert.virtual_entities())
    except (DXFError, *_FAULTS) as error:
        left_out.add(f"block {str(insert.dxf.name)[:60]}: {type(error).__name__}")
        return []


def _drop_damaged(found: list[tuple[str, Any]], left_out: LeftOutParts) -> list[tuple[str, Any]]:
    """Return the entities that have points which can be computed."""
    from ezdxf.lldxf.const import DXFError

    kept = []
    for kind, entity in found:
        try:
            _points(entity)
            list(_swings(entity))
        except (DXFError, *_FAULTS) as error:
            left_out.add(f"{entity.dxftype()} on {str(entity.dxf.layer)[:40]}: {type(error).__name__}")
        else:
            kept.append((kind, entity))
    return kept


def _doors_or_windows(found: list[tuple[str, Any]]) -> list[tuple[str, Any]]:
    """Divide a layer called both door and window: what lies around the hinge of a swing is a door."""
    hinges = [
        (swing[0], math.dist(swing[0], swing[1])) for kind, each in found if kind == _BOTH for swing in _swings(each)
    ]

    def which(entity: Any) -> str:
        points = _points(entity)
        around = (all(math.dist(at, hinge) < _AROUND_HINGE * wide for at in points) for hinge, wide in hinges)
        return "door" if any(_swings(entity)) or any(around) else "window"

    return [(which(entity) if kind == _BOTH else kind, entity) for kind, entity in found]


def _unnamed_lines(every: list[tuple[str, Any, bool]]) -> list[tuple[str, Any]]:
    """Return the lines that may be walls, and the arcs that may be doors; none where there are too many."""
    others = [each for each in every if not each[0] and not _OTHERS.search(str(each[1].dxf.get("layer", "0")))]
    drawn = [each for each in others if each[1].dxftype() == "LINE" or each[1].dxftype() in _POLYLINES]
    in_blocks = all(is_inside for _, _, is_inside in drawn)
    lines: list[tuple[str, Any]] = []
    for _, entity, is_inside in others:
        if is_inside and not in_blocks:
            continue
        if entity.dxftype() == "ARC":
            lines.append(("door", entity))
        elif entity.dxftype() == "LINE" or entity.dxftype() in _POLYLINES:
            lines.append(("wall", entity))
    swings = [swing for kind, entity in lines if kind == "door" for swing in _swings(entity)]
    kept = [pair for pair in lines if pair[1].dxftype() != "LINE" or not _is_leaf(pair[1], swings)]
    return kept if len(kept) <= _MOST_GUESSED else []


def _is_leaf(line: Any, swings: Sequence[tuple[Point, Point, Point]]) -> bool:
    """Return whether a line runs from the hinge of a swing to one of its ends, as exactly as people draw."""
    start, end = (line.dxf.start.x, line.dxf.start.y), (line.dxf.end.x, line.dxf.end.y)
    for hinge, *ends in swings:
        off = HARDLY * math.dist(hinge, ends[0])  # in widths of the leaf
        for near, far in ((start, end), (end, start)):
            if math.dist(near, hinge) <= off and any(math.dist(far, each) <= off for each in ends):
                return True
    return False


def _points(entity: Any) -> list[tuple[float, float]]:
    kind = entity.dxftype()
    if kind in _CURVES or (kind in _POLYLINES and bool(entity.has_arc)):  # R5
        from ezdxf.path import make_path

        return [(point.x, point.y) for point in make_path(entity).flattening(1e9, segments=_PIECES)]
    if kind == "LINE":
        return [(entity.dxf.start.x, entity.dxf.start.y), (entity.dxf.end.x, entity.dxf.end.y)]
    if kind == "LWPOLYLINE":
        return [(point[0], point[1]) for point in entity.get_points("xy")]
    if kind == "POLYLINE":
        return [(point.x, point.y) for point in entity.points()]
    if kind in {"SOLID", "TRACE", "3DFACE"}:
        return [(point.x, point.y) for point in entity.wcs_vertices()]
    return []


def _features(kind: str, entity: Any, scale: float) -> Iterator[Feature]:
    """Yield what an entity draws, in units; ``scale`` is their metres."""
    shape = entity.dxftype()
    if shape in _TEXTS:
        yield from _lines_of_text(entity)
    elif kind in {"door", "opening"} and (swings := list(_swings(entity))):  # R6
        for hinge, *ends in swings:
            if SWING_M[0] < math.dist(hinge, ends[0]) * scale < SWING_M[1]:
                yield Feature("swing", LineString([hinge, *ends]))
    elif shape in {"HATCH", "MPOLYGON"}:
        yield from (
            Feature("wall", area, filled=True) for area in (_filled_areas(entity, scale) if kind == "wall" else ())
        )
    elif shape not in _CURVES or kind == "wall":
        yield from _line(kind, entity, scale)


def _lines_of_text(entity: Any) -> Iterator[Feature]:
    text = entity.plain_text() if entity.dxftype() == "MTEXT" else entity.dxf.text
    at = entity.dxf.insert
    for line, word in enumerate(str(text).splitlines()):
        if word.strip():
            yield Feature("name", shapely.Point(at.x, at.y - line * SAME), (re.sub(r"\s+", " ", word.strip())[:100],))


def _letters(entities: Iterable[Any]) -> list[float]:
    """Return the heights of the letters of the texts among some entities, in units."""
    keys = {"TEXT": "height", "MTEXT": "char_height"}
    found = (float(each.dxf.get(keys[each.dxftype()], 0.0)) for each in entities if each.dxftype() in keys)
    return [height for height in found if height > 0.0]


def _swings(entity: Any) -> Iterator[tuple[Point, Point, Point]]:
    """Yield the hinges and the ends of the arcs up to a quarter of a circle, or a bit more, in units."""
    shape = entity.dxftype()
    if shape in _POLYLINES and bool(entity.has_arc):
        for part in entity.virtual_entities():
            if part.dxftype() == "ARC":
                yield from _swings(part)
    elif shape == "ARC":
        turn = (entity.dxf.end_angle - entity.dxf.start_angle) % 360
    elif shape == "ELLIPSE":
        turn = math.degrees((entity.dxf.end_param - entity.dxf.start_param) % math.tau)
    if shape in {"ARC", "ELLIPSE"} and AJAR_DEG <= turn <= 120:
        centre, start, end = entity.dxf.center, entity.start_point, entity.end_point
        yield (centre.x, centre.y), (start.x, start.y), (end.x, end.y)


def _width(entity: Any) -> float:
    """Return the width of a polyline, in units; 0 where it has none, or several."""
    if entity.dxftype() == "LWPOLYLINE":
        constant = float(entity.dxf.get("const_width", 0.0))
        widths = {round(width, 9) for each in entity.get_points("se") for width in each}
        return constant or (widths.pop() if len(widths) == 1 else 0.0)
    if entity.dxftype() == "POLYLINE":
        start, end = (float(entity.dxf.get(f"default_{which}_width", 0.0)) for which in ("start", "end"))
        return start if start == end else 0.0
    return 0.0


def _line(kind: str, entity: Any, scale: float) -> Iterator[Feature]:
    """Yield the area that a line closes or the line itself."""
    points = _points(entity)
    if not np.isfinite(np.asarray(points, np.float64)).all():
        raise ValueError("a coordinate is not finite")
    closed = len(points) > 2 and (
        entity.dxftype() in {"SOLID", "TRACE", "3DFACE"}
        or bool(getattr(entity, "is_closed", False))
        or points[0] == points[-1]
    )
    ring = [*points, points[0]] if closed else points
    area = polygon_from_ring(points) if closed else None
    wide = _width(entity) if kind == "wall" else 0.0
    if WALL_THICKNESS_M[0] <= wide * scale <= WALL_THICKNESS_M[1] and len(points) > 1:  # R5
        line = shapely.buffer(LineString(ring), wide / 2, cap_style="flat", join_style="mitre")
        yield Feature("wall", line, filled=True)
    elif area is not None and kind != "window":
        yield Feature(kind, area, ("object",) if kind == "object" else ())
    elif len(points) > 1 and (kind in {"wall", "room", "window"} or (kind == "opening" and len(points) == 2)):
        yield Feature(kind, LineString(ring if kind == "window" else points))


def _filled_areas(entity: Any, scale: float) -> list[Polygon]:
    """Return the areas of a hatch; rings inside an odd number of others are holes.

    ``scale`` is the file's unit, metres.
    """
    from ezdxf.path import from_hatch

    paths = ([(point.x, point.y) for point in path.flattening(1e9, segments=_PIECES)] for path in from_hatch(entity))
    rings = [area for path in paths if (area := polygon_from_ring(path)) is not None]
    areas = nest_rings([shapely.transform(ring, lambda points: points * scale) for ring in rings])
    return [shapely.transform(area, lambda points: points / scale) for area in areas]


# Find the unit of a DXF drawing: what it states, and what its walls and doors say.
#
# U1  The stated unit counts, unless the drawing is no house in it: it is shorter than a house or longer than a site, or
#     its doors are as wide as no door while they are in another unit, or it is longer than a house, and another unit
#     gives a house with walls as thick as walls, or with texts as high as in drawings of houses, unlike the stated one.
#     Templates state inches or metres for drawings in millimetres.
# U2  Else it is the first of mm, m, cm, inches and feet in which the walls are as long as a house, the doors as wide as
#     doors, and the walls as thick as walls. What the drawing does not tell, or tells of no unit, is passed over; texts
#     tell where walls do not.
# U3  A drawing that states a metric unit, if the wrong one, is not in inches or feet, if it is a house in a metric one
#     and its doors say nothing.


_METRIC: Final = (0.001, 0.01, 0.1, 1.0)
TEXT_HEIGHT_M: Final = (0.05, 1.0)
"""Letters in drawings of houses: 2.5 to 5 mm on paper, at scales of 1:20 to 1:200."""
LARGEST_TEXT_M: Final = 2.5
"""Letters of 5 mm on paper at 1:500, as site plans have them."""


def find_metres_per_unit(
    outlines: Sequence[Sequence[Point]],
    swings: Sequence[float],
    texts: Sequence[float],
    stated: float | None,
    name: str,
) -> tuple[float, bool]:
    """Return the metres per unit, and whether the drawing states it.

    Parameters
    ----------
    outlines
        Corners of the lines of walls and rooms, in units.
    swings
        Radii of the arcs of doors, in units.
    texts
        Heights of the letters of texts, in units.
    stated
        Metres per unit that the drawing states, if any.
    name
        The file's, for the message.

    Raises
    ------
    Rejection
        BAD_UNITS where the walls are as long as a house in no unit.
    """
    if not outlines:
        return stated or 1.0, stated is not None
    size = float(np.ptp(np.concatenate([np.asarray(each, np.float64) for each in outlines]), axis=0).max())
    swing = float(np.median(swings)) if swings else 0.0
    fits = [metres for metres in DRAWN_UNITS_M if _is_in(size * metres, DRAWING_M)]
    by_swing = [metres for metres in fits if _is_in(swing * metres, SWING_M)]
    if stated in _METRIC and not by_swing:
        fits = [metres for metres in fits if metres in _METRIC] or fits  # U3
    is_in_range = stated is not None and DRAWING_M[0] <= size * stated <= LONGEST_SITE_M
    no_doors = stated is not None and bool(by_swing) and not _is_in(swing * stated, SWING_M)
    if stated is not None and is_in_range and not no_doors and size * stated <= DRAWING_M[1]:  # U1
        return stated, True
    thick = _thickness([line for points in outlines for line in pairwise(points)])
    sound = [metres for metres in by_swing or fits if _is_in(thick * metres, WALL_THICKNESS_M)]
    letter = float(np.median(texts)) if texts else 0.0
    legible = [metres for metres in by_swing or fits if _is_in(letter * metres, TEXT_HEIGHT_M)]
    if stated is not None and is_in_range and not no_doors:  # U1
        no_walls = bool(sound) and not _is_in(thick * stated, WALL_THICKNESS_M)
        no_texts = bool(legible) and letter * stated > LARGEST_TEXT_M
        if not no_walls and not no_texts:
            return stated, True
    if fits:  # U2
        both = [metres for metres in sound if metres in legible]
        return (both or sound or legible or by_swing or fits)[0], False
    states = "no unit" if stated is None else f"a unit of {stated:g} m"
    detail = f"{name} states {states}, and its walls are {size:.4g} long: a house in none"
    raise Rejection("source", Reason.BAD_UNITS, detail, "set its unit ($INSUNITS)")


def _is_in(length_m: float, between: tuple[float, float]) -> bool:
    return between[0] <= length_m <= between[1]


def _thickness(lines: Sequence[tuple[Point, Point]]) -> float:
    """Return the usual distance of a line from the nearest one beside and along it, in units; 0 if there are no two."""
    ends = np.array(lines[:MAX_SAMPLES], np.float64).reshape(-1, 4)
    start, along = ends[:, :2], ends[:, 2:] - ends[:, :2]
    length = np.hypot(*along.T)
    start, along, length = start[length > 0], along[length > 0], length[length > 0]
    beside = []
    for at, way, long in zip(start, along / length[:, None], length, strict=True):
        across = np.array([-way[1], way[0]])
        away, turned = np.abs((start - at) @ across), np.abs(along @ across) / length
        first = (start - at) @ way
        last = first + along @ way
        shared = np.minimum(np.maximum(first, last), long) - np.maximum(np.minimum(first, last), 0.0)
        near = away[(turned < PARALLEL) & (shared > MOST * np.minimum(length, long)) & (away > SAME * long)]
        if len(near):
            beside.append(float(near.min()))
    return float(np.median(beside)) if beside else 0.0
