"""The sections of one storey, each made once: what stands at a height, floors and slabs left out."""

from __future__ import annotations

from dataclasses import dataclass, field

from shapely.geometry.base import BaseGeometry

from pipeline.geometry.cutting import Cutter
from pipeline.geometry.overlay import overlap, polygons_of, united
from pipeline.geometry.slits import joined_sheets
from pipeline.geometry.walls import section

STANDING = 0.5
"""Share of a massive body's section at the floor, with which it is a wall or a chimney and no slab."""


@dataclass(frozen=True, eq=False)
class Sections:
    """Sections of a mesh. ``sheet_m`` is what a single sheet gets, ``solid_m`` the thickest wall that may be hollow."""

    cutter: Cutter
    sheet_m: float
    solid_m: float
    _made: dict[float, BaseGeometry] = field(default_factory=dict)
    _closets: dict[float, BaseGeometry] = field(default_factory=dict)

    def foot(self, height: float) -> BaseGeometry:
        """All that stands at a height near the floor, massive bodies included."""
        found = section(self.cutter.cut(height), sheet_m=self.sheet_m, solid_m=self.solid_m)
        return united([joined_sheets(found.walls, self.sheet_m), found.solids])

    def at(self, height: float, foot: BaseGeometry) -> BaseGeometry:
        """The upright faces at a height, and of massive bodies those that stand at ``foot`` too: a slab does not."""
        if height not in self._made:
            cut = self.cutter.cut(height, upright_only=True)
            found = section(cut, sheet_m=self.sheet_m, solid_m=self.solid_m)
            massive = [part for part in polygons_of(found.solids) if overlap(part, foot).area > STANDING * part.area]
            walls = joined_sheets(found.walls, self.sheet_m)
            self._closets[height] = found.closets
            self._made[height] = united([walls, *massive]) if massive else walls
        return self._made[height]

    @property
    def closets(self) -> BaseGeometry:
        """What of all sections made so far is narrow space in a closed body, and no wall."""
        return united([closet for closet in self._closets.values() if not closet.is_empty])
