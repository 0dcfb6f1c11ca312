"""Bays and angled walls of sound homes, on a storey of two rooms side by side, and in homes that are made."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from pipeline.sources.sound_homes.footprint import add_bay, angle_wall
from pipeline.sources.sound_homes.home import make_sound_home
from pipeline.sources.sound_homes.values import Doorway, Storey, Window

WALL_M, OUTER_M = 0.1, 0.3
LIVING, BEDROOM = shapely.box(0.0, 0.0, 5.0, 5.0), shapely.box(5.1, 0.0, 9.0, 5.0)


def storey(window: tuple[float, float, float, float], door: tuple[float, float, float, float] | None = None) -> Storey:
    """Return a living room with a window and a front door in the south, and a bedroom east of it."""
    fronts = (Doorway(door or (1.0, -OUTER_M, 2.0, 0.0), (0, None)),)
    inner = (Doorway((5.0, 1.0, 5.1, 1.9), (0, 1)),)
    return Storey(("Living_Room", "Bedroom"), (LIVING, BEDROOM), inner, fronts, (Window(window, 0, 0.6, 2.0),), ())


def always(_: str, __: shapely.Polygon) -> bool:
    return True


@pytest.mark.parametrize(
    ("window", "outward"),
    [((1.5, 5.0, 3.5, 5.3), (0.0, 1.0)), ((-0.3, 1.5, 0.0, 3.5), (-1.0, 0.0))],
)
def test_a_bay_comes_forward_with_the_window_in_its_front(
    window: tuple[float, float, float, float], outward: tuple[float, float]
) -> None:
    before = storey(window)
    after = add_bay(before, OUTER_M, always, np.random.default_rng(0))
    room = after.rooms[0]
    assert isinstance(room, shapely.Polygon)
    assert room.covers(LIVING)
    assert after.rooms[1] is before.rooms[1]
    bay = room.difference(LIVING)
    assert 0.5 < bay.area < 3.0
    grown = np.subtract(room.bounds, LIVING.bounds)
    deep = grown[0] + grown[1] + grown[2] + grown[3]
    assert 0.6 <= abs(deep) <= 0.95
    assert np.sign(deep) == sum(outward)
    pane = shapely.box(*after.windows[0].rect)
    assert pane.intersection(room).area < 1e-6
    assert pane.distance(bay) < 1e-6
    assert pane.area == pytest.approx(OUTER_M * pane.length / 2 - OUTER_M**2, abs=1e-3)


def test_a_bay_has_no_place_where_another_room_or_a_door_is_near_or_limits_break() -> None:
    rng = np.random.default_rng(0)
    near = storey((3.8, 5.0, 4.8, 5.3))
    assert add_bay(near, OUTER_M, always, rng) is near
    beside = storey((2.2, -OUTER_M, 4.2, 0.0))  # the front door is at 1 to 2 m
    assert add_bay(beside, OUTER_M, always, rng) is beside
    free = storey((1.5, 5.0, 3.5, 5.3))
    assert add_bay(free, OUTER_M, lambda *_: False, rng) is free


def test_an_angled_wall_cuts_only_a_side_without_doors_and_windows() -> None:
    before = storey((1.5, 5.0, 3.5, 5.3))
    for seed in range(12):
        after = angle_wall(before, always, np.random.default_rng(seed))
        lost = shapely.union_all(before.rooms).difference(shapely.union_all(after.rooms))
        assert lost.area > 0.1
        openings = [each.rect for each in (*before.doors, *before.fronts)] + [each.rect for each in before.windows]
        assert min(lost.distance(shapely.box(*rect)) for rect in openings) >= 0.3
        assert (after.doors, after.fronts, after.windows) == (before.doors, before.fronts, before.windows)
        for one, other in zip(before.rooms, after.rooms, strict=True):
            assert one.buffer(1e-6).covers(other)
            assert other.area > 0.74 * one.area
    assert angle_wall(before, lambda *_: False, np.random.default_rng(0)) is before


def test_some_homes_have_bays_angled_walls_and_balconies_upstairs() -> None:
    homes = [make_sound_home(index, 3) for index in range(40)]
    oblique = [room for home in homes for storey in home.storeys for room in storey.rooms if _is_oblique(room)]
    assert oblique
    upstairs = [storey for home in homes for storey in home.storeys[1:] if storey.balconies]
    assert upstairs
    for each in upstairs:
        doors = [door.rooms for door in each.doors if door.rooms[1] in each.balconies]
        assert doors
        assert all(each.labels[room] in {"Bedroom", "Child_Room"} for room, _ in doors)


def _is_oblique(room: shapely.Polygon) -> bool:
    steps = np.abs(np.diff(shapely.get_coordinates(room), axis=0))
    return bool((steps.min(axis=1) > 0.02).any())
