"""Define the labels of a storey of a real house: a line of JSON with a person's findings, for fitting models.

A review writes these lines (``houseexpo labels``), and so do people who mark plans (``tests.corpus.marks``).
"""

from __future__ import annotations

import msgspec

Place = tuple[float, float]
Space = tuple[float, float, float]


class StoreyLabels(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """The labels of one storey; places and areas are in metres along the source's plan axes.

    ``extent`` is the size of the bounds of its walls; another size means that the file was read in another way.
    ``path`` is the file.
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
