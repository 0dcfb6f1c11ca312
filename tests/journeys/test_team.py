"""Journey 9: several robots explore one house, by the code of docs/pseudoslam/teams.md, "One house, two teams"."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from houseexpo import open_dataset, save_plan
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.simulator import Simulator
from tests.builders.browsing import two_rooms
from tests.builders.needs import need
from tests.journeys.pages import python_block

PAGE = "docs/pseudoslam/teams.md"


def follow(folder: Path) -> tuple[str, bytes]:
    """Run the page's code in a folder; return what it printed and the picture's bytes."""
    (folder / "explore.py").write_text(python_block(PAGE, "merged.png"))
    words = [sys.executable, "explore.py"]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout, (folder / "merged.png").read_bytes()


@pytest.mark.slow
def test_a_team_sees_the_house_in_fewer_steps_and_its_maps_make_one(tmp_path: Path) -> None:
    need(modules=["pettingzoo"], how="pip install 'houseexpo[teams]'")
    (tmp_path / "plans" / "demo").mkdir(parents=True)
    save_plan(two_rooms(), tmp_path / "plans" / "demo" / "two_rooms.json")
    said, picture = follow(tmp_path)
    alone, together = (line.split() for line in said.splitlines())
    assert (alone[0], together[0]) == ("1", "3")
    assert min(float(alone[1]), float(together[1])) >= 0.99
    assert int(together[2]) <= int(alone[2])
    assert follow(tmp_path) == (said, picture)  # the same seed, the same bytes

    (plan,) = open_dataset(tmp_path / "plans" / "demo")
    free = Simulator.of(plan, SimulatorConfig()).world.occupied == 0
    merged = np.asarray(Image.open(tmp_path / "merged.png"))
    assert merged.shape == free.shape
    assert (merged[free] == 127).mean() > 0.9  # in the frame of the house
    assert not (merged[~free] == 127).any()
    assert free[merged == 255].mean() < 0.1


@pytest.mark.slow
def test_the_merged_map_is_the_union_and_no_two_robots_are_in_one_place(tmp_path: Path) -> None:
    need(modules=["pettingzoo"], how="pip install 'houseexpo[teams]'")
    from houseexpo import pseudoslam

    del tmp_path
    env = pseudoslam.parallel_env(task="exploration", robots=3, dataset=two_rooms(), radio="none")
    env.reset(seed=0)
    rng = np.random.default_rng(0)
    for _ in range(150):
        if not env.agents:
            break
        env.step({agent: int(rng.integers(3)) for agent in env.agents})
        team = env.team
        maps = np.array([state.known for state in team.states])
        assert np.array_equal(team.known != 0, (maps != 0).any(axis=0))
        places = team.places_px() / env.config.pixels_per_metre
        gaps = np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1))[np.triu_indices(3, 1)]
        assert gaps.min() >= 2 * env.config.robot.radius_m - 1e-9
