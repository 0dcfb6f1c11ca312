"""Make a drawn storey of the features that a reader yields (``drawing.Feature``), and tell kinds of features by words.

R1  Areas that are called wall are walls; an area inside another is a hole of it. Lines called wall are thin walls, and
    two of them close to each other the faces of one (``drawing.walls_between_faces``).
R2  Areas called room are rooms. A text inside one names it; one that is the name of a room names what is around it.
R3  Areas and lines called door are passages; of an arc, which shows how the leaf turns, the passage runs from the
    hinge to the end that lies at a wall; of two, to the one across a gap; else to the one nearer to a wall.
R4  Without walls, rooms stand for themselves: walls are between and around them. Lines called room enclose rooms.
R5  A closed line called wall that is wide inside, and has rooms, doors or other walls in it, is the outline of a house
    or of a room, and no massive wall: its sides are lines. So are those of the closed lines that it touches. What is
    wide inside, and in no closed line but one around the names of two rooms, is space, too. So is a closed line alone,
    or with pillars in it.
R6  A closed line called room without a name, inside one with a name, is a hole of it.
R7  Two lines called wall that run beside each other, longer than they are apart, are the two faces of a wall, also
    where its ends are open. A line much farther off than another beside it (a measure beside a wall) is no face of it.
R8  Lines called window that hang together stand for the wall that they fill, if they are as thin as a wall.
R9  Spaces, the cells of a map, share their faces: a smaller one is a hole in a larger. Walls are around all of them,
    and where a walled one touches others; one with a passage in its edge is walled, if its file does not say.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from itertools import pairwise
from typing import Any, Final

import numpy as np
import numpy.typing as npt
import shapely
from shapely import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from houseexpo.plan.room_labels import canonical
from pipeline.geometry.areas import dot_product, drop_lines_and_points, drop_thin_parts, polygons_of
from pipeline.geometry.prisms import make_prisms
from pipeline.sources.drawn_storeys import Hole, Wall, merge_parallel_holes, unite_rooms, walls_around_floors
from pipeline.sources.roles import labels_for, names_furniture_with_doors
from pipeline.sources.tolerances import (
    DEEPEST_WALL_M,
    DOOR_HEIGHT_M,
    DRAWN_SHEET_M,
    FILE_GRID_M,
    LINE_WALL_M,
    MASSIVE_WALL_M,
    OBJECT_HEIGHT_M,
    PARALLEL,
)
from pipeline.sources.vector_plans.drawing import (
    DrawnStorey,
    Feature,
    Line,
    Point,
    deepen_to_jambs,
    deepen_to_walls,
    door_hole,
    passage_rectangles,
    usual_height,
    walls_along_lines,
    walls_between_faces,
    walls_between_rooms,
)
from pipeline.tolerances import BESIDE_M, CRACK_M, HAND_M, MM_M, SAME, THICK_WALL_M, WALL_M
from pipeline.values import Opening, SourceObject, SourceRoom

_WORDS: Final = {
    "name": r"name|text|label|beschriftung|texte|annot",
    "opening": r"opening|openings|doorway|durchgang|passage|cut|entrance_open",
    "door": r"door|doors|entrance|entrances|exit|exits|tür|türen|tuer|tueren|tur|porte|portes|puerta|puertas|porta|"
    r"portas|deur|deuren|dør|dörr|dörrar|drzwi|dveře|dvere|vrata|kap\u0131|kapi|cửa|ajtó|uși|.*[门門扉戸].*|.*ドア.*|.*문|двер\w*",
    "window": r"window|windows|fenster|fenêtre|fenetre|ventana|ventanas|finestra|finestre|glaz|glazing|raam|wid|win|"
    r"janela|janelas|okno|okna|fönster|vindu|vindue|pencere|ablak|.*[窗窓].*|창.*|окн\w*",
    "wall": r"wall|walls|wand|wände|waende|wanden|mauer|mur|murs|muro|muros|muri|parede|paredes|parete|pareti|muur|"
    r"muren|wal|muratura|murature|pared|mury|ściany?|sciany?|vägg|väggar|duvar|duvarlar|falak|zdi|zidovi|perete|pereți|"
    r".*[壁牆柱].*|벽.*|기둥.*|колонн\w*|(?!.*半高).*隔断.*|column|columns|pillar|pillars|stütze|stützen|columna|columnas|"
    r"pilar|pilares|pilastro|pilastri|poteau|poteaux|col|partition|partitions|cloison|cloisons|tabique|tabiques|structure|"
    r".*墙.*|стен\w*",
    "stairwell": r"stairwells?",
    "room": r"room|rooms|space|spaces|raum|räume|raeume|zimmer|pièce|pieces|area|unit|zone",
    "object": r"furniture|object|objects|möbel|moebel|mobilier|meuble|fixture|fixtures|.*家具.*|мебел\w*",
}
ROOM_FUNCTIONS: Final = {
    **dict.fromkeys(("walkway", "footbridge", "movingwalkway"), "Hallway"),
    "conferenceroom": "Office",
    "classroom": "Room",
    "auditorium": "Hall",
    "foodservice": "Kitchen",
    "waitingroom": "Lobby",
    "fitnessroom": "Gym",
    **dict.fromkeys(("retail", "shop", "boutique", "booth", "stall", "kiosk", "food", "restaurant", "cafe", "bar"), ""),
    **dict.fromkeys(("lab", "laboratory", "lecture", "workshop", "ward", "cubicle", "apartment", "flat"), ""),
    **dict.fromkeys(("stairs", "stair", "staircase", "stairwell", "escalator", "ramp"), ""),
}
"""Words that indoor maps have for spaces, and our labels of those which are the names of no rooms in other files."""
PASSAGES: Final = ("door", "opening")
ToMetres = Callable[[npt.NDArray[np.float64]], npt.NDArray[np.float64]]
_NO_WALLS: Final = frozenset({"stem", "footing", "foundation", "virtual", "shear"})
"""Words of walls that are under a floor, or nowhere."""

_FRENCH_WINDOW: Final = re.compile(
    r"portes?.?fen[eê]tre|puertas?.?ventana|porta.?(finestra|janela)|window.?door", re.IGNORECASE
)

Area = tuple[Polygon, Feature]
"""An area in metres, and what it was read as."""


@dataclass
class _Drawn:
    """The features of a storey by what they are, in metres."""

    wall_bodies: list[Polygon] = field(default_factory=list)
    """Filled areas, which are walls as they stand."""
    bodies: list[Wall] = field(default_factory=list)
    """The same, with heights."""
    wall_areas: list[Polygon] = field(default_factory=list)
    wall_lines: list[tuple[Point, Point]] = field(default_factory=list)
    wall_middles: dict[float, list[tuple[Point, Point]]] = field(default_factory=dict)
    """Lines of walls by their thickness."""
    tops: list[tuple[float, float]] = field(default_factory=list)
    """Heights of walls, where they are said, and the lengths of their outlines."""
    window_areas: list[Area] = field(default_factory=list)
    window_lines: list[tuple[Point, Point]] = field(default_factory=list)
    rooms: list[Area] = field(default_factory=list)
    room_lines: list[tuple[Point, Point]] = field(default_factory=list)
    spaces: list[Area] = field(default_factory=list)
    floors: list[Polygon] = field(default_factory=list)
    texts: list[tuple[str, Point]] = field(default_factory=list)
    door_areas: list[Area] = field(default_factory=list)
    door_lines: list[tuple[Point, Point, Feature]] = field(default_factory=list)
    arcs: list[tuple[Point, Point, Point]] = field(default_factory=list)
    """Hinge, and the two ends."""
    objects: list[Area] = field(default_factory=list)

    @classmethod
    def sorted(cls, features: Iterable[Feature], to_metres: float | ToMetres) -> _Drawn:
        """Sort features into their lists; ``to_metres`` is the unit, or what turns points (n, 2) into metres."""
        drawn, given = cls(), list(features)
        to = to_metres if callable(to_metres) else lambda points: points * to_metres
        shapes = shapely.transform(np.array([each.shape for each in given], np.object_), to)
        for each, shape in zip(given, shapes, strict=True):
            drawn._add(each, shape)
        return drawn

    def _add(self, each: Feature, shape: BaseGeometry) -> None:
        if each.kind == "wall" and each.top_m is not None and each.low_m == 0.0:
            self.tops.append((each.top_m, shape.length))
        if each.kind == "stairwell":
            each = replace(each, words=("stairwell",))
        if each.kind in {"object", "stairwell"}:
            shape = drop_lines_and_points(shapely.make_valid(shape))
            self.objects += [(shape, each)] if shape.area > SAME else []
            return
        for part in simple_parts(shape):
            if isinstance(part, Polygon):
                for area in polygons_of(shapely.make_valid(part)):
                    if area.area > SAME:
                        self._add_area(each, area)
            else:
                self._add_line(each, [(float(x), float(y)) for x, y in shapely.get_coordinates(part)])

    def _add_area(self, each: Feature, area: Polygon) -> None:
        if each.kind == "wall" and each.filled and each.top_m is not None:
            self.bodies.append(Wall(area, each.low_m, each.top_m))
        elif each.kind == "wall":
            (self.wall_bodies if each.filled else self.wall_areas).append(area)
        elif each.kind == "floor":
            self.floors.append(area)
        else:
            lists = {"room": self.rooms, "space": self.spaces, "window": self.window_areas}
            lists |= dict.fromkeys(PASSAGES, self.door_areas)
            lists.get(each.kind, []).append((area, each))

    def _add_line(self, each: Feature, points: list[Point]) -> None:
        if each.kind == "name":
            self.texts += [(word, points[0]) for word in each.words]
        elif each.kind == "swing":
            self.arcs.append((points[0], points[1], points[2]))
        elif each.kind in PASSAGES and len(points) > 3 and points[0] == points[-1]:  # drawn all round
            self.door_areas += [(area, each) for area in polygons_of(shapely.make_valid(Polygon(points)))]
        elif each.kind in PASSAGES:
            self.door_lines.append((points[0], points[-1], each))
        elif each.kind == "wall" and each.thick_m is not None:
            self.wall_middles.setdefault(each.thick_m, []).extend(pairwise(points))
        else:
            lists = {"wall": self.wall_lines, "window": self.window_lines, "room": self.room_lines}
            lists.get(each.kind, []).extend(pairwise(points))


@lru_cache(maxsize=4096)  # a drawing says the same few names again and again
def kind_from_name(name: str) -> str:
    """Return the kind that the name of a layer, class or kind says, a key of ``_WORDS``, or ""."""
    plain = re.sub(r"(?<=[a-zß-ÿ])(?=[A-Z])", " ", name).lower()
    parts = re.split(r"[\W\d_]+", plain)
    if not _NO_WALLS.isdisjoint(parts):
        return ""
    found = next((kind for kind, words in _WORDS.items() if any(re.fullmatch(words, part) for part in parts)), "")
    return "object" if found == "door" and names_furniture_with_doors(name) else found


def function_of_room(name: str) -> str | None:
    """Return our label of the space that a word is the function of, "" where we have none; None for other words."""
    parts = re.split(r"[\W\d_]+", name.lower())
    known = next((ROOM_FUNCTIONS[part] for part in (name.lower(), *parts) if part in ROOM_FUNCTIONS), None)
    return known or next(iter(labels_for((name,))), known)


def names_doors_and_windows(name: str) -> bool:
    """Return whether a layer's name says that both doors and windows are on it; a French window is a door."""
    parts = re.split(r"[\W\d_]+", re.sub(r"(?<=[a-zß-ÿ])(?=[A-Z])", " ", name).lower())
    both = all(any(re.fullmatch(_WORDS[kind], part) for part in parts) for kind in ("door", "window"))
    return both and not _FRENCH_WINDOW.search(name)


