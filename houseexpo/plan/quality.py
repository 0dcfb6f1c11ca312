"""The pipeline's confidence in a plan (docs/format.md, key ``quality``)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from houseexpo.errors import PlanError
from houseexpo.plan import checks
from houseexpo.plan.value import Value

SURE: Final = 0.8
"""A plan with a lower score is doubtful."""


@dataclass(frozen=True, eq=False)
class Quality(Value):
    """The confidence in a plan: a ``score`` from 0 to 1, and the ``grounds`` that it is based on.

    A ground is a named number, such as the share of doors that are cuts. Grounds are sorted by name, so that equal
    grounds are written as equal bytes.

    Examples
    --------
    >>> Quality(0.93, {"cut_share": 0.0, "guessed_wall_share": 0.1}).is_doubtful
    False
    """

    score: float
    grounds: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        score = checks.number(self.score, "score")
        if not 0 <= score <= 1:
            raise PlanError(f"expected 0 to 1, found {score}", "score")
        self._set("score", score)
        for name in self.grounds:
            checks.text(name, "grounds")
        grounds = {name: checks.number(self.grounds[name], f"grounds.{name}") for name in sorted(self.grounds)}
        self._set("grounds", grounds)

    @property
    def is_doubtful(self) -> bool:
        """Whether the score is below ``SURE``."""
        return self.score < SURE
