"""Split a build into shards, which run in any order, also twice: the inputs of each, common settings, and journals.

Rules:

1. An input belongs to the shard that the hash of its id falls into: every machine agrees, without asking another.
2. Shards are counted from 0 to N - 1 or from 1 to N: shard N of N is shard 0.
3. What shards have in common (``begun.json``) is written by whichever comes first, and must be the same for all. A
   build of one shard may change its mind on corrections, pictures and licence. A build of the whole folder that changes
   the data set ends the shards: put together again, they would take that back.
4. A shard's journal is a folder of chunks, written once each: two attempts at one shard add chunks beside each other,
   and the last line of an input counts. What is lost when a shard is killed is what stood in no chunk yet.
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, field

import msgspec

from houseexpo.corrections import Override
from houseexpo.errors import ConfigError
from pipeline.batch.data_set_folder import differing_parameter
from pipeline.batch.entry import Entry
from pipeline.batch.result_store import Store
from pipeline.config_file import BuildConfig

_FOLDER = ".build/shards"
_BEGUN = f"{_FOLDER}/begun.json"
_LINES, _SECONDS = 256, 20.0
"""A chunk of a journal is written when it has so many lines, or is so old when a line comes."""


@dataclass(frozen=True)
class Shard:
    """One of ``count`` parts; ``number`` is at least 0 and less than ``count``."""

    number: int
    count: int

    @classmethod
    def of(cls, text: str) -> Shard:
        """Read ``7/256``; raise ConfigError if it is no shard."""
        number, _, count = text.partition("/")
        if not (number.isdecimal() and count.isdecimal() and int(number) <= int(count) and int(count)):
            raise ConfigError(f"--shard {text}: expected NUMBER/COUNT such as 7/256, counted from 0 or from 1")
        return cls(int(number) % int(count), int(count))  # R2

    def holds(self, name: str) -> bool:
        """Tell whether the input of this id belongs to the shard (R1)."""
        return shard_number(name, self.count) == self.number

    def __str__(self) -> str:
        return f"{self.number}/{self.count}"


def shard_number(name: str, count: int) -> int:
    """Return the number of the shard that an input's id falls into (R1)."""
    return int.from_bytes(hashlib.sha256(name.encode("utf-8", "surrogateescape")).digest()[:8]) % count


class CommonSettings(msgspec.Struct, frozen=True):
    """What all shards of a data set have in common. The sources in ``config`` have their full names."""

    shards: int
    config: BuildConfig
    overrides: dict[str, Override]

    def write(self, store: Store) -> None:
        """Store it, or check that an earlier shard stored the same (R3).

        Raises
        ------
        ConfigError
            Where the shards that are there are of another build, or the place holds something else.
        """
        before = read_common_settings(store)
        if before is None:
            store.check(self.config)
            self._put(store)
        elif before != self and self.shards == before.shards == 1 and self._same_houses(before):
            self._put(store)
        elif before != self:
            what = (
                f"{before.shards} shards, not {self.shards}"
                if before.shards != self.shards
                else f"other parameters{differing_parameter(before.config.parameters(), self.config)}"
                if before.config.parameters() != self.config.parameters()
                else "other sources, overrides, pictures, limits or copies"
            )
            raise ConfigError(
                f"{store.name}: a build with {what} was begun there; go on with those, or choose another --out (in a "
                "folder, a build without --shard takes over what the shards have done)"
            )

    def _put(self, store: Store) -> None:
        store.put(_BEGUN, msgspec.json.encode(self, order="deterministic"))

    def _same_houses(self, other: CommonSettings) -> bool:
        """Tell whether the other has the same inputs and parameters; overrides do not count."""
        own, before = self.config.build, other.config.build
        asked = ((each.sources, each.limit, each.model_path) for each in (own, before))
        return len(set(asked)) == 1 and self.config.parameters() == other.config.parameters()


def remove_common_settings(store: Store) -> None:
    """Remove the record of what the shards have in common (R3)."""
    store.remove(_BEGUN)


def read_common_settings(store: Store) -> CommonSettings | None:
    """Return what the shards in a store have in common, or None if none has begun.

    A store that does not answer has not said that none has: its fault is raised.
    """
    try:
        return msgspec.json.decode(store.get(_BEGUN), type=CommonSettings)
    except (FileNotFoundError, NotADirectoryError, msgspec.DecodeError):
        return None


@dataclass
class ShardJournal:
    """The journal of one shard, or of all shards if ``shard`` is None; ``put`` needs a shard."""

    store: Store
    shard: Shard | None
    _entries: dict[str, Entry] = field(default_factory=dict)
    _chunks: int = 0
    _fresh: list[bytes] = field(default_factory=list)
    _since: float = 0.0

    def __post_init__(self) -> None:
        """Read the chunks that are there, the oldest first."""
        own = self.store.names(self._folder)
        for name in sorted(own, key=lambda name: name.rpartition("/")[2]):
            if name.endswith(".jsonl"):
                self._chunks += 1
                self._entries.update((entry.input, entry) for entry in _lines(self.store.get(name)))

    def get(self, name: str) -> Entry | None:
        """Return the last entry of an input."""
        return self._entries.get(name)

    def put(self, entry: Entry) -> None:
        """Note an entry; it is safe when its chunk is written."""
        self._entries[entry.input] = entry
        if not self._fresh:
            self._since = time.monotonic()
        self._fresh.append(msgspec.json.encode(entry))
        if len(self._fresh) >= _LINES or time.monotonic() - self._since > _SECONDS:
            self.sync()

    def sync(self) -> None:
        """Write the entries that are in no chunk yet (R4)."""
        if self._fresh:
            data = b"".join(line + b"\n" for line in self._fresh)
            digest = hashlib.sha256(data).hexdigest()[:16]
            self.store.put(f"{self._folder}/{self._chunks:08d}-{digest}.jsonl", data)
            self._chunks += 1
            self._fresh.clear()

    def entries(self) -> Iterable[Entry]:
        """Return the last entry of each input."""
        return self._entries.values()

    @property
    def _folder(self) -> str:
        return _FOLDER if self.shard is None else f"{_FOLDER}/{self.shard.number:06d}-of-{self.shard.count:06d}"


def _lines(data: bytes) -> Iterable[Entry]:
    """Yield the entries of a chunk; damaged lines are skipped."""
    for line in data.splitlines():
        with suppress(msgspec.DecodeError):
            yield msgspec.json.decode(line, type=Entry)
