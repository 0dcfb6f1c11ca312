"""Hold what a build records of one input: the files read, with hashes, and the plans and rejections that it gave."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TypeAlias

import msgspec

from pipeline.batch.disk import printable
from pipeline.rejection import Rejection
from pipeline.values import Input


class StoredPicture(msgspec.Struct, frozen=True, array_like=True):
    """A picture (PNG) in the store: the SHA-256 of its bytes, and how many."""

    sha256: str
    size: int


class PlanRecord(msgspec.Struct, frozen=True, omit_defaults=True):
    """A plan in the store: its reader's id, the SHA-256 of what it was made from and of its bytes, and how many.

    ``stages`` is the picture of its stages, if the build keeps pictures. ``by_hand``: a person keeps it although it is
    a copy; builds that do not list its source need this record. ``kept_from`` is the reason for which it would have
    been rejected otherwise, or "".
    """

    id: str
    content: str
    plan: str
    size: int
    stages: StoredPicture | None = None
    by_hand: bool = False
    kept_from: str = ""


class StoredRejection(msgspec.Struct, frozen=True, order=True):
    """An input, or a level of one, that gave no plan.

    ``picture`` is a PNG of it, or nothing. ``content`` is the SHA-256 of what the source holds of it, or "".
    """

    id: str
    stage: str
    reason: str
    detail: str
    advice: str = ""
    picture: bytes = b""
    content: str = ""

    @classmethod
    def of(cls, name: str, rejection: Rejection, content: str = "") -> StoredRejection:
        """Record a rejection under the id that it concerns."""
        detail, advice = printable(rejection.detail), printable(rejection.advice)
        return cls(printable(name), rejection.stage, str(rejection.reason), detail, advice, rejection.picture, content)

    def line(self) -> dict[str, str]:
        """Return its line of ``rejected.jsonl``."""
        return {"id": self.id, "stage": self.stage, "reason": self.reason, "detail": self.detail, "advice": self.advice}


class FileRecord(msgspec.Struct, frozen=True, array_like=True):
    """A file that was read: its name within the source's folder (``path_to_text``), how it looked, what it held.

    A missing file has the size -1. A file that may have changed while it was read has the time 0.
    """

    name: str
    size: int
    mtime_ns: int
    sha256: str


Outcome: TypeAlias = PlanRecord | StoredRejection


class Entry(msgspec.Struct, frozen=True):
    """One input that is done: what went in, and what came of it.

    ``source`` lists it; ``gone`` says that its source no longer does. ``transient``: a transient fault kept it from
    being done, so that it is to be tried again. ``versions`` are those of the libraries that made it. ``file`` is what
    people know the input by, ``stages`` the seconds of each stage.
    """

    input: str
    source: str
    recipe: str
    files: list[FileRecord]
    seconds: float
    plans: list[PlanRecord] = []
    refused: list[StoredRejection] = []
    versions: dict[str, str] = {}
    transient: bool = msgspec.field(default=False, name="passing")  # as journals have it
    gone: bool = False
    file: str = ""
    stages: dict[str, float] = {}

    @property
    def outcomes(self) -> Iterator[Outcome]:
        """The outcomes of the input, plans first."""
        yield from self.plans
        yield from self.refused


def journal_key(item: Input) -> str:
    """Return what stands for an input in the journal: which reader opens what."""
    text = f"{item.id}\0{item.reader}\0{item.path}\0{item.key}"
    return hashlib.sha256(text.encode("utf-8", "surrogateescape")).hexdigest()[:32]


def display_name(item: Input, source: str) -> str:
    """Return what people know an input by: its file within the source, and which house of it where it holds many."""
    path, root = Path(item.path).absolute(), Path(source)
    name = str(path.relative_to(root.parent)) if path.is_relative_to(root.parent) else path.name
    if not path.exists():  # a house that is made where it is read
        return printable(item.id)
    return printable(f"{name} ({item.key})" if item.key else name)


def sort_entries(entries: Iterable[Entry]) -> list[Entry]:
    """Return entries in an order that depends on what came of them only, not on when or from where."""
    return sorted(
        entries,
        key=lambda entry: [(o.id, o.content if isinstance(o, PlanRecord) else o.reason) for o in entry.outcomes],
    )
