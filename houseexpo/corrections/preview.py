"""Preview the effects of corrections on a plan that is built already, before it is built again."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

import msgspec
import numpy as np
from shapely import LineString, Polygon

from houseexpo.corrections.apply import Corrected, correct_plan
from houseexpo.corrections.draft import Space
from houseexpo.corrections.vocabulary import Correction
from houseexpo.grids.frame import plan_points_from_source, source_points_from_plan
from houseexpo.plan.model import PlanData, shift_plan

_Plan = TypeVar("_Plan", bound=PlanData)


@dataclass(frozen=True, eq=False)
class Preview(Generic[_Plan]):
    """The corrected plan, in the coordinates and with the quality of the built plan, and a record of each correction.

    A record has the keys of ``Effect.as_record``, and ``built``: whether the plan was built with this correction.
    """

    plan: _Plan
    records: tuple[dict[str, Any], ...]


def preview(
    plan: _Plan,
    corrections: Sequence[Correction],
    base: _Plan | None = None,
    spaces: Iterable[Space] = (),
    standing: Iterable[Polygon] = (),
    *,
    walls: Iterable[Polygon] | None = None,
    lines: Iterable[LineString] = (),
) -> Preview[_Plan]:
    """Return the effects of corrections on a plan that may have been built with some of them.

    Parameters
    ----------
    plan
        The plan as it was built.
    corrections
        All corrections of the plan, with points along the axes of its source.
    base
        The plan without any correction, if it is known. Otherwise, corrections that are built in stay, and the record
        of a ``room`` outside the plan says that the build will look for it.
    spaces, standing, walls, lines
        What the source shows, in the coordinates of ``base``; see ``correct_plan``.
    """
    built = {_key(told["word"], told["value"]): told for told in (plan.provenance or {}).get("corrections", [])}
    if plan.frame is None or (not corrections and (base is None or not built)):
        return Preview(plan, ())
    if base is not None:
        return _from_base(
            plan, correct_plan(base, corrections, spaces, standing, walls=walls, lines=lines, measure=False), built
        )
    said = [each for each in corrections if each.word != "wall" or _key(each.word, each.value) not in built]
    found = correct_plan(plan, said, measure=False)  # a wall once more would shut the cut that followed from it
    effects, records = {effect.correction: effect.as_record() for effect in found.effects}, []
    for each in corrections:
        before = built.get(_key(each.word, each.value))
        told = effects[each] if each in effects else dict(before or {})
        if before is None and told["word"] == "room" and told["outcome"] == "none":
            told["outcome"], told["said"] = "done", "the build looks for a closed space there"
        records.append({**(told if before is None else before), "built": before is not None})
    if len(found.followed) and records:
        new = [record for record in records if not record["built"] and record["outcome"] == "done"]
        if new:
            new[-1]["also"] = [*new[-1].get("also", []), *found.followed]
    return Preview(_in_place_of(found.plan, plan), tuple(records))


def _from_base(plan: _Plan, found: Corrected[_Plan], built: Mapping[bytes, dict[str, Any]]) -> Preview[_Plan]:
    records = []
    for effect in found.effects:
        told = effect.as_record()
        records.append({**told, "built": _key(told["word"], told["value"]) in built})
    done = [record for record in records if record["outcome"] == "done"]
    if found.followed and done:
        done[-1]["also"] = [*done[-1].get("also", []), *found.followed]
    shown = replace(found.plan, quality=plan.quality)  # ``base`` has the quality of the plan without corrections
    return Preview(_in_place_of(shown, plan), tuple(records))


def _key(word: str, value: Any) -> bytes:
    return msgspec.json.encode([word, value])


def _in_place_of(plan: _Plan, base: _Plan) -> _Plan:
    """Return a corrected plan shifted to the coordinates of ``base``, from which it was made."""
    if plan is base or plan.frame is None or base.frame is None:
        return plan
    origin = source_points_from_plan(plan.frame, np.zeros((1, 2)))
    x, y = np.round(plan_points_from_source(base.frame, origin)[0], 2).tolist()
    return shift_plan(plan, x, y) if x or y else plan
