"""A run over the corpus: the program's own builds, what came of each file, and what that means for its verdict.

Rules:

1. Files are built as a user would build them: with default options, many in one build, by worker processes with limits
   of time and memory. Worlds that need model folders are built together with those that need the same.
2. A file that the build does not take at all is ``refused``. Where a build ends without a data set, it is repeated with
   each half of its files until the files that end it are known: they have ``ended the build``.
3. A verdict holds for the outcome that a person has seen, and for one that differs from it by less than a person sees:
   as many rooms, doors and cuts, and areas that differ by at most 2%.
4. Where it does not hold, a rejection is wrong if there is an interior, and a plan is one of no house if there is none.
   Of any other plan nobody knows until a person has looked at it.
"""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import Any, Final

import msgspec

from houseexpo.errors import ConfigError
from pipeline.batch.assemble import BuildResult
from pipeline.batch.build import Progress, build
from pipeline.batch.data_set_folder import ExistingPlansPolicy
from pipeline.batch.entry import Entry
from pipeline.batch.plan_store import PlanStore
from pipeline.batch.result_store import FolderStore
from pipeline.config_file import BuildConfig, BuildOptions, LimitsConfig
from pipeline.executors import local
from pipeline.html_report import write_report
from pipeline.sources import find
from tests.corpus.manifest import File, Verdict, checkout

RESULTS: Final = Path(__file__).parent / "results.json"
LIMITS: Final = LimitsConfig(seconds=300.0, memory_gb=4.0)
SAME_AREA: Final = 0.02  # R3
_LEVEL: Final = re.compile(r"(_L\d+)?(_B\d+)?$")
_LINE: Final = re.compile(r"(\d+) rooms, (\d+) doors, (\d+) cuts, ([\d.]+) m2, plan (\w+)")


class Plan(msgspec.Struct, frozen=True):
    """A plan in a few figures; ``level`` is the end of its id ("_L1_B2"), ``digest`` a hash of geometry and labels."""

    level: str
    rooms: int
    doors: int
    cuts: int
    area_m2: float
    quality: float
    digest: str

    @property
    def line(self) -> str:
        """The plan in words."""
        return f"{self.rooms} rooms, {self.doors} doors, {self.cuts} cuts, {self.area_m2:.1f} m2, plan {self.digest}"


class Outcome(msgspec.Struct, frozen=True):
    """What came of a file. ``fault``: why it was refused, or ended the build ("" where neither)."""

    plans: list[Plan]
    rejected: list[str]
    fault: str = ""
    seconds: float = 0.0

    @property
    def lines(self) -> list[str]:
        """The outcome in words, a line for each plan and each rejection: what a verdict is about."""
        fault = [self.fault.partition(":")[0]] if self.fault else []
        return [*(plan.line for plan in self.plans), *sorted(self.rejected), *fault]

    @property
    def quality(self) -> float | None:
        """The quality of the least sure plan."""
        return min((plan.quality for plan in self.plans), default=None)


@dataclass(frozen=True)
class Built:
    """A file, what came of it, its plans as JSON, and the verdict of the two; ``stands``: the person's own verdict."""

    file: File
    outcome: Outcome
    plans: tuple[dict[str, Any], ...]
    verdict: Verdict
    stands: bool


def run(files: Sequence[File], folder: Path, out: Path, *, workers: int, progress: Progress) -> Iterator[Built]:
    """Build files that lie in a folder of checkouts, and judge what came of them, in the order of the files.

    Parameters
    ----------
    out
        Where the data sets of the builds are kept, so that the next run builds only what has changed.
    """
    found: dict[str, tuple[Outcome, tuple[dict[str, Any], ...]]] = {}
    for models, group in groupby(sorted(files, key=_models), key=_models):
        name = hashlib.sha256("\0".join(models).encode()).hexdigest()[:8] if models else "plain"
        paths = os.pathsep.join(str(folder / model) for model in models)
        config = BuildConfig(BuildOptions(model_path=paths), LIMITS)
        found |= _Builder(config, folder, out / name, workers, progress).outcomes(list(group))
    for file in files:
        outcome, plans = found[file.name]
        yield Built(file, outcome, plans, *verdict_of(file, outcome))


