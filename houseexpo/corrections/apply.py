"""Apply what a person says of a storey to its plan, word by word, and say at once what each word did.

R1  A correction changes the rooms and passages that it touches. Everything else stays as it is.
R2  Words are applied in the order of ``WORDS``, so that a table says the same whatever the order of its keys. A
    person's word wins over what was found. Of two words that contradict each other both are named, and the later one
    does nothing.
R3  ``door``, ``opening``: in a wall between two rooms it joins them; in an outer wall it leads outside; on a floor it
    parts the room (``openings``), if the rest of its line is at most a metre. A wider door than any is an opening.
    What stands there gives way. Behind it, a space into which nothing led becomes a room. Lines of which none parts a
    room alone part it together; as long as they do not, they wait.
R4  ``entrance``: a door to the outside, whatever lies there. ``wall``: parts the rooms that it crosses.
R5  ``one_room``: rooms and the passages and walls between them become one. ``no_wall``: so do the rooms at both sides
    of a line in a wall, joined by what of the wall is drawn. ``no_door``: the passage there is wall; ``window``: it is
    a window, which plans do not have.
R6  ``room``: a space between walls that the plan does not have is one; ``room_outline``: an area is one, as far as it
    is free. Entrances that lead to its place lead into it. ``no_room``: the room there is none, and its doors to others
    lead outside. ``outside``: so do they, and where rooms meet it without a wall, they are open. ``label``: names a
    room.
R7  At last the rooms must be joined: where words have parted them, the thinnest wall between them is cut, and that is
    said. What no cut reaches is left out. A cut that a person's door makes needless goes.
R8  A part that a person has said has confidence 1.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Generic, Literal, TypeVar

import numpy as np
import shapely
from shapely import Polygon

from houseexpo.corrections.draft import (
    Draft,
    DraftDoor,
    DraftRoom,
    Space,
    Vector,
)
from houseexpo.corrections.openings import SNAP_M, STEP_M, WALL_REACH_M, Strip, edges_of, faces_beside
from houseexpo.corrections.passages import clear_part, fit_to_wall, part_together, place_passage, remove_passage
from houseexpo.corrections.rooms import (
    add_room,
    draw_room,
    join_rooms,
    name_room,
    place_wall,
    remove_room,
    remove_wall,
)
from houseexpo.corrections.saying import AlreadySoError, NoEffectError, PartsNothingError, Placed, Said
from houseexpo.corrections.vocabulary import Correction, Word
from houseexpo.grids.frame import plan_points_from_source
from houseexpo.inference import with_rooms
from houseexpo.plan.model import PlanData

Outcome = Literal["done", "already", "none"]

_Plan = TypeVar("_Plan", bound=PlanData)


@dataclass(frozen=True)
class Effect:
    """What became of one correction: ``done``, ``already`` so, or ``none`` and why.

    ``also`` is what changed beside it. ``waits``: it does nothing alone, but may with others of its kind (R3).
    """

    correction: Correction
    outcome: Outcome
    said: str
    also: tuple[str, ...] = ()
    waits: bool = False

    @property
    def sentence(self) -> str:
        """The effect in words."""
        return "; ".join((self.said, *self.also))

    def as_record(self) -> dict[str, Any]:
        """Return it as a plan's provenance has it."""
        value = self.correction.value
        plain = [list(part) if isinstance(part, tuple) else part for part in value]
        return {
            "word": self.correction.word,
            "value": plain,
            "outcome": self.outcome,
            "said": self.said,
            **({"also": list(self.also)} if self.also else {}),
            **({"waits": True} if self.waits else {}),
        }


@dataclass(frozen=True, eq=False)
class Corrected(Generic[_Plan]):
    """A corrected plan, what each correction did, and what followed from all of them together."""

    plan: _Plan
    effects: tuple[Effect, ...]
    followed: tuple[str, ...] = ()

    @property
    def has_changed(self) -> bool:
        """Whether any correction had an effect."""
        return any(effect.outcome == "done" for effect in self.effects)


