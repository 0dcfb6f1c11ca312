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
        self.building = self._root("IfcBuilding", "House")
        self._aggregate(project, [self.building])

    def storey(self, name: str, elevation: float) -> Any:
        """Add a storey."""
        storey = self._root("IfcBuildingStorey", name, elevation)
        storey.Elevation = elevation / self.unit_m
        self._aggregate(self.building, [storey])
        return storey

    def element(self, kind: str, storey: Any, box: Box, name: str = "") -> Any:
        """Add a box-shaped element to a storey."""
        element = self._root(kind, name)
        element.Representation = self._body(box)
        self.model.createIfcRelContainedInSpatialStructure(ifcopenshell.guid.new(), None, None, None, [element], storey)
        return element

    def space(self, storey: Any, box: Box, number: str, name: str) -> Any:
        """Add a room: ``number`` as its Name, ``name`` as its LongName."""
        space = self._root("IfcSpace", number)
        space.LongName = name
        space.Representation = self._body(box)
        self._aggregate(storey, [space])
        return space

    def opening(self, wall: Any, box: Box, filling: str | None) -> None:
        """Cut a hole into a wall and fill it with an IfcDoor, an IfcWindow or nothing."""
        opening = self._root("IfcOpeningElement", "hole")
        opening.Representation = self._body(box)
        self.model.createIfcRelVoidsElement(ifcopenshell.guid.new(), None, None, None, wall, opening)
        if filling:
            leaf = self._root(filling, "leaf")
            x1, y1, z1, x2, y2, z2 = box
            thin = (y1 + y2) / 2 if x2 - x1 > y2 - y1 else (x1 + x2) / 2
            flat = (x1, thin - 0.02, z1, x2, thin + 0.02, z2)
            leaf.Representation = self._body(flat if x2 - x1 > y2 - y1 else (thin - 0.02, y1, z1, thin + 0.02, y2, z2))
            self.model.createIfcRelFillsElement(ifcopenshell.guid.new(), None, None, None, opening, leaf)

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
