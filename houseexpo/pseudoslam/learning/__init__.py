"""Train policies by PPO on the robot's map, or choosers of frontiers, in runs that can be killed and resumed.

``houseexpo train`` is the command; ``training.train`` does the work. Only ``model``, ``checkpoints``, ``training``,
``torch_network`` and ``onnx_export`` import PyTorch and Stable-Baselines3 (the extra ``learn``); only ``onnx_network``
and ``onnx_export`` import ONNX and ONNX Runtime (the extra ``onnx``).
"""

from __future__ import annotations

from importlib.util import find_spec
from typing import Final, Literal

from houseexpo.errors import MissingDependencyError, install_command

LIBRARIES: Final = {
    "learn": {
        "torch": "PyTorch",
        "stable_baselines3": "Stable-Baselines3",
        "sb3_contrib": "sb3-contrib",
        "tensorboard": "TensorBoard",
    },
    "onnx": {"onnx": "ONNX", "onnxruntime": "ONNX Runtime"},
}
"""The libraries of the extras, by their modules."""


def need_extra(extra: Literal["learn", "onnx"], what: str) -> None:
    """Raise MissingDependencyError, which says what to install, if a library of the extra is missing."""
    missing = [title for module, title in LIBRARIES[extra].items() if find_spec(module) is None]
    if missing:
        raise MissingDependencyError(f"{what} needs {', '.join(missing)}, not installed here: {install_command(extra)}")
