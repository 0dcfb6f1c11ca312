"""Kind ``ifc``: IFC2X3 and IFC4 files of one to three storeys, with what surrounds a house.

R1  Walls carry their openings; doors and windows fill them, some openings have none; spaces in most files.
R2  Slabs touch the door heads now and then; some floors lie on a build-up above the storey's elevation.
R3  Round the house: a veranda on posts, a garage roof with a parapet that no door leads to, a terrace slab, terrain.
R4  Stairs with a flight, a void above and a landing; a flat or a sloped roof, in a storey of its own or not.
"""

from __future__ import annotations

import math
import uuid
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.guid
import numpy as np
import shapely
import trimesh
from numpy.random import Generator
from shapely import Polygon, box

from tests.builders.kinds.homes import Style, random_storeys
from tests.builders.kinds.parts.joinery import frame, leaf_area, window
from tests.builders.kinds.parts.slabs import flight, pitched_roof
from tests.builders.kinds.parts.solids3d import joined, polygons, prism, rings
from tests.builders.kinds.parts.wall_bodies import runs
from tests.builders.kinds.placing import Placing, truth_of
from tests.builders.kinds.values import Leaf, Member, Opening, Storey

PREFIXES = {1.0: None, 0.001: "MILLI", 0.01: "CENTI"}


