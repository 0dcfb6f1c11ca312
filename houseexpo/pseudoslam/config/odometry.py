"""Configure the errors of odometry by one of three models of the field: velocity, odometry (as in AMCL), or wheels.

Each is a value of ``NoiseConfig.odometry_model``. Errors are those of a step: its turn and its way, or its arc for a
robot with a drive. All are off by default, so that only what is set errs.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

from houseexpo.pseudoslam.config.checks import check_number


@dataclass(frozen=True)
class Velocity:
    """The velocity motion model (Thrun, Burgard and Fox, Probabilistic Robotics, 2005, section 5.3).

    The reported speed v and speed of turning w have errors with the variances ``alpha1 v2 + alpha2 w2`` and
    ``alpha3 v2 + alpha4 w2``. At the end of a step, the reported heading turns by a further error with the variance
    ``(alpha5 v2 + alpha6 w2) dt2``. Units are metres, radians and seconds.
    """

    alpha1: float = 0.0
    alpha2: float = 0.0
    alpha3: float = 0.0
    alpha4: float = 0.0
    alpha5: float = 0.0
    alpha6: float = 0.0

    def __post_init__(self) -> None:
        _check_shares(self, "velocity")


@dataclass(frozen=True)
class Odometry:
    """The odometry motion model (Probabilistic Robotics, section 5.4), which AMCL uses, there with 0.2 for each alpha.

    A step is a rotation r1, a translation t and a rotation r2. They are reported with errors of the variances
    ``alpha1 r1^2 + alpha2 t^2``, ``alpha3 t^2 + alpha4 (r1^2 + r2^2)`` and ``alpha1 r2^2 + alpha2 t^2``. A robot that
    turns and then goes has no r2. On an arc, both rotations are half of the turn, and t is the length of the arc.
    Units are metres and radians.
    """

    alpha1: float = 0.0
    alpha2: float = 0.0
    alpha3: float = 0.0
    alpha4: float = 0.0

    def __post_init__(self) -> None:
        _check_shares(self, "odometry")


@dataclass(frozen=True)
class Wheels:
    """The errors of two wheels: systematic (Borenstein and Feng, 1996) and random (Chong and Kleeman, 1997).

    Odometry counts how far each wheel rolls, and knows only the nominal diameter and separation.

    Parameters
    ----------
    separation_m
        Nominal distance of the wheels; the default is that of a TurtleBot3 Waffle.
    diameter_ratio
        E_d of UMBmark: the diameter of the right wheel divided by that of the left one; their mean is the nominal
        diameter.
    separation_ratio
        E_b of UMBmark: the actual distance of the wheels divided by the nominal one.
    right_m_per_root_m, left_m_per_root_m
        Standard deviation of the distance that a wheel reports after rolling for a metre; variances are proportional
        to the distance.
    """

    separation_m: float = 0.287
    diameter_ratio: float = 1.0
    separation_ratio: float = 1.0
    right_m_per_root_m: float = 0.0
    left_m_per_root_m: float = 0.0

    def __post_init__(self) -> None:
        where = "noise.odometry_model.wheels"
        check_number(self.separation_m, f"{where}.separation_m", at_least=0.01, at_most=100.0)
        for name in ("diameter_ratio", "separation_ratio"):
            check_number(getattr(self, name), f"{where}.{name}", at_least=0.5, at_most=2.0)
        for name in ("right_m_per_root_m", "left_m_per_root_m"):
            check_number(getattr(self, name), f"{where}.{name}", at_least=0.0, at_most=10.0)


def _check_shares(model: Velocity | Odometry, name: str) -> None:
    for f in fields(model):
        check_number(getattr(model, f.name), f"noise.odometry_model.{name}.{f.name}", at_least=0.0, at_most=1000.0)
