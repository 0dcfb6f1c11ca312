"""``houseexpo prepare``: what it says, what it refuses."""

from __future__ import annotations

from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from houseexpo.commands.prepare import prepare
from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import RobotConfig, SimulatorConfig
from houseexpo.pseudoslam.worlds.store import WorldStore
from tests.builders.simulations import write_huts


@pytest.fixture
def plans(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path / "cache"))
    return write_huts(tmp_path)


def said(*words: object) -> str:
    app = typer.Typer()
    app.command()(prepare)
    result = CliRunner().invoke(app, [*map(str, words), "--workers", "1"], catch_exceptions=False)
    assert result.exit_code == 0
    return result.output


def test_it_makes_worlds_once(plans: Path) -> None:
    assert "3 worlds made, 0 known" in said(plans, "--resolution", 10)
    assert "0 worlds made, 3 known" in said(plans, "--resolution", 10)
    assert "3 worlds made, 0 known" in said(plans, "--resolution", 11)
    assert len(WorldStore(SimulatorConfig(10.0)).keys()) == 3


def test_sizes_are_options_or_a_configurations(plans: Path, tmp_path: Path) -> None:
    file = tmp_path / "robot.yaml"
    config = SimulatorConfig(10.0, RobotConfig(radius_m=0.3))
    file.write_text("pixels_per_metre: 10.0\nrobot:\n  radius_m: 0.3\n")
    assert SimulatorConfig.from_yaml(file) == config
    said(plans, "--config", file)
    assert len(WorldStore(config).keys()) == 3
    assert "0 worlds made" in said(plans, "--resolution", 10, "--robot-radius", 0.3)


def test_plans_without_a_world_are_named(plans: Path) -> None:
    assert "no world: robot.radius_m: a robot of radius 2 m fits nowhere in plan 'small'" in said(
        plans, "--resolution", 10, "--robot-radius", 2
    )


def test_sizes_that_cannot_be_are_refused(plans: Path) -> None:
    with pytest.raises(ConfigError, match="radius_m"):
        said(plans, "--robot-radius", -1)
