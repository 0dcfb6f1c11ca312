"""Licences under which plans may be redistributed, by their SPDX identifiers.

A plan is derived from a house, so that licences that forbid derived works are excluded.
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass
from typing import Final

from houseexpo.errors import DatasetError


@dataclass(frozen=True)
class Licence:
    """A licence: its SPDX identifier, its name, its address, and its name at Hugging Face."""

    spdx: str
    title: str
    url: str
    hub: str


_CC: Final = "https://creativecommons.org"
_ODC: Final = "https://opendatacommons.org/licenses"

LICENCES: Final = {
    licence.spdx: licence
    for licence in (
        Licence("CC0-1.0", "Creative Commons Zero 1.0", f"{_CC}/publicdomain/zero/1.0/", "cc0-1.0"),
        Licence("CC-BY-4.0", "Creative Commons Attribution 4.0", f"{_CC}/licenses/by/4.0/", "cc-by-4.0"),
        Licence(
            *("CC-BY-SA-4.0", "Creative Commons Attribution Share Alike 4.0"),
            *(f"{_CC}/licenses/by-sa/4.0/", "cc-by-sa-4.0"),
        ),
        Licence(
            *("CC-BY-NC-4.0", "Creative Commons Attribution Non Commercial 4.0"),
            *(f"{_CC}/licenses/by-nc/4.0/", "cc-by-nc-4.0"),
        ),
        Licence(
            *("CC-BY-NC-SA-4.0", "Creative Commons Attribution Non Commercial Share Alike 4.0"),
            *(f"{_CC}/licenses/by-nc-sa/4.0/", "cc-by-nc-sa-4.0"),
        ),
        Licence("PDDL-1.0", "Public Domain Dedication and License 1.0", f"{_ODC}/pddl/1-0/", "pddl"),
        Licence("ODC-By-1.0", "Open Data Commons Attribution 1.0", f"{_ODC}/by/1-0/", "odc-by"),
        Licence("ODbL-1.0", "Open Database License 1.0", f"{_ODC}/odbl/1-0/", "odbl"),
        Licence(
            *("CDLA-Permissive-2.0", "Community Data License Agreement Permissive 2.0"),
            *("https://cdla.dev/permissive-2-0/", "cdla-permissive-2.0"),
        ),
        Licence("MIT", "MIT License", "https://opensource.org/license/mit", "mit"),
        Licence("Apache-2.0", "Apache License 2.0", "https://www.apache.org/licenses/LICENSE-2.0", "apache-2.0"),
    )
}

OWN: Final = "CC-BY-4.0"
"""The licence of houses that the project generates, unless the manifest states another."""


def licence_of(spdx: str, what: str) -> Licence:
    """Return the licence with an identifier in any letter case; raise DatasetError if it is not in the list."""
    by_lower = {name.lower(): licence for name, licence in LICENCES.items()}
    found = by_lower.get(spdx.lower())
    if found is None:
        near = difflib.get_close_matches(spdx, LICENCES, n=1, cutoff=0.0)[0]
        raise DatasetError(
            f"{what}: expected a licence under which plans may be passed on, by its SPDX identifier; found {spdx!r}; "
            f"the nearest is {near!r}, known are {', '.join(LICENCES)}"
        )
    return found
