"""The examples in the commands' help name commands and options that there are."""

from __future__ import annotations

from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from houseexpo.commands.app import EXAMPLES, make_app

GROUP: Any = typer.main.get_command(make_app())


def test_every_command_has_an_example() -> None:
    groups = {name for name in GROUP.list_commands(None) if hasattr(GROUP.get_command(None, name), "commands")}
    assert set(GROUP.list_commands(None)) - groups == set(EXAMPLES)


@pytest.mark.parametrize("name", sorted(EXAMPLES))
def test_examples_name_options_that_there_are(name: str) -> None:
    command = GROUP.get_command(None, name)
    known = {option for parameter in command.params for option in parameter.opts}
    for example in EXAMPLES[name]:
        first, *words = example.split()
        assert first == name
        assert {word for word in words if word.startswith("--")} <= known


def test_the_help_ends_with_an_example_a_line() -> None:
    said = CliRunner().invoke(make_app(), ["build", "--help"]).output
    lines = [line.strip() for line in said.splitlines()]
    assert "houseexpo build house.glb --out plans/house" in lines
    assert "houseexpo build procedural:20 --seed 7 --out plans/homes" in lines