def storey_from_features(
    features: Iterable[Feature], height_m: float = 0.0, to_metres: float | ToMetres = 1.0
) -> DrawnStorey:
    """Return the storey of a drawing; it may be empty.

    Parameters
    ----------
    features
        What is drawn, in the file's unit.
    height_m
        Height of the floor.
    to_metres
        The metres in a unit, or a function of points (n, 2) that turns them into metres.
    """
    features = [*features]
    drawn = _Drawn.sorted((each for each in features if each.kind != "other"), to_metres)
    top = usual_height(drawn.tops)
    rooms = _with_holes(drawn)
    panes, frames = windows_from_lines(drawn.window_lines)
    if drawn.spaces:
        rooms, walls = _of_spaces(drawn, top)
    else:
        walls = _walls(drawn, rooms, panes, frames)
    bodies = [replace(each, top_m=min(each.top_m, top)) if each.bottom_m == 0.0 else each for each in drawn.bodies]
    bodies = [*(Wall(wall, 0.0, top) for wall in walls), *bodies]
    walls = [each.shape for each in bodies]
    holes = _of_areas(drawn.door_areas, walls)
    holes += [hole for line in drawn.door_lines if (hole := _of_line(line, walls)) is not None]
    solid = shapely.union_all(walls) if drawn.arcs else Polygon()
    holes += [hole for arc in drawn.arcs if (hole := _of_arc(arc, walls, solid)) is not None]
    return DrawnStorey(
        walls=tuple(bodies),
        holes=tuple(merge_parallel_holes(holes)),
        windows=(
            *(Opening.window(pane, (None, None)) for pane in (*panes, *_windows_of_frames(frames))),
            *(Opening.window(area, (each.top_m and each.low_m, each.top_m)) for area, each in drawn.window_areas),
        ),
        rooms=_rooms(drawn, rooms or _ring_rooms(drawn)),
        floor=unite_rooms(drawn.floors),
        furniture=tuple(
            SourceObject(
                each.words, make_prisms(shape, each.low_m, OBJECT_HEIGHT_M if each.top_m is None else each.top_m)
            )
            for shape, each in drawn.objects
        ),
        height_m=height_m,
        lines=partial(lines_of_features, features, to_metres),
    )


