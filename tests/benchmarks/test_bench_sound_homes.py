"""Sound homes beside real ones: areas and widths of rooms, rooms that doors join; and the time that making takes.

``HOMES`` in the environment says how many homes are made (2,000), of which more than half are flats.
The real ones are the 46,830 flats of Swiss Dwellings, as floorplan_eval (2026) tabulates them.
"""

from __future__ import annotations

import os
import time
from collections import defaultdict

import numpy as np
import shapely
from rich.console import Console

from pipeline.sources.sound_homes.home import make_sound_home
from pipeline.sources.sound_homes.values import SoundHome

COUNT, SEED = int(os.environ.get("HOMES", "2000")), 9092
FLATS = {"flat", "shared flat", "studio"}
TYPES = {
    "Living_Room": "living room",
    "Kitchen": "kitchen",
    "Bedroom": "bedroom",
    "Child_Room": "bedroom",
    "Bathroom": "bathroom",
    "Toilet": "bathroom",
    "Hallway": "hall",
    "Entryway": "hall",
    "Balcony": "balcony",
    "Terrace": "balcony",
    "Storage": "store",
    "Office": "office",
}
AREAS_M2 = {
    "living room": (16.2, 26.7, 42.7),
    "kitchen": (4.6, 8.0, 14.2),
    "bedroom": (9.9, 14.3, 21.8),
    "bathroom": (1.5, 3.8, 6.3),
    "hall": (2.2, 7.5, 17.7),
    "balcony": (2.1, 7.3, 21.3),
    "store": (0.5, 2.2, 7.3),
}
"""5, 50 and 95% of the rooms of a type."""
WIDTHS_M = {"living room": 4.0, "kitchen": 2.3, "bedroom": 3.2, "bathroom": 1.6, "hall": 1.8}
"""Medians of the diameter of the largest circle in a room."""
DOORS = {
    ("bathroom", "hall"): 0.89,
    ("bedroom", "hall"): 0.86,
    ("hall", "bathroom"): 0.84,
    ("hall", "bedroom"): 0.78,
    ("living room", "balcony"): 0.83,
    ("living room", "hall"): 0.46,
    ("living room", "bedroom"): 0.20,
    ("balcony", "bedroom"): 0.40,
    ("office", "hall"): 1.0,
}
"""The share of rooms of the first type with a door to one of the second."""
NEAR, NEAR_SHARE = 0.10, 0.05
REACHED_AREAS, REACHED_WIDTHS, REACHED_DOORS = 17, 3, 7
MAKING_MS = 60.0


def test_rooms_are_as_large_and_as_joined_as_in_real_flats() -> None:
    areas: dict[str, list[float]] = defaultdict(list)
    widths: dict[str, list[float]] = defaultdict(list)
    beside: dict[str, list[set[str]]] = defaultdict(list)
    flats = 0
    for index in range(COUNT):
        home = make_sound_home(index, SEED)
        if home.kind in FLATS:
            flats += 1
            take(home, areas, widths, beside)
    lines = [f"{flats} flats of {COUNT} homes, seed {SEED}"]
    reached = {"areas": 0, "widths": 0, "doors": 0}
    for kind, wanted in AREAS_M2.items():
        found = np.percentile(areas[kind], (5, 50, 95))
        near = np.abs(found / wanted - 1) <= NEAR
        reached["areas"] += int(near.sum())
        lines.append(f"{kind}: {found.round(2)} m2, wanted {wanted}, {near.sum()} of 3 near")
    for kind, width in WIDTHS_M.items():
        middle = float(np.median(widths[kind]))
        reached["widths"] += abs(middle / width - 1) <= NEAR
        lines.append(f"{kind}: {middle:.2f} m wide, wanted {width}")
    for (one, other), share in DOORS.items():
        joined = float(np.mean([other in each for each in beside[one]]))
        reached["doors"] += abs(joined - share) <= NEAR_SHARE
        lines.append(f"{one} with a door to a {other}: {joined:.3f}, wanted {share}")
    Console().print("\n".join([*lines, f"near: {reached}"]))
    assert reached["areas"] >= REACHED_AREAS
    assert reached["widths"] >= REACHED_WIDTHS
    assert reached["doors"] >= REACHED_DOORS


def take(
    home: SoundHome,
    areas: dict[str, list[float]],
    widths: dict[str, list[float]],
    beside: dict[str, list[set[str]]],
) -> None:
    """Add the rooms of a home to those of its kind."""
    for storey in home.storeys:
        kinds = [TYPES.get(label, label) for label in storey.labels]
        joined: list[set[str]] = [set() for _ in kinds]
        for one, other in (door.rooms for door in storey.doors):
            if other is not None:
                joined[one].add(kinds[other])
                joined[other].add(kinds[one])
        for kind, room, others in zip(kinds, storey.rooms, joined, strict=True):
            areas[kind].append(room.area)
            widths[kind].append(2 * shapely.maximum_inscribed_circle(room, 0.02).length)
            beside[kind].append(others)


def test_time_of_making() -> None:
    start = time.process_time()
    for index in range(100):
        make_sound_home(index, 1)
    spent = (time.process_time() - start) / 100 * 1000
    Console().print(f"making a sound home: {spent:.1f} ms of processor, asked {MAKING_MS:.0f}")
    assert spent <= MAKING_MS
