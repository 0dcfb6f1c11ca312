"""Fit the curves of ``pipeline.sources.occupancy_map.narrow_places``, and print its table, to be put there by hand.

::

    python -m research.map_fit ../shared/data/maps/bormann --plans ../shared/data/houseexpo/plans_33717.jsonl.gz

The maps are Bormann's empty ones, for each of these ``--made`` maps with furniture and noise that the project adds and
``SEEN`` that PseudoSLAM makes of it, and maps that PseudoSLAM makes of the kit's offices and homes and of published
plans (``research.seen_maps``), of which every ``THIN``-th example counts. Each narrow place between basins is an
example: it separates rooms where the basins lie in different true rooms. Furnished and real maps are not read.
``--folds`` prints how good the fit is on Bormann's maps that were left out.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from unittest import mock

import numpy as np
import numpy.typing as npt
from rich.console import Console
from scipy.optimize import minimize

from pipeline.sources.occupancy_map import narrow_places, rooms
from pipeline.sources.occupancy_map.clutter import fill_clutter
from pipeline.sources.occupancy_map.narrow_places import Basins, NarrowPlaces, find_basins
from research.seen_maps import look_around, seen_maps
from tests.builders.matching import RoomScores, room_scores
from tests.builders.robot_maps import CELL_M, TrueMap, bormann_maps, furnished, noisy

Floats = npt.NDArray[np.float64]
RIDGE = 2.0
SEEN = 2
OFFICES, HOMES, PUBLISHED = 12, 40, 40
"""How many maps PseudoSLAM makes; of the published plans, fewer serve."""
THIN = 4


def made_maps(empty: TrueMap, count: int) -> Iterator[TrueMap]:
    """Yield an empty map, ``count`` maps made from it, every second one with noise, and those that a robot sees."""
    yield empty
    for k in range(count):
        rng = np.random.default_rng([k, *empty.name.encode()])
        made = furnished(empty, rng)
        yield noisy(made, rng) if k % 2 else made
    for k in range(SEEN):
        rng = np.random.default_rng([9, k, *empty.name.encode()])
        yield look_around(furnished(empty, rng) if k else empty, rng)


def examples(made: TrueMap) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """Return the rows of the design matrix, and whether each narrow place separates true rooms.

    Features are taken as they are at the start, and as they are where all that is one true room has been joined.
    """
    basins = find_basins(fill_clutter(made.free, CELL_M), CELL_M)
    count = len(basins.peak_m)
    shared = np.zeros((count, int(made.rooms.max()) + 1))
    np.add.at(shared, (basins.label.ravel(), made.rooms.ravel()), 1)
    shared[:, 0] = 0.25  # ties: a basin in no room
    room = shared.argmax(axis=1)
    sides = basins.narrows.sides
    known = (room[sides] > 0).all(axis=1)
    apart = room[sides[:, 0]] != room[sides[:, 1]]
    joined = _joined_by(basins, room)
    parts = [(basins.narrows.only(known), basins.peak_m, basins.area_m2, sides[known])]
    both = known & apart
    parts += [(basins.narrows.only(both), *joined, sides[both])]
    rows = [design(narrows, peaks[at], areas[at]) for narrows, peaks, areas, at in parts]
    return np.concatenate(rows), np.concatenate([apart[known], apart[both]])


def _joined_by(basins: Basins, room: npt.NDArray[np.int64]) -> tuple[Floats, Floats]:
    peak, area = np.zeros(room.max() + 1), np.zeros(room.max() + 1)
    np.maximum.at(peak, room, basins.peak_m)
    np.add.at(area, room, basins.area_m2)
    return peak[room], area[room]


def design(narrows: NarrowPlaces, peaks: Floats, areas: Floats) -> Floats:
    """Return for each narrow place and knot the weight of the knot (hat functions), after a column of ones."""
    found = narrow_places.narrow_place_features(narrows, peaks, areas)
    columns = [np.ones(len(peaks))]
    for name, knots in narrow_places.KNOTS.items():
        columns += [np.interp(found[name], knots, one) for one in np.eye(len(knots))]
    return np.stack(columns, axis=1)


def fit(rows: Floats, apart: npt.NDArray[np.bool_]) -> Floats:
    """Return weights by ridge logistic regression; neighbouring knots of a curve are drawn together."""
    pull = np.zeros((rows.shape[1],) * 2)
    at = 1
    for knots in narrow_places.KNOTS.values():
        steps = np.diff(np.eye(len(knots)), axis=0)
        pull[at : at + len(knots), at : at + len(knots)] = steps.T @ steps + 0.05 * np.eye(len(knots))
        at += len(knots)
    pull *= RIDGE

    def loss(weights: Floats) -> tuple[float, Floats]:
        odds_ = rows @ weights
        slope = rows.T @ (1 / (1 + np.exp(-odds_)) - apart) + pull @ weights
        return float((np.logaddexp(0, odds_) - apart * odds_).sum() + weights @ pull @ weights / 2), slope

    found: Floats = minimize(loss, np.zeros(rows.shape[1]), jac=True, method="L-BFGS-B", options={"maxiter": 2000}).x
    return found


def curves_of(weights: Floats) -> dict[str, tuple[float, ...]]:
    """Return the weights of the knots of each curve, which follow the bias."""
    ends = np.cumsum([1, *map(len, narrow_places.KNOTS.values())])
    pairs = zip(narrow_places.KNOTS, np.split(weights, ends)[1:], strict=False)
    return {name: tuple(part.tolist()) for name, part in pairs}


def using(weights: Floats) -> mock._patch_dict:
    """Have the weights used instead of the module's."""
    return mock.patch.dict(vars(narrow_places), SEPARATION_BIAS=float(weights[0]), CURVES=curves_of(weights))


