"""The readers of COLLADA, glTF and OBJ, and the triangles of polygons."""

import base64
import json
from pathlib import Path

import DracoPy
import numpy as np
import pytest
import trimesh

from pipeline.rejection import Reason, Rejection
from pipeline.sources.meshes.collada import load
from pipeline.sources.meshes.formats import load_scene
from pipeline.sources.meshes.gltf import read_json_and_binary
from pipeline.sources.meshes.scene import NamedPiece, PartNames, triangulate_polygons
from tests.builders.formats.meshopt import TriangleEncoder, encode_attributes
from tests.builders.meshes import one_level, y_up

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


def write(path: Path, nodes: str = PLAIN, primitive: str = POLYLIST, more: str = "") -> list[NamedPiece]:
    path.write_text(
        '<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">'
        f"<asset/>{more}<library_geometries>{GEOMETRY.format(primitive=primitive)}</library_geometries>"
        f'<library_visual_scenes><visual_scene id="s">{nodes}</visual_scene></library_visual_scenes>'
        '<scene><instance_visual_scene url="#s"/></scene></COLLADA>'
    )
    return list(load(path, 1000))


def area(piece: NamedPiece) -> float:
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


MESH = y_up(one_level())


def views(*blobs: bytes) -> tuple[str, list[dict[str, int]]]:
    """Return a data URI of the blobs, each on a multiple of 4 bytes, and their buffer views."""
    data, found = b"", []
    for blob in blobs:
        data += b"\0" * (-len(data) % 4)
        found.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(blob)})
        data += blob
    return "data:application/octet-stream;base64," + base64.b64encode(data).decode(), found


def write_gltf(path: Path, accessors: list[dict], blobs: list[bytes], node: dict | None = None, **more: object) -> Path:
    uri, found = views(*blobs)
    primitive = {"attributes": {"POSITION": 0}, "indices": 1, **more.pop("primitive", {})}
    tree = {
        "asset": {"version": "2.0"},
        "nodes": [{"mesh": 0, "name": "House", **(node or {})}],
        "meshes": [{"primitives": [primitive]}],
        "accessors": accessors,
        "bufferViews": found,
        "buffers": [{"uri": uri}],
        **more,
    }
    path.write_text(json.dumps(tree))
    return path


INDICES = MESH.faces.astype("<u4").tobytes()
INDEX = {"bufferView": 1, "componentType": 5125, "count": MESH.faces.size, "type": "SCALAR"}
FLOATS = {"bufferView": 0, "componentType": 5126, "count": len(MESH.vertices), "type": "VEC3"}


def test_floats(tmp_path):
    path = write_gltf(tmp_path / "house.gltf", [FLOATS, INDEX], [MESH.vertices.astype("<f4").tobytes(), INDICES])
    scene = load_scene(path)
    assert scene.mesh.vertices == pytest.approx(MESH.vertices, abs=1e-6)
    assert np.array_equal(scene.mesh.faces, MESH.faces)
    assert scene.parts[0].groups == ("House",)


def test_quantised_positions_are_scaled_by_their_node(tmp_path):
    low, size = MESH.vertices.min(axis=0), float(np.ptp(MESH.vertices, axis=0).max())
    whole = np.round((MESH.vertices - low) / size * 65535).astype("<u2")
    rows = np.column_stack([whole, np.zeros(len(whole), "<u2")]).astype("<u2")  # padded to 8 bytes
    accessor = {**FLOATS, "componentType": 5123, "normalized": True}
    node = {"scale": [size] * 3, "translation": low.tolist()}
    path = write_gltf(tmp_path / "house.gltf", [accessor, INDEX], [rows.tobytes(), INDICES], node)
    tree = json.loads(path.read_text())
    tree["bufferViews"][0]["byteStride"] = 8
    tree["extensionsRequired"] = ["KHR_mesh_quantization"]
    path.write_text(json.dumps(tree))
    assert load_scene(path).mesh.vertices == pytest.approx(MESH.vertices, abs=2 * size / 65535)


def test_sparse_positions_replace_those_below(tmp_path):
    moved = MESH.vertices.copy()
    moved[3] += 9.0
    sparse = {
        "count": 1,
        "indices": {"bufferView": 2, "componentType": 5123},
        "values": {"bufferView": 3},
    }
    blobs = [moved.astype("<f4").tobytes(), INDICES, np.array([3], "<u2").tobytes()]
    blobs.append(MESH.vertices[3].astype("<f4").tobytes())
    path = write_gltf(tmp_path / "house.gltf", [{**FLOATS, "sparse": sparse}, INDEX], blobs)
    assert load_scene(path).mesh.vertices == pytest.approx(MESH.vertices, abs=1e-6)


