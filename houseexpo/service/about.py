"""The home page of a data set: what it is, how large, under which licence, and how to open it.

What a data set says of itself comes from strangers: it is shown as plain text, at most so many letters, and read from
regular files in the folder itself. A file that is damaged says nothing.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response
from starlette.routing import BaseRoute, Route

from houseexpo.drawing.scene import DOOR_COLOURS
from houseexpo.plan.categories import LABELS, colour
from houseexpo.plan.parts import SURE
from houseexpo.service.collection import Collection, Opened
from houseexpo.service.service import Service

_BYTES: Final = 4 << 20
_LETTERS: Final = 600
_PICTURES: Final = 12
_FEW: Final = 6


def routes(service: Service) -> list[BaseRoute]:
    """Return the routes of ``/DATA/about``, and of ``/``: the data sets, or the gallery of the only one."""

    def about(request: Request) -> Response:
        shown = service.collection(request)
        facts = facts_of(shown, _PICTURES)
        return service.page(
            request,
            "about.html",
            shown=shown,
            here="about",
            facts=facts,
            labels=_labels(shown.now),
            doors=DOOR_COLOURS,
            python=_python(service.opening(request, shown.name)),
        )

    def start(request: Request) -> Response:
        if len(service.collections) == 1:
            return RedirectResponse(f"/{next(iter(service.collections))}/")
        listed = [(shown, facts_of(shown, _FEW)) for shown in service.collections.values()]
        return service.page(request, "start.html", listed=listed)

    return [Route("/", start), Route("/{data}/about", about)]


def facts_of(shown: Collection, pictures: int) -> dict[str, Any]:
    """Return what is known of a data set, in words and numbers, and some of its plans."""
    now = shown.now
    table, said = now.views.table, _said(shown.path)
    figures = [("plans", f"{len(table):,}"), *_totals(now)]
    figures += [(words, f"{count:,}") for words, count in _recorded(now) if count]
    return {
        "name": said.get("name", "") or shown.name,
        "what": said.get("description", "") or _sentence(now, said),
        "licence": said.get("license", ""),
        "version": said.get("version", ""),
        "sources": said.get("sources", ""),
        "figures": figures,
        "plans": [(table.ids[row], table.title(row)) for row in _spread(len(table), pictures)],
    }


def _totals(now: Opened) -> list[tuple[str, str]]:
    table, found = now.views.table, []
    for name, words, unit in (("rooms", "rooms in all", ""), ("area", "free area in all", " m²")):
        known = table.numbers(name)[~np.isnan(table.numbers(name))]
        if len(known):
            found.append((words, f"{known.sum():,.0f}{unit}"))
            found.append((f"{'rooms' if name == 'rooms' else 'area'} a plan, median", f"{np.median(known):,.0f}{unit}"))
    return found


def _recorded(now: Opened) -> list[tuple[str, int]]:
    quality = now.views.table.numbers("quality")
    doubtful = int((quality[~np.isnan(quality)] < SURE).sum())
    records = now.records
    return [
        (f"doubtful plans (quality below {SURE:g})", doubtful),
        ("inputs that gave no plan", len(records.refused)),
        ("duplicates dropped", len(records.repeated)),
    ]


def _sentence(now: Opened, said: Mapping[str, str]) -> str:
    names, codes = now.views.table.groups["source"]
    counts = Counter(codes[codes >= 0].tolist())
    kinds = ", ".join(f"{names[code]} ({count:,})" for code, count in counts.most_common(_FEW))
    maker = f", made by {said['generator']}" if said.get("generator") else ""
    count = len(now.views.table)
    return f"{count:,} floor plan{'' if count == 1 else 's'}{maker}{f', from {kinds}' if kinds else ''}."


def _said(path: Path) -> dict[str, str]:
    """Return what a data set's own files say of it: those of a release first, then the build's manifest."""
    if not path.is_dir():
        return {}
    manifest, croissant = _json(path / "manifest.json"), _json(path / "croissant.json")
    generator, sources = manifest.get("generator"), manifest.get("sources")
    made = [_text(generator.get(key)) for key in ("name", "version")] if isinstance(generator, dict) else []
    # a path is somebody's; a source that is made has none
    named = [_text(each) for each in sources if "/" not in str(each)] if isinstance(sources, list) else []
    found = {
        "generator": " ".join(made),
        "sources": ", ".join(named[:_FEW]),
        "license": _text(croissant.get("license")) or _text(manifest.get("licence")),
        **{key: _text(croissant.get(key)) for key in ("name", "description", "version")},
    }
    return {key: value.strip() for key, value in found.items()}


def _json(file: Path) -> dict[str, Any]:
    try:
        if file.is_symlink() or file.stat().st_size > _BYTES:
            return {}
        found = msgspec.json.decode(file.read_bytes())
    except (OSError, msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}


def _text(value: Any) -> str:
    return " ".join(value[:_LETTERS].split()) if isinstance(value, str) else ""


def _spread(count: int, most: int) -> Sequence[int]:
    """Return rows all over a data set."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).astype(int)).tolist() if count else []


def _labels(now: Opened) -> list[tuple[str, str, int]]:
    """Return the labels that occur, with their colour and how many plans have them, the most frequent first."""
    counts = now.views.table.labels.sum(axis=1).tolist()
    found = [(label, colour(label), count) for label, count in zip(LABELS, counts, strict=True) if count]
    return sorted(found, key=lambda each: -each[2])


def _python(opening: str) -> str:
    return (
        "import houseexpo\n\n"
        f"{opening}\n"
        "some = plans.select(rooms=(3, 6), labels=['Kitchen'])\n"
        "some.plot(12)                  # pictures, by matplotlib\n"
        "plans.to_pandas()              # one row a plan\n"
        "plan = some[0]\n"
        "plan.grid(25), plan.graph()    # an occupancy grid, the graph of rooms and doors\n"
    )
