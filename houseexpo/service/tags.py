"""Store the tags that people give to plans, in one TOML file per data set.

The file is ``tags.toml`` in a folder of plans, and ``<name>.tags.toml`` beside an archive. People may edit it, and
several servers may write it: each change reads the file again, under a lock that the system releases when its owner
ends. Links are not followed, because a data set may come from strangers.
"""

from __future__ import annotations

import json
import threading
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Final

import msgspec

from houseexpo.dataset.store.folders import overrides_path
from houseexpo.errors import ConfigError
from houseexpo.files import hold_file_lock, without_mark, write_atomically

MOST_TAGS: Final = 500
"""The largest number of tags of a data set."""

LONGEST_TAG: Final = 60
"""Letters in the longest name."""

_TAGS_FILE_BYTES: Final = 64 << 20


Tags = Mapping[str, tuple[str, ...]]
"""The ids of each tag."""


class TagStore:
    """The tags of a data set; ``file`` is None if it is on another machine."""

    def __init__(self, dataset: str | Path) -> None:
        local = "://" not in str(dataset) and Path(dataset).exists()
        beside = overrides_path(Path(dataset)) if local else None
        self.file = None if beside is None else beside.with_name(beside.name.replace("overrides.toml", "tags.toml"))
        self._thread = threading.Lock()
        self._read: tuple[object, Tags] = (None, {})

    def now(self) -> Tags:
        """Return the contents of the file, which is read again if it has changed.

        Raises
        ------
        ConfigError
            The file cannot be read, or is a link.
        """
        stamp = self._stamp()
        if stamp != self._read[0]:
            self._read = (stamp, _read(self.file) if self.file is not None and stamp is not None else {})
        return self._read[1]

    def tag(self, name: str, ids: Iterable[str], *, remove: bool = False) -> Tags:
        """Give a tag to plans, or remove it; a tag without plans is deleted.

        Raises
        ------
        ConfigError
            The name is not valid, there are too many tags, or the file cannot be written.
        """
        name = check_name(name)
        if self.file is None:
            raise ConfigError("tags: this data set is on another machine; tag its plans on the server there")
        lock = self.file.with_name(f".{self.file.name}.lock")
        with self._thread, hold_file_lock(lock, self.file):
            found = self.now()
            has = dict.fromkeys(found.get(name, ()))
            for plan in ids:
                has.pop(plan, None) if remove else has.setdefault(plan)
            made = {each: plans for each, plans in {**found, name: tuple(has)}.items() if plans}
            if len(made) > MOST_TAGS:
                raise ConfigError(f"tags: expected at most {MOST_TAGS} tags; remove some first")
            write_atomically(self.file, _text(made).encode(), durable=True)
            self._read = (self._stamp(), made)
        return made

    def _stamp(self) -> object:
        if self.file is None:
            return None
        if self.file.is_symlink():
            raise ConfigError(f"{self.file.name}: expected a file, found a link, and links are not followed; remove it")
        try:
            found = self.file.stat()
        except OSError:
            return None
        return found.st_mtime_ns, found.st_size, found.st_ino


def check_name(name: str) -> str:
    """Return the name of a tag as one line; raise ConfigError if it is not valid."""
    plain = " ".join(name.split())
    if not 0 < len(plain) <= LONGEST_TAG or "," in plain or not plain.isprintable():
        raise ConfigError(f"tags: expected a name of 1 to {LONGEST_TAG} letters without a comma, found {name[:80]!r}")
    return plain


def _read(file: Path) -> Tags:
    try:
        with file.open("rb") as stream:
            data = stream.read(_TAGS_FILE_BYTES)
        table = tomllib.loads(without_mark(data).decode())
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise ConfigError(f"{file.name}: cannot be read ({error}); mend it or remove it") from None
    try:
        tags = msgspec.convert(table.get("tags", {}), dict[str, tuple[str, ...]])
    except msgspec.ValidationError as error:
        raise ConfigError(f"{file.name}: expected [tags] with lists of ids, found {error}; mend it") from None
    return {check_name(name): ids for name, ids in tags.items()}


def _text(found: Tags) -> str:
    lines = ["# Tags of houseexpo serve. You may edit this file.", "", "[tags]"]
    for name, ids in found.items():
        lines += [f"{_string(name)} = [", *(f"  {_string(each)}," for each in ids), "]"]
    return "\n".join([*lines, ""])


def _string(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
