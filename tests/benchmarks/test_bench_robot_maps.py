"""Rooms and doors of robots' maps, measured as ROSE2's evaluator does, beside the figures that ROSE2 publishes.

The maps lie in ``../shared/data/maps``: Bormann's 20 (empty, furnished, with trash bins, with both) and ROSE2's 11,
most of which a robot made. The segmentation was fitted on Bormann's empty maps and on maps that the project makes of
these (``python -m research.map_fit``): the row "empty" shows its own examples; the furnished and the real maps judge
it.

ROSE2's rooms are pictures in which the free cells of the map are coloured, and the truth of its own maps covers free
cells alone, which are all that are lighter than 229 and than unknown space. So the rooms are first measured on the free
cells of each map. The row "whole rooms" measures them with what stands in them: Bormann's truth includes the furniture,
ROSE2's does not.
Doors are Bormann's strokes that close them; a door counts as found 0.5 m from a true one at most.
"""

from __future__ import annotations

import resource
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from houseexpo import FloorPlan
from pipeline.sources.occupancy_map.rooms import segment_rooms
from tests.builders.matching import RoomScores, found_near, room_scores
from tests.builders.robot_maps import CELL_M, TrueMap, bormann_maps, rose_maps, true_doors
from tests.builders.shared import DATA, needs_shared

MAPS = DATA / "maps"
MEASURES = tuple(name for name in RoomScores.__dataclass_fields__ if name not in {"found", "true"})
PUBLISHED = {
    "empty": (93.3, 86.6, 97.6, 96.3, 86.2, 74.1, 77.4, 62.2),
    "_furnitures": (93.5, 85.4, 91.0, 89.7, 79.1, 65.8, 71.8, 53.4),
    "real": (89.0, 82.2, 93.9, 88.1, 73.3, 57.9, 68.8, 52.9),
}
"""ROSE2's ("geometrical") in percent, from the tables of declutter-reconstruct."""
NEAR_M = 0.5


def maps_of(kind: str) -> Iterator[TrueMap]:
    """Yield the maps of a row of the table."""
    return rose_maps(MAPS / "rose") if kind == "real" else bormann_maps(MAPS / "bormann", kind.removeprefix("empty"))


@needs_shared
def test_rooms_and_doors_by_the_measures_of_rose2() -> None:
    table = Table(title="Rooms of robots' maps, % (ROSE2's measures; 'micro' is the mean over rooms, 'macro' by area)")
    for heading in ("maps", "n", *(name.replace("_", " ") for name in MEASURES), "doors: recall / precision", "s"):
        table.add_column(heading, justify="right" if heading != "maps" else "left")
    for kind in ("empty", "_furnitures", "_trashbins", "_furnitures_trashbins", "real"):
        rows, whole, seconds, counts = [], [], [], np.zeros(3, int)
        for made in maps_of(kind):
            start = time.perf_counter()
            parts = segment_rooms(made.free, CELL_M, occupied=made.occupied)
            seconds.append(time.perf_counter() - start)
            label = parts.to_cells(parts.label, made.free.shape)
            coloured = made.free if made.coloured is None else made.coloured
            for kept, found in ((rows, np.where(coloured, label, 0)), (whole, label)):
                scores = room_scores(found, made.rooms)
                kept.append([100 * getattr(scores, name) for name in MEASURES])
            if kind != "real":
                doors = np.array([way.jambs.mean(axis=0) for way in parts.ways]).reshape(-1, 2)
                true = true_doors(made)
                counts += (found_near(true * CELL_M, doors * CELL_M, NEAR_M), len(true), len(doors))
        shown = f"{100 * counts[0] / counts[1]:.0f} / {100 * counts[0] / counts[2]:.0f}" if counts[1] else "-"
        figures = (f"{value:.1f}" for value in np.mean(rows, axis=0))
        table.add_row(kind.strip("_"), str(len(rows)), *figures, shown, f"{np.median(seconds):.2f}")
        table.add_row("  whole rooms", "", *(f"{value:.1f}" for value in np.mean(whole, axis=0)), "", "")
        if kind in PUBLISHED:
            table.add_row("  ROSE2", "", *(f"{value:.1f}" for value in PUBLISHED[kind]), "", "")
    Console(width=180).print(table)


@needs_shared
def test_a_map_of_4000_by_4000_cells(tmp_path: Path) -> None:
    """Tile a map of Bormann's: the processor time and the memory of a whole plan, in a process of its own."""
    from multiprocessing import get_context

    small = next(made for made in bormann_maps(MAPS / "bormann") if made.name == "lab_ipa").free
    free = np.tile(small, (4000 // small.shape[0] + 1, 4000 // small.shape[1] + 1))[:4000, :4000]
    np.save(tmp_path / "large.npy", np.where(free, 0, 100).astype(np.int8))
    with get_context("spawn").Pool(1) as pool:
        read_s, whole_s, megabytes, rooms = pool.apply(_planned, (tmp_path / "large.npy",))
    said = f"read in {read_s:.1f} s, planned after {whole_s:.1f} s, {megabytes:,.0f} MB, {rooms} rooms"
    Console(soft_wrap=True).print(f"4,000 x 4,000 cells: {said}")


def _planned(path: Path) -> tuple[float, float, float, int]:
    from pipeline.algorithm import plan_level
    from pipeline.config import PipelineConfig
    from pipeline.sources import find, reader

    start = time.process_time()
    (item,) = find(str(path), resolution=str(CELL_M))
    (level,) = reader(item.reader).read(item)
    read_s = time.process_time() - start
    plans = plan_level(level, PipelineConfig(), np.random.default_rng(0))
    rooms = sum(len(plan.rooms) for plan in plans if isinstance(plan, FloorPlan))
    megabytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return read_s, time.process_time() - start, megabytes, rooms
