"""Read mesh files: axes, units, scale, broken files."""

import json
import re
import struct
import warnings
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from houseexpo.errors import ConfigError
from pipeline.rejection import Reason, Rejection
from pipeline.sources import mesh_file
from pipeline.sources.meshes.formats import SUFFIXES, load_scene
from pipeline.sources.storeys.scale import UNITS, unit_from_opening_heads
from pipeline.sources.storeys.surfaces import Surfaces, cut_at_height
from pipeline.values import Input, Level, Mesh
from tests.builders.meshes import (
    Y_UP,
    as_trimesh,
    box,
    joined,
    one_level,
    read,
    slab,
    storey,
    table,
    turned,
    two_levels,
    walls_alone,
    write,
    y_up,
)
from tests.builders.tries import tries

Y_UP_TURN = trimesh.transformations.rotation_matrix(-np.pi / 2, (1.0, 0.0, 0.0))


def plan_length(level: Level, height: float) -> float:
    surfaces = Surfaces.of(level.walls)
    segments = cut_at_height(surfaces, surfaces.walls(), height)
    return float(np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1).sum())


def section_points(level: Level, height: float) -> np.ndarray:
    """Ends of the section's segments in the source's plan axes, sorted."""
    surfaces = Surfaces.of(level.walls)
    ends = cut_at_height(surfaces, surfaces.walls(), height).reshape(-1, 2)
    matrix = np.asarray(level.frame.matrix)
    points = np.round(ends @ matrix[:, :2].T + matrix[:, 2], 4)
    return np.unique(points, axis=0)


@pytest.mark.parametrize("suffix", [".ply", ".obj", ".glb", ".gltf", ".stl", ".off"])
def test_one_chiral_house_is_one_level_in_every_format(tmp_path, suffix):
    expected = one_level()
    (level,) = read(write(expected, tmp_path / f"house{suffix}"))
    assert level.walls.faces.shape == expected.faces.shape
    corners = level.walls.vertices[level.walls.faces]
    assert corners == pytest.approx(expected.vertices[expected.faces], abs=1e-5)
    assert level.frame.up == ("y" if suffix in Y_UP else "z")
    assert level.frame.floor == pytest.approx(0.0, abs=1e-6)
    assert level.floor is not None
    assert level.floor.area == pytest.approx(39.0, abs=0.01)


def test_frame_takes_the_plan_back_to_the_sources_axes(tmp_path):
    moved = turned(one_level(), 0.0, (10.0, 20.0, 3.0))
    (flat,) = read(write(moved, tmp_path / "house.ply"))
    (upright,) = read(write(moved, tmp_path / "house.obj"))
    x, y = section_points(flat, 1.0).T
    source_x, source_z = section_points(upright, 1.0).T
    assert (x.min(), x.max(), y.min(), y.max()) == pytest.approx((10.0, 18.0, 20.0, 26.0), abs=1e-4)
    assert (source_x.min(), source_x.max(), source_z.min(), source_z.max()) == pytest.approx(
        (10.0, 18.0, -26.0, -20.0), abs=1e-4
    )
    assert flat.frame.floor == pytest.approx(3.0, abs=1e-5)
    assert upright.frame.floor == pytest.approx(3.0, abs=1e-5)


def test_a_house_far_from_its_origin_is_brought_near(tmp_path):
    path = tmp_path / "far.obj"
    as_trimesh(turned(walls_alone(), 0.0, (691_000.0, 5_330_000.0, 400.0))).export(path, digits=4)
    (level,) = read(path)
    assert np.abs(level.walls.vertices).max() < 10.0
    low = section_points(level, 1.0).min(axis=0)
    assert level.frame.up == "z"
    assert low == pytest.approx((691_000.0, 5_330_000.0), abs=1e-3)
    assert level.frame.floor == pytest.approx(400.0, abs=1e-3)


@pytest.mark.parametrize(("units", "metres"), [("m", 1.0), ("cm", 0.01), ("mm", 0.001), ("in", 0.0254), ("ft", 0.3048)])
@pytest.mark.parametrize("make", [one_level, walls_alone, two_levels])
def test_units_are_found(tmp_path, units, metres, make):
    mesh = make()
    path = write(Mesh(mesh.vertices / metres, mesh.faces), tmp_path / "house.ply")
    levels = read(path)
    assert {level.provenance["units"] for level in levels} == {units}
    assert np.ptp(levels[0].walls.vertices[:, 0]) == pytest.approx(8.0, abs=1e-3)


