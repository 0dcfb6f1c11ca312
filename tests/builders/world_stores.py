"""Stores of worlds: three huts at a coarse grid, the files that hold them, and when two worlds are the same."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from houseexpo.plan.json_codec import encode
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.worlds.store import store_folder
from houseexpo.pseudoslam.worlds.world import World
from tests.builders.vectors import HUTS

COARSE = SimulatorConfig(pixels_per_metre=10.0)


def assert_same_world(one: World, other: World) -> None:
    assert (one.plan_id, one.frame, one.observable_cells) == (other.plan_id, other.frame, other.observable_cells)
    for name in ("occupied", "traversable", "observable"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
        assert getattr(one, name).dtype == np.uint8
        assert not getattr(one, name).flags.writeable


def write_huts(folder: Path) -> Path:
    """Write a data set of the three huts into a folder."""
    file = folder / "huts.jsonl"
    file.write_bytes(b"\n".join(map(encode, HUTS)))
    return file


def files() -> list[Path]:
    return sorted(store_folder(COARSE).glob("*.worlds"))
