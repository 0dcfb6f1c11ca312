"""Small batches: houses on disk, quick planners, plans that the pipeline makes of made houses, and of their files."""

from __future__ import annotations

import os
import signal
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import shapely
import trimesh

from houseexpo.corrections import Override
from houseexpo.exports import export, orient_plan
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import Quality
from pipeline.algorithm import plan_level
from pipeline.batch.assemble import BuildResult
from pipeline.batch.build import Progress, build
from pipeline.batch.data_set_folder import ExistingPlansPolicy
from pipeline.batch.job import Plan, PlanWithPicture
from pipeline.batch.shard_build import ShardResult, assemble_shards, begin_shards, build_shard, require_common_settings
from pipeline.batch.shards import Shard
from pipeline.config import PipelineConfig
from pipeline.config_file import BuildConfig, BuildOptions, LimitsConfig
from pipeline.executors import local
from pipeline.executors.local import Executor
from pipeline.rejection import Reason, Rejection
from pipeline.sources import find, reader, suncg
from pipeline.values import Level
from tests.builders.shared import planned
from tests.builders.suncg_houses import write_houses


def one_room(path: Path, width: float = 5.0, depth: float = 4.0) -> Path:
    """Write four walls of 0.2 m around a floor of the given size."""
    x, y = width + 0.4, depth + 0.4
    walls = [(0, 0, x, 0.2), (0, y - 0.2, x, y), (0, 0.2, 0.2, y - 0.2), (x - 0.2, 0.2, x, y - 0.2)]
    boxes = [trimesh.creation.box(bounds=[[x1, y1, 0], [x2, y2, 2.7]]) for x1, y1, x2, y2 in walls]
    path.parent.mkdir(parents=True, exist_ok=True)
    trimesh.util.concatenate(boxes).export(path)
    return path


def three_rooms(folder: Path) -> Path:
    """Write houses a, b and c, each of one room and each a metre wider."""
    for i, name in enumerate("abc"):
        one_room(folder / f"{name}.ply", 4.0 + i, 4.0)
    return folder


def boxed(level: Level, config: PipelineConfig, rng: np.random.Generator) -> tuple[FloorPlan]:
    """Return the room of a ``one_room`` house; ids of a few words misbehave as they say."""
    if "crash" in level.id:
        os.kill(os.getpid(), signal.SIGSEGV)
    if "kill" in level.id:
        os.kill(os.getpid(), signal.SIGKILL)
    if "sleep" in level.id:
        time.sleep(60)
    if "fault" in level.id:
        raise ZeroDivisionError("as asked")
    if "refuse" in level.id:
        raise Rejection("layout", Reason.NOT_ENCLOSED, "as asked", "ask for something else")
    low, high = level.walls.vertices.min(axis=0), level.walls.vertices.max(axis=0)
    width, depth = np.round((high - low)[:2] - 0.4, 2).tolist()
    ring = np.round([(0.1, 0.1), (0.1, 0.1 + depth), (0.1 + width, 0.1 + depth), (0.1 + width, 0.1)], 2)
    asked = {
        "ground_m": config.planes.ground_m,
        "characters": config.layout.characters,
        "drawn": int(rng.integers(1000)),
    }
    return (FloorPlan(level.id, ring, 1, {}, frame=level.frame, provenance={**level.provenance, **asked}),)


def slowly(level: Level, config: PipelineConfig, rng: np.random.Generator) -> tuple[FloorPlan]:
    """Plan as ``boxed``, but take a while."""
    time.sleep(0.2)
    return boxed(level, config, rng)


def sketched(level: Level, config: PipelineConfig, rng: np.random.Generator) -> tuple[PlanWithPicture]:
    """Plan as ``boxed``, with the level's id in place of a picture of its stages."""
    return (PlanWithPicture(boxed(level, config, rng)[0], f"stages of {level.id}".encode()),)


def killed_once(mark: Path, level: Level, config: PipelineConfig, rng: np.random.Generator) -> tuple[FloorPlan]:
    """Plan as ``boxed``, but the first worker that comes to house b is killed; the file ``mark`` remembers."""
    if level.id == "b" and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return boxed(level, config, rng)


