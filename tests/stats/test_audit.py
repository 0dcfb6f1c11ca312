"""The rules of real homes, on plans with one known fault each; clear width against a slow, plain twin."""

from __future__ import annotations

import itertools
import json
import math
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely import Polygon
from typer.testing import CliRunner

from houseexpo.analysis.audit import (
    PlanAudit,
    audit_plan,
    largest_circle_diameter,
)
from houseexpo.commands.app import make_app
from houseexpo.floorplan import FloorPlan, save_plan
from houseexpo.plan import Door, DoorKind, Room
from stats.html_report import report_html
from stats.measure import DataSetSummary
from stats.record import measure_and_audit
from stats.report import Report
from stats.summary import PlanSummary
from tests.builders.tries import tries
from tests.stats.conftest import box, outline

Box = tuple[float, float, float, float]


def home(*rooms: tuple[str, Box] | Room, doors: tuple[tuple[int, int | None], ...] = ()) -> FloorPlan:
    """Return a plan of rooms, given as label and box, and of doors that join them by number."""
    made = tuple(
        each if isinstance(each, Room) else Room(number, each[0], box(*each[1])) for number, each in enumerate(rooms)
    )
    joined = tuple(
        Door(number, "door" if pair[1] is not None else "entrance", ((0, 0), (0, 0.8)), 0.8, box(0, 0, 0.1, 0.8), pair)
        for number, pair in enumerate(doors)
    )
    x = [x for room in made for x in room.ring[:, 0]]
    y = [y for room in made for y in room.ring[:, 1]]
    return FloorPlan("home", box(min(x), min(y), max(x), max(y)), len(made), {}, (), made, joined)


SOUND = (("Living_Room", (0.0, 0.0, 5.0, 4.0)), ("Bedroom", (5.2, 0.0, 8.2, 4.0)), ("Bathroom", (8.3, 0.0, 10.0, 4.0)))


def audited(plan: FloorPlan) -> PlanAudit:
    found = audit_plan(plan)
    assert found is not None
    return found


def test_a_sound_home_breaks_no_rule() -> None:
    found = audited(home(*SOUND, doors=((0, 1), (0, None))))
    assert found.broken_rules() == set()
    assert list(found.reasons()) == []
    assert (found.overlap, found.holes, found.pieces) == (0.0, 0.0, 1)
    assert [room.type for room in found.rooms] == ["living room", "bedroom", "bathroom"]
    assert [room.area_m2 for room in found.rooms] == pytest.approx([20.0, 12.0, 6.8])
    assert [room.width_m for room in found.rooms] == pytest.approx([4.0, 3.0, 1.7], abs=0.011)


@pytest.mark.parametrize(
    ("label", "size", "rule", "reason"),
    [
        ("Bedroom", (0.0, 0.0, 2.2, 2.2), "area", "room 0 (bedroom): 4.84 m², at least 5"),
        ("Kitchen", (0.0, 0.0, 1.4, 3.0), "width", "room 0 (kitchen): 1.40 m wide, at least 1.5"),
        ("Bathroom", (0.0, 0.0, 1.2, 4.3), "aspect", "room 0 (bathroom): aspect 3.6, at most 3.5"),
        ("Garage", (0.0, 0.0, 3.0, 3.0), "area", "room 0 (garage): 9.00 m², at least 10"),
        ("Toilet", (0.0, 0.0, 0.9, 1.8), "width", "room 0 (bathroom): 0.90 m wide, at least 1"),
    ],
)
def test_a_room_breaks_one_rule(label: str, size: Box, rule: str, reason: str) -> None:
    found = audited(home((label, size)))
    assert found.broken_rules() == {rule}
    assert list(found.reasons()) == [reason]