@pytest.mark.parametrize("suffix", [".obj", ".ply"])
def test_an_axis_against_the_convention_is_found_and_can_be_given(tmp_path, suffix):
    mesh = one_level() if suffix == ".obj" else y_up(one_level())
    path = tmp_path / f"house{suffix}"
    as_trimesh(mesh).export(path)
    up = "z" if suffix == ".obj" else "y"
    (found,), (given_up,) = read(path), read(path, up=up, units="m")
    assert found.frame.up == given_up.frame.up == up
    assert np.array_equal(found.walls.vertices, given_up.walls.vertices)


@pytest.mark.parametrize("scale", [1.85, 1.5])
def test_a_house_in_no_known_unit_is_not_laid_on_its_side_for_a_storey_in_metres(tmp_path, scale):
    """On its side, the ground that it stands on would be a wall of 8 m, and a storey as high as a room's."""
    ground = slab(-0.6, -0.3, [(-3.0, -4.0, 12.0, 10.0)])
    house = two_levels()
    whole = joined([*ground, as_trimesh(house)])
    levels = read(write(Mesh(whole.vertices / scale, whole.faces), tmp_path / "house.obj"))
    assert {level.frame.up for level in levels} == {"y"}
    assert np.ptp(levels[0].walls.vertices[:, 0]) == pytest.approx(8.0, rel=0.1)


def test_a_tower_keeps_its_formats_axis(tmp_path):
    """Higher than it is deep: the convention decides, not the flatness."""
    floors = [2.8 * k for k in range(4)]
    parts = [part for z in floors for part in (*slab(z - 0.3, z), *storey(z, z + 2.5))]
    levels = read(write(joined(parts), tmp_path / "tower.glb"))
    assert [level.frame.floor for level in levels] == pytest.approx(floors, abs=1e-5)
    assert {level.frame.up for level in levels} == {"y"}


def test_collada_says_its_axis_and_unit(tmp_path):
    pytest.importorskip("collada")
    path = tmp_path / "house.dae"
    mesh = one_level()
    as_trimesh(Mesh(mesh.vertices / 0.0254, mesh.faces)).export(path)
    text = path.read_text()
    head = '<asset><unit name="inch" meter="0.0254"/><up_axis>Z_UP</up_axis>'
    start, end = text.index("<asset>"), text.index("</asset>")
    path.write_text(text[:start] + head + text[end:])
    (level,) = read(path)
    assert (level.provenance["units"], level.frame.up) == ("in", "z")
    assert np.ptp(level.walls.vertices[:, 0]) == pytest.approx(8.0, abs=1e-4)


def test_a_scene_is_put_together_with_its_transforms(tmp_path):
    mesh = as_trimesh(y_up(walls_alone()))
    scene = trimesh.Scene()
    scene.add_geometry(mesh, transform=trimesh.transformations.translation_matrix([5.0, 0.0, 0.0]))
    mirrored = np.diag([-1.0, 1.0, 1.0, 1.0])
    scene.add_geometry(mesh, transform=mirrored)
    path = tmp_path / "scene.glb"
    scene.export(path)
    (level,) = read(path)
    assert np.ptp(level.walls.vertices[:, 0]) == pytest.approx(8.0 + 13.0, abs=1e-5)
    assert as_trimesh(level.walls).volume == pytest.approx(2 * as_trimesh(walls_alone()).volume, rel=1e-6)


def test_a_missing_material_does_not_matter(tmp_path):
    path = write(one_level(), tmp_path / "house.obj")
    path.write_text("mtllib nowhere.mtl\nusemtl none\n" + path.read_text())
    assert len(read(path)) == 1


def test_ids_and_provenance_hold_no_path_of_the_machine(tmp_path):
    folder = tmp_path / "Häuser"
    (folder / "Ost").mkdir(parents=True)
    write(two_levels(), folder / "Ost" / "Haus 7.PLY".lower())
    write(one_level(), folder / "a.stl")
    (folder / "notes.txt").write_text("no mesh")
    items = list(mesh_file.find(str(folder)))
    assert [item.id for item in items] == ["ost_haus_7", "a"]
    assert [item.id for item in mesh_file.find(str(folder / "a.stl"))] == ["hauser_a"]
    levels = list(mesh_file.read(items[0]))
    assert [level.id for level in levels] == ["ost_haus_7_L0", "ost_haus_7_L1"]
    assert [level.frame.level for level in levels] == [0, 1]
    assert levels[0].provenance["file"] == "Ost/haus 7.ply"
    assert len(levels[0].provenance["sha256"]) == 64
    assert str(tmp_path) not in str(levels[0].provenance)


