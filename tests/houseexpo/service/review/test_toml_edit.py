"""Keys of one table change; all else in the file stays, comments and order too."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from houseexpo.errors import ConfigError
from houseexpo.service.review.toml_edit import edit_table
from pipeline.overrides import load_overrides
from tests.builders.tries import tries

HAND = """\
# What Ann saw on site.
[villa_L1]
keep = true   # seen on site
door = [
  [[1.0, 2.0], [1.0, 3.0]],  # kitchen
]

# a hall
[fair_hall]
drop = true
why = "a # is no comment"
"""


def test_a_key_changes_where_it_stands_and_keeps_its_comment() -> None:
    found = edit_table(HAND, "fair_hall", {"drop": None, "keep": True, "why": "it is a house"})
    assert found == HAND.replace('drop = true\nwhy = "a # is no comment"', 'why = "it is a house"\nkeep = true')
    assert edit_table("[a]\nh_g = 0.4  # low\n", "a", {"h_g": 0.5}) == "[a]\nh_g = 0.5  # low\n"


@pytest.mark.parametrize("sign", ["\u2028", "\u2029", "\u0085"])
def test_signs_that_end_lines_elsewhere_stay_in_their_comment(sign: str) -> None:
    text = f'# seen{sign}on site\n[hut]\nwhy = "small{sign}"  # and{sign}old\n'
    assert edit_table(text, "hut", {"keep": True}) == f"{text}keep = true\n"


def test_a_list_that_grows_keeps_the_comments_within_it() -> None:
    doors = [[[1.0, 2.0], [1.0, 3.0]], [[4.0, 4.0], [5.0, 4.0]]]
    found = edit_table(HAND, "villa_L1", {"door": doors})
    assert tomllib.loads(found)["villa_L1"]["door"] == doors
    assert "  [[1.0, 2.0], [1.0, 3.0]],  # kitchen\n  [[4.0, 4.0], [5.0, 4.0]]\n]" in found
    assert found.startswith("# What Ann saw on site.\n[villa_L1]\nkeep = true   # seen on site\n")


@pytest.mark.parametrize(
    ("before", "value"),
    [
        ("no_room = [1.0, 2.0]\n", [[1.0, 2.0], [3.0, 4.0]]),
        ("no_room = [ # one\n 1.0, 2.0]\n", [[1.0, 2.0], [3.0, 4.0]]),
        ("no_room = [[1.0, 2.0] # one\n]\n", [[1.0, 2.0], [3.0, 4.0]]),
        ("no_room = [[1.0, 2.0], [5.0, 6.0] # two\n]\n", [[1.0, 2.0]]),
    ],
)
def test_lists_in_every_form_change_and_no_comment_is_lost(before: str, value: list[Any]) -> None:
    found = edit_table(f"[a]\n{before}", "a", {"no_room": value})
    assert tomllib.loads(found) == {"a": {"no_room": value}}
    assert found.count("#") == before.count("#")


def test_a_key_that_goes_leaves_its_comment_and_a_table_with_one_stays() -> None:
    assert edit_table("[a]\nkeep = true # seen\n", "a", {"keep": None}) == "[a]\n# seen\n"
    assert edit_table("[a]\nkeep = true\n\n[b]\ndrop = true\n", "a", {"keep": None}) == "[b]\ndrop = true\n"


def test_tables_in_one_line_and_dotted_keys_are_changed_too() -> None:
    text = "hut = {keep = true}  # old\nbarn.drop = true\n"
    found = edit_table(edit_table(text, "hut", {"keep": None, "why": "gone"}), "barn", {"why": "hay"})
    assert found == 'hut = { why = "gone" }  # old\nbarn.drop = true\nbarn.why = "hay"\n'


def test_names_and_words_are_written_as_toml_has_them() -> None:
    found = edit_table("", "my house.1", {"why": 'he said "no"\\ \x7f ß'})
    assert found.startswith('["my house.1"]\n')
    assert tomllib.loads(found) == {"my house.1": {"why": 'he said "no"\\ \x7f ß'}}


def test_line_ends_are_those_of_the_file() -> None:
    assert (
        edit_table("[a]\r\nkeep = true\r\n", "b", {"drop": True}) == "[a]\r\nkeep = true\r\n\r\n[b]\r\ndrop = true\r\n"
    )


def test_what_stands_in_long_texts_is_no_table() -> None:
    text = '[a]\nwhy = """\n[b]\nkeep = false\n"""\n'
    assert edit_table(text, "b", {"keep": True}) == text + "\n[b]\nkeep = true\n"


def test_what_is_no_toml_is_refused() -> None:
    with pytest.raises(ConfigError, match="expected TOML"):
        edit_table("[a", "a", {"keep": True})


def test_what_cannot_be_changed_is_refused_not_spoilt() -> None:
    with pytest.raises(ConfigError, match="expected a table"):
        edit_table("[[a]]\nkeep = true\n", "a", {"keep": False})
    with pytest.raises(ConfigError, match="cannot be changed here"):
        edit_table("[a.why]\nkeep = true\n", "a", {"why": None})


def test_a_build_reads_what_was_written(tmp_path: Path) -> None:
    file = tmp_path / "overrides.toml"
    file.write_text(edit_table(HAND, "villa_L1", {"no_room": [5.5, 1.0], "keep": None}))
    found = load_overrides(None, file)
    assert found["villa_L1"].no_room == ((5.5, 1.0),)
    assert found["villa_L1"].door == (((1.0, 2.0), (1.0, 3.0)),)
    assert not found["villa_L1"].keep


NAMES = st.sampled_from(["villa_L1", "fair_hall", "new", "a b", "ü"])
POINTS = st.lists(st.floats(-100, 100).map(lambda x: round(x, 3) + 0.0), min_size=2, max_size=2)
CHANGES = st.fixed_dictionaries(
    {},
    optional={
        "keep": st.sampled_from([True, None]),
        "why": st.one_of(st.none(), st.text(st.characters(exclude_categories=["Cs"]), max_size=20)),
        "no_room": st.one_of(st.none(), st.lists(POINTS, min_size=1, max_size=3)),
    },
)


@tries(60)
@given(st.lists(st.tuples(NAMES, CHANGES), max_size=6))
def test_many_changes_say_what_they_should_and_lose_no_comment(steps: list[tuple[str, dict[str, Any]]]) -> None:
    text, wanted = HAND, tomllib.loads(HAND)
    for name, changes in steps:
        text = edit_table(text, name, changes)
        table = wanted.setdefault(name, {})
        table.update({key: value for key, value in changes.items() if value is not None})
        for key, value in changes.items():
            if value is None:
                table.pop(key, None)
    assert {k: v for k, v in tomllib.loads(text).items() if v} == {k: v for k, v in wanted.items() if v}
    for comment in ("# What Ann saw on site.", "# seen on site", "# kitchen", "# a hall"):
        assert comment in text


@tries(40)
@given(NAMES, st.booleans())
def test_a_new_table_that_goes_again_leaves_the_file_as_it_was(name: str, keep: bool) -> None:
    if name in tomllib.loads(HAND):
        return
    key = "keep" if keep else "drop"
    assert edit_table(edit_table(HAND, name, {key: True}), name, {key: None}) == HAND