class IfcBuilding:
    """Adds storeys and elements; lengths are given in metres and written in ``unit_m`` metres.

    The site stands at ``shift``, turned by ``turn_rad``; all else is given in the house's frame.
    """

    def __init__(self, rng: Generator, schema: str, unit_m: float, turn_rad: float, shift: Sequence[float]) -> None:
        self.model = ifcopenshell.file(schema=schema)
        self.rng, self.unit_m = rng, unit_m
        units = [self.model.createIfcSIUnit(None, "LENGTHUNIT", PREFIXES[unit_m], "METRE")]
        units.append(self.model.createIfcSIUnit(None, "AREAUNIT", None, "SQUARE_METRE"))
        units.append(self.model.createIfcSIUnit(None, "PLANEANGLEUNIT", None, "RADIAN"))
        world = self._axes((0.0, 0.0, 0.0))
        self.context = self.model.createIfcGeometricRepresentationContext(None, "Model", 3, 1e-5, world, None)
        project = self._root("IfcProject", "Project")
        project.RepresentationContexts, project.UnitsInContext = (
            [self.context],
            self.model.createIfcUnitAssignment(units),
        )
        site, self.building = self._root("IfcSite", "Site"), self._root("IfcBuilding", "Building")
        turned = self._axes(shift, (math.cos(turn_rad), math.sin(turn_rad), 0.0))
        site.ObjectPlacement = self.model.createIfcLocalPlacement(None, turned)
        self.building.ObjectPlacement = self.model.createIfcLocalPlacement(site.ObjectPlacement, self._axes((0, 0, 0)))
        self._aggregate(project, [site])
        self._aggregate(site, [self.building])

    def storey(self, name: str, elevation: float) -> Any:
        """Add a storey."""
        made = self._root("IfcBuildingStorey", name)
        made.Elevation = elevation / self.unit_m
        made.ObjectPlacement = self._placement(self.building, (0.0, 0.0, elevation))
        self._aggregate(self.building, [made])
        return made

    def outline(
        self, kind: str, storey: Any, area: Polygon, low: float, high: float, name: str = "", **more: Any
    ) -> Any:
        """Add an element that is an outline drawn up from ``low`` to ``high`` above the storey."""
        made = self._element(kind, storey, name, **more)
        made.Representation = self._shape("SweptSolid", [self._extrusion(area, low, high)])
        return made

    def triangles(self, kind: str, storey: Any, mesh: trimesh.Trimesh, name: str = "", **more: Any) -> Any:
        """Add an element of triangles (heights above the storey)."""
        made = self._element(kind, storey, name, **more)
        points = [self._point(p) for p in mesh.vertices]
        faces = []
        for corners in np.asarray(mesh.faces):
            loop = self.model.createIfcPolyLoop([points[int(k)] for k in corners])
            faces.append(self.model.createIfcFace([self.model.createIfcFaceOuterBound(loop, True)]))
        brep = self.model.createIfcFacetedBrep(self.model.createIfcClosedShell(faces))
        made.Representation = self._shape("Brep", [brep])
        return made

    def space(self, storey: Any, area: Polygon, high: float, number: str, name: str, floor: float = 0.0) -> Any:
        """Add a room: ``number`` as its Name, ``name`` as its LongName."""
        made = self._root("IfcSpace", number)
        made.LongName = name
        made.ObjectPlacement = self._placement(storey, (0.0, 0.0, 0.0))
        made.Representation = self._shape("SweptSolid", [self._extrusion(area, floor, high)])
        self._aggregate(storey, [made])
        return made

    def hole(self, wall: Any, storey: Any, area: Polygon, low: float, high: float) -> Any:
        """Cut an opening into a wall."""
        made = self._root("IfcOpeningElement", "Opening")
        made.ObjectPlacement = self._placement(storey, (0.0, 0.0, 0.0))
        made.Representation = self._shape("SweptSolid", [self._extrusion(area, low, high)])
        self.model.createIfcRelVoidsElement(self._guid(), None, None, None, wall, made)
        return made

    def fill(self, opening: Any, filling: Any) -> None:
        """Put a door or a window into an opening."""
        self.model.createIfcRelFillsElement(self._guid(), None, None, None, opening, filling)

    def write(self, path: Path) -> Path:
        """Write the file."""
        self.model.header.file_name.time_stamp = "2020-01-01T00:00:00"  # the same bytes each time
        self.model.write(str(path))
        return path

    def _element(self, kind: str, storey: Any, name: str, **more: Any) -> Any:
        made = self._root(kind, name)
        made.ObjectPlacement = self._placement(storey, (0.0, 0.0, 0.0))
        for key, value in more.items():
            setattr(made, key, value)
        self.model.createIfcRelContainedInSpatialStructure(self._guid(), None, None, None, [made], storey)
        return made

    def _root(self, kind: str, name: str) -> Any:
        return self.model.create_entity(kind, GlobalId=self._guid(), Name=name)

    def _guid(self) -> str:
        return str(ifcopenshell.guid.compress(uuid.UUID(bytes=self.rng.bytes(16)).hex))

    def _aggregate(self, whole: Any, parts: list[Any]) -> None:
        self.model.createIfcRelAggregates(self._guid(), None, None, None, whole, parts)

    def _point(self, coordinates: Sequence[float] | np.ndarray) -> Any:
        return self.model.createIfcCartesianPoint([float(v) / self.unit_m for v in coordinates])

    def _placement(self, of: Any, at: Sequence[float]) -> Any:
        return self.model.createIfcLocalPlacement(of.ObjectPlacement, self._axes(at))

    def _axes(self, at: Sequence[float], x: Sequence[float] | None = None) -> Any:
        up = self.model.createIfcDirection([0.0, 0.0, 1.0]) if x else None
        return self.model.createIfcAxis2Placement3D(
            self._point(at), up, self.model.createIfcDirection(x) if x else None
        )

    def _extrusion(self, area: Polygon, low: float, high: float) -> Any:
        loops = [self.model.createIfcPolyline([self._point(p) for p in [*ring, ring[0]]]) for ring in rings(area)]
        if len(loops) > 1:
            profile = self.model.createIfcArbitraryProfileDefWithVoids("AREA", None, loops[0], loops[1:])
        else:
            profile = self.model.createIfcArbitraryClosedProfileDef("AREA", None, loops[0])
        up = self.model.createIfcDirection([0.0, 0.0, 1.0])
        return self.model.createIfcExtrudedAreaSolid(profile, self._axes((0, 0, low)), up, (high - low) / self.unit_m)

    def _shape(self, sort: str, items: list[Any]) -> Any:
        shape = self.model.createIfcShapeRepresentation(self.context, "Body", sort, items)
        return self.model.createIfcProductDefinitionShape(None, None, [shape])


