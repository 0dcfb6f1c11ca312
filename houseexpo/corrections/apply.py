"""Apply a person's corrections of a storey to its plan, one word at a time, and report the effect of each.

R1  A correction changes the rooms and passages that it touches. Everything else stays as it is.
R2  Words are applied in the order in which they were said, as far as a review's log tells: each is of the plan that was
    shown then. Others come before, in the order of ``WORDS``, so the order of a table's keys does not matter, and the
    values of one word in their order. A person's word wins over what the build found. A word without an
    effect is tried again after the walls, after the passages and at the end, since a later word may make the room that
    it needs; but a room that is drawn on what was no wall before has its walls. If two words contradict each other,
    the later one does nothing and its message names the other.
R3  ``door``, ``opening``: in a wall between two rooms, it joins them. In an outer wall, it leads outside. On a floor,
    it parts the room (``openings``) if walls lie at most 1 m beyond its ends. A door wider than ``WIDEST_DOOR_M``
    becomes an opening. A passage that was found in its place is removed. A space behind it that nothing led into
    becomes a room. A line that parts no room by itself waits: several waiting lines may part a room together. A line
    opens nothing beyond its ends.
R4  ``entrance``: a door to the outside, whatever lies there. ``wall``: parts the rooms that it crosses. Spaces that it
    encloses together with the source's walls, rooms and other drawn walls become rooms. A wall that encloses no space
    waits. Walls over more than half of a passage, or just before it, shut it. A passage in which a line ends becomes
    one passage for each of the rooms that the line parts.
R5  ``one_room``: the rooms become one, together with the passages and walls between them (``merging``). If a door or
    an opening then does nothing, and both have an effect in the other order, the rooms are parted first. ``no_wall``:
    the rooms on both sides of a line in a wall become one, joined by the drawn part of the wall, and walls in this
    room within ``SNAP_M`` of the line go; in an outer wall the room is open to the outside there, by an entrance. If it
    is a line of the drawing, a wall that another line draws there stays, and an outer wall too. ``no_door``: the
    passage becomes wall, or else the cut through the wall there. ``window``: the same, and a window is there.
R6  ``room``: a space that the plan lacks, and that walls, rooms and what may close gaps enclose, becomes a room.
    ``room_outline``: the area is a room with exactly this ring. Walls in it go. Other rooms lose what it covers, with a
    wall of ``SAID_WALL_M`` around it, and what is left of them if that is no room. If the area and a room agree but for
    a fifth, it replaces that room's outline. Passages in edges that moved are fitted to the new ones, or go.
    Entrances that lead to the place of a new room lead into it. ``no_room``: the room is removed, and its doors to
    other rooms lead outside. ``outside``: the same, and rooms that meet the area without a wall are open to it.
    ``label``: names a room.
R7  Finally, a cut joins parts that words have separated, unless a person says that there is no way (``joining``). A
    word without an effect may deny this cut. A message reports the others.
R8  A part that a person has stated has confidence 1.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Generic, Literal, TypeVar

import numpy as np
import shapely
from shapely import GEOSException, LineString, Polygon

from houseexpo.corrections.draft import (
    AlreadySoError,
    ContradictionError,
    Draft,
    NoEffectError,
    PartsNothingError,
    Placed,
    Said,
    Space,
    Vector,
)
from houseexpo.corrections.joining import settle
from houseexpo.corrections.openings import WALL_REACH_M, drop_lines
from houseexpo.corrections.passages import part_together, place_passage, remove_passage
from houseexpo.corrections.rooms import (
    add_room,
    close_spaces,
    draw_room,
    join_rooms,
    name_room,
    place_wall,
    remove_room,
    remove_wall,
    shut_together,
    wall_text,
)
from houseexpo.corrections.vocabulary import Correction, Word
from houseexpo.grids.frame import plan_points_from_source
from houseexpo.inference import with_rooms
from houseexpo.plan.model import PlanData

Outcome = Literal["done", "already", "none"]

_Plan = TypeVar("_Plan", bound=PlanData)


@dataclass(frozen=True)
class Effect:
    """The effect of one correction.

    ``outcome`` is "done", "already" if the plan was so before, or "none". ``said`` describes it, for "none" with the
    reason. ``also`` lists further changes. ``waits``: it does nothing alone, but may with others of its kind (R3).
    ``against`` is the earlier correction, as a text, that it contradicts (R2).
    """

    correction: Correction
    outcome: Outcome
    said: str
    also: tuple[str, ...] = ()
    waits: bool = False
    against: str = ""

    @property
    def sentence(self) -> str:
        """The effect as a sentence: ``said`` and ``also``."""
        return "; ".join((self.said, *self.also))

    def as_record(self) -> dict[str, Any]:
        """Return the effect as plain values, as stored in a plan's provenance."""
        return {
            "word": self.correction.word,
            "value": self.correction.plain_value,
            "outcome": self.outcome,
            "said": self.said,
            **({"also": list(self.also)} if self.also else {}),
            **({"waits": True} if self.waits else {}),
            **({"against": self.against} if self.against else {}),
        }


