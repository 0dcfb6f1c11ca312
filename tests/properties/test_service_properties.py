"""An address that a query writes is read as the same query, whatever was asked for."""

from __future__ import annotations

from urllib.parse import parse_qsl

from hypothesis import example, given
from hypothesis import strategies as st

from houseexpo.service.search import GROUPS, NAMES, RADII, SORTS, parse_query
from tests.builders.tries import tries

ENDS = st.floats(allow_nan=False, allow_infinity=False)
RANGES = st.tuples(ENDS, ENDS).map(sorted).map(lambda ends: f"{ends[0]!r}..{ends[1]!r}")
LABELS = st.lists(st.sampled_from(["Kitchen", "kitchen", "Garage", "living room", " Hall "])).map(",".join)
WORDS = st.text(max_size=210)
ASKED = st.fixed_dictionaries(
    {},
    optional={
        **dict.fromkeys(NAMES, RANGES | ENDS.map(repr)),
        **dict.fromkeys(("labels", "without"), LABELS),
        **dict.fromkeys((*GROUPS, "text"), WORDS),
        "radius": st.sampled_from(RADII),
        "sort": st.sampled_from([*SORTS, *(f"-{name}" for name in SORTS)]),
    },
)


@tries(80)
@example({"long_side": "7.1000001.."})
@example({"rooms": "5e-324..", "source": ","})
@example({"labels": "Kitchen,kitchen", "text": "\u00df" * 200})
@given(ASKED)
def test_a_query_is_read_as_it_was_written(asked: dict[str, str]) -> None:
    query = parse_query(asked)
    assert parse_query(dict(parse_qsl(str(query)))) == query
