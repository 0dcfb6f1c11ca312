"""Define the styles in which plans are drawn: what each part is filled with, and how doors are shown.

``architect`` is the default: dark walls, pale rooms, door leaves with the arc of their swing. ``technical`` is the same
in black and white, for papers. ``semantic`` fills rooms with the colour of their label and colours doors by kind, as in
the legends of the service and the statistics.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, TypeAlias, get_args

from houseexpo.errors import ConfigError
from houseexpo.plan import DoorKind
from houseexpo.plan.room_labels import label_colour

StyleName: TypeAlias = Literal["architect", "technical", "semantic"]
STYLE_NAMES: Final[tuple[StyleName, ...]] = get_args(StyleName)

INK: Final = "#2f343b"
PAPER: Final = "#ffffff"
WALL: Final = "#454b54"
FLOOR: Final = "#f6f4ef"
FURNITURE: Final = "#e2ddd3"
FURNITURE_EDGE: Final = "#a9a294"
UNSURE: Final = "#8d8778"
# blue, light blue, amber, magenta, teal: distinguishable by colour-blind readers
DOOR_COLOURS: Final[dict[DoorKind, str]] = {
    "door": "#2f6da8",
    "opening": "#8fbde0",
    "entrance": "#e39a1f",
    "cut": "#c2188f",
    "window": "#3fa796",
}
DOOR_TINTS: Final[dict[DoorKind, str]] = {
    "door": "#bdd3e6",
    "opening": "#dcebf6",
    "entrance": "#f6ddb3",
    "cut": "#edb9de",
    "window": "#c3e4de",
}


@dataclass(frozen=True)
class Style:
    """The colours of a picture (``#rrggbb``), and how rooms and doors are drawn.

    ``strength`` is the share of the label's colour in a room's fill; the rest is ``floor``. ``swings`` says whether
    doors have leaves and arcs; otherwise they are filled by kind.
    """

    paper: str
    ink: str
    wall: str
    floor: str
    furniture: str
    line: str
    """Thin lines: furniture, arcs, hatching."""
    strength: float
    swings: bool

    def room(self, label: str) -> str:
        """Return the fill of a room."""
        return mix_colours(label_colour(label), self.floor, self.strength)


_STYLES: Final[dict[StyleName, Style]] = {
    "architect": Style(PAPER, INK, "#2b2f36", "#fcfbf8", "#fcfbf8", "#767b83", 0.45, swings=True),
    "technical": Style(PAPER, "#000000", "#000000", PAPER, PAPER, "#000000", 0.0, swings=True),
    "semantic": Style(PAPER, INK, WALL, FLOOR, FURNITURE, FURNITURE_EDGE, 1.0, swings=False),
}
_DARK: Final = Style("#16181b", "#e6e4df", "#c3c9d1", "#22262b", "#22262b", "#8d939c", 0.3, swings=True)
"""The style ``architect`` on dark pages."""


def check_style(name: str) -> StyleName:
    """Return the name of a style; raise ConfigError if there is none of this name."""
    for known in STYLE_NAMES:
        if known == name:
            return known
    raise ConfigError(f"style: expected one of {', '.join(STYLE_NAMES)}, found {name!r}")


def style_named(name: str) -> Style:
    """Return a style by its name; raise ConfigError if there is none of this name.

    Examples
    --------
    >>> style_named("technical").room("Kitchen")
    '#ffffff'
    """
    return _STYLES[check_style(name)]


def dark_colours(style: Style, labels: set[str]) -> dict[str, str]:
    """Return the colours of a style's picture of rooms with these labels, and those that replace them on dark pages.

    Only ``architect`` has them; the other styles are black on white, or the colours of a legend.
    """
    if style != _STYLES["architect"]:
        return {}
    parts = {getattr(style, part): getattr(_DARK, part) for part in ("paper", "ink", "wall", "floor", "line")}
    return parts | {style.room(label): _DARK.room(label) for label in sorted(labels)}


def mix_colours(one: str, other: str, share: float) -> str:
    """Return a colour that has ``share`` of ``one`` and the rest of ``other``, each ``#rrggbb``.

    Examples
    --------
    >>> mix_colours("#ffffff", "#000000", 0.5)
    '#808080'
    """
    pairs = zip(bytes.fromhex(one[1:7]), bytes.fromhex(other[1:7]), strict=True)
    return "#" + "".join(f"{round(share * a + (1 - share) * b):02x}" for a, b in pairs)
