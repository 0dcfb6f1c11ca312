"""Fit the models of ``pipeline.stages.confidence`` and write their table, ``weights.toml``.

::

    python -m research.confidence_fit --members 24 --corpus checkouts --records parts.jsonl --write

Made houses (every third one damaged) and the drawn truths of the corpus's first half are what it learns from; real
houses count as much as all made ones together. Nearly all drawn truths are of plans that are right, so entrances and
rooms also learn from the verdicts on the other files of the first half: of a right plan all parts are true, of a wrong
one none. The second half is only counted. Where a truth names no entrance, what
the plan has of them is not judged. A door is true where a passage of the truth has its middle within 0.35 m, a room
where it overlaps one of the truth's by an IoU of 0.7.
"""

from __future__ import annotations

import argparse
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, get_args

import msgspec
import numpy as np
import numpy.typing as npt
import shapely
from rich.console import Console
from rich.table import Table
from scipy.optimize import minimize
from shapely import Polygon

from houseexpo.errors import HouseExpoError
from pipeline.algorithm import run_stages
from pipeline.config import PipelineConfig
from pipeline.executors.local import Failure, Limits, run
from pipeline.rejection import Rejection
from pipeline.sources import find, reader
from pipeline.stages import confidence
from pipeline.stages.quality_grounds import measure_quality_grounds
from pipeline.stages.rooms import name_rooms
from pipeline.values import Evidence, Layout, Level, Spaces
from tests.builders.judged import area_under_curve, damage_of
from tests.builders.kinds.measuring import SAME_FLOOR_M
from tests.builders.kinds.registry import KINDS, RAW, make_member
from tests.builders.kinds.values import Member
from tests.builders.matching import which_near
from tests.corpus import manifest, truths

Floats = npt.NDArray[np.float64]
WEIGHTS = Path(confidence.__file__).with_name("weights.toml")
LIMITS = Limits(seconds=600.0, memory=8 << 30)
"""Far more than any of the houses takes: a fit that lost some would not be the same again."""
SAME_IOU = 0.7
RIDGES: Mapping[confidence.Part, float] = {"door": 3.0, "entrance": 15.0, "room": 40.0}
"""How strongly weights are kept small: for doors, of 1 to 100 the best for kinds and files left out of the fit; for
entrances and rooms, of which few are false, of 3, 15 and 40 the best calibrated on the corpus's second half."""
DRAWS = 1000
"""How often the calibration error of a model without fault is drawn."""
PARTS: tuple[confidence.Part, ...] = get_args(confidence.Part)
BINS = 10


class Part(msgspec.Struct, frozen=True):
    """A door, an entrance or a room of a plan: where it comes from, whether it is true, and its features."""

    part: confidence.Part
    house: str
    group: str
    true: bool
    features: dict[str, float]


class Known(msgspec.Struct, frozen=True):
    """What a storey has, in the source's plan axes: middles of inner passages and of entrances, and room areas."""

    doors: Floats
    entrances: Floats
    rooms: list[Polygon]


VERDICT = "verdicts 1"
NOTHING = Known(np.zeros((0, 2)), np.zeros((0, 2)), [])


def parts_of(level: Level, known: Known, house: str, group: str) -> Iterator[Part]:
    """Plan a level and tell which of its parts are true; a level that is rejected has none."""
    evidence = layout = spaces = None
    found: list[tuple[Level, Evidence, Layout, Spaces]] = []
    try:
        for result in run_stages(level, PipelineConfig(), np.random.default_rng(0)):
            match result.value:
                case Evidence():
                    evidence = result.value
                case Layout():
                    layout = result.value
                case Spaces():
                    spaces = result.value
            if result.stage == "plan" and evidence and layout and spaces:
                found.append((level, evidence, layout, spaces))
    except Rejection:
        pass
    for whole in found:
        yield from _judge_parts(*whole, known, house, group)


