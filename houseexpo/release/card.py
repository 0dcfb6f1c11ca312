"""The data card of a release: ``README.md`` with the header that Hugging Face reads."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any, Final

from houseexpo.release.tables import Table
from houseexpo.release.words import KEYWORDS, Facts, bibtex

MEASURES: Final = "pictures/measures.png"
SHEET: Final = "pictures/plans.png"
_HUB_SPLITS: Final = {"val": "validation"}
_SIZES: Final = ((1_000, "n<1K"), (10_000, "1K<n<10K"), (100_000, "10K<n<100K"), (1_000_000, "100K<n<1M"))
_SIGNS: Final = re.compile(r"[\\`*\[\]<>|]|(?<!\w)_|_(?!\w)|(?<!/)~")
"""The characters of Markdown syntax, which are escaped by a backslash. Bare addresses are unchanged."""
_ROWS: Final = (
    ("rooms", "rooms in a plan, as its source counts them", ""),
    ("area_m2", "free area", "m²"),
    ("long_side_m", "longer side", "m"),
    ("short_side_m", "shorter side", "m"),
    ("room_area_m2", "area of a room", "m²"),
    ("doors", "doors in a plan", ""),
    ("door_width_m", "width of a door", "m"),
    ("furniture", "pieces of furniture in a furnished plan", ""),
    ("quality", "quality", ""),
)


def card(facts: Facts, tables: Sequence[Table]) -> bytes:
    """Return the data card."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("houseexpo.release"),
        autoescape=False,  # noqa: S701  # Markdown; About has no line breaks in its words
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["words"] = _words
    text = environment.get_template("README.md.j2").render(
        header=_header(facts, tables),
        facts=facts,
        manifest=facts.material.manifest,
        tables=tables,
        measures=_measures(facts),
        part=next(iter(facts.parts.lists)),  # train, if there is one
        reach=[
            (radius, f"{100 * r['connected_share']:.1f}%") for radius, r in sorted(facts.stats["navigability"].items())
        ],
        hub_split=lambda part: _HUB_SPLITS.get(part, part),
        bibtex=bibtex(facts),
        pictures=(SHEET, MEASURES),
    )
    return text.encode()


def _words(text: str) -> str:
    """Escape a text so that Markdown shows it literally: without HTML, links, pictures or emphasis."""
    return _SIGNS.sub(r"\\\g<0>", text)


def _header(facts: Facts, tables: Sequence[Table]) -> str:
    """Return the YAML that lists the tables for Hugging Face, which shows the first one."""
    import yaml

    parts = facts.parts.lists
    size = next((name for limit, name in _SIZES if facts.plans < limit), "1M<n<10M")
    configs: list[dict[str, Any]] = [
        {
            "config_name": table.name,
            **({"default": True} if number == 0 else {}),
            "data_files": [
                {"split": _HUB_SPLITS.get(part, part), "path": f"{table.name}/{part}.parquet"} for part in parts
            ],
        }
        for number, table in enumerate(tables)
    ]
    said = {
        "pretty_name": facts.title,
        "license": facts.material.licence.hub,
        "task_categories": ["robotics"],
        "size_categories": [size],
        "tags": list(KEYWORDS),
        "configs": configs,
    }
    text: str = yaml.safe_dump(said, sort_keys=False, allow_unicode=True, width=1000)
    return text


def _measures(facts: Facts) -> list[tuple[str, ...]]:
    """Return the rows of the table of figures: name, mean, median, 5%, 95%."""
    rows = []
    for name, title, unit in _ROWS:
        tally = facts.stats.get(name, {})
        if tally.get("count"):
            values = (f"{tally[key]:,.4g}" for key in ("mean", "median", "p05", "p95"))
            rows.append((title, *(f"{value} {unit}".rstrip() for value in values)))
    return rows
