"""Corrections by hand: what they change, and those without effect."""

from __future__ import annotations

import re
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from typer.testing import CliRunner

from houseexpo.commands.app import make_app
from houseexpo.corrections import Override
from houseexpo.corrections.vocabulary import WORDS
from houseexpo.dataset import open_dataset
from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import plan_points_from_source, source_points_from_plan
from houseexpo.plan import Frame
from houseexpo.plan.ids import is_of_input
from houseexpo.service.review.decisions import DecisionStore
from pipeline.algorithm import plan_largest_building, plan_level
from pipeline.batch.job import level_rng
from pipeline.config import PipelineConfig
from pipeline.overrides import (
    LevelOverride,
    check_override_ids,
    correct_input,
    correct_level,
    load_overrides,
    overrides_by_input,
    settle_override_ids,
)
from pipeline.sources import find, reader
from pipeline.values import Input, Level, Mesh
from tests.builders.batch import lines, one_room, run_build
from tests.builders.bungalow import BEDROOM_DOOR, FILE, PATIO, ROOMS_M2, write_bungalow
from tests.builders.meshes import two_levels, write
from tests.pipeline.sources.test_occupancy_map import FREE, UNSEEN, WALL, saved, two_rooms

VILLA, SCENE = Input("villa", "mesh_file", "villa.ply"), Input("0a1b", "suncg", "root", "0a1b")
NOTHING = Mesh(np.empty((0, 3)), np.empty((0, 3), np.int64))


def level(frame: Frame) -> Level:
    return Level("villa", NOTHING, 2.7, frame)


@pytest.mark.parametrize("name", ["villa", "villa_L1", "villa_B2", "villa_B2_L1", "villa_L1_0123abcd", "0a1b_L3"])
def test_an_override_is_of_an_input_or_of_a_level_or_building_of_one(name: str) -> None:
    check_override_ids({name: Override(keep=True)}, [VILLA, SCENE])


def test_the_overrides_of_an_input_are_those_that_concern_it() -> None:
    ends = ("", "_B2", "_L1", "_0123abcd", "_B2_L1", "_L1_B2", "_L1_0123abcd", "_L", "_2", "x")
    names = [base + end for base in ("villa", "vil", "villa_L1", "0a1b") for end in ends]
    overrides = {name: Override(why=name) for name in names}
    found = overrides_by_input(overrides)
    for known in names:
        assert found.get(known, {}) == {name: overrides[name] for name in names if is_of_input(name, known)}
    assert set(found["villa"]) == {"villa" + end for end in ("", "_B2", "_L1", "_0123abcd", "_B2_L1", "_L1_0123abcd")}


@pytest.mark.parametrize("name", ["vila", "villa_L", "villa_L1x", "villa_2", "illa", "villa_L1_B2"])
def test_an_id_that_no_house_has_is_refused_with_the_nearest(name: str) -> None:
    with pytest.raises(ConfigError, match=f"corrections: {name}: expected an id .* did you mean 'villa'"):
        check_override_ids({name: Override(keep=True)}, [VILLA, SCENE])


def test_a_build_refuses_an_unknown_id_but_not_where_it_takes_only_some_houses(tmp_path: Path) -> None:
    one_room(tmp_path / "street" / "a.ply")
    one_room(tmp_path / "street" / "b.ply", 6.0)
    with pytest.raises(ConfigError, match="bb: expected an id of this build"):
        run_build([tmp_path / "street"], tmp_path / "out", overrides={"bb": Override(drop=True)})
    assert not (tmp_path / "out").exists()
    assert run_build([tmp_path / "street"], tmp_path / "out", limit=1, overrides={"b": Override(drop=True)}).ids == (
        "a",
    )


def test_scale_and_nodes_are_told_to_the_reader() -> None:
    override = Override(scale=20.0, drop_nodes=("Lamp*", "Car"), keep=True)
    told = correct_input(replace(VILLA, options=(("up", "z"),)), {"villa": override})
    assert told.options == (("drop_nodes", '["Lamp*", "Car"]'), ("keep", "true"), ("scale", "20.0"), ("up", "z"))
    assert correct_input(VILLA, {"villa": Override(why="nice"), "other": override}) == VILLA
    given = correct_input(VILLA, {"villa": Override(distance=((0, 0), (30, 40), 1.0), floors=(2.8, 0))})
    assert given.options == (("floors", "[0.0, 2.8]"), ("units", "0.02"))


