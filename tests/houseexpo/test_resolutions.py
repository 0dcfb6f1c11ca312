"""A resolution that shows nothing of a plan, or that no memory holds, is refused wherever one can be given."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from houseexpo import draw_plan, save_plan
from houseexpo.commands.app import make_app
from houseexpo.dataset.plan_rasters import RasterConfig, rasterise_plan
from houseexpo.drawing import svg
from houseexpo.errors import ConfigError, HouseExpoError, PlanError
from houseexpo.exports import export
from houseexpo.floorplan import FloorPlan
from houseexpo.pseudoslam.worlds.maps import map_house
from houseexpo.pseudoslam.worlds.world import make_world

SMALL = FloorPlan("hut", [(0, 0), (0, 3), (4, 3), (4, 0)], 1, {})
WITH_RESOLUTION = ("ros", "npz", "png", "coco")


def run(*words: object) -> tuple[int, str]:
    done = CliRunner().invoke(make_app(), [str(word) for word in words])
    return done.exit_code, " ".join(done.output.split())


@pytest.mark.parametrize("form", WITH_RESOLUTION)
@pytest.mark.parametrize(
    ("metres", "said"),
    [
        ("1e9", "expected a resolution of at most 1 m a pixel for 4.00 x 3.00 m, found 1e+09"),
        ("1e308", "expected a resolution of at most 1 m a pixel"),
        ("1.2", "expected a resolution of at most 1 m a pixel"),
        ("inf", "expected a resolution of more than 0 m a pixel, found inf"),
        ("1e-9", "expected at most 536,870,912 cells, found"),
        ("1e-300", "expected at most 536,870,912 cells, found"),
        ("1e-320", "expected a resolution of more than 0 m a pixel"),
    ],
)
def test_exports_refuse_it_and_write_nothing(tmp_path: Path, form: str, metres: str, said: str) -> None:
    save_plan(SMALL, tmp_path / "hut.json")
    code, output = run("export", tmp_path / "hut.json", "--to", form, "--resolution", metres, "--out", tmp_path / "out")
    assert code == 2
    assert said in output
    assert len(output) < 400
    assert not (tmp_path / "out").exists()


def test_grids_of_npz_that_take_many_gigabytes_are_refused(tmp_path: Path) -> None:
    large = FloorPlan("hall", [(0, 0), (0, 90), (90, 90), (90, 0)], 1, {})
    with pytest.raises(PlanError, match="npz: expected at most"):
        export(large, "npz", tmp_path, resolution=0.005)


@pytest.mark.parametrize("scale", [1e-300, 1e-9, 0.9])
@pytest.mark.parametrize(
    "use",
    [
        SMALL.grid,
        SMALL.room_grid,
        SMALL.door_grid,
        SMALL.distance_field,
        SMALL.grid_frame,
        lambda scale: draw_plan(SMALL, scale),
        lambda scale: svg(SMALL, scale),
        lambda scale: rasterise_plan(SMALL, RasterConfig(pixels_per_metre=scale)),
    ],
)
def test_functions_refuse_too_few_pixels_per_metre(use, scale: float) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(ConfigError, match=r"makes plan 'hut' \(4.00 x 3.00 m\) smaller than 4 cells"):
        use(scale)


@pytest.mark.parametrize("scale", [1e9, 1e150, 1e308])
@pytest.mark.parametrize("use", [SMALL.grid, lambda scale: draw_plan(SMALL, scale), lambda scale: svg(SMALL, scale)])
def test_functions_refuse_too_many(use, scale: float) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(ConfigError, match="grid: expected at most 536,870,912 cells, found") as error:
        use(scale)
    assert len(str(error.value)) < 250


@pytest.mark.parametrize("scale", [1e-9, 0.3, 200.0])
def test_worlds_refuse_a_grid_without_a_place_for_the_robot_or_with_too_many_cells(scale: float) -> None:
    plan = SMALL if scale < 1 else FloorPlan("hall", [(0, 0), (0, 90), (90, 90), (90, 0)], 1, {})
    with pytest.raises(HouseExpoError, match=r"px/m|pixels_per_metre"):
        make_world(plan, scale, 0.2, 5.0)


@pytest.mark.parametrize("side_m", [1e9, 11.0, 1e-9])
def test_maps_refuse_cells_of_no_sensible_size(tmp_path: Path, side_m: float) -> None:
    with pytest.raises(ConfigError, match=r"resolution: expected 0.0001 to 10 m a cell"):
        map_house(np.zeros((40, 60), bool), side_m)
    picture = tmp_path / "map.npy"
    np.save(picture, np.zeros((40, 60), np.int8))
    for words in (
        ["record", picture, "--resolution", side_m, "--out", tmp_path / "film.gif"],
        ["build", picture, "--resolution", side_m, "--out", tmp_path / "plans"],
    ):
        code, output = run(*words)
        assert code != 0
        assert "expected 0.0001 to 10 m a cell" in output or "bad_units" in output
    assert not (tmp_path / "film.gif").exists()


def test_prepare_refuses_it(tmp_path: Path) -> None:
    save_plan(SMALL, tmp_path / "hut.json")
    for scale in ("1e-9", "1e9", "inf", "nan"):
        assert run("prepare", tmp_path, "--resolution", scale)[0] == 2
