"""An IFC file's building as plain values: storeys, walls, floors, spaces and wall openings with their triangles.

One pass of ifcopenshell's geometry iterator over the elements that matter makes all triangles, in metres (the
iterator converts the file's unit) and in the project's z-up axes. What is left out and why:

- windows, door leaves, furniture: they are not walls, and their holes are in the walls already;
- stairs, railings, coverings: a robot meets a stair as furniture, the others lie over its head or underfoot;
- beams are kept apart from walls: one that spans an opening bounds its two rooms as a lintel does;
- proxies (IfcBuildingElementProxy) are walls only in a file without any wall, as some exporters write everything so.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.rejection import Reason, Rejection
from pipeline.sources.naming import check_file
from pipeline.values import Mesh

WALLS = ("IfcWall", "IfcColumn", "IfcChimney", "IfcCurtainWall")
CURTAIN_PARTS = ("IfcPlate", "IfcMember")
SPACES_WITHIN_SPACES = "COMPLEX"  # CompositionType of a group of spaces that are in the file themselves
AREAS = frozenset({"GFA"})  # PredefinedType of a space that is a measure of the whole storey
TAIL_BYTES = 4096


@dataclass(frozen=True)
class Storey:
    """A building storey: its step id, its name, its elevation in metres."""

    key: int
    name: str
    elevation_m: float


@dataclass(frozen=True, eq=False)
class Part:
    """An element's triangles in project axes, metres; ``storey`` is the step id of what contains it, or None."""

    mesh: Mesh
    storey: int | None
    names: tuple[str, ...] = ()
    has_door: bool = False


@dataclass(frozen=True, eq=False)
class Building:
    """What the levels are made from."""

    schema: str
    storeys: tuple[Storey, ...]
    walls: tuple[Part, ...]
    beams: tuple[Part, ...]
    slabs: tuple[Part, ...]
    spaces: tuple[Part, ...]
    openings: tuple[Part, ...]


def load_building(path: Path) -> Building:
    """Open an IFC file and triangulate what matters.

    Raises
    ------
    Rejection
        MISSING_FILE, EMPTY, UNREADABLE (garbage, truncated, ifcopenshell not installed) or NO_LEVEL (no storey).
    """
    check_file(path)
    try:
        import ifcopenshell
        import ifcopenshell.geom
    except ImportError as error:
        detail = f"{path.name} needs ifcopenshell, which is not installed"
        raise Rejection("source", Reason.UNREADABLE, detail, "pip install 'houseexpo[ifc]'") from error
    _check_end(path)
    try:
        model = ifcopenshell.open(str(path))
        return _building(model, path)
    except (MemoryError, Rejection):
        raise
    except Exception as error:
        detail = f"{path.name} cannot be read as IFC: {type(error).__name__}: {str(error)[:200]}"
        raise Rejection("source", Reason.UNREADABLE, detail, "export the file again") from error


def _check_end(path: Path) -> None:
    """Reject what is cut short: without the line that ends a step file the parser silently returns what is there."""
    with path.open("rb") as stream:
        start = stream.read(TAIL_BYTES)
        stream.seek(max(path.stat().st_size - TAIL_BYTES, 0))
        end = stream.read()
    if b"ISO-10303-21" not in start:
        raise Rejection("source", Reason.UNREADABLE, f"{path.name} is no IFC step file", "export it as .ifc")
    if b"END-ISO-10303-21" not in end:
        detail = f"{path.name} breaks off before END-ISO-10303-21"
        raise Rejection("source", Reason.UNREADABLE, detail, "the file is truncated: copy or export it again")


