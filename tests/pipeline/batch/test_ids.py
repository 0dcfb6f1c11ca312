from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from pipeline.batch.assemble import make_unique_ids
from tests.builders.tries import tries


def test_an_id_that_stands_alone_stays() -> None:
    assert make_unique_ids(["b", "a"], ["1" * 64, "2" * 64]) == ["b", "a"]


def test_equal_ids_all_get_eight_digits() -> None:
    assert make_unique_ids(["x", "y", "x"], ["ab" * 32, "cd" * 32, "ef" * 32]) == ["x_abababab", "y", "x_efefefef"]


def test_equal_ids_of_equal_content_are_numbered() -> None:
    assert make_unique_ids(["x", "x"], ["ab" * 32, "ab" * 32]) == ["x_abababab", "x_abababab_2"]


def test_an_id_made_anew_is_not_one_that_stands_already() -> None:
    assert make_unique_ids(["x", "x", "x_aaaaaaaa_2"], ["aa" * 32] * 3) == [
        "x_aaaaaaaa",
        "x_aaaaaaaa_3",
        "x_aaaaaaaa_2",
    ]


def test_ids_that_differ_by_case_only_name_one_file_on_some_systems() -> None:
    assert make_unique_ids(["A", "a"], ["12" * 32, "34" * 32]) == ["A_12121212", "a_34343434"]


@tries(100)
@given(st.lists(st.tuples(st.sampled_from(["x", "X", "x_aa", "x_aaaaaaaa", "x_aaaaaaaa_2"]), st.sampled_from("ab"))))
def test_no_two_ids_are_equal(pairs: list[tuple[str, str]]) -> None:
    settled = make_unique_ids([name for name, _ in pairs], [digit * 64 for _, digit in pairs])
    assert len({name.casefold() for name in settled}) == len(pairs)
