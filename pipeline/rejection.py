"""Define Rejection, raised where an input gives no plan: a stage, a reason code for counts, a detail for people."""

from __future__ import annotations

from enum import StrEnum


class Reason(StrEnum):
    """Reason codes. Each rule that replaces a judgement by eye in the paper has its own code."""

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
    NOT_YET = "not_yet"
    DROPPED_BY_HAND = "dropped_by_hand"
    NO_SUCH_LEVEL = "no_such_level"
    DOUBTFUL = "doubtful"
    # layout rules
    NO_LAYOUT = "no_layout"
    NOT_ENCLOSED = "not_enclosed"
    CHARACTERS = "characters"
    NO_ROOM_FITS = "no_room_fits"


class Rejection(Exception):  # noqa: N818 - an outcome that unwinds the stages, not a fault
    """Raised by a reader or a stage if a house cannot become a plan; the build records it and continues.

    ``detail`` says which thing is wrong, what was expected and what was found; ``advice`` says what to do. ``picture``
    may be a small PNG of the rejected house (``pipeline.png``), for the report.
    """

    def __init__(self, stage: str, reason: Reason, detail: str, advice: str = "", picture: bytes = b"") -> None:
        super().__init__(stage, reason, detail, advice, picture)  # pickles as it is made
        self.stage, self.reason, self.detail, self.advice, self.picture = stage, reason, detail, advice, picture

    def with_picture(self, picture: bytes) -> Rejection:
        """Return the rejection with a picture, unless it has one."""
        return Rejection(self.stage, self.reason, self.detail, self.advice, self.picture or picture)

    def __str__(self) -> str:
        text = f"{self.stage}: {self.reason}: {self.detail}"
        return f"{text} ({self.advice})" if self.advice else text
