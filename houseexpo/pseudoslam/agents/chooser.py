"""A learned chooser of frontiers, which goes to the frontier with the highest score.

``kernels.planning.outlook`` computes the features of a frontier; everything else is like the other explorers. The
weights that come with the project were trained by ``houseexpo train chooser`` with three seeds; ``chooser`` is the
first of them.
"""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np

from houseexpo.pseudoslam.agents.exploring import Explorer, Grid
from houseexpo.pseudoslam.agents.protocol import Interface, Knowledge, Policy, Robot, Training
from houseexpo.pseudoslam.kernels.planning.outlook import LOOKED_AT, OUTLOOKS, describe
from houseexpo.pseudoslam.kernels.planning.scoring import best_of
from houseexpo.pseudoslam.kernels.types import Floats, Rows
from houseexpo.pseudoslam.learning.weights import read_weights
from houseexpo.pseudoslam.plan_rules import outlook_rules

FAMILY: Final = "chooser"


class Chooser(Explorer):
    """An explorer that goes to the frontier with the highest score."""

    def __init__(self, robot: Robot, seed: int, weights: Floats) -> None:
        super().__init__(robot, seed)
        self._weights = weights
        self._outlook = outlook_rules(robot.config)
        self._outlooks, self._scores = np.zeros((LOOKED_AT, len(OUTLOOKS))), np.zeros(LOOKED_AT)

    def choose(self, known: Grid, frontiers: Rows, info: Knowledge) -> int:
        """Return the best of the frontiers that ``find_frontiers`` ranks first."""
        x, y, heading = info["pose_px"].tolist()
        n = describe(
            known, x, y, heading, info["steps"], frontiers, len(frontiers), self._outlook,
            self.scratch.ways, self._outlooks,
        )  # fmt: skip
        return int(best_of(self._outlooks, n, self._weights, self._scores))


class TrainedChooser:
    """A factory of choosers with the weights of a file."""

    interface = Interface(tasks=("exploration",))

    def __init__(self, file: Path) -> None:
        self.file = file

    def __call__(self, robot: Robot, seed: int) -> Policy:
        """Return the explorer for an episode."""
        return Chooser(robot, seed, self._read[0])

    @property
    def training(self) -> Training:
        """The family of the weights, and the seed of their training."""
        return Training(FAMILY, int(self._read[1].get("seed", 0)))

    @cached_property
    def _read(self) -> tuple[Floats, dict[str, Any]]:
        return read_weights(self.file)


def weights_file(seed: int) -> Path:
    """Return the path of the project's weights that were trained with a seed."""
    return Path(__file__).with_name(f"{FAMILY}-{seed}.json")


seed_0, seed_1, seed_2 = (TrainedChooser(weights_file(seed)) for seed in range(3))