def scores(made: TrueMap) -> RoomScores:
    """Return how good the rooms of a map are, measured on its free cells."""
    parts = rooms.segment_rooms(made.free, CELL_M, occupied=made.occupied)
    label = parts.to_cells(parts.label, made.free.shape)
    return room_scores(np.where(made.free, label, 0), made.rooms)


def main() -> None:
    """Print the table, and the cross-validation."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--plans", type=Path, help="published plans, JSON lines with gzip")
    parser.add_argument("--made", type=int, default=4)
    parser.add_argument("--folds", type=int, default=0)
    given = parser.parse_args()
    console = Console(soft_wrap=True, markup=False)
    maps = [list(made_maps(empty, given.made)) for empty in bormann_maps(given.folder)]
    known = [[examples(made) for made in family] for family in maps]
    others = seen_maps(given.plans, OFFICES, HOMES, PUBLISHED) if given.plans else ()
    thinned = [(rows[::THIN], apart[::THIN]) for rows, apart in map(examples, others)]

    def fit_on(kept: list[int]) -> Floats:
        pairs = [pair for k in kept for pair in known[k]] + thinned
        return fit(np.concatenate([rows for rows, _ in pairs]), np.concatenate([apart for _, apart in pairs]))

    shown: dict[str, list[RoomScores]] = {}
    for fold in range(given.folds):
        left_out = list(range(fold, len(maps), given.folds))
        with using(fit_on([k for k in range(len(maps)) if k not in left_out])):
            for made in (made for k in left_out for made in maps[k]):
                kind = " ".join(["empty", *made.name.split()[1:]])
                shown.setdefault(kind, []).append(scores(made))
    for kind, rows in shown.items():
        means = np.mean([list(vars(each).values()) for each in rows], axis=0)
        pairs = zip(RoomScores.__dataclass_fields__, means, strict=True)
        told = (f"{name} {100 * value:.2f}" for name, value in pairs if name not in {"found", "true"})
        console.print(f"left out, {kind}:", *told)
    weights = fit_on(list(range(len(maps))))
    console.print(f"SEPARATION_BIAS: Final = {weights[0]:.3f}\nCURVES: Final[dict[str, tuple[float, ...]]] = {{")
    for name, curve in curves_of(weights).items():
        console.print(f'    "{name}": ({", ".join(f"{value:.2f}" for value in curve)}),')
    console.print("}")


if __name__ == "__main__":
    main()
