"""Numbers from a key and a counter."""

from __future__ import annotations

import math

import numpy as np

from houseexpo.pseudoslam.kernels.hashing import normal, uniform

KEYS = (0, 1, 2**31, 2**32, 0x1234567890ABCDE)


def slow_uniform(key: int, counter: int) -> float:
    def mixed(word: int) -> int:
        for shift, factor in ((16, 0x21F0AAAD), (15, 0x735A2D97)):
            word ^= word >> shift
            word = word * factor % 2**32
        return word ^ word >> 15

    word = mixed(counter % 2**32) ^ key % 2**32
    return (mixed(mixed(word) ^ key >> 32 ^ counter >> 32) + 0.5) / 2**32


def test_it_is_what_its_twin_says() -> None:
    for key in KEYS:
        assert [uniform(key, n) for n in (0, 1, 7, 2**33 + 5)] == [slow_uniform(key, n) for n in (0, 1, 7, 2**33 + 5)]


def test_uniform_numbers_are_uniform_and_do_not_follow_each_other() -> None:
    for key in KEYS:
        numbers = np.array([uniform(key, n) for n in range(4000)])
        assert np.histogram(numbers, 10, (0, 1))[0].std() < 40  # 19 expected
        assert abs(np.corrcoef(numbers[1:], numbers[:-1])[0, 1]) < 0.05
    one, other = ([uniform(key, n) for n in range(4000)] for key in (5, 6))
    assert abs(np.corrcoef(one, other)[0, 1]) < 0.05


def test_normal_numbers_are_normal() -> None:
    numbers = np.array([normal(9, n) for n in range(6000)])
    assert abs(numbers.mean()) < 0.05
    assert abs(numbers.std() - 1) < 0.03
    assert math.isclose((abs(numbers) < 1).mean(), 0.6827, abs_tol=0.02)
    assert math.isclose((abs(numbers) < 2).mean(), 0.9545, abs_tol=0.01)
