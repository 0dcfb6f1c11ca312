import numpy as np
import pytest
import trimesh

from pipeline.rejection import Reason, Rejection
from pipeline.sources import find, mesh_file, reader
from pipeline.sources.storeys.interior import check_interior, measure_interior
from pipeline.values import Mesh
from tests.builders.meshes import as_trimesh, box, city, joined, one_level, sheet, slab, storey, walls_alone, y_up

CORNERS = [(0.0, 0.0), (12.0, 0.0), (12.0, 9.0), (0.0, 9.0)]
GAP = 1.0


def block(x: float = 0.0, outward: bool = True) -> list[trimesh.Trimesh]:
    """Four sheets that are seen from outside, or from inside."""
    ring = [(x + a, b) for a, b in CORNERS]
    ring = ring if outward else ring[::-1]
    return [sheet(ring[i - 1], ring[i], 0.0, 6.0) for i in range(4)]


def fault(*parts: list[trimesh.Trimesh]) -> str:
    return measure_interior(joined([each for part in parts for each in part])).fault


def test_a_closed_sheet_seen_from_outside_is_a_facade():
    assert "a facade" in fault(block(), slab(-0.1, 0.0, [(0.0, 0.0, 12.0, 9.0)]))


def test_furniture_within_it_speaks_for_a_room_but_not_in_a_vehicle():
    furnished = [box((4.0, 4.0, 6.0, 5.0), 0.0, 0.75)]
    assert not fault(block(), furnished)
    assert "a facade" in fault(block(), [box((4.0, 4.0, 6.0, 5.0), 0.0, 0.4)])
    assert "a facade" in fault(block(), [box((4.0, 0.0, 6.0, 0.3), 0.0, 0.75)])
    ring = [(0.0, 0.0), (5.0, 0.0), (5.0, 2.0), (0.0, 2.0)]
    vehicle = [sheet(ring[i - 1], ring[i], 0.0, 2.0) for i in range(4)]
    assert "a facade" in fault(vehicle, [box((0.8, 0.8, 4.2, 1.2), 0.0, 0.75)])


def test_furniture_says_nothing_where_nobody_knows_the_scale():
    walls = joined([*block(), box((4.0, 4.0, 6.0, 5.0), 0.0, 0.75)])
    check_interior([walls], "house")
    with pytest.raises(Rejection, match="a facade"):
        check_interior([walls], "house", is_sized=False)


def test_many_of_them_are_a_city():
    assert "4 separate closed blocks" in fault(*(block(20.0 * i) for i in range(4)))


def hollow(x: float, *doors: float) -> list[trimesh.Trimesh]:
    """A block whose walls have two faces; it stands open at these places of its front."""
    ends = [x, *(x + door + side for door in doors for side in (0.0, GAP)), x + 12.0]
    front = [(a, 0.0, b, 0.3) for a, b in zip(ends[::2], ends[1::2], strict=True)]
    sides = [(x, 8.7, x + 12.0, 9.0), (x, 0.3, x + 0.3, 8.7), (x + 11.7, 0.3, x + 12.0, 8.7)]
    return storey(0.0, 6.0, [*front, *sides])


def test_many_hollow_blocks_are_a_city_too_but_not_two_or_three_or_open_ones():
    assert "6 separate closed blocks" in fault(*(hollow(20.0 * i) for i in range(6)))
    assert not fault(*(hollow(20.0 * i) for i in range(3)))
    assert not fault(*(hollow(20.0 * i, 5.0) for i in range(6)))


def test_a_block_of_houses_with_windows_is_no_interior(tmp_path):
    city(tmp_path / "city.ply", 5_000)
    (item,) = find(str(tmp_path / "city.ply"))
    with pytest.raises(Rejection) as caught:
        list(reader(item.reader).read(item))
    assert caught.value.reason == Reason.NO_INTERIOR


def test_a_hill_is_neither():
    x, y = np.meshgrid(np.arange(-20.0, 21.0), np.arange(-20.0, 21.0))
    points = np.column_stack([x.ravel(), y.ravel(), 6.0 * np.exp(-(x**2 + y**2).ravel() / 40.0)])
    index = np.arange(41 * 41).reshape(41, 41)
    a, b, c, d = (part.ravel() for part in (index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]))
    hill = Mesh(points, np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])]).astype(np.int64))
    assert measure_interior(hill).fault


@pytest.mark.parametrize("walls", [one_level(), walls_alone()], ids=["on a slab", "alone"])
def test_rooms_of_solid_walls_are_an_inside(walls):
    assert not measure_interior(walls).fault


def test_one_closed_room_of_solid_walls_is_an_inside():
    studio = [(0.0, 0.0, 6.0, 0.1), (5.9, 0.1, 6.0, 5.0), (0.1, 4.9, 5.9, 5.0), (0.0, 0.1, 0.1, 5.0)]
    assert not fault(storey(0.0, 2.5, studio))


def test_the_scan_of_one_room_looks_inwards():
    assert not fault(block(outward=False))


def test_a_sheet_with_a_gap_to_enter_by_may_be_a_room():
    gap = [sheet((0.0, 0.0), (5.0, 0.0), 0.0, 6.0), sheet((5.0 + GAP, 0.0), (12.0, 0.0), 0.0, 6.0)]
    assert not fault(block()[:1] + block()[2:], gap)


def test_a_sheet_with_walls_inside_is_a_house():
    inner = [sheet((6.0, 0.0), (6.0, 9.0), 0.0, 6.0), sheet((6.0, 4.0), (12.0, 4.0), 0.0, 6.0)]
    assert not fault(block(), inner)


def test_one_level_with_an_inside_is_enough():
    facade = joined(block())
    check_interior([facade, one_level()], "house.glb")
    with pytest.raises(Rejection, match=r"house\.glb: one closed sheet") as caught:
        check_interior([facade, facade], "house.glb")
    assert caught.value.reason is Reason.NO_INTERIOR


@pytest.mark.parametrize("size", [0.003, 2000.0])
def test_a_facade_of_any_size_is_one_though_no_unit_makes_a_house_of_it(tmp_path, size):
    small = joined([*block(), *slab(-0.1, 0.0, [(0.0, 0.0, 12.0, 9.0)])])
    path = tmp_path / "block.glb"
    as_trimesh(y_up(Mesh(small.vertices * size, small.faces))).export(path)
    (item,) = mesh_file.find(str(path))
    with pytest.raises(Rejection, match="a facade") as caught:
        list(mesh_file.read(item))
    assert caught.value.reason == Reason.NO_INTERIOR
    assert "no known unit" in caught.value.detail


def test_rooms_of_a_size_that_nobody_knows_are_a_matter_of_units(tmp_path):
    rooms = one_level()
    path = tmp_path / "rooms.glb"
    as_trimesh(y_up(Mesh(rooms.vertices * 0.003, rooms.faces))).export(path)
    (item,) = mesh_file.find(str(path))
    (level,) = mesh_file.read(item)
    assert level.guesses == ("tried scale",)
