from __future__ import annotations

import os
import re
from pathlib import Path

import msgspec
import pytest

from houseexpo.corrections import Override
from houseexpo.dataset.manifest import manifest_path
from houseexpo.errors import ConfigError
from pipeline.cli_common import load_build_config
from pipeline.config import PipelineConfig
from pipeline.config_file import BuildConfig, find_manifest, load_config
from pipeline.overrides import configure, load_overrides
from pipeline.stages.logistic import LogisticModel

ROOT = Path(__file__).resolve().parents[2]


def written(tmp_path: Path, text: str, name: str = "manifest.toml") -> Path:
    path = tmp_path / name
    path.write_text(text)
    return path


def test_what_a_manifest_does_not_say_is_the_default(tmp_path: Path) -> None:
    assert load_config(written(tmp_path, "")) == BuildConfig()
    config = load_config(written(tmp_path, "[planes]\ndoor_m = 1\n[build]\nseed = 3\n[limits]\nseconds = 5"))
    assert (config.stages.planes.door_m, config.build.seed, config.limits.seconds) == (1.0, 3, 5.0)
    assert config.stages.connectivity == PipelineConfig().connectivity


def test_relative_sources_count_from_the_manifest(tmp_path: Path) -> None:
    config = load_config(written(tmp_path, '[build]\nsources = ["houses", "/abs/x.ply", "procedural:3"]'))
    assert config.build.sources == (str(tmp_path / "houses"), "/abs/x.ply", "procedural:3")


def test_relative_model_folders_count_from_the_manifest(tmp_path: Path) -> None:
    config = load_config(written(tmp_path, f'[build]\nmodel_path = "models{os.pathsep}/abs"'))
    assert config.build.model_path == f"{tmp_path / 'models'}{os.pathsep}/abs"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[planes]\ndor_m = 1", "unknown key 'planes.dor_m'; did you mean 'planes.door_m'?"),
        ("[plans]\ndoor_m = 1", "unknown key 'plans'; did you mean 'planes'?"),
        ("[limit]\nseconds = 1", "unknown key 'limit'; did you mean 'limits'?"),
        ("seconds = 1", "unknown key 'seconds'; did you mean 'limits.seconds'?"),
        ("[lobby]\nseconds = 1", "build, limits, limits.seconds, limits.memory_gb"),
        ("[build]\nsed = 1", "unknown key 'build.sed'; did you mean 'build.seed'?"),
        ("planes = 3", "planes: expected a mapping of ground_m"),
        ('[planes]\ndoor_m = "x"', "planes.door_m = 'x': expected `float`, got `str`"),
        ("[planes]\ndoor_m = nan", "planes.door_m = nan: expected a finite number of at least 0"),
        ("[planes]\ndoor_m = -0.2", "planes.door_m = -0.2: expected a finite number of at least 0"),
        ("[connectivity]\nsamples = 0", "connectivity.samples = 0: expected at least 1"),
        ("[build]\nseed = true", "build.seed = True: expected `int`, got `bool`"),
        ("[build]\nmin_quality = 80.0", "build.min_quality = 80.0: expected 0 to 1"),
        ("[limits]\nmemory_gb = 0", "limits.memory_gb = 0.0: expected a number above 0"),
        ('[build]\nup = "w"', "build.up = 'w'"),
        ("[build", "expected TOML, found"),
    ],
)
def test_a_bad_manifest_is_refused_with_the_full_name_of_the_key(tmp_path: Path, text: str, words: str) -> None:
    path = written(tmp_path, text)
    with pytest.raises(ConfigError) as caught:
        load_config(path)
    assert words in str(caught.value)
    assert str(path) in str(caught.value)


def test_the_hash_tells_parameters_apart_but_not_inputs(tmp_path: Path) -> None:
    plain = BuildConfig().digest()
    assert load_config(written(tmp_path, '[build]\nsources = ["x.ply"]\nlimit = 2')).digest() == plain
    assert load_config(written(tmp_path, "[cells]\narea_m2 = 2.5")).digest() != plain
    assert load_config(written(tmp_path, "[build]\nseed = 1")).digest() != plain
    assert load_config(written(tmp_path, "[build]\nmin_quality = 0.8")).digest() != plain
    assert load_config(written(tmp_path, "[build]\nresolution = 0.05")).digest() != plain


