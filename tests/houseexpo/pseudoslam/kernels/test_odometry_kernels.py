"""Models of odometry beside their definitions: means and variances over many draws, and what is exact."""

from __future__ import annotations

import math

import numpy as np
import pytest

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import NoiseConfig, Odometry, SimulatorConfig, Velocity, Wheels
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


@pytest.mark.parametrize(("turn", "way"), [(0.3, 0.2), (-0.3, -0.2), (0.0, 0.3), (0.5, 0.0)])
def test_the_velocity_model_has_the_variances_of_its_definition(turn: float, way: float) -> None:
    a = 0.02, 0.03, 0.4, 0.05, 0.06, 0.01
    v, w = way / SECONDS, turn / SECONDS
    wanted = (
        0.0,
        SECONDS * math.sqrt(a[2] * v**2 + a[3] * w**2),
        SECONDS * math.sqrt(a[0] * v**2 + a[1] * w**2),
        SECONDS * math.sqrt(a[4] * v**2 + a[5] * w**2),
    )
    assert_spread(draws(NoiseConfig(odometry_model=Velocity(*a)), turn, way, arc=True), *wanted)


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


def test_wheels_of_unequal_diameter_bend_a_straight_line() -> None:
    """UMBmark: after a way S, wheels with D_R / D_L = E_d are counted as S / c_R and S / c_L."""
    ratio, separation = 1.02, 0.4
    model = Wheels(separation, diameter_ratio=ratio)
    _, turn, way, _ = draws(NoiseConfig(odometry_model=model), 0.0, 4.0, arc=True)[0]
    right, left = 2 * ratio / (1 + ratio), 2 / (1 + ratio)  # the diameters; their mean is the nominal one
    assert right / left == pytest.approx(ratio)
    assert (turn, way) == pytest.approx(((4 / right - 4 / left) / separation, (4 / right + 4 / left) / 2 - 4))
    assert turn < 0.0  # the large right wheel counts less, so that the line seems to bend to the right


def test_a_wrong_separation_scales_turns() -> None:
    model = Wheels(0.4, separation_ratio=1.05)
    assert draws(NoiseConfig(odometry_model=model), 2.0, 0.0, arc=False)[0] == pytest.approx((0, 0.1, 0, 0), abs=1e-12)
    assert draws(NoiseConfig(odometry_model=model), 0.0, 2.0, arc=False)[0] == pytest.approx((0, 0, 0, 0), abs=1e-12)


@pytest.mark.parametrize("arc", [True, False])
def test_wheels_err_as_the_root_of_how_far_they_roll(arc: bool) -> None:
    turn, way, separation, right, left = 0.8, 0.3, 0.4, 0.02, 0.01
    model = Wheels(separation, right_m_per_root_m=right, left_m_per_root_m=left)
    found = draws(NoiseConfig(odometry_model=model), turn, way, arc=arc)
    half = turn * separation / 2
    rolled = (abs(way + half), abs(way - half)) if arc else (way + half, way + half)
    variances = right**2 * rolled[0], left**2 * rolled[1]
    assert found[:, 2].std() == pytest.approx(math.sqrt(sum(variances)) / 2, rel=0.05)
    assert found[:, 1].std() == pytest.approx(math.sqrt(sum(variances)) / separation, rel=0.05)
    wanted = (variances[0] - variances[1]) / math.sqrt(variances[0] + variances[1]) ** 2
    assert np.corrcoef(found[:, 1], found[:, 2])[0, 1] == pytest.approx(wanted, abs=0.05)


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


@pytest.mark.parametrize("model", [None, Velocity(), Odometry(), Wheels()])
def test_without_errors_all_is_exact(model: Velocity | Odometry | Wheels | None) -> None:
    for arc in (True, False):
        found = draws(NoiseConfig(odometry_model=model), 0.3, -0.2, arc=arc)
        assert np.abs(found).max() <= 1e-15


def test_lengths_are_metres_on_any_grid() -> None:
    for model in (Velocity(*[0.1] * 6), Odometry(*[0.1] * 4), Wheels(0.3, 1.1, 1.1, 0.02, 0.03)):
        found = []
        for ppm in (10.0, 40.0):
            errors: Errors = make_noise_params(NoiseConfig(odometry_model=model), ppm)
            counts, readings = np.zeros(1, COUNTS)[0], np.zeros(1, READINGS)[0]
            counts.key, counts.steps = 4, 9
            first, turn, way, last = draw_odometry_errors(errors, counts, readings, 0.4, 0.3 * ppm, True, SECONDS)
            found.append((first, turn, way / ppm, last))
        assert found[0] == pytest.approx(found[1])


def test_models_that_cannot_be_are_refused() -> None:
    for make, message in (
        (lambda: Velocity(alpha2=-0.1), r"odometry_model\.velocity\.alpha2: expected at least 0"),
        (lambda: Odometry(alpha4=math.inf), r"odometry_model\.odometry\.alpha4: expected a finite number"),
        (lambda: Wheels(separation_m=0.0), r"wheels\.separation_m: expected at least 0\.01"),
        (lambda: Wheels(diameter_ratio=3.0), r"wheels\.diameter_ratio: expected at most 2"),
        (lambda: NoiseConfig(slip=0.6), r"noise\.slip: expected at most 0\.5, found 0\.6"),
        (lambda: NoiseConfig(odometry_bias_deg_s=-1.0), r"odometry_bias_deg_s: expected at least 0"),
        (lambda: NoiseConfig(odometry_model="wheels"), r"noise\.odometry_model: expected a Velocity, an Odometry"),  # type: ignore[arg-type]
        (
            lambda: SimulatorConfig.from_mapping({"noise": {"odometry_model": {"wheel": {}}}}),
            r"unknown key 'noise\.odometry_model\.wheel'; did you mean 'noise\.odometry_model\.wheels'",
        ),
    ):
        with pytest.raises(ConfigError, match=message):
            make()


def test_a_model_is_read_and_written_with_the_configuration() -> None:
    given = {"noise": {"slip": 0.1, "odometry_model": {"odometry": {"alpha1": 0.2}}}}
    config = SimulatorConfig.from_mapping(given)
    assert config.noise.odometry_model == Odometry(0.2)
    assert SimulatorConfig.from_mapping(config.to_mapping()) == config
    assert config.noise.any
    assert config.noise.without_odometry() == NoiseConfig()
