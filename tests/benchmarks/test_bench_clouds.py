"""Point clouds of made homes, measured as Structured3D's evaluators do, beside what a network reaches there.

The data differ: Structured3D's clouds are of other, mostly furnished flats, and the network was trained on 3,000 of
them. The figures say what the measure means, not which method is better.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import pytest
import shapely
from rich.console import Console
from rich.table import Table

from pipeline.executors.local import Failure, Limits, run
from tests.builders.kinds.measuring import plans_of
from tests.builders.kinds.registry import make_member
from tests.builders.structured3d import MARGIN, PIXELS, Counts, compare

KINDS = ("cloud0", "cloud5", "cloud20")
MEASURES = ("room", "corner", "angle")
PUBLISHED = {
    "RoomFormer (2023), Structured3D": (97.9, 96.7, 89.1, 85.3, 83.0, 79.5),
}
"""Precision and recall in percent, as their papers say, of rooms, corners and angles."""
WORKERS, LIMITS = 2, Limits(seconds=120.0, memory=8 << 30)


def test_clouds_by_the_measures_of_structured3d(tmp_path: Path, request: pytest.FixtureRequest) -> None:
    members = request.config.getoption("--members")
    tasks = [(kind, number) for kind in KINDS for number in range(members)]
    work = partial(measured, seed=request.config.getoption("--seed"), folder=tmp_path)
    counts = {kind: {measure: Counts() for measure in MEASURES} for kind in KINDS}
    for (kind, _), result in run(work, tasks, workers=WORKERS, limits=LIMITS):
        assert not isinstance(result, Failure), result
        for measure in MEASURES:
            counts[kind][measure] += result[measure]
    table = Table(title=f"Rooms, corners and angles of {members} clouds each (precision / recall in %)")
    for heading in ("", *MEASURES):
        table.add_column(heading, justify="right" if heading else "left")
    for kind, each in counts.items():
        cells = (f"{100 * each[m].precision:.1f} / {100 * each[m].recall:.1f}" for m in MEASURES)
        table.add_row(f"{kind}, made homes", *cells)
    for name, figures in PUBLISHED.items():
        table.add_row(name, *(f"{a} / {b}" for a, b in zip(figures[::2], figures[1::2], strict=True)))
    Console(width=120).print(table)
    Console().print("The networks' data differ: other homes, furnished, 3,000 of them to learn from.")


def measured(task: tuple[str, int], seed: int, folder: Path) -> dict[str, Counts]:
    """The counts of one member, whose rooms are those between which a wall stands."""
    kind, number = task
    member = make_member(kind, number, seed, folder / kind)
    (truth,) = member.truths
    rooms = [shapely.Polygon(room["polygon"]) for room in truth["rooms"]]
    zones = [shapely.union_all([rooms[k].buffer(0.02) for k in zone]).buffer(-0.02) for zone in truth["zones"]]
    true = [ring for zone in zones if (ring := ring_of(zone)) is not None]
    pixel = (1 + 2 * MARGIN) * float(np.ptp(np.concatenate(true), axis=0).max()) / PIXELS
    found = []
    for plan in plans_of(member.path)[0]:
        matrix = np.asarray(plan["frame"]["matrix"], float)
        for room in plan["rooms"]:
            corners = np.asarray(room["polygon"]) @ matrix[:, :2].T + matrix[:, 2]
            ring = ring_of(shapely.Polygon(corners), pixel)
            found += [] if ring is None else [ring]
    member.path.unlink()
    return compare(found, true)


def ring_of(area: shapely.Geometry, slack_m: float = 0.005) -> np.ndarray | None:
    """The corners of an area, without those that are a straight line but for the slack; None where it is in pieces.

    A plan's rings have corners of a centimetre, which no image of that data set would show: their slack is a pixel.
    """
    return shapely.get_coordinates(area.simplify(slack_m).exterior)[:-1] if area.geom_type == "Polygon" else None
