"""Read a point cloud in blocks of points (n, 3), in its own unit and axes, so that large files take little memory.

E57 files come scan by scan, a compressed PCD file as one block, up to a limit.

PLY without faces, PCD, XYZ text, LAS and LAZ (laspy), E57 (pye57); the content says which it is.

**LZF**, which compresses PCD files: runs of literal bytes, and copies of what came before.

R1  A byte below 32 says how many literal bytes follow, less one.
R2  Any other says in its upper 3 bits how long a copy is, less two (7: a further byte adds to it), and in its lower 5
    bits, with the next byte, how far back it begins, less one.
"""

from __future__ import annotations

import io
import re
import subprocess
import sys
import warnings
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from houseexpo.errors import MissingDependencyError, install_command
from houseexpo.file_kinds import HEAD_BYTES
from pipeline.rejection import Reason, Rejection
from pipeline.sources.files import check_file
from pipeline.sources.tolerances import CHUNK_BYTES


def decompress_lzf(data: bytes, size: int) -> bytes:
    """Return the ``size`` bytes that were packed; raise ValueError if the data are not whole."""
    found = bytearray()
    at = 0
    try:
        while at < len(data):
            control = data[at]
            at += 1
            if control < 32:  # R1
                found += data[at : at + control + 1]
                at += control + 1
            else:  # R2
                length = control >> 5
                if length == 7:
                    length += data[at]
                    at += 1
                start = len(found) - ((control & 31) << 8) - data[at] - 1
                at += 1
                _copy(found, start, length + 2)
            if len(found) > size:
                break
    except IndexError:
        found.clear()
    if len(found) != size:
        raise ValueError(f"its compressed points are damaged: expected {size:,} bytes of them")
    return bytes(found)


def _copy(found: bytearray, start: int, length: int) -> None:
    """Append what stands at ``start``, again and again where that is shorter than ``length``."""
    if start < 0:
        raise IndexError
    piece = found[start : start + length]
    while len(piece) < length:
        piece += piece[: length - len(piece)]
    found += piece


Points = npt.NDArray[np.float64]
BLOCK = 1_000_000
LARGEST_PACKED = 1 << 29
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?|nan|[-+]?inf")
_PLY = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4",
        "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
        "float32": "f4", "float64": "f8"}  # fmt: skip


def read_blocks(path: Path) -> Iterator[Points]:
    """Yield the points (n, 3) of a file in its own unit and axes, a million at a time.

    Raises
    ------
    Rejection
        Where it cannot be read.
    MissingDependencyError
        Where the library for its format is not installed.
    """
    check_file(path)
    with path.open("rb") as stream:
        head = stream.read(HEAD_BYTES)
    try:
        if head.startswith(b"ply"):
            yield from _ply(path, head)
        elif head.startswith(b"LASF"):
            _require_library(path, "laspy")
            yield from _in_child(path)
        elif head.startswith(b"ASTM-E57"):
            _require_library(path, "pye57")
            yield from _in_child(path)
        elif b"FIELDS" in head[:2000] and b"DATA" in head[:4000]:
            yield from _pcd(path, head)
        else:
            with path.open("rb") as stream:
                yield from _text(stream, _columns_by_heading(stream))
    except (Rejection, MissingDependencyError, MemoryError):
        raise
    except Exception as error:  # noqa: BLE001 - what the libraries raise on broken bytes is of many kinds
        detail = f"{path.name} cannot be read as a point cloud: {type(error).__name__}: {str(error)[:120]}"
        raise Rejection("source", Reason.UNREADABLE, detail, "export or copy it again") from None


def _ply(path: Path, head: bytes) -> Iterator[Points]:
    end = head.index(b"end_header")
    start = head.index(b"\n", end) + 1
    lines = [line.split() for line in head[:end].decode("ascii", "replace").splitlines()]
    kind = next(line[1] for line in lines if line[:1] == ["format"])
    first = next(k for k, line in enumerate(lines) if line[:1] == ["element"])
    if lines[first][1] != "vertex":
        raise ValueError("expected the vertices first")
    fields = []
    for line in lines[first + 1 :]:
        if line[:1] == ["element"]:
            break
        if line[:1] == ["property"]:
            fields.append((line[-1], _PLY[line[1]]))
    count = int(lines[first][2])
    names = [name for name, _ in fields]
    with path.open("rb") as stream:
        stream.seek(start)
        if kind == "ascii":
            yield from _text(stream, tuple(names.index(axis) for axis in "xyz"), count)
        else:
            order = ">" if kind == "binary_big_endian" else "<"
            yield from _binary(stream, np.dtype([(name, order + code) for name, code in fields]), count)


