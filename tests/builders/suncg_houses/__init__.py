"""Write test houses that the project makes, some with planted faults, in SUNCG's layout on disk, with their true plans.

``write_house`` makes one house from its index and a seed, whatever others are made; ``write_houses`` makes many.
"""

from __future__ import annotations

from pathlib import Path

import msgspec

from tests.builders.suncg_houses.house import make_house, scene_id, storey_plan_id
from tests.builders.suncg_houses.scene import write_scene
from tests.builders.suncg_houses.truth import Truth, storey_truth

__all__ = ["Truth", "scene_id", "write_house", "write_houses"]


def write_house(folder: Path, index: int, seed: int) -> tuple[Truth, ...]:
    """Write house ``index`` of a seed, and truth/<id>.json for each of its levels.

    Parameters
    ----------
    folder : Path
        A SUNCG root, new or with other houses in it.
    index, seed : int
        Both non-negative; the same two give the same bytes.

    Returns
    -------
    tuple of Truth
        One for each level, from the ground up.
    """
    house = make_house(index, seed)
    write_scene(folder, house)
    truths = tuple(
        storey_truth(storey, storey_plan_id(house.id, level), level * house.storey_height)
        for level, storey in enumerate(house.storeys)
    )
    (folder / "truth").mkdir(parents=True, exist_ok=True)
    for truth in truths:
        (folder / "truth" / f"{truth.id}.json").write_bytes(msgspec.json.encode(truth))
    return truths


def write_houses(folder: Path, count: int, seed: int) -> None:
    """Write houses 0 to ``count`` - 1 of a seed."""
    for index in range(count):
        write_house(folder, index, seed)
