"""Whether published plans show stairs or courtyards: labels, holes, and walls that go in steps.

python -m research.home_traces plans_33717.jsonl.gz
"""

from __future__ import annotations

import gzip
import sys
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import numpy.typing as npt
import shapely

from houseexpo.errors import PlanError
from houseexpo.floorplan import FloorPlan, decode

STRAIGHT_M = 0.03
TREAD_M = (0.12, 0.5)
"""A step of a stair, as deep or as high as a wall would show it."""
LEAST_HOLE_M2 = 0.01


def steps(ring: npt.NDArray[np.float64]) -> int:
    """Return the most edges in a row that are as long as a tread and turn one way, then the other; points (n, 2)."""
    step = np.roll(ring, -1, axis=0) - ring
    length, after = np.hypot(*step.T), np.roll(step, -1, axis=0)
    left = step[:, 0] * after[:, 1] > step[:, 1] * after[:, 0]  # at an edge's end
    fits = (length >= TREAD_M[0]) & (length <= TREAD_M[1]) & (left != np.roll(left, 1))
    longest = run = 0
    for fit in np.tile(fits, 2).tolist():
        run = run + 1 if fit else 0
        longest = max(longest, run)
    return min(longest, len(ring))


def longest_stair(plan: FloorPlan) -> int:
    """Return the most steps in a row of a plan's straightened rings."""
    rings = shapely.get_rings(shapely.get_parts(shapely.simplify(plan.free_space, STRAIGHT_M)))
    return max((steps(shapely.get_coordinates(ring)[:-1]) for ring in rings), default=0)


def has_hole(plan: FloorPlan) -> bool:
    """Whether something stands free in a plan: a courtyard, a core, a pillar."""
    rings = [ring for part in shapely.get_parts(plan.free_space) for ring in part.interiors]
    return any(shapely.area(shapely.polygons(ring)) > LEAST_HOLE_M2 for ring in rings)


def traces(lines: Iterable[bytes]) -> tuple[Counter[str], int, Counter[int]]:
    """Return how many plans have each label, how many have a hole, and how many have each longest run of steps."""
    labels: Counter[str] = Counter()
    runs: Counter[int] = Counter()
    holes = 0
    for line in lines:
        try:
            plan = decode(line)
            holes += has_hole(plan)
        except PlanError:
            continue
        labels.update(plan.room_category.keys())
        runs[longest_stair(plan)] += 1
    return labels, holes, runs


def main() -> None:
    """Count and print."""
    with gzip.open(Path(sys.argv[1])) as stream:
        labels, holes, runs = traces(stream)
    sys.stdout.write(f"plans: {runs.total()}\nlabels: {dict(labels.most_common())}\n")
    sys.stdout.write(f"with a hole: {holes}\nlongest run of steps: {dict(sorted(runs.items()))}\n")


if __name__ == "__main__":
    main()
