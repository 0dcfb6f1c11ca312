"""What changes in a step."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt


@dataclass(eq=False)
class State:
    """An episode so far; ``Simulator.step`` changes it in place, ``copy`` keeps one.

    Parameters
    ----------
    pose_px
        (3,) float64: x across, y down in cells of the world's grid, heading in radians, counter-clockwise from x.
    known
        (rows, cols) uint8 map: 0 unknown, 127 free, 255 obstacle.
    view
        (side, side) uint8: the map round the robot, heading up.
    counts
        (4,) int64: steps, collisions, known cells, covered cells (``kernels.step``).
    blocked
        Whether something was in the way of the last step.
    """

    pose_px: npt.NDArray[np.float64]
    known: npt.NDArray[np.uint8]
    view: npt.NDArray[np.uint8]
    counts: npt.NDArray[np.int64] = field(default_factory=lambda: np.zeros(4, np.int64))
    blocked: bool = False

    def copy(self) -> State:
        """Return a state that shares nothing with this one."""
        return State(self.pose_px.copy(), self.known.copy(), self.view.copy(), self.counts.copy(), self.blocked)
