"""Triangles in space."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles: ``vertices`` (n, 3) float64 metres, ``faces`` (m, 3) int64. No promise that it is welded or closed.

    A point cloud has vertices and no faces.
    """

    vertices: npt.NDArray[np.float64]
    faces: npt.NDArray[np.int64]

    @property
    def is_cloud(self) -> bool:
        """Whether it has points only."""
        return len(self.vertices) > 0 and not len(self.faces)
