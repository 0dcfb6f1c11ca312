"""Plans as the published data sets write them, and what is bad in such files."""

import io
import os
import pickle

import pytest

from pipeline.rejection import Reason, Rejection
from pipeline.sources import find, reader
from pipeline.sources.vector_plans.tables import keys
from tests.builders import published_plans as published
from tests.builders.round_trip import plans_of

NAMED = {"Kitchen", "Bedroom"}
FILES = {
    "layout.txt": (published.spatiallm, set()),
    "ase_scene_language.txt": (published.aria, set()),
    "annotation_3d.json": (published.structured3d, NAMED),
    "zind_data.json": (published.zind, NAMED),
    "model.svg": (published.cubicasa, NAMED),
    "geometries.csv": (published.swiss_dwellings, NAMED),
    "ResPlan.pkl": (published.resplan, NAMED),
}


def rejected(path) -> Rejection:
    (item,) = find(str(path))
    with pytest.raises(Rejection) as caught:
        list(reader(item.reader).read(item))
    return caught.value


def written(path, content):
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


@pytest.mark.parametrize("name", sorted(FILES))
def test_two_rooms_with_a_door(tmp_path, name):
    made, names = FILES[name]
    (plan,) = plans_of(written(tmp_path / name, made()))
    assert len(plan.rooms) == 2
    assert {room.label for room in plan.rooms} >= names
    assert [door.kind for door in plan.doors] == ["door"]
    shrunk = (8 / 9) ** 2 if name == "model.svg" else 1.0  # its scale is a guess: doors of 0.8 m
    assert plan.area == pytest.approx(published.AREA_M2 * shrunk, rel=0.01)
    assert plan.doors[0].width == pytest.approx(0.9 * shrunk**0.5, abs=0.02)


def test_a_table_and_a_pickle_hold_many_plans(tmp_path):
    assert len(plans_of(written(tmp_path / "geometries.csv", published.swiss_dwellings(3)))) == 3
    path = written(tmp_path / "ResPlan.pkl", published.resplan(4))
    assert [item.key for item in find(str(path))] == ["0", "1", "2", "3"]
    assert len({plan.id for plan in plans_of(path)}) == 4
    assert len(plans_of(written(tmp_path / "msd.csv", published.swiss_dwellings(1, "geom")))) == 1


def test_a_scale_that_is_missing_is_guessed_from_doors(tmp_path):
    (plan,) = plans_of(written(tmp_path / "zind_data.json", published.zind(None)))
    assert plan.doors[0].width == pytest.approx(0.8, abs=0.02)
    (level,) = reader("vector_plans").read(next(find(str(tmp_path / "zind_data.json"))))
    assert level.guesses == ("scale",)


class Code:
    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return os.system, (f"touch {self.path}",)


@pytest.mark.parametrize("protocol", [2, 4, 5])
def test_a_pickle_with_code_is_refused_and_runs_nothing(tmp_path, protocol):
    data = pickle.dumps([{"wall": Code(tmp_path / "ran"), "id": 1}], protocol)
    found = rejected(written(tmp_path / "ResPlan.pkl", data))
    assert found.reason is Reason.UNREADABLE
    assert "no plan needs" in found.detail
    assert not (tmp_path / "ran").exists()


@pytest.mark.parametrize(
    "data",
    [
        b"\x80\x04cbuiltins\neval\n(V1+1\ntR.",
        b"\x80\x04cshapely.geometry\n__builtins__\n.",
        b"\x80\x04cnumpy\nload\n(V/etc/passwd\ntR.",
        b"\x80\x04r\xff\xff\xff\x7f.",
        b"\x80\x04" + b"(" * 100_000,
        b"\x80\x04N.",
        b"\x80\x04\x8e" + b"\xff" * 8,
    ],
)
def test_a_pickle_that_is_damaged_or_sly(tmp_path, data):
    assert rejected(written(tmp_path / "a.pkl", data)).reason in {Reason.UNREADABLE, Reason.NO_LEVEL}


def test_numpy_numbers_in_a_pickle_are_numbers(tmp_path):
    import numpy as np

    plans = pickle.loads(published.resplan())  # noqa: S301 - our own
    plans[0]["area"] = np.float64(plans[0]["area"])
    assert len(plans_of(written(tmp_path / "a.pkl", pickle.dumps(plans)))) == 1


def test_svg_with_entities_is_refused(tmp_path):
    bomb = '<!DOCTYPE svg [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;"><!ENTITY c SYSTEM "file:///etc/passwd">]>'
    found = rejected(written(tmp_path / "model.svg", bomb + published.cubicasa().replace("<text>x", "<text>&b;&c;")))
    assert "entity" in found.detail


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("layout.txt", "wall_0=Wall(a,b)\n", "no level|walls"),
        ("annotation_3d.json", "{", "no JSON"),
        ("annotation_3d.json", '{"junctions": 1}', "KeyError|TypeError"),
        ("zind_data.json", '{"redraw": {}}', "redraw"),
        ("model.svg", '<svg><g class="Wall"><polygon points="0,0 1,0 1,1"/></g></svg>', "door"),
        (
            "geometries.csv",
            "floor_id,entity_type,entity_subtype,geometry\n1,area,ROOM,POLYGON((0 0\n",
            "walls or rooms",
        ),
    ],
)
def test_a_file_that_holds_no_plan_says_why(tmp_path, name, content, said):
    import re

    assert re.search(said, str(rejected(written(tmp_path / name, content))))


def test_a_part_that_cannot_be_read_is_left_out(tmp_path):
    text = published.spatiallm() + "door_9=Door(wall_99,1,1,1,1,2)\nwall_9=Wall(nan,0,0,1,1,0,2.5,0)\nnonsense\n"
    (plan,) = plans_of(written(tmp_path / "layout.txt", text))
    for part in ("door door_9", "wall wall_9", "nonsense"):
        assert part in plan.provenance["left_out"]


def test_a_file_is_read_once_for_all_of_its_plans(tmp_path):
    path = written(tmp_path / "ResPlan.pkl", published.resplan(3))
    first = keys(path)
    path.write_bytes(published.resplan(5))
    os.utime(path, ns=(1, 1))
    assert (len(first), len(keys(path))) == (3, 5)
    assert io.BytesIO(path.read_bytes()).read(1) == b"\x80"
