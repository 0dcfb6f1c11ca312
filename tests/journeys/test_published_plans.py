"""Journey 5: the published plans, from the archive to tensors, by the lines that the page shows."""

from __future__ import annotations

import gzip
import itertools
from pathlib import Path
from typing import Any

import matplotlib as mpl
import pytest
from PIL import Image

from houseexpo import Dataset
from houseexpo.dataset.splits import inseparable_groups
from tests.builders.needs import need
from tests.builders.shared import DATA, needs_shared
from tests.journeys.pages import python_block

PUBLISHED = DATA / "houseexpo" / "plans_33717.jsonl.gz"


def walk(archive: Path) -> dict[str, Any]:
    """Run the lines on an archive in the current folder, and return their variables."""
    need(modules=["pandas", "torch"], how="make readers learn")
    mpl.use("agg")
    names: dict[str, Any] = {}
    exec(python_block("docs/readers/archive.md", "DataLoader").replace("plans/demo", str(archive)), names)  # noqa: S102
    return names


def check(names: dict[str, Any]) -> None:
    """The outcomes that a user looks at."""
    homes: Dataset = names["homes"]
    areas = [plan.area for plan in homes]
    assert areas == pytest.approx(sorted(areas), abs=0.01)
    assert all(3 <= plan.room_num <= 12 and 29.995 <= plan.area <= 300.005 for plan in homes)
    assert list(names["table"].index) == homes.ids
    assert list(names["table"]["source_rooms"]) == [plan.room_num for plan in homes]
    for picture in ("homes.png", "sheet.png"):
        assert len(Image.open(picture).convert("L").getcolors()) > 20
    train, test = (names["parts"][name] for name in ("train", "test"))
    assert sorted(train.ids + test.ids) == sorted(homes.ids)
    assert len(train) == pytest.approx(0.7 * len(homes), rel=0.05)
    assert tuple(names["batch"]["free"].shape) == (4, 1, 128, 128)
    assert tuple(names["batch"]["rooms"].shape) == (4, 128, 128)
    assert 0 < names["batch"]["free"].float().mean() < 1
    assert names["batch"]["rooms"].max() >= 1


@needs_shared
def test_some_published_plans_become_tensors(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with gzip.open(PUBLISHED) as lines:
        Path("some.jsonl").write_bytes(b"".join(itertools.islice(lines, 60)))
    names = walk(Path("some.jsonl"))
    assert len(names["plans"]) == 60
    check(names)
    for group in inseparable_groups(names["homes"]):
        assert sum(bool(set(group) & set(part.ids)) for part in names["parts"].values()) == 1


@pytest.mark.slow
@needs_shared
def test_all_published_plans_become_tensors(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names = walk(PUBLISHED)
    assert len(names["plans"]) == 33_717
    assert len(names["homes"]) > 20_000
    check(names)
