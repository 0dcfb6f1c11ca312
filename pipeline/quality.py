"""Score a plan's quality, 0 to 1, from its measured signs of faults (logistic), and reject plans below a limit.

A ground is 0 where nothing speaks against the plan and 1 where everything does, so no weight is above 0::

    log odds = BIAS + sum of weight * min(ground / WHOLE, 1)
    score = 1 / (1 + exp(-(sure + (log odds - sure) / SPREAD))), where sure is the log odds of 0.8

A ground of ``WHOLE`` or more counts in full: a plan is right only if all of it is, and one door of ten that is a cut
makes it as wrong as five do.

BIAS and weights were fitted on the kit of kinds, its houses sound and damaged, and, three times as strongly, on those
files of other people that a person has judged (the first half of the corpus, ``docs/contributing/corpus.md``).
The fit sets the bias such that at least 98% of the real files with 0.8 or more are right, where each is scored by a
model that saw nothing of its repository; and lower by 0.3, since other files are right less often than these. So a plan
with log odds of 0 is right far more often than not. SPREAD undoes this: one that is as likely right as not has 0.5.
``python -m research.weights_fit --corpus FOLDER`` fits them again and prints this table.
``tests/benchmarks/test_bench_quality.py`` measures how good it is on houses that were left out.

A robot's map has grounds that nothing else has (``Level.signs``), and a model of its own: ``map`` in
``stages/weights.toml``, fitted on people's maps by ``python -m research.map_quality_fit``. Its score is the probability
itself, neither lowered nor spread.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Final

from houseexpo.floorplan import FloorPlan
from houseexpo.plan import explanations
from houseexpo.plan.parts import SURE, Quality
from pipeline.rejection import Reason, Rejection
from pipeline.stages.logistic import load_models

_SCORE_DIGITS: Final = 4
_TELLING: Final = 0.1  # what moves the exponent by less is not worth a person's time
_PICTURE_PX: Final = 240
_SURE: Final = math.log(SURE / (1 - SURE))


@dataclass(frozen=True)
class QualityGround:
    """One ground: its name in a plan's file, its weight (0 or less), and the ``most`` that a fit may make of it.

    A guess of the reader alone makes a plan doubtful, and so does an edge that was guessed, a closed box in which
    nothing shows a use, and a map or a house that lies open: the corpus has too few of them to learn it from.
    """

    name: str
    weight: float
    most: float = 0.0


BIAS: Final = 2.84
GROUNDS: Final = (
    QualityGround("cut_share", -0.16),
    QualityGround("cut_off_share", -2.01),
    QualityGround("patch_share", -0.86),
    QualityGround("given_edge", -1.65, most=-1.65),
    QualityGround("guesses", -1.65, most=-1.65),
    QualityGround("floorless_room", 0.00),
    QualityGround("roomless_floor_share", -0.39),
    QualityGround("roomless_wall_share", -2.02),
    QualityGround("idle_lintel_share", -0.63),
    QualityGround("twin_door_share", -0.32),
    QualityGround("odd_doors", -0.44),
    QualityGround("odd_room_share", -0.81),
    QualityGround("loose_end_share", -1.52),
    QualityGround("left_out", -0.93),
    QualityGround("unlike_spaces", 0.00),
    QualityGround("sealed", -0.11),
    QualityGround("doubtful_space", -1.37),
    QualityGround("tall", -1.08),
    QualityGround("rail_share", 0.00),
    QualityGround("small", -1.14),
    QualityGround("open_border", -4.50, most=-4.50),
    QualityGround("bare", -4.50, most=-4.50),
)
SPREAD: Final = 1.95
"""How many times nearer to 0.8 a score lies, in log odds. 0.8 itself and the order of plans stay as they are."""
WHOLE: Final = 0.1
"""From so much on a ground counts in full: of 0.01 to 0.3 the best for files that were left out of the fit."""

MAP_WHOLE: Final = {
    "half_seen_rooms": 0.5,
    "beyond_rooms": 0.05,
    "ragged_room": 0.5,
    "free_wall": 1.0,
    "cut_share": WHOLE,
    "twin_door_share": WHOLE,
    "loose_end_share": WHOLE,
    "open_border": WHOLE,
}
"""The grounds that the model of maps weighs, and from how much on each counts in full."""
MAP_MOST: Final = {"open_border": -4.5}
"""The most that a fit may make of a weight of maps: one that lies open on all sides is doubtful."""

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
"""The model of houses whose source marks each door (``Level.sills``), fitted before real files weighed most.
Its grounds count in proportion, up to 1."""


def score_quality(grounds: Mapping[str, float], *, marked: bool = False) -> Quality:
    """Return the quality of a plan with these grounds, each 0 to 1; unknown grounds have no weight.

    ``marked``: the source marks each door (SUNCG, homes that the project makes), so little of such a plan is a guess.
    """
    kept = {name: round(float(value), _SCORE_DIGITS) for name, value in grounds.items()}
    return Quality(_model_of(grounds, marked=marked).score(grounds), kept)


def doubt_plan(grounds: Mapping[str, float], *, marked: bool = False) -> float:
    """Return how doubtful grounds make a plan, 0 (none of them) to 1, for those who rate its parts.

    It is how far the cautious probability lies below that of no grounds, as a share of it.
    """
    model = _model_of(grounds, marked=marked)
    cautious, best = (1 / (1 + math.exp(-log_odds)) for log_odds in (model.log_odds(grounds), model.bias))
    return 1.0 - cautious / best


def counted(ground: float) -> float:
    """Return how much of a ground counts, 0 to 1, for houses whose source does not mark each door."""
    return min(ground / WHOLE, 1.0)


def is_of_map(grounds: Mapping[str, float]) -> bool:
    """Whether grounds are those of a plan of a robot's map."""
    return "half_seen_rooms" in grounds


