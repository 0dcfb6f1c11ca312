"""Apply what a person says of a storey to its plan, word by word, and say at once what each word did.

R1  A correction changes the rooms and passages that it touches. Everything else stays as it is.
R2  Words are applied in the order of ``WORDS``, so that a table says the same whatever the order of its keys. A
    person's word wins over what was found. Of two words that contradict each other both are named, and the later one
    does nothing.
R3  ``door``, ``opening``: in a wall between two rooms it joins them; in an outer wall it leads outside; on a floor it
    parts the room (``openings``), if the rest of its line is at most a metre. A wider door than any is an opening.
    What stands there gives way. Behind it, a space into which nothing led becomes a room. Lines of which none parts a
    room alone part it together; as long as they do not, they wait.
R4  ``entrance``: a door to the outside, whatever lies there. ``wall``: parts the rooms that it crosses. Spaces that it
    closes, with what stands in the source, with rooms and with other walls, are rooms; as long as it closes none, it
    waits.
R5  ``one_room``: rooms and the passages and walls between them become one. ``no_wall``: so do the rooms at both sides
    of a line in a wall, joined by what of the wall is drawn. ``no_door``: the passage there is wall; ``window``: it is
    a window, which plans do not have.
R6  ``room``: a space between walls that the plan does not have is one; ``room_outline``: an area is one, as far as it
    is free. Entrances that lead to its place lead into it. ``no_room``: the room there is none, and its doors to others
    lead outside. ``outside``: so do they, and where rooms meet it without a wall, they are open. ``label``: names a
    room.
R7  At last, what words have parted is joined by a cut, or stays apart where a person says so (``joining``). That is
    said.
R8  A part that a person has said has confidence 1.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Generic, Literal, TypeVar

import numpy as np
import shapely
from shapely import Polygon

from houseexpo.corrections.draft import Draft, Space, Vector
from houseexpo.corrections.joining import settle
from houseexpo.corrections.passages import part_onward, part_together, place_passage, remove_passage
from houseexpo.corrections.rooms import (
    add_room,
    close_spaces,
    draw_room,
    join_rooms,
    name_room,
    place_wall,
    remove_room,
    remove_wall,
)
from houseexpo.corrections.saying import (
    AlreadySoError,
    NoEffectError,
    PartsNothingError,
    Placed,
    Said,
    contradiction,
)
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
    plan: _Plan,
    corrections: Sequence[Correction],
    spaces: Iterable[Space] = (),
    standing: Iterable[Polygon] = (),
    *,
    measure: bool = True,
) -> Corrected[_Plan]:
    """Return a plan with corrections applied (R1 to R8), and the effect of each, in the order given.

    Parameters
    ----------
    plan
        A plan; one without rooms is divided first. Without a ``frame``, points are in the plan's own axes.
    spaces
        Spaces between walls that the plan does not have, in its coordinates; ``room`` and ``door`` may need them.
    standing
        The walls of the source and what may close their gaps, in its coordinates; ``wall`` may need them.
    measure
        Whether the navigability is measured again, if the plan records it.

    Raises
    ------
    PlanError
        The plan has no rooms, and its outline cannot be repaired.
    """
    plan = plan if plan.rooms else with_rooms(plan)
    draft = Draft(plan, spaces, standing)
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
    """Apply words in turn; what does nothing is tried again after the others, lines that wait then together (R3)."""
    effects: list[Effect] = []
    last_wall = max((k for k, each in enumerate(placed) if each.correction.word == "wall"), default=-1)
    last = max((k for k, each in enumerate(placed) if each.correction.word in _PARTING), default=-1)
    for k, each in enumerate(placed):
        effects.append(_apply(draft, each, _WORDS[each.correction.word]))
        if k == last_wall:
            _close_with_walls(draft, placed, effects)
        if k == last:
            _apply_waiting(draft, placed, effects)
    has_more = True
    while has_more:  # a room in which a word acts may be the work of a later one
        idle = [k for k, effect in enumerate(effects) if effect.outcome == "none" and not effect.waits]
        for k in idle:
            effects[k] = _apply(draft, placed[k], _WORDS[placed[k].correction.word])
        has_more = any(effects[k].outcome == "done" for k in idle)
    return effects


_PARTING: Final = frozenset({"door", "opening"})


def _close_with_walls(draft: Draft, placed: Sequence[Placed], effects: list[Effect]) -> None:
    """Make rooms of the spaces that walls close which lie in no room (R4)."""
    loose = [k for k, effect in enumerate(effects) if effect.correction.word == "wall" and effect.outcome != "done"]
    for number, said in close_spaces(draft, [placed[k] for k in loose]).items():
        effects[loose[number]] = Effect(placed[loose[number]].correction, "done", said.text, tuple(said.also))


def _apply_waiting(draft: Draft, placed: Sequence[Placed], effects: list[Effect]) -> None:
    """Part rooms along lines that part none alone: together, or else as far as each goes on straight (R3)."""
    waiting = [k for k, effect in enumerate(effects) if effect.waits and effect.correction.word in _PARTING]
    before = draft.state()
    together = part_together(draft, [placed[at] for at in waiting])
    if together and (said := _parted_again(draft)):
        draft.restore(before)
        together = {}
        for number in waiting:
            effects[number] = Effect(placed[number].correction, "none", str(contradiction(said, "joins them, and")))
    for number, at in enumerate(waiting):
        if number in together:
            effects[at] = Effect(placed[at].correction, "done", together[number].text)
        elif effects[at].waits:
            onward = _apply(draft, placed[at], part_onward)
            effects[at] = onward if onward.outcome == "done" else effects[at]


def _parted_again(draft: Draft) -> str:
    """Return a correction that has made rooms one where a passage that is said parts them again, "" if none has."""
    for seam in draft.joined:
        for door in draft.inner_doors:
            if door.said and shapely.intersection(door.shape, seam.shape).area > door.shape.area / 2:
                return seam.said
    return ""


def _apply(draft: Draft, placed: Placed, word: Callable[[Draft, Placed], Said]) -> Effect:
    correction = placed.correction
    before = draft.state()
    try:
        done = word(draft, placed)
        if correction.word in _PARTING and (said := _parted_again(draft)):
            raise contradiction(said, "joins them, and")
    except AlreadySoError as stands:
        return Effect(correction, "already", str(stands))
    except PartsNothingError as waits:
        draft.restore(before)
        said = f"{waits}; it waits for other lines that do so together with this one"
        return Effect(correction, "none", said, waits=True)
    except NoEffectError as refused:
        draft.restore(before)
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