@pytest.mark.parametrize("options", [{"up": "x"}, {"units": "furlong"}, {"scale": "-2"}, {"scales": "2"}])
def test_an_unknown_option_is_refused(tmp_path, options):
    with pytest.raises(ConfigError, match=next(iter(options))):
        list(mesh_file.find(str(tmp_path), **options))


@tries(15)
@given(st.floats(0, 360), st.floats(-400, 400), st.floats(-400, 400), st.floats(-50, 50))
def test_a_moved_house_gives_the_moved_levels(tmp_path_factory, angle, x, y, z):
    folder = tmp_path_factory.mktemp("moved")
    moved = turned(two_levels(), angle, (x, y, z))
    path = folder / "house.ply"
    as_trimesh(moved).export(path)
    still = two_levels()
    as_trimesh(still).export(folder / "still.ply")
    expected = read(folder / "still.ply")
    found = list(mesh_file.read(Input("moved", "mesh_file", str(path))))
    assert [level.frame.floor - z for level in found] == pytest.approx([0.0, 2.8], abs=1e-3)
    for level, same in zip(found, expected, strict=True):
        assert level.ceiling_m == pytest.approx(same.ceiling_m, abs=2e-3)
        assert plan_length(level, 1.0) == pytest.approx(plan_length(same, 1.0), abs=0.02)
        assert level.floor is not None
        assert level.floor.area == pytest.approx(39.0, abs=0.05)


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


def test_a_glb_with_a_mesh_that_its_scene_does_not_show_is_not_truncated(tmp_path):
    path = tmp_path / "two.glb"
    trimesh.Scene({"house": as_trimesh(one_level()), "other": trimesh.creation.box()}).export(path)
    data = path.read_bytes()
    (length,) = struct.unpack("<I", data[12:16])
    tree = json.loads(data[20 : 20 + length])
    shown = next(number for number, node in enumerate(tree["nodes"]) if node.get("name") == "house")
    tree["scenes"][0]["nodes"] = [shown]
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    rest = data[20 + length :]
    path.write_bytes(data[:8] + struct.pack("<II", 20 + len(text) + len(rest), len(text)) + data[16:20] + text + rest)
    assert len(load_scene(path).mesh.faces) == len(as_trimesh(one_level()).faces)


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


NO_FACES, UNREADABLE = {Reason.EMPTY, Reason.UNREADABLE}, {Reason.UNREADABLE}
STL = "solid x\nfacet normal a b c\nouter loop\nvertex 1 2\nendloop\nendfacet\nendsolid\n"


@pytest.mark.parametrize(
    ("suffix", "text", "reasons"),
    [
        pytest.param(".obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\n", NO_FACES, id="obj without faces"),
        pytest.param(".off", "OFF\n3 0 0\n0 0 0\n1 0 0\n1 1 0\n", NO_FACES, id="off without faces"),
        pytest.param(".stl", "solid nothing\nendsolid nothing\n", NO_FACES, id="stl without faces"),
        pytest.param(".stl", STL, NO_FACES, id="words for numbers"),
        pytest.param(".obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 9\n", UNREADABLE, id="missing vertices"),
        pytest.param(".off", "OFF\n" + "# \n" * 60_000 + "x\n", UNREADABLE, id="a header full of comments"),
        pytest.param(".gltf", "[" * 100_000, UNREADABLE, id="nested too deep"),
        pytest.param(".dae", '<!DOCTYPE x [<!ENTITY a "aa">]><COLLADA>&a;</COLLADA>', UNREADABLE, id="entities"),
    ],
)
def test_broken_text_is_refused_and_no_logger_of_a_library_prints(tmp_path, suffix, text, reasons, capfd, caplog):
    path = tmp_path / f"broken{suffix}"
    path.write_text(text)
    assert rejection(path).reason in reasons
    assert not caplog.records
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("scale", "options", "said"),
    [((125.0, 125.0, 1.0), {}, "1000"), ((1000.0, 1000.0, 1000.0), {"units": "m"}, "say --units mm")],
)
def test_a_house_of_one_kilometre_is_in_another_unit(tmp_path, scale, options, said):
    found = rejection(write(scaled(one_level(), scale), tmp_path / "long.ply"), **options)
    assert found.reason is Reason.BAD_UNITS
    assert said in found.detail + found.advice


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


