"""What three departures from the paper change: entrances stay closed, open houses get walls, characters are no houses.

All houses are made here, so anybody can repeat it. The paper closed open houses and removed characters by hand.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from itertools import product
from pathlib import Path

import numpy as np
import shapely
from rich.console import Console
from rich.table import Table

from houseexpo.floorplan import FloorPlan
from pipeline.algorithm import plan_level
from pipeline.config import PipelineConfig
from pipeline.rejection import Rejection
from pipeline.sources import suncg
from pipeline.values import Level
from tests.builders.houses import CEILING, Parts, level, wall
from tests.builders.meshes import box
from tests.builders.shared import planned
from tests.builders.suncg_houses import write_houses

HOUSES, SEED = 200, 11
EACH = 20
"""Open houses of each row, and words of each row."""

SIDES = {"posts": (), "one wall": ("back",), "two walls": ("back", "left"), "three walls": ("back", "left", "right")}
CHARACTERS = {
    "A": "TLRMlr", "C": "TLlB", "E": "TLMlB", "F": "TLMl", "H": "LRMlr", "J": "RrlB", "L": "LlB", "O": "TLRlrB",
    "P": "TLRMl", "S": "TLMrB", "U": "LRlrB", "Y": "LRMrB", "6": "TLMlrB", "8": "TLRMlrB", "9": "TLRMrB",
}  # fmt: skip
"""The strokes of each: top, upper left and right, middle, lower left and right, bottom."""
RINGS = "O8"
"""Nothing but closed rings."""
OPEN = "CEFHJLSUY"


def test_entrances_that_stay_closed(tmp_path: Path) -> None:
    """Line 7: what opening the entrances, as the paper's sentence has it, would add to the free space."""
    write_houses(tmp_path, HOUSES, SEED)
    number, added, depth, shares = 0, [], [], []
    plans = 0
    for item in suncg.find(str(tmp_path)):
        for house in suncg.read(item):
            assert isinstance(house, Level)
            try:
                plan = planned(house)
            except Rejection:
                continue
            entrances = [door for door in plan.doors if door.kind == "entrance"]
            niches = [shapely.Polygon(door.ring) for door in entrances]
            beyond = shapely.union_all(niches).difference(plan.free_space).area
            plans, number = plans + 1, number + len(entrances)
            added += [niche.area for niche in niches]
            depth += [niche.area / door.width for niche, door in zip(niches, entrances, strict=True)]
            shares.append(beyond / (plan.area + beyond))
    console = Console(width=120)
    console.print(
        f"{number} entrances in {plans} plans: {np.median(added):.2f} m2, {np.median(depth):.2f} m deep (median)"
    )
    console.print(f"{100 * np.mean(shares):.2f}% of the free space on average, at most {100 * max(shares):.2f}%")
    assert max(shares) > 0


def test_open_houses() -> None:
    """Labelling 3: houses with walls on some sides, with and without a floor and a roof."""
    table = _table(f"{EACH} open houses a row", "sides, floor, roof", "plans", "doubtful", "rejected")
    total = Counter[str]()
    for (name, sides), floored, roofed in product(SIDES.items(), (True, False), (True, False)):
        rng = np.random.default_rng(SEED)
        found = _outcomes(_open_house(rng, sides, floored=floored, roofed=roofed) for _ in range(EACH))
        total += found
        row = f"{name}{', floor' * floored}{', roof' * roofed}"
        table.add_row(row, *(str(found[each]) for each in ("plan", "doubtful", "rejected")))
    _show(table, total)
    assert total["plan"] == total["doubtful"]


def test_words() -> None:
    """Labelling 4: words whose characters have seven strokes."""
    table = _table(f"{EACH} words a row", "characters", "words with a plan", "plans", "doubtful", "rejected")
    total = Counter[str]()
    for name, among in (("open", OPEN), ("any", "".join(CHARACTERS)), ("closed rings", RINGS)):
        rng = np.random.default_rng(SEED)
        found = _outcomes(_word(rng.choice(list(among), int(rng.integers(3, 7))).tolist()) for _ in range(EACH))
        total += found
        table.add_row(name, *(str(found[each]) for each in ("house", "plan", "doubtful", "rejected")))
    _show(table, total)
    assert total["plan"] == total["doubtful"]


def _open_house(rng: np.random.Generator, sides: tuple[str, ...], *, floored: bool, roofed: bool) -> Level:
    """Return a house of random size with walls on some of its sides, or with posts."""
    x, y = rng.uniform(4.0, 10.0), rng.uniform(3.5, 7.0)
    walls = {"back": (0.0, y - 0.2, x, y), "left": (0.0, 0.0, 0.2, y - 0.2), "right": (x - 0.2, 0.0, x, y - 0.2)}
    parts = [part for side in sides for part in wall(walls[side])]
    if not sides:
        parts += [box((a, b, a + 0.2, b + 0.2), 0.0, CEILING) for a in (0.0, x / 2, x - 0.2) for b in (0.0, y - 0.2)]
    if roofed:
        parts.append(box((0.0, 0.0, x, y), CEILING, CEILING + 0.2))
    return level(parts, floor=shapely.box(0, 0, x, y) if floored else None)


def _word(characters: list[str]) -> Level:
    """Return characters of 2.2 x 4.2 m side by side, as walls."""
    parts: Parts = []
    for k, each in enumerate(characters):
        x = 3.4 * k
        strokes = {
            "T": (x, 4.0, x + 2.2, 4.2), "M": (x + 0.2, 2.0, x + 2.0, 2.2), "B": (x, 0.0, x + 2.2, 0.2),
            "L": (x, 2.0, x + 0.2, 4.0), "l": (x, 0.2, x + 0.2, 2.0),
            "R": (x + 2.0, 2.0, x + 2.2, 4.0), "r": (x + 2.0, 0.2, x + 2.2, 2.0),
        }  # fmt: skip
        parts += [box(strokes[stroke], 0.0, CEILING) for stroke in CHARACTERS[each]]
    return level(parts)


def _outcomes(houses: Iterable[Level]) -> Counter[str]:
    """Count the houses with a plan, their plans, the doubtful plans, and the houses that are rejected, with reasons."""
    found = Counter[str]()
    for house in houses:
        try:
            results = plan_level(house, PipelineConfig(), np.random.default_rng(0))
        except Rejection as rejection:
            found.update(["rejected", rejection.reason.value])
            continue
        plans = [each for each in results if isinstance(each, FloorPlan)]
        found.update({"house": 1, "plan": len(plans), "doubtful": sum(map(_is_doubtful, plans))})
    return found


def _is_doubtful(plan: FloorPlan) -> bool:
    return plan.quality is not None and plan.quality.is_doubtful


def _table(title: str, *headings: str) -> Table:
    table = Table(title=title)
    for k, heading in enumerate(headings):
        table.add_column(heading, justify="right" if k else "left")
    return table


def _show(table: Table, total: Counter[str]) -> None:
    console = Console(width=120)
    console.print(table)
    console.print(dict(sorted(total.items())))
