"""Hold the 25 room labels of the data set in a table: each one's spelling, simulator group and colour in pictures."""

from __future__ import annotations

import re
from typing import Final, NamedTuple


class LabelStyle(NamedTuple):
    """One label: its group in the simulator's eight, and its colour in pictures (sRGB)."""

    label: str
    group: str
    colour: str


# Hues follow use (sleep blue, water teal, cooking amber, living green, work violet, passage sand, outside grey-green);
# labels of one hue differ in lightness, which colour-blind readers can see, and every picture writes the label too.
_TABLE: Final = (
    LabelStyle("Bedroom", "bedroom", "#a9c8ec"),
    LabelStyle("Child_Room", "bedroom", "#c5daf3"),
    LabelStyle("Guest_Room", "bedroom", "#8fb4dc"),
    LabelStyle("Bathroom", "bathroom", "#8fd3cf"),
    LabelStyle("Toilet", "bathroom", "#bce5e0"),
    LabelStyle("Kitchen", "kitchen", "#f9c983"),
    LabelStyle("Dining_Room", "dining_room", "#f7b191"),
    LabelStyle("Living_Room", "living_room", "#b9dca0"),
    LabelStyle("Room", "indoor", "#e3e6c3"),
    LabelStyle("Office", "office", "#c9b6e4"),
    LabelStyle("Gym", "indoor", "#e0b9d8"),
    LabelStyle("Hallway", "hallway", "#f5e7b8"),
    LabelStyle("Hall", "hallway", "#ead79b"),
    LabelStyle("Lobby", "hallway", "#dcc68a"),
    LabelStyle("Entryway", "hallway", "#f0dcae"),
    LabelStyle("Garage", "indoor", "#c7c3bd"),
    LabelStyle("Storage", "indoor", "#d9cbb8"),
    LabelStyle("Wardrobe", "indoor", "#e8c9c5"),
    LabelStyle("Boiler_room", "indoor", "#c9ada0"),
    LabelStyle("Balcony", "indoor", "#cfe3d4"),
    LabelStyle("Terrace", "indoor", "#b9d1bb"),
    LabelStyle("Loggia", "indoor", "#dcebd9"),
    LabelStyle("Aeration", "indoor", "#cfd8dc"),
    LabelStyle("Passenger_elevator", "indoor", "#b0bec5"),
    LabelStyle("Freight_elevator", "indoor", "#98a8b1"),
)

UNLABELLED: Final = "Unlabelled"
LABELS: Final = tuple(category.label for category in _TABLE)
GROUPS: Final = ("indoor", "kitchen", "dining_room", "living_room", "bathroom", "bedroom", "office", "hallway")

_BY_LABEL: Final = {category.label: category for category in _TABLE}
_BY_SPELLING: Final = {category.label.replace("_", "").casefold(): category.label for category in _TABLE}


def canonical(word: str) -> str | None:
    """Return the published label that a word spells, or None.

    Case, spaces, underscores, hyphens and camel case are ignored. Synonyms are not recognised: ``WC`` does not give
    ``Toilet``. Sources have their own tables for those.

    Parameters
    ----------
    word
        A label, as a file or a person writes it.

    Returns
    -------
    Its spelling in ``LABELS``.

    Examples
    --------
    >>> canonical("LivingRoom"), canonical("boiler room"), canonical("WC")
    ('Living_Room', 'Boiler_room', None)
    """
    return _BY_SPELLING.get(re.sub(r"[\s_\-]+", "", word).casefold())


def label_group(label: str) -> str:
    """Return the simulator's group of a label; "indoor" for labels without a group and for unlabelled rooms."""
    found = _BY_LABEL.get(label)
    return found.group if found else "indoor"


def label_colour(label: str) -> str:
    """Return the label's colour as ``#rrggbb``; near-white for unlabelled rooms."""
    found = _BY_LABEL.get(label)
    return found.colour if found else "#f1efec"
