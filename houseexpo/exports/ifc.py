"""Convert a plan to an IFC 4 building: walls, doors, openings, slabs, furniture, and a space for each room."""

from __future__ import annotations

import math
import uuid
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Unpack

import shapely

from houseexpo.errors import MissingDependencyError, install_command
from houseexpo.exports.encoding import Files, valid_xml_text
from houseexpo.exports.placement import pose_in_export
from houseexpo.exports.plan_bodies import BodyOptions, PlanBodies, WallOpening, plan_bodies, wall_openings
from houseexpo.exports.storeys import FLOOR_M, RISER_M, PlacedStorey, stack_storeys
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.raster import all_rings
from houseexpo.plan import Room
from houseexpo.plan.room_labels import UNLABELLED
from houseexpo.tolerances import CRUMB_M2, SAME_M2, WELD_M

if TYPE_CHECKING:
    from shapely import Polygon
    from shapely.geometry.base import BaseGeometry

_NAMES: Final = uuid.UUID("6f6d6a0e-9a0f-5d3e-8d0b-2f5c1a9e7b44")
_DOOR_LEAF_M: Final = 0.04
_TIME: Final = "1970-01-01T00:00:00"  # a fixed time, so that a plan always gives the same file


def ifc(plan: FloorPlan, **options: Unpack[BodyOptions]) -> Files:
    """Write ``<id>.ifc`` (IFC 4, metres): project, site, building, one storey.

    Each connected piece of wall is an IfcWall and goes on over doors. A passage is an IfcOpeningElement, as deep as
    the wall. Doors and entrances have an IfcDoor in their opening, windows an IfcWindow. Each room is an IfcSpace:
    ``Name`` is its id, ``LongName`` the source's own word or the label, ``ObjectType`` the label. Furniture is
    IfcFurniture. Options are those of ``plan_bodies``.

    Raises
    ------
    MissingDependencyError
        IfcOpenShell is not installed.
    """
    level = 0 if plan.frame is None else plan.frame.level
    pose = pose_in_export(plan, options.get("orientation", "world"), options.get("frame"))
    return _file(plan.id, [(f"Level {level}", PlacedStorey(plan, pose))], options)


def ifc_building(plans: Sequence[FloorPlan], name: str, **options: Unpack[BodyOptions]) -> Files:
    """Write ``<name>.ifc``: one building with a storey for each plan, lowest first, stacked by ``stack_storeys``.

    The name of a storey is the id of its plan. Everything else, and the errors, are as in ``ifc``.
    """
    storeys = stack_storeys(plans, name, options.get("orientation", "world"), options.get("frame"))
    return _file(name, [(each.plan.id, each) for each in storeys], options)


def _file(name: str, storeys: Sequence[tuple[str, PlacedStorey]], options: BodyOptions) -> Files:
    """Write a building of storeys, each with its name."""
    try:
        import ifcopenshell
    except ImportError:
        raise MissingDependencyError(
            f"IFC needs ifcopenshell, which is not installed: {install_command('ifc')}"
        ) from None
    parts = []
    for word, storey in storeys:
        built = plan_bodies(storey.plan, **options)
        parts.append(_Part(word, storey, built, wall_openings(built.plan, built.wall_thickness)))
    writer = _Writer(ifcopenshell.file(schema="IFC4"), ifcopenshell.guid.compress, name)
    writer.write(parts)
    writer.file.header.file_name.time_stamp = _TIME
    return {f"{name}.ifc": writer.file.to_string().encode()}


class _Part(NamedTuple):
    """A storey, its name, and its bodies."""

    name: str
    storey: PlacedStorey
    built: PlanBodies
    doors: Sequence[WallOpening]


