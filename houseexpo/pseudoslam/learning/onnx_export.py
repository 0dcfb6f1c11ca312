"""Export a trained policy from ``policy.pt`` to ``policy.onnx``, with a card that says how it was made."""

from __future__ import annotations

import io
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import onnx
import torch

from houseexpo.errors import ConfigError, TrainingError
from houseexpo.files import encode_json, make_folder, sha256_of, write_atomically
from houseexpo.pseudoslam.learning.environments import make_simulator_config
from houseexpo.pseudoslam.learning.onnx_network import FORMAT
from houseexpo.pseudoslam.learning.policy_file import ONNX, TrainedPolicy, read_policy
from houseexpo.pseudoslam.learning.records import find_versions
from houseexpo.pseudoslam.learning.signature import MEMORY, make_inputs, output_shapes
from houseexpo.pseudoslam.learning.torch_network import TorchNetwork

_OPSET: Final = 18
"""The version of ONNX's operators, of 2022: also old programs read it."""


def export_policy(file: Path, folder: Path, *, replace: bool = False) -> Path:
    """Write the policy of a ``policy.pt`` to an ONNX file of the same name in a folder, and return it.

    Its metadata hold what ``policy.json`` does ("about"), the SHA-256 of ``policy.pt``, and the versions of what
    exported it; its documentation is the card.

    Raises
    ------
    TrainingError
        The file is not a policy of ``houseexpo train``.
    ConfigError
        The new file exists, and is not to be replaced.
    """
    trained, out = read_policy(file), folder / f"{file.stem}{ONNX}"
    network = trained.network
    if not isinstance(network, TorchNetwork):
        raise TrainingError(f"{file}: expected a policy.pt, found what is exported already")
    if out.exists() and not replace:
        raise ConfigError(f"{out}: exists; name another folder, or add --replace")
    inputs = make_inputs(trained.observation_space, trained.config)
    outputs = list(output_shapes(trained.action_space, trained.config))
    several = {name: {1 if name.endswith(MEMORY) else 0: "N"} for name in (*inputs, *outputs)}
    packed = io.BytesIO()
    torch.onnx.register_custom_op_symbolic("aten::hypot", _hypot, _OPSET)
    with warnings.catch_warnings(), torch.inference_mode():
        warnings.simplefilter("ignore")  # the exporter that needs no further package warns that there is another one
        torch.onnx.export(
            network.module, tuple(map(torch.as_tensor, inputs.values())), packed, input_names=list(inputs),
            output_names=outputs, dynamic_axes=several, opset_version=_OPSET, dynamo=False,
        )  # fmt: skip
    model = onnx.load_model_from_string(packed.getvalue())
    model.doc_string = write_card(trained, sha256_of(file))
    told = {
        "format": FORMAT,
        "about": encode_json(trained.about).decode(),
        "policy.pt sha256": sha256_of(file),
        "exported with": encode_json(find_versions(("torch", "onnx"))).decode(),
    }
    onnx.helper.set_model_props(model, told)
    onnx.checker.check_model(model)
    make_folder(folder)
    write_atomically(out, model.SerializeToString(deterministic=True), durable=True)
    return out


def _hypot(graph: Any, a: Any, b: Any) -> Any:  # values of the exporter, which has no types
    """Return the length of a vector by ONNX's operators, which have none for it."""
    return graph.op("Sqrt", graph.op("Add", graph.op("Mul", a, a), graph.op("Mul", b, b)))


def write_card(trained: TrainedPolicy, sha256: str) -> str:
    """Return what a person wants to know of a policy: what it does, how it was made and tested, how it is used."""
    about, config = trained.about, trained.config
    place, likely = config.environment, config.evaluation.deterministic
    view = make_simulator_config(trained.task, place).observation.size_m
    inputs = {
        name: f"{zeros.dtype} {zeros.shape}" for name, zeros in make_inputs(trained.observation_space, config).items()
    }
    outputs = {name: f"float32 {shape}" for name, shape in output_shapes(trained.action_space, config).items()}
    chosen = ("the largest of logits", "drawn by logits") if "logits" in outputs else ("mean", "drawn by mean, log_std")
    plans = {side: f"{found['plans']:,} plans" for side, found in about["lists"].items()}
    room = "the room of the task"
    seen = f"the observation {place.observation} of houseexpo, unchanged"
    if config.policy != "set":
        seen += f", with a view of {view:g} m"
    made = (
        f"PPO, network {config.policy}, {about['steps']:,} steps, seed {about['seed']}, in {plans.get('train', room)}"
    )
    scores = _join_items({name: f"{value:.3g}" for name, value in about["score"].items()})
    paragraphs = [
        f"A policy of houseexpo for the task {trained.task}, with {place.actions} actions.",
        f"Made by houseexpo train {trained.task}: {made}.",
        f"Options of the task: {_join_items(place.task) or 'the usual ones'}.",
        f"Commit {about['commit']}; {_join_items(about['versions'])}.",
        f"Tested in {config.evaluation.plans} episodes, in {plans.get('test', room)}: {scores}.",
        f"Inputs: {_join_items(inputs)}. They are {seen}.",
        f"Outputs: {_join_items(outputs)}. The action of its tests is {chosen[0 if likely else 1]}.",
        "For N robots at once the first size is N, of a memory the second.",
    ]
    if MEMORY[0] in inputs:
        after = " and ".join(f"next_{name}" for name in MEMORY)
        paragraphs.append(f"{' and '.join(MEMORY)} are 0 when an episode begins, then {after} of the step before.")
    paragraphs.append(f"Exported from a policy.pt with the SHA-256 {sha256}.")
    return "".join(f"{each}\n" for each in paragraphs)


def _join_items(values: Mapping[str, object]) -> str:
    return ", ".join(f"{name} {value}" for name, value in values.items())
