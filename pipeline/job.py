"""What a worker does with one input: open it, plan its levels, and let nothing escape but outcomes."""

from __future__ import annotations

import hashlib
import time
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from houseexpo.errors import MissingDependencyError
from houseexpo.plan import FloorPlan
from houseexpo.plan_json import encode
from pipeline.config import PipelineConfig
from pipeline.corrections import corrected_level
from pipeline.overrides import Override
from pipeline.quality import check_quality
from pipeline.rejection import Reason, Rejection
from pipeline.sources import reader
from pipeline.top_view import top_view
from pipeline.values import Input, Level, RejectedLevel

Plan = Callable[[Level, PipelineConfig, np.random.Generator], Sequence[FloorPlan | RejectedLevel]]


@dataclass(frozen=True)
class Made:
    """A plan, as the bytes of its file; ``content`` is the SHA-256 of what it was made from."""

    id: str
    content: str
    plan: bytes = field(repr=False)


@dataclass(frozen=True)
class Refused:
    """An input, or a level of one, that gave no plan; ``picture`` is a PNG of it, or nothing."""

    id: str
    stage: str
    reason: str
    detail: str
    advice: str = ""
    picture: bytes = field(default=b"", repr=False)

    @classmethod
    def of(cls, name: str, rejection: Rejection) -> Refused:
        """Put a rejection down under the id it concerns."""
        return cls(name, rejection.stage, str(rejection.reason), rejection.detail, rejection.advice, rejection.picture)

    def line(self) -> dict[str, str]:
        """Return what ``rejected.jsonl`` has of it."""
        return {"id": self.id, "stage": self.stage, "reason": self.reason, "detail": self.detail, "advice": self.advice}


@dataclass(frozen=True)
class Finished:
    """What came of one input; ``seconds`` of wall clock."""

    content: str
    seconds: float
    outcomes: tuple[Made | Refused, ...]


@dataclass(frozen=True)
class Settings:
    """What all jobs of a build share; ``stamp`` goes into every plan's provenance."""

    config: PipelineConfig
    seed: int
    overrides: Mapping[str, Override]
    stamp: Mapping[str, str]
    plan: Plan
    min_quality: float = 0.0


@dataclass(frozen=True)
class Job:
    """One input, and the content of which the outcomes are known already ("" where none are)."""

    item: Input
    known: str = ""


def work(settings: Settings, job: Job) -> Finished | None:
    """Return what came of an input, or None where it is still what the outcomes known were made from."""
    start = time.perf_counter()
    content = _content(job.item)
    if content == job.known:
        return None
    outcomes = tuple(_outcomes(job.item, settings))
    return Finished(content, time.perf_counter() - start, outcomes)


def rng_of(level: Level, seed: int) -> np.random.Generator:
    """Return a level's own source of chance: it depends on the seed and the id, not on what ran before."""
    return np.random.default_rng([seed, *hashlib.sha256(level.id.encode()).digest()])


def _outcomes(item: Input, settings: Settings) -> Iterator[Made | Refused]:
    """Yield an outcome for each level; what goes wrong outside of a level's stages is the whole input's."""
    count = 0
    try:
        for level in reader(item.reader).read(item):
            count += 1
            if isinstance(level, RejectedLevel):
                yield Refused.of(level.id, level.rejection)
            else:
                yield from _of_level(level, item, settings)
    except Exception as error:  # noqa: BLE001 - one input's fault must not stop the batch
        yield Refused.of(item.id, _as_rejection(error, item))
    else:
        if not count:
            nothing = Rejection("source", Reason.NO_LEVEL, "expected a level, found none", "look at it in a viewer")
            yield Refused.of(item.id, nothing)


def _of_level(level: Level, item: Input, settings: Settings) -> list[Made | Refused]:
    """What came of a level: an outcome for each of its buildings."""
    override = settings.overrides.get(level.id, Override())
    if override.drop:
        return [Refused.of(level.id, _dropped(override))]
    rng = rng_of(level, settings.seed)
    try:
        found = settings.plan(corrected_level(level, override), override.applied(settings.config), rng)
    except Rejection as rejection:
        return [Refused.of(level.id, rejection.pictured(top_view(level.walls)))]
    except Exception as error:  # noqa: BLE001 - the other levels of the house go on
        return [Refused.of(level.id, _as_rejection(error, item))]
    return [_outcome(each, level, settings) for each in found]


def _outcome(found: FloorPlan | RejectedLevel, level: Level, settings: Settings) -> Made | Refused:
    if isinstance(found, RejectedLevel):
        return Refused.of(found.id, found.rejection.pictured(top_view(level.walls)))
    override = settings.overrides.get(found.id, Override())
    try:
        if override.drop:
            raise _dropped(override)
        if not override.keep:
            check_quality(found, settings.min_quality)
    except Rejection as rejection:
        return Refused.of(found.id, rejection.pictured(top_view(level.walls)))
    plan = replace(found, provenance={**(found.provenance or {}), **settings.stamp})
    return Made(found.id, str(level.provenance.get("sha256", "")), encode(plan) + b"\n")


def _dropped(override: Override) -> Rejection:
    why = override.why or "no reason given"
    return Rejection("overrides", Reason.DROPPED_BY_HAND, why, "see overrides.toml")


def _as_rejection(error: Exception, item: Input) -> Rejection:
    if isinstance(error, Rejection):
        return error
    if isinstance(error, MemoryError):
        detail = "needed more memory than a worker may take"
        return Rejection("executor", Reason.OUT_OF_MEMORY, detail, "raise limits.memory_gb, or simplify the mesh")
    if isinstance(error, MissingDependencyError):
        return Rejection("source", Reason.UNREADABLE, str(error), "install it and build again")
    place = traceback.extract_tb(error.__traceback__)[-1]
    text = " ".join(str(error).replace(item.path, Path(item.path).name).split())[:200]
    detail = f"{type(error).__name__} at {Path(place.filename).name}:{place.lineno} in {place.name}: {text}"
    return Rejection("internal", Reason.INTERNAL, detail, "this is a fault of the program: please report it")


def _content(item: Input) -> str:
    """SHA-256 of what an input is made from: its file, the scene's files, or what a made house is made from.

    A reader whose inputs are more, or less, than one file says itself what they are (``content``).
    """
    path = Path(item.path)
    own = getattr(reader(item.reader), "content", None)
    if own is not None:
        try:
            return hashlib.sha256(item.key.encode() + own(item)).hexdigest()
        except Rejection as rejection:  # what cannot be read stays so until the file changes
            return hashlib.sha256(str(rejection).encode()).hexdigest()
    digest = hashlib.sha256(item.key.encode())
    scene = [path / "house" / item.key, path / "room" / item.key]
    files = [path] if not item.key else sorted(file for folder in scene for file in folder.glob("*"))
    for file in files:
        try:
            data = file.read_bytes()
        except OSError:
            data = b"unreadable"
        digest.update(file.name.encode() + b"\0" + hashlib.sha256(data).digest())
    return digest.hexdigest()