def lines_of_features(features: Sequence[Feature], to_metres: float | ToMetres) -> list[Line]:
    """Return the name and the points (n, 2), metres, of each line and of each ring of each area."""
    to = to_metres if callable(to_metres) else lambda points: points * to_metres
    found: list[Line] = []
    for each in features:
        name = each.words[0] if each.kind in {"object", "other"} and each.words else each.kind
        parts = shapely.get_parts(each.shape)
        rings = [shapely.boundary(part) if isinstance(part, Polygon) else part for part in parts]
        lines = [shapely.get_coordinates(line) for line in shapely.get_parts(rings)]
        found += [(name, to(points)) for points in lines if len(points) > 1]
    return found


def _walls(
    drawn: _Drawn, rooms: Sequence[Area], panes: Sequence[Polygon], frames: Sequence[tuple[Point, Point]]
) -> list[Polygon]:
    """Return the walls: areas, lines, closed outlines and pairs of parallel faces that are called wall."""
    areas, sides = _outlines(drawn, rooms)
    lines = [*drawn.wall_lines, *sides, *frames]
    bodies = bodies_between_faces(lines)
    middles = [part for thick, each in sorted(drawn.wall_middles.items()) for part in walls_along_lines(each, thick)]
    shapes = [*areas, *drawn.wall_bodies, *panes, *walls_along_lines(lines, DRAWN_SHEET_M), *bodies, *middles]
    walls = walls_between_faces(shapes) if lines or panes or middles else shapes
    return [shapely.simplify(wall, MM_M) for wall in walls] if bodies else walls  # faces are nearly parallel


