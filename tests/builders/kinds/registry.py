"""The kinds by name, and how a member is made from its seed."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.random import Generator

from tests.builders.kinds import (
    artist,
    cloud,
    front3d,
    gazebo,
    ifc,
    office,
    procthor,
    raw,
    roomplan,
    rowhouses,
    scale_models,
    scan,
    solids,
)
from tests.builders.kinds.values import Member

Maker = Callable[[Generator, Path, str], Member]

KINDS: dict[str, Maker] = {
    "solids": solids.make,
    "front3d": front3d.make,
    "procthor": procthor.make,
    "artist_named": artist.make_named,
    "artist_unnamed": artist.make_unnamed,
    "scan5": scan.make_5,
    "scan20": scan.make_20,
    "ifc": ifc.make,
    "roomplan": roomplan.make,
    "gazebo": gazebo.make,
    "office": office.make,
    "rowhouses": rowhouses.make,
    "scale_models": scale_models.make,
}

RAW: dict[str, Maker] = {
    "raw_procthor": raw.make_procthor,
    "raw_front3d": raw.make_front3d,
    "raw_sdf": raw.make_sdf,
    "raw_sh3d": raw.make_sh3d,
    "raw_roomplan": raw.make_roomplan,
    "cloud0": cloud.make_0,
    "cloud5": cloud.make_5,
    "cloud20": cloud.make_20,
    "cloud_furnished": cloud.make_furnished,
    "cloud_doubled": cloud.make_doubled,
}
"""Homes in the formats of docs/sources.md: no meshes."""


def make_member(kind: str, number: int, seed: int, folder: Path) -> Member:
    """Write member ``number`` of a kind; the same three give the same bytes."""
    rng = np.random.default_rng([seed, number, zlib.crc32(kind.encode())])
    folder.mkdir(parents=True, exist_ok=True)
    return (KINDS | RAW)[kind](rng, folder, f"{kind}_{number:03d}")
