"""Journey 3: an artist's GLB with its unit -> a doubtful plan -> corrected in the review -> the same bytes later.

The house is the bungalow of docs/guide-pipeline.md as a GLB in centimetres: its bedroom's door is modelled shut, and
its patio looks like a room. The corrections are those of that page.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
import trimesh

from houseexpo import open_dataset
from houseexpo.grids.frame import plan_points_from_source
from tests.builders.bungalow import BEDROOM_DOOR, FILE, PATIO, ROOMS_M2
from tests.builders.commands import call
from tests.journeys.reviews import reviewing


def build(source: str, out: str, *more: str) -> None:
    words = ["build", source, "--units", "cm", "--up", "y", "--out", out, "--workers", "1", *more]
    call(*words)


@pytest.mark.slow
def test_an_artists_house_is_corrected_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("art").mkdir()
    scene = trimesh.load(FILE, split_object=True, group_material=False)
    scene.apply_transform(trimesh.transformations.scale_matrix(100.0))
    scene.apply_transform(trimesh.transformations.rotation_matrix(-np.pi / 2, (1, 0, 0)))  # y up, as glTF is
    scene.export("art/bungalow.glb")
    build("art", "plans/art")
    [name] = open_dataset("plans/art").ids
    before = open_dataset("plans/art")[name]
    assert before.quality is not None
    assert before.quality.is_doubtful
    assert before.frame is not None
    assert before.frame.up == "y"
    flip = np.array([1.0, -1.0])  # the source's plan axes are (X, Z)
    door = plan_points_from_source(before.frame, np.array(BEDROOM_DOOR) * flip).tolist()
    patio = plan_points_from_source(before.frame, np.array([PATIO]) * flip).tolist()

    with reviewing(Path("plans/art")) as ann:
        assert ann.say(name, "door", points=door)["effect"]["outcome"] == "done"
        assert ann.say(name, "no_room", points=patio)["effect"]["outcome"] == "done"
        living = max(before.rooms, key=lambda room: room.area).polygon.representative_point().coords[0]
        assert ann.say(name, "label", points=[living], text="Living_Room")["effect"]["outcome"] == "done"
        [outcome] = ann.build()["outcomes"]
        assert (outcome["became"], outcome["idle"]) == ("changed", [])
        assert [said.split()[0] for said in outcome["effects"][:3]] == ["door", "no_room", "label"]

    after = open_dataset("plans/art")[name]
    assert sorted((room.area for room in after.rooms), reverse=True) == pytest.approx(ROOMS_M2, abs=0.05)
    assert {room.label for room in after.rooms} == {"Living_Room", "Unlabelled"}
    assert after.quality is not None
    assert after.quality.score > before.quality.score + 0.2

    # Next month: a new folder, the same decisions, and who made them. One house: they hold for the file alone, too.
    shutil.copy("plans/art/overrides.toml", "decisions.toml")
    shutil.copy("plans/art/overrides.log.jsonl", "decisions.log.jsonl")
    build("art", "plans/later", "--overrides", "decisions.toml")
    assert open_dataset("plans/later").raw(name) == open_dataset("plans/art").raw(name)
    build("art/bungalow.glb", "plans/alone", "--overrides", "decisions.toml")
    [alone] = open_dataset("plans/alone")
    assert alone.rooms == after.rooms
