import pytest
import shapely

from pipeline.geometry.areas import enclosed_pieces
from pipeline.geometry.closing import bridges_and_rests, needed_to_separate, with_sides
from pipeline.values import Closer

SHELL = shapely.box(-0.2, -0.2, 7.4, 3.2).difference(shapely.box(0, 0, 7.2, 3))
INNER = shapely.union_all([shapely.box(4.0, 1.9, 4.2, 3.0), shapely.box(4.0, 0.0, 4.2, 1.0)])
DOOR = SHELL.union(INNER)
LINTEL = shapely.box(4.0, 1.0, 4.2, 1.9)
CORNICE = shapely.box(4.2, 2.8, 7.2, 3.0)


def in_its_plane(door: shapely.Geometry, piece: shapely.Geometry) -> tuple[list[Closer], list[Closer]]:
    return bridges_and_rests(door, [Closer(piece, "lintel")], *enclosed_pieces(shapely.union_all([door, piece])))


def test_a_piece_is_taken_apart_into_its_bridge_and_the_rest() -> None:
    console = shapely.box(4.2, 1.3, 5.5, 1.5)  # one body with the lintel
    (strip,), rest = in_its_plane(DOOR, LINTEL.union(console))
    assert strip.bridge is not None
    assert strip.bridge.strip().symmetric_difference(LINTEL).area < 1e-6
    assert shapely.union_all([c.polygon for c in rest]).symmetric_difference(console).area < 0.01


def test_a_piece_over_one_room_only_has_no_bridge() -> None:
    strips, rest = in_its_plane(DOOR.union(LINTEL), CORNICE)
    assert strips == []
    assert sum(c.polygon.area for c in rest) == pytest.approx(CORNICE.area, abs=1e-3)


def test_only_what_parts_two_spaces_is_needed() -> None:
    lintel, cornice = Closer(LINTEL, "lintel"), Closer(CORNICE, "lintel")
    closed = enclosed_pieces(shapely.union_all([DOOR, LINTEL, CORNICE]))
    assert needed_to_separate(DOOR, [], [lintel, cornice], *closed) == [lintel]
    assert needed_to_separate(DOOR, [lintel], [cornice], *closed) == []


def test_sides_are_looked_up_again() -> None:
    (closer,), _ = in_its_plane(DOOR, LINTEL)
    plane, rooms = enclosed_pieces(DOOR.union(LINTEL))
    assert rooms[0].bounds[0] == 0.0  # the larger room is the left one
    (found,) = with_sides([closer], rooms[::-1], plane)
    assert found.bridge is not None
    left, right = found.bridge.sides
    if found.bridge.across[0] < 0:
        left, right = right, left
    assert (left, right) == (1, 0)