def test_corrections_of_a_file_alone_work_in_its_folder_and_the_other_way_round(tmp_path: Path) -> None:
    one_room(tmp_path / "street" / "a.ply")
    one_room(tmp_path / "street" / "b.ply", 6.0)
    (alone,) = find(str(tmp_path / "street" / "a.ply"))
    both = list(find(str(tmp_path / "street")))
    assert (alone.id, [item.id for item in both]) == ("street_a", ["a", "b"])
    said = Override(drop=True)
    assert settle_override_ids({"street_a": said, "b_L1": said}, both) == {"a": said, "b_L1": said}
    assert settle_override_ids({"a_L1": said}, [alone]) == {"street_a_L1": said}
    assert settle_override_ids({"a": said, "street_a": Override(keep=True)}, both)["a"].keep
    with pytest.raises(ConfigError, match="other_a: expected an id of this build"):
        check_override_ids(settle_override_ids({"other_a": said}, both), both)
    one_room(tmp_path / "x" / "c" / "d.ply")
    one_room(tmp_path / "y" / "c" / "d.ply", 6.0)
    twice = list(find(str(tmp_path)))
    assert settle_override_ids({"c_d": said}, twice) == {"c_d": said}  # of two files: refused as unknown
    for source in ("street/a.ply", "street"):
        out = tmp_path / f"plans_{Path(source).stem}"
        run_build([tmp_path / source], out, overrides={"street_a": said})
        assert [line["reason"] for line in lines(out / "rejected.jsonl")] == ["dropped_by_hand"]


@pytest.mark.parametrize(("key", "value"), [("up", "x"), ("units", "furlong"), ("units", "-1"), ("scale", -1.0)])
def test_a_size_or_an_axis_that_is_none_is_refused(key: str, value: str | float) -> None:
    with pytest.raises(ConfigError, match=f"{key}: expected"):
        Override(**{key: value})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ({"units": "cm", "distance": ((0, 0), (1, 0), 0.9)}, "expected one of units and distance, found both"),
        ({"scale": 2.0, "distance": ((0, 0), (1, 0), 0.9)}, "expected one of distance and scale, found both"),
        ({"scale": 2.0, "storey_height": 2.5}, "expected one of storey_height and scale, found both"),
        ({"distance": ((1, 1), (1, 1), 0.9)}, "distance: expected two points"),
        ({"distance": ((1, 1), (1, 2), 0)}, "distance: expected two points, and metres above 0"),
        ({"distance": (1, 2, 0.9)}, r"distance: expected \[\[x, y\], \[x, y\], metres\]"),
        ({"storey_height": 0.0}, "storey_height: expected more than 0"),
        ({"floors": (0.0, 1.0)}, "floors: expected 1.8 m or more from one to the next, found 0 and 1"),
    ],
)
def test_sizes_that_contradict_each_other_or_are_none_are_refused(words: dict[str, object], said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        Override(**words)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("given", "said", "options"),
    [
        ({"storey_height": "2.6"}, {"units": "cm"}, {"units": "cm"}),
        ({"scale": "20"}, {"distance": ((0, 0), (2, 0), 1.0)}, {"units": "0.5"}),
        ({"units": "mm", "scale": "20"}, {"storey_height": 2.5}, {"storey_height": "2.5"}),
        ({"units": "mm"}, {"scale": 20.0}, {"units": "mm", "scale": "20.0"}),
        ({"storey_height": "2.6"}, {"up": "z"}, {"storey_height": "2.6", "up": "z"}),
    ],
)
def test_a_size_that_somebody_says_of_a_file_takes_the_place_of_the_commands(
    given: dict[str, str], said: dict[str, object], options: dict[str, str]
) -> None:
    item = Input("house", "mesh_file", "house.glb", options=tuple(sorted(given.items())))
    assert dict(correct_input(item, {"house": Override(**said)}).options) == options  # type: ignore[arg-type]


def test_of_two_tables_the_later_size_counts_but_unit_and_scale_go_together() -> None:
    assert Override(units="cm").joined(Override(scale=20.0)) == Override(units="cm", scale=20.0)
    metre = ((0.0, 0.0), (2.0, 0.0), 1.0)
    assert Override(units="cm", scale=20.0).joined(Override(distance=metre)) == Override(distance=metre)
    assert Override(distance=metre).joined(Override(scale=2.0)) == Override(scale=2.0)
    assert Override(distance=metre, floors=(0.0,)).joined(Override(floors=(3.0,))).floors == (3.0,)


def test_a_house_or_a_storey_of_it_is_dropped_or_kept_and_the_storey_counts() -> None:
    words = {"villa": Override(drop=True, why="a barn"), "villa_L1": Override(keep=True)}
    assert LevelOverride.of("villa_L0", words, "").own == Override(drop=True, why="a barn")
    assert LevelOverride.of("villa_L1", words, "").own == Override(keep=True, why="a barn")
    assert not LevelOverride.of("villas_L0", words, "").own.drop


