"""Lets PufferLib 3.0.0 be installed without its own games: its ``setup.py`` forgets a name where NO_OCEAN is set."""

import builtins

builtins.c_extension_paths = []  # type: ignore[attr-defined]