def test_a_room_without_daylight() -> None:
    plan = home(
        ("Living_Room", (0.0, 0.0, 5.0, 4.0)),
        ("Kitchen", (5.1, 0.0, 8.1, 4.0)),
        ("Bedroom", (8.2, 0.0, 12.2, 4.0)),
        ("Dining_Room", (0.0, 4.1, 4.0, 8.1)),
        ("Bathroom", (4.1, 4.1, 7.0, 8.1)),
        ("Balcony", (12.3, 0.0, 14.3, 4.0)),
        ("Office", (7.1, 4.1, 12.0, 8.1)),
    )

    def hole(kind: DoorKind, rooms: tuple[int, int | None], width: float = 1.0) -> Door:
        return Door(0, kind, ((0.0, 0.0), (0.0, width)), width, box(0, 0, 0.1, width), rooms)

    def dark(windows: tuple[Door, ...], *doors: Door) -> set[int]:
        holes = [tuple(replace(each, id=k) for k, each in enumerate(several)) for several in (doors, windows)]
        found = audited(replace(plan, doors=holes[0], windows=holes[1]))
        rooms = {room.id for room in found.rooms if "light" in room.broken_rules()}
        assert ("light" in found.broken_rules()) == bool(rooms)
        assert all(f"room {room}" in " ".join(found.reasons()) for room in rooms)
        return rooms

    window = hole("window", (0, None))
    assert dark(()) == set(), "the source states no windows"
    assert dark((window,)) == {1, 2, 3, 6}
    assert dark((hole("window", (0, 1)),)) == {0, 1, 2, 3, 6}, "a window between two rooms"
    assert dark((window,), hole("door", (2, 5))) == {1, 3, 6}, "a door to a balcony"
    assert dark((window,), hole("opening", (1, 0), 1.5), hole("door", (3, 0), 1.6)) == {2, 6}
    assert dark((window,), hole("opening", (1, 0), 1.4), hole("opening", (1, 4), 2.0)) == {1, 2, 3, 6}
    assert dark((window,), hole("entrance", (2, None), 0.9), hole("entrance", (6, None), 1.8)) == {1, 2, 3}


def test_daylight_does_not_count_beside_public_data_sets() -> None:
    window = Door(0, "window", ((0, 0), (0, 1)), 1.0, box(0, 0, 0.1, 1.0), (0, None))
    summary = PlanSummary()
    summary.take(measure_and_audit(replace(home(*SOUND), windows=(window,))))
    report = summary.report()
    assert (report["audit"]["break_a_rule"], report["audit"]["rules"]["light"]) == (0, 1)
    assert report["audit"]["rooms"]["bedroom"]["light"] == 1
    assert (report["room_windows"]["sum"], report["lit"]["mean"]) == (1, 0.5)


def test_rooms_that_overlap() -> None:
    found = audited(home(("Bedroom", (0.0, 0.0, 4.0, 4.0)), ("Bedroom", (3.8, 0.0, 7.8, 4.0))))
    assert found.broken_rules() == {"overlap"}
    assert found.overlap == pytest.approx(0.8 / 31.2, abs=1e-6)
    less = audited(home(("Bedroom", (0.0, 0.0, 4.0, 4.0)), ("Bedroom", (3.9, 0.0, 7.9, 4.0))))
    assert less.broken_rules() == set(), "1.3% is within the rule"


def ring_of_four(hole: float) -> FloorPlan:
    """Return four rooms round a square that belongs to no room, with a side of ``hole`` metres."""
    side = 4.0
    whole = 2 * side + hole
    return home(
        ("Bedroom", (0.0, 0.0, side + hole, side)),
        ("Bedroom", (side + hole, 0.0, whole, side + hole)),
        ("Bedroom", (side, side + hole, whole, whole)),
        ("Bedroom", (0.0, side, side, whole)),
    )


def test_a_hole_that_is_wider_than_a_wall() -> None:
    found = audited(ring_of_four(2.0))
    assert found.broken_rules() == {"holes"}
    assert found.holes == pytest.approx(4.0 / 100.0, abs=0.001)
    assert audited(ring_of_four(0.5)).holes == 0.0, "no wider than a wall"
    assert audited(ring_of_four(1.2)).broken_rules() == set(), "1.7% is within the rule"