def test_a_distance_in_the_file_gives_the_size_and_floors_the_storeys(tmp_path: Path) -> None:
    path = tmp_path / "villa.ply"
    write(two_levels(), path)
    trimesh.load(path).apply_scale(1 / 37).export(path)
    (item,) = find(str(path))
    long = Override(distance=((0.0, 0.0), (8.0 / 37, 0.0), 8.0))
    levels = list(reader("mesh_file").read(correct_input(item, {item.id: long})))
    assert [level.frame.floor for level in levels] == pytest.approx([0.0, 2.8], abs=1e-3)
    upper = replace(long, floors=(2.7,))  # a hand's breadth off
    (level,) = reader("mesh_file").read(correct_input(item, {item.id: upper}))
    assert level.frame.floor == pytest.approx(2.8, abs=1e-3)
    assert np.ptp(level.walls.vertices[:, 0]) == pytest.approx(8.0, abs=1e-3)


def test_scale_of_a_level_or_of_a_reader_that_takes_none_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"villa_L1: up, units, .* and wall_layers are of a whole file; .* \[villa\]"):
        correct_input(VILLA, {"villa_L1": Override(scale=20.0)})
    with pytest.raises(ConfigError, match="0a1b: its reader, suncg, takes no drop_nodes"):
        correct_input(SCENE, {"0a1b": Override(drop_nodes=("Lamp",))})


def test_a_door_and_no_room_are_said_in_the_source_s_plan_axes() -> None:
    given = Override(door=(((10.0, -3.0), (10.0, -4.0)),), no_room=((12.0, -7.0),))
    y_up = Frame(((1.0, 0.0, 9.0), (0.0, -1.0, -2.0)), "y", 0.0, 0)  # X = x + 9, Z = -y - 2
    found = correct_level(level(y_up), LevelOverride(given, {}))
    assert found.corrections == given.corrections
    assert not found.openings  # nothing of it is an input of the search
    places = [plan_points_from_source(found.frame, np.array(each.points)).tolist() for each in found.corrections]
    assert places == [[[1.0, 1.0], [1.0, 2.0]], [[3.0, 5.0]]]


def test_a_scale_model_becomes_a_house_of_true_size(tmp_path: Path) -> None:
    path = one_room(tmp_path / "toy.ply")
    trimesh.load(path).apply_scale(1 / 20).export(path)
    (item,) = find(str(path))
    item = correct_input(item, {item.id: Override(scale=20.0)})
    (found,) = reader("mesh_file").read(item)
    assert np.ptp(found.walls.vertices, axis=0) == pytest.approx((5.4, 4.4, 2.7), abs=1e-3)
    assert found.provenance["scale"] == 20.0


def test_nodes_are_dropped_with_all_that_is_in_them_and_no_others(tmp_path: Path) -> None:
    scene = trimesh.Scene(trimesh.load(one_room(tmp_path / "shell.ply")), base_frame="world")
    scene.graph.update("Gizmos", "world")
    for name, parent, x in (("Blip", "Gizmos", 1.0), ("Gizmo_2", "world", 2.0), ("Quux", "world", 3.0)):
        matrix = trimesh.transformations.translation_matrix((x, 2.0, 0.5))
        scene.add_geometry(trimesh.creation.box((0.1, 0.1, 1)), name, f"{name}_mesh", parent, transform=matrix)
    scene.apply_transform(trimesh.transformations.rotation_matrix(-np.pi / 2, (1, 0, 0)))
    scene.export(tmp_path / "villa.glb")
    (item,) = find(str(tmp_path / "villa.glb"))

    def faces(*patterns: str) -> int:
        (found,) = reader("mesh_file").read(correct_input(item, {item.id: Override(drop_nodes=patterns)}))
        return len(found.walls.faces)

    assert faces("Gizmos") == faces() - 12
    assert faces("Gizmo*") == faces() - 24
    assert faces("gizmo*") == faces()
    assert faces("Quux_mesh") == faces() - 12


def test_doors_and_points_under_the_id_of_a_building_are_of_its_level() -> None:
    door, point = ((1.0, 2.0), (1.0, 3.0)), (5.0, 5.0)
    words = {"villa_B2_L1": Override(door=(door,), drop=True), "villa_L1": Override(no_room=(point,))}
    assert LevelOverride.of("villa_L1", words, "").own == Override(door=(door,), no_room=(point,))
    assert LevelOverride.of("villa_L0", words, "").own == Override()
    assert LevelOverride.of("villa", {"villa_B2": Override(door=(door,))}, "").own.door == (door,)


