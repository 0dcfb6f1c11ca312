"""List pieces of furniture with their sizes, and the pieces that a room of each label may hold, with their chances.

Lengths are centimetres: plans stand on a grid of 1 cm, and so do the pieces.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

Place = Literal["wall", "beside", "before", "around", "opposite", "middle"]
"""At a wall; by an earlier piece (at its side, before it, round it, at a wall that it faces); or free on all sides."""


@dataclass(frozen=True)
class FurnitureKind:
    """A piece of furniture: ``width`` runs along its back, ``depth`` from its back to its front.

    ``front`` must stay free before it. ``by`` is the label of the earlier piece that it belongs to and stands ``gap``
    away from. ``likes`` says where at a wall it is put first.
    """

    label: str
    widths: tuple[int, ...]
    depth: int
    height: int
    front: int = 60
    place: Place = "wall"
    by: str = ""
    gap: int = 5
    likes: Literal["corner", "centre", "any"] = "any"


@dataclass(frozen=True)
class FurnitureWish:
    """Pieces that a room may hold: up to ``most``, each with a chance, where the room has ``area`` m2 or more."""

    piece: FurnitureKind
    chance: float = 1.0
    most: int = 1
    area: float = 0.0


_BED = FurnitureKind("bed", (140, 160, 180), 205, 50, 70, likes="centre")
_SINGLE = FurnitureKind("single bed", (90, 100), 205, 50, 60, likes="corner")
_NIGHTSTAND = FurnitureKind("nightstand", (40, 50), 40, 50, 0, "beside", "bed")
_WARDROBE = FurnitureKind("wardrobe", (120, 150, 180, 200), 60, 210, 70, likes="corner")
_DRESSER = FurnitureKind("dresser", (80, 100, 120), 45, 85, 60)
_DESK = FurnitureKind("desk", (120, 140, 160), 70, 75, 80)
_DESK_CHAIR = FurnitureKind("chair", (45,), 45, 90, 0, "before", "desk")
_BOOKCASE = FurnitureKind("bookcase", (60, 80, 100), 30, 190, 60)
_SOFA = FurnitureKind("sofa", (180, 200, 220), 90, 80, 80, likes="centre")
_COFFEE_TABLE = FurnitureKind("coffee table", (80, 100, 110), 55, 45, 0, "before", "sofa", 40)
_TV = FurnitureKind("tv stand", (120, 150, 180), 40, 50, 60, "opposite", "sofa")
_ARMCHAIR = FurnitureKind("armchair", (80, 85), 85, 85, 60, likes="corner")
_TABLE = FurnitureKind("table", (120, 140, 160, 180), 80, 75, 70, "middle")
_SMALL_TABLE = FurnitureKind("table", (70, 80), 70, 75, 60, "middle")
_TABLE_CHAIR = FurnitureKind("chair", (45,), 45, 90, 0, "around", "table")
_SIDEBOARD = FurnitureKind("sideboard", (120, 140, 160), 45, 85, 60)
_COUNTER = FurnitureKind("counter", (120, 160, 180, 240, 300), 60, 90, 90, likes="corner")
_STOVE = FurnitureKind("stove", (60,), 60, 90, 90, "beside", "counter")
_REFRIGERATOR = FurnitureKind("refrigerator", (60, 70), 65, 180, 80, likes="corner")
_BATHTUB = FurnitureKind("bathtub", (160, 170), 75, 60, 60, likes="corner")
_SHOWER = FurnitureKind("shower", (80, 90), 90, 200, 60, likes="corner")
_WASHBASIN = FurnitureKind("washbasin", (50, 60), 50, 85, 60)
_SMALL_BASIN = FurnitureKind("washbasin", (40,), 30, 85, 50)
_WC = FurnitureKind("toilet", (40,), 65, 75, 55)
_WASHER = FurnitureKind("washing machine", (60,), 60, 85, 70, likes="corner")
_SHOES = FurnitureKind("shoe cabinet", (60, 80, 100), 30, 90, 70)
_BENCH = FurnitureKind("bench", (90, 110), 40, 45, 70)
_COATS = FurnitureKind("coat rack", (60, 80), 35, 180, 70, likes="corner")
_SHELF = FurnitureKind("shelf", (80, 100, 120), 40, 180, 60, likes="corner")
_BOILER = FurnitureKind("boiler", (60,), 60, 180, 70, likes="corner")
_TREADMILL = FurnitureKind("treadmill", (85,), 180, 140, 60)
_WEIGHTS = FurnitureKind("weight bench", (70,), 140, 110, 60)
_CAR = FurnitureKind("car", (175, 185), 430, 150, 60, "middle")
_WORKBENCH = FurnitureKind("workbench", (120, 150, 180), 60, 90, 80, likes="corner")
_PLANTER = FurnitureKind("planter", (60, 80), 35, 60, 0, likes="corner")
_TREE = FurnitureKind("plant", (40,), 40, 120, 0, likes="corner")

_SLEEPING = (
    FurnitureWish(_BED, area=9.0),
    FurnitureWish(_NIGHTSTAND, 0.8, 2, 9.0),
    FurnitureWish(_WARDROBE, 0.9),
    FurnitureWish(_DRESSER, 0.5, area=11.0),
    FurnitureWish(_DESK, 0.35, area=13.0),
    FurnitureWish(_DESK_CHAIR, 0.9, area=13.0),
    FurnitureWish(_TREE, 0.3, area=12.0),
)
_YOUNG = (
    FurnitureWish(_SINGLE),
    FurnitureWish(_WARDROBE, 0.9, area=6.0),
    FurnitureWish(_DESK, 0.8, area=7.0),
    FurnitureWish(_DESK_CHAIR, 0.9, area=7.0),
    FurnitureWish(_BOOKCASE, 0.7, 2, 8.0),
)
_EATING = (
    FurnitureWish(_TABLE, area=9.0),
    FurnitureWish(_TABLE_CHAIR, 0.95, 6, 9.0),
    FurnitureWish(_SIDEBOARD, 0.7, area=10.0),
)
_ARRIVING = (
    FurnitureWish(_SHOES, 0.7),
    FurnitureWish(_COATS, 0.4, area=5.0),
    FurnitureWish(_BENCH, 0.3, area=7.0),
    FurnitureWish(_TREE, 0.3, area=8.0),
)
_OUTSIDE = (
    FurnitureWish(_SMALL_TABLE, 0.8, area=4.0),
    FurnitureWish(_TABLE_CHAIR, 0.8, 4, 4.0),
    FurnitureWish(_PLANTER, 0.6, 2),
)
_STORING = (FurnitureWish(_SHELF, 0.9, 3),)

WANTS: Final[dict[str, tuple[FurnitureWish, ...]]] = {
    "Bedroom": _SLEEPING,
    "Guest_Room": _SLEEPING,
    "Child_Room": _YOUNG,
    "Bathroom": (
        FurnitureWish(_BATHTUB, 0.6, area=5.0),
        FurnitureWish(_SHOWER, 0.6, area=3.0),
        FurnitureWish(_WC, 0.8),
        FurnitureWish(_WASHBASIN),
        FurnitureWish(_WASHER, 0.5, area=4.0),
    ),
    "Toilet": (FurnitureWish(_WC), FurnitureWish(_SMALL_BASIN, 0.8)),
    "Kitchen": (
        FurnitureWish(_COUNTER),
        FurnitureWish(_STOVE, 0.95),
        FurnitureWish(_REFRIGERATOR, 0.95),
        FurnitureWish(_SMALL_TABLE, 0.7, area=9.0),
        FurnitureWish(_TABLE_CHAIR, 0.9, 4, 9.0),
    ),
    "Living_Room": (
        FurnitureWish(_SOFA, area=8.0),
        FurnitureWish(_COFFEE_TABLE, 0.8, area=8.0),
        FurnitureWish(_TV, 0.9, area=8.0),
        FurnitureWish(_ARMCHAIR, 0.5, 2, 14.0),
        FurnitureWish(_BOOKCASE, 0.6, 2, 10.0),
        FurnitureWish(_TABLE, 0.4, area=26.0),
        FurnitureWish(_TABLE_CHAIR, 0.95, 6, 26.0),
        FurnitureWish(_TREE, 0.4, area=10.0),
    ),
    "Dining_Room": _EATING,
    "Office": (
        FurnitureWish(_DESK),
        FurnitureWish(_DESK_CHAIR, 0.95),
        FurnitureWish(_BOOKCASE, 0.8, 3),
        FurnitureWish(_SIDEBOARD, 0.4, area=10.0),
    ),
    "Hall": _ARRIVING,
    "Hallway": _ARRIVING,
    "Entryway": _ARRIVING,
    "Lobby": _ARRIVING,
    "Wardrobe": (FurnitureWish(_WARDROBE, 0.95, 2),),
    "Storage": _STORING,
    "Boiler_room": (FurnitureWish(_BOILER), FurnitureWish(_WASHER, 0.5), FurnitureWish(_SHELF, 0.5)),
    "Gym": (FurnitureWish(_TREADMILL, 0.9, 2), FurnitureWish(_WEIGHTS, 0.8), FurnitureWish(_SHELF, 0.4)),
    "Garage": (
        FurnitureWish(_CAR, 0.8, area=16.0),
        FurnitureWish(_WORKBENCH, 0.6, area=10.0),
        FurnitureWish(_SHELF, 0.6, 2),
    ),
    "Balcony": _OUTSIDE,
    "Terrace": _OUTSIDE,
    "Loggia": _OUTSIDE,
    "Room": (
        FurnitureWish(_SOFA, 0.4, area=12.0),
        FurnitureWish(_BOOKCASE, 0.6, 2, 6.0),
        FurnitureWish(_DRESSER, 0.5, area=6.0),
    ),
    "Unlabelled": (FurnitureWish(_SHELF, 0.3, area=4.0), FurnitureWish(_BOOKCASE, 0.3, area=8.0)),
}
"""By label, the large ones first. Elevators and shafts hold nothing."""
ONE_ROOM: Final = (FurnitureWish(_BED), FurnitureWish(_NIGHTSTAND, 0.6), *WANTS["Living_Room"])
"""What the living room of a home without a bedroom may hold."""
