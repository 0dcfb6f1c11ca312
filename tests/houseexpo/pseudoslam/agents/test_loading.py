"""Policies by name, file, and module."""

from __future__ import annotations

import hashlib
from pathlib import Path

import pytest

from houseexpo.errors import ConfigError, HouseExpoError
from houseexpo.pseudoslam.agents.loading import NAMES, load_policy
from houseexpo.pseudoslam.agents.protocol import Interface

FILE = """from dataclasses import dataclass


@dataclass
class Mine:
    robot: object
    seed: int

    def __call__(self, observation, info):
        return 1


def policy(robot, seed):
    return Mine(robot, seed)


number = 3
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "my_policy.py"
    path.write_text(FILE)
    return path


def test_every_name_is_a_policy() -> None:
    for name in NAMES:
        found = load_policy(name)
        assert found.name == name
        assert found.source == NAMES[name]
        assert len(found.sha256) == 64


def test_a_file_is_known_by_its_hash(file: Path) -> None:
    found = load_policy(str(file))
    assert found.source == f"{file}:policy"
    assert found.sha256 == hashlib.sha256(FILE.encode()).hexdigest()
    assert found.interface == Interface()
    assert found.factory(None, 5)(None, None) == 1  # type: ignore[arg-type]
    assert load_policy(f"{file}:Mine").source == f"{file}:Mine"


def test_a_module_is_found_in_the_working_directory(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(file.parent)
    assert load_policy("my_policy:Mine").source == "my_policy:Mine"


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("frontiers", "policy: no 'frontiers'; known: random, spin, forward"),
        ("none.py", r"policy 'none.py': expected a file, found none at none.py; check the path"),
        ("no_such_module:policy", r"policy 'no_such_module:policy': cannot be imported: ModuleNotFoundError"),
        ("math:no_such_name", "expected a class or function 'no_such_name' there, found none"),
        ("math:pi", r"policy 'math:pi': expected a class or function, found 3.14"),
        ("weights.bin", r"policy: no 'weights.bin'; .* a file \(.py, .pt, .onnx, .json\), or module:function"),
    ],
)
def test_what_is_no_policy_is_refused(name: str, said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        load_policy(name)


@pytest.mark.parametrize("suffix", [".pt", ".json"])
def test_a_file_of_weights_without_a_policy_is_refused(tmp_path: Path, suffix: str) -> None:
    if suffix == ".pt":
        pytest.importorskip("torch")
    file = tmp_path / f"mine{suffix}"
    file.write_bytes(b"nothing of the kind")
    with pytest.raises(HouseExpoError, match=f"mine{suffix}.*: expected"):
        load_policy(str(file))


@pytest.mark.parametrize("name", ["seek-likely-1", "chooser-1"])
def test_a_file_of_weights_says_which_policy_it_is_for(tmp_path: Path, name: str) -> None:
    ours = load_policy(name)
    file = tmp_path / "mine.json"
    file.write_bytes(ours.factory.file.read_bytes())
    assert load_policy(str(file)).training == ours.training


def test_a_file_that_fails_is_named(file: Path) -> None:
    file.write_text("1 / 0\n")
    with pytest.raises(ConfigError, match=r"my_policy.py': cannot be imported: ZeroDivisionError: division by zero"):
        load_policy(str(file))
    file.write_text("import sys\nsys.exit(0)\n")
    with pytest.raises(ConfigError, match=r"my_policy.py': cannot be imported: SystemExit: 0"):
        load_policy(str(file))
    file.write_text("def policy(robot, seed): ...\npolicy.interface = 'map'\n")
    with pytest.raises(ConfigError, match="expected its attribute 'interface' to be an Interface, found 'map'"):
        load_policy(str(file))
    with pytest.raises(ConfigError, match=r"interface\.actions: expected one of discrete, continuous"):
        Interface(actions="jump")  # type: ignore[arg-type]