NAMES = {
    "english": ("Ground Floor", "First Floor", "Second Floor"),
    "german": ("Erdgeschoss", "1. Obergeschoss", "2. Obergeschoss"),
    "numbers": ("Level 1", "Level 2", "Level 3"),
}
LABELS = {
    "german": {
        "Living_Room": "Wohnzimmer", "Kitchen": "Küche", "Bedroom": "Schlafzimmer", "Bathroom": "Bad", "Toilet": "WC",
        "Corridor": "Flur", "Hallway": "Flur", "Hall": "Diele", "Office": "Büro", "Storage": "Abstellraum",
        "Child_Room": "Kinderzimmer", "Stair": "Treppenhaus", "Garage": "Garage", "Wardrobe": "Ankleide",
        "Entryway": "Windfang", "Lobby": "Diele", "Dining_Room": "Esszimmer", "Guest_Room": "Gast",
    },
}  # fmt: skip


@dataclass(frozen=True)
class Building:
    """What is the same for all storeys of a file."""

    ifc: IfcBuilding
    slab: float
    buildup: float
    spaces: bool
    words: dict[str, str]


def make(rng: Generator, folder: Path, name: str) -> Member:
    """Write one file into a folder."""
    count = int(rng.choice([1, 1, 2, 2, 3]))
    storeys = random_storeys(rng, Style(height_m=(2.4, 3.0)), count)
    touching = bool(rng.random() < 0.2)
    if touching:  # R2
        storeys = [heads_at_ceiling(s) for s in storeys]
    language = str(rng.choice(list(NAMES)))
    labels = LABELS.get(language, {})
    storeys = [relabelled(s, labels) for s in storeys]
    turn = 0.0 if rng.random() < 0.6 else float(rng.uniform(0, 2 * math.pi))
    far = 3000.0 if rng.random() < 0.15 else 20.0
    shift = (float(rng.uniform(-far, far)), float(rng.uniform(-far, far)), float(rng.choice([0.0, 0.0, 12.5])))
    schema, unit = str(rng.choice(["IFC2X3", "IFC4"])), float(rng.choice([1.0, 0.001, 0.001]))
    house = Building(IfcBuilding(rng, schema, unit, turn, shift), round(float(rng.uniform(0.3, 0.42)), 2),
                     float(rng.choice([0.0, 0.0, 0.0, 0.12, 0.2])), bool(rng.random() < 0.7), labels)  # fmt: skip
    placing, z, truths, entities = Placing(turn, shift, "z", 1.0), 0.0, [], []
    for level, storey in enumerate(storeys):
        entity = house.ifc.storey(NAMES[language][level], z - house.buildup)
        entities.append(entity)
        fill_storey(house, entity, storey, storeys[level - 1] if level else None, rng)
        truth = truth_of(storey, placing, "ifc", f"{name}_{level}", z)
        truths.append(truth | ({"labelled": True, "zones": None} if house.spaces else {}))
        z += storey.height + house.slab
    extras = outside(house, entities, storeys, rng)
    extras += top(house, entities[-1], storeys[-1], z, rng)
    path = house.ifc.write(folder / f"{name}.ifc")
    about = f"{count} storeys, {schema}, unit {unit:g} m, spaces {house.spaces}, build-up {house.buildup}, "
    about += f"heads at ceiling {touching}, {', '.join(extras) or 'nothing round it'}"
    return Member(path, tuple(truths), about, "z", 1.0)


def heads_at_ceiling(storey: Storey) -> Storey:
    """R2: the same storey no higher than its door heads."""
    head = max(o.head for o in storey.openings if o.kind in {"door", "opening", "entrance"})
    made = [replace(o, head=min(o.head, head)) for o in storey.openings]
    made = [replace(o, head=head) if o.kind != "window" else o for o in made]
    return replace(storey, height=head, openings=tuple(made))


