"""Say what a word does while it is applied to a draft: what it did, or the error by which it does nothing."""

from __future__ import annotations

from dataclasses import dataclass, field

from houseexpo.corrections.draft import Vector
from houseexpo.corrections.vocabulary import Correction


class NoEffectError(Exception):
    """A word has no effect; the text says why."""


class PartsNothingError(NoEffectError):
    """A line parts nothing by itself; together with others it may."""


class AlreadySoError(Exception):
    """The plan says so already."""


def contradiction(said: str, what: str = "") -> NoEffectError:
    """Return the error of a word that contradicts an earlier one, which it names; ``what`` is what that one does."""
    return NoEffectError(f"{said}{f' {what}' if what else ''} is said too; take one of the two out")


@dataclass(frozen=True, eq=False)
class Placed:
    """A correction, and its points (n, 2) in the plan's coordinates."""

    correction: Correction
    points: Vector


@dataclass
class Said:
    """What a word did, and what changed beside it."""

    text: str
    also: list[str] = field(default_factory=list)