def _of_spaces(drawn: _Drawn, top_m: float) -> tuple[list[Area], list[Polygon]]:
    """Return the rooms and the walls of a map of spaces."""
    areas = [area for area, _ in drawn.spaces]
    ways = shapely.STRtree([LineString((start, end)).centroid for start, end, _ in drawn.door_lines])
    walled = [
        bool(len(ways.query(shapely.boundary(area), "dwithin", distance=BESIDE_M)))
        if each.walled is None
        else each.walled
        for area, each in drawn.spaces
    ]
    walls = [*drawn.wall_areas, *walls_between_rooms(areas, walled)]
    rooms: list[Area] = []
    taken = shapely.union_all(walls)
    for area, each in sorted(drawn.spaces, key=lambda space: space[0].area):
        rest = polygons_of(shapely.difference(area, taken))
        rooms += [(part, each) for part in rest if part.area > SAME]
        taken = shapely.union(taken, area)
    return rooms, [wall.shape for wall in walls_around_floors([area for area, _ in rooms], top_m)] + walls


def nest_rings(areas: Sequence[Polygon]) -> list[Polygon]:
    """Rings inside an odd number of others are holes, in which further rings are bodies again."""
    found = [shapely.make_valid(area) for area in areas]
    found = [part for area in found for part in polygons_of(area)]
    if len(found) < 2:
        return found
    tree = shapely.STRtree(found)
    shrunk = shapely.buffer(found, -FILE_GRID_M)  # rings that touch may cross by a hair
    inner, outer = tree.query(shrunk, predicate="within")
    deep = np.bincount(inner[inner != outer], minlength=len(found))
    solid = shapely.Polygon()
    for depth in range(int(deep.max()) + 1):
        layer = shapely.union_all(
            [each for each, n in zip(found, deep, strict=True) if n == depth], grid_size=FILE_GRID_M
        )
        solid = shapely.difference(solid, layer) if depth % 2 else shapely.union(solid, layer)
    return polygons_of(solid)


