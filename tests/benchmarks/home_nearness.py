"""Which made homes are nearer to a published plan than they may be; what it prints is an overrides file.

    python -m tests.benchmarks.home_nearness datasets/free35k plans_33717.jsonl.gz > free35k.overrides.toml

The measure is that of the stage dedupe. Beside its manifest the file has the next build leave these homes out.
"""

from __future__ import annotations

import sys
from pathlib import Path

from houseexpo import Dataset, open_dataset
from houseexpo.floorplan import FloorPlan
from pipeline.config import DedupeConfig
from pipeline.stages.dedupe import Pair, compared

NEAREST = 0.05


def near_published(made: Dataset, published: Dataset, limit: float = NEAREST) -> dict[str, tuple[str, float]]:
    """Return the made plans that lie within ``limit`` of a published one: id -> (the nearest one's id, difference)."""
    theirs, ours = list(published.ids), list(made.ids)

    def load(number: int) -> FloorPlan:
        return published[theirs[number]] if number < len(theirs) else made[ours[number - len(theirs)]]

    config = DedupeConfig(threshold=limit)
    known = compared(load, len(theirs), DedupeConfig(threshold=0.0))
    pairs = compared(load, len(theirs) + len(ours), config, known).pairs
    found: dict[str, Pair] = {}
    for pair in sorted(pairs, key=lambda pair: -pair.difference):
        if pair.first < len(theirs) <= pair.second:
            found[ours[pair.second - len(theirs)]] = pair
    return {name: (theirs[pair.first], pair.difference) for name, pair in sorted(found.items())}


def main() -> None:
    """Print a table for each home to leave out."""
    made, published = (open_dataset(Path(name)) for name in sys.argv[1:3])
    for name, (other, difference) in near_published(made, published).items():
        sys.stdout.write(f'[{name}]\ndrop = true\nwhy = "{difference:.3f} from published {other[:8]}"\n')


if __name__ == "__main__":
    main()
