"""A policy for ONNX Runtime: it takes the actions of PyTorch's, without PyTorch; what is no such file is refused."""

from __future__ import annotations

import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from houseexpo.errors import ConfigError, MissingDependencyError, PolicyError, TrainingError
from houseexpo.pseudoslam import learning as needs
from houseexpo.pseudoslam.learning.config import EnvironmentConfig, TrainConfig
from houseexpo.pseudoslam.learning.environments import make_environments
from houseexpo.pseudoslam.learning.policy_file import EpisodeActor, TrainedPolicy, read_policy
from houseexpo.pseudoslam.tasks import ROOM
from tests.builders.needs import need
from tests.builders.trained_policies import folder_of
from tests.builders.training import tiny

pytestmark = pytest.mark.slow

PLACES: dict[str, tuple[str, str, dict[str, Any]]] = {
    "masks": ("avoidance", "cnn", {"action_mask": True}),
    "continuous": ("navigation", "cnn-lstm", {"actions": "continuous"}),
    "scales": ("exploration", "cnn-lstm", {"observation": "scales", "preset": "view-10m"}),
    "dict": ("navigation", "cnn", {"observation": "dict"}),
    "set": ("exploration", "set", {"actions": "frontier"}),
}
TRAINED = ("avoidance", "exploration-view-10m-cnn", "exploration-frontiers")


@pytest.fixture(autouse=True)
def onnx(learn: None) -> None:
    need(modules=["onnx", "onnxruntime"], how="make learn")


def written(folder: Path, name: str) -> Path:
    """A policy.pt: one of the project's, or one whose weights are random and whose last layer is not near 0."""
    if name in TRAINED:
        return folder_of(name, 0) / "policy.pt"
    import torch

    from houseexpo.pseudoslam.learning.model import new_policy
    from houseexpo.pseudoslam.learning.torch_network import write_policy

    task, policy, given = PLACES[name]
    place = EnvironmentConfig(simulator=tiny().environment.simulator, **given)
    config: TrainConfig = replace(tiny(), policy=policy, environment=place)  # type: ignore[arg-type]
    envs = make_environments(task, place, ROOM, number=1, threads=1)
    torch.manual_seed(0)
    made = new_policy(envs.single_observation_space, envs.single_action_space, config)
    envs.close()
    with torch.no_grad():
        for weight in made.action_net.parameters():
            weight.mul_(100.0)
    about = {"task": task, "config": config.record(), "lists": {}, "seed": 0, "steps": 0, "commit": None}
    write_policy(folder / "policy.pt", made, {**about, "versions": {}, "score": {}})
    return folder / "policy.pt"


def exported(folder: Path, name: str) -> tuple[Path, Path]:
    from houseexpo.pseudoslam.learning.onnx_export import export_policy

    file = written(folder, name)
    return file, export_policy(file, folder / "onnx")


def seen_by(policy: TrainedPolicy, steps: int) -> list[Any]:
    """Observations of a robot that moves at random in the room of obstacle avoidance."""
    envs = make_environments(policy.task, policy.config.environment, ROOM, number=1, threads=1)
    envs.action_space.seed(0)
    found = [envs.reset(seed=0)[0]]
    for _ in range(steps):
        action = envs.action_space.sample()
        if isinstance(found[-1], dict) and "frontiers" in found[-1]:
            action = found[-1]["action_mask"].argmax(axis=1)
        found.append(envs.step(action)[0])
    envs.close()
    return [{k: v[0] for k, v in one.items()} if isinstance(one, dict) else one[0] for one in found]


@pytest.mark.parametrize("name", [*TRAINED, *PLACES])
def test_it_takes_the_actions_of_pytorch(name: str, tmp_path: Path) -> None:
    file, played = map(read_policy, exported(tmp_path, name))
    assert (file.about, file.config) == (played.about, played.config)
    observations = seen_by(file, 60)
    outputs = []
    for likely in (True, False):
        actors = [EpisodeActor(each, 3, deterministic=likely) for each in (file, played)]
        for observation in observations:
            first, second = (actor(observation) for actor in actors)
            assert type(first) is type(second)
            assert file.action_space.contains(second)
            np.testing.assert_allclose(first, second, atol=1e-4)
            both = [each.network(actor._inputs) for each, actor in zip((file, played), actors, strict=True)]
            for by_torch, by_onnx in zip(*both, strict=True):
                np.testing.assert_allclose(by_torch, by_onnx, rtol=1e-4, atol=1e-4)
            outputs.append(both[0][0])
    assert np.ptp(outputs, axis=0).max() > 0.01, "a network that always says the same shows nothing"


