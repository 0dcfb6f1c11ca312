"""Old names of public attributes work, and warn."""

from __future__ import annotations

import numpy as np
import pytest

from houseexpo.floorplan import FloorPlan
from houseexpo.pseudoslam import SimulatorConfig, State, world_for
from houseexpo.pseudoslam.renamed import renamed


@pytest.mark.parametrize(("old", "new"), [("solid", "occupied"), ("stand", "traversable"), ("countable", "observable")])
def test_a_world_has_its_old_names(old: str, new: str) -> None:
    plan = FloorPlan("square", np.array([(0, 0), (0, 4), (4, 4), (4, 0)]), 1, {})
    world = world_for(plan, SimulatorConfig(pixels_per_metre=5))
    with pytest.warns(DeprecationWarning, match=f"World.{old} is called {new}"):
        assert getattr(world, old) is getattr(world, new)


def test_a_state_has_its_old_names() -> None:
    assert all(isinstance(getattr(State, name), type(renamed("a", "b"))) for name in ("solid", "best_way_m"))
