"""Score a predicted map against the true house by IoU, over judged cells and unseen ones; make simple predictions.

The definition is that of MapEx (Ho, Kim et al., 2025; castacks/MapEx, ``scripts/calc_metrics_subdirectory.py``):

R1  The IoU counts obstacles: the cells that are obstacles in both maps, as a share of the cells that are obstacles in
    at least one map. It covers all cells, seen or not. It is 0 if neither map has an obstacle.
R2  A cell that a prediction leaves unknown counts as free.

MapEx judges drawings, in which walls are lines and the outside is free. In a plan the outside is solid:

R3  Only cells that a robot's map can hold are judged: free cells and the obstacles beside them (8 neighbours). So the
    inside of walls and the outside of a plan do not count. MapEx's floors lose only the inside of pillars and thick
    walls.
R4  Over the unseen part, that is, the judged cells that are unknown in the robot's map, the IoU of free cells is
    computed too. It is None if all cells are known.

PIPE forgives small shifts (Baek, Moon, Kim et al., 2025; castacks/pipe-planner, the same file):

R5  In the tolerant IoU, a true obstacle is a hit if a predicted obstacle lies within the square of 5 x 5 cells around
    it. A predicted obstacle is false if no true obstacle lies within its square. The IoU is hits / (true obstacles +
    false obstacles), over judged cells and the squares around them: 99.4 to 100% of the walls of MapEx's floors.

No map is aligned: with errors of odometry the drift counts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final

import cv2
import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.inference.map_prediction import check_cells, predict_map
from houseexpo.pseudoslam.benchmark.measures import Metric, Values
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE, UNKNOWN
from houseexpo.words import suggest_name

Grid = npt.NDArray[np.uint8]
Bools = npt.NDArray[np.bool_]
Predictor = Callable[[Grid], Grid]
"""A function from a map (rows, cols) to a predicted map of that shape; both hold 0 unknown, 127 free, 255 obstacle."""

OF_POLICY: Final = "policy"
"""The name of the policy's own prediction, made by its method ``predicted_map(info)``."""
LONGEST_GAP_M: Final = 1.5
"""The longest gap in a wall that the predictor ``lines`` closes."""
TABLE: Final = "prediction"
_NEIGHBOURS: Final = np.ones((3, 3), np.uint8)
_TOLERANCE: Final = np.ones((5, 5), np.uint8)
_PARTS: Final = {
    "iou": "IoU",
    "iou_tolerant": "tolerant IoU",
    "iou_unseen_walls": "unseen walls, IoU",
    "iou_unseen_free": "unseen free, IoU",
}


@dataclass(frozen=True)
class PredictionScores:
    """The IoU of obstacles over judged cells (R1, R5), and of obstacles and of free cells over unseen cells (R4)."""

    iou: float
    iou_tolerant: float
    iou_unseen_walls: float | None
    iou_unseen_free: float | None


def find_judged_cells(occupied: Grid) -> Bools:
    """Return which cells (rows, cols) are judged (R3): free cells and the obstacles beside them."""
    found: Bools = cv2.dilate((occupied == 0).astype(np.uint8), _NEIGHBOURS) != 0
    return found


def score_prediction(predicted: Grid, known: Grid, occupied: Grid, judged: Bools | None = None) -> PredictionScores:
    """Return the scores of a predicted map.

    Parameters
    ----------
    predicted, known
        The predicted and the robot's map (rows, cols): 0 unknown, 127 free, 255 obstacle.
    occupied
        The truth (rows, cols): not 0 for obstacles.
    judged
        ``find_judged_cells(occupied)``, if known.
    """
    judged = find_judged_cells(occupied) if judged is None else judged
    walls, truth = predicted == OBSTACLE, occupied != 0  # R2
    unseen = judged & (known == UNKNOWN)
    return PredictionScores(
        _iou(walls, truth, judged) or 0.0,
        _tolerant_iou(walls, truth, judged),
        _iou(walls, truth, unseen),
        _iou(~walls, ~truth, unseen),
    )


def _iou(one: Bools, other: Bools, part: Bools) -> float | None:
    """Return the IoU over a part of the cells; 0 if that part holds neither, None if it is empty."""
    if not part.any():
        return None
    union = int(np.count_nonzero((one | other) & part))
    return int(np.count_nonzero(one & other & part)) / union if union else 0.0


def _tolerant_iou(predicted: Bools, truth: Bools, part: Bools) -> float:
    """Return the tolerant IoU (R5) over a part of the cells and those near it; 0 if they hold neither."""
    near_predicted, near_truth, near_part = (
        cv2.dilate(cells.astype(np.uint8), _TOLERANCE) != 0 for cells in (predicted, truth, part)
    )
    union = int(np.count_nonzero((truth | (predicted & ~near_truth)) & near_part))
    return int(np.count_nonzero(truth & near_predicted & near_part)) / union if union else 0.0


