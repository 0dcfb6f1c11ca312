"""The scripts of the gallery run, draw what the page shows, and are all on the page."""

from __future__ import annotations

import runpy
from pathlib import Path

import matplotlib as mpl
import pytest
from PIL import Image

from pipeline.algorithm import plan_level
from tests.builders.batch import run_build
from tests.builders.needs import need

DOCS = Path(__file__).resolve().parents[1] / "docs"
SCRIPTS = sorted((DOCS / "examples" / "gallery").glob("*.py"))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("gallery")
    run_build([Path("procedural:14")], found / "plans" / "demo", seed=3, plan=plan_level)
    return found


@pytest.mark.slow
@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
def test_a_script_draws_its_picture(script: Path, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    need(modules=["pandas", "geopandas"], how="make readers")
    mpl.use("agg")
    monkeypatch.chdir(folder)
    runpy.run_path(str(script))
    with Image.open(folder / f"{script.stem}.png") as picture:
        assert min(picture.size) > 150
        assert len(picture.convert("L").getcolors()) > 10
    from matplotlib import pyplot as plt

    plt.close("all")
