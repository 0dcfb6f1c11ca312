"""Read the ids of plans: the input, the building and the level that a plan is of (docs/format.md, "Ids").

The id of an input is followed by ``_B2`` for a building, ``_L1`` for a level, and eight digits of a hash where inputs
have equal ids: ``house_B2_L1_0a1b2c3d``.
"""

from __future__ import annotations

import re
from typing import Final, NamedTuple

_PARTS: Final = r"(_B\d+)?(_L\d+)?(_[0-9a-f]{8}(?:_\d+)?)?"
_ID: Final = re.compile(f"(.*?){_PARTS}", re.DOTALL)
_AFTER_INPUT: Final = re.compile(_PARTS)


class PlanId(NamedTuple):
    """The parts of an id as they stand in it, "" for each that it lacks: ``("house", "_B2", "_L1", "_0a1b2c3d")``."""

    base: str
    building: str
    level: str
    digits: str

    @property
    def of_input(self) -> str:
        """The id of the input."""
        return self.base + self.digits

    @property
    def of_level(self) -> str:
        """The id of the level, of which this may be a building."""
        return self.base + self.level + self.digits

    @property
    def of_building(self) -> str:
        """The id of the building, of which this may be a level."""
        return self.base + self.building + self.digits

    @property
    def without_digits(self) -> str:
        """The id without the digits of a hash."""
        return self.base + self.building + self.level


def parts_of(plan_id: str) -> PlanId:
    """Return the parts of the id of a plan."""
    found = _ID.fullmatch(plan_id)
    assert found is not None  # noqa: S101  # any text matches
    return PlanId(*(part or "" for part in found.groups()))


def is_of_input(plan_id: str, input_id: str) -> bool:
    """Return whether an id is that of an input, or of a building or a level of it."""
    return plan_id.startswith(input_id) and _AFTER_INPUT.fullmatch(plan_id, len(input_id)) is not None


def building_id(level_id: str, number: int) -> str:
    """Return the id of a building of a level: ``house_L1`` becomes ``house_B2_L1``."""
    parts = parts_of(level_id)
    level = "" if parts.digits else parts.level  # digits at the end belong to the name: those of a hash come later
    return f"{level_id.removesuffix(level)}_B{number}{level}"
