"""Write the storeys of one house as one file, and read them back as several plans."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from houseexpo import save_plan
from houseexpo.commands.app import make_app
from houseexpo.errors import ConfigError
from houseexpo.exports import export
from houseexpo.plan import Frame
from pipeline.algorithm import plan_level
from pipeline.config import PipelineConfig
from pipeline.sources import find, reader
from tests.builders.batch import labels, likeness
from tests.builders.houses import Hole, plan_of, two_rooms

NEEDS = {"ifc": "ifcopenshell", "rmf": "yaml"}
SUFFIX = {"ifc": ".ifc", "rmf": ".building.yaml"}


def storeys():
    """A ground floor of two rooms, and above it the same, 1 m to the right and 2 m farther."""
    low = replace(plan_of(two_rooms(Hole(1.0, 1.9))), id="low")
    frames = [Frame(((1.0, 0.0, x), (0.0, 1.0, y)), "z", floor, level) for level, (x, y, floor) in enumerate(PLACES)]
    return [replace(low, id=name, frame=frame) for name, frame in zip(("low", "high"), frames, strict=True)]


PLACES = ((5.0, 7.0, 0.0), (6.0, 9.0, 2.8))


def levels_of(path):
    (item,) = find(str(path))
    return list(reader(item.reader).read(item))


@pytest.mark.parametrize("form", ["ifc", "rmf"])
def test_two_storeys_come_back_from_one_file_as_two_plans(tmp_path, form):
    pytest.importorskip(NEEDS[form])
    low, high = storeys()
    written = export([high, low], form, tmp_path, building="home")
    path = tmp_path / f"home{SUFFIX[form]}"
    assert path in written
    levels = levels_of(path)
    assert [level.frame.floor for level in levels] == pytest.approx([0.0, 2.8], abs=0.01)
    for level, plan in zip(levels, (low, high), strict=True):
        (found,) = plan_level(level, PipelineConfig(), np.random.default_rng(0))
        assert likeness(plan, found) > 0.99
        assert len(found.doors) == len(plan.doors)
        assert labels(found) == labels(plan)


def test_storeys_of_ifc_lie_over_each_other_as_in_their_source(tmp_path):
    pytest.importorskip("ifcopenshell")
    export(storeys(), "ifc", tmp_path, building="home")
    low, high = (level.walls.vertices.min(axis=0)[:2] + _shift(level) for level in levels_of(tmp_path / "home.ifc"))
    assert (high - low).tolist() == pytest.approx([1.0, 2.0], abs=0.01)


def _shift(level):
    return np.array(level.frame.matrix)[:, 2]


def test_fiducials_of_rmf_say_how_the_levels_lie(tmp_path):
    import yaml

    export(storeys(), "rmf", tmp_path, building="home")
    levels = yaml.safe_load((tmp_path / "home.building.yaml").read_text())["levels"]
    assert list(levels) == ["L1", "L2"]
    (low, *_), (high, *_) = (level["fiducials"] for level in levels.values())
    assert low[2] == high[2]
    a, b, about = levels["L1"]["measurements"][0]
    corners = levels["L1"]["vertices"]
    scale = about["distance"][1] / np.hypot(corners[a][0] - corners[b][0], corners[a][1] - corners[b][1])
    assert ((low[0] - high[0]) * scale, (high[1] - low[1]) * scale) == pytest.approx((1.0, 2.0), abs=0.01)


def test_plans_without_heights_are_stacked_in_their_order(tmp_path):
    pytest.importorskip("ifcopenshell")
    plans = [replace(plan, frame=None) for plan in storeys()]
    export(plans, "ifc", tmp_path, building="home")
    assert [level.frame.floor for level in levels_of(tmp_path / "home.ifc")] == pytest.approx([0.0, 3.0], abs=0.01)


@pytest.mark.parametrize(("form", "name", "said"), [("svg", "home", "ifc, rmf"), ("rmf", "a/b", "name that a file")])
def test_what_cannot_be_one_building_is_refused(tmp_path, form, name, said):
    with pytest.raises(ConfigError, match=said):
        export(storeys(), form, tmp_path, building=name)


def test_the_command_writes_one_building(tmp_path):
    (tmp_path / "plans").mkdir()
    for plan in storeys():
        save_plan(plan, tmp_path / "plans" / f"{plan.id}.json")
    asked = [
        "export",
        str(tmp_path / "plans"),
        "--to",
        "rmf",
        "--building",
        "home",
        "--out",
        str(tmp_path / "out"),
    ]
    result = CliRunner().invoke(make_app(), asked)
    assert result.exit_code == 0, result.output
    assert (tmp_path / "out" / "home.building.yaml").exists()
