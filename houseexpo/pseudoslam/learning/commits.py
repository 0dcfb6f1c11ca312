"""The commit of the code, if there is one."""

from __future__ import annotations

import subprocess
from functools import cache
from pathlib import Path

import houseexpo


@cache
def commit() -> str | None:
    """Return the commit of the code, with "+" if files differ from it; None if it is not in a repository.

    The result of the first call is cached.
    """
    root = Path(houseexpo.__file__).parents[1]
    if not (root / ".git").exists():
        return None
    said = [
        subprocess.run(["git", "-C", str(root), *words], capture_output=True, text=True, check=False)  # noqa: S603, S607
        for words in (["rev-parse", "HEAD"], ["status", "--porcelain", "--untracked-files=no"])
    ]
    if any(one.returncode for one in said):
        return None
    return said[0].stdout.strip() + ("+" if said[1].stdout.strip() else "")
