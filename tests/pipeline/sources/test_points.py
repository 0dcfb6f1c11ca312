"""Read point clouds, compressed ones too."""

import sys
from functools import cache

import numpy as np
import pytest
import shapely

from houseexpo.errors import MissingDependencyError
from pipeline.rejection import Reason, Rejection
from pipeline.sources import find, points
from pipeline.sources.points_file import decompress_lzf, read_blocks
from tests.builders.damage import mutated, outcome
from tests.builders.formats.clouds import (
    flat,
    sampled,
    turned,
    write_e57,
    write_las,
    write_packed_pcd,
    write_pcd,
    write_ply,
    write_xyz,
)
from tests.builders.houses import kinds, levels_of, plan_of

ROOMS = shapely.union_all(
    [shapely.box(0, 0, 4, 3), shapely.box(4.2, 0, 7.2, 3), shapely.box(4.0, 1.0, 4.2, 1.9)],
)


@cache
def cloud(**options):
    found = sampled(flat(), np.random.default_rng(0), **options)
    found.flags.writeable = False
    return found


def wide(**options):
    """Two such flats side by side: the floor is larger than any wall."""
    found = cloud(**options)
    return np.concatenate([found, found + np.array([0.0, 3.2, 0.0])])


def free_iou(plan, truth):
    matrix = np.array(plan.frame.matrix)
    rings = [np.array(ring) @ matrix[:, :2].T + matrix[:, 2] for ring in (plan.verts, *plan.holes)]
    found = shapely.Polygon(rings[0], rings[1:])
    return found.intersection(truth).area / found.union(truth).area


@pytest.mark.parametrize(
    ("noise", "outliers", "least", "degrees"),
    [
        (0.02, 0.1, 0.92, 25.0),
        *(
            pytest.param(*each, degrees, marks=pytest.mark.slow)
            for degrees in (0.0, 25.0)
            for each in ((0.0, 0.0, 0.95), (0.005, 0.1, 0.94), (0.02, 0.1, 0.92))
            if (each[0], degrees) != (0.02, 25.0)
        ),
    ],
)
def test_a_scanned_flat_gives_its_two_rooms_and_the_door(tmp_path, noise, outliers, least, degrees):
    there = (3.0, -2.0, 1.0)
    found = turned(cloud(noise_m=noise, outliers=outliers), degrees, there)
    (level,) = levels_of(write_ply(tmp_path / "scan.ply", found))
    plan = plan_of(level)
    truth = shapely.transform(ROOMS, lambda xy: turned(np.column_stack([xy, 0 * xy[:, :1]]), degrees, there)[:, :2])
    assert free_iou(plan, truth) > least
    assert sorted(room.area for room in plan.rooms) == pytest.approx([9.0, 12.0], rel=0.09)
    assert "door" in kinds(plan)
    assert level.frame.floor == pytest.approx(1.0, abs=0.03)
    assert level.ceiling_m == pytest.approx(2.5, abs=0.08)


def test_furniture_and_windows_leave_no_trace(tmp_path):
    (level,) = levels_of(write_ply(tmp_path / "scan.ply", cloud()))
    plan = plan_of(level)
    assert plan.holes == ()  # a cupboard stands in the first room
    assert kinds(plan) == ["door"]  # and a window is in its wall


IN_CHILD = ("g.las", "h.laz", "i.e57")
WRITERS = {
    "a.ply": write_ply,
    "b.ply": lambda path, found: write_ply(path, found, ascii_=True),
    "c.pcd": write_pcd,
    "d.pcd": lambda path, found: write_pcd(path, found, ascii_=True),
    "p.pcd": write_packed_pcd,
    "e.xyz": write_xyz,
    "f.xyz": lambda path, found: write_xyz(path, found, ";"),
    "g.las": write_las,
    "h.laz": write_las,
    "i.e57": write_e57,
}
NEEDS = {".las": "laspy", ".laz": "lazrs", ".e57": "pye57"}


def written(path, found):
    pytest.importorskip(NEEDS.get(path.suffix, "numpy"))
    return WRITERS[path.name](path, found)


@pytest.mark.parametrize("name", WRITERS)
def test_every_format_holds_the_same_points(tmp_path, name):
    found = cloud(density=300.0)
    path = written(tmp_path / name, found)
    assert [item.reader for item in find(str(path))] == ["points"]
    voxels = points.fill_voxels(points.read_blocks(path), 1.0, "auto", name)
    same = points.fill_voxels([found], 1.0, "auto", name)
    assert len(voxels.index) == pytest.approx(len(same.index), rel=0.02)
    assert voxels.centres().mean(axis=0) == pytest.approx(same.centres().mean(axis=0), abs=0.01)