@dataclass(frozen=True, eq=False)
class Corrected(Generic[_Plan]):
    """A corrected plan, the effect of each correction, and the changes that all of them caused together (R7)."""

    plan: _Plan
    effects: tuple[Effect, ...]
    followed: tuple[str, ...] = ()

    @property
    def has_changed(self) -> bool:
        """Whether any correction had an effect."""
        return any(effect.outcome == "done" for effect in self.effects)


def correct_plan(
    plan: _Plan,
    corrections: Sequence[Correction],
    spaces: Iterable[Space] = (),
    standing: Iterable[Polygon] = (),
    *,
    walls: Iterable[Polygon] | None = None,
    lines: Iterable[LineString] = (),
    measure: bool = True,
) -> Corrected[_Plan]:
    """Return a plan with corrections applied (R1 to R8), and the effect of each, in the order given.

    Parameters
    ----------
    plan
        A plan; a plan without rooms is divided first (``with_rooms``).
    corrections
        The corrections; points are in metres along the axes of the source (``plan.frame``), or the plan's own axes if
        it has no frame.
    spaces
        Spaces between walls that the plan lacks, in the plan's coordinates; ``room`` and ``door`` may need them.
    standing
        The source's walls and whatever may close their gaps, in the plan's coordinates; ``wall`` may need them.
    walls
        The walls that the source shows, in the plan's coordinates; ``one_room`` may need them. None if they are not
        known.
    lines
        The straight lines of a drawing, in the plan's coordinates: a line that is no wall leaves the walls that others
        draw.
    measure
        Whether to measure the navigability again, if the plan records it.

    Raises
    ------
    PlanError
        The plan has no rooms, and its outline cannot be repaired.
    """
    plan = plan if plan.rooms else with_rooms(plan)
    draft, placed, effects = _begun(plan, corrections, spaces, standing, walls=walls, lines=lines)
    if not any(effect.outcome == "done" for effect in effects):
        return Corrected(draft.made(measure=False) if draft.is_surer else plan, tuple(effects))
    followed = _settle(draft, placed, effects)
    return Corrected(draft.made(measure=measure), tuple(effects), followed)


class Trial:
    """A plan with corrections, on which further ones are tried; see ``correct_plan`` for the parameters."""

    def __init__(
        self,
        plan: PlanData,
        said: Sequence[Correction] = (),
        spaces: Iterable[Space] = (),
        standing: Iterable[Polygon] = (),
        *,
        walls: Iterable[Polygon] | None = None,
        lines: Iterable[LineString] = (),
    ) -> None:
        plan = plan if plan.rooms else with_rooms(plan)
        self._draft, self._placed, self._effects = _begun(plan, said, spaces, standing, walls=walls, lines=lines)

    def outcomes(self, new: Sequence[Correction]) -> tuple[list[Outcome], int]:
        """Return the outcome of each of some corrections, said after the others, and the number of rooms with them."""
        before = self._draft.state()
        placed = [*self._placed, *(Placed(each, _in_plan(self._draft.plan, each)) for each in new)]
        effects = [*self._effects, *_apply_in_turn(self._draft, placed[len(self._placed) :])]
        if any(effect.outcome == "none" for effect in effects):
            _try_again(self._draft, placed, effects)
        rooms = len(self._draft.rooms)
        self._draft.restore(before)
        return [effect.outcome for effect in effects[len(self._placed) :]], rooms


