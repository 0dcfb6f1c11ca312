"""Tell the outside of a house of unknown size from rooms, where no unit makes a house of a mesh.

R1  It is looked at with storeys of the usual height. Where it has no inside then, that is why it gives no plan: a unit
    or a scale would not help.
R2  One that is longer than houses are then has other proportions than a house: its unit, or its axis, is the fault.
"""

from __future__ import annotations

import numpy as np

from pipeline.rejection import Reason, Rejection
from pipeline.sources.interior import check_interior
from pipeline.sources.levels import find_levels
from pipeline.sources.scale import USUAL_STOREY_M
from pipeline.sources.shape import WIDTH_M, measured
from pipeline.sources.surfaces import Surfaces
from pipeline.values import Mesh


def outside_of(upright: Mesh, name: str) -> Rejection | None:
    """Return the rejection NO_INTERIOR of a z-up mesh in an unknown unit, or None if it may have rooms (R1)."""
    shape = measured(Surfaces.of(upright), 2)
    if shape is None or shape.storey <= 0:
        return None
    usual = Mesh(upright.vertices * (USUAL_STOREY_M / shape.storey), upright.faces)
    if np.ptp(usual.vertices[:, :2], axis=0).max() > WIDTH_M[1]:  # R2
        return None
    try:
        levels = find_levels(usual)
        check_interior(((level.walls, level.floor and float(level.floor.area)) for level in levels), name)
    except Rejection as rejection:
        if rejection.reason is not Reason.NO_INTERIOR:
            return None
        detail = f"{rejection.detail} (with storeys of {USUAL_STOREY_M} m; no known unit makes a house of it)"
        return Rejection("source", Reason.NO_INTERIOR, detail, rejection.advice)
    return None