@pytest.mark.parametrize("name", ["avoidance", "exploration-frontiers"])
def test_several_robots_at_once(name: str, tmp_path: Path) -> None:
    """Programs of others may ask for many; each gets what it would get alone."""
    import onnxruntime

    from houseexpo.pseudoslam.learning.signature import make_inputs

    _, file = exported(tmp_path, name)
    policy = read_policy(file)
    rng, one = np.random.default_rng(0), make_inputs(policy.observation_space, policy.config)
    session = onnxruntime.InferenceSession(str(file), providers=["CPUExecutionProvider"])
    alone = [{key: rng.integers(0, 2, zeros.shape).astype(zeros.dtype) for key, zeros in one.items()} for _ in range(3)]
    axes = {key: 1 if key.startswith("memory") else 0 for key in one}
    together = {key: np.concatenate([each[key] for each in alone], axis) for key, axis in axes.items()}
    wanted = np.concatenate([policy.network(each)[0] for each in alone])
    np.testing.assert_allclose(session.run(["logits"], together)[0], wanted, atol=1e-4)


PLAYS = """
import sys
sys.modules.update(dict.fromkeys(["torch", "stable_baselines3", "sb3_contrib"]))
from houseexpo.pseudoslam.agents.loading import load_policy
from houseexpo.pseudoslam.benchmark.cases import make_room_cases
from houseexpo.pseudoslam.benchmark.episodes import EpisodeRunner
from houseexpo.pseudoslam.benchmark.tracks import find_track
from houseexpo.pseudoslam.tasks import ROOM

if __name__ == "__main__":
    track = find_track("avoidance")
    (case,) = make_room_cases(track.id, ROOM.id, 1)
    episode = EpisodeRunner(track, load_policy(sys.argv[1]), [ROOM], 0).run(case)
    print(episode.actions)
"""


