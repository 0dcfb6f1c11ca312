"""Store the tags that people give to plans, and the views (queries) that they save, in one TOML file per data set.

The file is ``tags.toml`` in a folder of plans, and ``<name>.tags.toml`` beside an archive. People may edit it, and
several servers may write it: each change reads the file again, under a lock that the system releases when its owner
ends. Links are not followed, because a data set may come from strangers.
"""

from __future__ import annotations

import json
import threading
import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from houseexpo.dataset.store.folders import overrides_path
from houseexpo.errors import ConfigError
from houseexpo.files import hold_file_lock, without_mark, write_atomically

MOST_TAGS: Final = 500
"""The largest number of tags of a data set, and of views."""

LONGEST_TAG: Final = 60
"""Letters in the longest name."""

_TAGS_FILE_BYTES: Final = 64 << 20


@dataclass(frozen=True)
class TagsAndViews:
    """The contents of the file: the ids of each tag, and the query of each saved view."""

    tags: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    views: Mapping[str, str] = field(default_factory=dict)


class TagStore:
    """The tags and saved views of a data set; ``file`` is None if it is on another machine."""

    def __init__(self, dataset: str | Path) -> None:
        local = "://" not in str(dataset) and Path(dataset).exists()
        beside = overrides_path(Path(dataset)) if local else None
        self.file = None if beside is None else beside.with_name(beside.name.replace("overrides.toml", "tags.toml"))
        self._thread = threading.Lock()
        self._read: tuple[object, TagsAndViews] = (None, TagsAndViews())

    def now(self) -> TagsAndViews:
        """Return the contents of the file, which is read again if it has changed.

        Raises
        ------
        ConfigError
            The file cannot be read, or is a link.
        """
        stamp = self._stamp()
        if stamp != self._read[0]:
            self._read = (stamp, _read(self.file) if self.file is not None and stamp is not None else TagsAndViews())
        return self._read[1]

    def tag(self, name: str, ids: Iterable[str], *, remove: bool = False) -> TagsAndViews:
        """Give a tag to plans, or remove it; a tag without plans is deleted.

        Raises
        ------
        ConfigError
            The name is not valid, there are too many tags, or the file cannot be written.
        """
        name = check_name(name)

        def change(found: TagsAndViews) -> TagsAndViews:
            has = dict.fromkeys(found.tags.get(name, ()))
            for plan in ids:
                has.pop(plan, None) if remove else has.setdefault(plan)
            tags = {**found.tags, name: tuple(has)}
            return TagsAndViews({each: plans for each, plans in tags.items() if plans}, found.views)

        return self._update(change)

    def save_view(self, name: str, query: str | None) -> TagsAndViews:
        """Save a query under a name, or delete that view if the query is None; for errors see ``tag``."""
        name = check_name(name)

        def change(found: TagsAndViews) -> TagsAndViews:
            views = {**found.views, name: query or ""}
            if query is None:
                del views[name]
            return TagsAndViews(found.tags, views)

        return self._update(change)

    def _update(self, change: Callable[[TagsAndViews], TagsAndViews]) -> TagsAndViews:
        if self.file is None:
            raise ConfigError("tags: this data set is on another machine; tag its plans on the server there")
        lock = self.file.with_name(f".{self.file.name}.lock")
        with self._thread, hold_file_lock(lock, self.file):
            made = change(self.now())
            if max(len(made.tags), len(made.views)) > MOST_TAGS:
                raise ConfigError(f"tags: expected at most {MOST_TAGS} tags and views; remove some first")
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
    """Return the name of a tag or a view as one line; raise ConfigError if it is not valid."""
    plain = " ".join(name.split())
    if not 0 < len(plain) <= LONGEST_TAG or "," in plain or not plain.isprintable():
        raise ConfigError(f"tags: expected a name of 1 to {LONGEST_TAG} letters without a comma, found {name[:80]!r}")
    return plain


def _read(file: Path) -> TagsAndViews:
    try:
        with file.open("rb") as stream:
            data = stream.read(_TAGS_FILE_BYTES)
        table = tomllib.loads(without_mark(data).decode())
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise ConfigError(f"{file.name}: cannot be read ({error}); mend it or remove it") from None
    tags, views = table.get("tags", {}), table.get("views", {})
    good = isinstance(tags, dict) and isinstance(views, dict) and all(isinstance(each, str) for each in views.values())
    if not good or not all(isinstance(ids, list) and all(isinstance(i, str) for i in ids) for ids in tags.values()):
        raise ConfigError(f"{file.name}: expected [tags] with lists of ids and [views] with texts; mend it")
    return TagsAndViews({check_name(name): tuple(ids) for name, ids in tags.items()}, views)


def _text(found: TagsAndViews) -> str:
    lines = ["# Tags and saved views of houseexpo serve. You may edit this file.", "", "[tags]"]
    for name, ids in found.tags.items():
        lines += [f"{_string(name)} = [", *(f"  {_string(each)}," for each in ids), "]"]
    lines += ["", "[views]", *(f"{_string(name)} = {_string(query)}" for name, query in found.views.items()), ""]
    return "\n".join(lines)


def _string(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