# Units, scale and axis of a mesh file: what it declares, what the house shows, what a person says.


def scaled(mesh: Mesh, by: float | tuple[float, float, float]) -> Mesh:
    return Mesh(mesh.vertices * by, mesh.faces)


@pytest.mark.parametrize("options", [{"scale": "20"}, {"units": "20"}, {"storey_height": "2.5"}])
def test_a_person_decides_on_a_models_scale(tmp_path, options):
    path = write(scaled(walls_alone(), 1 / 20), tmp_path / "model.glb")
    (level,) = read(path, **options)
    assert level.ceiling_m == pytest.approx(2.5)
    assert level.guesses == ()


def test_a_model_without_doors_is_to_the_usual_scale_that_makes_its_storey_usual(tmp_path):
    (level,) = read(write(scaled(walls_alone(), 1 / 20), tmp_path / "model.glb"))
    assert level.ceiling_m == pytest.approx(2.5)
    assert level.guesses == ("scale",)


def with_doors() -> Mesh:
    """Walls of 2.7 m with lintels over gaps, in a plan of 8 x 6 m."""
    walls = [(0.0, 0.0, 8.0, 0.2), (7.8, 0.2, 8.0, 5.8), (0.0, 5.8, 8.0, 6.0), (0.0, 0.2, 0.2, 5.8)]
    inner = [(4.0, 0.2, 4.2, 2.0), (4.0, 2.9, 4.2, 4.0), (4.0, 4.9, 4.2, 5.8)]
    lintels = [box((4.0, y, 4.2, y + 0.9), 2.05, 2.7) for y in (2.0, 4.0)]
    return joined([*storey(0.0, 2.7, [*walls, *inner]), *lintels])


@pytest.mark.parametrize("unit", [1.0, 0.0254, 0.01, 0.001])
@pytest.mark.parametrize("scale", [1, 20, 50])
def test_door_heads_tell_the_unit_and_the_scale_where_none_is_declared(tmp_path, unit, scale):
    path = write(scaled(with_doors(), 1 / (unit * scale)), tmp_path / "model.ply")
    (level,) = read(path)
    assert np.ptp(level.walls.vertices[:, 0]) == pytest.approx(8.0, rel=0.02)


def test_without_a_unit_a_door_in_a_usual_storey_tells_a_scale_that_is_none_of_the_usual(tmp_path):
    """Metres would make a hall of it, 40 m high, in which no opening ends as high as a door."""
    (level,) = read(write(scaled(with_doors(), 1 / 0.0677), tmp_path / "model.ply"))
    assert level.ceiling_m == pytest.approx(2.7, abs=0.1)
    assert level.guesses == ("tried scale",)
    assert np.ptp(level.walls.vertices[:, 0]) == pytest.approx(8.0, rel=0.05)


@pytest.mark.parametrize(("high", "metres"), [(8.9, 2.7), (2.7, 2.7)])
def test_one_named_door_tells_the_scale_where_the_storey_is_higher_than_a_dwelling(tmp_path, high, metres):
    """In a storey of a usual height a door as high as a hatch is one."""
    door = box((2.0, 0.0, 3.0, 0.05), 0.0, 2.05 if high > 5 else 1.2)
    walls = [(0.0, 0.0, 0.05, 4.0), (5.95, 0.0, 6.0, 4.0), (0.05, 3.95, 5.95, 4.0), (0.05, 0.0, 5.95, 0.05)]
    scene = trimesh.Scene()
    scene.add_geometry(as_trimesh(y_up(scaled(joined(storey(0.0, 2.7, walls)), high / 2.7))), node_name="walls")
    scene.add_geometry(as_trimesh(y_up(scaled(joined([door]), high / 2.7))), node_name="door")
    scene.export(tmp_path / "room.glb")
    (level,) = read(tmp_path / "room.glb")
    assert level.ceiling_m == pytest.approx(metres, abs=0.2)


def hills(size: float = 100.0, count: int = 60) -> Mesh:
    """Terrain of triangles a few metres wide round (4, 3), level under the house and hilly around it."""
    x, y = np.meshgrid(np.linspace(-size, size, count) + 4.0, np.linspace(-size, size, count) + 3.0)
    away = np.maximum(np.hypot(x - 4.0, y - 3.0) - 12.0, 0.0)
    z = -0.3 + 0.03 * away * np.sin(x / 9.0) + 0.05 * away * np.cos(y / 13.0)
    at = np.arange(count * count).reshape(count, count)
    a, b, c, d = (corner.ravel() for corner in (at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]))
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return Mesh(np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1), faces)


