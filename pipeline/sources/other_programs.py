"""Files of design programs that no reader opens, and what to do about them."""

from __future__ import annotations

from collections.abc import Iterable

_SCENES = frozenset((".usd", ".usda", ".usdc", ".usdz", ".fbx", ".blend", ".3ds", ".max", ".ma", ".mb", ".x3d"))
_DESIGNS = frozenset((".skp", ".rvt", ".pln", ".3dm", ".step", ".stp", ".iges", ".igs", ".dwg", ".dxf"))


def how_to_export(suffixes: Iterable[str]) -> str:
    """Say how files with these endings can be built all the same, or nothing if none of them is such a file's."""
    known = sorted((_SCENES | _DESIGNS) & {suffix.lower() for suffix in suffixes})
    return f"; export {', '.join(known)} as .glb or .ifc from the program that made it" if known else ""
