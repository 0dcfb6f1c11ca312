"""What is asked of a drawing of which no plan came: its size, then layer after layer until one is the walls."""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np
import pytest

from houseexpo.corrections import Override
from houseexpo.corrections.vocabulary import Correction
from houseexpo.dataset.source_records import SourceRecord
from houseexpo.floorplan import decode
from houseexpo.grids.frame import source_points_from_plan
from houseexpo.service.review.question import Question
from houseexpo.service.review.sources import SourceView
from houseexpo.service.review.unread_questions import layer_questions, lines_of_layer, unread_questions
from pipeline.batch.listing import list_inputs
from pipeline.cli_common import load_build_config
from pipeline.source_record import SourceReader
from tests.pipeline.sources.test_unread_lines import ring, sheet


@pytest.fixture
def read(tmp_path: Path) -> tuple[str, SourceReader]:
    """A sheet on which no layer has a name: a house at 1:50 in mm, and an elevation far beside it."""
    ezdxf = pytest.importorskip("ezdxf")
    document = ezdxf.new("R2010", units=4)
    for layer, points in sheet():  # the reader passes over dimensions
        document.modelspace().add_lwpolyline(points.tolist(), dxfattribs={"layer": f"{layer}-DIM"})
    document.saveas(tmp_path / "sheet.dxf")
    config = load_build_config(None, {"sources": (str(tmp_path / "sheet.dxf"),)})
    (item,) = list_inputs(config)
    return item.id, SourceReader(config, item.id)


def asked(record: SourceRecord, *left: str) -> list[Question]:
    (level,) = record.levels
    assert not level.plans
    return list(unread_questions(SourceView(record, level, None), left))


def test_the_size_is_asked_about_first_and_then_layer_after_layer(read: tuple[str, SourceReader]) -> None:
    name, reader = read
    record = reader.record({})
    size, layer = asked(record)
    assert [size.answers[0].action, size.answers[0].text] == ["units", "0.05"]
    assert layer.key == "layer at A-1-DIM"
    stated = reader.record({name: Override(units="0.05")})
    (again,) = asked(stated)
    assert again == layer
    (other,) = asked(stated, layer.key)
    assert other.key != layer.key
    (third,) = asked(reader.record({name: Override(units="0.05", wall_layers=("E-DIM",))}))
    assert third.key == layer.key  # an elevation encloses nothing
    assert third.answers[0].text == "E-DIM\nA-1-DIM"
    assert [layer.answers[0].action, layer.answers[0].text] == ["wall_layers", "A-1-DIM"]
    (level,) = reader.record({name: Override(units="0.05", wall_layers=("A-1-DIM",))}).levels
    (plan,) = (decode(bytes(each.plan)) for each in level.plans)
    assert not level.plans[0].is_founded  # as if the layer had been called so
    assert sorted(room.area for room in plan.rooms) == pytest.approx([4.7 * 7.6, 4.7 * 7.6], rel=0.05)


def test_without_layers_all_lines_of_a_kind_are_asked_about_at_once(read: tuple[str, SourceReader]) -> None:
    _, reader = read
    known = reader.record({})
    record = msgspec.structs.replace(known, takes=tuple(word for word in known.takes if word != "wall_layers"))
    *_, asks = asked(record)
    walls = asks.answers[0]
    assert walls.action == "wall"
    (level,) = record.levels
    name = asks.key.removeprefix("layer at ")
    assert 1 + len(walls.more) == len(lines_of_layer(SourceView(record, level, None), name))
    line = source_points_from_plan(level.frame, np.asarray(walls.more[0])).round(3).tolist()
    said = [Correction("wall", tuple(map(tuple, line)))]
    *_, other = unread_questions(SourceView(record, level, None), (), said)
    assert other.key != asks.key


def test_of_a_plan_by_guessed_layers_the_one_that_draws_walls_in_its_rooms_is_asked_about(tmp_path: Path) -> None:
    ezdxf = pytest.importorskip("ezdxf")
    document = ezdxf.new("R2010", units=6)

    def draw(layer: str, *rings: list[list[float]]) -> None:
        for each in rings:
            document.modelspace().add_lwpolyline(each, dxfattribs={"layer": layer})

    draw("GF", ring(0, 0, 10, 8), ring(0.2, 0.2, 9.8, 7.8))
    draw("DETAILS", ring(4, 0.2, 4.2, 7.8), ring(4.2, 4, 9.8, 4.2))  # a word that says no wall
    draw("TREADS", *([[5.0 + k / 4, 5.0], [5.0 + k / 4, 7.0]] for k in range(12)))
    document.saveas(tmp_path / "plan.dxf")
    config = load_build_config(None, {"sources": (str(tmp_path / "plan.dxf"),)})
    (item,) = list_inputs(config)
    record = SourceReader(config, item.id).record({})
    (level,) = record.levels
    assert level.layers == ("DETAILS",)
    view = SourceView(record, level, level.plans[0])
    (question,) = layer_questions(view, (), (5.0, 4.0))
    assert question.answers[0].text == "DETAILS"
    x, y = view.origin
    shown = [question.answers[0].points, *question.answers[0].more]
    assert np.min(shown, axis=(0, 1)).tolist() == pytest.approx([4.0 - x, 0.2 - y], abs=0.01)
    assert not list(layer_questions(view, {question.key}, (5.0, 4.0)))
    (said,) = SourceReader(config, item.id).record({item.id: Override(wall_layers=("GF", "DETAILS"))}).levels
    assert (len(decode(bytes(said.plans[0].plan)).rooms), said.layers) == (3, ())


def test_the_view_holds_the_main_part_and_points_may_be_set_at_all_lines(read: tuple[str, SourceReader]) -> None:
    record = read[1].record({})
    view = SourceView(record, record.levels[0], None)
    x1, y1, x2, y2 = view.pictured
    assert (x2 - x1, y2 - y1) == pytest.approx((14.0, 12.0))  # with 1 m around it
    assert view.bounds_around(None)[2] > 100
    assert record.levels[0].extent == (12.0, 10.0)


def test_layers_that_are_left_out_are_neither_shown_nor_asked_about(read: tuple[str, SourceReader]) -> None:
    name, reader = read
    record = reader.record({name: Override(drop_nodes=("A-1*", "E*"))})
    assert {each.kind for each in record.levels[0].strokes} == {"A-0-DIM", "A-2-DIM", "A-3-DIM"}
    assert {"A-1-DIM", "E-DIM"} <= set(record.names)  # they can be taken in again
    assert "A-1-DIM" not in record.levels[0].layers
    assert record.unit_m == reader.record({}).unit_m  # what is said keeps its place
    points = np.concatenate([np.asarray(each.points) for each in record.levels[0].strokes])
    assert np.ptp(points[:, 0]) == pytest.approx(12.0)