def test_a_cloud_with_y_up_is_turned_upright(tmp_path):
    (level,) = levels_of(write_ply(tmp_path / "wide.ply", wide()[:, [0, 2, 1]] * (1.0, 1.0, -1.0)))
    assert (level.frame.up, level.frame.matrix[1][1]) == ("y", -1.0)
    (level,) = levels_of(write_ply(tmp_path / "scan.ply", cloud()[:, [0, 2, 1]] * (1.0, 1.0, -1.0)), up="y")
    assert free_iou(plan_of(level), shapely.transform(ROOMS, lambda xy: xy * (1.0, -1.0))) > 0.95


def test_millimetres_are_said_or_guessed(tmp_path):
    path = write_ply(tmp_path / "scan.ply", 1000 * cloud(density=500.0))
    (guessed,) = levels_of(path)
    assert (guessed.guesses, guessed.ceiling_m) == (("units",), pytest.approx(2.5, abs=0.08))
    for said in ("mm", "0.001"):
        (level,) = levels_of(path, units=said)
        assert level.guesses == ()
    with pytest.raises(Rejection) as found:
        levels_of(path, units="m")
    assert found.value.reason is Reason.BAD_UNITS


@pytest.mark.parametrize(
    ("heading", "order"),
    [("x y z nx\n", "xyzn"), ("12\n", "xyzn"), ('"I";"X";"Y";"Z"\n', "nxyz"), ("//X,Y,Z,R\n", "xyzn")],
)
def test_a_heading_is_passed_over_and_names_the_columns(tmp_path, heading, order):
    columns = {"x": [0.5, 1.5, -2.5], "y": [3.0, 4.0, 5e-1], "z": [6.0, 7.0, 8.0], "n": [255.0, 0.0, 9.0]}
    rows = np.column_stack([columns[name] for name in order])
    path = tmp_path / "scan.xyz"
    path.write_text(heading + "\n".join(" ".join(map(str, row)) for row in rows.tolist()))
    (found,) = read_blocks(path)
    assert found == pytest.approx(np.column_stack([columns[name] for name in "xyz"]))


@pytest.mark.slow
def test_a_cloud_of_a_sensor_held_askew_is_turned_upright(tmp_path):
    tilt = np.deg2rad(7.0)
    turn = np.array([[1.0, 0.0, 0.0], [0.0, np.cos(tilt), -np.sin(tilt)], [0.0, np.sin(tilt), np.cos(tilt)]])
    (level,) = levels_of(write_ply(tmp_path / "scan.ply", cloud(noise_m=0.005) @ turn.T))
    assert level.ceiling_m == pytest.approx(2.5, abs=0.1)
    plan = plan_of(level)
    assert sorted(room.area for room in plan.rooms) == pytest.approx([9.0, 12.0], rel=0.09)
    assert free_iou(plan, shapely.transform(ROOMS, lambda xy: xy * (1.0, np.cos(tilt)))) > 0.9  # its floor, from above


def test_an_upright_cloud_stays_as_it_is():
    voxels = points.fill_voxels([cloud(density=300.0)], 1.0, "auto", "scan")
    assert (voxels.turn == np.eye(3)).all()


def test_walls_as_full_as_the_layer_over_them_have_no_ceiling(tmp_path):
    found = cloud(density=300.0)
    walls = found[(found[:, 2] > 0.6) & (found[:, 2] < 2.3)]
    dense = walls[walls[:, 2] > 2.2]  # where the sensor was
    path = write_ply(tmp_path / "scan.ply", np.concatenate([walls, dense + np.array([0.0, 0.0, 0.05])]))
    with pytest.raises(Rejection) as rejected:
        levels_of(path, up="z")
    assert rejected.value.reason is Reason.NO_LEVEL


def test_a_storey_of_which_the_floor_was_not_seen_begins_where_the_cloud_does(tmp_path):
    found = cloud()
    (level,) = levels_of(write_ply(tmp_path / "scan.ply", found[found[:, 2] > 0.8]))
    assert level.frame.floor == pytest.approx(0.6, abs=0.06)  # 1.9 m under the ceiling
    assert level.guesses == ("floor",)
    assert sorted(round(room.area) for room in plan_of(level).rooms) == pytest.approx([9, 12], abs=1)