def relabelled(storey: Storey, words: dict[str, str]) -> Storey:
    """Rooms in the file's language, numbered where several share a name."""
    seen: dict[str, int] = {}
    cells = []
    for cell in storey.cells:
        label = words.get(cell.label, cell.label.replace("_", " "))
        seen[label] = seen.get(label, 0) + 1
        cells.append(replace(cell, label=label if seen[label] == 1 else f"{label} {seen[label]}"))
    return replace(storey, cells=tuple(cells))


def fill_storey(house: Building, entity: Any, storey: Storey, below: Storey | None, rng: Generator) -> None:
    """Walls with their openings, the slab, spaces, and the stair from below."""
    lift, ifc = house.buildup, house.ifc
    kind = "IfcWallStandardCase" if rng.random() < 0.6 else "IfcWall"
    filled = rng.random() < 0.9
    for run, openings, before, after in runs(storey):
        body = run.strip(-before, run.length + after)
        wall = ifc.outline(kind, entity, body, 0.0, lift + storey.height, "Wand" if house.words else "Basic Wall")
        for o in openings:
            area = run.strip(o.start, o.end, run.thickness + 0.04)
            hole = ifc.hole(wall, entity, area, lift + o.sill, lift + min(o.head, storey.height) + 1e-4)
            if o.kind != "opening" and (filled or o.kind == "door"):
                fill_opening(house, entity, storey, hole, run, o, lift)
    for pillar in storey.pillars:
        ifc.outline("IfcColumn", entity, pillar, 0.0, lift + storey.height, "Column")
    void = [c.polygon for c in storey.cells if not c.floor]
    area = (
        storey.footprint.difference(shapely.union_all(void).difference(storey.wall_area)) if void else storey.footprint
    )
    for piece in polygons(area):
        ifc.outline(
            "IfcSlab", entity, piece, lift - house.slab if below else -0.3, 0.0, "Floor", PredefinedType="FLOOR"
        )
        if lift:
            inside = shapely.union_all([r for r, c in zip(storey.rooms, storey.cells, strict=True) if c.floor])
            for room in polygons(inside):
                ifc.outline(
                    "IfcSlab" if ifc.model.schema == "IFC2X3" else "IfcCovering", entity, room, 0.0, lift, "Screed"
                )
    if house.spaces:
        for k, (room, cell) in enumerate(zip(storey.rooms, storey.cells, strict=True)):
            if cell.floor:
                ifc.space(entity, room, lift + storey.height, f"{k + 1:03d}", cell.label, lift)
    if below is not None:
        rise = below.height + house.slab
        steps = joined(flight(replace(storey, cells=tuple(plain(c, house.words) for c in storey.cells)), rise))
        steps.apply_translation((0, 0, lift - rise))
        ifc.triangles("IfcStairFlight", entity, steps, "Stair")


def plain(cell: Any, words: dict[str, str]) -> Any:
    """A stair's cell under the name that the stair's builder looks for."""
    return replace(cell, label="Stair") if cell.label == words.get("Stair", "Stair") else cell


def fill_opening(house: Building, entity: Any, storey: Storey, hole: Any, run: Any, o: Opening, lift: float) -> None:
    """R1: a door leaf in its frame, or a window."""
    size = {"OverallHeight": (o.head - o.sill) / house.ifc.unit_m, "OverallWidth": o.width / house.ifc.unit_m}
    if o.kind in {"window", "french"}:
        mesh, kind = window(run, o), "IfcWindow" if o.kind == "window" else "IfcDoor"
    else:
        leaves = [prism(leaf_area(run, replace(o, leaves=(Leaf(),)), Leaf(), 0.0, 0.04), 0.0, o.head - 0.045)]
        mesh, kind = joined([frame(run, o, 0.04, False), *leaves]), "IfcDoor"
    mesh.apply_translation((0, 0, lift))
    house.ifc.fill(
        hole, house.ifc.triangles(kind, entity, mesh, "Tür" if kind == "IfcDoor" and house.words else kind[3:], **size)
    )