def test_overrides_lie_beside_a_manifest(tmp_path: Path) -> None:
    manifest = written(tmp_path, "")
    assert load_overrides(None) == {}
    assert load_overrides(manifest) == {}
    written(tmp_path, '[b]\nkeep = true\n[a]\nh_g = 0.4\nh_d = 1\n[c]\ndrop = true\nwhy = "hall"', "overrides.toml")
    found = load_overrides(manifest)
    assert found == {"a": Override(h_g=0.4, h_d=1.0), "b": Override(keep=True), "c": Override(drop=True, why="hall")}
    assert configure(PipelineConfig(), found["a"]).planes.door_m == 1.0
    assert not configure(PipelineConfig(), found["b"]).layout.characters


def test_a_manifests_own_overrides_come_before_those_of_its_folder(tmp_path: Path) -> None:
    homes = written(tmp_path, "", "homes.toml")
    barns = written(tmp_path, "", "barns.toml")
    written(tmp_path, "[a]\nkeep = true\n", "overrides.toml")
    written(tmp_path, "[b]\nkeep = true\n", "homes.overrides.toml")
    assert list(load_overrides(homes)) == ["b"]
    assert list(load_overrides(barns)) == ["a"]


def test_what_a_review_left_in_the_data_set_is_read_too_and_comes_first(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    plans = tmp_path / "plans"
    plans.mkdir()
    first = '[a]\nkeep = true\nno_room = [1, 2]\n[b]\ndrop = true\nwhy = "hall"\n[c]\nh_g = 0.4\nscale = 20.0\n'
    manifest = written(tmp_path, "", "homes.toml")
    mine = written(tmp_path, first, "homes.overrides.toml")
    own = written(
        plans, "[a]\ndrop = true\nno_room = [[1, 2], [3, 4]]\n[b]\n[c]\nh_d = 1.2\n[d]\nkeep = true\n", "overrides.toml"
    )
    assert load_overrides(None, None, plans) == load_overrides(None, own) == load_overrides(None, own, plans)
    for found in (load_overrides(manifest, None, plans), load_overrides(None, mine, plans)):
        assert found == {
            "a": Override(drop=True, no_room=((1.0, 2.0), (3.0, 4.0))),
            "b": Override(drop=True, why="hall"),
            "c": Override(h_d=1.2, scale=20.0),
            "d": Override(keep=True),
        }
    assert f"a: {mine} and {own} contradict each other; {own} counts: drop" in caplog.text
    assert "b: " not in caplog.text
    assert load_overrides(manifest, None, tmp_path / "new") == load_overrides(manifest)


def test_a_link_in_the_data_set_is_not_read_unless_somebody_names_it(tmp_path: Path) -> None:
    plans = tmp_path / "plans"
    plans.mkdir()
    (plans / "overrides.toml").symlink_to(written(tmp_path, "[a]\nkeep = true\n", "mine.toml"))
    with pytest.raises(ConfigError, match="found a link, which is not followed; name it with --overrides"):
        load_overrides(None, None, plans)
    assert list(load_overrides(None, plans / "overrides.toml", plans)) == ["a"]


def test_one_door_or_point_is_written_as_it_is_and_several_as_a_list(tmp_path: Path) -> None:
    manifest = written(tmp_path, "")
    text = "[one]\ndoor = [[1, 2], [1, 3]]\nno_room = [5, 6.5]\n[more]\ndoor = [[[1, 2], [1, 3]], [[0, 0], [1, 0]]]\n"
    written(tmp_path, text + "no_room = [[5, 6.5], [7, 8]]\n[none]\ndoor = []\nno_room = []\n", "overrides.toml")
    found = load_overrides(manifest)
    first, second = ((1.0, 2.0), (1.0, 3.0)), ((0.0, 0.0), (1.0, 0.0))
    assert found["one"] == Override(door=(first,), no_room=((5.0, 6.5),))
    assert found["more"] == Override(door=(first, second), no_room=((5.0, 6.5), (7.0, 8.0)))
    assert found["none"] == Override()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[villa]\nkep = true", "unknown key 'villa.kep'; did you mean 'villa.keep'?"),
        ("[villa]\nkeep = true\ndrop = true", "villa: expected keep or drop, found both"),
        ("[villa]\nh_g = 0.5\nh_d = 0.2", "villa: expected h_d above h_g, found 0.2 and 0.5"),
        ("villa = true", "villa: expected a mapping of keep, drop"),
        ("[villa]\ndoor = [1, 2]", "villa.door: expected [[x, y], [x, y]]"),
        ("[villa]\ndoor = [[1, 2], [1, 2.1]]", "villa.door: expected jambs 0.3 m apart or more"),
        ("[villa]\ndoor = [[1, 2], [1, nan]]", "villa.door: expected finite metres, found [1, nan]"),
        ("[villa]\nno_room = [1, 2, 3]", "villa.no_room"),
        ("[villa]\nscale = 0", "villa: scale: expected more than 0, found 0"),
        ("[villa]\nscale = -20.0", "villa.scale = -20.0: expected a finite number of at least 0"),
        ('[villa]\ndrop_nodes = "Lamp"', "villa.drop_nodes = 'Lamp': expected `array`, got `str`"),
        ("[villa]\nkeep = 1", "villa.keep = 1: expected `bool`, got `int`"),
    ],
)
def test_bad_overrides_are_refused(tmp_path: Path, text: str, words: str) -> None:
    written(tmp_path, text, "overrides.toml")
    with pytest.raises(ConfigError) as caught:
        load_overrides(tmp_path / "manifest.toml")
    assert words in str(caught.value)


