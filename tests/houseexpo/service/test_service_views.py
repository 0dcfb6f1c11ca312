"""Queries: what an address says, and what is found, against a slow and obvious search."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from houseexpo.errors import ConfigError
from houseexpo.plan.room_labels import LABELS
from houseexpo.service.search import MEASURES, RADII, MeasureTable, PlanSearch, Query, choose_bins, parse_query
from houseexpo.service.service import Service


def made_up(count: int = 300) -> MeasureTable:
    """A table of random measures, a tenth of which are not known."""
    rng = np.random.default_rng(7)
    names = [m.name for m in MEASURES if m.name not in {"reach", "narrowest"}]
    names += [f"{name} {radius}" for name in ("reach", "narrowest") for radius in RADII]
    numbers = {name: np.where(rng.random(count) < 0.1, np.nan, rng.integers(0, 9, count) * 1.0) for name in names}
    ids = [f"p{number:03}" for number in rng.permutation(count)]
    return MeasureTable(
        ids=ids,
        words=[f"{name} kitchen" if number % 3 else name for number, name in enumerate(ids)],
        labels=rng.random((25, count)) < 0.3,
        groups={
            "source": (("ifc", "mesh"), rng.integers(-1, 2, count).astype(np.int32)),
            "split": (("test", "train"), rng.integers(0, 2, count).astype(np.int32)),
        },
        _numbers=numbers,
    )


def slowly(table: MeasureTable, query: Query) -> list[str]:
    """What a query finds, plan by plan."""

    def good(row: int) -> bool:
        return (
            all(low <= table.numbers(name, query.radius)[row] <= high for name, (low, high) in query.ranges.items())
            and all(table.labels[LABELS.index(label), row] for label in query.labels)
            and not any(table.labels[LABELS.index(label), row] for label in query.without)
            and all(
                table.groups[name][1][row] >= 0 and table.groups[name][0][table.groups[name][1][row]] in wanted
                for name, wanted in query.groups.items()
            )
            and all(word in table.words[row] for word in query.text.split())
        )

    found = [row for row in range(len(table)) if good(row)]
    name = query.sort.removeprefix("-")
    if name == "id":
        ordered = sorted((table.ids[row] for row in found), reverse=query.sort.startswith("-"))
        return list(ordered)
    sign = -1 if query.sort.startswith("-") else 1

    def key(row: int) -> tuple[bool, float, str]:
        value = float(table.numbers(name, query.radius)[row])
        return math.isnan(value), 0.0 if math.isnan(value) else sign * value, table.ids[row]

    return [table.ids[row] for row in sorted(found, key=key)]


QUERIES: list[dict[str, str]] = [
    {},
    {"rooms": "3"},
    {"rooms": "2..5", "area": "..6", "sort": "-area"},
    {"labels": "Kitchen,Garage", "without": "Hall", "sort": "rooms"},
    {"source": "ifc,mesh", "split": "train", "quality": "1.."},
    {"reach": "2..", "radius": "0.3", "sort": "narrowest"},
    {"text": "KITCHEN p1", "sort": "-id"},
    {"source": "ifc", "rooms": "9"},
]


@pytest.mark.parametrize("given", QUERIES)
def test_what_is_found_is_what_a_slow_search_finds(given: dict[str, str]) -> None:
    table, query = made_up(), parse_query(given)
    views = PlanSearch(table)
    view = views.find(query)
    expected = slowly(table, query)
    assert [table.ids[row] for row in view.rows] == expected
    assert view.facets["found"] == len(expected)
    assert views.find(query) is view  # kept


def test_counts_leave_their_own_condition_out_but_labels_add_up() -> None:  # R1
    table = made_up()
    views = PlanSearch(table)
    view = views.find(parse_query({"rooms": "2..4", "source": "ifc", "labels": "Kitchen"}))
    without = slowly(table, parse_query({"source": "ifc", "labels": "Kitchen"}))
    rooms = table.numbers("rooms")
    known = sum(not np.isnan(rooms[table.ids.index(name)]) for name in without)
    assert sum(view.facets["measures"]["rooms"]["counts"]) == known
    assert view.facets["source"] == {
        name: len(slowly(table, parse_query({"rooms": "2..4", "source": name, "labels": "Kitchen"})))
        for name in ("ifc", "mesh")
    }
    for label in ("Kitchen", "Garage"):
        wanted = slowly(table, parse_query({"rooms": "2..4", "source": "ifc", "labels": f"Kitchen,{label}"}))
        assert view.facets["labels"][label] == len(wanted)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"rooms": "six"}, "rooms: expected a number or a range"),
        ({"rooms": "6..3"}, "rooms: expected a number or a range"),
        ({"area": "nan"}, "area: expected a number or a range"),
        ({"area": ".."}, "area: expected a number or a range"),
        ({"labels": "Kichen"}, "'Kitchen'"),
        ({"sort": "colour"}, "sort: expected one of id, rooms"),
        ({"radius": "9"}, "radius: expected one of 0.10"),
        ({"colour": "red"}, "found 'colour'"),
    ],
)
def test_what_cannot_be_read_is_named(given: dict[str, str], said: str) -> None:
    with pytest.raises(ConfigError, match=r"^(query|select): ") as caught:
        parse_query(given)
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("values", "whole", "first", "step", "counts"),
    [
        ([1, 2, 2, 4], True, 1, 1, [1, 2, 0, 1]),
        ([0.0, 0.5, 1.0], False, 0, 0.05, [1, *[0] * 9, 1, *[0] * 9, 1]),
        ([3.0, 3.0], False, 3, 1, [2]),
        ([float("nan")], False, 0, 1, []),
        ([*range(1000), 10**6], True, 0, 50, [50] * 19 + [51]),
    ],
)
def test_bars_are_round(values: Any, whole: bool, first: float, step: float, counts: list[int]) -> None:
    found = choose_bins(np.array(values, dtype=np.float64), whole=whole)
    assert (found.first, found.step) == (first, pytest.approx(step))
    assert found.counts(np.ones(len(values), dtype=bool)) == counts


def test_the_table_of_a_data_set_says_what_its_plans_say(service: Service) -> None:
    table = service.collections["homes"].now.views.table
    data = service.collections["homes"].dataset
    assert table.numbers("area").tolist() == [round(plan.area, 2) for plan in data]
    assert table.numbers("doors").tolist() == [1] * 4
    assert table.numbers("quality").tolist() == [0.95, 0.55, 0.75, 0.85]
    assert table.numbers("vertices").tolist() == [12] * 4
    assert [table.groups["split"][0][code] if code >= 0 else "" for code in table.groups["split"][1]] == [
        *("train", "", "train", "")
    ]
    assert table.groups["source"][0] == ("made",)
    assert table.words[1] == "b2 bedroom garage made b2.glb"
    assert table.value(0, "reach") is None  # recorded nowhere and not computed


def test_what_was_computed_before_is_known(service: Service, folder: Path) -> None:
    from tests.builders.services import service_of

    service.collections["homes"].dataset.column("navigability")
    again = service_of(folder).collections["homes"].now.views.table
    assert again.value(0, "reach", "0.20") == 1.0
    assert again.value(0, "narrowest", "0.20") == pytest.approx(0.8, abs=0.02)
    assert again.value(0, "reach", "0.35") == 1.0
