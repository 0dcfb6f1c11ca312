"""Where the command starts: Ctrl-C ends it with 130, also out of a string that a library executes at import."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

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
