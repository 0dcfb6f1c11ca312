"""List plans of a data set that are as large as those of another: ``python -m research.home_sizes HOMES PLANS COUNT``.

Each is the plan of HOMES whose area is nearest to that of a random plan of PLANS, none twice; where PLANS has larger
plans than HOMES, the largest are taken. In ``HOMES/splits/NAME.txt``, the ids are a list that a training may name.
"""

from __future__ import annotations

import sys

import numpy as np

from houseexpo import open_dataset


def list_by_size(homes: str, plans: str, count: int, seed: int = 0) -> list[str]:
    """Return ``count`` ids of the first data set, at most as many as it has."""
    found, wanted = open_dataset(homes), open_dataset(plans)
    areas = np.array([plan.area for plan in found])
    aims = np.array([plan.area for plan in wanted])
    free = np.ones(len(areas), dtype=bool)
    chosen = []
    for aim in np.random.default_rng(seed).choice(aims, min(count, len(areas)), replace=False):
        nearest = int(np.argmin(np.where(free, np.abs(areas - aim), np.inf)))
        free[nearest] = False
        chosen.append(found.ids[nearest])
    return sorted(chosen)


if __name__ == "__main__":
    sys.stdout.write("\n".join(list_by_size(sys.argv[1], sys.argv[2], int(sys.argv[3]))) + "\n")
