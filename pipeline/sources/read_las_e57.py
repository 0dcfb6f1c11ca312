"""Read a LAS, LAZ or E57 file in a separate process, so that a crash of the library ends only that process.

Started as ``python -P read_las_e57.py FILE``; writes points to standard output, x y z, little-endian float64, and
what went wrong to standard error.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

BLOCK = 1_000_000


def read_las(path: str) -> Iterator[npt.NDArray[np.float64]]:
    """Yield the points of a LAS or LAZ file."""
    import laspy

    with laspy.open(path) as reader:
        for chunk in reader.chunk_iterator(BLOCK):
            yield np.column_stack([np.asarray(chunk.x), np.asarray(chunk.y), np.asarray(chunk.z)])


def read_e57(path: str) -> Iterator[npt.NDArray[np.float64]]:
    """Yield the points of an E57 file, scan by scan, in the file's common frame."""
    import pye57

    file = pye57.E57(path)
    for number in range(file.scan_count):
        scan = file.read_scan(number, ignore_missing_fields=True, transform=True)
        yield np.column_stack([scan[f"cartesian{axis}"] for axis in "XYZ"])


def main(path: str) -> int:
    """Write all points of a file; returns the exit status."""
    with open(path, "rb") as stream:  # noqa: PTH123 - nothing but the file's name is known here
        reader = read_las if stream.read(4) == b"LASF" else read_e57
    try:
        for block in reader(path):
            sys.stdout.buffer.write(np.ascontiguousarray(block, "<f8").tobytes())
    except Exception as error:  # noqa: BLE001 - what the libraries raise on broken bytes is of many kinds
        sys.stderr.write(f"{type(error).__name__}: {str(error)[:120]}")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
