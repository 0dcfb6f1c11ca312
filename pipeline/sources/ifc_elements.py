"""Which elements of an IFC model are walls, doors, holes, rooms, furniture; what is none of them is left out.

R1  Walls, columns and chimneys stand; so do curtain walls with their plates and members, and windows except those in
    roofs and slabs: full-height glazing parts rooms, and a pane closes the hole that it fills.
R2  A wall that is an aggregate without a body of its own is its parts.
R3  What may be a partition by another name (proxies, loose plates, members and parts) is ``loose``: the levels decide
    by its shape; in a file without walls they are the walls. Plants, cars, people and texts are neither.
R4  Openings count where they void a wall or a wall's part, not where they void a slab, a roof or a space.
R5  Spaces count unless they lie outside, measure a whole storey, or only group spaces that are in the file themselves;
    the parts of a space that has a body of its own do not.
R6  Beams are kept apart: one that spans an opening bounds its two rooms as a lintel does. Coverings, roofs, footings,
    ramps and pipes are left out: over the head, underfoot, passable or within walls.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

WALLS = ("IfcWall", "IfcColumn", "IfcChimney", "IfcCurtainWall", "IfcWindow")
LOOSE = ("IfcBuildingElementProxy", "IfcPlate", "IfcMember", "IfcBuildingElementPart")
HOSTS = ("IfcWall", "IfcCurtainWall")
COVERS = ("IfcSlab", "IfcRoof", "IfcCovering")
FURNITURE = (
    "IfcFurnishingElement",
    "IfcFlowTerminal",
    "IfcStair",
    "IfcStairFlight",
    "IfcRailing",
    "IfcTransportElement",
)
AREAS = frozenset({"GFA", "EXTERNAL"})  # PredefinedType of a space that is no room (IFC4)
NO_BUILDING = re.compile(
    r"tree|plant|shrub|hedge|\bcar\b|vehicle|person|people|human|\btext\b|entourage|topograph|terrain|parking"
    r"|baum|pflanze|hecke|arbre|[aá]rbol|alber[oi]|[aá]rvore|\bboom\b",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class Elements:
    """ifcopenshell's elements by what they are to a plan."""

    walls: list[Any]
    loose: list[Any]
    beams: list[Any]
    slabs: list[Any]
    spaces: list[Any]
    openings: list[Any]
    doors: list[Any]
    furniture: list[Any]

    def all(self) -> Iterator[Any]:
        """Every one of them."""
        for kind in (self.walls, self.loose, self.beams, self.slabs, self.spaces):
            yield from kind
        for kind in (self.openings, self.doors, self.furniture):
            yield from kind


def elements_of(model: Any) -> Elements:
    """Sort a model's elements."""
    walls = _walls(model)
    known = {element.id() for element in walls}
    loose = [e for name in LOOSE for e in _of_type(model, name) if e.id() not in known and _may_be_wall(e)]
    if not any(wall.is_a(name) for wall in walls for name in HOSTS):  # R3
        walls, loose = walls + loose, []
    return Elements(
        walls=walls,
        loose=loose,
        beams=_of_type(model, "IfcBeam"),
        slabs=[slab for slab in _of_type(model, "IfcSlab") if not _is_roof(slab)],
        spaces=_rooms(_of_type(model, "IfcSpace")),
        openings=[each for each in _of_type(model, "IfcOpeningElement") if any(map(_is_host, hosts_of(each)))],
        doors=_of_type(model, "IfcDoor"),
        furniture=[element for name in FURNITURE for element in _of_type(model, name)],
    )


def words_of(element: Any) -> tuple[str, ...]:
    """The element's own words: its long name, its name, its type's, without repetition."""
    words = (getattr(element, name, None) for name in ("LongName", "Name", "ObjectType"))
    return tuple(dict.fromkeys(word.strip() for word in words if isinstance(word, str) and word.strip()))


def hosts_of(opening: Any) -> list[Any]:
    """What an opening is a hole in."""
    return [each.RelatingBuildingElement for each in opening.VoidsElements if each.RelatingBuildingElement]


def filled_by(opening: Any) -> list[Any]:
    """What stands in an opening."""
    return [each.RelatedBuildingElement for each in opening.HasFillings if each.RelatedBuildingElement]


