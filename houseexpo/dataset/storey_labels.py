"""Define what people have found out about a storey of a real house, as a line of JSON from which models are fitted.

A review writes these lines (``houseexpo labels``), and so do people who mark plans (``tests.corpus.marks``).
"""

from __future__ import annotations

import msgspec

Place = tuple[float, float]
Space = tuple[float, float, float]


class StoreyLabels(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """What is known of one storey; places and areas are in metres of the source's plan axes.

    ``extent`` is how far its walls reach: of another size, it is another reading of the file. ``path`` is the file.
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