def _begun(
    plan: PlanData,
    corrections: Sequence[Correction],
    spaces: Iterable[Space],
    standing: Iterable[Polygon],
    *,
    walls: Iterable[Polygon] | None,
    lines: Iterable[LineString],
) -> tuple[Draft, list[Placed], list[Effect]]:
    """Return a draft with corrections applied, before cuts are made and removed (R7), and their effects."""
    draft = Draft(plan, spaces, standing, walls, lines)
    placed = [Placed(each, _in_plan(plan, each)) for each in corrections]
    erased = [each for each in placed if each.correction.word == "no_wall"]
    draft.lines, found = drop_lines(draft.lines, [each.points for each in erased])
    draft.no_walls = {str(erased[k].correction) for k in found}
    return draft, placed, _apply_all(draft, placed)


def _settle(draft: Draft, placed: Sequence[Placed], effects: list[Effect]) -> tuple[str, ...]:
    """Make and remove cuts (R7) without those that a person denies; return sentences about them."""
    while True:
        before, count = draft.state(), len(draft.denied)
        followed = tuple(settle(draft))
        for k, each in enumerate(placed):
            if each.correction.word in _DENYING and effects[k].outcome == "none":
                effects[k] = _apply(draft, each, remove_passage)
        denied = draft.denied
        if len(denied) == count:
            return followed
        draft.restore(before)
        draft.denied = denied


def _in_plan(plan: PlanData, correction: Correction) -> Vector:
    points = np.array(correction.points, dtype=np.float64).reshape(-1, 2)
    return points if plan.frame is None else plan_points_from_source(plan.frame, points)


def _apply_all(draft: Draft, placed: Sequence[Placed]) -> list[Effect]:
    """Apply words in turn; if a line then does nothing in joined rooms, lines part before rooms are joined (R5)."""
    before = draft.state()
    effects = _apply_in_turn(draft, placed)
    idle = [effect.correction.word for effect in effects if effect.outcome == "none"]
    joins = [k for k, each in enumerate(placed) if each.correction.word == "one_room"]
    if not joins or _PARTING.isdisjoint(idle):
        return effects
    found = draft.state()
    draft.restore(before)
    parted = max(k for k, each in enumerate(placed) if each.correction.word in _PARTING)
    order = [k for k in range(parted + 1) if k not in joins] + joins
    order += [k for k in range(len(placed)) if k not in order]
    again = dict(zip(order, _apply_in_turn(draft, [placed[k] for k in order]), strict=True))
    if len(idle) > sum(effect.outcome == "none" for effect in again.values()) and all(
        again[k].outcome != "none" for k, effect in enumerate(effects) if effect.outcome != "none"
    ):
        return [again[k] for k in range(len(placed))]
    draft.restore(found)
    return effects


def _apply_in_turn(draft: Draft, placed: Sequence[Placed]) -> list[Effect]:
    """Apply words in turn. After walls, after passages and at the end, try those without an effect again."""
    effects: list[Effect] = []
    words = [each.correction.word for each in placed]
    ends = {max((k for k, word in enumerate(words) if word in kinds), default=-1) for kinds in ({"wall"}, _PARTING)}
    for k, each in enumerate(placed):
        effects.append(_apply(draft, each, _WORDS[words[k]]))
        if k in {*ends, len(placed) - 1}:
            _try_again(draft, placed, effects)
    return effects


def _try_again(draft: Draft, placed: Sequence[Placed], effects: list[Effect]) -> None:
    """Try words without an effect again until none has one: a later word may make the room that an earlier needs."""
    has_more = True
    while has_more:
        idle = [k for k, effect in enumerate(effects) if effect.outcome == "none"]
        for k in idle:
            if not _is_edge_of_later_room(draft, placed, k):
                effects[k] = _apply(draft, placed[k], _WORDS[placed[k].correction.word])
        _close_with_walls(draft, placed, effects)
        _apply_waiting(draft, placed, effects)
        idle += _join_again(draft, placed, effects)
        has_more = any(effects[k].outcome == "done" for k in idle)


def _is_edge_of_later_room(draft: Draft, placed: Sequence[Placed], k: int) -> bool:
    """Return whether a line that was said to be no wall lies beside a room that was drawn after that."""
    if placed[k].correction.word != "no_wall":
        return False
    later, line = _outlines_after(placed, k), LineString(placed[k].points)
    return any(room.said in later and is_at_edge(line, room.shape) for room in draft.rooms)


