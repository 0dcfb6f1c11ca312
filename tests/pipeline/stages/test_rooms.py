"""Stage rooms: names from the source, and spaces divided as its IfcSpaces divide them."""

import pytest
import shapely

from pipeline.stages.rooms import name_rooms
from pipeline.values import NamedRoom, SourceRoom, Spaces
from tests.builders.houses import level, shell

LEFT, RIGHT = shapely.box(0, 0, 4, 3), shapely.box(4.2, 0, 7.2, 3)


def named(*sources: SourceRoom, rooms: tuple[shapely.Polygon, ...] = (LEFT, RIGHT)) -> tuple[NamedRoom, ...]:
    return name_rooms(level(shell((0, 0, 7.2, 3)), rooms=sources), Spaces(shapely.Polygon(), rooms, ()))


def space(label: str, shape: shapely.Polygon) -> SourceRoom:
    return SourceRoom((label.lower(),), (label,), polygon=shape)


def boxed(label: str, *box: float) -> SourceRoom:
    return SourceRoom((label.lower(),), (label,), box=box)


def test_without_a_source_rooms_have_no_name() -> None:
    assert [(r.labels, r.words) for r in named()] == [((), ()), ((), ())]


def test_polygons_name_the_room_that_they_overlap_most() -> None:
    found = named(space("Kitchen", RIGHT.buffer(0.1)), space("Bedroom", LEFT.buffer(-0.2)))
    assert [r.labels for r in found] == [("Bedroom",), ("Kitchen",)]
    assert found[0].words == ("bedroom",)


def test_a_polygon_that_lies_elsewhere_names_nothing() -> None:
    assert [r.labels for r in named(space("Garage", shapely.box(20, 0, 25, 4)))] == [(), ()]


def test_a_name_that_is_no_label_is_kept_as_the_sources_word() -> None:
    found = named(SourceRoom(("Wintergarten",), (), polygon=LEFT))
    assert (found[0].labels, found[0].words) == ((), ("Wintergarten",))


def test_an_open_plan_is_divided_as_its_spaces_divide_it() -> None:
    whole = shapely.box(0, 0, 8, 4)
    found = named(
        space("Kitchen", shapely.box(0.1, 0.1, 2.9, 3.9)), space("Living_Room", shapely.box(3, 0, 8, 4)), rooms=(whole,)
    )
    by_label = {r.labels[0]: r.polygon for r in found}
    assert by_label["Living_Room"].area == pytest.approx(20, abs=0.5)
    assert by_label["Kitchen"].area == pytest.approx(12, abs=0.5)
    assert sum(r.polygon.area for r in found) == pytest.approx(whole.area, abs=1e-3)
    assert by_label["Kitchen"].intersection(by_label["Living_Room"]).area < 1e-6


def test_two_spaces_in_two_rooms_divide_nothing() -> None:
    found = named(space("Bedroom", LEFT), space("Kitchen", RIGHT))
    assert [r.polygon for r in found] == [LEFT, RIGHT]


def test_boxes_that_take_in_walls_and_overlap_still_fit_one_room_each() -> None:
    found = named(boxed("Kitchen", 3.8, -0.3, 7.5, 3.4), boxed("Bedroom", -0.4, -0.3, 4.6, 3.2))
    assert [r.labels for r in found] == [("Bedroom",), ("Kitchen",)]


def test_a_second_box_in_one_room_is_its_second_name() -> None:
    found = named(
        boxed("Living_Room", 0, 0, 4, 3), boxed("Kitchen", 0.5, 0.2, 2.5, 2.8), boxed("Bathroom", 4.2, 0, 7.2, 3)
    )
    assert found[0].labels == ("Living_Room", "Kitchen")
    assert found[1].labels == ("Bathroom",)


def test_a_box_far_away_names_nothing() -> None:
    assert [r.labels for r in named(boxed("Garage", 20, 0, 25, 4))] == [(), ()]


def test_a_box_between_the_arms_of_a_hall_names_nothing() -> None:
    hall = shapely.difference(shapely.box(0, 0, 10, 10), shapely.box(6, 6, 10, 10))
    (room,) = named(boxed("Hall", 0, 0, 10, 10), boxed("Lift", 7, 7, 9, 9), boxed("Bar", 1, 1, 3, 3), rooms=(hall,))
    assert room.labels == ("Hall", "Bar")


def test_a_room_with_two_words_has_two_labels() -> None:
    found = named(SourceRoom(("Kitchen", "Dining_Room"), ("Kitchen", "Dining_Room"), box=(0, 0, 4, 3)))
    assert found[0].labels == ("Kitchen", "Dining_Room")