def _judge_parts(
    level: Level, evidence: Evidence, layout: Layout, spaces: Spaces, known: Known, house: str, group: str
) -> Iterator[Part]:
    grounds = measure_quality_grounds(level, evidence, layout, spaces)
    planned = confidence.FinalBuilding(level, evidence, layout, spaces, name_rooms(level, spaces), grounds)
    features = confidence.passage_features(planned)
    for part, true in (("door", known.doors), ("entrance", known.entrances)):
        if part == "entrance" and not len(true) and known is not NOTHING:
            continue
        which = [k for k, p in enumerate(spaces.passages) if confidence.model_for_passage(p) == part]
        middles = [spaces.passages[k].portal.centre for k in which]
        right = which_near(true, truths.in_source(level, np.asarray(middles).reshape(-1, 2)), truths.NEAR_M)
        for k, is_true in zip(which, right, strict=True):
            yield Part(part, house, group, bool(is_true), features[k])
    rooms = [_to_source(level, room.polygon) for room in planned.named]
    for row, is_true in zip(confidence.room_features(planned), _alike(known.rooms, rooms), strict=True):
        yield Part("room", house, group, bool(is_true), row)


def _to_source(level: Level, room: Polygon) -> Polygon:
    return shapely.transform(room, lambda points: truths.in_source(level, points))


def _alike(true: Sequence[Polygon], found: Sequence[Polygon]) -> npt.NDArray[np.bool_]:
    """Which found rooms (n,) are like a true one; a true one may stand for rooms that no wall parts, too."""
    right = np.zeros(len(found), np.bool_)
    for k, room in enumerate(found):
        shared = shapely.area(shapely.intersection(room.buffer(0), np.array(true, np.object_)))
        right[k] = bool(len(true)) and (shared / (room.area + shapely.area(true) - shared)).max() >= SAME_IOU
    return right


def of_member(task: tuple[str, int], seed: int, folder: Path) -> list[Part]:
    """Return the parts of a made house; every third one is damaged first."""
    kind, number = task
    member = make_member(kind, number, seed, folder / kind)
    damage = damage_of(kind, number, seed)
    found: list[Part] = []
    for level in levels_of(member.path):
        here = of_storey(member, level)
        if here:
            found += parts_of(damage(level) if damage else level, _of_cases(here), f"{kind} {number}", kind)
    return found


def of_storey(member: Member, level: Level) -> list[Mapping[str, Any]]:
    """Return the truths of the storey that a level shows: one for each of its buildings."""
    return [truth for truth in member.truths if abs(truth["floor_z"] - level.frame.floor) <= SAME_FLOOR_M]


def zones_of(truth: Mapping[str, Any]) -> list[Polygon]:
    """Return the areas that walls part from each other: a room, or several between which no wall stands."""
    rooms = [Polygon(r["polygon"], r["holes"]).buffer(0) for r in truth["rooms"]]
    groups = truth.get("zones") or [[k] for k in range(len(rooms))]
    return [shapely.union_all([rooms[i].buffer(0.02) for i in group]).buffer(-0.02) for group in groups]


def _of_cases(truths_: Sequence[Mapping[str, Any]]) -> Known:
    """Return what the buildings of one storey have."""
    rooms = [Polygon(r["polygon"], r["holes"]).buffer(0) for truth in truths_ for r in truth["rooms"]]
    doors = [door for truth in truths_ for door in truth["doors"]]
    inner = [door["centre"] for door in doors if door["interior"]]
    outer = [door["centre"] for door in doors if not door["interior"]]
    zones = [zone for truth in truths_ for zone in zones_of(truth)]
    return Known(np.reshape(inner, (-1, 2)), np.reshape(outer, (-1, 2)), rooms + zones)


def of_file(name: str, folder: Path) -> list[Part]:
    """Return the parts of a file of the corpus whose truth somebody has drawn."""
    file = next(file for file in manifest.load() if file.name == name)
    found: list[Part] = []
    for level, storey in storeys_of(file, folder):
        inner = [d.middle for d in storey.doors if d.interior]
        inner += [np.reshape(s, (2, 2)).mean(axis=0) for s in storey.open]
        outer = [d.middle for d in storey.doors if not d.interior]
        known = Known(np.reshape(inner, (-1, 2)), np.reshape(outer, (-1, 2)), truths.rooms_of(level, storey))
        found += parts_of(level, known, file.name, f"corpus {file.half}")
    return found


def of_verdict(name: str, folder: Path) -> list[Part]:
    """Return the entrances and rooms of a file that is right or wrong, and of which nobody has drawn a truth."""
    file = next(file for file in manifest.load() if file.name == name)
    right = file.verdict is manifest.Verdict.RIGHT
    found = [part for level in levels_of(file.place(folder)) for part in parts_of(level, NOTHING, name, VERDICT)]
    return [msgspec.structs.replace(part, true=right) for part in found if part.part != "door"]


