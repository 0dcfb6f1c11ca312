"""Score a plan's quality, 0 to 1, from its measured signs of faults (logistic), and reject plans below a limit.

A ground is 0 where nothing speaks against the plan and 1 where everything does, so no weight is above 0::

    score = 1 / (1 + exp(-(BIAS + sum of weight * ground)))

BIAS and weights were fitted on the kit of kinds, its houses sound and damaged, and, three times as strongly, on those
files of other people that a person has judged (the first half of the corpus, ``docs/contributing/corpus.md``). The bias
is such that at least 95% of the real files with 0.8 or more are right, where each is scored by a model that saw nothing
of its repository.
``python -m research.quality_fit --corpus FOLDER`` fits them again and prints this table.
``tests/benchmarks/test_bench_quality.py`` measures how good it is on houses that were left out.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from houseexpo.floorplan import FloorPlan
from houseexpo.plan import explanations
from houseexpo.plan.parts import Quality
from pipeline.rejection import Reason, Rejection

_DIGITS: Final = 4
_TELLING: Final = 0.1  # what moves the exponent by less is not worth a person's time
_PICTURE_PX: Final = 240


@dataclass(frozen=True)
class QualityGround:
    """One ground: its name in a plan's file, and its weight (0 or less)."""

    name: str
    weight: float


BIAS: Final = 1.73
GROUNDS: Final = (
    QualityGround("cut_share", -2.17),
    QualityGround("cut_off_share", 0.00),
    QualityGround("patch_share", 0.00),
    QualityGround("given_edge", -1.57),
    QualityGround("guesses", -1.22),
    QualityGround("floorless_room", -1.17),
    QualityGround("roomless_floor_share", 0.00),
    QualityGround("roomless_wall_share", -2.39),
    QualityGround("idle_lintel_share", -1.05),
    QualityGround("twin_door_share", -0.40),
    QualityGround("odd_doors", 0.00),
    QualityGround("odd_room_share", -1.29),
    QualityGround("loose_end_share", -1.22),
    QualityGround("left_out", -1.02),
    QualityGround("unlike_spaces", -0.19),
    QualityGround("sealed", -0.46),
    QualityGround("tall", -2.24),
    QualityGround("rail_share", -1.49),
    QualityGround("small", -1.75),
)


MARKED_BIAS: Final = 2.98
MARKED: Final = {
    "cut_share": -4.81,
    "cut_off_share": -1.92,
    "patch_share": -1.52,
    "given_edge": -1.56,
    "guesses": -2.12,
    "floorless_room": -0.69,
    "roomless_floor_share": -1.31,
    "roomless_wall_share": -5.26,
    "idle_lintel_share": -2.49,
    "twin_door_share": -3.70,
    "odd_room_share": -1.57,
    "loose_end_share": -3.27,
    "left_out": -1.32,
    "unlike_spaces": -2.23,
    "sealed": -2.28,
}
"""The model of houses whose source marks each door (``Level.sills``), fitted before real files weighed most."""


def score_quality(grounds: Mapping[str, float], *, marked: bool = False) -> Quality:
    """Return the quality of a plan with these grounds, each 0 to 1; unknown grounds have no weight.

    ``marked``: the source marks each door (SUNCG, homes that the project makes), so little of such a plan is a guess.
    """
    kept = {name: round(float(value), _DIGITS) for name, value in grounds.items()}
    return Quality(_score(grounds, *_MODELS[marked]), kept)


_MODELS: Final = ((BIAS, {ground.name: ground.weight for ground in GROUNDS}), (MARKED_BIAS, MARKED))


def _score(grounds: Mapping[str, float], bias: float, weights: Mapping[str, float]) -> float:
    exponent = bias + sum(weight * grounds.get(name, 0.0) for name, weight in weights.items())
    return round(1 / (1 + math.exp(-exponent)), _DIGITS)


def main_grounds_in_words(quality: Quality, most: int = 3) -> list[str]:
    """Return the grounds that speak most against a plan, in words, the weightiest first.

    Their weights are those of the model that gives the plan's score, or the nearest to it.
    """
    _, weights = min(_MODELS, key=lambda model: abs(_score(quality.grounds, *model) - quality.score))
    against = [(weight * quality.grounds.get(name, 0.0), name) for name, weight in weights.items()]
    heaviest = sorted((pair for pair in against if pair[0] <= -_TELLING), key=lambda pair: pair[0])[:most]
    return [f"{explanations.GROUNDS[name]}: {quality.grounds[name]:.2f}" for _, name in heaviest]


def check_quality(plan: FloorPlan, least: float) -> None:
    """Refuse a plan whose quality is below the limit; a plan without a quality passes.

    Raises
    ------
    Rejection
        DOUBTFUL, with the score and the main grounds.
    """
    quality = plan.quality
    if quality is None or quality.score >= least:
        return
    grounds = "; ".join(main_grounds_in_words(quality)) or "no single ground"
    detail = f"expected a quality of {least:g} or more, found {quality.score:.2f} ({grounds})"
    advice = "look at it with houseexpo inspect; overrides.toml can say where doors are, or keep it"
    from houseexpo.drawing import draw_plan
    from pipeline.png import encode_png

    raise Rejection("quality", Reason.DOUBTFUL, detail, advice, encode_png(draw_plan(plan, size=_PICTURE_PX)))