def correct_plan(
    plan: _Plan, corrections: Sequence[Correction], spaces: Iterable[Space] = (), *, measure: bool = True
) -> Corrected[_Plan]:
    """Return a plan with corrections applied (R1 to R8), and the effect of each, in the order given.

    Parameters
    ----------
    plan
        A plan; one without rooms is divided first. Without a ``frame``, points are in the plan's own axes.
    spaces
        Spaces between walls that the plan does not have, in its coordinates; ``room`` and ``door`` may need them.
    measure
        Whether the navigability is measured again, if the plan records it.

    Raises
    ------
    PlanError
        The plan has no rooms, and its outline cannot be repaired.
    """
    plan = plan if plan.rooms else with_rooms(plan)
    draft = Draft(plan, spaces)
    placed = [Placed(each, _in_plan(plan, each)) for each in corrections]
    effects = _apply_all(draft, placed)
    if not any(effect.outcome == "done" for effect in effects):
        return Corrected(draft.made(measure=False) if draft.is_surer else plan, tuple(effects))
    followed = tuple(settle(draft))
    return Corrected(draft.made(measure=measure), tuple(effects), followed)


def _in_plan(plan: PlanData, correction: Correction) -> Vector:
    points = np.array(correction.points, dtype=np.float64).reshape(-1, 2)
    return points if plan.frame is None else plan_points_from_source(plan.frame, points)


def _apply_all(draft: Draft, placed: Sequence[Placed]) -> list[Effect]:
    """Apply words in turn; lines that wait are tried together after the last of their kind (R3)."""
    effects: list[Effect] = []
    last = max((k for k, each in enumerate(placed) if each.correction.word in _PARTING), default=-1)
    for k, each in enumerate(placed):
        effects.append(_apply(draft, each))
        waiting = [number for number, effect in enumerate(effects) if effect.waits] if k == last else []
        if len(waiting) > 1:
            for number, said in part_together(draft, [placed[at] for at in waiting]).items():
                effects[waiting[number]] = Effect(placed[waiting[number]].correction, "done", said.text)
    return effects


_PARTING: Final = frozenset({"door", "opening"})


def _apply(draft: Draft, placed: Placed) -> Effect:
    correction = placed.correction
    before = list(draft.rooms), list(draft.doors)
    try:
        done = _WORDS[correction.word](draft, placed)
    except AlreadySoError as stands:
        return Effect(correction, "already", str(stands))
    except PartsNothingError as waits:
        draft.rooms, draft.doors = before
        said = f"{waits}; it waits for other lines that part it together with this one"
        return Effect(correction, "none", said, waits=True)
    except NoEffectError as refused:
        draft.rooms, draft.doors = before
        return Effect(correction, "none", str(refused))
    return Effect(correction, "done", done.text, tuple(done.also))


_WORDS: Final[Mapping[Word, Callable[[Draft, Placed], Said]]] = {
    "room": add_room,
    "room_outline": draw_room,
    "wall": place_wall,
    "no_wall": remove_wall,
    "door": place_passage,
    "opening": place_passage,
    "entrance": place_passage,
    "one_room": join_rooms,
    "no_door": remove_passage,
    "window": remove_passage,
    "no_room": remove_room,
    "outside": remove_room,
    "label": name_room,
}


# Join what words have parted, and take out what they make needless (R7).


CUT_M: Final = 0.8
"""The width of a cut: ``pipeline.config.ConnectivityConfig.cut_width_m``."""

_SAME_M: Final = 1e-6
"""Walls whose thickness differs by less are equally thin, metres."""