def test_a_word_on_a_level_that_the_house_has_not_is_refused(tmp_path: Path) -> None:
    folder = tmp_path / "street"
    folder.mkdir()
    write(two_levels(), folder / "villa.ply")
    words = {
        "villa": Override(label=((0.0, 0.0, "Kitchen"),)),
        "villa_L0": Override(no_room=((0.0, 0.0),)),
        "villa_B1_L1": Override(keep=True),
        "villa_L7": Override(keep=True),
    }
    run_build([folder], tmp_path / "out", overrides=words)
    refused = [line for line in lines(tmp_path / "out" / "rejected.jsonl") if line["reason"] == "no_such_level"]
    assert [line["id"] for line in refused] == ["villa", "villa_L7"]
    assert "villa_L0, villa_L1" in refused[0]["detail"]


# A correction by hand that nothing in the house answers to is named.


def built(tmp_path: Path, corrections: str) -> str:
    (tmp_path / "corrections.toml").write_text(f"[houses_bungalow]\n{corrections}\n")
    words = ["build", str(FILE), "--overrides", str(tmp_path / "corrections.toml"), "--out", str(tmp_path / "plans")]
    done = CliRunner().invoke(make_app(), [*words, "--workers", "1"])
    assert done.exit_code == 0, done.output
    return " ".join(done.output.split())


@pytest.mark.parametrize(
    ("corrections", "said"),
    [
        ("door = [[50.0, 1.0], [50.0, 1.9]]", "houses_bungalow: door [[50.0, 1.0], [50.0, 1.9]]: it lies 41.0 m from"),
        ("no_room = [70.0, 4.7]", "no_room [70.0, 4.7]: no room is there; the nearest is 61.00 m away"),
        ('drop_nodes = ["Lamp*"]', "houses_bungalow: drop_nodes 'Lamp*': nothing in bungalow.obj has this name"),
        ("h_g = 0.4\nh_d = 1.1", "houses_bungalow: h_d: only houses in SUNCG's layout are cut at such a height"),
        ("door = [[5.1, 1.0], [5.1, 1.9]]\nno_room = [7.1, 4.7]", ""),
        ("keep = true", "houses_bungalow: keep: nothing would have left the plan out; it is not needed"),
    ],
)
def test_what_has_no_effect_is_named(tmp_path: Path, corrections: str, said: str) -> None:
    output = built(tmp_path, corrections)
    assert ("correction without effect" in output) == bool(said)
    assert said in output
    page = (tmp_path / "plans" / ".build" / "report.html").read_text()
    assert "Corrections: " in page
    assert ("<td>none" in page) == bool(said)


def test_keep_that_is_needed_is_not_named(tmp_path: Path) -> None:
    (tmp_path / "corrections.toml").write_text("[houses_bungalow]\nkeep = true\n")
    words = ["build", str(FILE), "--overrides", str(tmp_path / "corrections.toml"), "--out", str(tmp_path / "plans")]
    done = CliRunner().invoke(make_app(), [*words, "--workers", "1", "--min-quality", "0.6"])
    assert done.exit_code == 0, done.output
    assert "correction without effect" not in " ".join(done.output.split())


def test_keep_of_a_review_is_not_named(tmp_path: Path) -> None:
    DecisionStore(tmp_path / "corrections.toml").decide("houses_bungalow", "keep", "ann")
    words = ["build", str(FILE), "--overrides", str(tmp_path / "corrections.toml"), "--out", str(tmp_path / "plans")]
    done = CliRunner().invoke(make_app(), [*words, "--workers", "1"])
    assert done.exit_code == 0, done.output
    assert "correction without effect" not in " ".join(done.output.split())


# The corrections that the guide shows improve the house that it names.


OVERRIDES = FILE.parents[1] / "corrections.toml"
GUIDE = Path(__file__).resolve().parents[2] / "docs" / "guide-pipeline.md"


def built_bungalow(out: Path, *, corrected: bool) -> FloorPlan:
    overrides = load_overrides(None, OVERRIDES) if corrected else {}
    run_build([FILE], out, plan=plan_level, overrides=overrides)
    return open_dataset(out)[0]


def test_the_example_improves_the_house(tmp_path: Path) -> None:
    before, after = (
        built_bungalow(tmp_path / "before", corrected=False),
        built_bungalow(tmp_path / "after", corrected=True),
    )
    assert [door.kind for door in before.doors].count("cut") == 1
    assert len(before.rooms) == 3
    assert before.quality is not None
    assert before.quality.is_doubtful
    assert sorted((room.area for room in after.rooms), reverse=True) == pytest.approx(ROOMS_M2, abs=0.05)
    assert sorted(door.kind for door in after.doors) == ["door", "entrance", "entrance"]
    assert after.quality is not None
    assert after.quality.score > before.quality.score + 0.2
    assert [name for name, value in after.quality.grounds.items() if value] == ["guesses"]


