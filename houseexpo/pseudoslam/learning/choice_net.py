"""Weights that tell how much better one frontier is than the others: least squares over choices, in plain NumPy.

R1  Of a choice only the differences count: numbers and worths are taken less their means over what was tried.
R2  Worths are divided by their spread over all choices, and errors beyond 1.5 of it count linearly (Huber).
R3  One net tells both worths, area and metres. What a chooser wants of them is a mixture of the two, made afterwards.
R4  Several nets that begin with other weights are one, which tells their mean: choices are few and worths are noisy.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg import block_diag

from houseexpo.errors import TrainingError
from houseexpo.pseudoslam.kernels.planning.scoring import Scorer
from houseexpo.pseudoslam.learning.choices import Choices

Floats = npt.NDArray[np.float64]
_NETS, _CELLS = 6, 16
_BATCH, _EPOCHS, _RATE, _DECAY = 128, 15, 2e-3, 1e-2
_LINEAR = 1.5
_EPS = 1e-9


@dataclass(frozen=True, eq=False)
class Net:
    """Arrays as ``Scorer`` has them, but ``line`` (2, n) and ``last`` (2, k): for area, and for metres saved."""

    line: Floats
    first: Floats
    first_bias: Floats
    second: Floats
    second_bias: Floats
    last: Floats

    def mixed(self, share: float) -> Scorer:
        """Return the scorer that wants so large a share of area, and the rest of metres."""
        mix = np.array([share, 1.0 - share])
        return Scorer(mix @ self.line, self.first, self.first_bias, self.second, self.second_bias, mix @ self.last)


def fit(choices: Choices, rng: np.random.Generator, epochs: int = _EPOCHS) -> Net:
    """Return the net that tells best what choices were worth (R4); TrainingError where there are none."""
    if not len(choices):
        raise TrainingError("expected choices between frontiers to learn from, found none; learn from more plans")
    there = choices.tried[:, :, None].astype(np.float64)
    given = choices.outlooks[choices.tried]
    middle, spread = given.mean(axis=0), given.std(axis=0) + 1e-3
    numbers = (choices.outlooks - middle) / spread * there
    wanted = _centred(choices.worth * np.array([1.0, -1.0]), there)
    wanted /= np.sqrt((wanted**2).sum(axis=(0, 1)) / there.sum()) + _EPS
    line, first, first_bias, second, second_bias, last = _as_one(
        [_fitted(numbers, there, wanted, rng, epochs) for _ in range(_NETS)]
    )
    return Net(line / spread, first / spread, first_bias - first @ (middle / spread), second, second_bias, last)


def _fitted(numbers: Floats, there: Floats, wanted: Floats, rng: np.random.Generator, epochs: int) -> list[Floats]:
    """Return the weights of one net."""
    parts = _begun(numbers.shape[2], rng)
    batches = max(len(numbers) // _BATCH, 1)
    adam = _Adam(parts, epochs * batches)
    for _ in range(epochs):
        for rows in np.array_split(rng.permutation(len(numbers)), batches):
            adam.step(_slopes(parts, numbers[rows], there[rows], wanted[rows]))
    return parts


def _as_one(nets: list[list[Floats]]) -> list[Floats]:
    """Return the net that tells the mean of what others tell (R4): their cells side by side, not connected."""
    lines, firsts, first_biases, seconds, second_biases, lasts = zip(*nets, strict=True)
    share = 1.0 / len(nets)
    return [
        share * np.sum(lines, axis=0), np.vstack(firsts), np.concatenate(first_biases), block_diag(*seconds),
        np.concatenate(second_biases), share * np.hstack(lasts),
    ]  # fmt: skip


class _Adam:
    """Steps down slopes (Kingma and Ba, 2015), with weights that decay and a rate that falls to 0."""

    def __init__(self, parts: list[Floats], steps: int) -> None:
        self._parts, self._steps, self._done = parts, steps, 0
        self._means, self._squares = [np.zeros_like(part) for part in parts], [np.zeros_like(part) for part in parts]

    def step(self, slopes: list[Floats]) -> None:
        """Change the parts in place."""
        self._done += 1
        rate = _RATE * (1 - self._done / (self._steps + 1))
        for i, slope in enumerate(slopes):
            self._means[i] += 0.1 * (slope - self._means[i])
            self._squares[i] += 0.001 * (slope**2 - self._squares[i])
            mean, square = self._means[i] / (1 - 0.9**self._done), self._squares[i] / (1 - 0.999**self._done)
            self._parts[i] -= rate * (mean / (np.sqrt(square) + 1e-8) + _DECAY * self._parts[i])


def _begun(numbers: int, rng: np.random.Generator) -> list[Floats]:
    """Return the weights at the start."""
    first = rng.normal(0.0, np.sqrt(2.0 / numbers), (_CELLS, numbers))
    second = rng.normal(0.0, np.sqrt(2.0 / _CELLS), (_CELLS, _CELLS))
    last = rng.normal(0.0, 0.1, (2, _CELLS))
    return [np.zeros((2, numbers)), first, np.zeros(_CELLS), second, np.zeros(_CELLS), last]


def _slopes(parts: list[Floats], numbers: Floats, there: Floats, wanted: Floats) -> list[Floats]:
    """Return the slopes of the mean error, for each part."""
    line, first, first_bias, second, second_bias, last = parts
    flat = numbers.reshape(-1, numbers.shape[2])
    one = np.maximum(flat @ first.T + first_bias, 0.0)
    two = np.maximum(one @ second.T + second_bias, 0.0)
    told = (flat @ line.T + two @ last.T).reshape(wanted.shape)
    error = np.clip(_centred(told, there) - wanted, -_LINEAR, _LINEAR)  # R2
    out = _centred(error * there, there).reshape(-1, 2) / len(numbers)
    to_two = (out @ last) * (two > 0)
    to_one = (to_two @ second) * (one > 0)
    return [out.T @ flat, to_one.T @ flat, to_one.sum(axis=0), to_two.T @ one, to_two.sum(axis=0), out.T @ two]


def _centred(values: Floats, there: Floats) -> Floats:
    """Return values less their means over what there is (R1); 0 elsewhere."""
    centred: Floats = (values - (values * there).sum(axis=1, keepdims=True) / there.sum(axis=1, keepdims=True)) * there
    return centred