def _outlines(drawn: _Drawn, rooms: Sequence[Area]) -> tuple[list[Polygon], list[tuple[Point, Point]]]:
    """Return the walls that are bodies, and the sides of the rings of which the others are made."""
    inside = [LineString(line) for line in drawn.wall_lines] + [area for area, _ in rooms]
    names = [shapely.Point(at) for text, at in drawn.texts if labels_for((text,))]
    inside += names
    inside += [shapely.Point(arc[0]) for arc in drawn.arcs] + [area.centroid for area, _ in drawn.door_areas]
    tree, named = shapely.STRtree(inside), shapely.STRtree(names)
    rings = sorted(drawn.wall_areas, key=lambda ring: ring.area)
    bodies: list[Polygon] = []
    outlines: list[Polygon] = []
    side_by_side = _side_by_side(rings)
    for wall in nest_rings(drawn.wall_areas):
        at = wall.representative_point()
        around = next((ring for ring in rings if ring.contains(at)), wall)
        in_house = len(named.query(around, "contains")) > 1
        is_outline = _is_wide_round(wall, None if in_house else tree) or _is_beside(wall, side_by_side)
        (outlines if is_outline else bodies).append(wall)
    if not (outlines or inside or drawn.wall_bodies) and _is_alone(rings):
        bodies, outlines = [], bodies
    whole = shapely.union_all(outlines)
    sides: list[tuple[Point, Point]] = []
    for ring in drawn.wall_areas if outlines else ():
        if whole.intersects(ring.exterior):
            sides += pairwise([(float(x), float(y)) for x, y in shapely.get_coordinates(ring.exterior)])
    return bodies, sides


def _is_alone(rings: Sequence[Polygon]) -> bool:
    """Return whether the last of some rings, the largest, is wide inside, and the others are pillars in it."""
    if not rings or not _is_wide(rings[-1], MASSIVE_WALL_M):
        return False
    return all(rings[-1].contains(ring) and not _is_wide(ring, MASSIVE_WALL_M) for ring in rings[:-1])


def _ring_rooms(drawn: _Drawn) -> list[Area]:
    """Return the closed lines called wall that are rooms, since they lie side by side."""
    side_by_side = _side_by_side(drawn.wall_areas)
    return [
        (ring, Feature("room", ring))
        for ring in drawn.wall_areas
        if _is_beside(ring, side_by_side) and not any(ring is not each and ring.contains(each) for each in side_by_side)
    ]


