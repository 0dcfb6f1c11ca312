"""Mend a model before its triangles are made, and tell which of its products native code may follow.

ifcopenshell takes the kinds of instances that a placement or a representation refers to on trust. A damaged file that
names another kind there ends the process, and one whose parts hold each other in a circle never ends. Such a product
is left out (``SoundnessChecker``).

S1  ifcopenshell reads units from the only context of a file. A library (IfcProjectLibrary) is a context too, but has
    no part in the building, so it is taken out.
S2  A damaged opening is left out of its wall.
S3  The kernel refuses an extrusion of a negative depth. It is turned into one the other way.
S4  A space that is drawn as closed lines on the floor alone (a footprint) gets the area within them as its body.
"""

from __future__ import annotations

from contextlib import suppress
from typing import Any, Final

import numpy as np

from pipeline.sources.ifc.elements import has_body, has_parent_cycle, of_type
from pipeline.sources.tolerances import DEEPEST, NAMED_DOOR_M


def mend_model(model: Any, metres: float) -> None:
    """Mend a model, whose unit is so many metres, in place (S1 to S4)."""
    for library in of_type(model, "IfcProjectLibrary"):  # S1
        model.remove(library)
    _leave_out_damaged_openings(model)
    for solid in of_type(model, "IfcExtrudedAreaSolid"):
        _extrude_forwards(model, solid)
    for space in of_type(model, "IfcSpace"):
        with suppress(*DAMAGED):
            _raise_footprint(model, space, metres)


def _leave_out_damaged_openings(model: Any) -> None:
    """S2."""
    sound = SoundnessChecker()
    for relation in of_type(model, "IfcRelVoidsElement"):
        opening = relation.RelatedOpeningElement
        if not opening or not sound.of(opening):
            model.remove(relation)


def _extrude_forwards(model: Any, solid: Any) -> None:
    """S3."""
    if isinstance(solid.Depth, float) and solid.Depth < 0 and solid.ExtrudedDirection:
        x, y, z = solid.ExtrudedDirection.DirectionRatios
        solid.ExtrudedDirection = model.createIfcDirection((-x, -y, -z))
        solid.Depth = -solid.Depth


def _raise_footprint(model: Any, space: Any, metres: float) -> None:
    """S4; it is as high as a door."""
    if not space.Representation or has_body(space):
        return
    for drawn in space.Representation.Representations or ():
        if drawn.RepresentationIdentifier != "FootPrint":
            continue
        items = [each for item in drawn.Items or () for each in getattr(item, "Elements", None) or [item]]
        profiles = [
            model.createIfcArbitraryClosedProfileDef("AREA", None, line)
            for line in items
            if line.is_a("IfcBoundedCurve") and _is_closed(line)
        ]
        if profiles:
            up = model.createIfcDirection((0.0, 0.0, 1.0))
            place = model.createIfcAxis2Placement3D(model.createIfcCartesianPoint((0.0, 0.0, 0.0)))
            solids = [model.createIfcExtrudedAreaSolid(each, place, up, NAMED_DOOR_M[1] / metres) for each in profiles]
            body = model.createIfcShapeRepresentation(drawn.ContextOfItems, "Body", "SweptSolid", solids)
            space.Representation.Representations = [*space.Representation.Representations, body]
            return


def _is_closed(line: Any) -> bool:
    """Return whether a line ends where it begins."""
    if line.is_a("IfcPolyline"):
        corners = [tuple(point.Coordinates) for point in line.Points]
    elif line.is_a("IfcIndexedPolyCurve"):
        corners = [tuple(point) for point in line.Points.CoordList]
        ends = [segment.wrappedValue for segment in line.Segments or ()]
        corners = [corners[ends[0][0] - 1], *corners, corners[ends[-1][-1] - 1]] if ends else corners
    else:
        return bool(line.is_a("IfcCompositeCurve"))
    return len(corners) > 3 and bool(np.allclose(corners[0], corners[-1]))


DAMAGED: Final = (AttributeError, LookupError, TypeError, ValueError, ZeroDivisionError)
"""What reading damaged attributes raises."""


class SoundnessChecker:
    """Remembers what has been looked at: products share placements and representations."""

    def __init__(self) -> None:
        self._known: dict[int, bool] = {}

    def of(self, product: Any) -> bool:
        """Return whether a product, and the openings that are taken out of it, can be triangulated."""
        openings = [each.RelatedOpeningElement for each in getattr(product, "HasOpenings", None) or ()]
        return all(self._is_whole(each) and not has_parent_cycle(each) for each in (product, *openings))

    def _is_whole(self, product: Any) -> bool:
        if not product or not product.is_a("IfcProduct"):
            return False
        placement, shape = product.ObjectPlacement, product.Representation
        return self._is_placed(placement, DEEPEST) and (shape is None or self._check_once(shape, _is_shape))

    def _is_placed(self, placement: Any, depth: int) -> bool:
        if placement is None:
            return True
        if depth == 0 or not placement.is_a("IfcObjectPlacement"):
            return False
        if not placement.is_a("IfcLocalPlacement"):
            return True
        if not self._check_once(placement, _has_axes):
            return False
        return self._is_placed(placement.PlacementRelTo, depth - 1)

    def _check_once(self, instance: Any, check: Any) -> bool:
        key = instance.id()
        if key not in self._known:
            self._known[key] = bool(check(instance))
        return self._known[key]


def _has_axes(placement: Any) -> bool:
    axes = placement.RelativePlacement
    if not axes or not axes.is_a("IfcPlacement"):
        return False
    directions = (getattr(axes, name, None) for name in ("Axis", "RefDirection"))
    if not axes.Location or not axes.Location.is_a("IfcPoint"):
        return False
    return all(each is None or each.is_a("IfcDirection") for each in directions)


def _is_shape(shape: Any) -> bool:
    if not shape.is_a("IfcProductRepresentation"):
        return False
    for each in shape.Representations or ():
        if not each.is_a("IfcRepresentation") or not each.ContextOfItems:
            return False
        if not each.ContextOfItems.is_a("IfcRepresentationContext"):
            return False
        if not all(item.is_a("IfcRepresentationItem") for item in each.Items or ()):
            return False
    return True