def _building(model: Any, path: Path) -> Building:
    from ifcopenshell.util.placement import get_storey_elevation
    from ifcopenshell.util.unit import calculate_unit_scale

    metres = float(calculate_unit_scale(model))
    storeys = [
        Storey(storey.id(), storey.Name or "", float(get_storey_elevation(storey)) * metres)
        for storey in model.by_type("IfcBuildingStorey")
    ]
    if not storeys:
        detail = f"{path.name} holds no IfcBuildingStorey"
        raise Rejection("source", Reason.NO_LEVEL, detail, "export the building with its storeys, or as a mesh")
    walls = _walls(model)
    beams = list(model.by_type("IfcBeam"))
    slabs = [slab for slab in model.by_type("IfcSlab") if slab.PredefinedType != "ROOF"]
    spaces = [space for space in model.by_type("IfcSpace") if _is_room(space)]
    openings = [opening for opening in model.by_type("IfcOpeningElement") if _is_passage(opening)]
    meshes = dict(_triangulate(model, [*walls, *beams, *slabs, *spaces, *openings]))
    kinds = (tuple(_parts(elements, meshes)) for elements in (walls, beams, slabs, spaces, openings))
    return Building(str(model.schema), tuple(sorted(storeys, key=lambda s: (s.elevation_m, s.key))), *kinds)


def _walls(model: Any) -> list[Any]:
    walls = [element for name in WALLS for element in _of_type(model, name)]
    walls += [part for name in CURTAIN_PARTS for part in _of_type(model, name) if _in_curtain_wall(part)]
    if not _of_type(model, "IfcWall"):
        walls += _of_type(model, "IfcBuildingElementProxy")
    return walls


def _of_type(model: Any, name: str) -> list[Any]:
    try:
        return list(model.by_type(name))
    except RuntimeError:  # a class that this file's schema does not have
        return []


def _in_curtain_wall(part: Any) -> bool:
    return any(relation.RelatingObject.is_a("IfcCurtainWall") for relation in part.Decomposes)


def _is_room(space: Any) -> bool:
    return space.CompositionType != SPACES_WITHIN_SPACES and getattr(space, "PredefinedType", None) not in AREAS


def _is_passage(opening: Any) -> bool:
    """Tell a hole in a wall, open or with a door, from a window's and from one in a slab."""
    hosts = [relation.RelatingBuildingElement for relation in opening.VoidsElements]
    fillings = [relation.RelatedBuildingElement for relation in opening.HasFillings]
    return any(host.is_a("IfcWall") for host in hosts) and not any(fill.is_a("IfcWindow") for fill in fillings)


def _triangulate(model: Any, elements: Iterable[Any]) -> Iterator[tuple[int, Mesh]]:
    """Yield (step id, triangles); one that has no body, or whose body cannot be made, is left out by the iterator."""
    import ifcopenshell.geom

    wanted = list(elements)
    settings: Any = ifcopenshell.geom.settings()  # type: ignore[no-untyped-call]
    settings.set("use-world-coords", True)
    iterator: Any = ifcopenshell.geom.iterator(settings, model, 1, include=wanted)
    if not wanted or not iterator.initialize():
        return
    while True:
        shape = iterator.get()
        vertices = np.array(shape.geometry.verts, np.float64).reshape(-1, 3)
        faces = np.array(shape.geometry.faces, np.int64).reshape(-1, 3)
        if len(faces) and np.isfinite(vertices).all():
            yield int(shape.id), Mesh(vertices, faces)
        if not iterator.next():
            return


def _parts(elements: Iterable[Any], meshes: dict[int, Mesh]) -> Iterator[Part]:
    for element in sorted(elements, key=lambda each: each.id()):
        if element.id() in meshes:
            words = (getattr(element, "LongName", None), element.Name)
            names = tuple(dict.fromkeys(word.strip() for word in words if word and word.strip()))
            yield Part(meshes[element.id()], _storey_of(element), names, _has_door(element))


def _storey_of(element: Any) -> int | None:
    from ifcopenshell.util.element import get_parent

    storey = get_parent(element, ifc_class="IfcBuildingStorey")
    return int(storey.id()) if storey else None


def _has_door(element: Any) -> bool:
    fillings = getattr(element, "HasFillings", None) or ()
    return any(relation.RelatedBuildingElement.is_a("IfcDoor") for relation in fillings)
