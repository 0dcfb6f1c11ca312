"""Write the plans of a data set, and the pictures of their stages where the build keeps them."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from houseexpo.dataset.index import row
from houseexpo.files import write_whole
from houseexpo.floorplan import FloorPlan, decode
from houseexpo.summaries import Summary, new_summaries
from pipeline.batch.entry import Kept
from pipeline.batch.folder import Finished, Folder, Written
from pipeline.batch.lists import valid_parts
from pipeline.batch.plans import Plans

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class Published:
    """The written files by name, the index's rows, the plans' summaries, and counts."""

    written: dict[str, Written]
    rows: list[dict[str, Any]]
    summaries: dict[str, Any]
    counts: dict[str, Any]


def files_of(kept: Mapping[str, Kept], *, pictured: bool) -> dict[str, str]:
    """Return the files of these plans by name, each with its SHA-256; with those of their pictures if ``pictured``."""
    files = {_plan(name): plan.plan for name, plan in kept.items()}
    pictures = {_picture(name): plan.stages.sha256 for name, plan in kept.items() if plan.stages is not None}
    return {**files, **(pictures if pictured else {})}


def publish(
    folder: Folder, plans: Plans, kept: Mapping[str, Kept], files: Mapping[str, str], before: Finished | None
) -> Published:
    """Write those of ``files`` that do not stand as an earlier run wrote them, in one pass.

    Raises
    ------
    DamagedPlanError
        Where a plan, or its picture, is not in the store as it was kept.
    """
    summaries, parts_of = new_summaries(), valid_parts(folder.root, kept)
    rules: Counter[str] = Counter()
    rows, doubtful, unmeasured = [], 0, 0
    written: dict[str, Written] = {}
    if any(_picture(name) in files for name in kept):
        folder.stages.mkdir(exist_ok=True)
    for name, plan_kept in kept.items():
        data = plans.get(plan_kept)
        plan = decode(data)
        rows.append({**row(plan), "split": parts_of.get(name)})
        rules.update(_rules(plan))
        doubtful += plan.quality is not None and plan.quality.is_doubtful
        unmeasured += not _measured(summaries.values(), plan)
        reads = {_plan(name): partial(bytes, data), _picture(name): partial(plans.picture, plan_kept)}
        for file, read in reads.items():
            if file in files:
                written[file] = _written(folder, file, files[file], read, before)
    counts: dict[str, Any] = {"doubtful": doubtful, "rules": dict(sorted(rules.items()))}
    if unmeasured:
        counts["unmeasured"] = unmeasured
    return Published(written, rows, {name: summary.report() for name, summary in summaries.items()}, counts)


def _measured(summaries: Iterable[Summary], plan: FloorPlan) -> bool:
    """Add a plan to the summaries; if it cannot be measured, say so and leave it out."""
    try:
        for summary in summaries:
            summary.add(plan)
    except Exception as error:  # noqa: BLE001 - one plan never ends a build
        _LOG.warning("%s: it is left out of the statistics: %s", plan.id, error)
        return False
    return True


def remove_others(folder: Folder, written: Iterable[str]) -> None:
    """Remove the plans and pictures of an earlier run that are not among what was written."""
    for name in folder.names().difference(written):
        (folder.root / name).unlink()
    if folder.stages.is_dir() and not any(folder.stages.iterdir()):
        folder.stages.rmdir()


def _written(folder: Folder, file: str, sha256: str, read: Callable[[], bytes], before: Finished | None) -> Written:
    """Write a file, unless it stands there as an earlier run wrote it."""
    was = before.files.get(file) if before is not None else None
    if was is not None and was.sha256 == sha256 and folder.stands(file, was):
        return was
    write_whole(folder.root / file, read())
    return folder.described(file, sha256)


def _rules(plan: FloorPlan) -> list[str]:
    """Name the rules that took effect in a plan and replace a judgement by eye in the paper."""
    notes = (plan.provenance or {}).get("notes", {})
    return [f"{name}:{value}" if isinstance(value, str) else name for name, value in notes.items()]


def _plan(name: str) -> str:
    return f"json/{name}.json"


def _picture(name: str) -> str:
    return f"stages/{name}.png"
