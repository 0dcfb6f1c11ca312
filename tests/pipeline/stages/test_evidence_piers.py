"""Piers of a doorway that end below the walls beside them are wall; a cupboard beside a door is none."""

from dataclasses import replace

import pytest
import shapely

from pipeline.config import EvidenceConfig
from pipeline.stages.evidence import gather_evidence
from pipeline.values import Evidence
from tests.builders.houses import Hole, Parts, gap, level, shell, wall

T = 0.4
LEFT, RIGHT = (1.0, -T, 1.8, 0.0), (2.9, -T, 3.7, 0.0)


def evidence(parts: Parts) -> Evidence:
    return gather_evidence(level(parts), EvidenceConfig())


def test_piers_under_a_band_of_glass_are_wall() -> None:
    piers = [*wall(LEFT, top=2.2), *wall(RIGHT, top=2.2)]
    lintel = wall((1.8, -T, 2.9, 0.0), foot=2.1)
    found = evidence([*shell((0, 0, 6, 4), T, front=[gap(1.0, 3.7)]), *piers, *lintel])
    assert found.furniture.is_empty
    for pier in (LEFT, RIGHT):
        assert found.walls.intersection(shapely.box(*pier)).area == pytest.approx(0.8 * T, abs=0.01)


def test_a_cupboard_beside_a_door_is_furniture() -> None:
    house = shell((0, 0, 6, 4), T, front=[Hole(1.8, 2.7)])
    found = evidence([*house, *wall((2.9, 0.0, 3.9, 0.5), top=2.1)])
    assert found.furniture.area == pytest.approx(0.5, abs=0.03)


def test_a_partition_lower_than_the_walls_is_wall_though_it_ends_in_a_pillar() -> None:
    """Thin all along, it stands free of the front; a pillar at its end is thicker than a cupboard's least."""
    stub = [*wall((3.0, 1.5, 3.12, 4.0), top=2.2), *wall((2.85, 1.2, 3.27, 1.5), top=2.2)]
    found = evidence([*shell((0, 0, 6, 4), T), *stub])
    assert found.furniture.is_empty
    assert found.walls.covers(shapely.box(3.01, 1.3, 3.11, 3.9))


def test_a_corner_of_the_wall_under_a_higher_facade_is_wall() -> None:
    """The sheet of a facade goes on above it, and the lintels over windows at both its ends; a cupboard has a back."""
    corner = [*wall((0.0, -T, 1.5, 0.0), top=2.2), *wall((-T, -T, 0.0, 1.5), top=2.2)]
    facade = [*wall((-T, -T - 0.03, 6.4, -T), top=2.6), *wall((-T - 0.03, -T - 0.03, -T, 4.4), top=2.6)]
    windows = [*wall((1.5, -T, 2.5, 0.0), foot=2.1), *wall((-T, 1.5, 0.0, 2.5), foot=2.1)]
    rest = [*wall((2.5, -T, 6.4, 0.0)), *wall((-T, 2.5, 0.0, 4.4)), *wall((6, 0, 6.4, 4.4)), *wall((0, 4, 6, 4.4))]
    found = evidence([*corner, *facade, *windows, *rest])
    assert found.furniture.is_empty
    assert found.walls.covers(shapely.box(-T + 0.02, -T + 0.02, 1.4, -0.02))


def test_what_the_source_names_wall_is_no_cupboard() -> None:
    house = level([*shell((0, 0, 6, 4), T, front=[Hole(1.8, 2.7)]), *wall((2.9, 0.0, 3.9, 0.5), top=2.1)])
    found = gather_evidence(replace(house, only_walls=True), EvidenceConfig())
    assert found.furniture.is_empty
    assert found.walls.covers(shapely.box(3.0, 0.1, 3.8, 0.4))


def test_a_cupboard_between_two_screens_is_furniture() -> None:
    """It has its back at a wall."""
    place = (2.7, 3.35, 3.3, 4.0)
    screens = [*wall((0.0, 3.575, 2.7, 3.775)), *wall((3.3, 3.575, 6.0, 3.775))]
    found = evidence([*shell((0, 0, 6, 4)), *screens, *wall(place, top=2.2)])
    assert found.furniture.covers(shapely.box(*place).buffer(-0.02))