def _is_wide_round(wall: Polygon, things: shapely.STRtree | None) -> bool:
    """Return whether a ring is wide inside, and has one of some things there; None: whatever it has there."""
    if things is not None and not len(things.query(wall, "contains")):  # of most walls that is all that is asked
        return False
    wide = _wide_part(wall, MASSIVE_WALL_M)
    return bool(wide.area > 0.5 * wall.area and (things is None or len(things.query(wide, "contains"))))


def _side_by_side(rings: Sequence[Polygon]) -> list[Polygon]:
    """Return the rings that are wider than any wall, have no other such ring in them, and have one beside them (R5)."""
    if len(rings) < 2:
        return []
    wide = [ring for ring in rings if _is_wide(ring, MASSIVE_WALL_M)]
    tree = shapely.STRtree(wide)
    inner = [ring for ring in wide if len(tree.query(ring, "contains")) <= 1]  # it contains itself
    near = shapely.STRtree(inner)
    return [ring for ring in inner if len(near.query(ring, "dwithin", distance=THICK_WALL_M)) > 1]


def _is_beside(wall: Polygon, rings: Sequence[Polygon]) -> bool:
    """Return whether a body is one or several of such rings, or lies beside one and is wider than most walls."""
    return any(shapely.dwithin(wall, ring, THICK_WALL_M) for ring in rings) and _is_wide(wall, THICK_WALL_M)


def _is_wide(shape: Polygon, than_m: float) -> bool:
    return bool(_wide_part(shape, than_m).area > 0.5 * shape.area)


@lru_cache(maxsize=64)  # a wall is most often a ring by itself, and asked for twice
def _wide_part(shape: Polygon, than_m: float) -> BaseGeometry:
    return drop_thin_parts(shape, than_m)


def _enclosed_rooms(drawn: _Drawn) -> list[Area]:
    """Return the areas that lines called room enclose."""
    if not drawn.room_lines:
        return []
    lines = shapely.union_all(
        [LineString(line) for line in drawn.room_lines if line[0] != line[1]], grid_size=FILE_GRID_M
    )
    found = shapely.get_parts(shapely.polygonize(shapely.get_parts(lines)))
    return [(area, Feature("room", area)) for area in found if not drop_thin_parts(area, THICK_WALL_M).is_empty]


def _with_holes(drawn: _Drawn) -> list[Area]:
    """Return the areas called room, less their holes (R6)."""
    rooms = drawn.rooms
    if len(rooms) < 2 or not drawn.texts:
        return rooms
    texts = shapely.STRtree([shapely.Point(at) for _, at in drawn.texts])
    named = [bool(each.words or each.labels or len(texts.query(area, "intersects"))) for area, each in rooms]
    tree = shapely.STRtree([area for area, _ in rooms])
    found = []
    for i, (area, each) in enumerate(rooms):
        if not named[i] and any(named[k] and k != i for k in tree.query(area, "within")):
            continue
        inside = [int(k) for k in tree.query(area, "contains") if k != i and not named[k]] if named[i] else []
        rest = shapely.difference(area, shapely.union_all([rooms[k][0] for k in inside])) if inside else area
        found.append((rest if isinstance(rest, Polygon) else area, each))
    return found


def _rooms(drawn: _Drawn, areas: Sequence[Area]) -> tuple[SourceRoom, ...]:
    """Return the areas called room; a text in one names it, or the space around it."""
    rooms, used = [], set()
    for area, each in [*areas, *_enclosed_rooms(drawn)]:
        inside = [i for i, (_, at) in enumerate(drawn.texts) if shapely.intersects_xy(area, *at)]
        used.update(inside)
        said = [*each.words, *(drawn.texts[i][0] for i in inside)]
        found = next((label for word in [*each.labels, *said] if (label := canonical(word))), None)
        kept = tuple(dict.fromkeys(word for word in said if word and word not in {found, "Unlabelled"}))
        rooms.append(SourceRoom(kept or ((found,) if found else ()), (found,) if found else labels_for(said), area))
    for i, (text, (x, y)) in enumerate(drawn.texts):
        labels = labels_for((text,))
        if i not in used and labels:
            box = (x - HAND_M, y - HAND_M, x + HAND_M, y + HAND_M)
            rooms.append(SourceRoom((text,), labels, box=box))
    return tuple(rooms)


