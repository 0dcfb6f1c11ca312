import re
from pathlib import Path

import pytest

from pipeline.rejection import Reason, Rejection

pytest.importorskip("ifcopenshell")

from pipeline.sources.ifc_model import open_model
from tests.builders.ifc import tiny_house


def written(tmp_path: Path, edition: str, schema: str) -> Path:
    """A tiny house written in an edition that ifcopenshell has, whose header names another schema."""
    path = tiny_house(edition).write(tmp_path / "house.ifc")
    path.write_text(re.sub(r"FILE_SCHEMA\(\('[^']*'\)\)", f"FILE_SCHEMA (( '{schema}' ))", path.read_text()))
    return path


@pytest.mark.parametrize(
    ("edition", "schemas"),
    [
        ("IFC2X3", ("IFC2X_FINAL", "IFC2X", "IFC2X2_FINAL", "IFC2X2", "IFC2X3_TC1", "ifc2x3")),
        ("IFC4", ("IFC4_ADD2", "IFC4_ADD2_TC1", "IFC4X1", "IFC4RC4")),
        ("IFC4X3_ADD2", ("IFC4X3", "IFC4X3_RC2", "IFC4X3_ADD1", "IFC4X3_ADD2")),
    ],
)
def test_editions_of_a_known_schema_are_read(tmp_path, edition, schemas):
    for schema in schemas:
        model, named = open_model(written(tmp_path, edition, schema))
        assert model.schema_identifier == edition
        assert named == schema.upper()
        assert (len(model.by_type("IfcWall")), len(model.by_type("IfcSpace"))) == (7, 5)


@pytest.mark.parametrize("schema", ["IFC151_FINAL", "IFC20_LONGFORM", "IFC2X4_RC2", "IFC5", "AUTOMOTIVE_DESIGN", ""])
def test_other_schemas_are_refused_by_name(tmp_path, schema):
    with pytest.raises(Rejection, match=schema or "empty") as caught:
        open_model(written(tmp_path, "IFC2X3", schema))
    assert caught.value.reason is Reason.UNREADABLE


def test_entities_that_the_schema_does_not_have_are_passed_over(tmp_path):
    path = tiny_house("IFC2X3").write(tmp_path / "house.ifc")
    path.write_text(path.read_text().replace("DATA;\n", "DATA;\n#90001=IFCUNHEARDOF('a',$,(1.,2.));\n"))
    assert len(open_model(path)[0].by_type("IfcWall")) == 7


@pytest.mark.parametrize("encoding", ["utf-8", "cp1252"])
def test_characters_beyond_ascii_are_kept(tmp_path, encoding):
    path = tiny_house("IFC2X3").write(tmp_path / "house.ifc")
    path.write_bytes(path.read_text().replace("'footing'", "'Wände (Süd)'").encode(encoding))
    assert open_model(path)[0].by_type("IfcWall")[0].Name == "Wände (Süd)"


def test_escapes_of_the_standard_are_kept_too(tmp_path):
    path = tiny_house("IFC4").write(tmp_path / "house.ifc")
    assert "Küche" not in path.read_text()
    assert open_model(path)[0].by_type("IfcSpace")[0].LongName == "Küche"


def test_a_header_without_a_schema_is_refused(tmp_path):
    path = tmp_path / "none.ifc"
    path.write_text("ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n")
    with pytest.raises(Rejection, match="FILE_SCHEMA"):
        open_model(path)
