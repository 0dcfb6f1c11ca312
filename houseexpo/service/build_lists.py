"""Read the lists that a build writes beside its plans: rejected inputs, and plans dropped as duplicates.

It also finds the pictures that the build kept of them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import msgspec

from houseexpo.dataset.store.folders import rejected_picture_path
from houseexpo.errors import PlanError
from houseexpo.files import decode_json, read_file
from houseexpo.plan import checks

_T = TypeVar("_T", bound=msgspec.Struct)


class RejectionLine(msgspec.Struct, frozen=True):
    """A line of ``rejected.jsonl``: an input that gave no plan."""

    id: str
    stage: str
    reason: str
    detail: str = ""
    advice: str = ""


class DroppedDuplicate(msgspec.Struct, frozen=True):
    """A line of ``duplicates.jsonl``: a plan that was dropped because it repeats the kept one."""

    id: str
    kept_id: str
    difference: float
    symmetry: str = ""


@dataclass(frozen=True)
class BuildLists:
    """Both lists; ``broken`` are errors in reading them, ``listed`` says whether a build wrote them."""

    refused: tuple[RejectionLine, ...] = ()
    repeated: tuple[DroppedDuplicate, ...] = ()
    broken: tuple[str, ...] = ()
    listed: bool = False

    @property
    def reasons(self) -> list[tuple[str, str, int]]:
        """Stages and reasons with their numbers of inputs, the most frequent first."""
        counts = Counter((each.stage, each.reason) for each in self.refused)
        return [(*key, n) for key, n in sorted(counts.items(), key=lambda item: (-item[1], item[0]))]

    def of(self, stage: str, reason: str) -> Sequence[RejectionLine]:
        """Return the inputs rejected at a stage for a reason; "" stands for any."""
        return [each for each in self.refused if stage in ("", each.stage) and reason in ("", each.reason)]

    def repeats_of(self, kept_id: str) -> Sequence[DroppedDuplicate]:
        """Return the plans that were dropped as duplicates of one."""
        return [each for each in self.repeated if each.kept_id == kept_id]


def read_build_lists(path: Path) -> BuildLists:
    """Read the lists in a data set's folder; both are empty if it is not a folder or has no lists."""
    if not path.is_dir():
        return BuildLists()
    refused, one = _lines(path / "rejected.jsonl", RejectionLine)
    repeated, other = _lines(path / "duplicates.jsonl", DroppedDuplicate)
    listed = (path / "rejected.jsonl").is_file()
    return BuildLists(tuple(refused), tuple(repeated), (*one, *other), listed)


def duplicate_picture_path(path: Path, plan_id: str) -> Path | None:
    """Return the picture of a dropped plan, or None if the build did not keep it or the id is not valid."""
    folder = path / ".build" / "pictures"
    try:
        file = folder / f"{checks.check_plan_id(plan_id)}.png"
    except PlanError:
        return None
    return _unlinked_file(file)


def rejection_picture_path(path: Path, name: str) -> Path | None:
    """Return the picture of a rejected input, or None if the build did not keep it."""
    return _unlinked_file(rejected_picture_path(path, name))


def _unlinked_file(file: Path) -> Path | None:
    """Return the file if it exists and no part of its path is a link."""
    linked = any(part.is_symlink() for part in (file, file.parent, file.parent.parent))
    return file if file.is_file() and not linked else None


def _lines(file: Path, kind: type[_T]) -> tuple[list[_T], tuple[str, ...]]:
    try:
        return [decode_json(line, kind) for line in read_file(file).splitlines() if line.strip()], ()
    except FileNotFoundError:
        return [], ()
    except (OSError, msgspec.DecodeError) as error:
        return [], (f"{file.name}: cannot be read ({error})",)