def storeys_of(file: manifest.File, folder: Path) -> Iterator[tuple[Level, truths.Storey]]:
    """Yield the levels of a file with what somebody has drawn of them; a level of another size has nothing drawn."""
    truth = truths.load(file.name)
    levels = levels_of(file.place(folder))
    for storey in truth.storeys if truth else ():
        for level in levels:
            same = level.frame.level == storey.level
            if same and np.allclose(truths.extent_of(level), storey.extent, rtol=truths.SAME, atol=truths.SAME):
                yield level, storey


def levels_of(path: Path) -> list[Level]:
    """Return the levels of a file that are no rejections."""
    found = []
    try:
        for item in find(str(path)):
            found += [level for level in reader(item.reader).read(item) if isinstance(level, Level)]
    except Rejection:
        pass
    return found


def fit(parts: Sequence[Part], names: Sequence[str], ridge: float = RIDGES["door"]) -> confidence.LogisticModel:
    """Fit one model by greatest likelihood; a ridge keeps the weights of rare features small."""
    table = np.array([[part.features.get(name, 0.0) for name in names] for part in parts])
    true = np.array([part.true for part in parts])
    weight = weights_of(parts)

    def loss(x: Floats) -> tuple[float, Floats]:
        z = x[0] + table @ x[1:]
        value = (weight * np.logaddexp(0, np.where(true, -z, z))).sum() + ridge * (x[1:] ** 2).sum() / 2
        slope = weight * (1 / (1 + np.exp(-z)) - true)
        return float(value), np.concatenate([[slope.sum()], table.T @ slope + ridge * x[1:]])

    x = minimize(loss, np.zeros(len(names) + 1), jac=True, method="L-BFGS-B", options={"maxiter": 2000}).x
    kept = {name: round(float(w), 2) for name, w in zip(names, x[1:], strict=True) if abs(w) >= 0.05}
    return confidence.LogisticModel(round(float(x[0]), 2), kept)


def weights_of(parts: Sequence[Part]) -> Floats:
    """Return the weight of each part: real houses count as much as all made ones together.

    A real house with many parts counts with the root of their number: all may be right or wrong for one reason.
    """
    real = np.array([part.group.startswith("corpus") or part.group == VERDICT for part in parts])
    if real.all() or not real.any():
        return np.ones(len(parts))
    count = Counter(part.house for part in parts)
    weight = np.array([count[part.house] ** -0.5 for part in parts])
    return np.where(real, weight * (~real).sum() / weight[real].sum(), 1.0) / 2


def measures(scores: Floats, true: npt.NDArray[np.bool_]) -> dict[str, float]:
    """Area under the curve, Brier score, and the expected calibration error over ``BINS`` bins of equal width.

    ``by chance`` is the calibration error that so few parts would show on average if each of them were true with
    exactly the probability that its score says, and independently of the others.
    """
    rng = np.random.default_rng(0)
    drawn = [_calibration_error(scores, rng.random(len(scores)) < scores) for _ in range(DRAWS)]
    return {
        "area": area_under_curve(scores, true),
        "brier": float(((scores - true) ** 2).mean()),
        "calibration": _calibration_error(scores, true),
        "by chance": float(np.mean(drawn)),
    }


def _calibration_error(scores: Floats, true: npt.NDArray[np.bool_]) -> float:
    """Return the mean over all parts of the difference between the mean score of a bin and its share of true parts."""
    which = np.minimum((scores * BINS).astype(int), BINS - 1)
    sums = np.bincount(which, scores - true, minlength=BINS)
    return float(np.abs(sums).sum() / len(scores))


def table_of(parts: Sequence[Part], fitted: Mapping[str, confidence.LogisticModel]) -> Table:
    """Show how good the models are, a row for each part and group."""
    table = Table(title="Confidence of doors, entrances and rooms")
    for k, heading in enumerate(("part", "of", "n", "true", "mean", "area", "Brier", "calibration error", "by chance")):
        table.add_column(heading, justify="right" if k > 1 else "left")
    for part in PARTS:
        for group in sorted({each.group for each in parts}):
            chosen = [each for each in parts if each.part == part and each.group == group]
            if chosen:
                true = np.array([each.true for each in chosen])
                scores = np.array([fitted[part].confidence(each.features) for each in chosen])
                found = measures(scores, true)
                figures = [f"{x:.2f}" for x in (true.mean(), scores.mean(), *found.values())]
                table.add_row(part, group, str(len(chosen)), *figures)
    return table


