"""The file of what was learned: the benchmark takes it for a policy, and nothing else for it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from houseexpo.errors import ConfigError, TrainingError
from houseexpo.pseudoslam.learning.config import EnvironmentConfig
from houseexpo.pseudoslam.tasks import ROOM
from tests.builders.training import run, tiny

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("learn")]


def test_what_was_learned_is_a_policy_of_the_benchmark(tmp_path: Path) -> None:
    import torch

    from houseexpo.pseudoslam.agents.loading import load_policy
    from houseexpo.pseudoslam.agents.protocol import Robot, make_robot
    from houseexpo.pseudoslam.benchmark.run import check_task
    from houseexpo.pseudoslam.benchmark.tracks import find_track

    run(tmp_path / "a", replace(tiny(steps=64), environment=EnvironmentConfig(simulator={"max_steps": 20})))
    named = load_policy(str(tmp_path / "a" / "policy.pt"))
    track = find_track("avoidance")
    check_task(named, track)
    env = track.environment([ROOM], named.interface)
    ways = []
    for _ in range(2):
        observation, _ = env.reset(seed=0)
        policy = named.factory(make_robot(env, named.interface), 7)
        actions = [policy(observation, {"steps": i}) for i in range(10)]  # type: ignore[typeddict-item]
        assert all(env.action_space.contains(action) for action in actions)
        ways.append(actions)
    assert ways[0] == ways[1]
    assert torch.backends.mkldnn.enabled, "a training in this process is to go as in one of its own"
    with pytest.raises(ConfigError, match="made for avoidance; track exploration-budget-v1 is exploration"):
        check_task(named, find_track("budget"))
    with pytest.raises(ConfigError, match=r"policy.pt: expected the observation space of its training, Box\("):
        named.factory(Robot(env.config, env.action_space, env.action_space), 7)
    (tmp_path / "other.pt").write_bytes(b"nothing")
    with pytest.raises(TrainingError, match="expected a policy of houseexpo train"):
        load_policy(str(tmp_path / "other.pt"))


def test_a_policy_that_learned_with_masks_runs_in_the_benchmark(tmp_path: Path) -> None:
    from houseexpo.pseudoslam.agents.loading import load_policy
    from houseexpo.pseudoslam.benchmark.cases import make_room_cases
    from houseexpo.pseudoslam.benchmark.episodes import EpisodeRunner
    from houseexpo.pseudoslam.benchmark.tracks import find_track

    place = EnvironmentConfig(simulator={"max_steps": 20}, action_mask=True)
    run(tmp_path / "a", replace(tiny(steps=64), policy="cnn", environment=place))
    track = find_track("avoidance")
    policy = load_policy(str(tmp_path / "a" / "policy.pt"))
    assert policy.interface.action_mask
    (case,) = make_room_cases(track.id, ROOM.id, 1)
    assert EpisodeRunner(track, policy, [ROOM]).run(case).values["steps"] == 200


@pytest.mark.parametrize("damage", [b"", b"no policy", None])
def test_what_is_no_policy_is_refused(damage: bytes | None, tmp_path: Path) -> None:
    from houseexpo.pseudoslam.learning.policy_file import read_policy
    from houseexpo.pseudoslam.learning.torch_network import write_policy

    file = tmp_path / "policy.pt"
    if damage is None:
        run(tmp_path / "a", tiny(steps=64))
        trained = read_policy(tmp_path / "a" / "policy.pt")
        with pytest.raises(TrainingError, match="expected a policy for exploration, found one for avoidance"):
            read_policy(tmp_path / "a" / "policy.pt", "exploration")
        packed = (tmp_path / "a" / "policy.pt").read_bytes()
        for length in range(0, len(packed), len(packed) // 40):
            file.write_bytes(packed[:length])
            with pytest.raises(TrainingError, match=r"policy.pt: expected a policy of houseexpo train, found none"):
                read_policy(file)
        write_policy(
            file, trained.network.policy, {**trained.about, "config": tiny(memory=16).record()}
        )  # other shapes
    else:
        file.write_bytes(damage)
    with pytest.raises(
        TrainingError, match=r"policy.pt: expected a policy of houseexpo train, found none \(.*\)$"
    ) as found:
        read_policy(file)
    assert "weights_only" not in str(found.value)
    with pytest.raises(TrainingError, match="cannot be read: No such file"):
        read_policy(tmp_path / "none.pt")
