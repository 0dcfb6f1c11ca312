"""What every page needs: the data sets by name, the settings, the templates."""

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
"""Sub-packages with templates and files of their own: ``review/page.html``, ``/static/review/page.js``."""


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
    """A service: ``collections`` are the data sets shown, by the name that stands in their addresses."""

    collections: Mapping[str, Collection]
    settings: Settings = field(default_factory=Settings)
    templates: Environment = field(default_factory=_templates, repr=False)

    def collection(self, request: Request) -> Collection:
        """Return the data set that a request's path names (``{data}``); answer 404 if there is none."""
        name = request.path_params["data"]
        found = self.collections.get(name)
        if found is None:
            known = ", ".join(self.collections)
            raise HTTPException(404, f"no data set {name!r} here; there are: {known}")
        found.look()
        return found

    def opening(self, request: Request, name: str) -> str:
        """Return the line of Python that opens a data set here; the token itself stays with those who have it."""
        address = f"{request.base_url}{name}"
        if not self.settings.token:
            return f'plans = houseexpo.open_dataset("{address}")'
        told = "# TOKEN: the one in the address that houseexpo serve printed"
        return f'plans = houseexpo.open_dataset("{address}?token=TOKEN")  {told}'

    def page(self, request: Request, template: str, status: int = 200, **values: Any) -> HTMLResponse:
        """Return a page: a template that extends ``base.html``, with the values that it needs.

        ``here`` says which link of the navigation is the page's own; ``shown`` is its data set, or None if it has none.
        """
        given = {"here": "", "shown": None, "request": request, "service": self, "settings": self.settings, **values}
        return HTMLResponse(self.templates.get_template(template).render(given), status)
