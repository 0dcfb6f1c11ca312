"""Damaged houses of every format in one build: each ends as a plan or with a reason, and nothing else shows."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.builders.damage import build_damaged

COUNT = 130
"""Each kind of house twice."""


@pytest.mark.slow
def test_damaged_houses_end_as_plans_or_with_a_reason(tmp_path: Path) -> None:
    found = build_damaged(tmp_path, COUNT, seed=7, limit_s=60)
    assert (found.code, found.inputs) == (0, COUNT), found.said
    assert f" from {COUNT} houses (" in found.said.splitlines()[0]
    assert "Traceback" not in found.said + found.written
    assert str(tmp_path) not in found.written
    assert not {"internal", "out_of_memory", "timeout"} & found.reasons.keys(), found.refused
    assert all(each["detail"] and each["advice"] for each in found.refused)
