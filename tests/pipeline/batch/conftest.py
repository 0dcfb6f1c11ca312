"""Houses that builds in parts are tried on, and what one build makes of them."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.builders.batch import contents, one_room, run_build


@pytest.fixture(scope="module")
def street(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Seven houses in several formats: one with a second file, one in a folder, one refused, one a copy."""
    folder = tmp_path_factory.mktemp("houses") / "street"
    for number, name in enumerate("abc"):
        one_room(folder / f"{name}.ply", 5.0 + number)
    one_room(folder / "far" / "e.obj", 9.0)
    one_room(folder / "split" / "f.gltf", 11.0)  # its vertices lie in another file
    one_room(folder / "g_refuse.glb", 7.0)
    one_room(folder / "z.ply", 4.0, 5.0)
    return folder


@pytest.fixture(scope="module")
def serial(street: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """The data set of one build."""
    out = tmp_path_factory.mktemp("serial") / "plans"
    run_build([street], out)
    return contents(out)
