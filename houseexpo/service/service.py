"""The service that every page uses: its data sets by name, its settings, its templates."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from jinja2 import ChoiceLoader, Environment, PackageLoader, PrefixLoader, StrictUndefined
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import HTMLResponse

from houseexpo import __version__
from houseexpo.service.collection import Collection
from houseexpo.service.settings import Settings

PARTS = ("review", "drive")
"""Subpackages with their own templates and files: ``review/page.html``, ``/static/review/page.js``."""


def _templates() -> Environment:
    own = PackageLoader("houseexpo.service")
    parts = PrefixLoader({part: PackageLoader(f"houseexpo.service.{part}") for part in PARTS})
    found = Environment(
        loader=ChoiceLoader([own, parts]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    found.globals["version"] = __version__
    return found


@dataclass(frozen=True)
class Service:
    """A service; ``collections`` are its data sets by the names in their addresses."""

    collections: Mapping[str, Collection]
    settings: Settings = field(default_factory=Settings)
    templates: Environment = field(default_factory=_templates, repr=False)

    def collection(self, request: Request) -> Collection:
        """Return the data set that a request's path names (``{data}``); raise HTTPException (404) if there is none."""
        name = request.path_params["data"]
        found = self.collections.get(name)
        if found is None:
            known = ", ".join(self.collections)
            raise HTTPException(404, f"no data set {name!r}; the data sets: {known}")
        found.look()
        return found

    def opening(self, request: Request, name: str) -> str:
        """Return the line of Python that opens a data set of this server; it does not contain the token."""
        address = f"{request.base_url}{name}"
        if not self.settings.token:
            return f'plans = houseexpo.open_dataset("{address}")'
        told = "# TOKEN is in the address that houseexpo serve printed"
        return f'plans = houseexpo.open_dataset("{address}?token=TOKEN")  {told}'

    def page(self, request: Request, template: str, status: int = 200, **values: Any) -> HTMLResponse:
        """Return a page from a template that extends ``base.html``, and its values.

        ``here`` names the page's own link in the navigation; ``shown`` is its data set, None if it has none.
        """
        given = {"here": "", "shown": None, "request": request, "service": self, "settings": self.settings, **values}
        return HTMLResponse(self.templates.get_template(template).render(given), status)
