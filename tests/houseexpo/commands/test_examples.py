"""The examples in the commands' help name commands and options that there are."""

from __future__ import annotations

from typing import Any

import pytest
import typer

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