def _of_areas(areas: Sequence[Area], walls: Sequence[Polygon]) -> list[Hole]:
    """One walks through the shorter way."""
    ways = passage_rectangles([area for area, _ in areas])
    plain = [
        Hole(area, each.low_m, _head(each), each.kind == "door", way[1] if way else (0.0, 0.0))
        for (area, each), way in zip(areas, ways, strict=True)
    ]
    holes = deepen_to_walls(plain, walls)
    for k, (_, each) in enumerate(areas):
        if holes[k] is plain[k] and each.thick_m is not None:
            holes[k] = deepen_to_jambs(plain[k], each.thick_m, walls)
    return holes


def _of_line(line: tuple[Point, Point, Feature], walls: Sequence[Polygon]) -> Hole | None:
    """Return the passage along a line that is called door."""
    start, end, each = line
    thick = LINE_WALL_M if each.thick_m is None else each.thick_m
    leaf = each.kind == "door"
    return door_hole(start, end, walls, has_door=leaf, bottom_m=each.low_m, top_m=_head(each), thick_m=thick)


def _head(each: Feature) -> float:
    return DOOR_HEIGHT_M if each.top_m is None else each.top_m


def _of_arc(arc: tuple[Point, Point, Point], walls: Sequence[Polygon], solid: BaseGeometry) -> Hole | None:
    """Return the passage of a leaf's arc: from the hinge to the end of the arc that a wall meets."""
    hinge, *ends = arc
    at_walls = [end for end in ends if shapely.dwithin(solid, shapely.Point(end), CRACK_M)]
    gaps = [end for end in at_walls if not shapely.dwithin(solid, LineString([hinge, end]).centroid, CRACK_M)]

    def away(end: Point) -> float:
        return float(solid.distance(LineString([hinge, end]).centroid) + solid.distance(shapely.Point(end)))

    sure: list[Point] = at_walls if len(at_walls) == 1 else gaps if len(gaps) == 1 else list(ends)
    end: Point = min(sure, key=away)
    return door_hole(hinge, end, walls, has_door=True)


def simple_parts(shape: Any) -> Iterator[Any]:
    """Yield the points, lines and polygons of a geometry, however deep they are in collections."""
    parts = [shape] if isinstance(shape, Polygon) else shapely.get_parts(shape)
    for part in parts:
        if part.geom_type.startswith("Multi") or part.geom_type == "GeometryCollection":
            yield from simple_parts(part)
        else:
            yield part


# Make bodies of walls and windows that are drawn by their faces: two lines beside each other, open at their ends.
#
# Lengths are in metres, lines are pairs of points.


_AS_NEAR: Final = 2.5
"""A face of a wall is at most this many times as far off as the nearest line beside it: the leaf of a cavity wall is,
the line of a measure or of a canopy is not."""


