"""Closed spaces are joined as in the paper where doors are marked, else left out, and never without a note."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pipeline.algorithm import plan_level
from pipeline.config import CellsConfig, PipelineConfig
from pipeline.config_file import BuildConfig, load_config
from tests.builders.closed_rooms import closed_room, outcome
from tests.builders.shared import DATA, needs_shared
from tests.pipeline.test_graph_of_plans import plans_in


@pytest.mark.parametrize("seed", range(8))
def test_where_doors_are_marked_each_closed_space_of_2_m2_is_joined_whatever_its_shape(seed: int) -> None:
    assert outcome(closed_room(seed, marked=True)) == "joined"


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("marked", [True, False])
def test_a_cell_below_2_m2_is_filled_with_a_note(seed: int, marked: bool) -> None:
    assert outcome(closed_room(seed, marked=marked, least_m2=1.0, most_m2=1.9), "join") == "noted"


@pytest.mark.parametrize("seed", [0, 12, 15])  # 12, 15: slits without a floor, which the layout leaves out
def test_a_cell_of_a_mesh_that_is_no_room_has_a_note(seed: int) -> None:
    assert outcome(closed_room(seed, marked=False, least_m2=1.0, most_m2=1.9)) == "noted"


@pytest.mark.parametrize("seed", range(8))
def test_in_a_mesh_a_closed_space_is_joined_or_left_out_with_a_note(seed: int) -> None:
    house = closed_room(seed, marked=False)
    assert outcome(house) == outcome(house, "leave")
    assert outcome(house) in {"joined", "noted"}


@pytest.mark.parametrize("seed", range(8))
def test_if_asked_for_each_closed_space_of_a_mesh_is_joined(seed: int) -> None:
    assert outcome(closed_room(seed, marked=False), "join") == "joined"


def test_the_paper_s_threshold_decides_what_is_filled() -> None:
    house = closed_room(1, marked=True, least_m2=3.0, most_m2=4.0)
    config = replace(PipelineConfig(), cells=CellsConfig(area_m2=5.0))
    (plan,) = plan_level(house.level, config, np.random.default_rng(0))
    assert plan.provenance["notes"] == {"filled_cells": 1}


@needs_shared
@pytest.mark.parametrize("name", ["B_cell_25", "slit_80_a32", "sq_22"])
def test_a_closed_space_of_a_file_is_noted_with_its_place(name: str) -> None:
    (plan,) = plans_in(DATA / "found" / f"{name}.ply")
    assert plan.provenance["notes"] == {"closed_spaces": 1}
    assert [each["area"] for each in plan.provenance["closed_spaces"]] == [pytest.approx(2.75, abs=0.75)]


def test_a_manifest_says_what_becomes_of_closed_spaces(tmp_path) -> None:
    path = tmp_path / "houses.toml"
    path.write_text('[build]\nsources = ["."]\n[connectivity]\nclosed_spaces = "join"\n')
    joined = load_config(path)
    assert joined.planning.connectivity.joins_closed_spaces(marked=False)
    assert "closed_spaces" not in BuildConfig().parameters()["connectivity"]  # plans made before have that hash
    assert joined.digest() != BuildConfig(build=joined.build).digest()