def outside(house: Building, entities: list[Any], storeys: list[Storey], rng: Generator) -> list[str]:
    """R3."""
    made, ifc, base = [], house.ifc, storeys[0]
    x1, y1, x2, _ = base.footprint.bounds
    lift = house.buildup
    if rng.random() < 0.35:
        deep = float(rng.uniform(1.8, 3.0))
        area = box(x1, y1 - deep, x2, y1 - 0.001)
        ifc.outline("IfcSlab", entities[0], area, lift - 0.25, lift - 0.05, "Veranda", PredefinedType="FLOOR")
        for x in np.linspace(x1 + 0.2, x2 - 0.2, 4):
            ifc.outline("IfcColumn", entities[0], box(x - 0.1, y1 - deep, x + 0.1, y1 - deep + 0.2), lift - 0.05,
                        lift + base.height - 0.2, "Post")  # fmt: skip
        roof = box(x1 - 0.2, y1 - deep - 0.2, x2 + 0.2, y1 - 0.001)
        ifc.outline(
            "IfcSlab", entities[0], roof, lift + base.height - 0.2, lift + base.height, "Roof", PredefinedType="ROOF"
        )
        made.append("veranda")
    level = min(1, len(entities) - 1)
    if rng.random() < 0.35 and garage_roof(house, entities[level], storeys[level], rng, level > 0):
        made.append("garage roof" if level else "yard")
    if rng.random() < 0.25:
        area = base.footprint.buffer(6.0, join_style="mitre")
        ifc.outline("IfcBuildingElementProxy", entities[0], area.envelope, -0.6, -0.5, "Terrain")
        made.append("terrain")
    return made


def garage_roof(house: Building, entity: Any, storey: Storey, rng: Generator, upper: bool) -> bool:
    """A roof terrace beside an upper storey, or a yard beside the only one, with a parapet of 0.9 to 1.1 m round it.

    None is made where a door leads there: it would be a balcony, and a room.
    """
    _, y1, x2, y2 = storey.footprint.bounds
    wide, high = float(rng.uniform(2.8, 4.5)), float(rng.uniform(0.9, 1.1))
    y2 = min(y2, y1 + float(rng.uniform(4.0, 7.0)))
    area, low = box(x2 + 0.001, y1, x2 + wide, y2), house.buildup
    if any(o.sill < 0.3 and storey.gap(o, 0.3).intersects(area) for o in storey.openings):
        return False
    kind = "ROOF" if upper else "FLOOR"
    house.ifc.outline("IfcSlab", entity, area, low - house.slab, low, "Garage roof", PredefinedType=kind)
    inner = box(x2 - 1, y1 + 0.15, x2 + wide - 0.15, y2 - 0.15)
    for piece in polygons(area.difference(inner)):
        house.ifc.outline("IfcWall", entity, piece, low, low + high, "Parapet")
    return True


def top(house: Building, entity: Any, storey: Storey, z: float, rng: Generator) -> list[str]:
    """R4: nothing, a flat roof with a parapet, or a sloped roof over a void."""
    pick, lift = rng.random(), house.buildup
    high = lift + storey.height
    if pick < 0.25:
        return []
    own = house.ifc.storey("Roof", z - house.buildup) if rng.random() < 0.5 else None
    at, base = (own, lift - house.slab) if own is not None else (entity, high)
    for piece in polygons(storey.footprint):
        house.ifc.outline(
            "IfcSlab", at, piece, base, base + house.slab, "Roof", PredefinedType="ROOF" if pick < 0.6 else "FLOOR"
        )
    if pick < 0.6:
        rim = storey.footprint.difference(storey.footprint.buffer(-0.2, join_style="mitre"))
        for piece in polygons(rim):
            house.ifc.outline("IfcWall", at, Polygon(piece), base + house.slab, base + house.slab + 0.6, "Parapet")
        return ["flat roof with parapet" + (" in a storey of its own" if own is not None else "")]
    roof = pitched_roof(storey, base + house.slab, rng)
    house.ifc.triangles("IfcSlab", at, roof, "Roof", PredefinedType="ROOF")
    return ["sloped roof" + (" in a storey of its own" if own is not None else "")]
