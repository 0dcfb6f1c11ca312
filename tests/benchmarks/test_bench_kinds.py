"""How many houses of each kind of the kit meet the table of what must hold, and what fails most.

``make bench`` runs 100 members a kind. While developing, e.g.::

    python -m pytest -s tests/benchmarks/test_bench_kinds.py -k table --benchmarks --members 10 --kinds solids

Then doors and rooms one by one: is each true one among the candidates, and how good is the confidence of those found. A
true inner door has a candidate where one lies within 0.1 m of its middle; a true boundary where a wall or a candidate
lies within 0.12 m. With the corpus (``HOUSEEXPO_CORPUS``), the drawn doors of its files are counted too. The confidence
is measured on houses of a seed on which its models were not fitted.

Last, point clouds of made homes, measured as Structured3D's evaluators do, beside what a network reaches there. The
data differ: Structured3D's clouds are of other, mostly furnished flats, and the network was trained on 3,000 of them.
The figures say what the measure means, not which method is better.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
import shapely
from rich.console import Console
from rich.table import Table
from shapely import Polygon

from houseexpo.grids.frame import source_points_from_plan
from pipeline.config import PipelineConfig
from pipeline.executors.local import Failure, Limits, run
from pipeline.stages.closings import find_closing_candidates
from pipeline.stages.confidence import load_models
from pipeline.stages.evidence import gather_evidence
from pipeline.stages.planes import find_planes
from pipeline.values import Level
from research.confidence_fit import LIMITS as FIT_LIMITS
from research.confidence_fit import collect_parts, levels_of, of_storey, storeys_of, table_of, zones_of
from tests.builders.kinds.measuring import Outcome, measure, plans_of
from tests.builders.kinds.registry import KINDS, make_member
from tests.builders.matching import MARGIN, PIXELS, Counts, compare
from tests.builders.shared import needs_shared
from tests.corpus import manifest, truths

WORKERS = 2
LIMITS = Limits(seconds=60.0, memory=8 << 30)
SURE = 0.8
"""A plan of this quality should be right."""


def outcomes(kinds: list[str], members: int, seed: int, folder: Path, keep: str) -> Iterator[Outcome]:
    """Measure members in worker processes; one that dies or takes too long is an outcome too."""
    tasks = [(kind, number) for kind in kinds for number in range(members)]
    work = partial(_measured, seed=seed, folder=folder, keep=keep)
    for task, result in run(work, tasks, workers=WORKERS, limits=LIMITS):
        failed = isinstance(result, Failure)
        yield Outcome(*task, (result.kind,), LIMITS.seconds, detail=result.detail) if failed else result


def _measured(task: tuple[str, int], seed: int, folder: Path, keep: str) -> Outcome:
    kind, number = task
    return measure(kind, number, seed, str(folder / kind), keep and f"{keep}/{kind}")


@needs_shared
def test_the_kinds_against_the_table(tmp_path: Path, request: pytest.FixtureRequest) -> None:
    option = request.config.getoption
    kinds = option("--kinds").split(",") if option("--kinds") else list(KINDS)
    found: dict[str, list[Outcome]] = {kind: [] for kind in kinds}
    console = Console(width=150)
    for outcome in outcomes(kinds, option("--members"), option("--seed"), tmp_path, option("--keep") or ""):
        found[outcome.kind].append(outcome)
        if not outcome.met:
            console.print(
                f"{outcome.kind} {outcome.number}: {', '.join(outcome.failing)}; {outcome.detail}", style="dim"
            )
    console.print(table(found, option("--seed")))
    console.print(certainty([pair for made in found.values() for outcome in made for pair in outcome.qualities]))
    assert all(len(made) == option("--members") for made in found.values())


def table(found: dict[str, list[Outcome]], seed: int) -> Table:
    """One row a kind."""
    made = Table(title=f"Houses of each kind that meet the table (seed {seed})")
    for k, heading in enumerate(("kind", "met", "of", "fails most", "median s", "longest s")):
        made.add_column(heading, justify="left" if k in {0, 3} else "right")
    for kind, results in found.items():
        failing = Counter(column for outcome in results for column in outcome.failing)
        most = ", ".join(f"{column} {count}" for column, count in failing.most_common(4))
        seconds = [outcome.seconds for outcome in results]
        median, longest = (f"{f(seconds):.2f}" for f in (np.median, np.max))
        made.add_row(kind, str(sum(o.met for o in results)), str(len(results)), most, median, longest)
    return made


def certainty(pairs: list[tuple[float | None, bool]]) -> str:
    """What the plans' own quality is worth: how many of the sure ones are right, how well it tells right from wrong."""
    known = [(quality, met) for quality, met in pairs if quality is not None]
    sure = [met for quality, met in known if quality >= SURE]
    good, bad = ([quality for quality, met in known if met is wanted] for wanted in (True, False))
    if not good or not bad:
        return f"quality: {len(known)} plans have one, too alike to judge it"
    wins = np.mean([[1.0 if g > b else 0.5 if g == b else 0.0 for b in bad] for g in good])
    return (
        f"quality of {SURE} or more: {sum(sure)} of {len(sure)} plans meet the table; area under the curve {wins:.3f}"
    )


DOOR_M = 0.1
BOUNDARY_M = 0.12
STEP_M = 0.05
FITTED_SEED = 0


def missing(task: tuple[str, int], seed: int, folder: Path) -> Counter[str]:
    """Count the true doors and samples of true boundary of a made house, and those without a candidate."""
    member = make_member(*task, seed, folder / task[0])
    found: Counter[str] = Counter()
    for level in levels_of(member.path):
        here = of_storey(member.truths, level)
        doors = [each["centre"] for truth in here for each in truth["doors"] if each["interior"]]
        found += without_candidate(level, doors, [zone for truth in here for zone in zones_of(truth)])
    return found


