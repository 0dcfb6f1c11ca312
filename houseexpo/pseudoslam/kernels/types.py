"""Names of the arrays that kernels take."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

Grid: TypeAlias = npt.NDArray[np.uint8]
"""(rows, cols), C order."""
Cells: TypeAlias = npt.NDArray[np.int32]
"""Flat indices, row * cols + col."""
Floats: TypeAlias = npt.NDArray[np.float64]