def test_manifests_of_the_project_can_be_read() -> None:
    manifests = [file for file in (ROOT / "data_manifests").glob("*.toml") if "[build]" in file.read_text()]
    assert {manifest.name for manifest in manifests} >= {"demo.toml", "suncg.toml"}
    read = {manifest.name: load_config(manifest) for manifest in manifests}
    assert read["demo.toml"].build.sources
    assert read["suncg.toml"].stages == PipelineConfig()  # the paper's parameters are the defaults


def test_a_manifest_that_comes_with_the_project_is_known_by_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert load_config(find_manifest(Path("demo"))).build.sources == ("procedural:300?style=sound",)
    (tmp_path / "demo").mkdir()  # a folder is no manifest
    assert find_manifest(Path("demo")) == manifest_path("demo")
    (tmp_path / "suncg").write_text("[build]\n")  # a file that is named is believed
    assert find_manifest(Path("suncg")) == Path("suncg")


@pytest.mark.parametrize(
    ("given", "advice"),
    [
        ("dmeo", "did you mean --config demo?"),
        ("data_manifests/demo.toml", "did you mean --config demo?"),
        ("zzz.toml", "check the path"),
        ("benchmark", "known by name: demo, free35k, free40k, furnished, suncg"),  # nothing can be built from it
    ],
)
def test_a_manifest_that_is_not_there_is_answered_with_the_nearest(
    given: str, advice: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ConfigError, match=f"there is no such file; .*{re.escape(advice)}"):
        find_manifest(Path(given))


def test_the_defaults_are_the_parameters_of_the_paper():
    stages = PipelineConfig()
    found = (stages.planes.ground_m, stages.planes.door_m, stages.cells.samples, stages.connectivity.samples)
    assert found == (0.01, 0.2, 500, 100)
    assert stages.cells.area_m2 == 2.0


MINE = "[door]\nbias = 1.5\n[door.weights]\nnarrow = -2.0\n"


def test_weights_of_ones_own_are_named_in_the_manifest_and_are_parameters(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(MINE)
    named = load_build_config(written(tmp_path, '[build]\nweights = "mine.toml"'), {})
    given = load_build_config(None, {"weights": tmp_path / "mine.toml"})
    assert named.stages.weights == given.stages.weights == {"door": LogisticModel(1.5, {"narrow": -2.0})}
    assert named.parameters()["weights"] == {"door": {"bias": 1.5, "weights": {"narrow": -2.0}}}
    assert named.digest() == given.digest() != BuildConfig().digest()
    assert "weights" not in BuildConfig().parameters()  # plans made before have that hash
    again = msgspec.json.decode(msgspec.json.encode(given), type=BuildConfig)  # as shards keep it
    assert again == given
    assert hash(again) == hash(given)


def test_weights_stand_in_a_file_of_their_own(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r'weights: expected a file, under \[build\]: weights = "mine.toml"'):
        load_config(written(tmp_path, "[weights.door]\nbias = 1.0"))
