"""A build shows how far it is: bars in a terminal, plain lines elsewhere."""

from __future__ import annotations

from io import StringIO

import pytest
from rich.console import Console

from pipeline import display
from pipeline.batch.entry import Entry, PlanRecord, StoredRejection
from pipeline.display import ProgressDisplay


def _entry(name: str, seconds: float, *reasons: str) -> Entry:
    plans = [] if reasons else [PlanRecord(name, "c", "p", 1)]
    return Entry(
        name, "", "", [], seconds, plans, [StoredRejection(name, "source", reason, "") for reason in reasons], file=name
    )


def _fine() -> None:
    """Let the build go on."""


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The time that the display sees; a test moves it."""
    now = [100.0]
    monkeypatch.setattr(display.time, "monotonic", lambda: now[0])
    return now


def test_a_log_gets_a_line_now_and_then_and_one_at_the_end(clock: list[float]) -> None:
    console = Console(file=StringIO(), force_terminal=False)
    with ProgressDisplay(console, _fine) as shown:
        shown.progress("planning", 0, 40)
        for number, seconds in enumerate((0.5, 3.0, 0.1)):
            shown.note_outcome(_entry(f"{number}.glb", seconds))
        shown.note_outcome(_entry("bad.glb", 0.1, "not_enclosed"))
        shown.progress("planning", 4, 40)  # too soon for a line
        clock[0] += 10.0
        shown.progress("planning", 20, 40)
        clock[0] += 1.0
        shown.progress("planning", 40, 40)
        shown.progress("planning", 40, 40)  # said already
    said = console.file.getvalue().splitlines()  # type: ignore[attr-defined]
    tally = "3 plans, 1 rejected (not_enclosed 1)"
    assert said == [f"planning: 20 of 40, 2.0 a second, 10 s left; {tally}", f"planning: 40 of 40; {tally}"]


def test_what_an_earlier_run_did_is_not_this_ones_speed(clock: list[float]) -> None:
    console = Console(file=StringIO(), force_terminal=False)
    with ProgressDisplay(console, _fine) as shown:
        shown.progress("planning", 900, 1000)
        clock[0] += 10.0
        shown.progress("planning", 950, 1000)
    assert "5.0 a second, 10 s left" in console.file.getvalue()  # type: ignore[attr-defined]


def test_a_terminal_shows_bars_and_what_came_of_the_inputs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm")  # a dumb one has no bars
    console = Console(file=StringIO(), force_terminal=True, width=100)
    with ProgressDisplay(console, _fine) as shown:
        shown.note_outcome(_entry("a.glb", 2.0, "units", "not_enclosed"))
        shown.note_outcome(_entry("b.glb", 1.0, "no_level"))
        shown.note_outcome(_entry("c.glb", 1.0, "no_interior"))
        shown.progress("planning", 3, 3)
    said = console.file.getvalue()  # type: ignore[attr-defined]
    assert "planning" in said
    assert "3/3" in said
    assert "0 plans, 4 rejected (units 1, not_enclosed 1, no_level 1, ...)" in said
    assert "longest" not in said  # that is for -v


def test_each_step_asks_whether_to_go_on() -> None:
    def stop() -> None:
        raise KeyboardInterrupt

    with ProgressDisplay(Console(file=StringIO()), stop) as shown, pytest.raises(KeyboardInterrupt):
        shown.progress("planning", 1, 2)
