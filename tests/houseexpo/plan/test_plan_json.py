from __future__ import annotations

import json

import pytest

from houseexpo.errors import PlanError
from houseexpo.floorplan import decode, load_plan, save_plan
from houseexpo.plan.json_codec import encode

PUBLISHED = (
    b'{"verts":[[0.1,0.1],[0.1,4.1],[4.1,4.1],[4.1,0.1]],"id":"0004d52d","room_category":'
    b'{"Kitchen":[[-0.05,0.1,4.2,4.1]]},"room_num":2,"bbox":{"max":[4.1,4.1],"min":[0.1,0.1]}}'
)


def test_a_published_plan_keeps_every_byte():
    plan = decode(PUBLISHED)
    assert (plan.id, plan.room_num, plan.rooms, plan.frame) == ("0004d52d", 2, (), None)
    assert plan.room_category == {"Kitchen": ((-0.05, 0.1, 4.2, 4.1),)}
    assert encode(plan) == PUBLISHED
    assert decode(PUBLISHED.decode()) == plan


def test_published_files_round_trip(published_lines):
    assert [encode(decode(line)) for line in published_lines] == published_lines


def test_our_plan_round_trips_with_the_keys_of_the_format(two_rooms):
    data = encode(two_rooms)
    assert decode(data) == two_rooms
    assert encode(decode(data)) == data
    keys = json.loads(data)
    assert list(keys)[:5] == ["verts", "id", "room_category", "room_num", "bbox"]
    assert keys["format"] == "houseexpo/2"
    assert keys["rooms"][0]["area"] == 11.84
    assert keys["rooms"][0]["source_labels"] == ["Wohnzimmer"]
    assert keys["doors"][1]["rooms"] == [0, None]
    assert keys["frame"] == {"matrix": [[0, -1, 5], [1, 0, -2]], "up": "z", "floor": 2.7, "level": 1}
    assert keys["navigability"] == {"0.20": {"components": 1, "largest_share": 1.0, "narrowest": 0.8}}
    assert b"4.2," in data
    assert b"4.20" not in data
    assert b" " not in data.replace(b"made by hand", b"")


def test_quality_and_objects_round_trip_and_stand_where_the_format_has_them(furnished, two_rooms):
    data = encode(furnished)
    assert decode(data) == furnished
    assert encode(decode(data)) == data
    keys = json.loads(data)
    assert list(keys)[8:11] == ["doors", "quality", "objects"]
    assert keys["quality"] == {"score": 0.93, "grounds": {"cut_share": 0.0, "guessed_wall_share": 0.1}}
    assert keys["objects"] == [
        {"id": 0, "label": "Kachelofen", "room": 0, "height": 0.9, "polygon": two_rooms.holes[0][::-1].tolist()}
    ]
    assert {"quality", "objects"}.isdisjoint(json.loads(encode(two_rooms)))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b'"score":0.93', b'"score":1.2', r"plan 'furnished': quality\.score: expected 0 to 1, found 1\.2"),
        (b'"score":0.93', b'"score":"high"', "quality.score: expected `float`, got `str`"),
        (b'"cut_share":0.0', b'"cut_share":null', "quality.grounds"),
        (b'"room":0,', b'"room":7,', r"plan 'furnished': objects\[0\]\.room: expected null or one of \[0, 1\]"),
        (b'"height":0.9', b'"height":-1', r"objects\[0\]\.height: expected metres, 0 or more, found -1"),
        (b'"label":"Kachelofen"', b'"label":" "', r"objects\[0\]\.label: expected a name, found ' '"),
        (b'"height":0.9', b'"tall":0.9', "unknown field `tall`|expected this key"),
    ],
)
def test_a_broken_quality_or_object_is_named(furnished, old, new, message):
    data = encode(furnished)
    assert old in data
    with pytest.raises(PlanError, match=message):
        decode(data.replace(old, new, 1))


def test_a_published_file_may_hold_more_and_ours_may_not(two_rooms):
    more = PUBLISHED[:-1] + b',"mine":1}'
    assert decode(more) == decode(PUBLISHED)
    ours = encode(two_rooms)[:-1] + b',"hole":[]}'
    with pytest.raises(PlanError, match=r"plan 'two_rooms': .*unknown field `hole`"):
        decode(ours)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b'"room_num":2', b'"rooms_num":2', "plan '0004d52d': room_num: expected this key, found none"),
        (b'"min"', b'"mins"', "plan '0004d52d': bbox.min: expected this key"),
        (b'"room_num":2', b'"room_num":"2"', "room_num: expected `int`, got `str`"),
        (b"[0.1,4.1]", b'[0.1,"4.1"]', r"verts\[1\]\[1\]: expected `float`, got `str`"),
        (b"[0.1,4.1]", b"[0.1,NaN]", "plan '0004d52d': expected one JSON object"),
        (b"[0.1,4.1]", b"[0.1,1e999]", r"verts\[1\]\[1\]: number out of range"),
        (b"[0.1,4.1]", b"[0.1]", r"verts\[1\]: expected `array` of length 2"),
        (b"[0.1,4.1],[4.1,4.1],", b"", "verts: expected at least 3 vertices"),
        (b"0004d52d", b"../up", "safe as a file name"),
        (b'"max":[4.1', b'"max":[4.2', "plan '0004d52d': bbox: expected the bounds of verts"),
        (b"}}", b'},"format":"houseexpo/3"}', "format: expected 'houseexpo/2' or no such key, found 'houseexpo/3'"),
        (b"}}", b"}", "expected one JSON object"),
    ],
)
def test_a_broken_file_is_refused_by_name_and_key(old, new, message):
    with pytest.raises(PlanError, match=message):
        decode(PUBLISHED.replace(old, new, 1))


def test_a_broken_part_is_named(two_rooms):
    data = encode(two_rooms).replace(b'"kind":"entrance"', b'"kind":"door"')
    with pytest.raises(PlanError, match=r"plan 'two_rooms': doors\[1\].rooms: expected two room ids"):
        decode(data)


@pytest.mark.parametrize("data", [b"", b"\xff\xfe{}", "\ud800", b"null", b"[" * 100_000, b'{"verts":' + b"[" * 100_000])
def test_what_is_no_plan_at_all_is_refused(data):
    with pytest.raises(PlanError):
        decode(data)


def test_every_cut_short_file_is_refused():
    for length in range(len(PUBLISHED)):
        with pytest.raises(PlanError):
            decode(PUBLISHED[:length])


def test_files_are_written_whole_and_errors_name_them(tmp_path, two_rooms):
    path = tmp_path / "two_rooms.json"
    save_plan(two_rooms, path)
    assert load_plan(path) == two_rooms
    assert [p.name for p in tmp_path.iterdir()] == ["two_rooms.json"]
    path.write_bytes(path.read_bytes()[:200])
    with pytest.raises(PlanError, match=r"two_rooms\.json.*expected one JSON object"):
        load_plan(path)
    path.write_bytes(b"\n")
    with pytest.raises(PlanError, match=r"expected one JSON object in UTF-8, found an empty file$"):
        load_plan(path)
