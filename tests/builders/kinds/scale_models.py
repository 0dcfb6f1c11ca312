"""Kind ``scale_models``: a house at 1:15, 1:20 or 1:50, in an undeclared unit; and small rooms in real size.

The truth is in the real house's metres. What nobody could tell apart is left out: 1:20 in inches is 1:50 in centimetres
but for 1.6%, 1:50 in inches a low house in metres, and without lintels 1:15 with high rooms is 1:20 with low ones.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from numpy.random import Generator
from shapely import box

from tests.builders.kinds import artist, gazebo, solids
from tests.builders.kinds.homes import Style, thicknesses
from tests.builders.kinds.parts.openings import Heads, furnish_openings
from tests.builders.kinds.parts.topology import storey_of
from tests.builders.kinds.values import Cell, Member, Storey

UNIT_M = (15.0, 20.0, 50.0, 0.15, 0.2, 0.5, 15 * 0.0254)
"""What a unit of the file stands for in the real house: metres, centimetres, inches at the scales."""


def make(rng: Generator, folder: Path, name: str) -> Member:
    """Write one model into a folder; every fifth is a single room of 3 m in its real size."""
    if rng.random() < 0.2:
        member = solids.render([single_room(rng)], rng, folder, name)
        return replace(member, about=f"real size; {member.about}")
    scale = float(rng.choice(UNIT_M))
    if scale == 50.0 and rng.random() < 0.5:
        member = gazebo.make(rng, folder, name, scale)
    elif rng.random() < 0.6:
        member = solids.make(rng, folder, name, scale)
    else:
        member = artist.make_unnamed(rng, folder, name, scale)
    return replace(member, about=f"a unit is {scale:g} m; {member.about}")


def single_room(rng: Generator) -> Storey:
    """A room of 2.9 to 4 m with a door and a window."""
    while True:
        outer, inner = thicknesses(rng, Style())
        wide, deep = float(rng.uniform(2.9, 4.0)), float(rng.uniform(2.9, 4.0))
        bare = storey_of(
            [Cell("Bedroom", box(0, 0, wide, deep))], [], outer, inner, round(float(rng.uniform(2.3, 2.8)), 2)
        )
        made = furnish_openings(bare, rng, {}, [0], Heads.draw(rng, bare.height))
        if made is not None:
            return made
