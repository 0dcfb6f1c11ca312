"""Each rule of the format, broken once, is found; what keeps all of them is not."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import jsonschema
import msgspec
import numpy as np
import pytest

from houseexpo import DatasetError, encode
from houseexpo.dataset.validation import validate_dataset
from houseexpo.plan import Navigability, PlanObject, Quality
from houseexpo.plan.schema import SHIPPED, make_schema, schema_bytes
from tests.builders.plan_files import hexed, house, pack

SHARED = Path(__file__).resolve().parents[4] / "shared" / "data" / "houseexpo" / "plans_33717.jsonl.gz"
GOOD = house(hexed(7))


def found(tmp_path: Path, data: bytes, name: str = hexed(7)) -> dict[str, str]:
    """Return key by rule."""
    report = validate_dataset(pack(tmp_path, "folder", {name: data}))
    return {finding.rule: finding.key for finding in report.findings}


@pytest.fixture
def whole(two_rooms):
    """A plan of ours that keeps every rule."""
    pillar, (room, other), (door, entrance) = two_rooms.holes[0], two_rooms.rooms, two_rooms.doors
    room = replace(room, ring=[(0.1, 0.1), (0.1, 3.1), (4.1, 3.1), (4.1, 1.9), (4.1, 1.1), (4.1, 0.1)])
    reach = {f"{radius:.2f}": Navigability(1, 1.0, 0.8) for radius in (0.1, 0.15, 0.2, 0.25, 0.3, 0.35)}
    return replace(two_rooms, holes=(pillar,), rooms=(room, other), doors=(door, entrance), navigability=reach)


def test_the_shipped_schema_is_current():
    assert SHIPPED.read_bytes() == schema_bytes(), "run python -m houseexpo.plan.schema"


def test_the_schema_is_one_and_takes_what_we_write(whole):
    jsonschema.Draft202012Validator.check_schema(make_schema())
    check = jsonschema.Draft202012Validator(make_schema())
    for plan in (whole, GOOD):
        keys = msgspec.json.decode(encode(plan))
        check.validate(keys)
        for key in ("verts", "bbox", "room_num", "id", "room_category"):
            with pytest.raises(jsonschema.ValidationError, match="required"):
                check.validate({name: value for name, value in keys.items() if name != key})
        with pytest.raises(jsonschema.ValidationError):
            check.validate({**keys, "verts": [["0.1", 0.1]]})
    with pytest.raises(jsonschema.ValidationError):
        check.validate({**msgspec.json.decode(encode(whole)), "doors_": []})


def test_what_is_right_has_no_findings(tmp_path, whole):
    (tmp_path / "ours").mkdir()
    assert found(tmp_path, encode(GOOD)) == {}
    assert found(tmp_path / "ours", encode(whole), "two_rooms") == {}
    oven = PlanObject(0, "oven", 0, whole.holes[0][::-1], 0.9)
    furnished = encode(replace(whole, objects=(oven,), quality=Quality(0.9, {"cut_share": 0.0})))
    assert found(tmp_path / "ours", furnished, "two_rooms") == {}
    jsonschema.Draft202012Validator(make_schema()).validate(msgspec.json.decode(furnished))


def moved(**keys):
    return encode(replace(GOOD, **keys))


@pytest.mark.parametrize(
    ("rule", "data"),
    [
        ("schema", encode(GOOD)[:-9]),
        ("schema", encode(GOOD).replace(b'"room_num":1', b'"room_num":"1"')),
        ("file", encode(house(hexed(8)))),
        ("identity", encode(house("villa"))),
        ("count", moved(room_num=0)),
        ("labels", moved(room_category={"Dungeon": [(0, 0, 1, 1)]})),
        ("boxes", moved(room_category={"Kitchen": [(1, 0, 0, 1)]})),
        ("grid", moved(verts=[(0.1, 0.1), (0.1, 4.1), (4.1, 4.1), (4.1, 2.005), (4.1, 0.1)])),
        ("origin", encode(GOOD.moved(1, 0))),
        ("direction", moved(verts=GOOD.verts[::-1])),
        ("directions", moved(verts=[(0.1, 0.1), (0.1, 4.1), (4.1, 4.1), (4.2, 0.1)])),
        ("repeated", moved(verts=[(0.1, 0.1), (0.1, 4.1), (0.1, 4.1), (4.1, 4.1), (4.1, 0.1)])),
        ("simple", moved(verts=[(0.1, 0.1), (0.1, 4.1), (4.1, 4.1), (4.1, 2.1), (0.1, 2.1), (4.1, 2.1), (4.1, 0.1)])),
    ],
)
def test_published_plans(tmp_path, rule, data):
    assert rule in found(tmp_path, data)


def test_our_plans(tmp_path, whole):
    room, other = whole.rooms
    door, entrance = whole.doors
    broken = {
        "collinear": replace(whole, verts=[(0.1, 0.1), (0.1, 1.1), *whole.verts[1:].tolist()]),
        "rooms": replace(whole, rooms=(room, replace(other, ring=other.ring + np.array([0.5, 0])))),
        "doors": replace(whole, doors=(replace(door, width=0.9), entrance)),
        "objects": replace(whole, objects=(PlanObject(0, "bed", 1, other.ring, 0.5),)),
        "grid": replace(whole, objects=(PlanObject(0, "oven", 0, whole.holes[0] + 0.003, 0.5),)),
        "navigability": replace(whole, navigability={"0.20": Navigability(1, 1.5, 0.8)}),
        "direction": replace(whole, holes=(whole.holes[0][::-1],)),
    }
    for rule, plan in broken.items():
        folder = tmp_path / rule
        folder.mkdir()
        assert rule in found(folder, encode(plan), "two_rooms"), rule
    data = encode(whole).replace(b'"area":9', b'"area":8')
    assert found(tmp_path, data, "two_rooms") == {"area": "rooms[1].area"}


def test_a_manifest_that_disagrees(tmp_path):
    path = pack(tmp_path, "nested", {hexed(7): encode(GOOD)})
    files = {f"json/{hexed(7)}.json": "0" * 64, "json/lost.json": "0" * 64, "../../evil": "0" * 64}
    (path / "manifest.json").write_bytes(msgspec.json.encode({"files": files}))
    report = validate_dataset(path)
    assert sorted((f.rule, f.key) for f in report.findings) == sorted(("manifest", name) for name in files)
    (path / "manifest.json").write_bytes(b"{")
    with pytest.raises(DatasetError, match=r"manifest\.json"):
        validate_dataset(path)


def test_two_processes_find_the_same(tmp_path):
    plans = {hexed(i): encode(house(hexed(i), 3 + i / 100, i % 7)) for i in range(1100)}
    path = pack(tmp_path, "jsonl", plans)
    assert validate_dataset(path, 2) == validate_dataset(path, 1)


@pytest.mark.slow
def test_the_published_plans():
    if not SHARED.exists():
        pytest.skip("the published plans are not on this machine")
    report = validate_dataset(SHARED, 2)
    assert report.plans == 33_717
    assert {rule: n for rule, (n, _) in report.by_rule().items() if n} == {"simple": 1285}
