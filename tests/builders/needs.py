"""What some tests need beside the project's own dependencies: without it they are skipped, and in CI they fail."""

from __future__ import annotations

import os
import shutil
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

import pytest


def is_installed(module: str) -> bool:
    """Whether a module can be imported; a folder that happens to have its name is no module.

    Name a module inside where the package itself is a namespace (``rosbags.rosbag2``).
    """
    try:
        found = find_spec(module)
    except ModuleNotFoundError:  # the package around it is not there
        return False
    return found is not None and found.origin is not None


def need(
    *,
    modules: Sequence[str] = (),
    programs: Sequence[str] = (),
    folders: Sequence[Path] = (),
    root: bool = False,
    how: str,
) -> None:
    """Skip where modules, programs or folders are missing; ``how`` says how to install them."""
    missing = [name for name in modules if not is_installed(name)]
    missing += [name for name in programs if shutil.which(name) is None]
    missing += [folder.name for folder in folders if not folder.is_dir()]
    if root and os.getuid() != 0:
        missing.append("root's rights")
    if missing:
        reason = f"not there: {', '.join(missing)}; {how}"
        if os.environ.get("CI"):
            pytest.fail(reason)
        pytest.skip(reason)
