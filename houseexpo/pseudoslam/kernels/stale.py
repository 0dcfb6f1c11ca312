"""Compiled kernels on disk that no longer say what the sources do.

numba keeps what it has compiled beside a hash of the file that it stands in, and does not look at other files that it
calls: after an update of one of those it would go on with the old code.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
from pathlib import Path
from typing import Any

_MARK = "sources.sha256"


def forget_stale(kernel: Any, sources: Path) -> None:
    """Remove what was compiled to disk from other ``sources``, a folder of Python files, than are there now.

    ``kernel`` is one of theirs: all are kept in one place. Where nothing can be removed, nothing could be written.
    """
    if not hasattr(kernel, "stats") or kernel.stats.cache_path is None:
        return  # nothing is compiled, or kept
    digest = _digest(sources)
    place = Path(kernel.stats.cache_path)
    with contextlib.suppress(OSError):
        if (place / _MARK).is_file() and (place / _MARK).read_text() == digest:
            return
        for kept in sorted(place.glob("*.nb[ic]")):
            kept.unlink(missing_ok=True)
        whole = place / f"{_MARK}.{os.getpid()}"
        whole.write_text(digest)
        whole.replace(place / _MARK)


def _digest(sources: Path) -> str:
    found = hashlib.sha256()
    for source in sorted(sources.glob("*.py")):
        found.update(source.name.encode() + b"\0" + source.read_bytes() + b"\0")
    return found.hexdigest()