@pytest.mark.parametrize(("gap_m", "pieces"), [(0.1, 1), (0.59, 1), (0.61, 2), (3.0, 2)])
def test_rooms_further_apart_than_a_wall_are_two_pieces(gap_m: float, pieces: int) -> None:
    found = audited(home(("Bedroom", (0.0, 0.0, 3.0, 30.0)), ("Bedroom", (3.0 + gap_m, 0.0, 6.0 + gap_m, 30.0))))
    assert found.pieces == pieces
    assert ("pieces" in found.broken_rules()) == (pieces > 1)


@pytest.mark.parametrize(("shared_m", "joined"), [(0.2, False), (0.7, True)])
def test_rooms_adjoin_on_half_a_metre_of_wall(shared_m: float, joined: bool) -> None:
    # rooms that are grown by 0.3 m overlap 0.3 m beyond each end of the wall that they share: 0.6 m more
    found = audited(home(("Bedroom", (0.0, 0.0, 3.0, 3.0)), ("Bedroom", (3.0, 3.6 - shared_m, 6.0, 6.6))))
    assert (found.pieces == 1) == joined


def test_an_outline_is_not_audited() -> None:
    assert audit_plan(outline("a")) is None
    assert "audit" not in Report(DataSetSummary("a")).values()["plans"]


def slow_clear_width(shape: Polygon, step: float) -> float:
    """Return twice the greatest distance from a point of a grid inside a polygon to its boundary."""
    corners = [list(ring.coords) for ring in (shape.exterior, *shape.interiors)]
    edges = [pair for ring in corners for pair in itertools.pairwise(ring)]

    def is_inside(x: float, y: float) -> bool:
        crossed = 0
        for (x1, y1), (x2, y2) in edges:
            if (y1 > y) != (y2 > y) and x < x1 + (y - y1) * (x2 - x1) / (y2 - y1):
                crossed += 1
        return crossed % 2 == 1

    def distance(x: float, y: float, edge: tuple[tuple[float, ...], tuple[float, ...]]) -> float:
        (x1, y1), (x2, y2) = edge
        length = (x2 - x1) ** 2 + (y2 - y1) ** 2
        along = 0.0 if length == 0 else max(0.0, min(1.0, ((x - x1) * (x2 - x1) + (y - y1) * (y2 - y1)) / length))
        return math.hypot(x - x1 - along * (x2 - x1), y - y1 - along * (y2 - y1))

    x1, y1, x2, y2 = shape.bounds
    best = 0.0
    for i in range(int((x2 - x1) / step) + 1):
        for j in range(int((y2 - y1) / step) + 1):
            x, y = x1 + (i + 0.5) * step, y1 + (j + 0.5) * step
            if is_inside(x, y):
                best = max(best, min(distance(x, y, edge) for edge in edges))
    return 2.0 * best


L_SHAPE = Polygon([(0, 0), (4, 0), (4, 1.5), (1.5, 1.5), (1.5, 4), (0, 4)])


@pytest.mark.parametrize(
    ("shape", "width"),
    [
        (Polygon(box(0, 0, 5, 2)), 2.0),
        (Polygon([(0, 0), (3, 0), (0, 4)]), 2.0),
        # the circle in the corner touches both outer walls and the inner corner: 2r = 2 * 1.5 * (2 - sqrt(2))
        (L_SHAPE, 3.0 * (2 - math.sqrt(2))),
        (Polygon(box(0, 0, 4, 4), [box(1.5, 1.5, 2.5, 2.5)]), 3.0 * (2 - math.sqrt(2))),
    ],
)
def test_clear_widths_that_are_known(shape: Polygon, width: float) -> None:
    assert width - 0.0101 <= largest_circle_diameter(shape) <= width + 1e-9
    assert slow_clear_width(shape, 0.05) == pytest.approx(width, abs=0.08)


