import gzip
import itertools
import json
import tracemalloc

import pytest
import shapely

from pipeline.rejection import Reason, Rejection
from pipeline.sources import find, procthor
from pipeline.sources.reader_choice import reader_for_file
from tests.builders.damage import rejected
from tests.builders.formats import procthor as tiny
from tests.builders.houses import kinds, levels_of, plan_of

ROOMS = {"Bedroom": (0.0, 0.0, 3.0, 4.0), "Kitchen": (3.0, 0.0, 8.0, 4.0)}


def test_rooms_doors_and_frame_are_the_files_own(tmp_path):
    (level,) = levels_of(tiny.write(tmp_path / "house.json", tiny.house()))
    assert {room.words[0]: room.polygon.bounds for room in level.rooms} == ROOMS
    assert [room.labels for room in level.rooms] == [("Bedroom",), ("Kitchen",)]
    between, front = level.openings  # the window is none
    assert between.polygon.centroid.coords[0] == pytest.approx((3.0, 2.55))  # from the first corner, (3, 4), downwards
    assert front.polygon.bounds == pytest.approx((-0.01, 2.0, 0.01, 3.0))
    assert (level.frame.matrix, level.frame.up, level.ceiling_m) == (((1, 0, 0), (0, 1, 0)), "y", tiny.HEIGHT)


def test_the_plan_has_both_rooms_the_door_and_the_entrance(tmp_path):
    (level,) = levels_of(tiny.write(tmp_path / "house.json", tiny.house()))
    plan = plan_of(level)
    assert sorted(room.label for room in plan.rooms) == ["Bedroom", "Kitchen"]
    assert kinds(plan) == ["door", "entrance"]
    assert sum(room.area for room in plan.rooms) == pytest.approx(32.0, rel=0.02)


def test_an_empty_wall_does_not_stand_and_a_doorframe_has_no_leaf(tmp_path):
    house = tiny.house()
    house["doors"][0]["assetId"] = "Doorframe_1"
    (level,) = levels_of(tiny.write(tmp_path / "frame.json", house))
    assert [opening.has_door for opening in level.openings] == [False, True]
    for wall in house["walls"]:
        wall["empty"] = wall["id"] in {"wall|2|2", "wall|3|0"}
    house["doors"] = []
    (level,) = levels_of(tiny.write(tmp_path / "open.json", house))
    plan = plan_of(level)
    assert sorted(room.label for room in plan.rooms) == ["Bedroom", "Kitchen"]
    assert kinds(plan) == []


def test_objects_are_furniture_where_they_have_a_box(tmp_path):
    house = tiny.house()
    box = {"center": tiny.point(1.0, 0.3, 1.0), "size": tiny.point(1.0, 0.6, 2.0)}
    house["objects"].append({"id": "Bed|2|1", "axisAlignedBoundingBox": box})
    path = tiny.write(tmp_path / "house.json", house)
    (bed,) = levels_of(path)[0].furniture
    assert bed.words == ("Bed",)
    assert shapely.MultiPoint(bed.mesh.vertices[:, :2]).bounds == pytest.approx((0.5, 0.0, 1.5, 2.0))


@pytest.mark.parametrize("name", ["many.jsonl", "many.gz", "no_suffix"])
def test_a_file_of_many_houses_is_known_by_its_content(tmp_path, name):
    path = tiny.write(tmp_path / name, [tiny.house(float(k)) for k in range(3)])
    items = list(find(str(path)))
    assert [item.id[-7:] for item in items] == ["_000000", "_000001", "_000002"]
    last, first = (next(procthor.read(items[k])) for k in (2, 0))  # backwards too
    assert (first.rooms[0].polygon.bounds[0], last.rooms[0].polygon.bounds[0]) == (0.0, 2.0)


@pytest.mark.parametrize("indent", [None, 2])
@pytest.mark.parametrize("name", ["many.json", "many.json.gz"])
def test_a_json_list_of_houses_is_many(tmp_path, name, indent):
    path = tmp_path / name
    data = json.dumps([tiny.house(float(k)) for k in range(3)], indent=indent).encode()
    path.write_bytes(gzip.compress(data) if path.suffix == ".gz" else data)
    assert [item.id[-7:] for item in find(str(path))] == ["_000000", "_000001", "_000002"]
    assert [level.rooms[0].polygon.bounds[0] for level in levels_of(path)] == [0.0, 1.0, 2.0]


