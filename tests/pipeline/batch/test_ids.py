from __future__ import annotations

from pipeline.batch.ids import settle


def test_an_id_that_stands_alone_stays() -> None:
    assert settle(["b", "a"], ["1" * 64, "2" * 64]) == ["b", "a"]


def test_equal_ids_all_get_eight_digits() -> None:
    assert settle(["x", "y", "x"], ["ab" * 32, "cd" * 32, "ef" * 32]) == ["x_abababab", "y", "x_efefefef"]


def test_equal_ids_of_equal_content_are_numbered() -> None:
    assert settle(["x", "x"], ["ab" * 32, "ab" * 32]) == ["x_abababab", "x_abababab_2"]
