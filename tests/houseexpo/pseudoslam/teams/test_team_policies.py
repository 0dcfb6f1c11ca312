"""How teams share out frontiers, tracks and tables."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from houseexpo import FloorPlan
from houseexpo.commands.app import make_app
from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.agents.protocol import Robot
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.kernels.planning.planner_types import FRONTIER, STRAIGHT
from houseexpo.pseudoslam.teams.policies import POLICIES, Auction, GreedyTeam, Hungarian, NearestEach
from houseexpo.pseudoslam.teams.tracks import (
    COLUMNS,
    TRACKS,
    find_team_track,
    format_track_markdown,
    make_table,
    run_team,
)

CROSS = FloorPlan(  # a hall with a corridor to each side
    "cross",
    [(0, 4), (0, 6), (8, 6), (8, 10), (10, 10), (10, 6), (18, 6), (18, 4), (10, 4), (10, 0), (8, 0), (8, 4)], 1, {},
)  # fmt: skip
CUPBOARD = FloorPlan("cupboard", [(0, 0), (0, 0.6), (0.6, 0.6), (0.6, 0)], 1, {})


def _scene() -> tuple[np.ndarray[Any, Any], Any, np.ndarray[Any, Any]]:
    """Return a map of a corridor between unknown cells, two frontiers at its ends, and their places."""
    known = np.zeros((60, 300), np.uint8)
    known[20:40, 10:290] = 127
    known[19, 10:290] = known[40, 10:290] = 255
    places = np.array([[20.5, 30.5], [280.5, 30.5]])
    frontiers = np.zeros(2, FRONTIER)
    frontiers["goal"] = [30 * 300 + 20, 30 * 300 + 280]
    return known, frontiers, places


@pytest.mark.parametrize("kind", [GreedyTeam, Hungarian, Auction])
def test_two_robots_take_two_frontiers(kind: Any) -> None:
    known, frontiers, places = _scene()
    info: Any = {}
    one, other = kind(Robot(SimulatorConfig()), 0), kind(Robot(SimulatorConfig()), 1)
    # the robots are at x = 100 and x = 130: both are nearer to the first frontier
    for explorer, x, rest in ((one, 100.5, 130.5), (other, 130.5, 100.5)):
        frontiers["way"] = [(x - 20.5) * STRAIGHT, (280.5 - x) * STRAIGHT]
        goal = (math.nan, math.nan) if explorer is one else (20.5, 30.5)
        explorer.others = np.array([(rest, 30.5, *goal)])
        assert explorer.share(known, frontiers, places, info) == (0 if explorer is one else 1)
        ways = explorer.ways_m(known, frontiers, places)
        np.testing.assert_allclose(ways[1], [abs(rest - 20.5) / 25, abs(280.5 - rest) / 25], atol=0.1)
    nearest = NearestEach(Robot(SimulatorConfig()), 0)
    assert nearest.share(known, frontiers, places, info) == 0


@pytest.mark.parametrize("name", sorted(POLICIES))
def test_a_team_explores_and_gives_the_same_again(name: str) -> None:
    result = run_team(TRACKS[0], name, [CROSS, CUPBOARD], ["cross", "cupboard"])
    assert result["without_room"] == ["cupboard"]
    (plan,) = result["plans"]
    assert plan["team_coverage"] >= 0.99
    assert plan["steps_to_90"] <= plan["steps_to_99"] == plan["makespan"]
    assert plan["longest_m"] <= plan["metres"] <= 2 * plan["longest_m"]
    assert 0 <= plan["overlap"] < 0.5
    assert run_team(TRACKS[0], name, [CROSS], ["cross"])["plans"] == [plan]


def test_the_table_has_what_the_results_have() -> None:
    row = dict.fromkeys(COLUMNS, 2.0)
    results = [{"policy": "x", "without_room": ["c"], "plans": [row, {**row, "steps_to_99": None, "overlap": 0.5}]}]
    heads, (cells,) = make_table(results)
    assert len(heads) == len(cells) == len(COLUMNS) + 1
    assert cells[heads.index("steps to 99%")] == "2 [2, 2] /1"
    assert cells[heads.index("overlap, %")].startswith("125 [50, 200]")
    assert "2 robots in 2 houses (1 more had no room" in format_track_markdown(TRACKS[0], results)
    with pytest.raises(ConfigError, match="--track: expected one of team-2, team-4, team-8"):
        find_team_track("team-3")


def test_the_command(tmp_path: Path) -> None:
    plans = tmp_path / "plans"
    plans.mkdir()
    CROSS.save(plans / "cross.json")
    (plans / "map_id_test.txt").write_text("cross\n")
    words = ["benchmark", "team", "--track", "team-2", "--policy", "greedy", "--plans", "1"]
    out = tmp_path / "teams.md"
    done = CliRunner().invoke(make_app(), [*words, "--dataset", str(tmp_path / "plans"), "--out", str(out)])
    assert done.exit_code == 0, done.output
    (result,) = json.loads(out.with_suffix(".json").read_text())
    assert [plan["plan_id"] for plan in result["plans"]] == ["cross"]
    assert "\n| greedy | " in out.read_text()
    done = CliRunner().invoke(make_app(), [*words, "--policy", "greedily", "--out", str(out)])
    assert done.exit_code != 0