# ---------------------------------------------------------------------------------------------------------------------
# Predictors that come with the benchmark; all but the network cost nothing.
# ---------------------------------------------------------------------------------------------------------------------


def predict_free(known: Grid) -> Grid:
    """Return the map with all unknown cells free; by R2, making no prediction has the same scores."""
    return np.where(known == UNKNOWN, np.uint8(FREE), known)


def predict_solid(known: Grid) -> Grid:
    """Return the map with all unknown cells occupied."""
    return np.where(known == UNKNOWN, np.uint8(OBSTACLE), known)


def predict_walls_in_gaps(known: Grid, gap_px: float) -> Grid:
    """Return the map with walls in gaps of at most ``gap_px`` unknown cells between walls of a row or column.

    Other unknown cells are free.
    """
    walls = (known == OBSTACLE).astype(np.uint8)
    side = max(int(gap_px), 1) + 1
    padded = cv2.copyMakeBorder(walls, side, side, side, side, cv2.BORDER_CONSTANT, value=0)
    found = predict_free(known)
    for shape in ((1, side), (side, 1)):
        closed = cv2.morphologyEx(padded, cv2.MORPH_CLOSE, np.ones(shape, np.uint8))[side:-side, side:-side]
        found[(closed != 0) & (known == UNKNOWN)] = OBSTACLE
    return found


PREDICTORS: Final = ("free", "solid", "lines", "network", "network-tolerant")
"""The names of the predictors that come with the benchmark."""


def check_predictor_name(name: str) -> None:
    """Raise ConfigError if there is no prediction of that name."""
    known = (OF_POLICY, *PREDICTORS)
    if name not in known:
        raise ConfigError(
            f"--prediction: expected one of {', '.join(known)}; found {name!r}" + suggest_name(name, list(known))
        )


def find_predictor(name: str, pixels_per_metre: float) -> Predictor:
    """Return a predictor of ``PREDICTORS``."""
    if name == "lines":
        return lambda known: predict_walls_in_gaps(known, LONGEST_GAP_M * pixels_per_metre)
    if name in {"network", "network-tolerant"}:
        is_tolerant = name != "network"
        return lambda known: predict_map(known, 1.0 / pixels_per_metre).to_map(tolerant=is_tolerant)
    return {"free": predict_free, "solid": predict_solid}[name]


# ---------------------------------------------------------------------------------------------------------------------
# Scores on the way.
# ---------------------------------------------------------------------------------------------------------------------


@dataclass
class PredictionScorer:
    """The scores of predictions at given metres of an episode, each of the last map before them, as for coverage.

    Parameters
    ----------
    predict
        A function from the robot's knowledge to a predicted map.
    occupied
        The truth (rows, cols): not 0 for obstacles.
    budgets_m
        The metres, in ascending order.
    """

    predict: Callable[[Any], Grid]
    occupied: Grid
    budgets_m: tuple[int, ...]
    found: list[PredictionScores] = field(default_factory=list)
    _judged: Bools | None = None
    _before: Any = None

    def add(self, metres: float, knowledge: Any) -> None:
        """Score the previous map for all budgets that the robot has now exceeded."""
        while len(self.found) < len(self.budgets_m) and metres > self.budgets_m[len(self.found)]:
            self._score()
        self._before = {**knowledge, "map": knowledge["map"].copy()}

    def values(self) -> Values:
        """Return the values of all budgets; the last map counts for budgets that were not reached."""
        while len(self.found) < len(self.budgets_m):
            self._score()
        return {
            f"{part}_{budget}_metres": getattr(scores, part)
            for budget, scores in zip(self.budgets_m, self.found, strict=True)
            for part in _PARTS
        }

    def _score(self) -> None:
        if self._judged is None:
            self._judged = find_judged_cells(self.occupied)
        known = self._before["map"]
        predicted = check_predicted_map(self.predict({**self._before, "map": known.copy()}), known.shape)
        self.found.append(score_prediction(predicted, known, self.occupied, self._judged))


def check_predicted_map(found: object, shape: tuple[int, ...]) -> Grid:
    """Return a predicted map (rows, cols); raise ConfigError if it is no map of this shape."""
    if not isinstance(found, np.ndarray) or found.dtype != np.uint8 or found.shape != shape:
        was = f"{found.dtype} {found.shape}" if isinstance(found, np.ndarray) else repr(found)[:80]
        raise ConfigError(f"predicted_map: expected an array uint8 {shape}, found {was}")
    check_cells(found, "predicted_map")
    return found


def prediction_metrics(budgets_m: tuple[int, ...]) -> tuple[Metric, ...]:
    """Return the metrics of ``PredictionScorer``, for a table of their own."""
    return tuple(
        Metric(f"{part}_{budget}_metres", f"{title}, {budget} metres", "%", "high", TABLE)
        for part, title in _PARTS.items()
        for budget in budgets_m
    )