def parent_of(element: Any, kind: str) -> Any:
    """The nearest thing of a class that holds an element, has it as a part or has the hole that it fills, or None."""
    return next((each for each in _holders(element) if each is not None and each.is_a(kind)), None)


def is_held_in_a_circle(element: Any) -> bool:
    """Whether what holds an element is held by it in turn: a damaged file, in which native code never ends."""
    return next((True for each in _holders(element) if each is None), False)


def _holders(element: Any) -> Iterator[Any]:
    """The element, what holds it, what holds that; None at the end where they go round in a circle."""
    seen: set[int] = set()
    while element is not None:
        if element.id() in seen:
            yield None
            return
        yield element
        seen.add(element.id())
        element = _holder(element)


def _holder(element: Any) -> Any:
    ways = (
        ("ContainedInStructure", "RelatingStructure"),
        ("Decomposes", "RelatingObject"),
        ("FillsVoids", "RelatingOpeningElement"),
        ("VoidsElements", "RelatingBuildingElement"),
    )
    for inverse, relating in ways:
        for relation in getattr(element, inverse, None) or ():
            if getattr(relation, relating, None) is not None:
                return getattr(relation, relating)
    return None


def _of_type(model: Any, name: str) -> list[Any]:
    try:
        return list(model.by_type(name))
    except RuntimeError:  # a class that this file's schema does not have
        return []


def _wholes(element: Any) -> Iterator[Any]:
    """What an element is a part of, from near to far; a file may go round in circles."""
    seen = {element.id()}
    while element is not None:
        relations = getattr(element, "Decomposes", None) or ()
        element = next((each.RelatingObject for each in relations if hasattr(each, "RelatingObject")), None)
        if element is None or element.id() in seen:
            return
        seen.add(element.id())
        yield element


def _parts(element: Any, seen: frozenset[int] = frozenset()) -> Iterator[Any]:
    """The parts of an element at all depths."""
    for relation in getattr(element, "IsDecomposedBy", None) or ():
        for part in relation.RelatedObjects or ():
            if part.id() not in seen:
                yield part
                yield from _parts(part, seen | {part.id()})


def _walls(model: Any) -> list[Any]:
    """R1, R2."""
    found = {each.id(): each for name in WALLS for each in _of_type(model, name) if not _is_in_roof(each)}
    for whole in list(found.values()):
        if whole.is_a("IfcCurtainWall") or (whole.is_a("IfcWall") and not whole.Representation):
            parts = (part for part in _parts(whole) if part.is_a("IfcElement") and not part.is_a("IfcDoor"))
            found |= {part.id(): part for part in parts}
    return list(found.values())


def _is_in_roof(element: Any) -> bool:
    """Whether a window lies in a roof or a slab."""
    openings = [each.RelatingOpeningElement for each in getattr(element, "FillsVoids", None) or ()]
    wholes = [*_wholes(element), *(host for opening in openings for host in hosts_of(opening))]
    return element.is_a("IfcWindow") and any(whole.is_a(name) for whole in wholes for name in COVERS)


def _may_be_wall(element: Any) -> bool:
    """R3; the parts of slabs and roofs are none, whatever their shape."""
    if any(whole.is_a(name) for whole in _wholes(element) for name in COVERS):
        return False
    return not any(NO_BUILDING.search(word) for word in words_of(element))


def _is_host(element: Any) -> bool:
    """R4."""
    return any(each.is_a(name) for each in (element, *_wholes(element)) for name in HOSTS) or (
        any(element.is_a(name) for name in LOOSE)
    )


def _is_roof(slab: Any) -> bool:
    return slab.PredefinedType == "ROOF" or any(whole.is_a("IfcRoof") for whole in _wholes(slab))


def _rooms(spaces: list[Any]) -> list[Any]:
    """R5."""
    bodied = {space.id() for space in spaces if space.Representation}
    return [space for space in spaces if _is_room(space, bodied)]


def _is_room(space: Any, bodied: set[int]) -> bool:
    kinds = {getattr(space, name, None) for name in ("PredefinedType", "InteriorOrExteriorSpace")}
    if kinds & AREAS:
        return False
    if space.CompositionType == "PARTIAL":
        return not any(whole.id() in bodied for whole in _wholes(space))
    if space.CompositionType == "COMPLEX":
        return not any(part.id() in bodied for part in _parts(space))
    return True
