"""Sort a model's elements into walls, doors, holes, rooms and furniture; anything else is left out.

The bodies tell more than the classes in E7 and E8; ``ifc.model`` follows these.

E1  Walls, columns and chimneys stand; so do curtain walls with their plates and members, and windows except those in
    roofs, ceilings and slabs: full-height glazing parts rooms, and a pane closes the hole that it fills.
E2  A wall that is an aggregate without a body of its own (an axis is not a body) is replaced by its parts.
E3  What may be a partition by another name (proxies, loose plates, members and parts) is ``loose``: the levels decide
    by its shape; in a file without walls they are the walls. Plants, cars, people and texts are neither.
E4  Openings count where they void a wall or a wall's part, not where they void a slab, a roof or a space.
E7  Some exporters do not say what fills an opening. Then it is the door or window that stands mostly in the opening,
    or else a door or window as large that stands right before or behind it, in another leaf of the wall. A window as
    high as a door that is called a door (a French window), or sliding, counts as a door.
E5  Spaces count as rooms, except spaces that measure a whole storey, that only group other spaces of the file, or that
    are parts of a space with a body of its own. A space that is external by its class or its property IsExternal is not
    a room: it marks an area outdoors.
E8  An element called a door and as large as a door is a door, whatever its class: a proxy, a plate, a piece of
    furniture. In a file without walls, proxies called furniture, plants or lamps are not the walls.
E9  In a file without walls, an element called a wall is a wall, whatever its class.
E10 Stairs are furniture. They are also kept apart, with ramps and the landings among the slabs: they show where people
    go up.
E6  Beams are kept apart: a beam that spans an opening bounds its two rooms as a lintel does. Roofs with all their parts
    are kept apart too: they show which area has a cover. Coverings, footings, ramps and pipes are left out: they lie
    over the head, underfoot or within walls, or are passable.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from fnmatch import fnmatchcase
from typing import Any

from pipeline.sources.roles import Role, role_from_name

WALLS = ("IfcWall", "IfcColumn", "IfcChimney", "IfcCurtainWall", "IfcWindow")
LOOSE = ("IfcBuildingElementProxy", "IfcPlate", "IfcMember", "IfcBuildingElementPart")
CALLED = (*LOOSE, "IfcFurnishingElement")  # E8
MISNAMED = ("IfcSlab", "IfcBeam", "IfcFooting", "IfcCovering", "IfcFurnishingElement")  # E9
HOSTS = ("IfcWall", "IfcCurtainWall")
COVERS = ("IfcSlab", "IfcRoof", "IfcCovering")
FLAT = frozenset({"Axis", "FootPrint", "Annotation", "Box"})  # representations that are no bodies
FURNITURE = (
    "IfcFurnishingElement",
    "IfcFlowTerminal",
    "IfcStair",
    "IfcStairFlight",
    "IfcRailing",
    "IfcTransportElement",
)
STAIRS = ("IfcStair", "IfcStairFlight", "IfcRamp", "IfcRampFlight")
AREA, EXTERNAL = "GFA", "EXTERNAL"  # PredefinedTypes of spaces that are no rooms (IFC4)
NO_BUILDING = re.compile(
    r"tree|plant|shrub|hedge|\bcar\b|vehicle|person|people|human|\btext\b|entourage|topograph|terrain|parking"
    r"|baum|pflanze|hecke|arbre|[aá]rbol|alber[oi]|[aá]rvore|\bboom\b",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class ElementsByKind:
    """ifcopenshell's elements by what they are to a plan."""

    walls: list[Any]
    loose: list[Any]
    beams: list[Any]
    slabs: list[Any]
    roofs: list[Any]
    spaces: list[Any]
    outdoors: list[Any]
    openings: list[Any]
    doors: list[Any]
    furniture: list[Any]
    stairs: list[Any]

    def __iter__(self) -> Iterator[Any]:
        for kind in (self.walls, self.loose, self.beams, self.slabs, self.roofs, self.spaces, self.outdoors):
            yield from kind
        for kind in (self.openings, self.doors, self.furniture, self.stairs):
            yield from kind

    def without(self, patterns: Sequence[str]) -> ElementsByKind:
        """Leave out the elements of which a name or the class matches a pattern (``Lamp*``, ``IfcRailing``).

        An opening goes with the only thing that stands in it: the wall is whole there.
        """
        if not patterns:
            return self
        groups = {each.name: getattr(self, each.name) for each in fields(self)}
        kept = {name: [each for each in group if not _matches(each, patterns)] for name, group in groups.items()}
        kept["openings"] = [each for each in kept["openings"] if not _is_filled_by(each, patterns)]
        return ElementsByKind(**kept)


