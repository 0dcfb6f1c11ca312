from __future__ import annotations

import json
import subprocess
import sys

import pytest

import houseexpo

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


def test_every_public_name_is_there():
    for name in houseexpo.__all__:
        assert getattr(houseexpo, name) is not None
    assert set(houseexpo.__all__) <= set(dir(houseexpo))
    with pytest.raises(AttributeError, match="no attribute 'FloorPlans'"):
        _ = houseexpo.FloorPlans
