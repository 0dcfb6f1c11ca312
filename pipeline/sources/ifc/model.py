"""Read an IFC file as plain values (``Building``): its storeys, and the triangles of its walls, doors, spaces and more.

One pass of ifcopenshell's geometry iterator makes all triangles, in metres (the iterator converts the file's unit) and
in the project's z-up axes. Most of a read's time goes here: into holes taken out of walls, then into furniture.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from pipeline.geometry.meshes import box_around
from pipeline.rejection import Reason, Rejection
from pipeline.sources.ifc.elements import (
    ElementsByKind,
    containers,
    element_words,
    find_parent,
    is_called_door,
    members,
    opening_fillings,
    opening_hosts,
    sort_elements,
)
from pipeline.sources.ifc.mending import DAMAGED, SoundnessChecker, mend_model
from pipeline.sources.ifc.step_file import open_model
from pipeline.sources.tolerances import IFC_DOOR_M, NAMED_DOOR_M, NARROWEST_DOOR_M, VERTICAL, WIDEST_DOOR_BODY_M
from pipeline.tolerances import HAND_M, HEAD_M, MOST, THICK_WALL_M
from pipeline.values import Mesh

FRENCH_WINDOW = re.compile(
    r"\bporte(s\b|\b|fen)|\bcoulissante?s?\b|\bsliding\b|\bschuif|\bschiebe|\bporta(\b|fin)|\bpuerta(s\b|\b|vent)|\bdeur(en)?\b|\bdrzwi\b"
    r"|(?<!out)\bdoors?\b|t(ü|ue)r(e?n)?\b",
    re.IGNORECASE,
)
KERNEL: Final = "hybrid-cgal-simple-opencascade"  # flat-faced bodies go a quick way, the rest through OCC


@dataclass(frozen=True)
class Storey:
    """A building storey: its step id, its name, its elevation in metres, the step id of its building.

    ``is_said`` is of one that a person says.
    """

    key: int
    name: str
    elevation_m: float
    building: int | None = None
    is_said: bool = False


@dataclass(frozen=True, eq=False)
class Body:
    """Triangles in project axes, metres."""

    mesh: Mesh

    @property
    def bottom(self) -> float:
        """Height of its lowest point."""
        return float(self.mesh.vertices[:, 2].min())

    @property
    def top(self) -> float:
        """Height of its highest point."""
        return float(self.mesh.vertices[:, 2].max())


@dataclass(frozen=True, eq=False)
class ElementBody(Body):
    """The body of an element, its words and its class.

    ``storey`` is the step id of the storey that contains it, or None if there is none; ``building`` is then the step id
    of the building that contains it, or None if there is none either.
    """

    storey: int | None
    words: tuple[str, ...] = ()
    kind: str = ""
    building: int | None = None


@dataclass(frozen=True, eq=False)
class WallHole(Body):
    """A way through a wall: the body of the opening, or of the door where it stands there without one.

    ``host``: the wall's triangles, or None if the source names none. ``along``: direction of the door's width in plan,
    known for doors; ``width_m``: its width. ``is_window``: what counts as its door is a window that is called a door.
    """

    host: Mesh | None
    has_door: bool
    along: tuple[float, float] | None = None
    width_m: float | None = None
    is_window: bool = False


@dataclass(frozen=True, eq=False)
class Building:
    """What the levels are made from.

    ``unit_m`` is the length of the file's unit, metres. ``buildings`` are the step ids of its buildings.
    ``named_openings``: the file has holes in its walls as elements.
    """

    schema: str
    buildings: frozenset[int]
    storeys: tuple[Storey, ...]
    walls: tuple[ElementBody, ...]
    loose: tuple[ElementBody, ...]
    beams: tuple[ElementBody, ...]
    slabs: tuple[ElementBody, ...]
    roofs: tuple[ElementBody, ...]
    spaces: tuple[ElementBody, ...]
    outdoors: tuple[ElementBody, ...]
    holes: tuple[WallHole, ...]
    windows: tuple[WallHole, ...]  # in walls, filled by windows; ``holes`` are all others
    leaves: tuple[ElementBody, ...]
    furniture: tuple[ElementBody, ...]
    stairs: tuple[ElementBody, ...]
    named_openings: bool
    unit_m: float = 1.0


def load_building(path: Path, without: Sequence[str] = ()) -> Building:
    """Open an IFC file and triangulate what matters, but for elements of which a name or the class is ``without``.

    Raises
    ------
    Rejection
        MISSING_FILE, EMPTY, UNREADABLE (garbage, truncated, ifcopenshell not installed).
    """
    try:
        model, schema = open_model(path)
        return _building(model, schema, without)
    except (MemoryError, Rejection):
        raise
    except Exception as error:
        detail = f"{path.name} cannot be read as IFC: {type(error).__name__}: {str(error)[:200]}"
        raise Rejection("source", Reason.UNREADABLE, detail, "export the file again") from error


def _building(model: Any, schema: str, without: Sequence[str]) -> Building:
    from ifcopenshell.util.unit import calculate_unit_scale

    metres = 1.0
    with suppress(*DAMAGED):  # such a unit says nothing
        metres = float(calculate_unit_scale(model))
    mend_model(model, metres)
    storeys = [_storey(storey, metres) for storey in model.by_type("IfcBuildingStorey")]
    elements = sort_elements(model).without(without)
    meshes = dict(_triangulate(model, elements))
    elements = _with_called_doors(elements, meshes)
    fillings = _fillings(elements, meshes)
    french = _french_windows(elements, fillings, meshes)
    return Building(
        schema=schema,
        buildings=frozenset(int(each.id()) for each in model.by_type("IfcBuilding")),
        storeys=tuple(sorted(storeys, key=lambda s: (s.elevation_m, s.key))),
        walls=_parts((each for each in elements.walls if each.id() not in french), meshes),
        loose=_parts(elements.loose, meshes),
        beams=_parts(elements.beams, meshes),
        slabs=_parts(elements.slabs, meshes),
        roofs=_parts(elements.roofs, meshes),
        spaces=_parts(elements.spaces, meshes),
        outdoors=_parts(elements.outdoors, meshes),
        holes=tuple(_holes(elements, fillings, meshes, metres)),
        windows=tuple(_windows(elements, fillings, meshes, metres)),
        leaves=_parts([*elements.doors, *french.values()], meshes),
        furniture=_parts(elements.furniture, meshes),
        stairs=_parts(elements.stairs, meshes),
        named_openings=bool(elements.openings),
        unit_m=metres,
    )


def _storey(storey: Any, metres: float) -> Storey:
    building, matrix = find_parent(storey, "IfcBuilding"), _placement(storey, metres)
    elevation = float(storey.Elevation or 0.0) * metres if matrix is None else float(matrix[2, 3])
    return Storey(storey.id(), storey.Name or "", elevation, building.id() if building else None)


def _triangulate(model: Any, elements: Iterable[Any]) -> Iterator[tuple[int, Mesh]]:
    """Yield (step id, triangles); the iterator leaves out elements without a body, or whose body cannot be made."""
    import ifcopenshell.geom

    sound = SoundnessChecker()
    wanted = [each for each in {element.id(): element for element in elements}.values() if sound.of(each)]
    for element in wanted:
        _give_words(element)
    settings: Any = ifcopenshell.geom.settings()  # type: ignore[no-untyped-call]
    iterator: Any = ifcopenshell.geom.iterator(settings, model, 1, include=wanted, geometry_library=KERNEL)
    if not wanted or not iterator.initialize():
        return
    while True:
        shape = iterator.get()
        vertices = np.array(shape.geometry.verts, np.float64).reshape(-1, 3)
        faces = np.array(shape.geometry.faces, np.int64).reshape(-1, 3)
        placement = np.array(shape.transformation.matrix, np.float64).reshape(4, 4).T  # column after column
        vertices = vertices @ placement[:3, :3].T + placement[:3, 3]
        if len(faces) and np.isfinite(vertices).all():
            yield int(shape.id), Mesh(vertices, faces)
        if not iterator.next():
            return


def _give_words(element: Any) -> None:
    """Give an element an id and a name that are words: with others the iterator fails, for all later files too."""
    if not isinstance(element.GlobalId, str):
        element.GlobalId = f"{element.id():022d}"
    if not isinstance(element.Name, str | None):
        element.Name = None


def _parts(elements: Iterable[Any], meshes: dict[int, Mesh]) -> tuple[ElementBody, ...]:
    bodied = (each for each in sorted(elements, key=lambda each: each.id()) if each.id() in meshes)
    return tuple(_part(each, meshes[each.id()]) for each in bodied)


def _part(element: Any, mesh: Mesh) -> ElementBody:
    storey = _id_of_parent(element, "IfcBuildingStorey")
    building = _id_of_parent(element, "IfcBuilding") if storey is None else None
    return ElementBody(mesh, storey, element_words(element), element.is_a(), building)


def _id_of_parent(element: Any, kind: str) -> int | None:
    parent = find_parent(element, kind)
    return int(parent.id()) if parent else None


def _with_called_doors(elements: ElementsByKind, meshes: dict[int, Mesh]) -> ElementsByKind:
    """Return the elements with those among the doors that are called doors and are as large as one (E8)."""
    groups = (elements.walls, elements.loose, elements.furniture)
    found = {
        each.id(): each
        for group in groups
        for each in group
        if is_called_door(each) and each.id() in meshes and _is_as_large_as_door(meshes[each.id()])
    }
    found = {key: each for key, each in found.items() if not any(whole.is_a("IfcDoor") for whole in containers(each))}
    if not found:
        return elements
    walls, loose, furniture = ([each for each in group if each.id() not in found] for group in groups)
    doors = [*elements.doors, *found.values()]
    return replace(elements, walls=walls, loose=loose, furniture=furniture, doors=doors)


def _is_as_large_as_door(mesh: Mesh) -> bool:
    """Return whether a body is as high and as wide as a door, and no deeper than a wall (E8)."""
    box = box_around(mesh.vertices)
    is_high = NAMED_DOOR_M[0] <= box.high - box.low <= NAMED_DOOR_M[1]
    return is_high and NARROWEST_DOOR_M <= box.width <= WIDEST_DOOR_BODY_M and box.thickness <= THICK_WALL_M


def _fillings(elements: ElementsByKind, meshes: dict[int, Mesh]) -> dict[int, list[Any]]:
    """Return the doors and windows in each opening, by its step id (E7)."""
    found = {opening.id(): opening_fillings(opening) for opening in elements.openings}
    windows = [each for each in elements.walls if each.is_a("IfcWindow")]
    fillings = [*elements.doors, *windows]
    bodies = [(each, body) for each in fillings if (body := _body_of(each, meshes)) is not None]
    loose = [(each, body) for each, body in bodies if not getattr(each, "FillsVoids", None)]
    for opening in elements.openings:
        if not found[opening.id()] and opening.id() in meshes:
            hole = meshes[opening.id()]
            within = [each for each, body in loose if _stands_in(body, hole)]
            found[opening.id()] = within or [each for each, body in bodies if _stands_before(body, hole)]
    return found


def _body_of(element: Any, meshes: dict[int, Mesh]) -> npt.NDArray[np.float64] | None:
    """Return the corners of an element's body, or of its parts' where it has none of its own."""
    if element.id() in meshes:
        return meshes[element.id()].vertices
    parts = [meshes[part.id()].vertices for part in members(element) if part.id() in meshes]
    return np.concatenate(parts) if parts else None


def _stands_in(corners: npt.NDArray[np.float64], hole: Mesh) -> bool:
    """Return whether the box around some corners lies in that around a hole for the most part."""
    low, high = corners.min(axis=0), corners.max(axis=0)
    shared = np.minimum(high, hole.vertices.max(axis=0)) - np.maximum(low, hole.vertices.min(axis=0))
    return bool((shared >= MOST * (high - low)).all())


def _stands_before(corners: npt.NDArray[np.float64], hole: Mesh) -> bool:
    """Return whether some corners span as much of a wall as a hole does, at its place, but for how deep they stand."""
    low, high = corners.min(axis=0), corners.max(axis=0)
    start, end = hole.vertices.min(axis=0), hole.vertices.max(axis=0)
    across = int(np.argmin((end - start)[:2]))
    if across != int(np.argmin((high - low)[:2])):
        return False
    shared = np.minimum(high, end) - np.maximum(low, start)
    in_wall = np.array([1 - across, 2])
    both = np.maximum(high - low, end - start)
    return bool((shared[in_wall] >= MOST * both[in_wall]).all() and shared[across] >= -HAND_M)


def _is_door(element: Any) -> bool:
    """Return whether what fills an opening is a door (E7, E8)."""
    if element.is_a("IfcDoor") or is_called_door(element):
        return True
    return element.is_a("IfcWindow") and any(FRENCH_WINDOW.search(word) for word in element_words(element))


def _french_windows(
    elements: ElementsByKind, fillings: dict[int, list[Any]], meshes: dict[int, Mesh]
) -> dict[int, Any]:
    """Return the windows that are leaves, by their step ids (E7)."""
    doors = [each for each in elements.openings if each.id() in meshes and _is_high(meshes[each.id()])]
    filling = [each for opening in doors for each in fillings[opening.id()]]
    return {each.id(): each for each in filling if each.is_a("IfcWindow") and _is_door(each)}


def _is_high(mesh: Mesh) -> bool:
    return float(np.ptp(mesh.vertices[:, 2])) >= HEAD_M  # a lower window is no door, whatever its name


def _holes(
    elements: ElementsByKind, fillings: dict[int, list[Any]], meshes: dict[int, Mesh], metres: float
) -> Iterator[WallHole]:
    """Openings in walls that hold no window, then the doors that stand in no such opening."""
    done: set[int] = set()
    for opening in elements.openings:
        if opening.id() not in meshes or _is_window(fillings[opening.id()], meshes[opening.id()]):
            continue
        doors = [each for each in fillings[opening.id()] if _is_door(each)]
        host = _host(opening, meshes)
        along, width = _door_frame(doors[0], metres) if doors else (None, None)
        done.update(door.id() for door in doors)
        is_window = bool(doors) and all(each.is_a("IfcWindow") for each in doors)
        yield WallHole(meshes[opening.id()], host, bool(doors), along, width, is_window)
    for door in elements.doors:
        if door.id() not in done:
            along, width = _door_frame(door, metres)
            body = meshes.get(door.id()) or _box(door, metres)
            if body is not None:
                yield WallHole(body, None, True, along, width)


def _windows(
    elements: ElementsByKind, fillings: dict[int, list[Any]], meshes: dict[int, Mesh], metres: float
) -> Iterator[WallHole]:
    for each in elements.openings:
        if each.id() in meshes and _is_window(fillings[each.id()], meshes[each.id()]):
            yield WallHole(meshes[each.id()], _host(each, meshes), False, *_door_frame(fillings[each.id()][0], metres))


def _is_window(filling: list[Any], hole: Mesh) -> bool:
    """Return whether a window fills an opening, and no door."""
    doors = [each for each in filling if each.is_a("IfcDoor") or (_is_door(each) and _is_high(hole))]
    return any(each.is_a("IfcWindow") for each in filling) and not doors


def _host(opening: Any, meshes: dict[int, Mesh]) -> Mesh | None:
    """Return the wall that an opening is a hole in, where it has a body."""
    return next((meshes[each.id()] for each in opening_hosts(opening) if each.id() in meshes), None)


def _placement(element: Any, metres: float) -> npt.NDArray[np.float64] | None:
    from ifcopenshell.util.placement import get_local_placement

    if not getattr(element, "ObjectPlacement", None) or not SoundnessChecker().of(element):
        return None
    matrix = np.array(get_local_placement(element.ObjectPlacement), np.float64)
    matrix[:3, 3] *= metres
    return matrix if np.isfinite(matrix).all() else None


def _door_frame(door: Any, metres: float) -> tuple[tuple[float, float] | None, float | None]:
    """The direction of a door's or window's width in plan (the x axis of its placement), and the width, where known."""
    if not hasattr(door, "OverallWidth"):  # E8: its placement says nothing of its direction
        return None, None
    matrix = _placement(door, metres)
    width = _length(door.OverallWidth, metres) or None
    if matrix is None or abs(matrix[2, 0]) > VERTICAL:  # an x axis that is not level is no width in plan
        return None, width
    return (float(matrix[0, 0]), float(matrix[1, 0])), width


def _length(value: Any, metres: float) -> float:
    """Return a length in metres, 0 where the file gives none."""
    return float(value) * metres if isinstance(value, float | int) else 0.0


def _box(door: Any, metres: float) -> Mesh | None:
    """A door without a body, as the box that its placement and its size tell."""
    matrix = _placement(door, metres)
    if matrix is None:
        return None
    width = _length(door.OverallWidth, metres) or IFC_DOOR_M[0]
    height = _length(door.OverallHeight, metres) or IFC_DOOR_M[1]
    corners = np.array([(x, y, z) for x in (0, width) for y in (0, IFC_DOOR_M[2]) for z in (0, height)])
    faces = np.array([(0, 4, 6), (0, 6, 2), (0, 1, 5), (0, 5, 4), (1, 3, 7), (1, 7, 5), (2, 6, 7), (2, 7, 3)])
    return Mesh(corners @ matrix[:3, :3].T + matrix[:3, 3], faces.astype(np.int64))
