"""A data set in a notebook or a script: build, tables, plots, pictures."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
import shapely

import houseexpo
from houseexpo import ConfigError, Dataset, FloorPlan, open_dataset
from houseexpo.words import count_noun
from pipeline.algorithm import plan_level
from tests.builders.batch import run_build
from tests.builders.needs import need


@pytest.fixture(scope="module")
def plans(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    folder = tmp_path_factory.mktemp("hour") / "homes"
    run_build([Path("procedural:4")], folder, seed=3, plan=plan_level)
    return open_dataset(folder)


@pytest.mark.slow
def test_a_script_without_a_main_guard_builds(tmp_path: Path) -> None:
    (tmp_path / "script.py").write_text(
        "import houseexpo\n"
        "print('once')\n"
        "plans = houseexpo.build('procedural:2', 'homes', workers=2, seed=3)\n"
        "print(len(plans), len(plans.rejected))\n"
    )
    done = subprocess.run(
        [sys.executable, "script.py"], cwd=tmp_path, capture_output=True, text=True, check=False, timeout=120
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == ["once", "2 0"]


def test_build_names_what_it_was_not_given(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"no_such\.glb"):
        houseexpo.build(tmp_path / "no_such.glb", tmp_path / "out")
    with pytest.raises(ConfigError, match="'refuse', 'add' or 'replace'"):
        houseexpo.build("procedural:1", tmp_path / "out", others="overwrite")  # type: ignore[arg-type]
    assert not (tmp_path / "out").exists()


def test_a_plan_comes_back_from_the_file_that_it_was_saved_to(plans: Dataset, tmp_path: Path) -> None:
    plans[0].save(tmp_path / "plan.json")
    assert houseexpo.load_plan(tmp_path / "plan.json") == plans[0]


def test_polygons_are_what_shapely_users_expect(plans: Dataset) -> None:
    room, door = plans[0].rooms[0], plans[0].doors[0]
    assert isinstance(room.polygon, shapely.Polygon)
    assert room.polygon.area == pytest.approx(room.area, abs=0.01)
    assert isinstance(door.polygon, shapely.Polygon)


def test_index_is_that_of_every_sequence(plans: Dataset) -> None:
    assert [plans.index(plan) for plan in plans] == list(range(len(plans)))
    assert plans.index(plans.ids[2]) == 2
    with pytest.raises(ValueError, match=r"from 0 to 2"):
        plans.index(plans.ids[2], 0, 2)
    with pytest.raises(ValueError, match="none"):
        plans.index("none")


def test_tables_have_a_row_for_each_plan_room_and_door(plans: Dataset) -> None:
    need(modules=["pandas", "geopandas"], how="make readers")
    table = plans.to_pandas()
    assert list(table.index) == list(plans.ids)
    assert list(table["room_num"]) == [plan.room_num for plan in plans]
    rooms = plans.to_geopandas("rooms")
    assert len(rooms) == sum(len(plan.rooms) for plan in plans)
    assert (rooms.area - rooms["area"]).abs().max() < 0.01
    doors = plans[0].to_geopandas("doors")
    assert list(doors["width"]) == [door.width for door in plans[0].doors]
    spaces = plans.to_geopandas("plans").set_index("id")
    assert spaces.area[plans.ids[1]] == pytest.approx(plans[1].area, abs=0.01)
    assert list(plans[:0].to_geopandas("objects").columns) == [
        "plan_id",
        "object",
        "label",
        "room",
        "height",
        "geometry",
    ]


def test_layers_have_names(plans: Dataset) -> None:
    with pytest.raises(ConfigError, match="plans, rooms, doors, objects, found 'walls'"):
        plans.to_geopandas("walls")  # type: ignore[arg-type]


def test_a_plan_is_drawn_on_the_axis_that_is_given(plans: Dataset) -> None:
    import matplotlib as mpl

    mpl.use("agg")
    from matplotlib import pyplot as plt

    _, ax = plt.subplots()
    plan = plans[0]
    assert plan.plot(ax, title="a plan") is ax
    assert ax.get_title() == "a plan"
    assert ax.get_aspect() == 1
    assert {text.get_text() for text in ax.texts} == {room.label.replace("_", " ") for room in plan.rooms}
    (x1, x2), (y1, y2) = ax.get_xlim(), ax.get_ylim()
    assert shapely.box(x1, y1, x2, y2).contains(plan.outline)
    bare = plan.plot(rooms=False, doors=False, objects=False, walls=False)
    assert not bare.texts
    assert len(bare.patches) == 1
    sheet = plans.plot(3, columns=2)
    assert [ax.get_title() for ax in sheet.axes] == [
        *(f"{count_noun(p.room_num, 'room')}, {p.area:.0f} m2" for p in plans[:3]),
        "",
    ]
    plt.close("all")


def test_a_notebook_shows_counts_pictures_and_a_table(plans: Dataset) -> None:
    html = plans._repr_html_()
    assert "4 plans" in html
    assert html.count("<svg") == 4
    assert html.count("<tr>") == 5
    assert "no plans" in plans[:0]._repr_html_()


def test_names_of_plans_are_escaped_in_a_notebook(tmp_path: Path) -> None:
    square = FloorPlan("<b>x", [(0.1, 0.1), (0.1, 4.1), (4.1, 4.1), (4.1, 0.1)], 1, {})
    square.save(tmp_path / "x.json")
    assert "<b>x" not in open_dataset(tmp_path)._repr_html_()