def element_names(model: Any) -> list[str]:
    """Return the names and the classes of all elements with a place in a building, each once."""
    names = {name for each in of_type(model, "IfcProduct") for name in (*element_words(each), each.is_a())}
    return sorted(names)


def _matches(element: Any, patterns: Sequence[str]) -> bool:
    names = (*element_words(element), element.is_a())
    return any(fnmatchcase(name, pattern) for pattern in patterns for name in names)


def _is_filled_by(opening: Any, patterns: Sequence[str]) -> bool:
    filled = opening_fillings(opening)
    return bool(filled) and all(_matches(each, patterns) for each in filled)


def sort_elements(model: Any) -> ElementsByKind:
    """Sort a model's elements."""
    walls = _walls(model)
    known = {element.id() for element in walls}
    loose = [e for name in LOOSE for e in of_type(model, name) if e.id() not in known and _may_be_wall(e)]
    things: list[Any] = []
    if not any(wall.is_a(name) for wall in walls for name in HOSTS):  # E3, E8
        things = [each for each in loose if called_role(each) in {Role.FURNITURE, Role.LEFT_OUT}]
        called = [e for name in MISNAMED for e in of_type(model, name) if called_role(e) is Role.WALL]  # E9
        walls, loose = walls + called + [each for each in loose if each not in things], []
    named = {each.id() for each in walls}
    spaces = of_type(model, "IfcSpace")
    return ElementsByKind(
        walls=walls,
        loose=loose,
        beams=[beam for beam in of_type(model, "IfcBeam") if beam.id() not in named],
        slabs=[slab for slab in of_type(model, "IfcSlab") if not _is_roof(slab) and slab.id() not in named],
        roofs=_roofs(model),
        spaces=_rooms([space for space in spaces if not _is_external(space)]),
        outdoors=[space for space in spaces if _is_external(space)],
        openings=[each for each in of_type(model, "IfcOpeningElement") if any(map(_is_host, opening_hosts(each)))],
        doors=of_type(model, "IfcDoor"),
        furniture=things + [e for name in FURNITURE for e in of_type(model, name) if e.id() not in named],
        stairs=[e for name in STAIRS for e in of_type(model, name)]
        + [slab for slab in of_type(model, "IfcSlab") if _is_landing(slab)],
    )


def element_words(element: Any) -> tuple[str, ...]:
    """Return the element's own words: its long name, its name, its type's, without repetition."""
    words = (getattr(element, name, None) for name in ("LongName", "Name", "ObjectType"))
    return tuple(dict.fromkeys(word.strip() for word in words if isinstance(word, str) and word.strip()))


def called_role(element: Any) -> Role | None:
    """Return what an element's own words say that it is (E8)."""
    found = (role_from_name(word) for word in element_words(element))
    return next((named.role for named in found if named), None)


def is_called_door(element: Any) -> bool:
    """E8."""
    return any(element.is_a(name) for name in CALLED) and called_role(element) is Role.DOOR


def opening_hosts(opening: Any) -> list[Any]:
    """Return what an opening is a hole in."""
    return [each.RelatingBuildingElement for each in opening.VoidsElements if each.RelatingBuildingElement]


def opening_fillings(opening: Any) -> list[Any]:
    """Return what stands in an opening."""
    return [each.RelatedBuildingElement for each in opening.HasFillings if each.RelatedBuildingElement]


def find_parent(element: Any, kind: str) -> Any:
    """The nearest thing of a class that holds an element, has it as a part or has the hole that it fills, or None."""
    return next((each for each in _holders(element) if each is not None and each.is_a(kind)), None)


def has_parent_cycle(element: Any) -> bool:
    """Return whether an element holds itself, directly or not: in such a damaged file native code never ends."""
    return next((True for each in _holders(element) if each is None), False)


def _holders(element: Any) -> Iterator[Any]:
    """Yield the element, its holder, the holder's holder and so on; None at the end if they form a circle."""
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


def of_type(model: Any, name: str) -> list[Any]:
    """Return the instances of a class; none where the file's schema does not have it."""
    try:
        return list(model.by_type(name))
    except RuntimeError:  # a class that this file's schema does not have
        return []


