"""Three walks through the code: how many files and functions a value passes on its way.

Each walk runs once to warm up (imports, compiled kernels, caches) and once under a profile that notes every call of a
function of ours, in every thread. Compiled kernels count with the function that Python calls.
"""

from __future__ import annotations

import os
import sys
import threading
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

import gymnasium
import numpy as np
import pytest
from rich.console import Console
from rich.table import Table

pytest.importorskip("starlette")
from starlette.testclient import TestClient

import houseexpo
import houseexpo.pseudoslam
from houseexpo.plan.json_codec import encode
from houseexpo.service.app import make_app
from pipeline.algorithm import plan_level
from pipeline.config import PipelineConfig
from pipeline.sources import find, reader
from pipeline.values import Level
from tests.builders.examples import FOLDER
from tests.builders.services import BASE, built, service_of, some_plans

ROOT = Path(houseexpo.__file__).parents[1]
ROOMS = tuple(f"{ROOT / package}{os.sep}" for package in ("houseexpo", "pipeline", "stats"))


class Walk:
    """The functions of ours that were called, by file and name."""

    def __init__(self) -> None:
        self.called: set[tuple[str, str]] = set()

    def __call__(self, frame: FrameType, event: str, _: object) -> None:
        code = frame.f_code
        if (
            event == "call"
            and code.co_filename.startswith(ROOMS)
            and "<" not in code.co_name
            and code.co_filename.endswith(".py")
        ):
            self.called.add((code.co_filename, code.co_qualname))

    @property
    def files(self) -> set[str]:
        return {str(Path(file).relative_to(ROOT)) for file, _ in self.called}

    def functions_of(self, file: str) -> list[str]:
        return sorted(name for path, name in self.called if path == str(ROOT / file))

    @property
    def folders(self) -> str:
        folders = Counter(str(Path(file).parent) for file in self.files)
        return ", ".join(f"{folder} {count}" for folder, count in folders.most_common())


@contextmanager
def walking() -> Iterator[Walk]:
    walk = Walk()
    threading.setprofile(walk)
    sys.setprofile(walk)
    try:
        yield walk
    finally:
        sys.setprofile(None)
        threading.setprofile(None)


def walked(call: Callable[[], object]) -> Walk:
    """Return the walk of a call's second run."""
    call()
    with walking() as walk:
        call()
    return walk


def glb_to_json() -> None:
    (item,) = find(str(FOLDER / "house.glb"))
    for level in reader(item.reader).read(item):
        assert isinstance(level, Level)
        assert all(encode(plan) for plan in plan_level(level, PipelineConfig(), np.random.default_rng(0)))


def vector_step(data_set: Path) -> Walk:
    env = gymnasium.make_vec("PseudoSLAM/Exploration-v0", num_envs=2, dataset=str(data_set))
    env.reset(seed=1)
    return walked(lambda: env.step(env.action_space.sample()))


def gallery_page(data_set: Path) -> Walk:
    client = TestClient(make_app(service_of(data_set)), base_url=BASE)
    return walked(lambda: client.get("/homes/?rooms=2").raise_for_status())


def test_the_walks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """``WALKS=1 ...`` also prints each walk's functions, file by file."""
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path / "cache"))
    data_set = built(tmp_path / "homes", some_plans())
    walks = {
        "a glb house becomes JSON": walked(glb_to_json),
        "a step of a vector environment": vector_step(data_set),
        "a page of the gallery": gallery_page(data_set),
    }
    table = Table(title="Walks through the code")
    for heading in ("walk", "files", "functions", "files by folder"):
        table.add_column(heading)
    for name, walk in walks.items():
        table.add_row(name, str(len(walk.files)), str(len(walk.called)), walk.folders)
    Console(width=160).print(table)
    if os.environ.get("WALKS"):
        for name, walk in walks.items():
            print(f"\n{name}")  # noqa: T201
            for file in sorted(walk.files):
                print(f"  {file}: {', '.join(walk.functions_of(file))}")  # noqa: T201
    assert all(walk.called for walk in walks.values())
