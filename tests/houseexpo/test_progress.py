"""How far something long is, where no terminal shows it."""

from __future__ import annotations

import logging
from types import SimpleNamespace

import pytest

from houseexpo import progress


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The time, to be set; standard error is no terminal in a test."""
    now = [0.0]
    monkeypatch.setattr(progress, "time", SimpleNamespace(monotonic=lambda: now[0]))
    return now


@pytest.mark.parametrize(("total", "of"), [(4000, " of 4,000"), (None, "")])
def test_a_log_has_a_line_now_and_then(
    clock: list[float], capsys: pytest.CaptureFixture[str], total: int | None, of: str
) -> None:
    seen = []
    for item in progress.show_progress(range(4000), "drawing", total):
        clock[0] += progress.EVERY_S / 1280  # a power of two in the fraction: no rounding
        seen.append(item)
    assert seen == list(range(4000))
    assert capsys.readouterr().err == f"drawing: 1,280{of}\ndrawing: 2,560{of}\ndrawing: 3,840{of}\n"


def test_quiet_commands_say_nothing(clock: list[float], capsys: pytest.CaptureFixture[str]) -> None:
    log = logging.getLogger("houseexpo")
    before = log.level
    log.setLevel(logging.ERROR)
    try:
        for _ in progress.show_progress(range(3), "drawing", 3):
            clock[0] += 2 * progress.EVERY_S
    finally:
        log.setLevel(before)
    assert capsys.readouterr().err == ""
