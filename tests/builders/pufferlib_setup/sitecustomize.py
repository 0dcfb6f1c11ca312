"""Lets PufferLib 3.0.0 be installed without its own games, and without CUDA.

Its ``setup.py`` forgets a name where NO_OCEAN is set, and takes a compiler of CUDA for a PyTorch with CUDA.
"""

import builtins
import shutil
from importlib.metadata import PackageNotFoundError, version
from typing import Any

builtins.c_extension_paths = []  # type: ignore[attr-defined]
_which = shutil.which


def _which_fits(program: str, *given: Any, **more: Any) -> Any:
    return None if program == "nvcc" else _which(program, *given, **more)


try:
    if version("torch").endswith("+cpu"):
        shutil.which = _which_fits
except PackageNotFoundError:
    pass
