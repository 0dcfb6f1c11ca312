"""Define each stage's parameters as a dataclass; defaults are the paper's if it gives any (section II, Algorithm 1)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from pipeline.stages.logistic import LogisticModel


@dataclass(frozen=True)
class PlanesConfig:
    """Heights are metres above the level's floor."""

    ground_m: float = 0.01  # h_g of the paper
    door_m: float = 0.2  # h_d of the paper
    sheet_m: float = 0.05  # thickness given to a wall that is a single sheet
    solid_m: float = 0.7  # the widest face between wall surfaces that can be a wall's inside


@dataclass(frozen=True)
class EvidenceConfig:
    """The heights at which walls are searched, metres above the floor; ``furniture``: it is an obstacle too."""

    sill_m: float = 0.45  # under a window stands wall at this height, on a door's threshold nothing
    breast_m: float = 1.1  # above tables and counters, below what hangs on walls
    head_m: float = 1.8  # a lintel starts here or higher
    sheet_m: float = 0.05  # thickness given to a wall that is a single sheet
    solid_m: float = 0.7  # the widest face between wall surfaces that can be a wall's inside
    furniture: bool = False


@dataclass(frozen=True)
class LayoutConfig:
    """What counts as a layout, and how open houses are closed."""

    area_m2: float = 2.0  # a scene that encloses less has no layout
    gap_m: float = 1.5  # the widest gap of full height that two wall ends close between two rooms
    entrance_m: float = 3.0  # and the widest that they close between a room and the outside (gates, double doors)
    beam_m: float = 4.0  # a lintel that bridges more, from wall to crossing wall, is a beam in a room and no boundary
    header_m: float = 1.5  # nor is a wider one that hangs from the ceiling by a hand's breadth only a boundary
    characters: bool = True  # reject walls shaped as characters; overrides.toml says "keep" where they are a house
    walled: float = 0.25  # a space with less than this share of its edge walled is part of a room


@dataclass(frozen=True)
class DoorsConfig:
    """Which differences between the two planes are doors. No stage reads ``sliver_m`` any more (docs/decisions.md)."""

    sliver_m: float = 0.03
    narrowest_m: float = 0.4
    widest_m: float = 2.5  # a lintel over more divides rooms, but is no door
    jambless_m: float = 0.95  # nor is one over more of which an end hangs in the air
    post_m: float = 0.3  # a post this thick does not divide what stands beside it


@dataclass(frozen=True)
class CellsConfig:
    """Closed cells (the paper's area threshold)."""

    area_m2: float = 2.0
    samples: int = 500  # n of the paper; exact labelling covers every point, see docs/paper.md


@dataclass(frozen=True)
class IsolatedConfig:
    """A separate building is erased if it meets both conditions."""

    distance_m: float = 2.0
    share: float = 0.25


@dataclass(frozen=True)
class ConnectivityConfig:
    """Sampled points, ways of a disc between them, and cuts if there is none.

    ``closed_spaces`` says what becomes of spaces that no way leads into: "join" cuts a way into each, as the paper
    does; "leave" leaves out those that are likely no rooms (a shaft, a hollow wall), which departs from it. The
    default, "by_source", joins them where the source marks each door (``Level.sills``: SUNCG and the homes that the
    project makes), and leaves them out elsewhere.
    """

    samples: int = 100  # m of the paper
    robot_radius_m: float = 0.2
    cut_width_m: float = 0.8
    pixels_per_metre: int = 20  # of a grid on which ways were looked for; no stage reads it any more
    closed_spaces: Literal["by_source", "join", "leave"] = "by_source"

    def joins_closed_spaces(self, *, marked: bool) -> bool:
        """Return whether a way is cut into each closed space of a level; ``marked``: its source marks each door."""
        return marked if self.closed_spaces == "by_source" else self.closed_spaces == "join"


@dataclass(frozen=True)
class RefineConfig:
    """Straight walls of one thickness."""

    offset_m: float = 0.03  # parallel faces closer than this are one face
    angle_deg: float = 2.0  # faces closer than this in direction are parallel


@dataclass(frozen=True)
class DedupeConfig:
    """Copies have the same walls (``houseexpo.analysis.copies``) and at most a pixel difference.

    The difference is ``|A xor B| / max(|A|, |B|)`` under the eight symmetries of the square and small shifts.
    """

    pixels_per_metre: int = 20
    threshold: float = 0.02
    symmetries: bool = True  # False: a mirrored or turned house is another house
    shift_px: int = 2
    off: bool = False  # True: all copies are kept


@dataclass(frozen=True)
class PipelineConfig:
    """All parameters of a build; stored with its output.

    ``weights`` are models that take the place of those of ``stages/weights.toml``, by their names (``houseexpo fit``).
    """

    evidence: EvidenceConfig = field(default_factory=EvidenceConfig)
    planes: PlanesConfig = field(default_factory=PlanesConfig)
    layout: LayoutConfig = field(default_factory=LayoutConfig)
    doors: DoorsConfig = field(default_factory=DoorsConfig)
    cells: CellsConfig = field(default_factory=CellsConfig)
    isolated: IsolatedConfig = field(default_factory=IsolatedConfig)
    connectivity: ConnectivityConfig = field(default_factory=ConnectivityConfig)
    refine: RefineConfig = field(default_factory=RefineConfig)
    dedupe: DedupeConfig = field(default_factory=DedupeConfig)
    weights: Mapping[str, LogisticModel] = field(default_factory=dict, hash=False)
