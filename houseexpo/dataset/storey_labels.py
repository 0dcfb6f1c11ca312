"""Define the labels of a storey of a real house: a line of JSON with a person's findings, for fitting models.

A review writes these lines (``houseexpo labels``), and so do people who mark plans (``tests.corpus.marks``).
"""

from __future__ import annotations

from typing import Final

import msgspec

NEAR_WAY_M: Final = 0.35
"""Two passages whose middles are nearer than this are the same passage, metres, as when passages are matched with a
drawn truth."""

Place = tuple[float, float]
Space = tuple[float, float, float]


class StoreyLabels(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """The labels of one storey; places and areas are in metres along the source's plan axes.

    ``extent`` is the size of the bounds of its walls; another size means that the file was read in another way.
    ``path`` is the file; ``reader``, ``key`` and ``options`` are how it was read, with what is said of the file.
    ``right`` is whether the plan was right as it was built; None if nobody knows.
    """

    file: str
    level: int
    extent: tuple[float, float]
    rooms: list[Space]
    unlike: list[Space]
    no_rooms: list[Space]
    ways: list[Place]
    no_ways: list[Place]
    path: str = ""
    reader: str = ""
    key: str = ""
    options: dict[str, str] = {}
    right: bool | None = None