def _pcd(path: Path, head: bytes) -> Iterator[Points]:
    at = head.index(b"DATA")
    start = head.index(b"\n", at) + 1
    said = {line.split()[0]: line.split()[1:] for line in head[:start].decode("ascii", "replace").splitlines() if line}
    names, sizes, kinds = said["FIELDS"], said["SIZE"], said["TYPE"]
    counts = said.get("COUNT", ["1"] * len(names))
    total = int(said["POINTS"][0])
    with path.open("rb") as stream:
        stream.seek(start)
        if said["DATA"] == ["ascii"]:
            columns = np.cumsum([0, *map(int, counts)])
            yield from _text(stream, tuple(int(columns[names.index(axis)]) for axis in "xyz"), total)
            return
        letters = {"F": "f", "I": "i", "U": "u"}
        kind = np.dtype(
            [
                (f"{name}{k}" if name == "_" else name, f"<{letters[t]}{int(size)}", (int(n),))
                for k, (name, t, size, n) in enumerate(zip(names, kinds, sizes, counts, strict=True))
            ]
        )
        if said["DATA"] == ["binary"]:
            yield from _binary(stream, kind, total)
        else:
            yield _unpack_fields(stream, kind, total)


def _unpack_fields(stream: BinaryIO, kind: np.dtype[Any], count: int) -> Points:
    """A PCD's points field by field, packed as one piece."""
    packed, size = (int(number) for number in np.frombuffer(stream.read(8), "<u4"))
    if size > LARGEST_PACKED or size != count * kind.itemsize:
        most = f"expected {count * kind.itemsize:,}, and {LARGEST_PACKED >> 20} MB at most"
        raise ValueError(f"its compressed points take {size:,} bytes, {most}; save it as binary")
    data = decompress_lzf(stream.read(packed), size)
    axes, fields = [], dict(kind.fields or {})
    for axis in "xyz":
        field, start = fields[axis][:2]
        axes.append(np.frombuffer(data, field.base, count, start * count).astype(np.float64))
    return np.column_stack(axes)


def _binary(stream: BinaryIO, kind: np.dtype[Any], count: int) -> Iterator[Points]:
    left = count
    while left > 0:
        data = stream.read(kind.itemsize * min(left, BLOCK))
        found = np.frombuffer(data, kind, count=len(data) // kind.itemsize)
        if not len(found):
            raise ValueError(f"it announces {count:,} points and breaks off {left:,} before")
        yield np.column_stack([found[axis].reshape(len(found), -1)[:, 0].astype(np.float64) for axis in "xyz"])
        left -= len(found)


def _text(stream: BinaryIO, columns: tuple[int, ...], count: int | None = None) -> Iterator[Points]:
    """Lines of numbers divided by spaces, tabs, commas or semicolons."""
    left = np.inf if count is None else count
    while left > 0 and (data := stream.read(CHUNK_BYTES)):
        lines = (data + stream.readline(CHUNK_BYTES)).translate(bytes.maketrans(b",;\t", b"   "))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a block of comments only
            found = np.loadtxt(io.BytesIO(lines), usecols=columns, ndmin=2, comments=["#", "//"])
        yield found[: int(min(left, len(found)))]
        left -= len(found)
    if count is not None and left > 0:
        raise ValueError(f"it announces {count:,} points and breaks off {int(left):,} before")


def _columns_by_heading(stream: BinaryIO) -> tuple[int, ...]:
    """Pass over what stands above the numbers, as the count of points; return the columns that it names x, y and z."""
    columns: tuple[int, ...] = (0, 1, 2)
    start = stream.tell()
    for line in iter(lambda: stream.readline(HEAD_BYTES), b""):
        words = line.translate(bytes.maketrans(b",;\t", b"   ")).decode("ascii", "replace").lower().strip("#/ ").split()
        if len(words) >= len(columns) and all(_NUMBER.fullmatch(word) for word in words):
            break
        if {"x", "y", "z"} <= (names := {word.strip("\"'"): k for k, word in enumerate(words)}).keys():
            columns = tuple(names[axis] for axis in "xyz")
        start = stream.tell()
    else:
        start = 0  # no line of numbers: whoever reads them says so
    stream.seek(start)
    return columns


def _in_child(path: Path) -> Iterator[Points]:
    """Points as another process reads them: the libraries of these formats end the process on some broken files."""
    # as a file of its own, not as a module: the package would be imported first, which takes longer than most files
    command = [sys.executable, "-P", str(Path(__file__).with_name("read_las_e57.py")), str(path.resolve())]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as child:  # noqa: S603 - our own
        assert child.stdout is not None  # noqa: S101 - as asked for
        assert child.stderr is not None  # noqa: S101
        try:
            while data := child.stdout.read(24 * BLOCK):
                yield np.frombuffer(data[: len(data) // 24 * 24], "<f8").reshape(-1, 3)
            said = child.stderr.read(1000).decode("utf-8", "replace").splitlines()
        finally:
            child.kill()
    if child.returncode:
        raise ValueError(said[0] if said else f"its library broke down ({child.returncode})")


def _require_library(path: Path, library: str) -> None:
    try:
        import_module(library)
    except ImportError:
        said = f"{path.name} needs {library}, which is not installed: {install_command('scans')}"
        raise MissingDependencyError(said) from None
