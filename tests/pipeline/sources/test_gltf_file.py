import base64
import json
from pathlib import Path

import DracoPy
import numpy as np
import pytest

from pipeline.rejection import Reason, Rejection
from pipeline.sources.meshes.formats import load_scene
from tests.builders.meshes import one_level, y_up

MESH = y_up(one_level())


def views(*blobs: bytes) -> tuple[str, list[dict[str, int]]]:
    """Return a data URI of the blobs, each on a multiple of 4 bytes, and their buffer views."""
    data, found = b"", []
    for blob in blobs:
        data += b"\0" * (-len(data) % 4)
        found.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(blob)})
        data += blob
    return "data:application/octet-stream;base64," + base64.b64encode(data).decode(), found


def write(path: Path, accessors: list[dict], blobs: list[bytes], node: dict | None = None, **more: object) -> Path:
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
    path = write(tmp_path / "house.gltf", [FLOATS, INDEX], [MESH.vertices.astype("<f4").tobytes(), INDICES])
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
    path = write(tmp_path / "house.gltf", [accessor, INDEX], [rows.tobytes(), INDICES], node)
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
    path = write(tmp_path / "house.gltf", [{**FLOATS, "sparse": sparse}, INDEX], blobs)
    assert load_scene(path).mesh.vertices == pytest.approx(MESH.vertices, abs=1e-6)


def test_draco(tmp_path):
    packed = DracoPy.encode(MESH.vertices, MESH.faces, quantization_bits=16)
    extension = {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}}
    bare = [{key: value for key, value in each.items() if key != "bufferView"} for each in (FLOATS, INDEX)]
    more = {"primitive": {"extensions": extension}, "extensionsRequired": ["KHR_draco_mesh_compression"]}
    scene = load_scene(write(tmp_path / "house.gltf", bare, [packed], **more))
    assert scene.mesh.vertices.min(axis=0) == pytest.approx(MESH.vertices.min(axis=0), abs=1e-3)
    assert scene.mesh.vertices.max(axis=0) == pytest.approx(MESH.vertices.max(axis=0), abs=1e-3)


@pytest.mark.parametrize("name", ["EXT_meshopt_compression", "KHR_meshopt_compression"])
def test_meshopt_is_refused_as_what_it_is(tmp_path, name):
    blobs = [MESH.vertices.astype("<f4").tobytes(), INDICES]
    path = write(tmp_path / "house.gltf", [FLOATS, INDEX], blobs, extensionsRequired=[name])
    with pytest.raises(Rejection, match=name) as caught:
        load_scene(path)
    assert caught.value.reason is Reason.UNREADABLE


@pytest.mark.parametrize("uri", ["../outside.bin", "http://localhost/x.bin", "%2e%2e/outside.bin", "/etc/hostname"])
def test_a_buffer_outside_of_the_folder_is_not_opened(tmp_path, uri):
    (tmp_path / "outside.bin").write_bytes(bytes(100_000))
    folder = tmp_path / "house"
    folder.mkdir()
    path = write(folder / "house.gltf", [FLOATS, INDEX], [b"", INDICES])
    tree = json.loads(path.read_text())
    tree["buffers"][0]["uri"] = uri
    path.write_text(json.dumps(tree))
    with pytest.raises(Rejection, match="not in its folder") as caught:
        load_scene(path)
    assert str(tmp_path) not in str(caught.value)


def test_a_node_that_is_its_own_ancestor(tmp_path):
    blobs = [MESH.vertices.astype("<f4").tobytes(), INDICES]
    path = write(tmp_path / "house.gltf", [FLOATS, INDEX], blobs, {"children": [0]}, scenes=[{"nodes": [0]}])
    with pytest.raises(Rejection, match="its own ancestor"):
        load_scene(path)
