"""A tiny Sweet Home 3D home: rooms of 4 x 3 m and 3 x 3 m, walls of 20 cm, a door, a front door and a window."""

from __future__ import annotations

import zipfile
from pathlib import Path

WALLS = {  # middles in centimetres, y down
    "n": (-10, -10, 730, -10),
    "e": (730, -10, 730, 310),
    "s": (730, 310, -10, 310),
    "w": (-10, 310, -10, -10),
    "m": (410, -10, 410, 310),
}
JOINED = {"n": ("w", "e"), "e": ("n", "s"), "s": ("e", "w"), "w": ("s", "n")}
ROOMS = {"Camera": (0, 0, 400, 300), "Kitchen": (420, 0, 720, 300)}
DOOR = (
    "<doorOrWindow name='door' x='410' y='150' angle='1.5707964' width='90' depth='10' height='208'{}>"
    "<sash/></doorOrWindow>"
)
FRONT = "<doorOrWindow name='front' x='100' y='310' width='100' depth='20' height='208'><sash/></doorOrWindow>"
WINDOW = "<doorOrWindow name='window' x='600' y='-10' elevation='90' width='100' depth='20' height='120'/>"
BED = "<pieceOfFurniture name='bed' x='100' y='100' angle='1.5707964' width='200' depth='90' height='50'/>"


def wall(key: str, x1: float, y1: float, x2: float, y2: float, extra: str = "") -> str:
    """Return a wall of 20 cm."""
    start, end = JOINED.get(key, ("", ""))
    joined = f" wallAtStart='{start}' wallAtEnd='{end}'" if start else ""
    ends = f"xStart='{x1}' yStart='{y1}' xEnd='{x2}' yEnd='{y2}'"
    return f"<wall id='{key}'{joined} {ends} height='250' thickness='20' {extra}/>"


def room(name: str, x1: float, y1: float, x2: float, y2: float, extra: str = "") -> str:
    """Return a rectangular room."""
    points = "".join(f"<point x='{x}' y='{y}'/>" for x, y in [(x1, y1), (x2, y1), (x2, y2), (x1, y2)])
    return f"<room name='{name}' {extra}>{points}</room>"


def home(*more: str, door: str = DOOR.format("")) -> str:
    """Return ``Home.xml``."""
    walls = "".join(wall(key, *ends) for key, ends in WALLS.items())
    rooms = "".join(room(name, *box) for name, box in ROOMS.items())
    content = [walls, rooms, door, FRONT, WINDOW, *more]
    return f"<?xml version='1.0'?><home version='6000' wallHeight='250'>{''.join(content)}</home>"


def write(path: Path, xml: str | bytes, name: str = "Home.xml") -> Path:
    """Pack a home."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(zipfile.ZipInfo(name), xml)
    return path