def test_the_example_says_what_is_true_of_the_house(tmp_path: Path) -> None:
    (override,) = load_overrides(None, OVERRIDES).values()
    assert override.door == (BEDROOM_DOOR,)
    assert override.no_room == (PATIO,)
    assert write_bungalow(tmp_path / "bungalow.obj").read_bytes() == FILE.read_bytes()


def test_the_guide_shows_the_example_as_it_is() -> None:
    assert f"```toml\n{OVERRIDES.read_text()}```" in GUIDE.read_text()


def test_the_guide_has_each_key_with_an_example_that_is_read(tmp_path: Path) -> None:
    table = GUIDE.read_text().partition("| key | of | meaning |")[2].partition("\n\n")[0]
    examples = dict(re.findall(r"^\| `(\w+) = (.+?)` \| a (?:storey|file) \| .+ \|$", table, re.MULTILINE))
    assert set(examples) == {field.name for field in fields(Override)} - {"authors"}  # of the log, not of the file
    for key, value in examples.items():
        (tmp_path / "mine.toml").write_text(f"[villa]\n{key} = {value}\n")
        (override,) = load_overrides(None, tmp_path / "mine.toml").values()
        assert override != Override(), key
    words = re.findall(
        r"`(\w+)`", GUIDE.read_text().partition("Words are applied in this order: ")[2].partition(".")[0]
    )
    assert words == list(WORDS)


# In robots' maps, the counts, the confidences and the quality are those of the corrected plan.


def level_of(folder: Path) -> Level:
    """Two rooms and a third one behind a door, the far end of which nobody saw."""
    shades = np.hstack([two_rooms(), np.full((80, 80), UNSEEN, np.uint8)])
    shades[8:72, 156:220] = WALL
    shades[10:70, 158:220] = FREE
    shades[32:50, 154:158] = FREE
    (item,) = find(str(saved(folder, shades)))
    (level,) = reader("occupancy_map").read(item)
    assert isinstance(level, Level)
    return level


def planned(level: Level, said: Override = Override()) -> FloorPlan:  # noqa: B008  # frozen
    corrected = replace(level, corrections=said.corrections)
    return plan_largest_building(corrected, PipelineConfig(), level_rng(level, 0))


def test_the_signs_of_a_map_follow_the_corrected_rooms(tmp_path: Path) -> None:
    level = level_of(tmp_path)
    before = planned(level)
    assert before.quality is not None
    assert before.quality.grounds["half_seen_rooms"] > 0
    fan = max(before.rooms, key=lambda room: float(room.polygon.centroid.x))
    place = source_points_from_plan(before.frame, [fan.polygon.representative_point().coords[0]])[0]
    after = planned(level, Override(no_room=place.tolist()))
    assert len(after.rooms) == len(before.rooms) - 1
    assert after.room_num == before.room_num - 1
    assert after.quality is not None
    assert after.quality.grounds["half_seen_rooms"] == 0
    assert after.quality.grounds["beyond_rooms"] > before.quality.grounds["beyond_rooms"]
    assert (after.provenance or {})["corrections"][0]["outcome"] == "done"


def test_a_name_or_a_word_without_effect_changes_no_sign(tmp_path: Path) -> None:
    level = level_of(tmp_path)
    before = planned(level)
    assert before.quality is not None
    place = source_points_from_plan(before.frame, [before.rooms[0].polygon.representative_point().coords[0]])[0]
    for said in (Override(label=[*place.tolist(), "Kitchen"]), Override(door=[[500, 1], [500, 2]])):  # type: ignore[arg-type]
        after = planned(level, said)
        assert after.quality == before.quality


def test_what_a_person_says_of_a_map_is_certain(tmp_path: Path) -> None:
    level = level_of(tmp_path)
    before = planned(level)
    door = before.doors[0]
    ends = source_points_from_plan(before.frame, door.segment)
    moved = (ends + np.array([0.0, 1.1])).tolist()
    after = planned(level, Override(door=moved))
    new = [each for each in after.doors if each.confidence == 1.0]
    assert [each.kind for each in new] == ["door"]
    assert new[0].width == pytest.approx(door.width, abs=0.15)
    told = planned(level, Override(room=[2.5, 2.0])).rooms
    assert sorted(room.confidence == 1.0 for room in told) == [False, False, True]
