"""The long description of the distribution: the README with links that work on an index page.

All else stands in ``pyproject.toml``. Links of the README are relative, and an index page has no files beside it.
With a ``Repository`` in ``[project.urls]`` they become absolute. Without one, links become plain text and pictures are
left out.
"""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

from setuptools import setup

ROOT = Path(__file__).parent
RELATIVE = r"(?!https?://|#|mailto:)"


def long_description() -> str:
    """Return the README's text for an index page."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    repository = project.get("urls", {}).get("Repository", "").rstrip("/")
    if repository:
        text = re.sub(rf"!\[([^\]]*)\]\({RELATIVE}([^)]+)\)", rf"![\1]({repository}/raw/main/\2)", text)
        return re.sub(rf"(?<!!)\[([^\]]*)\]\({RELATIVE}([^)]+)\)", rf"[\1]({repository}/blob/main/\2)", text)
    text = re.sub(rf"!\[[^\]]*\]\({RELATIVE}[^)]+\)\n*(\*[^*]+\*\n*)?", "", text)
    return re.sub(rf"\[([^\]]*)\]\({RELATIVE}[^)]+\)", r"\1", text)


setup(long_description=long_description(), long_description_content_type="text/markdown")
