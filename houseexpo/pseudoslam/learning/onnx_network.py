"""Compute the network of a ``policy.onnx`` by ONNX Runtime, without PyTorch.

A file may come from anybody. It is data: it has the standard operators alone, no graphs inside of graphs (loops), no
weights that are sparse or in other files, and exactly the inputs and outputs that its description says. All of this is
checked before it is used. Whatever sizes its operators ask for, they get no more than ``_MEMORY``.
"""

from __future__ import annotations

from functools import cache
from typing import Any, Final

import onnx
import onnxruntime
from google.protobuf.message import DecodeError
from gymnasium import spaces

from houseexpo.pseudoslam.learning.config import TrainConfig
from houseexpo.pseudoslam.learning.signature import Array, make_inputs, output_shapes

FORMAT: Final = "houseexpo policy 1"
_STANDARD: Final = {"", "ai.onnx"}
"""The names of the domain of ONNX's own operators."""

_MEMORY: Final = 1 << 30
"""Memory of all networks of a process together, bytes: those of ``houseexpo train`` take a few MB."""


def unpack(data: bytes) -> tuple[str, onnx.ModelProto]:
    """Return the description (JSON) and the model of a file's content; raise ValueError if they are not there."""
    try:
        model = onnx.load_model_from_string(data)
    except DecodeError:
        raise ValueError("no ONNX model, or not all of it") from None
    told = {each.key: each.value for each in model.metadata_props}
    if told.get("format") != FORMAT:
        raise ValueError(f"expected the metadata format = {FORMAT!r}, found {told.get('format')!r}")
    _check_is_plain(model)
    return told["about"], model


def _check_is_plain(model: onnx.ModelProto) -> None:
    """Raise ValueError if a model has anything but standard operators and its own weights."""
    graph = model.graph
    values = [each for node in graph.node for each in node.attribute]
    tensors = [*graph.initializer, *(each.t for each in values), *(one for each in values for one in each.tensors)]
    for operator in sorted({(node.domain, node.op_type) for node in graph.node if node.domain not in _STANDARD}):
        raise ValueError(f"expected ONNX's own operators, found {'.'.join(operator)}")
    if model.functions or any(each.HasField("g") or each.graphs for each in values):
        raise ValueError("expected one graph of operators, found functions, loops or branches")
    if graph.sparse_initializer or any(each.HasField("sparse_tensor") or each.sparse_tensors for each in values):
        raise ValueError("expected no sparse weights, found some")  # parts of them may be in other files
    if any(each.data_location == onnx.TensorProto.EXTERNAL for each in tensors):
        raise ValueError("expected all weights in this file, found some that are in others")


def make_network(
    model: onnx.ModelProto, seen: spaces.Space[Any], actions: spaces.Space[Any], config: TrainConfig
) -> OnnxNetwork:
    """Return the network; raise ValueError if it has other inputs or outputs than such a policy, or cannot be run."""
    return OnnxNetwork(model, make_inputs(seen, config), output_shapes(actions, config))


class OnnxNetwork:
    """A network that ONNX Runtime computes, on one thread: inputs by their names to outputs in their order."""

    def __init__(self, model: onnx.ModelProto, inputs: dict[str, Array], outputs: dict[str, tuple[int, ...]]) -> None:
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1  # a decision is too little work to share
        options.log_severity_level = 4  # what it would print is raised too
        _limit_memory()
        options.add_session_config_entry("session.use_env_allocators", "1")
        self._names = list(outputs)
        try:
            self._session = onnxruntime.InferenceSession(
                model.SerializeToString(), options, providers=["CPUExecutionProvider"],
                disabled_optimizers=["ConstantFolding"],  # it would compute without the limit
            )  # fmt: skip
            _check_inputs(self._session, inputs)
            found = dict(zip(outputs, self(inputs), strict=True))
        except ValueError:
            raise
        except Exception as error:  # noqa: BLE001  # its exceptions have no class of their own
            raise ValueError(f"ONNX Runtime: {error}") from None
        for name, shape in outputs.items():
            wanted, shown = f"float32 {shape}", f"{found[name].dtype} {found[name].shape}"
            if shown != wanted:
                raise ValueError(f"expected the output {name} {wanted}, found {shown}")

    def __call__(self, inputs: dict[str, Array]) -> list[Array]:
        """Return the outputs."""
        found: list[Array] = self._session.run(self._names, inputs)
        return found


@cache
def _limit_memory() -> None:
    """Let the networks of this process share memory of at most ``_MEMORY``."""
    place = onnxruntime.OrtMemoryInfo(
        "Cpu", onnxruntime.OrtAllocatorType.ORT_ARENA_ALLOCATOR, 0, onnxruntime.OrtMemType.DEFAULT
    )
    onnxruntime.create_and_register_allocator(place, onnxruntime.OrtArenaCfg({"max_mem": _MEMORY}))


def _check_inputs(session: onnxruntime.InferenceSession, wanted: dict[str, Array]) -> None:
    """Raise ValueError if a model has other inputs, or of other types or sizes; sizes of N may be open."""
    shown = {name: f"{zeros.dtype} {list(zeros.shape)}" for name, zeros in wanted.items()}
    found = {}
    for each in session.get_inputs():
        sizes = wanted[each.name].shape if each.name in wanted else ()
        fits = len(sizes) == len(each.shape)
        shape = [size if isinstance(size, int) or not fits else sizes[k] for k, size in enumerate(each.shape)]
        kind = each.type.removeprefix("tensor(").removesuffix(")")
        found[each.name] = f"{'float32' if kind == 'float' else kind} {shape}"
    if found != shown:
        listed = [", ".join(f"{name} {sizes}" for name, sizes in each.items()) for each in (shown, found)]
        raise ValueError(f"expected the inputs {listed[0]}, found {listed[1]}")
