"""List the inputs of a build from its sources, each once; name sources, and count files, that hold no house."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from itertools import islice, product
from pathlib import Path

from houseexpo.errors import ConfigError
from houseexpo.files import real_path
from houseexpo.outputs import check_not_in_inputs, lies_in
from pipeline.batch.data_set_folder import PARTS
from pipeline.batch.disk import printable
from pipeline.batch.entry import journal_key
from pipeline.batch.mirror import Mirror, mirror_source
from pipeline.batch.result_store import is_url
from pipeline.config_file import BuildConfig
from pipeline.sources import NoHouseError, find, is_path, made_count
from pipeline.sources.files import links_left_out, walk_source_files
from pipeline.sources.reader_choice import parse_made_houses
from pipeline.values import Input


@dataclass(frozen=True)
class Listing:
    """The inputs of a build. Made houses are listed one by one, so that a million of them need no memory."""

    config: BuildConfig
    _files: dict[str, list[Input]] = field(default_factory=dict)
    _mirrors: dict[str, tuple[Mirror, Path]] = field(default_factory=dict)
    _passed_over: dict[str, NoHouseError] = field(default_factory=dict)

    def __iter__(self) -> Iterator[tuple[str, Input]]:
        """Yield each input once, with its source: the path in full, or ``procedural:COUNT?style=sound``."""
        return islice(self._list_inputs(), self.config.build.limit)

    @property
    def sources(self) -> tuple[str, ...]:
        """The sources by their full names."""
        return tuple(dict.fromkeys(map(full_source_name, self.config.build.sources)))

    @property
    def mirrors(self) -> tuple[Mirror, ...]:
        """The local folders that mirror the object stores listed so far."""
        return tuple(mirror for mirror, _ in self._mirrors.values())

    def public(self, item: Input) -> Input:
        """Return an input as every machine knows it: where it lies in an object store, not in the folder for it."""
        for mirror in self.mirrors:
            folder = str(mirror.root)
            if item.path.startswith(folder):
                options = tuple((name, value.replace(folder, mirror.url)) for name, value in item.options)
                return replace(item, path=item.path.replace(folder, mirror.url), options=options)
        return item

    def identity(self, item: Input) -> str:
        """Return what stands for an input in a journal, on every machine."""
        return journal_key(self.public(item))

    def check(self) -> None:
        """Raise ConfigError if a source does not exist, or none of them holds a house."""
        if not self.config.build.sources:
            raise ConfigError("no SOURCE: name one, or a --config whose [build] has sources")
        for source in self.config.build.sources:
            next(iter(self._inputs(source)), None)
        if len(self._passed_over) == len(set(self.config.build.sources)):
            raise next(iter(self._passed_over.values()))

    @property
    def passed_over(self) -> tuple[str, ...]:
        """The sources that hold no house, among others that do."""
        return tuple(self._passed_over)

    def check_apart(self, out: Path) -> None:
        """Raise ConfigError if a data set in ``out`` would lie in a source, or a source in its folders of plans."""
        places = [Path(self._place(source)) for source in self.config.build.sources if is_path(source)]
        check_not_in_inputs(out, places)
        for place, part in product(places, PARTS):
            if lies_in(place, out / part):
                raise ConfigError(
                    f"{place}: a source that lies in {out / part}, where a build writes; choose another --out"
                )

    def total(self) -> int:
        """Return how many inputs there are; an input that two sources hold counts twice."""
        counts = (made_count(source) or len(list(self._inputs(source))) for source in self.config.build.sources)
        return min(sum(counts), self.config.build.limit or sys.maxsize)

    def count_ignored(self) -> Counter[str]:
        """Count, by suffix, the files of the folders that are no house by themselves; a SUNCG root is left out."""
        counts: Counter[str] = Counter()
        for place, houses in self._folders():
            files = (file for file in walk_source_files(place) if file not in houses)
            counts.update(printable(file.suffix.lower()) or "no suffix" for file in files)
        return counts

    def links_left_out(self) -> tuple[str, ...]:
        """Return the links in the folders that are not followed; a SUNCG root is left out."""
        return tuple(link for place, _ in self._folders() for link in links_left_out(place))

    def _folders(self) -> Iterator[tuple[Path, set[Path]]]:
        """Yield the folders of houses but SUNCG roots, each with the paths of its inputs."""
        for source in self.config.build.sources:
            place = Path(self._place(source))
            if is_path(source) and place.is_dir():
                houses = {Path(item.path) for item in self._inputs(source)}
                if place not in houses:
                    yield place, houses

    def _list_inputs(self) -> Iterator[tuple[str, Input]]:
        sources = {full_source_name(source): source for source in self.config.build.sources}
        seen: set[Input] = set()
        for name, source in sources.items():
            for item in self._inputs(source):
                if len(sources) == 1:
                    yield name, item
                elif item not in seen:
                    seen.add(item)
                    yield name, item

    def _inputs(self, source: str) -> Iterable[Input]:
        if not is_path(source):
            return find(source, **self._options())
        if source not in self._files:
            try:
                self._files[source] = list(find(self._place(source), **self._options()))
            except NoHouseError as error:
                self._files[source], self._passed_over[source] = [], error
        return self._files[source]

    def _place(self, source: str) -> str:
        """Return where a source lies on this machine, whatever folder a worker is in."""
        if not is_url(source):
            return absolute_source(source)
        if source not in self._mirrors:
            self._mirrors[source] = mirror_source(source)
        return str(self._mirrors[source][1])

    def _options(self) -> dict[str, str]:
        options = self.config.build
        return {
            "up": options.up,
            "units": options.units,
            "scale": f"{options.scale:g}",
            "storey_height": "" if options.storey_height is None else f"{options.storey_height:g}",
            "resolution": "" if options.resolution is None else f"{options.resolution:g}",
            "furniture": "yes" if options.furniture else "no",
            "seed": str(options.seed),
            "model_path": options.model_path,
        }


def list_inputs(config: BuildConfig) -> Iterator[Input]:
    """Yield what the sources hold, each once, up to the limit.

    Raises
    ------
    ConfigError
        Where a source does not exist, or is not a source of houses.
    """
    listing = Listing(config)
    listing.check()
    return (item for _, item in listing)


def absolute_source(source: str) -> str:
    """Return a source's name that holds from any folder; a source that does not exist keeps its name."""
    return str(Path(source).absolute()) if is_path(source) and Path(source).exists() else source


def full_source_name(source: str) -> str:
    """Return a source's own name on this machine; of made houses it states the style."""
    if is_url(source):
        return source.rstrip("/")
    made = parse_made_houses(source)
    if made is not None:
        return made.name
    return printable(str(real_path(source))) if is_path(source) else source
