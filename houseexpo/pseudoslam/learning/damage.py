"""The errors of reading a damaged file."""

from __future__ import annotations

import pickle
import struct
import zipfile
import zlib
from typing import Final

import msgspec

DAMAGED: Final = (
    ArithmeticError, AttributeError, EOFError, LookupError, RuntimeError, TypeError, ValueError,
    msgspec.DecodeError, pickle.UnpicklingError, struct.error, zipfile.BadZipFile, zlib.error,
)  # fmt: skip
"""They are of many kinds, since damage may be found by PyTorch, pickle or zipfile."""
