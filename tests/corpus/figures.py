"""The figures of a run: verdicts by kind and half, and how far the plans' quality can be believed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from houseexpo.plan.parts import SURE
from tests.builders.judged import area_under_curve
from tests.corpus.manifest import KINDS, WITH_INTERIOR, Verdict
from tests.corpus.runs import Built

Rows = tuple[str, tuple[str, ...], list[list[str]]]
"""A table: title, column headings, cells."""

_OPEN: Final = "to be judged"
_HALF_SURE: Final = 0.5


def verdict_rows(built: Sequence[Built]) -> Rows:
    """Count the verdicts by kind, and of each half: of interiors, and of all others how many became plans."""
    columns = ("files", "interiors", "right", "partly", "wrong", "rejected", _OPEN, "others", "planned", "builds ended")
    groups = [(kind, [each for each in built if each.file.kind == kind]) for kind in KINDS]
    groups += [(f"half {half}", [each for each in built if each.file.half == half]) for half in (1, 2)]
    groups.append(("all", list(built)))
    return "Verdicts", columns, [_verdicts(name, group) for name, group in groups if group]


def _verdicts(name: str, group: Sequence[Built]) -> list[str]:
    count = Counter(each.verdict for each in group)
    inside = [each for each in group if each.file.interior]
    share = {verdict: f"{count[verdict]}" for verdict in WITH_INTERIOR}
    if inside:
        share[Verdict.RIGHT] += f" ({100 * count[Verdict.RIGHT] / len(inside):.0f}%)"
    ended = sum(each.outcome.fault.startswith("ended") for each in group)
    others = len(group) - len(inside)
    no_house = count[Verdict.PLAN_OF_NO_HOUSE]
    return [name, str(len(inside)), *share.values(), str(count[Verdict.OPEN]), str(others), str(no_house), str(ended)]


def quality_rows(built: Sequence[Built]) -> Rows:
    """How far quality can be believed, of each half: a file counts with the least sure of its plans."""
    columns = (
        "files with plans",
        "count",
        f"{SURE} or more",
        "of these right",
        "area under curve",
        f"no house at {_HALF_SURE} or more",
        f"no house at {SURE} or more",
    )
    groups = [(f"half {half}", [each for each in built if each.file.half == half]) for half in (1, 2)]
    groups.append(("all", list(built)))
    return "Quality", columns, [_quality(name, group) for name, group in groups if group]


def _quality(name: str, group: Sequence[Built]) -> list[str]:
    judged = [each for each in group if each.outcome.plans and each.verdict]
    scores = np.array([each.outcome.quality for each in judged], np.float64)
    right = np.array([each.verdict == Verdict.RIGHT for each in judged], np.bool_)
    none = np.array([each.verdict == Verdict.PLAN_OF_NO_HOUSE for each in judged], np.bool_)
    sure = scores >= SURE
    of_these = f"{(right & sure).sum()} ({100 * right[sure].mean():.0f}%)" if sure.any() else "-"
    area = f"{area_under_curve(scores, right):.2f}" if right.any() and not right.all() else "-"
    faint = str(int((none & (scores >= _HALF_SURE)).sum()))
    return [name, str(len(judged)), str(int(sure.sum())), of_these, area, faint, str(int((none & sure).sum()))]


def figures_of(built: Sequence[Built]) -> dict[str, Any]:
    """The figures that are kept of a run: verdicts by half and by kind."""
    groups = {f"half {half}": [each for each in built if each.file.half == half] for half in (1, 2)}
    groups |= {kind: [each for each in built if each.file.kind == kind] for kind in KINDS}
    return {
        name: dict(Counter(str(each.verdict) or _OPEN for each in group)) for name, group in groups.items() if group
    }
