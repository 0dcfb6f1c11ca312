"""What becomes of the closed spaces of 200 made houses: joined, left out with a note, or lost without one."""

from __future__ import annotations

from collections import Counter

from rich.console import Console
from rich.table import Table

from tests.builders.closed_rooms import closed_room, outcome

HOUSES = 50
"""Of each of the four rows."""


def test_nothing_is_left_out_without_a_note() -> None:
    table = Table(title=f"Closed spaces of {4 * HOUSES} made houses")
    for heading in ("doors", "area, m2", "joined", "left out with a note", "lost"):
        table.add_column(heading)
    lost = 0
    for marked in (True, False):
        for least_m2, most_m2 in ((1.0, 1.9), (2.1, 9.0)):
            made = (closed_room(seed, marked=marked, least_m2=least_m2, most_m2=most_m2) for seed in range(HOUSES))
            found = Counter(outcome(house) for house in made)
            counts = [str(found[name]) for name in ("joined", "noted", "lost")]
            table.add_row("marked by sills" if marked else "of a mesh", f"{least_m2} to {most_m2}", *counts)
            lost += found["lost"]
    Console(width=100).print(table)
    assert lost == 0
