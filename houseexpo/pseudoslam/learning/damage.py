"""What reading a file raises where its bytes are damaged."""

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
"""Of all kinds: what bytes PyTorch, pickle and zipfile come upon decides where they stumble."""
