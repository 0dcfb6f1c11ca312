"""Journey 6: a data set of variants of one house (a door, a wall, furniture), by the lines of the page."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from houseexpo import open_dataset
from tests.builders.commands import call
from tests.journeys.pages import commands, python_block

PAGE = "docs/guide-pipeline.md"


@pytest.mark.slow
def test_all_variants_of_a_house_are_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    exec(python_block(PAGE, "variants"), {})  # noqa: S102 - the page's own lines
    written = sorted(file.stem for file in Path("variants").glob("*.glb"))
    assert len(written) == 15

    [build] = commands(PAGE, "build variants")
    call(*shlex.split(build)[1:], "--workers", "2")

    plans = open_dataset("plans/variants")
    assert plans.ids == written
    assert plans.column("rooms") == [2] * 15
    for name in written:
        inner = next(door for door in plans[name].doors if None not in door.rooms)
        [sofa] = plans[name].objects or [None]
        assert (sofa is not None) == name.startswith("sofa")
        width_cm, wall_cm = (90, 400) if sofa else (int(word) for word in name.split("_")[1::2])
        assert inner.width == pytest.approx(width_cm / 100, abs=0.02)
        left = min(
            room.area for room in plans[name].rooms
        )  # one of them is 0.2 m of wall to the east end from the other
        widths = sorted((wall_cm / 100 - 0.2, 6.8 - wall_cm / 100 - 0.2))
        assert left == pytest.approx(widths[0] * 4.6, abs=0.3 if sofa is None else 1.8)
    parts = plans.split(train=0.5, test=0.5)
    assert sum(len(part) for part in parts.values()) == 15
