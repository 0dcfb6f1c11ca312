"""How a data set folder was built, so that it can be built again: a record in ``.build``."""

from __future__ import annotations

from pathlib import Path

import msgspec

from houseexpo.files import as_json, write_whole

FILE = ".build/command.json"
"""Where the record lies in a data set."""


class BuildRecord(msgspec.Struct, frozen=True):
    """A command that builds a data set again; paths in it are in full.

    Parameters
    ----------
    arguments
        Of ``houseexpo build``, without ``--out`` and ``--overrides``.
    overrides
        The file of corrections by hand that the build reads, or would read if it were there; "" where it names none.
    earlier
        Arguments of the builds whose plans this one kept (``--add``); they are built again before it.
    """

    arguments: tuple[str, ...]
    overrides: str = ""
    earlier: tuple[tuple[str, ...], ...] = ()

    def beside(self, before: BuildRecord | None) -> BuildRecord:
        """Return the record of a build that kept the plans of those before it.

        Those that were corrected by another file are left out: it would not be read when they are built again.
        """
        if before is None or (before.overrides and self.overrides not in {"", before.overrides}):
            return self
        found = dict.fromkeys(map(_added, (*before.earlier, before.arguments)))
        earlier = tuple(each for each in found if each != _added(self.arguments))
        return msgspec.structs.replace(self, overrides=self.overrides or before.overrides, earlier=earlier)

    def commands(self) -> tuple[tuple[str, ...], ...]:
        """Return the arguments of the builds that make the data set again, the last one last."""
        return (*self.earlier, self.arguments)


def _added(arguments: tuple[str, ...]) -> tuple[str, ...]:
    return arguments if arguments[-1:] == ("--add",) else (*arguments, "--add")


def record_build(root: Path, record: BuildRecord) -> None:
    """Keep the record in a data set folder; a file that says so already is left alone."""
    if recorded_build(root) != record:
        write_whole(root / FILE, encoded(record), durable=True)


def encoded(record: BuildRecord) -> bytes:
    """Return the record as it lies in a data set."""
    return as_json(msgspec.to_builtins(record))


def recorded_build(root: Path) -> BuildRecord | None:
    """Return how a data set folder was built; None where nothing says so."""
    try:
        return msgspec.json.decode((root / FILE).read_bytes(), type=BuildRecord)
    except (OSError, msgspec.DecodeError):
        return None
