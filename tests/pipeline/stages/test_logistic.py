"""The models that rate the parts of plans: a file of a person's own is read back, and anything else is refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from houseexpo.errors import ConfigError
from pipeline.stages.logistic import (
    FITTED,
    WEIGHTS,
    LogisticModel,
    load_models,
    models_with,
    read_model_weights,
    source_of,
)


def written(folder: Path, text: str) -> Path:
    file = folder / "mine.toml"
    file.write_text(text, encoding="utf-8")
    return file


def test_models_that_are_written_are_read_back(tmp_path: Path) -> None:
    own = {"door": LogisticModel(2.5, {"narrow": -1.25, "cut": 0.0}), "space": LogisticModel(-1.0, {})}
    text = source_of(own, "Written by a test.\n\nTwo lines.")
    assert text.startswith("# Written by a test.\n#\n# Two lines.\n\n[door]\n")
    assert read_model_weights(written(tmp_path, text)) == own
    every = models_with(own)
    assert every["door"] is own["door"]
    assert every["room"] is load_models()["room"]


def test_the_models_of_the_program_are_a_file_of_weights_but_for_that_of_maps(tmp_path: Path) -> None:
    shipped = {name: load_models()[name] for name in FITTED}
    assert read_model_weights(written(tmp_path, source_of(shipped, ""))) == shipped
    assert source_of(load_models(), WEIGHTS.read_text(encoding="utf-8").split("\n")[0][2:]) == WEIGHTS.read_text(
        encoding="utf-8"
    )


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "expected one of the tables space, door, entrance, room; found none; houseexpo fit writes them"),
        ("[planes]\ndoor_m = 1\n", "unknown key 'planes'; known: space, door, entrance, room"),
        ("[map]\nbias = 1.0\n[map.weights]\n", "unknown key 'map'"),
        ("door = 3\n", "door: expected a mapping of bias, weights; found 3"),
        ("[door]\nbias = 1.0\n", "door.weights: expected a value, found none; fit the weights again"),
        ("[door]\nbiass = 1.0\n", "unknown key 'door.biass'; did you mean 'door.bias'?"),
        ("[door]\nbias = nan\n[door.weights]\n", "door.bias = nan: expected a finite number"),
        ("[door]\nbias = true\n[door.weights]\n", "door.bias = True: expected a finite number"),
        ("[door]\nbias = 1\n[door.weights]\nnarrow = inf\n", "door.weights.narrow = inf: expected a finite number"),
        ("[door]\nbias = 1\nweights = 3\n", "door.weights: expected a mapping of"),
        ("[door]\nbias = 1\n[door.weights]\nmoon = 1.0\n", "door.weights.moon: this version weighs no such feature"),
        ("[door\n", "expected TOML, found"),
    ],
)
def test_a_file_that_holds_no_weights_is_refused_by_name(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(ConfigError) as caught:
        read_model_weights(written(tmp_path, text))
    assert str(caught.value).startswith(f"{tmp_path / 'mine.toml'}: ")
    assert words in str(caught.value)


def test_a_file_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"none\.toml: cannot be read .*; check the path"):
        read_model_weights(tmp_path / "none.toml")
