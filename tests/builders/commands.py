"""The command, called as a person does."""

from __future__ import annotations

from pathlib import Path

from typer.testing import CliRunner

from houseexpo.commands import app


def call(*words: str | Path, code: int = 0) -> str:
    """Call ``houseexpo`` in a wide terminal; return what it says. It must end with this exit code."""
    done = CliRunner().invoke(app.make_app(), [str(word) for word in words], env={"COLUMNS": "200"})
    assert done.exit_code == code, done.output
    return done.output