def missing_in_file(name: str, folder: Path) -> Counter[str]:
    """Count the drawn inner doors of a file of the corpus, and those without a candidate, under its half's number."""
    file = next(file for file in manifest.load() if file.name == name)
    found: Counter[str] = Counter()
    for level, storey in storeys_of(file, folder):
        doors = [door.middle for door in storey.doors if door.interior]
        found += without_candidate(level, doors, truths.rooms_of(level, storey))
    return Counter({f"half {file.half} {key}": count for key, count in found.items()})


def without_candidate(level: Level, doors: Sequence[npt.ArrayLike], zones: Sequence[Polygon]) -> Counter[str]:
    """Count doors, and points along the edges of zones, in the source's plan axes; and those without a candidate."""
    found: Counter[str] = Counter()
    config = PipelineConfig()
    evidence = gather_evidence(level, config.evidence)
    planes = find_planes(level, evidence, config.planes)
    closing = [each.polygon for each in find_closing_candidates(level, planes, config.layout)]
    shapes = shapely.union_all([*closing, *evidence.leaves, *(d.polygon for d in evidence.doorways)])
    shapes = shapely.transform(shapes, partial(source_points_from_plan, level.frame))
    walls = shapely.union_all(
        [shapely.transform(evidence.walls, partial(source_points_from_plan, level.frame)), shapes]
    )
    found["doors"] = len(doors)
    found["doors missing"] = sum(shapely.Point(door).distance(shapes) > DOOR_M for door in doors)
    for zone in zones:
        points = shapely.line_interpolate_point(zone.boundary, np.arange(0, zone.boundary.length, STEP_M))
        found["boundary"] += len(points)
        found["boundary missing"] += int((shapely.distance(points, walls) > BOUNDARY_M).sum())
    return found


def printed(counts: dict[str, Counter[str]]) -> None:
    """Print a row for each kind or half."""
    table = Table(title="Without a candidate (asked: below 2%)")
    for k, heading in enumerate(("of", "true doors", "missing", "true boundary, m", "missing")):
        table.add_column(heading, justify="right" if k else "left")
    for name, found in counts.items():
        share = [found[f"{what} missing"] / max(found[what], 1) for what in ("doors", "boundary")]
        metres = f"{found['boundary'] * STEP_M:.0f}"
        table.add_row(name, str(found["doors"]), f"{share[0]:.1%}", metres, f"{share[1]:.1%}")
    Console(width=120).print(table)


def test_true_doors_and_boundaries_have_candidates(tmp_path: Path, request: pytest.FixtureRequest) -> None:
    option = request.config.getoption
    kinds = option("--kinds").split(",") if option("--kinds") else list(KINDS)
    tasks = [(kind, number) for number in range(option("--members")) for kind in kinds]
    counts: dict[str, Counter[str]] = {kind: Counter() for kind in kinds}
    for task, result in run(
        partial(missing, seed=option("--seed"), folder=tmp_path), tasks, workers=2, limits=FIT_LIMITS
    ):
        if not isinstance(result, Failure):
            counts[task[0]] += result
    printed(counts)
    assert sum(found["doors"] for found in counts.values())


@pytest.mark.skipif(not os.environ.get("HOUSEEXPO_CORPUS"), reason="needs the corpus: HOUSEEXPO_CORPUS")
def test_drawn_doors_of_real_files_have_candidates() -> None:
    folder = Path(os.environ["HOUSEEXPO_CORPUS"]).absolute()
    names = [file.name for file in manifest.load() if file.is_in(folder) and truths.load(file.name)]
    total: Counter[str] = Counter()
    for _, result in run(partial(missing_in_file, folder=folder), names, workers=WORKERS, limits=FIT_LIMITS):
        if not isinstance(result, Failure):
            total += result
    halves = {f"half {half}": Counter() for half in (1, 2)}
    for half, found in halves.items():
        found.update({key.removeprefix(f"{half} "): count for key, count in total.items() if key.startswith(half)})
    printed(halves)
    assert total


def test_confidence_tells_true_parts_from_false_ones(request: pytest.FixtureRequest) -> None:
    option = request.config.getoption
    kinds = option("--kinds").split(",") if option("--kinds") else list(KINDS)
    seed = option("--seed") or FITTED_SEED + 1
    parts = collect_parts(kinds, option("--members"), seed)
    Console(width=120).print(table_of([(part, load_models()[part.part].confidence(part.features)) for part in parts]))
    assert {part.part for part in parts} == {"space", "door", "entrance", "room"}


CLOUDS = ("cloud0", "cloud5", "cloud20", "cloud_furnished", "cloud_doubled")
MEASURES = ("room", "corner", "angle")
PUBLISHED = {
    "RoomFormer (2023), Structured3D": (97.9, 96.7, 89.1, 85.3, 83.0, 79.5),
}
"""Precision and recall in percent, as their papers say, of rooms, corners and angles."""
WORKERS, CLOUD_LIMITS = 2, Limits(seconds=120.0, memory=8 << 30)


def test_clouds_by_the_measures_of_structured3d(tmp_path: Path, request: pytest.FixtureRequest) -> None:
    members = request.config.getoption("--members")
    tasks = [(kind, number) for kind in CLOUDS for number in range(members)]
    work = partial(measured, seed=request.config.getoption("--seed"), folder=tmp_path)
    counts = {kind: {name: Counts() for name in MEASURES} for kind in CLOUDS}
    for (kind, _), result in run(work, tasks, workers=WORKERS, limits=CLOUD_LIMITS):
        assert not isinstance(result, Failure), result
        for name in MEASURES:
            counts[kind][name] += result[name]
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
