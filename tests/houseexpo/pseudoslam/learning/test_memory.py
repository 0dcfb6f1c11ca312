"""A memory that takes whole sequences against the library's, which goes step by step."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:  # to import them takes a second, which each worker would wait for
    import torch

    from houseexpo.pseudoslam.learning.model import States

SEQUENCES, STEPS, WIDTH, HIDDEN = 5, 7, 6, 4


@pytest.mark.usefixtures("learn")
@pytest.mark.parametrize("begins", ["nowhere", "first", "within"])
def test_whole_sequences_are_the_librarys_step_by_step(begins: str) -> None:
    import torch

    from houseexpo.pseudoslam.learning.model import run_lstm

    torch.manual_seed(0)
    lstm = torch.nn.LSTM(WIDTH, HIDDEN)
    states = (torch.randn(1, SEQUENCES, HIDDEN), torch.randn(1, SEQUENCES, HIDDEN))
    starts = torch.zeros(SEQUENCES, STEPS)
    starts[[1, 3], 0] = float(begins != "nowhere")
    starts[2, 4] = float(begins == "within")
    features = torch.randn(SEQUENCES * STEPS, WIDTH)
    found = []
    for way in (run_lstm, step_by_step):
        seen = features.clone().requires_grad_()
        said, behind = way(seen, states, starts.flatten(), lstm)
        said.pow(2).sum().backward()
        found.append((said, *behind, seen.grad))
    for one, other in zip(*found, strict=True):
        torch.testing.assert_close(one, other)


def step_by_step(
    features: torch.Tensor, states: States, starts: torch.Tensor, lstm: torch.nn.LSTM
) -> tuple[torch.Tensor, States]:
    """Ask the library for each step by itself."""
    import torch
    from sb3_contrib.common.recurrent.policies import RecurrentActorCriticPolicy

    said, first, second = [], [], []
    for k in range(SEQUENCES):
        state = states[0][:, k : k + 1], states[1][:, k : k + 1]
        for step in range(k * STEPS, (k + 1) * STEPS):
            at = slice(step, step + 1)
            one, state = RecurrentActorCriticPolicy._process_sequence(features[at], state, starts[at], lstm)
            said.append(one)
        first.append(state[0])
        second.append(state[1])
    return torch.cat(said), (torch.cat(first, dim=1), torch.cat(second, dim=1))
