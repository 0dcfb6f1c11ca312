"""The commands of docs/sources.md, on the files that they name."""

import re
from pathlib import Path

import pytest

from tests.builders.commands import call
from tests.builders.examples import FOLDER, write_examples

ROOT = Path(__file__).resolve().parents[1]
TEXT = (ROOT / "docs" / "sources.md").read_text()
COMMANDS = re.findall(r"^    houseexpo (build \S+ --out plans/\w+)$", TEXT, re.MULTILINE)


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_of_the_page_makes_a_plan(tmp_path, command):
    build, source, option, out = command.split()
    call(build, FOLDER / source, option, tmp_path / out, "--workers", "1")
    assert len(list((tmp_path / out / "json").glob("*.json"))) == 1


@pytest.mark.slow
def test_the_examples_are_what_the_builders_write(tmp_path):
    for path in write_examples(tmp_path):
        assert path.read_bytes() == (FOLDER / path.relative_to(tmp_path)).read_bytes(), path.name
