"""docs/format.md says what the code does."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from houseexpo.plan import DoorKind
from houseexpo.plan.json_codec import Published
from houseexpo.plan.room_labels import LABELS, UNLABELLED
from houseexpo.plan.schema import make_schema

ROOT = Path(__file__).resolve().parents[1]
PARTS = make_schema()["$defs"]
TEXT = (ROOT / "docs" / "format.md").read_text()


def section(title: str) -> str:
    return TEXT.split(f"# {title}\n")[1].split("\n#")[0]


def keys(title: str) -> set[str]:
    return set(re.findall(r"^\| `(\w+)` \|", section(title), re.MULTILINE))


def test_every_key_has_its_row() -> None:
    assert keys("Published keys") == set(Published.__struct_fields__)
    assert keys("Our keys") | keys("Published keys") == set(PARTS["Plan"]["properties"])


def test_the_labels_are_those_of_the_code() -> None:
    told = re.findall(r"`(\w+)`", section("Labels"))
    assert set(told) == {*LABELS, UNLABELLED}


def test_every_kind_of_door_has_its_row() -> None:
    assert keys("`doors`") == set(DoorKind.__args__) - {"window"}


@pytest.mark.parametrize(
    ("key", "part"),
    [("rooms", "Room"), ("doors", "Door"), ("objects", "Object"), ("windows", "Window"), ("frame", "Frame")],
)
def test_an_example_has_every_key_of_its_part(key: str, part: str) -> None:
    (example,) = re.findall(r"```json\n(.*?)\n```", section(f"`{key}`"), re.DOTALL)
    assert set(json.loads(example)) == set(PARTS[part]["properties"])


def test_nothing_cites_text_that_is_not_here() -> None:
    for folder in ("houseexpo", "pipeline", "stats", "docs"):
        for file in (ROOT / folder).rglob("*.[pm][yd]"):
            assert not re.search(r"FORMAT\.md|FIELD_NOTES|DESIGN\.md", file.read_text()), file