def verdict_of(file: File, outcome: Outcome) -> tuple[Verdict, bool]:
    """Return the verdict on an outcome, and whether it is the person's (R3, R4)."""
    if file.verdict and same(file.seen, outcome.lines):
        return file.verdict, True
    if not file.interior:
        return (Verdict.PLAN_OF_NO_HOUSE if outcome.plans else Verdict.REJECTED_RIGHTLY), False
    if not outcome.plans:
        return Verdict.REJECTED_WRONGLY, False
    return Verdict.OPEN, False


def same(seen: Sequence[str], lines: Sequence[str]) -> bool:
    """Whether a person would see no difference between two outcomes (R3)."""
    return len(seen) == len(lines) and all(_same_line(*pair) for pair in zip(seen, lines, strict=True))


def _same_line(one: str, other: str) -> bool:
    plans = _LINE.fullmatch(one), _LINE.fullmatch(other)
    if one == other or not all(plans):
        return one == other
    (*counts, area, _), (*counts_other, area_other, _) = (plan.groups() for plan in plans if plan)
    areas = float(area), float(area_other)
    return counts == counts_other and abs(areas[0] - areas[1]) <= SAME_AREA * max(areas)


def changes(file: File, before: Outcome | None, now: Outcome) -> list[str]:
    """Say what differs between the outcomes of two runs, a line each; nothing where all is the same."""
    if before is None:
        return ["not built before"]
    if before.lines == now.lines:
        return [
            f"quality{new.level}: {old.quality:.2f} -> {new.quality:.2f}"
            for old, new in zip(before.plans, now.plans, strict=True)
            if abs(old.quality - new.quality) >= 0.01
        ]
    if same(before.lines, now.lines):
        return ["the plan moved a little"]
    return [*(f"- {line}" for line in before.lines), *(f"+ {line}" for line in now.lines)]


def load_results(path: Path = RESULTS) -> dict[str, Outcome]:
    """Return the outcomes that were recorded last, by the files' keys; nothing where there are none."""
    if not path.is_file():
        return {}
    return msgspec.json.decode(path.read_bytes(), type=_Results).files


def record(built: Sequence[Built], figures: dict[str, Any], name: str, path: Path = RESULTS) -> None:
    """Keep outcomes, and add the run's ``figures`` under its name (of a commit, say) to those of earlier runs.

    What may name a file of the second half is left out.
    """
    bare = {each.file.key: each.outcome for each in built}
    for each in built:
        if each.file.half == 2:
            bare[each.file.key] = msgspec.structs.replace(each.outcome, fault=each.outcome.fault.partition(":")[0])
    old = msgspec.json.decode(path.read_bytes(), type=_Results) if path.is_file() else _Results({}, {})
    files = dict(sorted({**old.files, **bare}.items()))
    runs = {**old.runs, name: figures}
    lines = ",\n".join(f"{_json(key)}: {_json(outcome)}" for key, outcome in files.items())
    told = ",\n".join(f"{_json(key)}: {_json(value)}" for key, value in runs.items())
    path.write_text(f'{{"runs": {{\n{told}\n}},\n"files": {{\n{lines}\n}}}}\n', encoding="utf-8")


class _Results(msgspec.Struct):
    """``results.json``: the figures of each run by its name, and the last outcomes by the files' keys."""

    runs: dict[str, dict[str, Any]]
    files: dict[str, Outcome]


def _json(value: Any) -> str:
    return msgspec.json.encode(value).decode()


def _models(file: File) -> tuple[str, ...]:
    """The model folders of a file, named from the folder of checkouts."""
    return tuple(str(checkout(Path(), file.repository) / model) for model in file.models)


