"""Writes the table that homes are drawn from: distributions of published plans, never a plan.

    python -m research.home_statistics plans_33717.jsonl.gz [PLANS]

Of every kind of house (by its number of spaces) it keeps quantiles of each number and the correlations between them;
of every label how large its rooms are, as a share of the mean room; and the kinds of ``home_kinds``.
"""

from __future__ import annotations

import gzip
import json
import sys
from collections import Counter, defaultdict
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.special import ndtri
from scipy.stats import rankdata

from houseexpo.errors import PlanError
from houseexpo.floorplan import decode
from pipeline.sources.homes.wishes import COUNTED, NUMBERS, STRATA, TABLE, stratum_index
from research.home_kinds import door_kinds, house_kinds
from research.home_measures import Seen, measure_plan

SEED = 17
USUAL_WALL_M = 0.1
"""Of a house without doors."""
SHARES = [0.001, 0.005, 0.01, *np.linspace(0.02, 0.98, 33).round(4).tolist(), 0.99, 0.995, 0.999]
FEW = 20
MOST_SPACES = 30
"""Larger houses, one in a thousand, are left out."""


def measure_published(path: Path, count: int, *, last: bool = False) -> list[Seen]:
    """Measure ``count`` published plans, drawn at random; those that cannot be repaired are left out.

    The table is made of the first ones of a drawn order; ``last`` takes others, the last ones.
    """
    with gzip.open(path) as stream:
        lines = stream.readlines()
    chosen = np.random.default_rng(SEED).permutation(len(lines))
    chosen = chosen[-count:] if last else chosen[:count]
    found = []
    for k in sorted(chosen.tolist()):
        try:
            found.append(measure_plan(decode(lines[k])))
        except PlanError:
            continue
    return found


def numbers_of(house: Seen) -> list[float]:
    """Return a house's numbers in the order of ``COUNTED`` and ``NUMBERS``."""
    first = {name: values[0] for name, values in house.numbers.items() if values}
    spaces = first["rooms_found"]
    return [
        spaces,
        first["rooms"],
        first["unlabelled"],
        first["area_m2"],
        first["short_side_m"] / first["long_side_m"],
        first["extent"],
        first["corners"] - 8 * spaces + 4,
        first["oblique_share"],
        float(np.median(house.numbers["wall_m"] or [USUAL_WALL_M])),
        float(np.std(house.numbers["room_area_m2"]) / np.mean(house.numbers["room_area_m2"])),
        float(np.min(house.numbers["room_area_m2"]) / np.mean(house.numbers["room_area_m2"])),
    ]


def table_of(houses: list[Seen]) -> dict[str, object]:
    """Return the table's plain values."""
    houses = [house for house in houses if house.numbers["rooms_found"][0] <= MOST_SPACES]
    strata = np.array([stratum_index(int(house.numbers["rooms_found"][0])) for house in houses])
    rows = np.array([numbers_of(house) for house in houses])
    counts = Counter(
        tuple(int(house.numbers[name][0]) for name in ("rooms_found", "rooms", "label_boxes", "unlabelled"))
        for house in houses
    )
    jitter = np.random.default_rng(SEED).uniform(-1e-6, 1e-6, rows.shape)  # whole numbers have ties
    scores = np.zeros(rows.shape)
    for k in range(len(STRATA)):
        own = strata == k
        scores[own] = ndtri((rankdata((rows + jitter)[own], axis=0) - 0.5) / own.sum())
    doors = door_kinds([house.numbers["clear_m"] for house in houses], strata)
    return {
        "plans": len(houses),
        "shares": SHARES,
        "houses": sorted([*house, n] for house, n in counts.items()),
        "strata": [_quantiles(rows[strata == k]) for k in range(len(STRATA))],
        "kinds": house_kinds([house.labels for house in houses], scores, strata, doors.likely),
        "door_kinds": doors.table,
        "sides_cm": {name: _centimetres(houses, name) for name in ("long_side_m", "short_side_m")},
        "room_areas": _areas(houses),
        "hubs": _hubs(houses),
    }


def _quantiles(rows: npt.NDArray[np.float64]) -> dict[str, list[float]]:
    """Quantiles of each number of a stratum."""
    found = np.quantile(rows, SHARES, axis=0, method="closest_observation").T
    return {
        name: [float(f"{value:.4g}") for value in values]
        for name, values in zip((*COUNTED, *NUMBERS), found.tolist(), strict=True)
    }


def _centimetres(houses: list[Seen], name: str) -> list[list[int]]:
    """[centimetres, how many houses], ascending: floor planners' own sizes of rooms show in the sides of houses."""
    counts = Counter(round(house.numbers[name][0] * 100) for house in houses)
    return [[value, n] for value, n in sorted(counts.items())]


def _areas(houses: list[Seen]) -> dict[str, list[float]]:
    """How log(room) follows log(mean room of its house), by label: level, slope and what is left (its deviation)."""
    points = defaultdict(list)
    for house in houses:
        mean = float(np.log(np.mean(house.numbers["room_area_m2"])))
        if len(house.numbers["room_area_m2"]) > 2:
            for label, areas in house.areas.items():
                points[label] += [(mean, float(np.log(area))) for area in areas]
    found = {}
    for label, values in sorted(points.items()):
        x, y = np.array(values).T
        slope = float(np.clip(np.polyfit(x, y, 1)[0], 0.2, 1.6)) if len(x) > FEW else 1.0
        rest = y - slope * x
        found[label] = [round(float(rest.mean()), 3), round(slope, 3), round(float(rest.std()), 3)]
    return found


def _hubs(houses: list[Seen]) -> dict[str, float]:
    """Doors of a room beyond the mean of its house, by label."""
    beyond = defaultdict(list)
    for house in houses:
        for label, degrees in house.degrees.items():
            beyond[label] += [degree - float(np.mean(house.numbers["doors_per_room"])) for degree in degrees]
    return {label: round(float(np.mean(values)), 3) for label, values in sorted(beyond.items()) if len(values) > FEW}


def main() -> None:
    """Measure and write."""
    path, count = Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 12000
    TABLE.write_text(json.dumps(table_of(measure_published(path, count)), separators=(",", ":")) + "\n")


if __name__ == "__main__":
    main()
