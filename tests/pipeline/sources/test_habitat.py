"""Habitat scenes: the stage is found by its name or its configuration, inside the data set, and read as a mesh."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh

from pipeline.rejection import Reason
from tests.builders.batch import plans_of
from tests.builders.damage import rejected
from tests.builders.houses import Hole, three_rooms
from tests.builders.meshes import joined


@pytest.fixture(scope="module")
def house(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A house of three rooms as .glb, with y up as the format has it."""
    mesh = joined(three_rooms([Hole(1.0, 1.9)], [Hole(1.0, 1.9)]))
    walls = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    walls.apply_transform(trimesh.transformations.rotation_matrix(-np.pi / 2, (1, 0, 0)))
    return bytes(walls.export(file_type="glb"))


def data_set(folder: Path, template: str, *, objects: int = 0) -> Path:
    """A scene in the folder ``scenes`` that names this stage."""
    scene = folder / "scenes" / "a.scene_instance.json"
    scene.parent.mkdir(parents=True, exist_ok=True)
    sofa = {"template_name": "sofa", "translation": [0, 0, 0], "rotation": [1, 0, 0, 0], "motion_type": "STATIC"}
    document = {"stage_instance": {"template_name": template}, "object_instances": [sofa] * objects}
    scene.write_text(json.dumps(document))
    return scene


def test_the_stage_of_a_scene_gives_the_plan_of_its_mesh(tmp_path: Path, house: bytes) -> None:
    stages = tmp_path / "stages"
    stages.mkdir()
    (stages / "a.glb").write_bytes(house)
    of_mesh = plans_of(stages / "a.glb")
    plans = plans_of(data_set(tmp_path, "stages/a", objects=3))
    assert [len(plan.rooms) for plan in plans] == [len(plan.rooms) for plan in of_mesh]
    assert (plans[0].verts == of_mesh[0].verts).all()
    assert plans[0].provenance is not None
    assert plans[0].provenance["source"] == "habitat"
    assert plans[0].provenance["stage"] == "a.glb"
    assert "3 objects" in plans[0].provenance["left_out"]


def test_a_configuration_names_the_mesh_and_its_axis(tmp_path: Path, house: bytes) -> None:
    configs = tmp_path / "configs" / "stages"
    configs.mkdir(parents=True)
    (tmp_path / "stages").mkdir()
    (tmp_path / "stages" / "flat.glb").write_bytes(house)
    said = {"render_asset": "../../stages/flat.glb", "up": [0, 1, 0], "front": [0, 0, -1]}
    (configs / "flat_stage.stage_config.json").write_text(json.dumps(said))
    (plan, *_) = plans_of(data_set(tmp_path, "flat_stage"))
    assert plan.frame is not None
    assert plan.frame.up == "y"


@pytest.mark.parametrize("template", ["stages/none", "", "../../../../etc/passwd", "a\0b"])
def test_a_stage_that_is_not_there_is_named(tmp_path: Path, template: str) -> None:
    fault = rejected(data_set(tmp_path, template))
    assert fault.reason is Reason.MISSING_FILE
    assert "is not in its folder" in fault.detail


def test_a_damaged_scene_is_refused(tmp_path: Path) -> None:
    scene = data_set(tmp_path, "a")
    scene.write_text('{"stage_instance": 3}')
    assert rejected(scene).reason is Reason.UNREADABLE