def counted_of_map(name: str, ground: float) -> float:
    """Return how much of a ground counts, 0 to 1, in the model of maps."""
    return min(ground / MAP_WHOLE.get(name, WHOLE), 1.0)


@dataclass(frozen=True)
class _Model:
    bias: float
    weights: Mapping[str, float]
    count: Callable[[str, float], float]
    spread: float = 1.0

    def against(self, grounds: Mapping[str, float]) -> dict[str, float]:
        """Return what each ground takes from the exponent (0 or less)."""
        return {name: weight * self.count(name, grounds.get(name, 0.0)) for name, weight in self.weights.items()}

    def log_odds(self, grounds: Mapping[str, float]) -> float:
        return self.bias + sum(self.against(grounds).values())

    def score(self, grounds: Mapping[str, float]) -> float:
        exponent = _SURE + (self.log_odds(grounds) - _SURE) / self.spread
        return round(1 / (1 + math.exp(-exponent)), _SCORE_DIGITS)


_WEIGHTS: Final = {ground.name: ground.weight for ground in GROUNDS}
_HOUSES: Final = _Model(BIAS, _WEIGHTS, lambda _, ground: counted(ground), SPREAD)
_MARKED: Final = _Model(MARKED_BIAS, MARKED, lambda _, ground: ground)


@cache
def _of_maps() -> _Model:
    found = load_models()["map"]
    return _Model(found.bias, found.weights, counted_of_map)


def _model_of(grounds: Mapping[str, float], *, marked: bool = False) -> _Model:
    if is_of_map(grounds):
        return _of_maps()
    return _MARKED if marked else _HOUSES


def main_grounds_in_words(quality: Quality) -> list[str]:
    """Return the grounds that speak most against a plan, three at most, in words, the weightiest first.

    Their weights are those of the model of maps for a map, else of that which gives the plan's score, or the nearest.
    """
    models = [_of_maps()] if is_of_map(quality.grounds) else [_HOUSES, _MARKED]
    model = min(models, key=lambda model: abs(model.score(quality.grounds) - quality.score))
    against = [(value, name) for name, value in model.against(quality.grounds).items()]
    heaviest = sorted((pair for pair in against if pair[0] <= -_TELLING), key=lambda pair: pair[0])[:3]
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
