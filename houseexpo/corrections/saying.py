"""Define the result of applying a word to a draft: what it changed, or an error that says why it changed nothing."""

from __future__ import annotations

from dataclasses import dataclass, field

from houseexpo.corrections.draft import Vector
from houseexpo.corrections.vocabulary import Correction


class NoEffectError(Exception):
    """A word has no effect; the text says why."""


class PartsNothingError(NoEffectError):
    """A line parts no room by itself; it may part one together with other lines."""


class AlreadySoError(Exception):
    """The plan agrees with the word already."""


def contradiction(said: str, what: str = "") -> NoEffectError:
    """Return the error for a word that contradicts the earlier word ``said``; ``what`` describes the earlier word."""
    return NoEffectError(f"{said}{f' {what}' if what else ''} is said too; take one of the two out")


@dataclass(frozen=True, eq=False)
class Placed:
    """A correction, and its points (n, 2) in the plan's coordinates."""

    correction: Correction
    points: Vector


@dataclass
class Said:
    """The change that a word made, and further changes, as sentences."""

    text: str
    also: list[str] = field(default_factory=list)
