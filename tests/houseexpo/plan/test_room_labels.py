from __future__ import annotations

import pytest

from houseexpo.plan.room_labels import UNLABELLED, canonical


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
