from __future__ import annotations

import pytest

from houseexpo.plan.room_labels import GROUPS, LABELS, UNLABELLED, canonical, label_colour, label_group


def test_the_table_is_whole():
    assert len(set(LABELS)) == 25
    assert {label_group(label) for label in LABELS} == set(GROUPS)
    assert len({label_colour(label) for label in (*LABELS, UNLABELLED)}) == 26


@pytest.mark.parametrize(
    ("word", "label"),
    [
        ("Living_Room", "Living_Room"),
        ("LivingRoom", "Living_Room"),
        ("living room", "Living_Room"),
        ("BOILER-ROOM", "Boiler_room"),
        ("passenger elevator", "Passenger_elevator"),
        (" Hall ", "Hall"),
        ("Hallways", None),
        ("WC", None),
        ("", None),
        (UNLABELLED, None),
    ],
)
def test_spellings(word, label):
    assert canonical(word) == label


def test_words_without_a_group_are_indoor():
    assert label_group(UNLABELLED) == label_group("indoor") == "indoor"
    assert label_group("Toilet") == "bathroom"
