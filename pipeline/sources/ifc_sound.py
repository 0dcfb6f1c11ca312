"""Whether an IFC product's placement and body are what the schema says, so that native code may follow them.

ifcopenshell takes the kinds of instances that a placement or a representation refers to on trust; a damaged file that
names another kind there ends the process, and one whose parts hold each other in a circle never ends. Such a product is
left out.
"""

from __future__ import annotations

from typing import Any

from pipeline.sources.ifc_elements import is_held_in_a_circle

DEEPEST = 100  # placements within placements; more is a circle


class Soundness:
    """Remembers what has been looked at: products share placements and representations."""

    def __init__(self) -> None:
        self._known: dict[int, bool] = {}

    def of(self, product: Any) -> bool:
        """Whether a product, and the openings that are taken out of it, can be triangulated."""
        openings = [each.RelatedOpeningElement for each in getattr(product, "HasOpenings", None) or ()]
        return all(self._is_whole(each) and not is_held_in_a_circle(each) for each in (product, *openings))

    def _is_whole(self, product: Any) -> bool:
        if not product or not product.is_a("IfcProduct"):
            return False
        placement, shape = product.ObjectPlacement, product.Representation
        return self._is_placed(placement, DEEPEST) and (shape is None or self._remembered(shape, _is_shape))

    def _is_placed(self, placement: Any, depth: int) -> bool:
        if placement is None:
            return True
        if depth == 0 or not placement.is_a("IfcObjectPlacement"):
            return False
        if not placement.is_a("IfcLocalPlacement"):
            return True
        if not self._remembered(placement, _has_axes):
            return False
        return self._is_placed(placement.PlacementRelTo, depth - 1)

    def _remembered(self, instance: Any, check: Any) -> bool:
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