def source_of(fitted: Mapping[str, confidence.LogisticModel]) -> str:
    """Return the text of ``weights.toml``."""
    lines = ["# Written by python -m research.confidence_fit; see pipeline/stages/confidence.py.", ""]
    for part in PARTS:
        lines += [f"[{part}]", f"bias = {fitted[part].bias}", f"[{part}.weights]"]
        lines += [f"{name} = {weight}" for name, weight in sorted(fitted[part].weights.items())] + [""]
    return "\n".join(lines[:-1]) + "\n"


def collect_parts(
    kinds: Sequence[str], members: int, seed: int, corpus: Path | None, records: Path | None
) -> list[Part]:
    """Return what the file of records has, where there is one; else plan all houses and keep it there."""
    if records and records.exists():
        return [msgspec.json.decode(line, type=Part) for line in records.read_bytes().splitlines()]
    found: list[Part] = []
    with tempfile.TemporaryDirectory() as folder:
        tasks = [(kind, number) for number in range(members) for kind in kinds]
        found += _in_order(partial(of_member, seed=seed, folder=Path(folder)), tasks)
    if corpus:
        names = [file.name for file in manifest.load() if file.is_in(corpus) and truths.load(file.name)]
        found += _in_order(partial(of_file, folder=corpus), names)
        told = {manifest.Verdict.RIGHT, manifest.Verdict.WRONG}
        files = [file for file in manifest.load() if file.half == 1 and file.verdict in told and file.name not in names]
        found += _in_order(partial(of_verdict, folder=corpus), [file.name for file in files if file.is_in(corpus)])
    if records:
        records.write_bytes(b"".join(msgspec.json.encode(part) + b"\n" for part in found))
    return found


def _in_order(function: Callable[[Any], list[Part]], items: Sequence[Any]) -> list[Part]:
    """Return the parts of all items in their order; raise HouseExpoError if one of them is lost."""
    results = dict(run(function, items, workers=2, limits=LIMITS))
    lost = [f"{item}: {results[item]}" for item in items if isinstance(results[item], Failure)]
    if lost:
        raise HouseExpoError(f"{len(lost)} of {len(items)} houses gave nothing: {'; '.join(lost)[:500]}")
    return [part for item in items for part in results[item]]


def _is_of_model(name: str, part: confidence.Part) -> bool:
    """Whether the model of a part has a feature: doors weigh the grounds of the plan, rooms its quality (F5)."""
    if name == "doubtful_plan":
        return part == "room"
    return part == "door" or not name.startswith("plan_")


def main() -> None:
    """Fit on what is for it, show what comes of it on what was left out, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--members", type=int, default=24)
    parser.add_argument("--kinds", default=",".join({**KINDS, **RAW}))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--records", type=Path)
    parser.add_argument("--corpus", type=Path)
    parser.add_argument("--parts", default=",".join(PARTS), help="fit these models only, and keep the others")
    parser.add_argument("--write", action="store_true")
    given = parser.parse_args()
    corpus = given.corpus.absolute() if given.corpus else None
    parts = collect_parts(given.kinds.split(","), given.members, given.seed, corpus, given.records)
    seen = [part for part in parts if part.group != "corpus 2"]
    console = Console(width=120)
    fitted = dict(confidence.load_models())
    asked: list[confidence.Part] = [part for part in PARTS if part in given.parts.split(",")]
    for part in asked:
        its = [each for each in seen if each.part == part]
        names = sorted({n for each in its for n, value in each.features.items() if value and _is_of_model(n, part)})
        fitted[part] = fit(its, names, RIDGES[part])
    console.print(table_of(parts, fitted))
    text = source_of(fitted)
    if given.write:
        WEIGHTS.write_text(text, encoding="utf-8")
    else:
        console.print(text, highlight=False, markup=False)


if __name__ == "__main__":
    main()