def bodies_between_faces(lines: Sequence[tuple[Point, Point]]) -> list[Polygon]:
    """Return what lies between lines that are the two faces of one wall, over the length that they share.

    Faces are parallel, up to THICK_WALL_M apart and longer than they are apart, so that the jambs of a narrow door
    are none.
    """
    ends = np.asarray([(*a, *b) for a, b in lines], np.float64).reshape(-1, 4)
    start, along = ends[:, :2], ends[:, 2:] - ends[:, :2]
    length = np.hypot(*along.T)
    kept = length > MM_M
    start, length, way = start[kept], length[kept], along[kept] / length[kept, None]
    if len(start) < 2:
        return []
    segments = shapely.linestrings(np.stack([start, start + way * length[:, None]], axis=1))
    one, other = shapely.STRtree(segments).query(segments, predicate="dwithin", distance=THICK_WALL_M)
    across = np.stack([-way[:, 1], way[:, 0]], axis=1)
    from_one = start[other] - start[one]
    first = dot_product(from_one, way[one])
    last = first + dot_product(way[other], way[one]) * length[other]
    low, high = np.maximum(np.minimum(first, last), 0.0), np.minimum(np.maximum(first, last), length[one])
    away = np.abs(dot_product(from_one, across[one]))
    is_face = (np.abs(dot_product(way[other], across[one])) < PARALLEL) & (away > MM_M) & (away <= THICK_WALL_M)
    is_face &= high - low >= away
    one, other, low, high, away = one[is_face], other[is_face], low[is_face], high[is_face], away[is_face]
    nearest = _nearest_along(one, low, high, away)
    back = {(int(i), int(k)): near for i, k, near in zip(one, other, nearest, strict=True)}
    bodies = []
    for i, k, a, b, far, near in zip(one, other, low, high, away, nearest, strict=True):
        if i < k and far <= _AS_NEAR * min(near, back.get((int(k), int(i)), near)):
            side = np.sign(float((start[k] - start[i]) @ across[i])) * far * across[i]
            p, q = start[i] + way[i] * a, start[i] + way[i] * b
            bodies.append(Polygon([p, q, q + side, p + side]))
    return bodies


def windows_from_lines(lines: Sequence[tuple[Point, Point]]) -> tuple[list[Polygon], list[tuple[Point, Point]]]:
    """Return the bodies of windows, and the lines of those that are only lines.

    Lines that touch are one window, whose body is the smallest turned rectangle around it. One that is deeper than a
    wall (with sashes that stand open, or a bay) has no body, and its lines are left out.
    """
    segments = [LineString(line) for line in lines if line[0] != line[1]]
    if not segments:
        return [], []
    groups = shapely.get_parts(shapely.union_all(shapely.buffer(segments, CRACK_M / 2, cap_style="square")))
    tree = shapely.STRtree(segments)
    bodies: list[Polygon] = []
    frames: list[tuple[Point, Point]] = []
    for group in groups:
        parts = [segments[i] for i in tree.query(group, predicate="covers")]
        box = shapely.minimum_rotated_rectangle(shapely.union_all(parts))
        if isinstance(box, Polygon) and box.area > MM_M * box.length:
            corners = shapely.get_coordinates(box)
            if np.hypot(*np.diff(corners[:3], axis=0).T).min() <= DEEPEST_WALL_M:
                bodies.append(box)
        else:
            frames += [(part.coords[0], part.coords[-1]) for part in parts]
    return bodies, frames


def _windows_of_frames(frames: Sequence[tuple[Point, Point]]) -> list[Polygon]:
    """Return the places of windows that are only lines; lines beside each other in one wall are one window."""
    lines = [LineString(frame) for frame in frames]
    beside = shapely.union_all(shapely.buffer(lines, WALL_M / 2, cap_style="flat"))
    tree, found = shapely.STRtree(lines), []
    for group in polygons_of(beside):
        own = shapely.buffer([lines[k] for k in tree.query(group, predicate="covers")], MM_M, cap_style="flat")
        box = shapely.minimum_rotated_rectangle(shapely.union_all(own))
        sides = np.hypot(*np.diff(shapely.get_coordinates(box)[:3], axis=0).T)
        if isinstance(box, Polygon) and sides.min() < THICK_WALL_M:
            found.append(box)
    return found


def _nearest_along(
    one: npt.NDArray[np.intp],
    low: npt.NDArray[np.float64],
    high: npt.NDArray[np.float64],
    away: npt.NDArray[np.float64],
) -> npt.NDArray[np.float64]:
    """Return, for each pair, how near the nearest line is that runs beside the first line along half of the pair."""
    found = away.copy()
    order = np.argsort(one, kind="stable")
    for group in np.split(order, np.flatnonzero(np.diff(one[order])) + 1) if len(order) else ():
        shared = np.minimum(high[group], high[group][:, None]) - np.maximum(low[group], low[group][:, None])
        beside = shared >= 0.5 * (high[group] - low[group])[:, None]
        found[group] = np.where(beside, away[group][None, :], np.inf).min(axis=1)
    return found
