"""A small data set of made houses, and its release."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from houseexpo.release import PublisherTexts, release, write_release
from pipeline.algorithm import plan_level
from tests.builders.batch import one_room, run_build

ABOUT = PublisherTexts(
    title="Eight houses",
    creators=("A. Author", "B. Builder"),
    published="2026-05-01",
    url="https://example.org/eight",
    doi="10.5281/zenodo.1234567",
)


@pytest.fixture(scope="session")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A build of eight houses that the project makes."""
    folder = tmp_path_factory.mktemp("made") / "built"
    run_build([Path("procedural:8")], folder, seed=3, plan=plan_level)
    return folder


@pytest.fixture(scope="session")
def released(made: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Its release."""
    return release(made, tmp_path_factory.mktemp("released") / "eight-houses", ABOUT).folder


@pytest.fixture(scope="session")
def _rooms(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("rooms")
    for number in range(3):
        one_room(folder / "houses" / f"{'abc'[number]}.ply", 4.0 + 2 * number)
    run_build([folder / "houses"], folder / "rooms", licence="ODbL-1.0", credit="Surveyed by C.")
    return folder / "rooms"


@pytest.fixture
def rooms(_rooms: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A build of three houses of one room each, of a source whose licence its manifest states; plots are left out."""
    monkeypatch.setattr(write_release, "draw_measures_png", lambda _: b"")
    return Path(shutil.copytree(_rooms, tmp_path / "rooms"))
