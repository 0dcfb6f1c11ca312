"""Models of odometry beside their definitions: means and variances over many draws, and what is exact."""

from __future__ import annotations

import math

import numpy as np
import pytest

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import NoiseConfig, Odometry, SimulatorConfig
from houseexpo.pseudoslam.kernels.episode import COUNTS, READINGS
from houseexpo.pseudoslam.kernels.odometry import draw_odometry_errors, grip_share
from houseexpo.pseudoslam.kernels.types import Errors
from houseexpo.pseudoslam.step_kernels import make_noise_params

PPM, DRAWS, SECONDS = 20.0, 4000, 0.5


def draws(noise: NoiseConfig, turn: float, way_m: float, *, arc: bool) -> np.ndarray:
    """(draws, 4): the errors of a step, radians and metres."""
    errors, counts, readings = make_noise_params(noise, PPM), np.zeros(1, COUNTS)[0], np.zeros(1, READINGS)[0]
    counts.key = 77
    found = []
    for step in range(1, DRAWS + 1):
        counts.steps = step
        found.append(draw_odometry_errors(errors, counts, readings, turn, way_m * PPM, arc, SECONDS))
    return np.array(found) * (1.0, 1.0, 1.0 / PPM, 1.0)


def assert_spread(found: np.ndarray, *deviations: float) -> None:
    """Errors have no mean, these standard deviations, and nothing to do with each other."""
    for values, deviation in zip(found.T, deviations, strict=True):
        assert values.mean() == pytest.approx(0.0, abs=4.5 * deviation / math.sqrt(DRAWS))
        assert values.std() == pytest.approx(deviation, rel=0.05, abs=1e-12)
    spread = found[:, [deviation > 0 for deviation in deviations]]
    if spread.shape[1] > 1:
        assert np.abs(np.corrcoef(spread.T) - np.eye(spread.shape[1])).max() < 0.07


@pytest.mark.parametrize("arc", [True, False])
@pytest.mark.parametrize(("turn", "way"), [(0.3, 0.2), (-0.3, -0.2), (0.0, 0.3), (0.5, 0.0)])
def test_the_odometry_model_has_the_variances_of_its_definition(turn: float, way: float, arc: bool) -> None:
    a = 0.02, 0.3, 0.04, 0.05
    one, two = (turn / 2, turn / 2) if arc else (turn, 0.0)
    wanted = (
        math.sqrt(a[0] * one**2 + a[1] * way**2),
        0.0,
        math.sqrt(a[2] * way**2 + a[3] * (one**2 + two**2)),
        math.sqrt(a[0] * two**2 + a[1] * way**2),
    )
    assert_spread(draws(NoiseConfig(odometry_model=Odometry(*a)), turn, way, arc=arc), *wanted)


def test_a_bias_walks_and_the_heading_drifts_by_its_integral() -> None:
    errors, deviation, n = make_noise_params(NoiseConfig(odometry_bias_deg_s=0.3), PPM), math.radians(0.3), 30
    ends = []
    for key in range(2000):
        counts, readings, heading = np.zeros(1, COUNTS)[0], np.zeros(1, READINGS)[0], 0.0
        counts.key = 7919 * key + 13
        for step in range(n + 1):  # the first is the scan before the episode
            counts.steps = step
            found = draw_odometry_errors(errors, counts, readings, 0.0, 0.0, False, SECONDS)
            assert (found.before, found.way, found.after) == (0.0, 0.0, 0.0)
            heading += found.turn
        ends.append((readings.bias, heading))
    bias, heading = np.array(ends).T
    assert bias.std() == pytest.approx(deviation * math.sqrt(n * SECONDS), rel=0.06)
    wanted = deviation * math.sqrt(SECONDS**3 * n * (n + 1) * (2 * n + 1) / 6)
    assert heading.std() == pytest.approx(wanted, rel=0.06)
    assert heading.mean() == pytest.approx(0.0, abs=4 * wanted / math.sqrt(2000))


def test_slip_is_a_uniform_share() -> None:
    errors = make_noise_params(NoiseConfig(slip=0.2), PPM)
    lost = np.array([1.0 - grip_share(errors, 5, step) for step in range(DRAWS)])
    assert lost.mean() == pytest.approx(0.2, abs=0.01)
    assert lost.std() == pytest.approx(0.4 / math.sqrt(12), rel=0.05)
    assert 0.0 <= lost.min() < lost.max() <= 0.4
    assert grip_share(make_noise_params(NoiseConfig(), PPM), 5, 3) == 1.0


@pytest.mark.parametrize("model", [None, Odometry()])
def test_without_errors_all_is_exact(model: Odometry | None) -> None:
    for arc in (True, False):
        found = draws(NoiseConfig(odometry_model=model), 0.3, -0.2, arc=arc)
        assert np.abs(found).max() <= 1e-15


def test_lengths_are_metres_on_any_grid() -> None:
    found = []
    for ppm in (10.0, 40.0):
        errors: Errors = make_noise_params(NoiseConfig(odometry_model=Odometry(*[0.1] * 4)), ppm)
        counts, readings = np.zeros(1, COUNTS)[0], np.zeros(1, READINGS)[0]
        counts.key, counts.steps = 4, 9
        first, turn, way, last = draw_odometry_errors(errors, counts, readings, 0.4, 0.3 * ppm, True, SECONDS)
        found.append((first, turn, way / ppm, last))
    assert found[0] == pytest.approx(found[1])


def test_models_that_cannot_be_are_refused() -> None:
    for make, message in (
        (lambda: Odometry(alpha2=-0.1), r"odometry_model\.alpha2: expected at least 0"),
        (lambda: Odometry(alpha4=math.inf), r"odometry_model\.alpha4: expected a finite number"),
        (lambda: NoiseConfig(slip=0.6), r"noise\.slip: expected at most 0\.5, found 0\.6"),
        (lambda: NoiseConfig(odometry_bias_deg_s=-1.0), r"odometry_bias_deg_s: expected at least 0"),
        (lambda: NoiseConfig(odometry_model="wheels"), r"noise\.odometry_model: expected an Odometry"),  # type: ignore[arg-type]
        (
            lambda: SimulatorConfig.from_mapping({"noise": {"odometry_model": {"alpha5": 0.1}}}),
            r"unknown key 'noise\.odometry_model\.alpha5'; did you mean 'noise\.odometry_model\.alpha",
        ),
    ):
        with pytest.raises(ConfigError, match=message):
            make()


def test_a_model_is_read_and_written_with_the_configuration() -> None:
    given = {"noise": {"slip": 0.1, "odometry_model": {"alpha1": 0.2}}}
    config = SimulatorConfig.from_mapping(given)
    assert config.noise.odometry_model == Odometry(0.2)
    assert SimulatorConfig.from_mapping(config.to_mapping()) == config
    assert config.noise.any
    assert config.noise.without_odometry() == NoiseConfig()