def test_it_plays_where_there_is_no_pytorch_as_it_does_where_there_is(tmp_path: Path) -> None:
    from houseexpo.pseudoslam.agents.loading import load_policy
    from houseexpo.pseudoslam.benchmark.cases import make_room_cases
    from houseexpo.pseudoslam.benchmark.episodes import EpisodeRunner
    from houseexpo.pseudoslam.benchmark.tracks import find_track

    file, played = exported(tmp_path, "avoidance")
    done = subprocess.run([sys.executable, "-c", PLAYS, str(played)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    track = find_track("avoidance")
    (case,) = make_room_cases(track.id, ROOM.id, 1)
    episode = EpisodeRunner(track, load_policy(str(file)), [ROOM]).run(case)
    assert done.stdout.strip() == str(episode.actions)


def test_the_file_says_what_it_is_and_is_the_same_each_time(tmp_path: Path) -> None:
    import msgspec
    import onnx

    from houseexpo.files import sha256_of
    from houseexpo.pseudoslam.learning.onnx_export import export_policy

    file, played = exported(tmp_path, "avoidance")
    packed = played.read_bytes()
    with pytest.raises(ConfigError, match=r"policy.onnx: exists; name another folder, or add --replace"):
        export_policy(file, played.parent)
    assert export_policy(file, played.parent, replace=True).read_bytes() == packed
    model = onnx.load_model_from_string(packed)
    told = {each.key: each.value for each in model.metadata_props}
    assert msgspec.json.decode(told["about"]) == msgspec.json.decode(file.with_suffix(".json").read_bytes())
    assert told["policy.pt sha256"] == sha256_of(file)
    assert [each.name for each in model.graph.input] == ["map", "memory_h", "memory_c"]
    assert [each.name for each in model.graph.output] == ["logits", "next_memory_h", "next_memory_c"]
    for said in (
        "for the task avoidance, with discrete actions",
        "251,904 steps, seed 0",
        "view of 3 m",
        sha256_of(file),
    ):
        assert said in model.doc_string


def _spoiled(file: Path, how: str) -> None:
    """Spoil an exported file."""
    import onnx
    from onnx import TensorProto, helper

    model = onnx.load(file)
    graph = model.graph
    first = graph.initializer[0]
    if how == "other inputs":
        graph.input[0].name = graph.node[0].input[0] = "view"
    elif how == "another size":
        graph.input[0].type.tensor_type.shape.dim[-1].dim_value = 43
    elif how == "other outputs":
        graph.output[0].name = "scores"
        graph.node.append(helper.make_node("Identity", ["logits"], ["scores"]))
    elif how == "another layout":
        (about,) = (each for each in model.metadata_props if each.key == "about")
        about.value = about.value.replace('"memory": 128', '"memory": 16').replace('"memory":128', '"memory":16')
    elif how == "not ours":
        del model.metadata_props[:]
    elif how == "custom operator":
        model.opset_import.append(helper.make_opsetid("their.own", 1))
        graph.node[-1].domain = "their.own"
    elif how == "loop":
        body = helper.make_graph([], "body", [], [])
        graph.node.append(helper.make_node("Loop", ["", ""], ["more"], body=body))
    elif how == "other files":
        first.ClearField("raw_data")
        first.data_location = TensorProto.EXTERNAL
        entry = first.external_data.add()
        entry.key, entry.value = "location", "../secret"
    elif how == "sparse weights":
        value = graph.node.add(op_type="Constant", output=["more"])
        value.attribute.add(name="sparse_value", type=onnx.AttributeProto.SPARSE_TENSOR).sparse_tensor.dims.append(2)
    elif how == "not finite":
        (first,) = (each for each in graph.initializer if each.name.endswith("action_net.bias"))
        first.raw_data = np.full(len(first.raw_data) // 4, np.nan, np.float32).tobytes()
    elif how == "memory":
        (last,) = (node for node in graph.node if "logits" in node.output)
        last.output[0] = "less"
        graph.initializer.append(helper.make_tensor("size", TensorProto.INT64, [1], [1 << 29]))  # 2 GiB of float32
        graph.node.append(helper.make_node("ConstantOfShape", ["size"], ["large"]))
        graph.node.append(helper.make_node("ReduceMax", ["large"], ["sum"], keepdims=0))
        graph.node.append(helper.make_node("Add", ["less", "sum"], ["logits"]))
    elif how == "weights of another size":
        first.dims[0] += 1
    file.write_bytes(model.SerializeToString())


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ("other inputs", r"expected the inputs map uint8 \[1, 1, 42, 42\], .*, found view uint8"),
        ("another size", r"expected the inputs map uint8 \[1, 1, 42, 42\], .*, found map uint8 \[1, 1, 42, 43\]"),
        ("other outputs", r"ONNX Runtime: .*logits"),
        ("another layout", r"expected the inputs .*memory_h float32 \[1, 1, 16\], .*, found .*\[1, 1, 128\]"),
        ("not ours", r"expected the metadata format = 'houseexpo policy 1', found None"),
        ("custom operator", r"expected ONNX's own operators, found their.own\.Gemm"),
        ("loop", "expected one graph of operators, found functions, loops or branches"),
        ("other files", "expected all weights in this file, found some that are in others"),
        ("sparse weights", "expected no sparse weights, found some"),
        ("memory", "ONNX Runtime: .*[Aa]vailable memory of .* is smaller than requested"),
        ("weights of another size", "ONNX Runtime: "),
    ],
)
def test_another_file_is_refused(how: str, said: str, tmp_path: Path) -> None:
    _, file = exported(tmp_path, "avoidance")
    _spoiled(file, how)
    with pytest.raises(
        TrainingError, match=rf"^{re.escape(str(file))}: expected a policy of houseexpo train.* \({said}"
    ):
        read_policy(file)


def test_a_part_of_a_file_and_a_large_one_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _, file = exported(tmp_path, "exploration-frontiers")
    packed = file.read_bytes()
    for length in range(0, len(packed), len(packed) // 40):
        file.write_bytes(packed[:length])
        with pytest.raises(TrainingError, match=r"policy.onnx: expected a policy of houseexpo train, found none"):
            read_policy(file)
    file.write_bytes(packed)
    monkeypatch.setattr("houseexpo.pseudoslam.learning.policy_file._LARGEST", {".onnx": 1000, ".pt": 1 << 30})
    with pytest.raises(TrainingError, match="cannot be read: expected at most 0 MiB, found more"):
        read_policy(file)


def test_numbers_that_are_not_finite_are_told(tmp_path: Path) -> None:
    _, file = exported(tmp_path, "avoidance")
    _spoiled(file, "not finite")
    policy = read_policy(file)
    with pytest.raises(PolicyError, match=r"expected finite numbers from the network, found \[\[nan"):
        EpisodeActor(policy)(seen_by(policy, 0)[0])


def test_without_the_extra_a_line_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(needs, "find_spec", lambda name: None if "onnx" in name else object())
    with pytest.raises(MissingDependencyError, match=r"policy.onnx needs ONNX, ONNX Runtime, .*\[onnx\]"):
        read_policy(tmp_path / "policy.onnx")
