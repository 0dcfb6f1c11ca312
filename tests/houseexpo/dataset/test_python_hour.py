"""A data set in a notebook or a script: build, tables, plots, pictures."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import shapely

import houseexpo
from houseexpo import ConfigError, Dataset, FloorPlan, open_dataset
from houseexpo.plan.room_labels import UNLABELLED
from houseexpo.words import count_noun
from pipeline.algorithm import plan_level
from tests.builders.batch import run_build
from tests.builders.needs import need


@pytest.fixture(scope="module")
def plans(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    folder = tmp_path_factory.mktemp("hour") / "homes"
    run_build([Path("procedural:3")], folder, seed=3, plan=plan_level)
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
    assert done.stdout.splitlines() == ["once", "3 0"]


def test_build_names_what_it_was_not_given(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"no_such\.glb"):
        houseexpo.build(tmp_path / "no_such.glb", tmp_path / "out")
    with pytest.raises(ConfigError, match="'refuse', 'add' or 'replace'"):
        houseexpo.build("procedural:1", tmp_path / "out", others="overwrite")  # type: ignore[arg-type]
    assert not (tmp_path / "out").exists()


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
    assert list(table["rooms"]) == [len(plan.rooms) for plan in plans]
    assert list(table["source_rooms"]) == [plan.room_num for plan in plans]
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


def test_walls_are_a_layer(plans: Dataset) -> None:
    need(modules=["geopandas"], how="make readers")
    table = plans[:2].to_geopandas("walls")
    assert set(table["plan_id"]) == set(plans.ids[:2])
    drawn = shapely.union_all(plans[0].walls())
    assert shapely.union_all(table.geometry[table["plan_id"] == plans.ids[0]]).equals(drawn)


@pytest.mark.parametrize(
    ("name", "first"), [("p.PNG", b"\x89PNG"), ("p.svg", b"<svg"), ("p.pdf", b"%PDF"), ("p.json", b"{")]
)
def test_the_end_of_a_name_says_what_is_saved(plans: Dataset, tmp_path: Path, name: str, first: bytes) -> None:
    plans[0].save(tmp_path / name)
    data = (tmp_path / name).read_bytes()
    assert data.startswith(first)
    plans[0].save(tmp_path / name)
    assert (tmp_path / name).read_bytes() == data


@pytest.mark.parametrize("name", ["plan", "plan.txt", "plan.json.gz", "plan.jpg"])
def test_other_names_are_refused_with_a_list(plans: Dataset, tmp_path: Path, name: str) -> None:
    with pytest.raises(ConfigError, match=rf"\.json \(the plan\), \.png, \.svg or \.pdf.*'{name}'"):
        plans[0].save(tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_plans_are_taken_as_from_an_array(plans: Dataset) -> None:
    ids = plans.ids
    assert plans[[0, 3]].ids == [ids[0], ids[3]]
    assert plans[np.array([-1, 0])].ids == [ids[-1], ids[0]]
    assert plans[[ids[2], ids[1]]].ids == [ids[2], ids[1]]
    area = np.array(plans.column("area"))
    assert plans[area > np.median(area)].ids == [
        name for name, m2 in zip(ids, area, strict=True) if m2 > np.median(area)
    ]
    assert plans[[True, False, False, True]].ids == [ids[0], ids[3]]
    assert not len(plans[[]])
    assert plans.only(ids[1]).ids == [ids[1]]
    assert plans[[1, 2]][[1]].ids == [ids[2]]
    with pytest.raises(IndexError, match="expected 4 truth values, one for each plan, found 2"):
        plans[[True, False]]
    with pytest.raises(IndexError):
        plans[[9]]
    for number in (4, -5, 10**30):
        with pytest.raises(IndexError, match=rf"plans\[{number}\]: there are 4 plans, with numbers from 0"):
            plans[number]
    for odd in ([[0]], [0.5], {0}, 1.0, None, True, np.True_):
        with pytest.raises(TypeError, match="expected a number, an id, a slice"):
            plans[odd]


def test_a_mask_from_a_table_is_read_by_its_ids(plans: Dataset) -> None:
    pytest.importorskip("pandas")
    table = plans.to_pandas()
    large = table["area"] > table["area"].median()
    ids = list(table.index[large])
    assert 0 < len(ids) < len(plans)
    assert plans[large].ids == plans[large[::-1]].ids == plans[large.to_numpy()].ids == ids
    assert plans[1:][large].ids == [name for name in plans.ids[1:] if name in ids]
    assert plans[large.reset_index(drop=True)].ids == ids
    for other in (large[1:], large.rename(index={plans.ids[0]: "other"})):
        with pytest.raises(IndexError, match="expected 4 truth values, one for each plan, found 3"):
            plans[other]


def test_plans_are_sorted_by_a_column(plans: Dataset) -> None:
    area = plans.column("area")
    assert plans.sort("area").column("area") == sorted(area)
    assert plans.sort("area", descending=True).head(2).column("area") == sorted(area, reverse=True)[:2]
    assert plans.sort("source").ids == plans.ids
    with pytest.raises(ConfigError, match="the nearest is 'area'"):
        plans.sort("areas")
    for odd in (3, ["area"]):
        with pytest.raises(ConfigError, match="column: no "):
            plans.sort(odd)
    with pytest.raises(ConfigError, match="numbers or words, found 'navigability'"):
        plans.sort("navigability")


def test_shares_divide_the_plans(plans: Dataset) -> None:
    parts = plans.split(train=0.5, test=0.5, seed=1)
    assert list(parts) == ["train", "test"]
    assert sorted(parts["train"].ids + parts["test"].ids) == sorted(plans.ids)
    assert parts["train"].ids == plans.split(train=0.5, test=0.5, seed=1)["train"].ids
    for wrong in ({}, {"train": 0.4}, {"train": 2.0, "test": -1.0}):
        with pytest.raises(ConfigError, match="split: expected"):
            plans.split(**wrong)
    with pytest.raises(ConfigError, match="the name of a list, or shares"):
        plans.split("train", test=1.0)  # type: ignore[call-overload]


def test_a_plan_is_geojson(plans: Dataset) -> None:
    need(modules=["geopandas"], how="make readers")
    import geopandas

    plan = plans[0]
    assert json.loads(plan.to_geojson(orientation="plan", frame="plan")) == plan.__geo_interface__
    table = geopandas.GeoDataFrame.from_features(plan)
    assert (table["kind"] == "room").sum() == len(plan.rooms)
    assert table.area[table["kind"] == "free_space"].sum() == pytest.approx(plan.area, abs=0.1)


def test_what_reads_a_published_plans_shapes_has_its_axes() -> None:
    plan = FloorPlan("corner", [(0, 0), (6, 0), (6, 6), (3, 6), (3, 3), (0, 3)], 1, {})
    read = shapely.geometry.shape(plan.__geo_interface__["features"][0]["geometry"])
    assert read.symmetric_difference(plan.free_space).area < 0.01
    above = shapely.from_geojson(plan.to_geojson()).geoms[0]
    assert above.symmetric_difference(plan.free_space).area > 1.0


def test_the_way_between_two_points(plans: Dataset) -> None:
    plan = plans[0]
    start, goal = (room.polygon.representative_point() for room in (plan.rooms[0], plan.rooms[-1]))
    way = plan.shortest_path((start.x, start.y), (goal.x, goal.y))
    assert way is not None
    assert way.length == pytest.approx(shapely.LineString(way.points).length)
    assert way.length >= start.distance(goal)
    wide = plan.shortest_path((start.x, start.y), (goal.x, goal.y), radius=0.2)
    assert wide is None or wide.length >= way.length - 0.05
    assert plan.shortest_path((start.x, start.y), (1e3, 1e3)) is None


def test_a_plan_is_drawn_on_the_axis_that_is_given(plans: Dataset) -> None:
    import matplotlib as mpl

    mpl.use("agg")
    from matplotlib import pyplot as plt

    _, ax = plt.subplots()
    plan = plans[0]
    assert plan.plot(ax, title="a plan") is ax
    assert ax.get_title() == "a plan"
    assert ax.get_aspect() == 1
    named = {room.label.replace("_", " ") for room in plan.rooms if room.label != UNLABELLED}
    assert {text.get_text().split("\n")[0] for text in ax.texts} & named
    ax.figure.canvas.draw()
    (x1, x2), (y1, y2) = ax.get_xlim(), ax.get_ylim()
    assert shapely.box(x1, y1, x2, y2).contains(plan.outline)
    bare = plan.plot(rooms=False, doors=False, objects=False, walls=False)
    assert not bare.texts
    assert len(bare.patches) == 1
    sheet = plans.plot(3, columns=2)
    assert [ax.get_title() for ax in sheet.axes] == [
        *(f"{count_noun(len(p.rooms), 'room')}, {p.area:.0f} m²" for p in plans[:3]),
        "",
    ]
    assert plan.plot(figsize=(3, 2)).figure.get_size_inches().tolist() == [3, 2]
    assert plans.plot(2, figsize=(5, 2)).get_size_inches().tolist() == [5, 2]
    with pytest.raises(ConfigError, match="ax or figsize, found both"):
        plan.plot(ax, figsize=(3, 2))
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
