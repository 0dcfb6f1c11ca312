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
python_maximum_signature_line_length = 80
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