@pytest.mark.parametrize("suffix", [".glb", ".obj", ".ply"])
def test_terrain_around_a_house_says_nothing_of_its_unit(tmp_path, suffix):
    floor = as_trimesh(joined([box((0.0, 0.0, 8.0, 6.0), -0.2, 0.0)]))
    house = joined([as_trimesh(with_doors()), floor, as_trimesh(hills())])
    (level,) = read(write(house, tmp_path / f"house{suffix}"))
    assert level.ceiling_m == pytest.approx(2.7, rel=0.05)
    assert level.guesses == ()


def test_a_corner_that_lies_far_away_costs_its_faces_alone(tmp_path):
    house = as_trimesh(one_level())
    plain = next(iter(read(write(house, tmp_path / "plain.ply"))))
    table_top = as_trimesh(joined([box((2.0, 2.0, 3.0, 3.0), 0.7, 0.75)]))
    table_top.vertices[0] *= 1e6
    (level,) = read(write(joined([house, table_top]), tmp_path / "house.ply"))
    assert level.ceiling_m == pytest.approx(plain.ceiling_m)
    assert level.guesses == plain.guesses
    assert "far away" in level.provenance["left_out"]


@pytest.mark.parametrize("half", [False, True])
def test_a_ball_around_a_house_is_the_sky_whatever_its_name(tmp_path, half):
    ball = trimesh.creation.icosphere(subdivisions=3, radius=60.0)
    if half:
        ball.update_faces(ball.triangles[:, :, 2].min(axis=1) >= -1.0)
    scene = trimesh.Scene([as_trimesh(one_level()), ball])
    scene.apply_transform(Y_UP_TURN)
    scene.export(tmp_path / "house.glb")
    (level,) = read(tmp_path / "house.glb")
    assert level.guesses == ()
    assert level.ceiling_m == pytest.approx(2.5, abs=0.3)
    assert "the sky" in level.provenance["left_out"]


def test_a_dome_over_a_room_is_no_sky(tmp_path):
    dome = trimesh.creation.icosphere(subdivisions=3, radius=4.0)
    trimesh.Scene([dome, table(0.0, 0.0, -2.0), box((-3.0, -3.0, 3.0, 3.0), -2.0, 0.5)]).export(tmp_path / "dome.glb")
    assert len(load_scene(tmp_path / "dome.glb").without_sky().parts) == 3
    assert load_scene(tmp_path / "dome.glb").without_sky().left_out == ""


def test_a_scale_that_no_unit_gives_is_tried_and_said(tmp_path):
    (level,) = read(write(scaled(walls_alone(), 1 / 3), tmp_path / "model.glb"))
    assert level.guesses == ("tried scale",)
    assert level.ceiling_m == pytest.approx(2.7, abs=0.1)


def test_hatches_do_not_scale_a_house_whose_metres_are_declared(tmp_path):
    scene = trimesh.Scene()
    scene.add_geometry(as_trimesh(y_up(walls_alone())), node_name="Walls")
    hatch = box((1.0, 0.05, 1.5, 0.1), 0.0, 0.6)
    scene.add_geometry(as_trimesh(y_up(Mesh(hatch.vertices, hatch.faces))), node_name="Door_of_the_cellar")
    scene.export(tmp_path / "house.glb")
    (level,) = read(tmp_path / "house.glb")
    assert level.provenance["units"] == "m"


def test_a_unit_that_cannot_be_decided_shows_the_sizes(tmp_path):
    path = write(scaled(walls_alone(), (1.0, 1.0, 0.001)), tmp_path / "model.glb")
    with pytest.raises(Rejection, match=r"bad_units.*in: 0\.\d+ m.*--scale") as caught:
        read(path)
    assert caught.value.reason is Reason.BAD_UNITS


def test_named_doors_tell_a_models_scale(tmp_path):
    scene = trimesh.Scene()
    scene.add_geometry(as_trimesh(y_up(scaled(walls_alone(), 1 / 15))), node_name="Walls")
    for x in (1.0, 3.0):
        leaf = Mesh(box((x, 0.05, x + 0.9, 0.1), 0.0, 2.05).vertices, box((x, 0.05, x + 0.9, 0.1), 0.0, 2.05).faces)
        scene.add_geometry(as_trimesh(y_up(scaled(leaf, 1 / 15))), node_name=f"Door_{x}")
    scene.export(tmp_path / "model.glb")
    (level,) = read(tmp_path / "model.glb")
    assert level.ceiling_m == pytest.approx(2.5, abs=0.01)
    assert level.guesses == ("scale",)
    assert len(level.leaves) == 2


