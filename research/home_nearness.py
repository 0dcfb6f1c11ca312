"""Which made homes are nearer to a published plan than they may be; what it prints is an overrides file.

    python -m research.home_nearness plans/free35k plans_33717.jsonl.gz > free35k.overrides.toml

The measure is that of the stage dedupe. Beside its manifest the file has the next build leave these homes out, and with
them their duplicates, which would come in their places.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from houseexpo import Dataset, open_dataset
from houseexpo.analysis.similarity import SimilarPair, find_similar_pairs
from houseexpo.floorplan import FloorPlan

NEAREST = 0.05
HEAD = f"""\
# Homes that lie nearer than {NEAREST:g} to a published plan, as the stage dedupe measures it, and their duplicates;
# made by python -m research.home_nearness
"""


def near_published(made: Dataset, published: Dataset, limit: float = NEAREST) -> dict[str, tuple[str, float]]:
    """Return the made plans that lie within ``limit`` of a published one: id -> (the nearest one's id, difference)."""
    theirs, ours = list(published.ids), list(made.ids)

    def load(number: int) -> FloorPlan:
        return published[theirs[number]] if number < len(theirs) else made[ours[number - len(theirs)]]

    known = find_similar_pairs(load, len(theirs), threshold=0.0)
    pairs = find_similar_pairs(load, len(theirs) + len(ours), threshold=limit, known=known).pairs
    found: dict[str, SimilarPair] = {}
    for pair in sorted(pairs, key=lambda pair: -pair.difference):
        if pair.first < len(theirs) <= pair.second:
            found[ours[pair.second - len(theirs)]] = pair
    return {name: (theirs[pair.first], pair.difference) for name, pair in sorted(found.items())}


def duplicates(folder: Path) -> dict[str, str]:
    """Return the homes that a build dropped as duplicates: id -> that of the one it kept."""
    lines = map(json.loads, (folder / "duplicates.jsonl").read_text().splitlines())
    return {line["id"]: line["kept_id"] for line in lines}


def main() -> None:
    """Print a table for each home to leave out."""
    made, published = (open_dataset(Path(name)) for name in sys.argv[1:3])
    near = near_published(made, published)
    why = {name: f"{difference:.3f} from published {other[:8]}" for name, (other, difference) in near.items()}
    why |= {name: f"a duplicate of {kept[:8]}" for name, kept in duplicates(made.path).items() if kept in near}
    sys.stdout.write(HEAD)
    for name, reason in sorted(why.items()):
        sys.stdout.write(f'[{name}]\ndrop = true\nwhy = "{reason}"\n')


if __name__ == "__main__":
    main()