def settle(draft: Draft) -> Iterator[str]:
    """Join what words have parted, and take out the cuts that a person's door makes needless; yield what was done."""
    while len(groups := draft.pieces()) > 1:
        found = _thinnest_wall(draft, groups[-1], groups[:-1])
        names = " and ".join(draft.name(room) for room in groups[-1][:3])
        if found is None:
            for room in groups[-1]:
                draft.remove_room(room)
            yield f"nothing leads into {names} any more, and no wall near is thin enough for a cut: left out"
            continue
        strip, (one, other) = found
        area = clear_part(strip.polygon(deeper_m=STEP_M), (room.shape for room in draft.rooms), strip.centre)
        draft.doors.append(DraftDoor("cut", area, strip.ends, (one, other), None))
        yield (
            f"nothing else led into {names}: a cut of {strip.length:.2f} m joins {draft.name(one)} and "
            f"{draft.name(other)}; if the way is elsewhere, draw the door"
        )
    yield from _without_needless_cuts(draft)


def _without_needless_cuts(draft: Draft) -> Iterator[str]:
    for cut in [door for door in draft.doors if door.kind == "cut" and door.before is not None]:
        if not _was_needed(draft, cut):
            continue
        without = [door for door in draft.doors if door is not cut]
        kept, draft.doors = draft.doors, without
        if len(draft.pieces()) > 1:
            draft.doors = kept
        else:
            one, other = cut.rooms
            assert other is not None  # noqa: S101  # a cut joins two rooms
            yield f"the cut between {draft.name(one)} and {draft.name(other)} is not needed any more, and gone"


def _was_needed(draft: Draft, cut: DraftDoor) -> bool:
    """Return whether nothing but a cut joined two parts of the plan as it was."""
    before = Draft(draft.plan)
    before.doors = [door for door in before.doors if door.before is not cut.before]
    return len(before.pieces()) > 1


def _thinnest_wall(
    draft: Draft, part: Sequence[DraftRoom], others: Sequence[Sequence[DraftRoom]]
) -> tuple[Strip, tuple[DraftRoom, DraftRoom]] | None:
    """Return where the thinnest wall between some rooms and the others takes a cut, clear of other passages.

    A wall is no thinner than the way from its line to the nearest other room. So lines are tried from the nearest on,
    until none can be thinner; of equally thin walls, the first along the rooms' edges is taken.
    """
    rest = [room for group in others for room in group]
    shapes = [room.shape for room in rest]
    taken = shapely.union_all([door.shape for door in draft.doors]) if draft.doors else Polygon()
    lines = [(room, line, side) for room in part for line, side in _lines_along(room.shape)]
    ways = shapely.distance([shapely.LineString(line.ends) for _, line, _ in lines], shapely.union_all(shapes))
    found: list[tuple[int, Strip, tuple[DraftRoom, DraftRoom]]] = []
    thinnest = math.inf
    for k in np.argsort(ways, kind="stable").tolist():
        if ways[k] > min(thinnest, WALL_REACH_M) + _SAME_M:
            break
        room, line, side = lines[k]
        faces = faces_beside(line, [room.shape, *shapes])
        there = faces.shapes[side] - 1
        low, high = faces.clear
        if there < 0 or high - low < CUT_M - 0.02:
            continue
        strip = fit_to_wall(line, faces)
        if strip.depth <= thinnest + _SAME_M and not strip.polygon().intersects(taken):
            found.append((k, strip, (room, rest[there])))
            thinnest = min(thinnest, strip.depth)
    best = min((each for each in found if each[1].depth <= thinnest + _SAME_M), default=None, key=lambda each: each[0])
    return None if best is None else best[1:]


def _lines_along(shape: Polygon) -> Iterator[tuple[Strip, int]]:
    """Yield the lines as wide as a cut, just outside a room along its edges, in steps, and the side away from it."""
    for start, end in zip(*edges_of([shape]), strict=True):
        length = math.dist(start, end)
        if length < CUT_M:
            continue
        along = (end - start) / length
        for at in np.arange(CUT_M / 2, length - CUT_M / 2 + 1e-9, SNAP_M).tolist():
            line = Strip(start + along * at, along, CUT_M, 0.0)
            outside = -1 if shape.covers(shapely.Point(line.before(1, 0.02))) else 1
            yield Strip(line.centre + outside * line.across * 0.01, along, CUT_M, 0.0), 0 if outside < 0 else 1