def test_draco(tmp_path):
    packed = DracoPy.encode(MESH.vertices, MESH.faces, quantization_bits=16)
    extension = {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}}
    bare = [{key: value for key, value in each.items() if key != "bufferView"} for each in (FLOATS, INDEX)]
    more = {"primitive": {"extensions": extension}, "extensionsRequired": ["KHR_draco_mesh_compression"]}
    scene = load_scene(write_gltf(tmp_path / "house.gltf", bare, [packed], **more))
    assert scene.mesh.vertices.min(axis=0) == pytest.approx(MESH.vertices.min(axis=0), abs=1e-3)
    assert scene.mesh.vertices.max(axis=0) == pytest.approx(MESH.vertices.max(axis=0), abs=1e-3)


def test_meshopt(tmp_path):
    """Positions are quantised by the node's scale, as gltfpack does it, and lie in compressed views."""
    low, size = MESH.vertices.min(axis=0), float(np.ptp(MESH.vertices, axis=0).max())
    whole = np.zeros((len(MESH.vertices), 4), "<u2")
    whole[:, :3] = np.round((MESH.vertices - low) / size * 65535)
    packed = [encode_attributes(whole.view(np.uint8).reshape(-1, 8)), TriangleEncoder(1).write(MESH.faces)]
    views = [{"mode": "ATTRIBUTES", "byteStride": 8, "count": len(whole)}]
    views.append({"mode": "TRIANGLES", "byteStride": 4, "count": 3 * len(MESH.faces)})
    positions = {"bufferView": 0, "componentType": 5123, "count": len(whole), "type": "VEC3", "normalized": True}
    path = write_gltf(tmp_path / "house.gltf", [positions, INDEX], packed)
    tree = json.loads(path.read_text())
    for view, extension in zip(tree["bufferViews"], views, strict=True):
        own = {key: view[key] for key in ("buffer", "byteOffset", "byteLength")}
        view["extensions"] = {"EXT_meshopt_compression": {**own, **extension}}
        view |= {"buffer": 1, "byteOffset": 0, "byteLength": extension["count"] * extension["byteStride"]}
        view["byteStride"] = extension["byteStride"]
    tree["bufferViews"][1].pop("byteStride")
    tree["buffers"].append({"byteLength": 10**6, "extensions": {"EXT_meshopt_compression": {"fallback": True}}})
    tree["extensionsRequired"] = ["EXT_meshopt_compression", "KHR_mesh_quantization"]
    tree["nodes"][0] |= {"scale": [size] * 3, "translation": low.tolist()}
    path.write_text(json.dumps(tree))
    scene = load_scene(path)
    assert scene.mesh.vertices.min(axis=0) == pytest.approx(low, abs=1e-3)
    corners = np.sort(scene.mesh.vertices[scene.mesh.faces].reshape(-1, 9), axis=1)
    assert corners == pytest.approx(np.sort(MESH.vertices[MESH.faces].reshape(-1, 9), axis=1), abs=1e-3)


def test_newer_meshopt_is_refused_as_what_it_is(tmp_path):
    name = "KHR_meshopt_compression"
    blobs = [MESH.vertices.astype("<f4").tobytes(), INDICES]
    path = write_gltf(tmp_path / "house.gltf", [FLOATS, INDEX], blobs, extensionsRequired=[name])
    with pytest.raises(Rejection, match=name) as caught:
        load_scene(path)
    assert caught.value.reason is Reason.UNREADABLE
    assert "gltfpack -noq -kn -km -i house.gltf" in caught.value.advice


