"""Radios: the formula against arithmetic, and the kernels against slow twins."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.kernels.radio import find_heard, length_in_walls, received_dbm
from houseexpo.pseudoslam.teams.tasks import Radio


def test_received_power_by_hand() -> None:
    radio = Radio("signal").link(1.0)
    assert received_dbm(radio, 1.0, 0.0) == -51.0  # the loss at the reference distance
    assert received_dbm(radio, 35.0, 0.0) == pytest.approx(-71.0)  # ten times as far: 20 dB
    assert received_dbm(radio, 1.0, 0.1) == -51.0  # one unit of wall
    assert received_dbm(radio, 1.0, 1.0) == pytest.approx(-91.0)  # ten units: 40 dB
    assert received_dbm(radio, 7.0, 0.2) == pytest.approx(-51.0 - 20 * math.log10(2) - 40 * math.log10(2))


def test_who_hears_whom() -> None:
    walls = np.zeros((40, 100), np.uint8)
    walls[:30, 50:54] = 1  # 0.4 m of wall at 10 px/m
    places = np.array([[20.5, 10.5], [40.5, 10.5], [60.5, 10.5], [60.5, 35.5]])
    # from 1 to 3 the line crosses 0.5 m of wall, 28 dB; from 0 to 3 it crosses a corner, 0.2 m, 12 dB
    pairs = {"none": "", "always": "01 02 03 12 13 23", "range": "01 12 23", "sight": "01 23", "signal": "01 03 23"}
    for model, wanted in pairs.items():
        found = np.zeros((4, 4), np.uint8)
        find_heard(Radio(model, range_m=2.6).link(0.1), walls, places, found)  # type: ignore[arg-type]  # a name
        assert {f"{i}{j}" for i, j in np.argwhere(np.triu(found)).tolist()} == set(wanted.split()), model
        assert (found == found.T).all()


def test_bad_radios() -> None:
    bad_ones: list[dict[str, Any]] = [{"range_m": 0.0}, {"model": "x"}, {"loss_db": -1.0}]
    for bad in bad_ones:
        said = f"radio.{next(iter(bad))}"
        with pytest.raises(ConfigError, match=said):
            Radio(**bad)


def test_way_in_walls_against_many_samples() -> None:
    rng = np.random.default_rng(0)
    for _ in range(60):
        walls = (rng.random((30, 41)) < 0.3).astype(np.uint8)
        x, y, to_x, to_y = rng.uniform((0, 0, 0, 0), (41, 30, 41, 30))
        if rng.random() < 0.2:
            to_x = x
        part = (np.arange(200_000) + 0.5) / 200_000
        inside = walls[(y + part * (to_y - y)).astype(int), (x + part * (to_x - x)).astype(int)] != 0
        way = math.hypot(to_x - x, to_y - y)
        assert length_in_walls(walls, x, y, to_x, to_y) == pytest.approx(inside.mean() * way, abs=1e-2)
        assert length_in_walls(walls, to_x, to_y, x, y) == pytest.approx(
            length_in_walls(walls, x, y, to_x, to_y), abs=1e-9
        )
    assert length_in_walls(walls, 3.0, 3.0, 3.0, 3.0) == 0.0
