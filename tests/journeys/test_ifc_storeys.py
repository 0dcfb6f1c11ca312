"""Journey 2: an IFC of three storeys -> plans -> a correction -> DXF, SVG and IFC, read by other libraries."""

from __future__ import annotations

import shlex
from pathlib import Path
from xml.etree import ElementTree

import pytest

from houseexpo import open_dataset
from tests.builders.commands import call
from tests.builders.formats.ifc import TinyBuilding
from tests.builders.needs import need
from tests.journeys.pages import commands

STOREYS = {"houses_office_L0": 0.0, "houses_office_L1": 3.0, "houses_office_L2": 6.0}


def write_office(file: Path) -> None:
    """Write three storeys of two rooms; on the middle one, nobody drew the door between them."""
    office = TinyBuilding()
    for number, z in enumerate(STOREYS.values()):
        storey = office.storey(f"storey {number}", z)
        office.element("IfcSlab", storey, (0, 0, z - 0.2, 8 + number, 6, z), "floor")
        outer = office.walls_around(storey, (0, 0, z, 8 + number, 6, z + 2.8))
        inner = office.element("IfcWall", storey, (4, 0.2, z, 4.2, 5.8, z + 2.8), "inner")
        office.opening(outer[0], (1, 0, z, 2, 0.2, z + 2.1), "IfcDoor")
        if number != 1:
            office.opening(inner, (4, 2, z, 4.2, 2.9, z + 2.1), "IfcDoor")
        for name, x1, x2 in (("Office", 0.2, 4.0), ("Kitchen", 4.2, 7.8 + number)):
            office.space(storey, (x1, 0.2, z, x2, 5.8, z + 2.8), f"{number}{name}", name)
    office.write(file)


@pytest.mark.slow
def test_storeys_of_an_ifc_are_corrected_and_read_by_other_libraries(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    need(modules=["ifcopenshell", "ezdxf"], how="make setup")
    import ezdxf
    import ifcopenshell

    monkeypatch.chdir(tmp_path)
    Path("houses").mkdir()
    write_office(Path("houses/office.ifc"))
    build, again, *exports = commands("docs/readers/houses.md", "office.toml", "text")

    def run(command: str) -> None:
        call(*shlex.split(command)[1:])

    run(build)
    before = open_dataset("plans/office")
    assert list(before.ids) == list(STOREYS)
    assert [len(before[name].rooms) for name in STOREYS] == [2, 2, 2]
    assert sorted(door.kind for door in before["houses_office_L1"].doors) == ["cut", "entrance"]

    Path("office.toml").write_text("[houses_office_L1]\ndoor = [[4.1, 2.0], [4.1, 2.9]]\n")
    run(again)
    after = open_dataset("plans/office")
    assert sorted(door.kind for door in after["houses_office_L1"].doors) == ["door", "entrance"]
    assert all(after[name] == before[name] for name in ("houses_office_L0", "houses_office_L2"))

    for command in exports:
        run(command)
    for name in STOREYS:
        plan = after[name]
        drawing = ezdxf.readfile(f"drawings/{name}.dxf")
        assert not drawing.audit().errors
        assert len(drawing.modelspace()) > len(plan.rooms)
        page = ElementTree.parse(f"pages/{name}.svg").getroot()  # noqa: S314 - our own file
        assert "Kitchen" in " ".join(page.itertext())
        model = ifcopenshell.open(f"models/{name}.ifc")
        assert len(model.by_type("IfcSpace")) == len(plan.rooms)
        assert len(model.by_type("IfcDoor")) == len(plan.doors)