def test_a_real_room_of_three_metres_is_no_model(tmp_path):
    walls = [(0.0, 0.0, 2.9, 0.1), (2.8, 0.0, 2.9, 2.9), (0.0, 2.8, 2.9, 2.9), (0.0, 0.0, 0.1, 2.9)]
    (level,) = read(write(joined(storey(0.0, 2.5, walls)), tmp_path / "room.ply"))
    assert level.ceiling_m == pytest.approx(2.5)


@pytest.mark.parametrize(("unit", "metres"), [("inch", 0.0254), ("meter", 1.0)])
def test_a_declared_unit_stands_over_a_shell_without_an_inner_slab(tmp_path, unit, metres):
    shell = storey(
        0.0, 8.4, [(0.0, 0.0, 12.0, 0.2), (11.8, 0.0, 12.0, 9.0), (0.0, 8.8, 12.0, 9.0), (0.0, 0.0, 0.2, 9.0)]
    )
    path = tmp_path / "shell.dae"
    as_trimesh(scaled(joined(shell), 1 / metres)).export(path)
    declared = f'<unit name="{unit}" meter="{metres}"/><up_axis>Z_UP</up_axis>'
    path.write_text(
        re.sub(r"<unit[^>]*/>|<up_axis>.*?</up_axis>", "", path.read_text()).replace("</asset>", f"{declared}</asset>")
    )
    (level,) = read(path)
    assert np.ptp(level.walls.vertices[:, 0]) == pytest.approx(12.0, abs=1e-3)
    assert level.frame.up == "z"
    assert level.guesses == ()


def test_a_declared_axis_stands_over_a_tower(tmp_path):
    tower = storey(0.0, 14.0, [(0.0, 0.0, 5.0, 0.2), (4.8, 0.0, 5.0, 7.0), (0.0, 6.8, 5.0, 7.0), (0.0, 0.0, 0.2, 7.0)])
    path = tmp_path / "tower.dae"
    as_trimesh(joined(tower)).export(path)
    text = re.sub(r"<up_axis>.*?</up_axis>", "", path.read_text())
    path.write_text(text.replace("</asset>", "<up_axis>Z_UP</up_axis></asset>"))
    assert [level.frame.up for level in read(path)] == ["z"]


def test_a_rejection_says_how_high_the_walls_are(tmp_path):
    path = write(joined(storey(0.0, 1.5)), tmp_path / "low.ply")
    with pytest.raises(Rejection, match=r"which are 1\.50 m high in all on") as caught:
        read(path, up="z", units="m", scale="1.0001")
    assert "--storey-height" in caught.value.advice


# Units that heads of doors tell: bare ones, and those of models.


@pytest.mark.parametrize("unit", ["m", "cm", "mm", "in"])
def test_a_bare_unit_is_taken_before_a_model_of_nearly_the_same_size(unit: str) -> None:
    """Inches differ from millimetres at 1:25 by 1.6%."""
    for head_m in (2.0, 2.06, 2.1):
        assert unit_from_opening_heads(2.7 / UNITS[unit], [head_m / UNITS[unit]]) == UNITS[unit]


@pytest.mark.parametrize("metres", [15.0, 20.0, 50.0, 0.2, 0.5, 0.02])
def test_a_model_is_told_by_its_doors(metres: float) -> None:
    assert unit_from_opening_heads(2.7 / metres, [2.06 / metres]) == pytest.approx(metres)


@pytest.mark.parametrize("head_m", [2.0, 2.03, 2.06, 2.1])
def test_of_two_scales_that_nobody_can_tell_apart_the_metric_one_is_taken(head_m: float) -> None:
    """1:20 in inches is 1:50 in centimetres but for 1.6%, and brings such heads nearer to the usual one."""
    assert unit_from_opening_heads(2.7 / 0.5, [head_m / 0.5]) == pytest.approx(0.5)
    assert unit_from_opening_heads(2.7 / 0.381, [head_m / 0.381]) == pytest.approx(
        0.381
    )  # 1:15 in inches has no such twin
