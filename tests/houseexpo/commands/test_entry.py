"""Where the command starts: Ctrl-C ends it with 130, also out of a string that a library executes at import."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

from houseexpo.commands import app

_INTERRUPTS_AN_IMPORT = """
import sys
class Interrupts:
    def find_spec(self, name, *_):
        if name == "houseexpo.commands.app":
            exec("raise KeyboardInterrupt")
sys.meta_path.insert(0, Interrupts())
"""


def test_ctrl_c_in_a_string_that_an_import_executes_ends_with_130(tmp_path: Path) -> None:
    (tmp_path / "sitecustomize.py").write_text(_INTERRUPTS_AN_IMPORT)
    done = subprocess.run(
        [sys.executable, "-m", "houseexpo", "--help"],
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (130, "interrupted\n")


@pytest.mark.parametrize(("number", "code"), [(errno.ENOSPC, 3), (errno.EDQUOT, 3), (errno.EACCES, 2)])
def test_a_full_disk_is_a_transient_fault_in_every_command(
    number: int, code: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(number, os.strerror(number), "map.pgm")

    monkeypatch.setattr("houseexpo.dataset.open_dataset", full)
    monkeypatch.setattr("houseexpo.dataset.dataset.open_dataset", full)
    monkeypatch.setattr(sys, "argv", ["houseexpo", "split", str(tmp_path)])
    with pytest.raises(SystemExit) as ended:
        app.main()
    assert ended.value.code == code
    assert "map.pgm" in capsys.readouterr().err
