import struct
import warnings
from pathlib import Path

import numpy as np
import pytest
import trimesh

from pipeline.rejection import Reason, Rejection
from pipeline.sources import mesh_file
from pipeline.sources.meshes.formats import SUFFIXES, load_scene
from pipeline.values import Mesh
from tests.builders.meshes import as_trimesh, joined, one_level, table, y_up


def read_all(path: Path, **options: str) -> None:
    """Read as a batch does; a warning that leaves the reader is an error."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for item in mesh_file.find(str(path), **options):
            list(mesh_file.read(item))


def rejection(path: Path, **options: str) -> Rejection:
    with pytest.raises(Rejection) as caught:
        read_all(path, **options)
    assert caught.value.stage == "source"
    assert caught.value.advice
    return caught.value


def test_missing_file_and_folder(tmp_path):
    assert rejection(tmp_path / "none.ply").reason is Reason.MISSING_FILE
    assert rejection(tmp_path / "nowhere").reason is Reason.MISSING_FILE


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_empty_file(tmp_path, suffix):
    path = tmp_path / f"empty{suffix}"
    path.touch()
    assert rejection(path).reason is Reason.EMPTY


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("seed", range(3))
def test_binary_garbage(tmp_path, suffix, seed, caplog, capfd):
    path = tmp_path / f"garbage{suffix}"
    path.write_bytes(np.random.default_rng(seed).bytes(5000))
    assert rejection(path).reason in {Reason.UNREADABLE, Reason.EMPTY}
    assert not caplog.records
    assert capfd.readouterr() == ("", "")


def test_a_glb_that_announces_more_than_it_has_costs_no_memory(tmp_path):
    path = tmp_path / "small.glb"
    path.write_bytes(b"glTF" + struct.pack("<III", 2, 22, 0xFFFFFFF0) + b"JSON{}")
    assert "announces 4,294,967,280 bytes and has 2" in rejection(path).detail


@pytest.mark.parametrize("suffix", [suffix for suffix in SUFFIXES if suffix not in {".gltf", ".obj"}])
@pytest.mark.parametrize("share", [0.3, 0.6, 0.9])
def test_truncated_file(tmp_path, suffix, share):
    whole = tmp_path / f"whole{suffix}"
    as_trimesh(one_level()).export(whole)
    path = tmp_path / f"cut{suffix}"
    path.write_bytes(whole.read_bytes()[: int(share * whole.stat().st_size)])
    assert rejection(path).reason in {Reason.UNREADABLE, Reason.EMPTY}


def test_obj_cut_off_among_its_vertices(tmp_path):
    """An OBJ does not say how long it is; cut off among its faces, what is there is a mesh."""
    path = tmp_path / "cut.obj"
    as_trimesh(one_level()).export(path)
    path.write_bytes(path.read_bytes()[:300])
    assert rejection(path).reason in {Reason.UNREADABLE, Reason.EMPTY}


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e30])
@pytest.mark.parametrize("suffix", [".ply", ".stl", ".glb"])
def test_coordinates_that_are_no_numbers_to_reckon_with(tmp_path, suffix, value):
    mesh = one_level()
    mesh.vertices[3, 1] = value
    path = tmp_path / f"nan{suffix}"
    with np.errstate(all="ignore"):
        as_trimesh(mesh).export(path)
    assert rejection(path).reason is Reason.NOT_FINITE


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("none.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\n"),
        ("none.off", "OFF\n3 0 0\n0 0 0\n1 0 0\n1 1 0\n"),
        ("none.stl", "solid nothing\nendsolid nothing\n"),
    ],
)
def test_no_faces(tmp_path, name, text):
    path = tmp_path / name
    path.write_text(text)
    assert rejection(path).reason in {Reason.EMPTY, Reason.UNREADABLE}


def test_faces_that_name_missing_vertices(tmp_path):
    path = tmp_path / "broken.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 9\n")
    assert rejection(path).reason is Reason.UNREADABLE


def test_a_house_of_one_kilometre(tmp_path):
    mesh = one_level()
    path = tmp_path / "long.ply"
    as_trimesh(Mesh(mesh.vertices * (125.0, 125.0, 1.0), mesh.faces)).export(path)
    found = rejection(path)
    assert found.reason is Reason.BAD_UNITS
    assert "1000" in found.detail


def test_millimetres_taken_for_metres(tmp_path):
    mesh = one_level()
    path = tmp_path / "mm.ply"
    as_trimesh(Mesh(mesh.vertices * 1000.0, mesh.faces)).export(path)
    found = rejection(path, units="m")
    assert found.reason is Reason.BAD_UNITS
    assert found.advice == "say --units mm"


def test_a_table_is_no_house(tmp_path):
    path = tmp_path / "table.obj"
    as_trimesh(y_up(joined([table(0.0, 0.0, 0.0), table(4.0, 3.0, 0.0)]))).export(path)
    assert rejection(path).reason in {Reason.NO_LEVEL, Reason.BAD_UNITS}


@pytest.mark.parametrize("suffix", [".ply", ".stl", ".off", ".obj", ".glb"])
def test_too_many_faces_are_refused_before_they_are_read(tmp_path, suffix, monkeypatch):
    path = tmp_path / f"large{suffix}"
    as_trimesh(one_level()).export(path)
    monkeypatch.setattr(trimesh, "load_scene", lambda *_, **__: pytest.fail("was read"))
    with pytest.raises(Rejection, match="the limit is 50") as caught:
        load_scene(path, max_faces=50)
    assert caught.value.reason is Reason.TOO_LARGE


def test_one_bad_file_does_not_stop_the_listing(tmp_path):
    (tmp_path / "a.ply").touch()
    as_trimesh(one_level()).export(tmp_path / "b.ply")
    items = list(mesh_file.find(str(tmp_path)))
    assert [item.id for item in items] == ["a", "b"]
    assert len(list(mesh_file.read(items[1]))) == 1


def test_an_off_header_full_of_comments_is_read_at_once(tmp_path):
    path = tmp_path / "comments.off"
    path.write_bytes(b"OFF\n" + b"# \n" * 60_000 + b"x\n")
    assert rejection(path).reason is Reason.UNREADABLE


def test_json_nested_too_deep(tmp_path):
    path = tmp_path / "deep.gltf"
    path.write_text("[" * 100_000)
    assert rejection(path).reason is Reason.UNREADABLE


@pytest.mark.parametrize("material", ["/etc/passwd", "../../secret.mtl", "http://localhost/x.mtl", "%00"])
def test_a_material_file_is_never_opened(tmp_path, material, monkeypatch):
    path = tmp_path / "house.obj"
    as_trimesh(y_up(one_level())).export(path)
    path.write_text(f"mtllib {material}\n" + path.read_text())
    opened, real = [], Path.open

    def spied(self, *rest, **more):
        opened.append(self)
        return real(self, *rest, **more)

    monkeypatch.setattr(Path, "open", spied)
    read_all(path)
    assert set(opened) == {path}


@pytest.mark.parametrize("unit", ["1-2", "nan", "-1", "0", "e"])
def test_a_collada_unit_that_is_no_number(tmp_path, unit):
    path = tmp_path / "house.dae"
    as_trimesh(one_level()).export(path)
    path.write_text(path.read_text().replace("</asset>", f'<unit name="odd" meter="{unit}"/></asset>', 1))
    found = rejection(path)
    assert found.reason is Reason.UNREADABLE
    assert unit in found.detail


@pytest.mark.parametrize("element", ["vertex", "face"])
def test_a_header_that_announces_more_than_the_file_holds(tmp_path, element):
    path = tmp_path / "lying.ply"
    as_trimesh(one_level()).export(path)
    head, _, rest = path.read_bytes().partition(b"end_header")
    lines = [f"element {element} 4000000000".encode() if line.startswith(f"element {element}".encode()) else line
             for line in head.split(b"\n")]  # fmt: skip
    path.write_bytes(b"\n".join(lines) + b"end_header" + rest)
    found = rejection(path)
    assert found.reason is Reason.UNREADABLE
    assert "announces" in found.detail


def test_a_collada_file_with_a_document_type(tmp_path):
    path = tmp_path / "bomb.dae"
    path.write_text('<!DOCTYPE x [<!ENTITY a "aaaa">]><COLLADA>&a;</COLLADA>')
    assert rejection(path).reason is Reason.UNREADABLE


def test_no_logger_of_a_library_prints(tmp_path, capfd, caplog):
    path = tmp_path / "broken.stl"
    path.write_text("solid x\nfacet normal a b c\nouter loop\nvertex 1 2\nendloop\nendfacet\nendsolid\n")
    assert rejection(path).reason in {Reason.UNREADABLE, Reason.EMPTY}
    assert not caplog.records
    assert capfd.readouterr() == ("", "")


def test_a_few_faces_without_a_place_cost_themselves(tmp_path):
    mesh = as_trimesh(one_level())
    finite = np.concatenate([np.asarray(mesh.vertices), [[np.nan, 0.0, 0.0], [0.0, np.inf, 0.0], [1.0, 1.0, 1.0]]])
    count = len(mesh.vertices)
    faces = np.concatenate([np.asarray(mesh.faces), [[count, count + 1, count + 2]]])
    text = "".join(f"v {x} {y} {z}\n" for x, y, z in finite) + "".join(f"f {a} {b} {c}\n" for a, b, c in faces + 1)
    (tmp_path / "house.obj").write_text(text)
    (item,) = mesh_file.find(str(tmp_path / "house.obj"), up="z", units="m")
    (level,) = mesh_file.read(item)
    assert "2 vertices that are NaN" in level.provenance["left_out"]
    assert np.isfinite(level.walls.vertices).all()
