"""How Sphinx makes the pages of ``docs/`` a site; ``make docs`` builds it, offline, and warnings are errors."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import houseexpo

project = "HouseExpo"
author = copyright = "the HouseExpo project"
version = release = houseexpo.__version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx_copybutton", "sphinx_design"]
exclude_patterns = ["_build", "examples", "scripts"]
highlight_language = "bash"  # blocks without a language hold commands
copybutton_prompt_text = "$ "  # of blocks with a prompt, only the commands are copied
source_suffix = {".md": "markdown"}

myst_heading_anchors = 3
myst_enable_extensions = ["colon_fence"]

autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_member_order = "bysource"
autodoc_mock_imports = ["torch", "stable_baselines3"]
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_preprocess_types = False

html_theme = "furo"
html_static_path = ["_static"]
html_css_files = ["wide.css"]
html_title = f"HouseExpo {version}"
html_show_sphinx = False
html_copy_source = False
html_theme_options = {"navigation_with_keys": True}


def make_accessible(_app: object, _page: str, _template: str, context: dict[str, object], _doctree: object) -> None:
    """Name the level of the headings in the sidebar, and let the keyboard reach what scrolls: code and wide tables."""
    for key, old, new in (
        ("furo_navigation_tree", 'role="heading"', 'role="heading" aria-level="2"'),
        ("body", "<pre>", '<pre tabindex="0">'),
        ("body", '<div class="table-wrapper', '<div tabindex="0" class="table-wrapper'),
    ):
        if isinstance(text := context.get(key), str):
            context[key] = text.replace(old, new)


def setup(app: object) -> None:
    """Connect what changes pages; it comes after the theme, which makes the sidebar."""
    app.connect("html-page-context", make_accessible, priority=900)  # type: ignore[attr-defined]