def test_a_list_that_breaks_off_costs_its_last_house(tmp_path):
    path = tmp_path / "many.json"
    path.write_text(json.dumps([tiny.house(), tiny.house(5.0)])[:-200])
    good, bad = find(str(path))
    assert next(procthor.read(good)).rooms
    with pytest.raises(Rejection) as caught:
        next(procthor.read(bad))
    assert caught.value.reason is Reason.UNREADABLE


def test_a_list_of_other_things_is_no_house(tmp_path):
    for value in ([], [1], [{"name": "chair"}], [[[{"floorPolygon": 1}]]]):
        path = tmp_path / "list.json"
        path.write_text(json.dumps(value))
        assert reader_for_file(path) is None


def test_a_hole_may_be_written_as_a_box(tmp_path):
    house = tiny.house()
    for slot in house["doors"] + house["windows"]:
        low, high = slot.pop("holePolygon")
        slot["boundingBox"] = {"min": low, "max": high}
    (level,) = levels_of(tiny.write(tmp_path / "old.json", house))
    (today,) = levels_of(tiny.write(tmp_path / "new.json", tiny.house()))
    assert [each.polygon for each in level.openings] == [each.polygon for each in today.openings]


def test_a_door_without_a_hole_is_named(tmp_path):
    house = tiny.house()
    house["doors"][0]["holePolygon"] = []
    assert "no hole in 'wall|2|2'" in rejected(tiny.write(tmp_path / "house.json", house)).detail


def test_an_indented_house_is_one_house(tmp_path):
    path = tmp_path / "house.json"
    path.write_text(json.dumps(tiny.house(), indent=2))
    assert len(levels_of(path)) == 1


@pytest.mark.slow
def test_a_long_file_needs_no_more_memory_than_a_short_one(tmp_path):
    def most(count):
        path = tiny.write(tmp_path / f"{count}.jsonl.gz", [tiny.house(float(k)) for k in range(count)])
        tracemalloc.start()
        assert sum(1 for item in find(str(path)) for _ in procthor.read(item)) == count
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return peak

    most(10)
    assert most(200) < 1.5 * most(20)


def test_one_bad_line_is_one_bad_house(tmp_path):
    path = tiny.write(tmp_path / "many.jsonl", [tiny.house(), {"walls": 3}, tiny.house(2.0)])
    good, bad, other = find(str(path))
    assert next(procthor.read(good)).rooms
    assert next(procthor.read(other)).rooms
    with pytest.raises(Rejection, match="walls"):
        next(procthor.read(bad))


@pytest.mark.parametrize("name", ["many.jsonl", "many.jsonl.gz"])
@pytest.mark.parametrize(
    "first",
    [b"garbage", b"{garb", b'{"a": }', b'{"a": 1}', b"[garb", b'[{"a": 1}]', b"<home>", b"PK\x03\x04", b"\0", b"null"],
)
def test_a_first_line_of_garbage_is_one_bad_house(tmp_path, name, first):
    path = tiny.write(tmp_path / "many.jsonl", [tiny.house(), tiny.house(2.0)])
    data = first + b"\n" + path.read_bytes()
    path = tmp_path / name
    path.write_bytes(gzip.compress(data) if name.endswith(".gz") else data)
    bad, good, other = find(str(path))
    assert next(procthor.read(good)).rooms
    assert next(procthor.read(other)).rooms
    with pytest.raises(Rejection, match=r"JSON|object|missing"):
        next(procthor.read(bad))


def test_a_list_in_a_file_for_lines_is_a_list_of_houses(tmp_path):
    path = tmp_path / "many.jsonl"
    path.write_text(json.dumps([tiny.house(), tiny.house(2.0)]))
    assert len(list(find(str(path)))) == 2


def test_a_packed_file_that_breaks_off_gives_the_houses_before(tmp_path):
    data = gzip.compress(b"".join(json.dumps(tiny.house(float(k))).encode() + b"\n" for k in range(40)), 0)
    path = tmp_path / "many.jsonl.gz"
    path.write_bytes(data[: len(data) // 2])
    *whole, broken = list(itertools.islice(find(str(path)), 50))
    assert len(whole) > 10
    assert next(procthor.read(whole[3])).rooms
    with pytest.raises(Rejection):
        next(procthor.read(broken))


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"walls": []}, Reason.EMPTY),
        ({"doors": [tiny.door("door|1", "wall|9", "", 1.0, 2.0)]}, Reason.UNREADABLE),
        ({"rooms": [{"floorPolygon": [tiny.point(1e9, 0.0)]}]}, Reason.BAD_UNITS),
        ({"rooms": 7}, Reason.UNREADABLE),
    ],
)
def test_bad_house(tmp_path, change, reason):
    assert rejected(tiny.write(tmp_path / "house.json", tiny.house() | change)).reason is reason
