from pathlib import Path

import numpy as np
import pytest

from pipeline.rejection import Rejection
from pipeline.sources.meshes.collada import load
from pipeline.sources.meshes.scene import Piece

GEOMETRY = """
<geometry id="g" name="Panel"><mesh>
  <source id="p"><float_array id="a" count="12">0 0 0 2 0 0 2 3 0 0 3 0</float_array>
    <technique_common><accessor source="#a" count="4" stride="3"/></technique_common></source>
  <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
  {primitive}
</mesh></geometry>"""
INPUT = '<input semantic="VERTEX" source="#v" offset="0"/>'
POLYLIST = f'<polylist material="m" count="1">{INPUT}<vcount>4</vcount><p>0 1 2 3</p></polylist>'
PLAIN = '<node name="Wall"><instance_geometry url="#g"/></node>'


def write(path: Path, nodes: str = PLAIN, primitive: str = POLYLIST, more: str = "") -> list[Piece]:
    path.write_text(
        '<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">'
        f"<asset/>{more}<library_geometries>{GEOMETRY.format(primitive=primitive)}</library_geometries>"
        f'<library_visual_scenes><visual_scene id="s">{nodes}</visual_scene></library_visual_scenes>'
        '<scene><instance_visual_scene url="#s"/></scene></COLLADA>'
    )
    return list(load(path, 1000))


def area(piece: Piece) -> float:
    corners = piece.vertices[piece.faces]
    return float(
        np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    )


@pytest.mark.parametrize(
    "primitive",
    [
        POLYLIST,
        f'<triangles count="2">{INPUT}<p>0 1 2 0 2 3</p></triangles>',
        f'<polygons count="1">{INPUT}<p>0 1 2 3</p></polygons>',
        f'<trifans count="1">{INPUT}<p>0 1 2 3</p></trifans>',
        f'<tristrips count="1">{INPUT}<p>1 2 0 3</p></tristrips>',
    ],
)
def test_every_kind_of_surface(tmp_path, primitive):
    (piece,) = write(tmp_path / "house.dae", primitive=primitive)
    assert area(piece) == pytest.approx(6.0)


def test_names_and_nested_transforms(tmp_path):
    inner = "<translate>1 0 0</translate><rotate>0 0 1 90</rotate><scale>2 1 1</scale>"
    door = f'<node name="Door_1">{inner}<instance_geometry url="#g"/></node>'
    nodes = f'<node name="House"><translate>0 0 5</translate>{door}</node>'
    (piece,) = write(tmp_path / "house.dae", nodes)
    assert piece.part.groups == ("House", "Door_1")
    assert piece.part.mesh == "Panel"
    assert piece.vertices[1] == pytest.approx((1.0, 4.0, 5.0))  # (2, 0, 0) scaled, turned, moved, in this order


def test_a_material_is_called_by_its_name(tmp_path):
    library = (
        '<library_materials><material id="m1" name="Glass"><instance_effect url="#e"/></material></library_materials>'
    )
    symbol = '<instance_material symbol="m" target="#m1"/>'
    bound = f"<bind_material><technique_common>{symbol}</technique_common></bind_material>"
    nodes = f'<node name="Wall"><instance_geometry url="#g">{bound}</instance_geometry></node>'
    (piece,) = write(tmp_path / "house.dae", nodes, more=library)
    assert piece.part.material == "Glass"


def test_odd_effects_and_missing_pictures_do_no_harm(tmp_path):
    effect = '<effect id="e"><profile_X><technique/></profile_X></effect>'
    odd = f"<library_effects>{effect}</library_effects><library_images/>"
    assert len(write(tmp_path / "house.dae", more=odd)) == 1


def test_an_instance_of_another_files_node_is_passed_over(tmp_path):
    nodes = PLAIN + '<node name="Far"><instance_geometry url="../far.dae#g"/><instance_node url="far.dae#n"/></node>'
    assert len(write(tmp_path / "house.dae", nodes)) == 1


@pytest.mark.parametrize(
    "primitive",
    [
        POLYLIST.replace("0 1 2 3", "0 1 2 9"),
        POLYLIST.replace("<vcount>4", "<vcount>5"),
        "<triangles><p>0</p></triangles>",
    ],
)
def test_broken_indices(tmp_path, primitive):
    with pytest.raises((ValueError, LookupError)):
        write(tmp_path / "house.dae", primitive=primitive)


def test_a_node_within_itself_ends(tmp_path):
    nodes = '<node id="n" name="n"><instance_node url="#n"/></node>'
    with pytest.raises(ValueError, match="nested"):
        write(tmp_path / "house.dae", nodes)


def test_more_faces_than_may_be(tmp_path):
    nodes = PLAIN * 600
    with pytest.raises(Rejection, match="more than 1,000 faces"):
        write(tmp_path / "house.dae", nodes)


def test_an_id_that_a_node_and_a_geometry_share_hides_neither(tmp_path: Path) -> None:
    node = '<node id="g" name="Wall"><instance_geometry url="#g"/></node>'
    (piece,) = write(tmp_path / "a.dae", node)
    assert area(piece) == pytest.approx(6.0)


def test_a_source_of_an_id_that_another_mesh_has_too_is_the_meshs_own(tmp_path: Path) -> None:
    other = GEOMETRY.replace('id="g"', 'id="h"').replace("2 0 0 2 3 0 0 3 0", "1 0 0 1 1 0 0 1 0")
    nodes = PLAIN + '<node name="Small"><instance_geometry url="#h"/></node>'
    more = f"<library_geometries>{other.format(primitive=POLYLIST)}</library_geometries>"
    pieces = write(tmp_path / "a.dae", nodes, more=more)
    assert sorted(map(area, pieces)) == pytest.approx([1.0, 6.0])