def test_textures_that_need_ktx2_are_not_opened(tmp_path):
    """As gltfpack -tc writes them: the picture is required, and named by an extension alone."""
    blobs = [MESH.vertices.astype("<f4").tobytes(), INDICES]
    more = {
        "images": [{"uri": "wall.ktx2", "mimeType": "image/ktx2"}],
        "textures": [{"extensions": {"KHR_texture_basisu": {"source": 0}}}],
        "materials": [{"name": "wall", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "extensionsRequired": ["KHR_texture_basisu"],
    }
    scene = load_scene(write_gltf(tmp_path / "house.gltf", [FLOATS, INDEX], blobs, **more))
    assert scene.mesh.vertices == pytest.approx(MESH.vertices, abs=1e-6)


@pytest.mark.parametrize("uri", ["../outside.bin", "http://localhost/x.bin", "%2e%2e/outside.bin", "/etc/hostname"])
def test_a_buffer_outside_of_the_folder_is_not_opened(tmp_path, uri):
    (tmp_path / "outside.bin").write_bytes(bytes(100_000))
    folder = tmp_path / "house"
    folder.mkdir()
    path = write_gltf(folder / "house.gltf", [FLOATS, INDEX], [b"", INDICES])
    tree = json.loads(path.read_text())
    tree["buffers"][0]["uri"] = uri
    path.write_text(json.dumps(tree))
    with pytest.raises(Rejection, match="not in its folder") as caught:
        load_scene(path)
    assert str(tmp_path) not in str(caught.value)


def test_a_node_that_is_its_own_ancestor(tmp_path):
    blobs = [MESH.vertices.astype("<f4").tobytes(), INDICES]
    path = write_gltf(tmp_path / "house.gltf", [FLOATS, INDEX], blobs, {"children": [0]}, scenes=[{"nodes": [0]}])
    with pytest.raises(Rejection, match="its own ancestor"):
        load_scene(path)


SQUARE = "v 0 0 0\nv 2 0 0\nv 2 3 0\nv 0 3 0\n"


def load_obj(tmp_path, text):
    path = tmp_path / "house.obj"
    path.write_text(text)
    return load_scene(path)


def test_groups_and_materials_are_parts(tmp_path):
    scene = load_obj(
        tmp_path,
        SQUARE + "o House\ng Wall\nusemtl paint\nf 1 2 3\nusemtl door\nf 1 3 4\ng Wall\nusemtl paint\nf 1 2 4\n",
    )
    assert scene.parts == (PartNames(("House", "Wall"), "", "paint"), PartNames(("House", "Wall"), "", "door"))
    assert scene.owner.tolist() == [0, 0, 1]


def test_a_group_ends_where_an_object_begins(tmp_path):
    scene = load_obj(tmp_path, SQUARE + "g Plant\nf 1 2 3\no Wall\nf 1 3 4\n")
    assert scene.parts == (PartNames(("Plant",), "", ""), PartNames(("Wall",), "", ""))


def test_an_object_with_faces_of_its_own_ends_where_a_group_begins(tmp_path):
    scene = load_obj(tmp_path, SQUARE + "o Wardrobe\nusemtl oak\nf 1 2 3\ng Shell_44\nf 1 3 4\n")
    assert scene.parts == (PartNames(("Wardrobe",), "", "oak"), PartNames(("Shell_44",), "", "oak"))


@pytest.mark.parametrize("face", ["f 1/1/1 2//2 3/3 4", "f -4 -3 -2 -1", "f 1 2 3 4 # a comment", "f 1 2 \\\n3 4"])
def test_every_way_to_write_a_face(tmp_path, face):
    scene = load_obj(tmp_path, SQUARE + face + "\n")
    corners = scene.mesh.vertices[scene.mesh.faces]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    assert areas.tolist() == pytest.approx([3.0, 3.0])


def test_colours_and_weights_are_dropped(tmp_path):
    scene = load_obj(tmp_path, "v 0 0 0 1 0 0\nv 2 0 0 1 0 0\nv 2 3 0 1 0 0\nf 1 2 3\n")
    assert scene.mesh.vertices.tolist() == [[0, 0, 0], [2, 0, 0], [2, 3, 0]]


@pytest.mark.parametrize("broken", ["f 1 2 x", "f 1 2 9", "f 0 1 2", "f -9 1 2", "v 1 2\nf 1 2 3", "v a b c\nf 1 2 3"])
def test_broken_lines_are_rejected(tmp_path, broken):
    with pytest.raises(Rejection) as caught:
        load_obj(tmp_path, SQUARE + broken + "\n")
    assert caught.value.reason is Reason.UNREADABLE


NOTCHED = np.array([(0, 0), (1, 0), (1, 2), (2, 2), (2, 0), (4, 0), (4, 3), (0, 3)], float)  # a wall with its door hole


@pytest.mark.parametrize("axes", [(0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (1, 0, 2), (2, 1, 0)])
@pytest.mark.parametrize("way", [1, -1])
def test_a_notch_stays_open_and_the_winding_is_kept(axes, way):
    ring = np.column_stack([NOTCHED, np.zeros(8)])[::way][:, axes]
    faces, owner = triangulate_polygons(ring, np.arange(8), np.array([8]))
    mesh = trimesh.Trimesh(ring, faces, process=False)
    normal = np.cross(ring - ring[0], np.roll(ring, -1, axis=0) - ring[0]).sum(axis=0)
    assert mesh.area == pytest.approx(10.0)
    assert ((mesh.face_normals @ normal) > 0).all()
    assert set(owner) == {0}


def test_polygons_of_several_sizes_keep_their_order():
    ring = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
    faces, owner = triangulate_polygons(ring, np.array([0, 1, 2, 0, 1, 2, 3, 1, 0]), np.array([3, 4, 2]))
    assert faces.tolist() == [[0, 1, 2], [0, 1, 2], [0, 2, 3]]
    assert owner.tolist() == [0, 1, 1]


def test_a_binary_gltf_is_known_by_its_bytes_whatever_it_is_called(tmp_path):
    box = trimesh.creation.box((4.0, 2.5, 3.0))
    (tmp_path / "house.gltf").write_bytes(box.export(file_type="glb"))
    tree, binary = read_json_and_binary(tmp_path / "house.gltf")
    assert tree["meshes"]
    assert len(binary) > 100
    (tmp_path / "house.glb").write_bytes(json.dumps({"asset": {"version": "2.0"}}).encode())
    assert read_json_and_binary(tmp_path / "house.glb") == ({"asset": {"version": "2.0"}}, b"")