def run_build(
    sources: Sequence[Path | str],
    out: Path,
    *,
    workers: int = 1,
    overrides: Mapping[str, Override] | None = None,
    seconds: float = 30.0,
    plan: Plan | None = boxed,
    others: ExistingPlansPolicy = ExistingPlansPolicy.REFUSE,
    rehash: bool = False,
    execute: Executor | None = None,
    progress: Progress | None = None,
    **options: Any,
) -> BuildResult:
    """Build with the quick planner."""
    return build(
        config_for(sources, seconds=seconds, **options),
        out,
        overrides=overrides or {},
        workers=workers,
        progress=progress or _quiet,
        plan=plan,
        others=others,
        rehash=rehash,
        execute=execute,
    )


def config_for(sources: Sequence[Path | str], *, seconds: float = 30.0, **options: Any) -> BuildConfig:
    """Return the configuration of a build of these sources."""
    return BuildConfig(BuildOptions(sources=tuple(map(str, sources)), **options), LimitsConfig(seconds=seconds))


def run_shard(config: BuildConfig, out: Path | str, shard: str, *, plan: Plan = boxed) -> ShardResult:
    """Do one shard with the quick planner and one worker."""
    asked = Shard.of(shard)
    begun = begin_shards(config, str(out), asked.count, {})
    return build_shard(begun, str(out), asked, execute=partial(local.run, workers=1), progress=_quiet, plan=plan)


def run_assemble(out: Path | str) -> BuildResult:
    """Put the plans of shards together."""
    with assemble_shards(require_common_settings(str(out)), str(out), _quiet) as data_set:
        return data_set


def _quiet(what: str, done: int, total: int) -> None:
    """Show nothing."""


def lines(path: Path) -> list[dict[str, Any]]:
    """Read a file of JSON lines."""
    return [msgspec.json.decode(line) for line in path.read_bytes().splitlines()]


def contents(folder: Path) -> dict[str, bytes]:
    """Return every file outside .build, by its path in the data set."""
    files = (file for file in sorted(folder.rglob("*")) if file.is_file() and ".build" not in file.parts)
    return {file.relative_to(folder).as_posix(): file.read_bytes() for file in files}


# A quick planner whose plans are as sure as the names of their houses say.


def doubting(level: Level, config: PipelineConfig, rng: np.random.Generator) -> tuple[FloorPlan]:
    """Return the room of a ``one_room`` house; ``sure_30`` is 0.30 sure, half of its doors being cuts."""
    (plan,) = boxed(level, config, rng)
    _, said, hundredths = plan.id.partition("sure_")
    return (replace(plan, quality=Quality(int(hundredths) / 100, {"cut_share": 0.5})) if said else plan,)


# Plans that the pipeline makes of houses that it makes.


def made_plans(folder: Path, houses: int, seed: int) -> list[FloorPlan]:
    """Write so many houses into a folder, and return the plans of those that give one."""
    write_houses(folder, houses, seed)
    plans = []
    for item in suncg.find(str(folder)):
        for level in suncg.read(item):
            if isinstance(level, Level):
                try:
                    plans.append(planned(level))
                except Rejection:
                    continue
    return plans


# A plan through a file and back: what the pipeline makes of it, and how much of the plan that is.


def plans_of(path: Path, config: PipelineConfig | None = None, **options: str) -> list[FloorPlan]:
    """Build every level of a source, without the batch around it."""
    found = []
    for item in find(str(path), **options):
        for level in reader(item.reader).read(item):
            assert isinstance(level, Level), level
            made = plan_level(level, config or PipelineConfig(), np.random.default_rng(0))
            found += [plan for plan in made if isinstance(plan, FloorPlan)]
    return found


def through(plan: FloorPlan, form: str, folder: Path, suffix: str = "") -> FloorPlan:
    """Write a plan in a format and build a plan of the file again: the largest, of several buildings."""
    files = [file for file in export(plan, form, folder) if file.name.endswith(suffix)]
    return max(plans_of(files[0]), key=lambda each: each.area)


def likeness(plan: FloorPlan, other: FloorPlan) -> float:
    """IoU of the free space of two plans; the lower left corners of their bounds are laid on each other."""
    one, two = orient_plan(plan).free_space, other.free_space
    (x1, y1, *_), (x2, y2, *_) = one.bounds, two.bounds
    moved = shapely.affinity.translate(two, x1 - x2, y1 - y2)
    return float(one.intersection(moved).area / one.union(moved).area)


def labels(plan: FloorPlan) -> Counter[str]:
    """How many rooms have which label."""
    return Counter(room.label for room in plan.rooms)
