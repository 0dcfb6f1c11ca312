"""A correction by hand that nothing in the house answers to is named."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from houseexpo.commands.app import make_app
from tests.builders.bungalow import FILE


def built(tmp_path: Path, corrections: str) -> str:
    (tmp_path / "corrections.toml").write_text(f"[houses_bungalow]\n{corrections}\n")
    words = ["build", str(FILE), "--overrides", str(tmp_path / "corrections.toml"), "--out", str(tmp_path / "plans")]
    done = CliRunner().invoke(make_app(), [*words, "--workers", "1"])
    assert done.exit_code == 0, done.output
    return " ".join(done.output.split())


@pytest.mark.parametrize(
    ("corrections", "said"),
    [
        ("door = [[50.0, 1.0], [50.0, 1.9]]", "houses_bungalow: door [[50.0, 1.0], [50.0, 1.9]]: the plan has no door"),
        ("no_room = [70.0, 4.7]", "no_room [70.0, 4.7]: it lies more than 10 m from the house"),
        ("door = [[5.1, 1.0], [5.1, 1.9]]\nno_room = [7.1, 4.7]", ""),
    ],
)
def test_what_has_no_effect_is_named(tmp_path: Path, corrections: str, said: str) -> None:
    output = built(tmp_path, corrections)
    assert ("correction without effect" in output) == bool(said)
    assert said in output
