"""What a source holds and a plan does without: a fault costs the part that it is in, with a note, never the house."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Final

from pipeline.rejection import Reason, Rejection

KEY: Final = "left_out"
"""Under which name the note stands in a plan's provenance."""

_LACKS: Final = {"missing": "missing", KEY: "left out as damaged"}
_NAMED: Final = 5
_LETTERS: Final = 300


class LeftOut:
    """Collects the parts of one house that could not be read, each with the reason."""

    def __init__(self) -> None:
        self._why: dict[str, None] = {}

    def __len__(self) -> int:
        return len(self._why)

    @contextmanager
    def part(self) -> Iterator[None]:
        """Read a part: where that ends in a Rejection, the part is left out, and the text of it is kept.

        What is too large ends the reading all the same: the next part would be too.
        """
        try:
            yield
        except Rejection as fault:
            if fault.reason is Reason.TOO_LARGE:
                raise
            self._why[fault.detail] = None

    def add(self, why: str) -> None:
        """Leave a part out; ``why`` names it and says what is wrong with it."""
        self._why[why] = None

    @property
    def note(self) -> str:
        """The first parts with their reasons, and how many there are, or "" if there is none."""
        named = "; ".join(list(self._why)[:_NAMED])
        more = len(self._why) - _NAMED
        return f"{named}; and {more} more" if more > 0 else named

    @property
    def provenance(self) -> dict[str, str]:
        """What stands in a plan's provenance of it: nothing where nothing is left out."""
        return {KEY: self.note} if self._why else {}


def told_of(rejection: Rejection, provenance: Mapping[str, Any]) -> Rejection:
    """Return a rejection that also says what of the source was missing or damaged: that may be why."""
    lacks = [f"{words}: {str(provenance[key])[:_LETTERS]}" for key, words in _LACKS.items() if provenance.get(key)]
    if not lacks:
        return rejection
    detail = f"{rejection.detail}; {'; '.join(lacks)}"
    return Rejection(rejection.stage, rejection.reason, detail, rejection.advice, rejection.picture)
