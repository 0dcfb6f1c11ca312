"""Why an input gave no plan: the stage, a reason that the report counts, a detail for the person who looks."""

from __future__ import annotations

from enum import StrEnum


class Reason(StrEnum):
    """Reason codes; each rule that stands for what the paper left to people has its own."""

    # reading
    MISSING_FILE = "missing_file"
    UNREADABLE = "unreadable"
    EMPTY = "empty"
    NOT_FINITE = "not_finite"
    TOO_LARGE = "too_large"
    BAD_UNITS = "bad_units"
    NO_LEVEL = "no_level"
    NO_INTERIOR = "no_interior"
    TIMEOUT = "timeout"
    OUT_OF_MEMORY = "out_of_memory"
    INTERNAL = "internal"
    DROPPED_BY_HAND = "dropped_by_hand"
    # layout rules
    NO_LAYOUT = "no_layout"
    NOT_ENCLOSED = "not_enclosed"
    CHARACTERS = "characters"
    NO_ROOM_FITS = "no_room_fits"
    UNREACHABLE = "unreachable"


class Rejection(Exception):  # noqa: N818 - an outcome that unwinds the stages, not a fault
    """Raised by a reader or a stage where a house cannot become a plan; the batch records it and goes on.

    ``detail`` says which thing, what was expected, what was found; ``advice`` says what to do.
    """

    def __init__(self, stage: str, reason: Reason, detail: str, advice: str = "") -> None:
        super().__init__(stage, reason, detail, advice)  # pickles as it is made
        self.stage, self.reason, self.detail, self.advice = stage, reason, detail, advice

    def __str__(self) -> str:
        text = f"{self.stage}: {self.reason}: {self.detail}"
        return f"{text} ({self.advice})" if self.advice else text
