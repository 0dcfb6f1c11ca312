"""Plans of which is known whether they meet the table: of the development cases, and of the kit of kinds.

A plan that no storey of its house is like is judged too: it does not meet the table. Every third house of the kit is
damaged before it is planned (``damage``): of sound ones too few plans are wrong to learn from.
"""

from __future__ import annotations

import re
import zlib
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.executors.local import Failure, Limits, run
from pipeline.values import Level
from tests.builders.damage import damaged
from tests.builders.kinds.measuring import columns_failing, overlap, paired, plans_of
from tests.builders.kinds.registry import make_member
from tests.builders.quality_model import Judged
from tests.builders.shared import CASES, DATA, case, of_building, scorer

WORKERS = 2
LIMITS = Limits(seconds=60.0, memory=8 << 30)
CASE = "case"
DAMAGED = 3
"""Every so many-th house of the kit is damaged."""


def judged(kinds: Sequence[str], members: int, seed: int, folder: Path) -> Iterator[Judged]:
    """Plan so many members of each kind and the cases in worker processes, and judge every plan that says its quality.

    A house that takes too long, or whose worker dies, gives no plan.
    """
    tasks = [(kind, number) for number in range(members) for kind in kinds]
    tasks += [(CASE, number) for number in range(len(CASES))]
    found = dict(run(partial(judge, seed=seed, folder=folder), tasks, workers=WORKERS, limits=LIMITS))
    for task in tasks:
        result = found[task]
        if not isinstance(result, Failure):
            yield from result


def judge(task: tuple[str, int], seed: int, folder: Path) -> list[Judged]:
    """Judge the plans of a case, or of a member of a kind."""
    kind, number = task
    return _of_case(CASES[number]) if kind == CASE else _of_member(kind, number, seed, folder / kind)


def damage_of(kind: str, number: int, seed: int) -> Callable[[Level], Level] | None:
    """Return what is done to the levels of a member of a kind before they are planned; None for sound members."""
    rng = np.random.default_rng([seed, number, zlib.crc32(kind.encode())])
    return partial(damaged, rng=rng) if number % DAMAGED == DAMAGED - 1 else None


def _of_case(name: str) -> list[Judged]:
    """Judge what the mesh gives, and what the IFC file does, where there is one; buildings one by one."""
    found, truth = [], case(name)
    house = re.sub(r"(_\d+)?(_leaves)?$", "", name)
    for source in dict.fromkeys(truth[key] for key in ("mesh", "ifc") if key in truth):
        known = {**truth, "zones": None, "kind": "ifc"} if source.endswith(".ifc") else truth
        plans = [plan for plan in plans_of(DATA / source)[0] if overlap(known, plan) > 0]
        for plan in plans:
            its = of_building(known, plan) if len(plans) > 1 else known
            found += _judged(house, CASE, plan, met=not columns_failing(scorer()(plan, its), its))
    return found


def _of_member(kind: str, number: int, seed: int, folder: Path) -> list[Judged]:
    """Judge a member; every ``DAMAGED``-th one is damaged first."""
    member = make_member(kind, number, seed, folder)
    damage = damage_of(kind, number, seed)
    plans, _ = plans_of(member.path, damage)
    scores, _, _ = paired(member, plans)
    met = {score["plan"]: not score["failing"] for score in scores if "plan" in score}
    house, kind = f"{kind} {number}", "damaged" if damage else kind
    return [one for k, plan in enumerate(plans) for one in _judged(house, kind, plan, met=met.get(k, False))]


def _judged(house: str, kind: str, plan: dict[str, Any], *, met: bool) -> list[Judged]:
    quality = plan.get("quality")
    return [Judged(house, kind, met, quality["score"], quality["grounds"])] if quality else []
