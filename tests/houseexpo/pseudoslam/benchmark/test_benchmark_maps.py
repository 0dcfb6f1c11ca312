"""Tracks on maps of other people: small maps in their formats, with the starts where their programs have them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.benchmark.maps import StartedHouse, map_cases, read_maps
from houseexpo.pseudoslam.benchmark.result import read_result
from houseexpo.pseudoslam.benchmark.tracks import MAP_TRACKS, find_track
from tests.builders.commands import call
from tests.builders.shared import DATA, needs_shared

MARK, FREE, WALL = 208, 195, 127


def dungeon(folder: Path, name: str = "img_1", marks: int = 200) -> np.ndarray:
    """A hall of 60 x 40 pixels with a chamber, marked at the start in the order of rows from row 10, column 12."""
    pixels = np.full((60, 100), WALL, np.uint8)
    pixels[6:46, 6:66] = FREE
    pixels[20:40, 70:94] = FREE
    pixels[28:32, 66:70] = FREE
    rows, cols = np.divmod(np.arange(marks), 20)
    pixels[10 + rows, 12 + cols] = MARK
    Image.fromarray(pixels).save(folder / f"{name}.png")
    return pixels


def floor(folder: Path, starts: str = "hall --start_pose 510 512\nhall --start_pose 520 530\n") -> None:
    """A floor of 8 m x 6 m in pixels of 0.05 m; black is occupied."""
    pixels = np.zeros((120, 160), np.uint8)
    pixels[4:116, 4:156] = 255
    pixels[61, 61] = 0  # a post of one pixel, which fills its cell
    Image.fromarray(pixels).save(folder / "hall.png")
    (folder / "starts.txt").write_text(starts)


def test_a_floor_of_mapex_has_cells_of_a_tenth_of_a_metre_and_its_starts(tmp_path: Path) -> None:
    floor(tmp_path)
    (house,) = read_maps(find_track("kth"), tmp_path)
    assert isinstance(house, StartedHouse)
    assert house.occupied.shape == (60, 80)
    assert house.pixels_per_metre == pytest.approx(10.0)
    assert house.occupied[30, 30]
    assert house.occupied.sum() == 2 * (2 * 60 + 2 * 80 - 8) + 1
    first, second = map_cases(find_track("kth"), [house])
    assert first.pose == pytest.approx((1.25, 6.0 - 1.05, 0.0))  # row 10, column 12 of the floor itself
    assert second.pose == pytest.approx((3.05, 6.0 - 2.05, 0.0))
    assert first.seed != second.seed


def test_pipe_runs_on_the_floors_of_a_class(tmp_path: Path) -> None:
    floor(tmp_path, "hall --start_pose 510 512\n50052749 --start_pose 510 512\n")
    (tmp_path / "50052749.png").write_bytes((tmp_path / "hall.png").read_bytes())
    assert [house.id for house in read_maps(find_track("pipe-small"), tmp_path)] == ["50052749"]
    assert find_track("pipe-large").budgets_m == (300, 600)
    with pytest.raises(ConfigError, match="expected a start on 50015847 or 50015848, found none"):
        read_maps(find_track("pipe-large"), tmp_path)


def test_a_map_of_dare_joins_pixels_and_starts_at_the_eleventh_mark(tmp_path: Path) -> None:
    pixels = dungeon(tmp_path)
    (house,) = read_maps(find_track("dare"), tmp_path)
    assert isinstance(house, StartedHouse)
    joined = pixels.reshape(30, 2, 50, 2).min(axis=(1, 3)) <= 150
    assert np.array_equal(house.occupied > 0, joined.repeat(2, axis=0).repeat(2, axis=1))
    ((x, y, heading),) = house.starts  # cells of marks: ten in each of five rows from row 5, column 6
    assert (x, y, heading) == pytest.approx((6.5 * 0.4, (30 - 6.5) * 0.4, 0.0))


def test_a_map_of_ariadne_starts_at_the_128th_mark(tmp_path: Path) -> None:
    pixels = dungeon(tmp_path)
    (house,) = read_maps(find_track("ariadne"), tmp_path)
    assert isinstance(house, StartedHouse)
    assert np.array_equal(house.occupied > 0, pixels <= 150)
    ((x, y, _),) = house.starts
    assert (x, y) == pytest.approx(((12 + 7.5) * 0.25, (60 - 16.5) * 0.25))


@pytest.mark.parametrize(
    ("track", "said"),
    [("kth", "expected the pictures"), ("dare", "expected the pictures"), ("ariadne", "expected the pictures")],
)
def test_an_empty_folder_is_refused(tmp_path: Path, track: str, said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        read_maps(find_track(track), tmp_path)


def test_missing_starts_are_refused(tmp_path: Path) -> None:
    dungeon(tmp_path, marks=5)
    for track in ("dare", "ariadne"):
        with pytest.raises(ConfigError, match="expected the start"):
            read_maps(find_track(track), tmp_path)
    with pytest.raises(ConfigError, match=r"expected starts\.txt"):
        read_maps(find_track("kth"), tmp_path)
    floor(tmp_path, "hall --start_pose 510\n")
    with pytest.raises(ConfigError, match="ROW COLUMN"):
        read_maps(find_track("kth"), tmp_path)
    floor(tmp_path, "attic --start_pose 510 510\n")
    with pytest.raises(ConfigError, match="floor attic"):
        read_maps(find_track("kth"), tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("track", ["kth", "dare", "ariadne"])
def test_a_track_runs_from_the_command_line(tmp_path: Path, track: str) -> None:
    maps, out = tmp_path / "maps", tmp_path / "run.json"
    maps.mkdir()
    if track == "kth":
        floor(maps)
    else:
        dungeon(maps)
    words = ["benchmark", "run", "--track", track, "--policy", "frontier", "--maps", maps, "--out", out]
    call(*words, "--workers", "1")
    result = read_result(out)
    assert result.track_id == find_track(track).id
    coverage = json.loads(out.read_bytes())["episodes"]["coverage"]
    assert len(coverage) == (2 if track == "kth" else 1)
    assert min(coverage) >= 0.98


def test_a_track_of_maps_asks_for_maps(tmp_path: Path) -> None:
    words = ["benchmark", "run", "--track", "kth", "--policy", "frontier", "--out", str(tmp_path / "run.json")]
    done = call(*words, code=2)
    assert "--maps" in done


@needs_shared
def test_all_published_maps_can_be_read() -> None:
    counts = {"kth": 24, "dare": 100, "ariadne": 100, "pipe-small": 8, "pipe-medium": 8, "pipe-large": 8}
    for track in MAP_TRACKS:
        folder = DATA / "maps" / {"ariadne": "ariadne_complex", "dare": "dare"}.get(track.name, "kth")
        cases = map_cases(track, read_maps(track, folder))
        assert len(cases) == counts[track.name]
        assert all(case.pose is not None for case in cases)