@dataclass(frozen=True)
class _Builder:
    """Builds files with one configuration into one folder."""

    config: BuildConfig
    folder: Path
    out: Path
    workers: int
    progress: Progress

    def outcomes(self, files: list[File]) -> dict[str, tuple[Outcome, tuple[dict[str, Any], ...]]]:
        """What came of each file by its name, and its plans (R2)."""
        found: dict[str, tuple[Outcome, tuple[dict[str, Any], ...]]] = {}
        takes = []
        for file in files:
            if why := self._refusal(file):
                found[file.name] = Outcome([], [], f"refused: {why}"), ()
            else:
                takes.append(file)
        return found | self._built(takes)

    def _refusal(self, file: File) -> str:
        try:
            next(iter(find(str(file.place(self.folder)), model_path=self.config.build.model_path)))
        except ConfigError as error:
            return str(error).replace(f"{file.place(self.folder)}", file.path)
        return ""

    def _built(self, files: list[File]) -> dict[str, tuple[Outcome, tuple[dict[str, Any], ...]]]:
        if not files:
            return {}
        try:
            return self._sorted(files, self._build(files))
        except Exception as error:  # noqa: BLE001 - whatever it was: a user would have lost the whole build
            if len(files) == 1:
                told = f"{type(error).__name__}: {error}".replace(f"{self.folder}/", "")
                return {files[0].name: (Outcome([], [], f"ended the build: {told}"), ())}
        half = len(files) // 2
        return self._built(files[:half]) | self._built(files[half:])

    def _build(self, files: list[File]) -> BuildResult:
        places = tuple(str(file.place(self.folder).resolve()) for file in files)
        options = BuildOptions(sources=places, model_path=self.config.build.model_path)
        data_set = build(
            BuildConfig(options, self.config.limits),
            self.out,
            overrides={},
            workers=self.workers,
            progress=self.progress,
            others=ExistingPlansPolicy.REPLACE,
            execute=partial(local.run, workers=self.workers),
        )
        write_report(data_set, self.progress)
        return data_set

    def _sorted(
        self, files: list[File], data_set: BuildResult
    ) -> dict[str, tuple[Outcome, tuple[dict[str, Any], ...]]]:
        """Share the entries of a data set out to the files that they are of."""
        store = PlanStore(FolderStore(self.out.absolute()))
        entries: dict[str, list[Entry]] = {}
        for entry in data_set.entries:
            entries.setdefault(entry.source, []).append(entry)
        found = {}
        for file in files:
            own = entries.get(str(file.place(self.folder).resolve()), [])
            kept = sorted((kept for entry in own for kept in entry.plans), key=lambda each: each.id)
            plans = tuple(dict(msgspec.json.decode(store.get(each))) for each in kept)
            rejected = sorted(f"{each.stage}: {each.reason}" for entry in own for each in entry.refused)
            seconds = round(sum(entry.seconds for entry in own), 1)
            figures = [figures_of_plan(_LEVEL.search(each.id)[0], plan) for each, plan in zip(kept, plans, strict=True)]
            found[file.name] = Outcome(figures, rejected, "", seconds), plans
        return found


def figures_of_plan(level: str, plan: Mapping[str, Any]) -> Plan:
    """Count a plan's parts; its digest knows nothing of ids, quality and provenance."""
    rooms, doors = plan.get("rooms", []), plan.get("doors", [])
    parts = [plan.get(key) for key in ("verts", "holes", "frame")]
    parts += [[room["polygon"], room["holes"], room["label"]] for room in rooms]
    parts += [[door["kind"], door["segment"]] for door in doors]
    cuts = sum(door["kind"] == "cut" for door in doors)
    area = sum(room["area"] for room in rooms)
    quality = round((plan.get("quality") or {}).get("score", 1.0), 3)
    digest = hashlib.sha256(msgspec.json.encode(parts)).hexdigest()[:10]
    return Plan(level, len(rooms), len(doors), cuts, round(area, 1), quality, digest)
