"""Hold the 25 room labels of the data set in a table: each one's spelling, simulator group and colour in pictures."""

from __future__ import annotations

import re
from typing import Final, NamedTuple


class Category(NamedTuple):
    """One label: its group in the simulator's eight, and its colour in pictures (sRGB)."""

    label: str
    group: str
    colour: str


# Hues follow use (sleep blue, water teal, cooking amber, living green, work violet, passage sand, outside grey-green);
# labels of one hue differ in lightness, which colour-blind readers can see, and every picture writes the label too.
_TABLE: Final = (
    Category("Bedroom", "bedroom", "#a9c8ec"),
    Category("Child_Room", "bedroom", "#c5daf3"),
    Category("Guest_Room", "bedroom", "#8fb4dc"),
    Category("Bathroom", "bathroom", "#8fd3cf"),
    Category("Toilet", "bathroom", "#bce5e0"),
    Category("Kitchen", "kitchen", "#f9c983"),
    Category("Dining_Room", "dining_room", "#f7b191"),
    Category("Living_Room", "living_room", "#b9dca0"),
    Category("Room", "indoor", "#e3e6c3"),
    Category("Office", "office", "#c9b6e4"),
    Category("Gym", "indoor", "#e0b9d8"),
    Category("Hallway", "hallway", "#f5e7b8"),
    Category("Hall", "hallway", "#ead79b"),
    Category("Lobby", "hallway", "#dcc68a"),
    Category("Entryway", "hallway", "#f0dcae"),
    Category("Garage", "indoor", "#c7c3bd"),
    Category("Storage", "indoor", "#d9cbb8"),
    Category("Wardrobe", "indoor", "#e8c9c5"),
    Category("Boiler_room", "indoor", "#c9ada0"),
    Category("Balcony", "indoor", "#cfe3d4"),
    Category("Terrace", "indoor", "#b9d1bb"),
    Category("Loggia", "indoor", "#dcebd9"),
    Category("Aeration", "indoor", "#cfd8dc"),
    Category("Passenger_elevator", "indoor", "#b0bec5"),
    Category("Freight_elevator", "indoor", "#98a8b1"),
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

    Examples
    --------
    >>> canonical("LivingRoom"), canonical("boiler room"), canonical("WC")
    ('Living_Room', 'Boiler_room', None)
    """
    return _BY_SPELLING.get(re.sub(r"[\s_\-]+", "", word).casefold())


def group(label: str) -> str:
    """Return the simulator's group of a label; "indoor" for labels without a group and for unlabelled rooms."""
    found = _BY_LABEL.get(label)
    return found.group if found else "indoor"


def colour(label: str) -> str:
    """Return the label's colour as ``#rrggbb``; near-white for unlabelled rooms."""
    found = _BY_LABEL.get(label)
    return found.colour if found else "#f1efec"
