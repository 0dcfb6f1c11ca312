"""The example files of docs/sources.md: one tiny home in each format, as ``tests/data/sources`` holds them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from tests.builders import clouds, front3d, gazebo, procthor, roomplan, sweethome

FOLDER = Path(__file__).resolve().parents[1] / "data" / "sources"


def write_examples(folder: Path) -> list[Path]:
    """Write all examples; the same bytes each time."""
    world = gazebo.world(gazebo.house(), gazebo.cube("cart", "1 1 0.3 0 0 0", static=False))
    cloud = clouds.sampled(clouds.flat(), np.random.default_rng(0), density=700.0)
    texts = {
        "procthor.json": json.dumps(procthor.house(), indent=1),
        "front3d.json": json.dumps(front3d.scene(), indent=1),
        "roomplan.json": json.dumps(roomplan.home(), indent=1),
        "gazebo.world": world,
    }
    for name, text in texts.items():
        (folder / name).write_text(text + "\n")
    return [
        *(folder / name for name in texts),
        sweethome.write(folder / "home.sh3d", sweethome.home(sweethome.BED)),
        clouds.write_ply(folder / "cloud.ply", cloud),
    ]


if __name__ == "__main__":
    write_examples(FOLDER)
