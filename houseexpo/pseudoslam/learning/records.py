"""Record a training run: its settings and versions, the commit of its code, and learning curves in a CSV file."""

from __future__ import annotations

import csv
import io
import math
import platform
import subprocess
from collections.abc import Mapping, Sequence
from functools import cache, partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import msgspec

import houseexpo
from houseexpo.errors import TrainingError
from houseexpo.files import encode_json, make_folder, write_atomically
from houseexpo.outputs import check_run_folder, first_difference


@cache
def find_commit() -> str | None:
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


def find_versions(libraries: Sequence[str] = ("numpy",)) -> dict[str, str]:
    """Return the versions of HouseExpo, Python and some libraries that a run uses."""
    made_by = {"houseexpo": houseexpo.__version__, "python": platform.python_version()}
    return {**made_by, **{name: version(name) for name in libraries}}


def begin_run(
    folder: Path, run: Mapping[str, Any], *, resume: bool, holds: Sequence[str] = (), free: Sequence[str] = ()
) -> None:
    """Write the description of a run to ``run.json``.

    Parameters
    ----------
    holds
        The names of what a run writes first, by which a folder is known to hold one.
    free
        As for ``check_same_run``.

    Raises
    ------
    TrainingError
        The folder holds another run, a damaged one, or a run and ``resume`` is False.
    """
    record = folder / "run.json"
    if not resume and any((folder / name).exists() for name in (record.name, *holds)):
        raise TrainingError(f"{folder}: holds a run; continue it with --resume, or name another folder")
    check_run_folder(folder, [record.name, *holds])
    if record.exists():
        read = partial(msgspec.json.decode, type=dict[str, Any])
        try:
            found = read(record.read_bytes())
        except msgspec.DecodeError:
            raise TrainingError(f"{record}: damaged; name another folder") from None
        check_same_run(found, read(encode_json(run)), record, free)
    make_folder(folder)
    write_atomically(record, encode_json(run))


def check_same_run(found: Mapping[str, Any], wanted: Mapping[str, Any], where: Path, free: Sequence[str] = ()) -> None:
    """Raise TrainingError, which names the first difference, unless the runs are the same.

    ``free`` are dotted keys that may differ.
    """
    other = first_difference(_drop_keys(found, free), _drop_keys(wanted, free))
    if other is not None:
        key, there, here = other
        raise TrainingError(
            f"{where}: belongs to another run: {key} is {there!r} there, {here!r} here; "
            "continue with the settings of that run, or name another folder"
        )


def _drop_keys(values: Mapping[str, Any], free: Sequence[str], within: str = "") -> dict[str, Any]:
    """Return nested values without some dotted keys."""
    return {
        key: _drop_keys(value, free, f"{within}{key}.") if isinstance(value, Mapping) else value
        for key, value in values.items()
        if f"{within}{key}" not in free
    }


STEPS = "steps_done"


class CurveFile:
    """A CSV file whose first column is the number of steps; the first added row determines the other columns."""

    def __init__(self, file: Path, until: int) -> None:
        """Continue a file after a number of steps; later rows and incomplete rows are dropped."""
        self._file = file
        header, *rows = [*_rows(file), []][:-1] or [[]]
        self._names = header
        kept = [row for row in rows if len(row) == len(header) and row[0].isdigit() and int(row[0]) <= until]
        write_atomically(file, _as_csv([header, *kept]) if header and kept else b"")
        if not kept:
            self._names = []

    def add(self, steps: int, values: Mapping[str, float]) -> None:
        """Append a row."""
        rows: list[list[str]] = []
        if not self._names:
            self._names = [STEPS, *values]
            rows.append(self._names)
        rows.append([str(steps), *(_format_value(values.get(name, math.nan)) for name in self._names[1:])])
        with self._file.open("ab") as stream:
            stream.write(_as_csv(rows))


def _rows(file: Path) -> list[list[str]]:
    if not file.is_file():
        return []
    whole, _, _ = file.read_bytes().rpartition(b"\n")  # text after the last newline is incomplete
    return list(csv.reader(io.StringIO(whole.decode("utf-8", "replace"))))


def _format_value(value: float) -> str:
    return "" if math.isnan(value) else f"{value:.6g}"


def _as_csv(rows: list[list[str]]) -> bytes:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue().encode()
