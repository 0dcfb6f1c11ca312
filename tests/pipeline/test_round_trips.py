"""Plan -> format -> plan, for every format that the project both writes and reads as a plan."""

from pathlib import Path

import pytest

from houseexpo.dataset import open_dataset
from houseexpo.exports import FORMATS
from pipeline.cli_build import from_python
from tests.builders.batch import labels, likeness, through

FORMS = {"dxf": "", "geojson": "", "ifc": "", "mjcf": "", "rmf": ".building.yaml", "svg": "", "usd": ""}
NEEDS = {"dxf": "ezdxf", "ifc": "ifcopenshell", "usd": "pxr"}
"""The formats, and how the name of the file ends that is read."""
QUICK, MANY = 3, 30


@pytest.fixture(scope="session")
def homes(tmp_path_factory):
    """Plans of the demo: homes that the project makes."""
    folder = tmp_path_factory.mktemp("demo") / "plans"
    from_python(
        [f"procedural:{QUICK}"], str(folder), config=None, overrides=None, workers=1, others="refuse", seed=2019
    )
    data = open_dataset(folder)
    return [data[name] for name in data.ids]


@pytest.fixture(scope="session")
def many_homes(tmp_path_factory):
    folder = tmp_path_factory.mktemp("many") / "plans"
    from_python([f"procedural:{MANY}"], str(folder), config=None, overrides=None, workers=2, others="refuse", seed=2019)
    data = open_dataset(folder)
    return [data[name] for name in data.ids]


def check(plans, form, folder: Path):
    if form in NEEDS:
        pytest.importorskip(NEEDS[form])
    for plan in plans:
        found = through(plan, form, folder / plan.id, FORMS[form])
        assert likeness(plan, found) >= 0.99, plan.id
        assert len(found.rooms) == len(plan.rooms), plan.id
        assert len(found.doors) == len(plan.doors), plan.id
        assert labels(found) == labels(plan), plan.id


@pytest.mark.parametrize("form", sorted(FORMS))
def test_a_plan_comes_back(homes, form, tmp_path):
    assert form in FORMATS
    check(homes, form, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("form", sorted(FORMS))
def test_many_plans_come_back(many_homes, form, tmp_path):
    check(many_homes, form, tmp_path)
