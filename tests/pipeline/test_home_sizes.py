"""Plans that are as large as those of another data set."""

from __future__ import annotations

from pathlib import Path

from houseexpo import save_plan
from houseexpo.floorplan import FloorPlan
from research.home_sizes import list_by_size


def squares(folder: Path, sides: list[float]) -> str:
    """A data set of square plans, named after their sides."""
    (folder / "json").mkdir(parents=True)
    for side in sides:
        name = f"side-{side}"
        corners = [(0.0, 0.0), (0.0, side), (side, side), (side, 0.0)]
        save_plan(FloorPlan(name, corners, 1, {}), folder / "json" / f"{name}.json")
    return str(folder)


def test_the_nearest_sizes_are_listed_and_none_twice(tmp_path: Path) -> None:
    homes, plans = squares(tmp_path / "homes", [4.0, 5.0, 6.0, 7.0]), squares(tmp_path / "plans", [5.1, 8.0, 9.0])
    assert list_by_size(homes, plans, 3) == ["side-5.0", "side-6.0", "side-7.0"]
    assert len(list_by_size(plans, homes, 9)) == 3
