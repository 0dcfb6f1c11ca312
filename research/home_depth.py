"""How many doors lead from a room called Entryway to the farthest room, in made homes and in published plans.

    python -m research.home_depth plans/free35k plans_33717.jsonl.gz [HOUSES]

Some 2% of plans have such a room, so that the 2,000 of ``home_comparison`` have 40: two draws of 40 published plans are
0.24 deviations apart in the median. Here up to HOUSES of each are looked at, 1,000 by default.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.stats import wasserstein_distance

from houseexpo import open_dataset
from houseexpo.analysis.measures import BY_NAME
from houseexpo.inference import with_rooms
from research.home_measures import as_published

HOUSES, ENTRANCE = 1000, "Entryway"


def depths(path: Path) -> Iterator[tuple[int, int]]:
    """Yield the depth and the rooms of each plan that has an entrance, looked at in the published form."""
    for plan in open_dataset(path).select(labels=[ENTRANCE]):
        found = with_rooms(as_published(plan))
        for depth in BY_NAME["depth"].numbers(found):
            yield int(depth), len(found.rooms)


def main() -> None:
    """Print the means and the distance."""
    most = int(sys.argv[3]) if len(sys.argv) > 3 else HOUSES
    made, published = (np.array(list(islice(depths(Path(name)), most))) for name in sys.argv[1:3])
    table = Table(title=f"Doors from the {ENTRANCE} to the farthest room")
    for heading in ("", "plans", "depth", "rooms"):
        table.add_column(heading, justify="right" if heading else "left")
    for name, rows in (("made", made), ("published", published)):
        table.add_row(name, str(len(rows)), *(f"{mean:.2f}" for mean in rows.mean(axis=0)))
    Console().print(table)
    distance = wasserstein_distance(made[:, 0], published[:, 0]) / np.std(published[:, 0])
    Console().print(f"{distance:.3f} deviations apart (asked: 0.15)")


if __name__ == "__main__":
    main()
