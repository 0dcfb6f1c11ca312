"""The licences stated for a data set's sources, one by one, and the licence that all share.

R1  A build states the licence and the credit of its own sources. Those of sources whose plans it keeps (``--add``) stay
    as they were stated.
R2  A data set has a licence where all of its sources have that one. Houses that the project makes
    (``procedural:``) agree to any where none is stated of them. The credits of all stand one after another.
R3  Of a data set that was built before these were kept apart, the manifest's hold for all of its sources.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final

import msgspec

from houseexpo.files import as_json, write_whole
from pipeline.batch.folder import Folder
from pipeline.values import MADE

_FILE: Final = "rights.json"


class Rights(msgspec.Struct, frozen=True, omit_defaults=True):
    """The licence of a source, as its manifest spells it, and whom to name, or "" if nothing is stated."""

    licence: str = ""
    credit: str = ""


def rights_by_source(folder: Folder, own: Mapping[str, Rights], beside: Iterable[str]) -> dict[str, Rights]:
    """Return and store the licences of a build's own sources and of those whose plans it keeps (R1, R3)."""
    file = folder.build / _FILE
    try:
        before = msgspec.json.decode(file.read_bytes(), type=dict[str, Rights])
    except (OSError, msgspec.DecodeError):
        before = {}
    manifest = folder.manifest()
    unknown = Rights(manifest.licence, manifest.credit) if manifest else Rights()
    found = {**own, **{source: before.get(source, unknown) for source in beside}}
    if found != before:
        write_whole(file, as_json(msgspec.to_builtins(dict(sorted(found.items())))), durable=True)
    return found


def licences(rights: Mapping[str, Rights]) -> tuple[str, ...]:
    """Return the licences that sources state, each once, "" among them where one that could state one does not."""
    found: dict[str, str] = {}
    for source, each in sorted(rights.items()):
        if each.licence or not _is_made(source):
            found.setdefault(each.licence.casefold(), each.licence)
    return tuple(found.values())


def agreed(rights: Mapping[str, Rights]) -> Rights:
    """Return the licence and credit shared by all of these sources (R2)."""
    found = licences(rights)
    credit = dict.fromkeys(each.credit for _, each in sorted(rights.items()) if each.credit)
    return Rights(found[0] if len(found) == 1 else "", "; ".join(credit))


def _is_made(source: str) -> bool:
    return source.startswith(f"{MADE}:")
