"""Hold and check the texts that the publisher of a release provides: title, creators, version, date and addresses."""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import date
from typing import Final

from houseexpo.errors import ConfigError

CREATORS: Final = ("HouseExpo contributors",)
_LINE_LETTERS: Final = 300
LINE: Final = f"a line of at most {_LINE_LETTERS} letters"


@dataclass(frozen=True)
class PublisherTexts:
    """Texts for the descriptions of a release; empty ones are left out.

    ``published`` is a date (2026-05-01). The current time is not used, so that two releases of the same data set to
    folders of the same name have equal bytes.

    Raises
    ------
    ConfigError
        A text is not valid in its place.
    """

    title: str = ""
    creators: tuple[str, ...] = CREATORS
    version: str = "1.0.0"
    published: str = ""
    url: str = ""
    doi: str = ""

    def __post_init__(self) -> None:
        for name, text in (("title", self.title), *(("creator", creator) for creator in self.creators)):
            if not fits_one_line(text):
                raise ConfigError(f"release: {name}: expected {LINE}, found {text!r}")
        if not self.creators or not all(self.creators):
            raise ConfigError("release: creator: expected at least one name, found none")
        _match(self.version, r"\d+\.\d+\.\d+", "version", "three numbers such as 1.0.0")
        _match(self.url, r"(https?://[^\s\"<>]+)?", "url", "an address that begins with https://")
        _match(self.doi, r"(10\.\d{4,9}/[^\s\"<>]+)?", "doi", "a DOI such as 10.5281/zenodo.1234567")
        if self.published:
            try:
                date.fromisoformat(self.published)
            except ValueError:
                expected = "a date such as 2026-05-01"
                raise ConfigError(f"release: date: expected {expected}, found {self.published!r}") from None
            _match(self.published, r"\d{4}-\d\d-\d\d", "date", "a date such as 2026-05-01")

    @property
    def year(self) -> str:
        """The year of publication, "" if no date is given."""
        return self.published[:4]


def fits_one_line(text: str) -> bool:
    """Return whether a text fits in one line of a description: printable, not too long, no space at the ends."""
    return len(text) <= _LINE_LETTERS and text.isprintable() and text == text.strip()


def _match(text: str, pattern: str, name: str, expected: str) -> None:
    if not re.fullmatch(pattern, text):
        raise ConfigError(f"release: {name}: expected {expected}, found {text!r}")
