"""An IFC building of extruded outlines and triangles, in any schema and unit, as CAD programs export it."""

from __future__ import annotations

import math
import uuid
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.guid
import numpy as np
import trimesh
from numpy.random import Generator
from shapely import Polygon

from tests.builders.kinds.parts.solids3d import rings

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
