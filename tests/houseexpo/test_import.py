from __future__ import annotations

import importlib
import json
import subprocess
import sys

import pytest

import houseexpo
from tests.builders.needs import need

HEAVY = {"numba", "gymnasium", "trimesh", "matplotlib", "pyarrow", "cv2", "networkx", "shapely", "scipy", "PIL"}


def modules_after(code: str) -> set[str]:
    script = f"{code}\nimport sys, json; print(json.dumps([m for m in sys.modules if '.' not in m]))"
    found = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    return set(json.loads(found.stdout))


@pytest.mark.parametrize(
    "code", ["import houseexpo", "from houseexpo import FloorPlan, load_plan, GridFrame, free_mask"]
)
def test_importing_pulls_in_nothing_heavy(code):
    assert not modules_after(code) & HEAVY


def test_what_every_worker_loads_leaves_out_what_few_houses_need():
    found = modules_after("import pipeline.algorithm, pipeline.batch.planning")
    assert not found & {"scipy", "numba", "matplotlib", "pandas"}


DOCUMENTED = {
    "houseexpo": [
        *("LABELS", "UNLABELLED", "canonical", "Dataset", "open_dataset", "contact_sheet", "draw_plan", "svg"),
        *("ConfigError", "DatasetError", "HouseExpoError", "MissingDependencyError", "PlanError", "TrainingError"),
        *("UnknownPlanError", "WorkerError"),
        *("fetch", "load_plan", "save_plan", "GridFrame", "navigability", "rooms_graph", "with_rooms", "Door"),
        *("FloorPlan", "Frame", "Navigability", "PlanObject", "Quality", "Room", "decode", "encode", "door_ids"),
        *("free_mask", "room_ids", "Repair", "find_duplicates", "build", "export"),
        *("Correction", "Override", "predict_map", "PredictedMap"),
    ],
    "houseexpo.exports": ["export"],
    "houseexpo.torch": ["PlanDataset"],
    "houseexpo.pseudoslam": ["NoiseConfig", "PeopleConfig", "Simulator", "SimulatorConfig"],
    "houseexpo.pseudoslam.sb3": ["SB3VecEnv"],
}
"""What README and guides name: it stays where it is, whatever moves inside."""


@pytest.mark.parametrize("module", DOCUMENTED)
def test_what_the_documents_name_stays(module):
    if module.endswith("sb3"):
        need(modules=["stable_baselines3"], how="make learn")
    found = importlib.import_module(module)
    for name in DOCUMENTED[module]:
        assert getattr(found, name) is not None


def test_tab_completion_offers_what_users_call():
    assert set(dir(houseexpo)) == set(DOCUMENTED["houseexpo"])


def test_every_public_name_is_there():
    for name in houseexpo.__all__:
        assert getattr(houseexpo, name) is not None
    assert set(houseexpo.__all__) <= set(dir(houseexpo))
    with pytest.raises(AttributeError, match="FloorPlans"):
        _ = houseexpo.FloorPlans
