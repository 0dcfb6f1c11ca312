import json
from pathlib import Path

import pytest

from pipeline.sources import mesh_file
from pipeline.values import Input, Level

DATA = Path(__file__).resolve().parents[4] / "shared" / "data"
CASES = [
    path for path in sorted((DATA / "cases").glob("*.json")) if '.ifc",' not in path.read_text().split('"mesh"')[1][:80]
]
INCHES = {"osrf_cafe"}  # its truth counts in the file's inches
COVERED = {"smiley_west_0", "smiley_west_0_leaves"}  # the truth counts from the storey, the floor lies 0.18 m above it
FLOORS = {truth["mesh"]: truth["floor_z"] for truth in (json.loads(path.read_text()) for path in CASES)}
ONE_LEVEL = ("ifc/*/*.ply", "sweethome3d/*/*.ply", "procthor/*/*.ply", "gazebo/*/*.ply")
MESHES = sorted(path for pattern in ONE_LEVEL for path in DATA.glob(pattern))

pytestmark = pytest.mark.skipif(not CASES, reason="needs the development data beside the repository")


def levels_of(path: Path) -> list[Level]:
    return list(mesh_file.read(Input("case", "mesh_file", str(path))))


@pytest.mark.parametrize("case", CASES, ids=lambda path: path.stem)
def test_a_level_lies_at_the_cases_floor(case):
    truth = json.loads(case.read_text())
    levels = levels_of(DATA / truth["mesh"])
    floor = truth["floor_z"] * (0.0254 if case.stem in INCHES else 1.0)
    assert min(abs(level.frame.floor - floor) for level in levels) < (0.2 if case.stem in COVERED else 0.05)


@pytest.mark.parametrize("path", MESHES, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_each_mesh_is_one_level_as_high_as_a_storey(path):
    (level,) = levels_of(path)
    raised = 0.2 if "smiley" in path.parent.name else 0.05
    assert abs(level.frame.floor - FLOORS.get(path.relative_to(DATA).as_posix(), 0.0)) < raised
    assert 2.3 < level.ceiling_m < 5.1
    assert (level.provenance["units"], level.frame.up) == ("m", "z")