@tries(12)
@given(
    st.lists(st.tuples(st.floats(0.6, 3.0), st.floats(0.5, 1.0)), min_size=4, max_size=9),
    st.booleans(),
)
def test_clear_width_is_that_of_its_slow_twin(spokes: list[tuple[float, float]], with_hole: bool) -> None:
    """Star-shaped rooms: every corner lies at another distance and direction from the origin."""
    turns = [0.0]
    for _, step in spokes:
        turns.append(turns[-1] + step)
    corners = [
        (length * math.cos(2 * math.pi * turn / turns[-1]), length * math.sin(2 * math.pi * turn / turns[-1]))
        for (length, _), turn in zip(spokes, turns, strict=False)
    ]
    shape = Polygon(corners)
    if with_hole:
        shape = shape.difference(Polygon(box(-0.1, -0.1, 0.1, 0.1)))
    if shape.geom_type != "Polygon" or shape.area < 0.5:
        return
    step = 0.05
    fast, slow = largest_circle_diameter(shape), slow_clear_width(shape, step)
    assert slow <= fast + 0.0101, "no point has a larger circle than the best"
    assert fast <= slow + 2 * step, "a point of the grid lies near the best one"


def test_audits_add_up_in_any_order() -> None:
    plans = [home(*SOUND), ring_of_four(2.0), home(("Bedroom", (0.0, 0.0, 2.2, 2.2)))]
    whole, parts = PlanSummary(), [PlanSummary() for _ in plans]
    for plan, part in zip(plans, parts, strict=True):
        whole.take(measure_and_audit(plan))
        part.take(measure_and_audit(plan))
    total = PlanSummary()
    for part in reversed(parts):
        total.merge(part)
    assert total.report() == whole.report()
    assert whole.report()["audit"]["break_a_rule"] == 2
    assert whole.report()["audit"]["rules"]["holes"] == 1
    assert whole.report()["audit"]["mean_shares"]["area"] == pytest.approx(1 / 3, abs=1e-4)


@pytest.fixture
def homes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path / "cache"))
    folder = tmp_path / "homes"
    folder.mkdir()
    for name, plan in (("sound", home(*SOUND)), ("small", home(("Bedroom", (0.0, 0.0, 2.2, 2.2))))):
        save_plan(replace(plan, id=name), folder / f"{name}.json")
    return folder


def run(*words: str | Path, code: int = 0) -> str:
    done = CliRunner().invoke(make_app(), ["stats", *map(str, words)], env={"COLUMNS": "200"})
    assert done.exit_code == code, done.output
    return done.stdout if code == 0 else done.stderr


def test_the_command_lists_what_breaks_a_rule(homes: Path) -> None:
    assert run(homes, "--audit", "--workers", "1") == "small\troom 0 (bedroom): 4.84 m², at least 5\n"
    told = json.loads(run(homes, "--audit", "--json", "--workers", "1"))
    assert told == {"audited": 2, "break_a_rule": {"small": ["room 0 (bedroom): 4.84 m², at least 5"]}, "broken": []}


def test_a_list_beside_what_it_would_drop_is_refused(homes: Path, tmp_path: Path) -> None:
    for words in (
        ("--list-bad", "--audit"),
        ("--audit", "--out", tmp_path / "a.html"),
        ("--list-bad", "--compare", homes),
    ):
        assert f"leave out {words[1]}" in " ".join(run(homes, *words, code=2).split())
    assert not (tmp_path / "a.html").exists()


def test_the_report_shows_the_data_set_beside_the_public_ones(homes: Path) -> None:
    shown = run(homes, "--workers", "1")
    assert "50.00%" in next(line for line in shown.splitlines() if "Any of the first six" in line)
    for name in ("homes", "Swiss Dwellings", "CubiCasa5k", "floorplan_eval"):
        assert name in shown
    told = json.loads(run(homes, "--json", "--workers", "1"))
    assert told["plans"]["audit"]["break_a_rule_share"] == 0.5


def test_the_page_has_the_audit_only_where_there_are_rooms(folder: Path) -> None:
    found = DataSetSummary("one")
    found.whole.take(measure_and_audit(home(*SOUND, doors=((0, 1),))))
    html = report_html(Report(found))
    for words in ("Beside real homes", "Swiss Dwellings", "Sizes of rooms"):
        assert words in html
    bare = DataSetSummary("bare")
    bare.whole.add(outline("a"))
    assert "Beside real homes" not in report_html(Report(bare))