def containers(element: Any) -> Iterator[Any]:
    """Yield what an element is a part of, from near to far; a file may go round in circles."""
    seen = {element.id()}
    while element is not None:
        relations = getattr(element, "Decomposes", None) or ()
        element = next((each.RelatingObject for each in relations if hasattr(each, "RelatingObject")), None)
        if element is None or element.id() in seen:
            return
        seen.add(element.id())
        yield element


def members(element: Any, seen: frozenset[int] = frozenset()) -> Iterator[Any]:
    """Yield the parts of an element at all depths."""
    for relation in getattr(element, "IsDecomposedBy", None) or ():
        for part in relation.RelatedObjects or ():
            if part.id() not in seen:
                yield part
                yield from members(part, seen | {part.id()})


def _walls(model: Any) -> list[Any]:
    """E1, E2."""
    found = {each.id(): each for name in WALLS for each in of_type(model, name) if not _is_in_roof(each)}
    for whole in list(found.values()):
        if whole.is_a("IfcCurtainWall") or (whole.is_a("IfcWall") and not has_body(whole)):
            parts = (part for part in members(whole) if part.is_a("IfcElement") and not part.is_a("IfcDoor"))
            found |= {part.id(): part for part in parts}
    return list(found.values())


def has_body(element: Any) -> bool:
    """Return whether an element is drawn by more than lines, areas and boxes for plans (E2)."""
    shape = element.Representation
    drawn = [each.RepresentationIdentifier for each in shape.Representations or ()] if shape else []
    return any(identifier not in FLAT for identifier in drawn)


def _is_in_roof(element: Any) -> bool:
    """Return whether a window lies in a roof or a slab."""
    openings = [each.RelatingOpeningElement for each in getattr(element, "FillsVoids", None) or ()]
    wholes = [*containers(element), *(host for opening in openings for host in opening_hosts(opening))]
    return element.is_a("IfcWindow") and any(_lies_over_rooms(whole) for whole in wholes)


def _lies_over_rooms(whole: Any) -> bool:
    """E1; a covering without a stated purpose may be the outer leaf of a wall."""
    if whole.is_a("IfcCovering"):
        return whole.PredefinedType in {"ROOFING", "CEILING"}
    return any(whole.is_a(name) for name in COVERS)


def _may_be_wall(element: Any) -> bool:
    """E3: return the loose parts; parts of slabs and roofs are never loose, whatever their shape."""
    if any(whole.is_a(name) for whole in containers(element) for name in COVERS):
        return False
    return not any(NO_BUILDING.search(word) for word in element_words(element))


def _is_host(element: Any) -> bool:
    """E4."""
    return any(each.is_a(name) for each in (element, *containers(element)) for name in HOSTS) or (
        any(element.is_a(name) for name in LOOSE)
    )


def _is_roof(slab: Any) -> bool:
    return slab.PredefinedType == "ROOF" or any(whole.is_a("IfcRoof") for whole in containers(slab))


def _is_landing(slab: Any) -> bool:
    return slab.PredefinedType == "LANDING" or any(whole.is_a("IfcStair") for whole in containers(slab))


def _roofs(model: Any) -> list[Any]:
    """E6."""
    wholes = [*of_type(model, "IfcRoof"), *(slab for slab in of_type(model, "IfcSlab") if _is_roof(slab))]
    parts = (part for whole in wholes for part in (whole, *members(whole)) if part.is_a("IfcElement"))
    return list({part.id(): part for part in parts}.values())


def _rooms(spaces: list[Any]) -> list[Any]:
    """E5."""
    bodied = {space.id() for space in spaces if space.Representation}
    return [space for space in spaces if _is_room(space, bodied)]


def _is_room(space: Any, bodied: set[int]) -> bool:
    if getattr(space, "PredefinedType", None) == AREA:
        return False
    if space.CompositionType == "PARTIAL":
        return not any(whole.id() in bodied for whole in containers(space))
    if space.CompositionType == "COMPLEX":
        return not any(part.id() in bodied for part in members(space))
    return True


def _is_external(space: Any) -> bool:
    """E5."""
    if EXTERNAL in {getattr(space, name, None) for name in ("PredefinedType", "InteriorOrExteriorSpace")}:
        return True
    sets = (getattr(each, "RelatingPropertyDefinition", None) for each in space.IsDefinedBy or ())
    properties = (each for found in sets for each in getattr(found, "HasProperties", None) or ())
    said = (getattr(each, "NominalValue", None) for each in properties if each.Name == "IsExternal")
    return any(value is not None and value.wrappedValue is True for value in said)
