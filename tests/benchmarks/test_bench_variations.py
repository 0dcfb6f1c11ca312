"""Whether a house keeps its rooms and doors when it is written as other people would write it.

Each variation (``tests/builders/variations.py``) changes what does not change the plan: the order of the faces, their
winding and size, names, units, axis, a roof, terrain. The last rows take a wall away, or cut all walls at 1.2 m: there
the house should still be planned, but its outer doors, or its openings, cannot be the same. The houses are those of the
kit and, with ``HOUSEEXPO_CORPUS``, mesh files of the corpus' first half whose plans are right: those of several rooms
first, then the small ones::

    python -m pytest -s tests/benchmarks/test_bench_variations.py --benchmarks --members 8
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console
from rich.table import Table

from houseexpo import FloorPlan
from pipeline.algorithm import plan_level
from pipeline.config import PipelineConfig
from pipeline.executors.local import Failure, Limits, run
from pipeline.rejection import Rejection
from pipeline.sources.meshes.formats import SUFFIXES
from tests.builders.kinds.registry import make_member
from tests.builders.variations import VARIATIONS, VariedHouse, house_of, levels_of
from tests.corpus import manifest

WORKERS = 2
LIMITS = Limits(seconds=900.0, memory=8 << 30)
KINDS = ("artist_named", "artist_unnamed", "solids")
MOST_MEMBERS = 10
LARGEST_FILE = 2 << 20
MOST_FILES = 60

Counts = list[tuple[int, int]]
"""Rooms and doors of each plan, sorted."""


def test_variations_of_the_kit(tmp_path: Path, request: pytest.FixtureRequest) -> None:
    option = request.config.getoption
    kinds = option("--kinds").split(",") if option("--kinds") else KINDS
    members = min(option("--members"), MOST_MEMBERS)
    made = [make_member(kind, number, option("--seed"), tmp_path / kind) for kind in kinds for number in range(members)]
    meshes = [member.path for member in made if member.path.suffix in SUFFIXES]
    Console(width=110).print(table("Made houses", list(counted(meshes))))
    assert meshes


def test_variations_of_the_corpus() -> None:
    if not (folder := os.environ.get("HOUSEEXPO_CORPUS")):
        pytest.skip("HOUSEEXPO_CORPUS names no folder of checkouts")
    files = [file for file in manifest.load() if file.half == 1 and file.verdict == manifest.Verdict.RIGHT]
    places = {file.place(Path(folder)): rooms_seen(file) for file in files if file.is_in(Path(folder))}
    meshes = [path for path in places if path.suffix in SUFFIXES and path.stat().st_size < LARGEST_FILE]
    meshes.sort(key=lambda path: (places[path] < 2, path.stat().st_size))
    Console(width=110).print(table("Right files of the corpus' first half", list(counted(meshes[:MOST_FILES]))))


def rooms_seen(file: manifest.File) -> int:
    """Return how many rooms the plans of a file had when they were judged."""
    return sum(int(line.split(" rooms")[0]) for line in file.seen if " rooms" in line)


def counted(meshes: list[Path]) -> Iterator[dict[str, Counts]]:
    """The counts of each file's variations."""
    for _, found in run(counts_of, meshes, workers=WORKERS, limits=LIMITS):
        if not isinstance(found, Failure) and found:
            yield found


def counts_of(path: Path) -> dict[str, Counts]:
    """The counts of each variation of a house that stands in the file; empty where there is none."""
    try:
        house = house_of(path)
    except Rejection:
        return {}
    as_it_is = count(house)
    if not as_it_is:
        return {}
    varied = partial(_count_varied, house)
    return {name: as_it_is if name == "as it is" else varied(name) for name in VARIATIONS}


def _count_varied(house: VariedHouse, name: str) -> Counts:
    return count(VARIATIONS[name](house))


def count(house: VariedHouse) -> Counts:
    """Count the rooms and doors of each plan of a house; none where it is rejected."""
    found = []
    try:
        for level in levels_of(house):
            try:
                plans = plan_level(level, PipelineConfig(), np.random.default_rng(0))
            except Rejection:
                continue
            found += [(len(plan.rooms), len(plan.doors)) for plan in plans if isinstance(plan, FloorPlan)]
    except Rejection:
        return []
    return sorted(found)


def table(title: str, found: list[dict[str, Counts]]) -> Table:
    """One row a variation: houses that are planned, with as many rooms, with as many rooms and doors."""
    made = Table(title=f"{title} ({len(found)})")
    for k, heading in enumerate(("variation", "planned", "same rooms", "same rooms and doors")):
        made.add_column(heading, justify="left" if k == 0 else "right")
    for name in VARIATIONS:
        pairs = [(each["as it is"], each[name]) for each in found]
        planned = sum(bool(now) for _, now in pairs)
        rooms = sum([r for r, _ in before] == [r for r, _ in now] for before, now in pairs)
        same = sum(before == now for before, now in pairs)
        made.add_row(name, str(planned), str(rooms), str(same))
    return made
