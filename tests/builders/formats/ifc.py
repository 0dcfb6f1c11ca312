"""A tiny IFC building of extruded boxes, in any unit and schema, whose storeys, rooms and doors are known."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.guid

Box = tuple[float, float, float, float, float, float]
"""x1, y1, z1, x2, y2, z2 in metres."""


class TinyBuilding:
    """Adds boxes as elements; lengths are given in metres and written in ``unit_m`` metres."""

    def __init__(self, schema: str = "IFC4", unit_m: float = 1.0) -> None:
        self.model = ifcopenshell.file(schema=schema)
        self.unit_m = unit_m
        prefix = {1.0: None, 0.001: "MILLI", 0.01: "CENTI"}[unit_m]
        unit = self.model.createIfcSIUnit(UnitType="LENGTHUNIT", Prefix=prefix, Name="METRE")
        self.context = self.model.createIfcGeometricRepresentationContext(
            ContextType="Model",
            CoordinateSpaceDimension=3,
            Precision=1e-5,
            WorldCoordinateSystem=self._axes(0.0, 0.0, 0.0),
        )
        project = self._root("IfcProject", "Tiny")
        project.UnitsInContext = self.model.createIfcUnitAssignment([unit])
        project.RepresentationContexts = [self.context]
        self.project = project
        self.building = self.add_building("House")

    def add_building(self, name: str) -> Any:
        """Add a building to the project."""
        building = self._root("IfcBuilding", name)
        self._aggregate(self.project, [building])
        return building

    def storey(self, name: str, elevation: float, building: Any = None) -> Any:
        """Add a storey to a building, the first one where none is given."""
        storey = self._root("IfcBuildingStorey", name, elevation)
        storey.Elevation = elevation / self.unit_m
        self._aggregate(building or self.building, [storey])
        return storey

    def element(self, kind: str, storey: Any, box: Box | None, name: str = "", **attributes: Any) -> Any:
        """Add a box-shaped element to a storey; without a storey, or without a body, where those are None."""
        element = self._root(kind, name)
        for attribute, value in attributes.items():
            setattr(element, attribute, value)
        if box is not None:
            element.Representation = self._body(box)
        if storey is not None:
            guid = ifcopenshell.guid.new()
            self.model.createIfcRelContainedInSpatialStructure(guid, None, None, None, [element], storey)
        return element

    def walls_around(self, storey: Any, box: Box, thick: float = 0.2) -> list[Any]:
        """Add the four outer walls of a box, within it: south, east, north, west."""
        x1, y1, z1, x2, y2, z2 = box
        t = thick
        sides = ((x1, y1, x2, y1 + t), (x2 - t, y1 + t, x2, y2), (x1, y2 - t, x2 - t, y2), (x1, y1 + t, x1 + t, y2 - t))
        return [self.element("IfcWall", storey, (a, b, z1, c, d, z2), "outer") for a, b, c, d in sides]

    def part_of(self, whole: Any, *parts: Any) -> None:
        """Make elements the parts of another."""
        self._aggregate(whole, list(parts))

    def turned(self, element: Any, at: tuple[float, float, float], direction: tuple[float, float]) -> Any:
        """Place an element anew: its origin, and where its x axis points in plan."""
        axes = self.model.createIfcAxis2Placement3D(
            self._point(*at),
            self.model.createIfcDirection([0.0, 0.0, 1.0]),
            self.model.createIfcDirection([*direction, 0.0]),
        )
        element.ObjectPlacement = self.model.createIfcLocalPlacement(None, axes)
        return element

    def space(self, storey: Any, box: Box, number: str, name: str, **attributes: Any) -> Any:
        """Add a room: ``number`` as its Name, ``name`` as its LongName; under no storey where that is None."""
        space = self._root("IfcSpace", number)
        space.LongName = name
        for attribute, value in attributes.items():
            setattr(space, attribute, value)
        space.Representation = self._body(box)
        if storey is not None:
            self._aggregate(storey, [space])
        return space

    def property_of(self, element: Any, group: str, **values: bool) -> None:
        """Give an element properties, in a set of this name."""
        single = self.model.createIfcPropertySingleValue
        found = [single(name, None, self.model.createIfcBoolean(value), None) for name, value in values.items()]
        known = self.model.createIfcPropertySet(ifcopenshell.guid.new(), None, group, None, found)
        self.model.createIfcRelDefinesByProperties(ifcopenshell.guid.new(), None, None, None, [element], known)

    def opening(self, wall: Any, box: Box, filling: str | None) -> Any:
        """Cut a hole into a wall and fill it with an IfcDoor, an IfcWindow or nothing; return what fills it."""
        opening = self._root("IfcOpeningElement", "hole")
        opening.Representation = self._body(box)
        self.model.createIfcRelVoidsElement(ifcopenshell.guid.new(), None, None, None, wall, opening)
        if not filling:
            return None
        leaf = self._root(filling, "leaf")
        x1, y1, z1, x2, y2, z2 = box
        if x2 - x1 > y2 - y1:
            y1, y2 = (y1 + y2) / 2 - 0.02, (y1 + y2) / 2 + 0.02
        else:
            x1, x2 = (x1 + x2) / 2 - 0.02, (x1 + x2) / 2 + 0.02
        leaf.Representation = self._body((x1, y1, z1, x2, y2, z2))
        self.model.createIfcRelFillsElement(ifcopenshell.guid.new(), None, None, None, opening, leaf)
        return leaf

    def write(self, path: Path) -> Path:
        """Write the file."""
        self.model.write(str(path))
        return path

    def _root(self, kind: str, name: str, height: float = 0.0) -> Any:
        entity = self.model.create_entity(kind, GlobalId=ifcopenshell.guid.new(), Name=name)
        if hasattr(entity, "ObjectPlacement"):
            entity.ObjectPlacement = self.model.createIfcLocalPlacement(None, self._axes(0.0, 0.0, height))
        return entity

    def _aggregate(self, whole: Any, parts: list[Any]) -> None:
        self.model.createIfcRelAggregates(ifcopenshell.guid.new(), None, None, None, whole, parts)

    def _point(self, *coordinates: float) -> Any:
        return self.model.createIfcCartesianPoint([value / self.unit_m for value in coordinates])

    def _axes(self, x: float, y: float, z: float) -> Any:
        return self.model.createIfcAxis2Placement3D(self._point(x, y, z))

    def _body(self, box: Box) -> Any:
        x1, y1, z1, x2, y2, z2 = box
        profile = self.model.createIfcRectangleProfileDef(
            "AREA",
            None,
            self.model.createIfcAxis2Placement2D(self._point((x1 + x2) / 2, (y1 + y2) / 2)),
            (x2 - x1) / self.unit_m,
            (y2 - y1) / self.unit_m,
        )
        up = self.model.createIfcDirection([0.0, 0.0, 1.0])
        solid = self.model.createIfcExtrudedAreaSolid(profile, self._axes(0, 0, z1), up, (z2 - z1) / self.unit_m)
        shape = self.model.createIfcShapeRepresentation(self.context, "Body", "SweptSolid", [solid])
        return self.model.createIfcProductDefinitionShape(None, None, [shape])


def tiny_house(schema: str = "IFC4", unit_m: float = 1.0, shift: tuple[float, float] = (0.0, 0.0)) -> TinyBuilding:
    """Two rooms of 3.8 x 5.6 m a storey on floors at 0.0 and 2.8 m, over a crawl space and under a roof storey.

    The outer walls are one piece over both storeys, contained in the lower one. The inner wall has a door and, in the
    upper storey, a hole without one.
    """
    house = TinyBuilding(schema, unit_m)
    dx, dy = shift

    def at(*box: float) -> Box:
        x1, y1, z1, x2, y2, z2 = box
        return x1 + dx, y1 + dy, z1, x2 + dx, y2 + dy, z2

    cellar, ground, upper, roof = (
        house.storey(name, z) for name, z in (("Fundament", -1.0), ("EG", 0.0), ("OG", 2.8), ("Dach", 5.6))
    )
    house.element("IfcWall", cellar, at(0, 0, -1, 8, 0.2, -0.3), "footing")
    outer = ((0, 0, 8, 0.2), (7.8, 0.2, 8, 6), (0, 5.8, 7.8, 6), (0, 0.2, 0.2, 5.8))
    shells = [house.element("IfcWall", ground, at(x1, y1, 0, x2, y2, 5.3), "outer") for x1, y1, x2, y2 in outer]
    house.opening(shells[0], at(1, -0.1, 0, 2, 0.3, 2.1), "IfcDoor")
    house.opening(shells[0], at(5, -0.1, 0.9, 7, 0.3, 2.1), "IfcWindow")
    for storey, z, filling in ((ground, 0.0, "IfcDoor"), (upper, 2.8, None)):
        inner = house.element("IfcWall", storey, at(4, 0.2, z, 4.2, 5.8, z + 2.5), "inner")
        house.opening(inner, at(3.9, 2, z, 4.3, 2.9, z + 2.1), filling)
        house.element("IfcSlab", storey, at(0, 0, z - 0.3, 8, 6, z), "slab")
    names = (("Küche", "Wohnen"), ("Schlafzimmer 1", "Galerie"))
    for storey, z, (left, right) in zip((ground, upper), (0.0, 2.8), names, strict=True):
        house.space(storey, at(0.2, 0.2, z, 4.0, 5.8, z + 2.5), "1", left)
        house.space(storey, at(4.2, 0.2, z, 7.8, 5.8, z + 2.5), "2", right)
    house.element("IfcFurnishingElement", ground, at(1, 3, 0, 3, 4, 0.7), "table")
    house.element("IfcRailing", upper, at(5, 3, 2.8, 7, 3.05, 3.8), "railing")
    house.space(roof, at(0, 0, 5.6, 8, 6, 7), "R", "Dach")
    return house