def test_two_storeys_are_two_levels(tmp_path):
    lower = wide(density=800.0)
    upper = lower + np.array([0.0, 0.0, 2.8])
    (below, above) = levels_of(write_ply(tmp_path / "scan.ply", np.concatenate([lower, upper])))
    assert (below.frame.floor, above.frame.floor) == pytest.approx((0.0, 2.8), abs=0.05)


def test_a_mesh_in_the_same_folder_is_none(tmp_path):
    write_ply(tmp_path / "scan.ply", cloud(density=50.0))
    assert [item.reader for item in find(str(tmp_path))] == ["points"]


def test_the_voxels_do_not_depend_on_the_blocks():
    found = cloud(density=300.0)
    whole = points.fill_voxels([found], 1.0, "z", "a")
    parts = points.fill_voxels(np.array_split(found, 7), 1.0, "z", "a")
    same = [np.unique(np.round(each.centres(), 3), axis=0) for each in (whole, parts)]
    assert np.array_equal(*same)


@pytest.mark.parametrize(
    ("found", "reason"),
    [
        (np.full((5000, 3), np.nan), Reason.NOT_FINITE),
        (np.zeros((1, 3)), Reason.EMPTY),
        (np.random.default_rng(0).random((20_000, 3)) * (900.0, 700.0, 30.0), Reason.BAD_UNITS),
        (np.random.default_rng(0).random((20_000, 3)) * (5.0, 5.0, 0.5), Reason.NO_LEVEL),
    ],
    ids=["nan", "point", "campus", "rug"],
)
def test_what_is_no_flat(tmp_path, found, reason):
    rejection = outcome(write_ply(tmp_path / "scan.ply", found))
    assert isinstance(rejection, Rejection)
    assert rejection.reason is reason


@pytest.mark.parametrize("library", ["laspy", "pye57"])
def test_a_missing_library_is_named(tmp_path, monkeypatch, library):
    path = tmp_path / "scan.bin"
    path.write_bytes({"laspy": b"LASF", "pye57": b"ASTM-E57"}[library] + b"\0" * 500)
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(MissingDependencyError, match="scans"):
        list(points.read_blocks(path))


@pytest.mark.parametrize(
    ("name", "count"),
    [(name, 60) for name in WRITERS if name not in IN_CHILD]
    + [pytest.param(name, 30, marks=pytest.mark.slow) for name in IN_CHILD],  # a process for each
)
def test_damaged_clouds_end_as_levels_or_rejections(tmp_path, name, count):
    path = tmp_path / name
    data = written(path, cloud(density=15.0)).read_bytes()
    whole = sum(map(len, points.read_blocks(path)))
    found = []
    for changed in mutated(data, count, seed=2):
        path.write_bytes(changed)
        try:
            found.append(sum(map(len, points.read_blocks(path))))
        except Rejection as error:
            found.append(error)
    assert any(isinstance(each, Rejection) for each in found)
    assert all(isinstance(each, Rejection) or each <= 2 * whole for each in found)


def test_what_a_laser_sees_far_outside_costs_nothing(tmp_path):
    rng = np.random.default_rng(3)
    inside = cloud()
    far = rng.uniform((-600.0, 20.0, 0.0), (600.0, 900.0, 3.0), (20, 3))
    behind_glass = rng.uniform((30.0, 0.0, 0.0), (60.0, 4.0, 3.0), (30, 3))
    write_ply(tmp_path / "flat.ply", np.concatenate([inside, far, behind_glass]))
    (level,) = levels_of(tmp_path / "flat.ply")
    assert free_iou(plan_of(level), ROOMS) > 0.9
    assert "far from all others" in level.provenance["left_out"]


def test_a_cloud_of_a_street_is_none(tmp_path):
    write_ply(tmp_path / "street.ply", cloud() * (200.0, 1.0, 1.0))
    with pytest.raises(Rejection, match="from its middle"):
        levels_of(tmp_path / "street.ply")


def test_literal_bytes_and_copies():  # R1, R2
    assert decompress_lzf(b"\x02abc", 3) == b"abc"
    assert decompress_lzf(b"\x02abc\x20\x02", 6) == b"abcabc"  # 3 bytes from 3 back
    assert decompress_lzf(b"\x00a\xe0\x02\x00", 12) == b"a" * 12  # 7 + 2 + 2 bytes from 1 back: it runs on into itself


@pytest.mark.parametrize("data", [b"", b"\x02ab", b"\x20", b"\x20\x05", b"\x00a\xe0", b"\x1f" + b"a" * 32])
def test_damaged_data_are_refused(data):
    with pytest.raises(ValueError, match="damaged"):
        decompress_lzf(data, 3)
