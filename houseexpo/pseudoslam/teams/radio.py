"""Configure how robots of a team communicate: who hears whom."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from houseexpo.pseudoslam.config.checks import check_number, check_one_of
from houseexpo.pseudoslam.kernels.radio import RadioParams

Model = Literal["none", "always", "range", "sight", "signal"]


@dataclass(frozen=True)
class Radio:
    """The communication of a team. Robots that hear each other exchange their maps, in both directions.

    Parameters
    ----------
    model
        "none"; "always"; "range": within ``range_m``; "sight": within ``range_m``, with no wall in between; "signal":
        the received power is above ``threshold_dbm``.
    range_m
        The range of the models "range" and "sight", metres.
    power_dbm, threshold_dbm
        The sent power, and the least power that is received.
    loss_db
        The path loss at the reference distance.
    reference_m
        The reference distance in air; air up to it adds no loss.
    air_exponent, wall_exponent
        The path-loss exponents of air and of walls.
    wall_unit_m
        The thickness of wall that adds no loss.

    Notes
    -----
    "signal" is the model of IR2 (Tan et al., IROS 2024) without its fading: with the length ``a`` of the line between
    two robots in air and ``w`` in walls, the received power is ``power - loss - 10 air_exponent log10(a / reference) -
    10 wall_exponent log10(w / wall_unit)``; a logarithm below 0 counts as 0. IR2 counts lengths in cells of its maps
    (reference 35, unit 1); the defaults here take one of its cells as 0.1 m. It treats unknown cells like walls,
    because it asks the robots' maps; here the house itself decides.
    """

    model: Model = "none"
    range_m: float = 5.0
    power_dbm: float = -20.0
    threshold_dbm: float = -70.0
    loss_db: float = 31.0
    reference_m: float = 3.5
    air_exponent: float = 2.0
    wall_exponent: float = 4.0
    wall_unit_m: float = 0.1

    def __post_init__(self) -> None:
        check_one_of(self.model, "radio.model", get_args(Model))
        for name in ("range_m", "reference_m", "wall_unit_m", "air_exponent", "wall_exponent"):
            check_number(getattr(self, name), f"radio.{name}", above=0.0)
        check_number(self.loss_db, "radio.loss_db", at_least=0.0)
        for name in ("power_dbm", "threshold_dbm"):
            check_number(getattr(self, name), f"radio.{name}")

    def link(self, cell_m: float) -> RadioParams:
        """Return the parameters for kernels, on a grid with cells of this side."""
        return RadioParams(
            get_args(Model).index(self.model), float(cell_m), float(self.range_m), float(self.power_dbm),
            float(self.threshold_dbm), float(self.loss_db), float(self.reference_m), float(self.air_exponent),
            float(self.wall_exponent), float(self.wall_unit_m),
        )  # fmt: skip