class _Writer:
    """One IFC file, to which parts are added."""

    def __init__(self, file: Any, compress: Any, name: str) -> None:
        self.file, self._compress, self._name = file, compress, name
        self._storey = ""
        self._axes = self._here = self._new("IfcAxis2Placement3D", Location=self._point(0.0, 0.0, 0.0))
        context = self._new(
            "IfcGeometricRepresentationContext",
            ContextType="Model",
            CoordinateSpaceDimension=3,
            Precision=1e-5,
            WorldCoordinateSystem=self._axes,
        )
        self._body = self._new(
            "IfcGeometricRepresentationSubContext",
            ContextIdentifier="Body",
            ContextType="Model",
            ParentContext=context,
            TargetView="MODEL_VIEW",
        )
        units = [
            self._new("IfcSIUnit", UnitType=kind, Name=unit)
            for kind, unit in (("LENGTHUNIT", "METRE"), ("AREAUNIT", "SQUARE_METRE"), ("PLANEANGLEUNIT", "RADIAN"))
        ]
        self._project = self._root(
            "IfcProject",
            "project",
            Name=name,
            RepresentationContexts=[context],
            UnitsInContext=self._new("IfcUnitAssignment", Units=units),
        )

    def write(self, parts: Sequence[_Part]) -> None:
        """Add a house to the file."""
        place = self._new("IfcLocalPlacement", RelativePlacement=self._axes)
        site = self._root("IfcSite", "site", Name="Site", ObjectPlacement=place, CompositionType="ELEMENT")
        building = self._root(
            "IfcBuilding", "building", Name=self._name, ObjectPlacement=place, CompositionType="ELEMENT"
        )
        storeys = []
        for number, part in enumerate(parts):
            self._begin(number, part.storey)
            storey = self._root(
                "IfcBuildingStorey",
                "storey",
                Name=part.name,
                ObjectPlacement=place
                if not part.storey.pose
                else self._new("IfcLocalPlacement", RelativePlacement=self._here),
                CompositionType="ELEMENT",
                Elevation=part.storey.pose.z,
            )
            storeys.append(storey)
        self._begin(0, parts[0].storey)
        self._aggregate("in project", self._project, [site])
        self._aggregate("in site", site, [building])
        self._aggregate("in building", building, storeys)
        for number, (part, storey) in enumerate(zip(parts, storeys, strict=True)):
            self._begin(number, part.storey)
            self._fill(storey, part.built, part.doors)

    def _begin(self, number: int, storey: PlacedStorey) -> None:
        """Make a storey the place of the elements that follow."""
        self._storey = f"storey {number}\n" if number else ""
        if not storey.pose:
            self._here = self._axes
            return
        pose = storey.pose
        turn = {}
        if pose.yaw:
            turn["Axis"] = self._new("IfcDirection", DirectionRatios=[0.0, 0.0, 1.0])
            along = [math.cos(pose.yaw), math.sin(pose.yaw), 0.0]
            turn["RefDirection"] = self._new("IfcDirection", DirectionRatios=along)
        at = self._point(pose.x, pose.y, pose.z)
        self._here = self._new("IfcAxis2Placement3D", Location=at, **turn)

    def _fill(self, storey: Any, built: PlanBodies, doors: Sequence[WallOpening]) -> None:
        """Add the bodies of a plan to its storey."""
        spaces = [self._space(room, built) for room in built.plan.rooms]
        if spaces:
            self._aggregate("spaces", storey, spaces)
        elements = [*self._walls(built, doors), self._slab(built)]
        elements += [
            self._element("IfcStair", name, "stairwell", shape, -RISER_M - FLOOR_M, FLOOR_M)
            for name, shape in built.named_wells
        ]
        elements += [
            self._element(
                "IfcFurniture", f"object {thing.id}", valid_xml_text(thing.label), thing.polygon, 0.0, thing.height
            )
            for thing in built.furniture
            if thing.height > 0
        ]
        self._root(
            "IfcRelContainedInSpatialStructure",
            "contained",
            RelatedElements=elements,
            RelatingStructure=storey,
        )

    def _walls(self, built: PlanBodies, doors: Sequence[WallOpening]) -> list[Any]:
        """Return the walls, with their openings, and the doors in the openings."""
        whole = shapely.union_all([*built.walls, *(each.shape for each in doors)], grid_size=WELD_M)
        bodies = [part for part in shapely.get_parts(whole) if part.geom_type == "Polygon" and part.area > CRUMB_M2]
        walls = [
            self._element("IfcWall", f"wall {i}", f"Wall {i}", part, 0.0, built.wall_height)
            for i, part in enumerate(bodies)
        ]
        found = list(walls)
        for each in doors:
            name, height = each.door.id, built.door_height if each.has_leaf else built.wall_height
            opening = self._element("IfcOpeningElement", f"opening {name}", f"Opening {name}", each.shape, 0.0, height)
            self._void(str(name), opening, each.shape, bodies, walls)
            if each.has_leaf:
                leaf = shapely.LineString(each.segment).buffer(_DOOR_LEAF_M / 2, cap_style="flat")
                door = self._element("IfcDoor", f"door {name}", f"Door {name}", leaf, 0.0, height)
                door.OverallHeight, door.OverallWidth = height, float(each.door.width)
                self._root(
                    "IfcRelFillsElement", f"fills {name}", RelatingOpeningElement=opening, RelatedBuildingElement=door
                )
                found.append(door)
        return [*found, *self._windows(built, bodies, walls)]

    def _windows(self, built: PlanBodies, bodies: Sequence[Polygon], walls: Sequence[Any]) -> Iterator[Any]:
        """Yield the windows, each in an opening of its wall."""
        for each in built.windows:
            number, heights = each.window.id, (each.sill, each.head - each.sill)
            key = f"window opening {number}"
            opening = self._element("IfcOpeningElement", key, f"Window opening {number}", each.shape, *heights)
            self._void(f"window {number}", opening, each.shape, bodies, walls)
            pane = shapely.LineString(each.segment).buffer(_DOOR_LEAF_M / 2, cap_style="flat")
            window = self._element("IfcWindow", f"window {number}", f"Window {number}", pane, *heights)
            window.OverallHeight, window.OverallWidth = float(heights[1]), float(each.window.width)
            self._root(
                "IfcRelFillsElement",
                f"fills window {number}",
                RelatingOpeningElement=opening,
                RelatedBuildingElement=window,
            )
            yield window

    def _void(
        self, name: str, opening: Any, shape: BaseGeometry, bodies: Sequence[Polygon], walls: Sequence[Any]
    ) -> None:
        """Make an opening a hole in the wall in which it lies."""
        inside = [wall for part, wall in zip(bodies, walls, strict=True) if part.intersection(shape).area > SAME_M2]
        if inside:
            self._root(
                "IfcRelVoidsElement",
                f"voids {name}",
                RelatingBuildingElement=inside[0],
                RelatedOpeningElement=opening,
            )

    def _space(self, room: Room, built: PlanBodies) -> Any:
        space = self._element("IfcSpace", f"room {room.id}", str(room.id), room.polygon, 0.0, built.wall_height)
        words = room.source_labels  # of several, none says what the whole room is
        has_name = len(words) == 1 or (words and room.label == UNLABELLED)
        space.LongName = valid_xml_text(words[0] if has_name else room.label)
        space.Description = valid_xml_text(" / ".join(words)) if len(words) > 1 else None
        space.ObjectType = room.label
        space.CompositionType, space.PredefinedType = "ELEMENT", "INTERNAL"
        return space

    def _slab(self, built: PlanBodies) -> Any:
        whole = shapely.union_all([built.space, *built.walls], grid_size=WELD_M)
        slab = self._element("IfcSlab", "floor", "Floor", whole, -FLOOR_M, FLOOR_M)
        slab.PredefinedType = "FLOOR"
        return slab

    def _element(self, kind: str, key: str, name: str, shape: BaseGeometry, *heights: float) -> Any:
        """Return an element extruded from a shape; ``heights`` are the height of its foot and its own, metres."""
        low, high = heights
        parts = [part for part in shapely.get_parts(shape) if part.geom_type == "Polygon"]
        solids = [self._extrusion(part, low, high) for part in parts]
        shown = self._new(
            "IfcShapeRepresentation",
            ContextOfItems=self._body,
            RepresentationIdentifier="Body",
            RepresentationType="SweptSolid",
            Items=solids,
        )
        return self._root(
            kind,
            key,
            Name=name,
            ObjectPlacement=self._new("IfcLocalPlacement", RelativePlacement=self._here),
            Representation=self._new("IfcProductDefinitionShape", Representations=[shown]),
        )

    def _extrusion(self, part: Polygon, low: float, high: float) -> Any:
        outer, *inner = [self._polyline(ring) for ring in all_rings(part)]
        profile = self._new("IfcArbitraryClosedProfileDef", ProfileType="AREA", OuterCurve=outer)
        if inner:
            profile = self._new(
                "IfcArbitraryProfileDefWithVoids", ProfileType="AREA", OuterCurve=outer, InnerCurves=inner
            )
        return self._new(
            "IfcExtrudedAreaSolid",
            SweptArea=profile,
            Position=self._new("IfcAxis2Placement3D", Location=self._point(0.0, 0.0, low)),
            ExtrudedDirection=self._new("IfcDirection", DirectionRatios=[0.0, 0.0, 1.0]),
            Depth=float(high),
        )

    def _polyline(self, ring: Any) -> Any:
        points = [self._point(float(x), float(y)) for x, y in ring.round(4).tolist()]
        return self._new("IfcPolyline", Points=[*points, points[0]])

    def _point(self, *at: float) -> Any:
        return self._new("IfcCartesianPoint", Coordinates=list(at))

    def _aggregate(self, key: str, whole: Any, parts: list[Any]) -> None:
        self._root("IfcRelAggregates", key, RelatingObject=whole, RelatedObjects=parts)

    def _root(self, kind: str, key: str, **values: Any) -> Any:
        """Return an IFC root entity; its global id is derived from the plan's id and ``key``."""
        mark = self._compress(uuid.uuid5(_NAMES, f"{self._name}\n{self._storey}{key}").hex)
        return self._new(kind, GlobalId=mark, **values)

    def _new(self, kind: str, **values: Any) -> Any:
        return self.file.create_entity(kind, **values)
