"""Hold the 25 room labels of the data set in a table: each one's spelling, and its colour in pictures."""

from __future__ import annotations

import re
from typing import Final

# Hues follow use (sleep blue, water teal, cooking amber, living green, work violet, passage sand, outside grey-green);
# labels of one hue differ in lightness, which colour-blind readers can see, and every picture writes the label too.
_COLOURS: Final = {
    "Bedroom": "#a9c8ec",
    "Child_Room": "#c5daf3",
    "Guest_Room": "#8fb4dc",
    "Bathroom": "#8fd3cf",
    "Toilet": "#bce5e0",
    "Kitchen": "#f9c983",
    "Dining_Room": "#f7b191",
    "Living_Room": "#b9dca0",
    "Room": "#e3e6c3",
    "Office": "#c9b6e4",
    "Gym": "#e0b9d8",
    "Hallway": "#f5e7b8",
    "Hall": "#ead79b",
    "Lobby": "#dcc68a",
    "Entryway": "#f0dcae",
    "Garage": "#c7c3bd",
    "Storage": "#d9cbb8",
    "Wardrobe": "#e8c9c5",
    "Boiler_room": "#c9ada0",
    "Balcony": "#cfe3d4",
    "Terrace": "#b9d1bb",
    "Loggia": "#dcebd9",
    "Aeration": "#cfd8dc",
    "Passenger_elevator": "#b0bec5",
    "Freight_elevator": "#98a8b1",
}

UNLABELLED: Final = "Unlabelled"
LABELS: Final = tuple(_COLOURS)

_BY_SPELLING: Final = {label.replace("_", "").casefold(): label for label in LABELS}


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


def label_colour(label: str) -> str:
    """Return the label's colour as ``#rrggbb``; near-white for unlabelled rooms."""
    return _COLOURS.get(label, "#f1efec")
