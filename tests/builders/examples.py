"""The example houses that come with houseexpo (``houseexpo demo``): made homes, each in a format of docs/sources.md."""

from __future__ import annotations

import shutil
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import numpy as np

from tests.builders.formats import clouds
from tests.builders.kinds.registry import make_member

FOLDER: Final = Path(__file__).resolve().parents[2] / "pipeline" / "examples"
MEMBERS: Final = {
    "house.glb": ("artist_named", 1),
    "house.ifc": ("ifc", 8),
    "houses/procthor.json": ("raw_procthor", 0),
    "houses/front3d.json": ("raw_front3d", 3),
    "houses/gazebo.world": ("raw_sdf", 3),
    "houses/home.sh3d": ("raw_sh3d", 4),
    "houses/roomplan.json": ("raw_roomplan", 2),
}
"""By file: the kind, and the number of the home."""


def write_examples(folder: Path) -> list[Path]:
    """Write all examples but ``bungalow.obj`` (``tests.builders.bungalow``); the same bytes each time."""
    (folder / "houses").mkdir(parents=True, exist_ok=True)
    for name, (kind, number) in MEMBERS.items():
        with TemporaryDirectory() as made:
            make_member(kind, number, 0, Path(made))
            (file,) = (each for each in Path(made).rglob("*") if each.suffix == Path(name).suffix)
            shutil.copyfile(file, folder / name)
    cloud = clouds.sampled(clouds.flat(), np.random.default_rng(0), density=700.0)
    return [*(folder / name for name in MEMBERS), clouds.write_ply(folder / "houses" / "cloud.ply", cloud)]


if __name__ == "__main__":
    write_examples(FOLDER)
