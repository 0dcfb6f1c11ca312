"""An IFC file's building as plain values: its storeys, and the triangles of all that is told apart in it.

One pass of ifcopenshell's geometry iterator makes all triangles, in metres (the iterator converts the file's unit) and
in the project's z-up axes. Most of a read's time goes here: into holes taken out of walls, then into furniture.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from pipeline.rejection import Reason, Rejection
from pipeline.sources.ifc_elements import Elements, elements_of, filled_by, hosts_of, parent_of, words_of
from pipeline.sources.ifc_sound import Soundness
from pipeline.sources.ifc_text import open_model
from pipeline.values import Mesh

KERNEL: Final = "hybrid-cgal-simple-opencascade"  # flat-faced bodies go a quick way, the rest through OCC
DOOR_WIDTH_M, DOOR_HEIGHT_M, DOOR_DEPTH_M = 0.9, 2.0, 0.1  # of a door that has neither body nor size


@dataclass(frozen=True)
class Storey:
    """A building storey: its step id, its name, its elevation in metres, the step id of its building."""

    key: int
    name: str
    elevation_m: float
    building: int | None = None


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
class Part(Body):
    """The body of an element, its words and its class.

    ``storey`` is the step id of the storey that contains it, or None if there is none.
    """

    storey: int | None
    words: tuple[str, ...] = ()
    kind: str = ""


@dataclass(frozen=True, eq=False)
class Hole(Body):
    """A way through a wall: the body of the opening, or of the door where it stands there without one.

    ``host``: the wall's triangles, or None if the source names none. ``along``: direction of the door's width in plan,
    known for doors; ``width_m``: its width.
    """

    host: Mesh | None
    has_door: bool
    along: tuple[float, float] | None = None
    width_m: float | None = None


@dataclass(frozen=True, eq=False)
class Building:
    """What the levels are made from; ``named_openings``: the file has holes in its walls as elements."""

    schema: str
    storeys: tuple[Storey, ...]
    walls: tuple[Part, ...]
    loose: tuple[Part, ...]
    beams: tuple[Part, ...]
    slabs: tuple[Part, ...]
    spaces: tuple[Part, ...]
    holes: tuple[Hole, ...]
    windows: tuple[Hole, ...]  # in walls, filled by windows; ``holes`` are all others
    leaves: tuple[Part, ...]
    furniture: tuple[Part, ...]
    named_openings: bool


def load_building(path: Path) -> Building:
    """Open an IFC file and triangulate what matters.

    Raises
    ------
    Rejection
        MISSING_FILE, EMPTY, UNREADABLE (garbage, truncated, ifcopenshell not installed) or NO_LEVEL (no storey).
    """
    try:
        model, schema = open_model(path)
        return _building(model, schema, path)
    except (MemoryError, Rejection):
        raise
    except Exception as error:
        detail = f"{path.name} cannot be read as IFC: {type(error).__name__}: {str(error)[:200]}"
        raise Rejection("source", Reason.UNREADABLE, detail, "export the file again") from error


def _building(model: Any, schema: str, path: Path) -> Building:
    from ifcopenshell.util.unit import calculate_unit_scale

    metres = float(calculate_unit_scale(model))
    storeys = [_storey(storey, metres) for storey in model.by_type("IfcBuildingStorey")]
    if not storeys:
        detail = f"{path.name} holds no IfcBuildingStorey"
        raise Rejection("source", Reason.NO_LEVEL, detail, "export the building with its storeys, or as a mesh")
    elements = elements_of(model)
    meshes = dict(_triangulate(model, elements.all()))
    return Building(
        schema=schema,
        storeys=tuple(sorted(storeys, key=lambda s: (s.elevation_m, s.key))),
        walls=_parts(elements.walls, meshes),
        loose=_parts(elements.loose, meshes),
        beams=_parts(elements.beams, meshes),
        slabs=_parts(elements.slabs, meshes),
        spaces=_parts(elements.spaces, meshes),
        holes=tuple(_holes(elements, meshes, metres)),
        windows=tuple(_windows(elements, meshes, metres)),
        leaves=_parts(elements.doors, meshes),
        furniture=_parts(elements.furniture, meshes),
        named_openings=bool(elements.openings),
    )


def _storey(storey: Any, metres: float) -> Storey:
    building, matrix = parent_of(storey, "IfcBuilding"), _placement(storey, metres)
    elevation = float(storey.Elevation or 0.0) * metres if matrix is None else float(matrix[2, 3])
    return Storey(storey.id(), storey.Name or "", elevation, building.id() if building else None)


def _triangulate(model: Any, elements: Iterable[Any]) -> Iterator[tuple[int, Mesh]]:
    """Yield (step id, triangles); one that has no body, or whose body cannot be made, is left out by the iterator."""
    import ifcopenshell.geom

    sound = Soundness()
    wanted = [each for each in {element.id(): element for element in elements}.values() if sound.of(each)]
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


def _parts(elements: Iterable[Any], meshes: dict[int, Mesh]) -> tuple[Part, ...]:
    bodied = (each for each in sorted(elements, key=lambda each: each.id()) if each.id() in meshes)
    return tuple(Part(meshes[each.id()], _storey_of(each), words_of(each), each.is_a()) for each in bodied)


def _storey_of(element: Any) -> int | None:
    storey = parent_of(element, "IfcBuildingStorey")
    return int(storey.id()) if storey else None


def _holes(elements: Elements, meshes: dict[int, Mesh], metres: float) -> Iterator[Hole]:
    """Openings in walls that hold no window, then the doors that stand in no such opening."""
    done: set[int] = set()
    for opening in elements.openings:
        doors = [each for each in filled_by(opening) if each.is_a("IfcDoor")]
        if opening.id() not in meshes or _is_window(opening):
            continue
        host = _host(opening, meshes)
        along, width = _door_frame(doors[0], metres) if doors else (None, None)
        done.update(door.id() for door in doors)
        yield Hole(meshes[opening.id()], host, bool(doors), along, width)
    for door in elements.doors:
        if door.id() not in done:
            along, width = _door_frame(door, metres)
            body = meshes.get(door.id()) or _box(door, metres)
            if body is not None:
                yield Hole(body, None, True, along, width)


def _windows(elements: Elements, meshes: dict[int, Mesh], metres: float) -> Iterator[Hole]:
    for each in elements.openings:
        if each.id() in meshes and _is_window(each):
            yield Hole(meshes[each.id()], _host(each, meshes), False, *_door_frame(filled_by(each)[0], metres))


def _is_window(opening: Any) -> bool:
    """Whether a window fills an opening, and no door."""
    doors, windows = ([each for each in filled_by(opening) if each.is_a(kind)] for kind in ("IfcDoor", "IfcWindow"))
    return bool(windows and not doors)


def _host(opening: Any, meshes: dict[int, Mesh]) -> Mesh | None:
    """The wall that an opening is a hole in, where it has a body."""
    return next((meshes[each.id()] for each in hosts_of(opening) if each.id() in meshes), None)


def _placement(element: Any, metres: float) -> npt.NDArray[np.float64] | None:
    from ifcopenshell.util.placement import get_local_placement

    if not getattr(element, "ObjectPlacement", None) or not Soundness().of(element):
        return None
    matrix = np.array(get_local_placement(element.ObjectPlacement), np.float64)
    matrix[:3, 3] *= metres
    return matrix if np.isfinite(matrix).all() else None


def _door_frame(door: Any, metres: float) -> tuple[tuple[float, float] | None, float | None]:
    """The direction of a door's or window's width in plan (the x axis of its placement), and the width, where known."""
    matrix = _placement(door, metres)
    width = door.OverallWidth * metres if door.OverallWidth else None
    if matrix is None or abs(matrix[2, 0]) > 0.1:  # an x axis that is not level is no width in plan
        return None, width
    return (float(matrix[0, 0]), float(matrix[1, 0])), width


def _box(door: Any, metres: float) -> Mesh | None:
    """A door without a body, as the box that its placement and its size tell."""
    matrix = _placement(door, metres)
    if matrix is None:
        return None
    width = (door.OverallWidth or 0) * metres or DOOR_WIDTH_M
    height = (door.OverallHeight or 0) * metres or DOOR_HEIGHT_M
    corners = np.array([(x, y, z) for x in (0, width) for y in (0, DOOR_DEPTH_M) for z in (0, height)])
    faces = np.array([(0, 4, 6), (0, 6, 2), (0, 1, 5), (0, 5, 4), (1, 3, 7), (1, 7, 5), (2, 6, 7), (2, 7, 3)])
    return Mesh(corners @ matrix[:3, :3].T + matrix[:3, 3], faces.astype(np.int64))