def is_at_edge(line: LineString, room: Polygon) -> bool:
    """Return whether a line that was said to be no wall is so near that it would open a room drawn after that."""
    return bool(room.distance(line) <= WALL_REACH_M)


def _outlines_after(placed: Sequence[Placed], k: int) -> set[str]:
    """Return the outlines, as texts, that were drawn after a word."""
    return {str(each.correction) for each in placed[k:] if each.correction.word == "room_outline"}


_PARTING: Final = frozenset({"door", "opening"})
_DENYING: Final = frozenset({"no_door", "window"})


def _close_with_walls(draft: Draft, placed: Sequence[Placed], effects: list[Effect]) -> None:
    """Shut passages that walls cover together, and make rooms of the spaces that they enclose outside rooms (R4)."""
    walls = [k for k, effect in enumerate(effects) if effect.correction.word == "wall"]
    for number, shut in shut_together(draft, [placed[k] for k in walls]).items():
        at = walls[number]
        known = effects[at].also if effects[at].outcome == "done" else ()
        effects[at] = Effect(placed[at].correction, "done", wall_text(placed[at]), (*known, *shut))
    loose = [k for k, effect in enumerate(effects) if effect.correction.word == "wall" and effect.outcome != "done"]
    for number, said in close_spaces(draft, [placed[k] for k in loose]).items():
        effects[loose[number]] = Effect(placed[loose[number]].correction, "done", said.text, tuple(said.also))


def _join_again(draft: Draft, placed: Sequence[Placed], effects: list[Effect]) -> list[int]:
    """Merge rooms that were one when ``one_room`` was applied, and that a later line has parted; return its indices.

    A later outline of one of them is of what is shown by then, and stays.
    """
    again = []
    for k, effect in enumerate(effects):
        if effect.correction.word == "one_room" and effect.outcome != "none":
            later = _outlines_after(placed, k)
            if any(room and room.said in later for room in map(draft.room_at, placed[k].points)):
                continue
            found = _apply(draft, placed[k], join_rooms)
            if found.outcome == "done" or (found.outcome == "none" and effect.outcome == "already"):
                effects[k] = found
                again.append(k)
    return again


def _apply_waiting(draft: Draft, placed: Sequence[Placed], effects: list[Effect]) -> None:
    """Part rooms along several waiting lines together (R3)."""
    waiting = [k for k, effect in enumerate(effects) if effect.waits and effect.correction.word in _PARTING]
    while True:
        draft.beside = []
        before = draft.state()
        together = part_together(draft, [placed[at] for at in waiting])
        again = _parted_again(draft)
        refused = {at: said for at in waiting if (said := again.get(str(placed[at].correction)))}
        if not refused:
            break
        draft.restore(before)
        for at, said in refused.items():
            effects[at] = Effect(
                placed[at].correction, "none", str(ContradictionError(said, "joins them, and")), against=said
            )
        waiting = [at for at in waiting if at not in refused]
    for number, at in enumerate(waiting):
        if number in together:
            also, draft.beside = tuple(draft.beside), []
            effects[at] = Effect(placed[at].correction, "done", together[number].text, also)


def _parted_again(draft: Draft) -> dict[str, str]:
    """Return the stated passages that part merged rooms where they were joined, and the correction that joined them."""
    return {
        door.said: seam.said
        for seam in draft.joined
        for door in draft.inner_doors
        if door.said and shapely.intersection(door.shape, seam.shape).area > door.shape.area / 2
    }


def _apply(draft: Draft, placed: Placed, word: Callable[[Draft, Placed], Said]) -> Effect:
    correction = placed.correction
    draft.beside = []
    before = draft.state()
    try:
        done = word(draft, placed)
        if correction.word in _PARTING and (said := _parted_again(draft).get(str(correction))):
            raise ContradictionError(said, "joins them, and")
    except AlreadySoError as stands:
        return Effect(correction, "already", str(stands))
    except PartsNothingError as waits:
        draft.restore(before)
        said = f"{waits}; it waits for other lines that do so together with this one"
        return Effect(correction, "none", said, waits=True)
    except NoEffectError as refused:
        draft.restore(before)
        return Effect(correction, "none", str(refused), against=refused.against)
    except GEOSException as fault:
        draft.restore(before)
        return Effect(correction, "none", f"its shapes cannot be computed ({fault}); move a point by some centimetres")
    return Effect(correction, "done", done.text, (*done.also, *draft.beside))


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
