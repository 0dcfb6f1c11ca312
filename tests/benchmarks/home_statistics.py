"""Writes the table that homes are drawn from: distributions of published plans, never a plan.

    python -m tests.benchmarks.home_statistics plans_33717.jsonl.gz [PLANS]

Of every kind of house (by its number of spaces) it keeps quantiles of each number and the correlations between them;
of every label how often a house has it and how large its rooms are, as a share of the mean room.
"""

from __future__ import annotations

import gzip
import json
import sys
from collections import Counter, defaultdict
from pathlib import Path

import numpy as np
from scipy.special import ndtri
from scipy.stats import rankdata

from houseexpo.errors import PlanError
from houseexpo.floorplan import decode
from pipeline.sources.homes.wishes import NUMBERS, STRATA, TABLE, stratum_of
from tests.benchmarks.home_measures import Seen, seen

SEED = 17
USUAL_WALL_M, USUAL_DOOR_M = 0.1, 0.75
"""Of a house without doors."""
SHARES = [0.001, 0.005, 0.01, *np.linspace(0.02, 0.98, 33).round(4).tolist(), 0.99, 0.995, 0.999]
FEW, NARROWEST_M = 20, 0.5
MAX_OF_ONE = 8
"""A house has so many rooms of one label at most, in the table."""


def published(path: Path, count: int, *, last: bool = False) -> list[Seen]:
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
            found.append(seen(decode(lines[k])))
        except PlanError:
            continue
    return found


def numbers_of(house: Seen) -> list[float]:
    """Return a house's numbers in the order of ``NUMBERS``."""
    first = {name: values[0] for name, values in house.numbers.items() if values}
    spaces = first["rooms_found"]
    return [
        first["rooms"],
        first["label_boxes"],
        first["unlabelled"],
        first["area_m2"],
        first["short_side_m"] / first["long_side_m"],
        first["extent"],
        first["corners"] - 8 * spaces + 4,
        first["oblique_share"],
        float(np.median(house.numbers["wall_m"] or [USUAL_WALL_M])),
        *doors_of([width for width in house.numbers["door_width_m"] if width >= NARROWEST_M] or [USUAL_DOOR_M]),
        float(np.std(house.numbers["room_area_m2"]) / np.mean(house.numbers["room_area_m2"])),
        float(np.min(house.numbers["room_area_m2"]) / np.mean(house.numbers["room_area_m2"])),
    ]


def doors_of(widths: list[float]) -> tuple[float, float, float]:
    """Return the narrowest width, how much wider the widest is, and where the mean is between them, 0 to 1."""
    least, range_m = min(widths), max(widths) - min(widths)
    return least, range_m, (float(np.mean(widths)) - least) / range_m if range_m else 0.5


def table_of(houses: list[Seen]) -> dict[str, object]:
    """Return the table's plain values."""
    spaces = np.array([int(house.numbers["rooms_found"][0]) for house in houses])
    counts = np.bincount(spaces, minlength=31)[:31]
    strata = []
    for k in range(len(STRATA)):
        rows = np.array([numbers_of(h) for h, n in zip(houses, spaces, strict=True) if stratum_of(int(n)) == k])
        jitter = np.random.default_rng(SEED).uniform(-1e-6, 1e-6, rows.shape)  # whole numbers have ties
        scores = ndtri((rankdata(rows + jitter, axis=0) - 0.5) / len(rows))
        strata.append(
            {
                "quantiles": {
                    name: [float(f"{v:.4g}") for v in np.quantile(rows[:, i], SHARES, method="closest_observation")]
                    for i, name in enumerate(NUMBERS)
                },
                "correlations": np.corrcoef(scores.T).round(3).tolist(),
            }
        )
    return {
        "plans": len(houses),
        "shares": SHARES,
        "spaces": counts.tolist(),
        "strata": strata,
        "labels": _labels(houses),
        "room_areas": _areas(houses),
        "hubs": _hubs(houses),
        "door_widths_m": _widths(houses),
    }


def _labels(houses: list[Seen]) -> dict[str, list[list[float]]]:
    """Of every label and stratum by boxes: in what share of houses it occurs 0, 1, 2 ... times."""
    counts: dict[str, np.ndarray] = defaultdict(lambda: np.zeros((len(STRATA), MAX_OF_ONE + 1)))
    totals = np.zeros(len(STRATA))
    for house in houses:
        k = stratum_of(int(house.numbers["label_boxes"][0]))
        totals[k] += 1
        for label, n in house.labels.items():
            counts[label][k, min(n, MAX_OF_ONE)] += 1
    found = {}
    for label, table in sorted(counts.items()):
        table[:, 0] = totals - table[:, 1:].sum(axis=1)
        found[label] = (table / np.maximum(totals, 1)[:, None]).round(4).tolist()
    return found


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


def _widths(houses: list[Seen]) -> dict[str, float]:
    """Shares of the clear widths of doors, to the centimetre, without those that a robot of 0.2 m hardly passes."""
    counts = Counter(round(w, 2) for h in houses for w in h.numbers["door_width_m"] if w >= NARROWEST_M)
    return {f"{width:.2f}": round(n / counts.total(), 5) for width, n in sorted(counts.items())}


def main() -> None:
    """Measure and write."""
    path, count = Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 8000
    TABLE.write_text(json.dumps(table_of(published(path, count)), separators=(",", ":")) + "\n")


if __name__ == "__main__":
    main()
