"""Write episodes of a policy on a track as a Minari data set, to learn from without a simulator; for ``collect``.

R1  Plans are taken in an order that depends only on their ids and the seed, each once before any again. Those in
    which the robot fits nowhere, or has no goal, are passed over. An episode's start and noise have a seed from the ids
    of track and plan, the run's seed and the episode's number.
R2  A step is stored as the environment returns it: the observation that the policy's interface asks for, without loss,
    the action, the reward, and the numbers of ``info``. Texts of ``info`` are left out: Minari stores columns.
R3  An episode whose policy is done before the task ends is truncated at its last step.
R4  Episodes are written in their order. The data set gets its name when it is complete.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final, NamedTuple

import msgspec
import numpy as np
import numpy.typing as npt

from houseexpo import __version__
from houseexpo.configuration import check_whole_number
from houseexpo.dataset import Dataset
from houseexpo.errors import ConfigError, MissingDependencyError, PolicyError, install_command
from houseexpo.progress import show_progress
from houseexpo.pseudoslam.agents.loading import load_policy
from houseexpo.pseudoslam.benchmark.cases import Case, seed_from_words
from houseexpo.pseudoslam.benchmark.episodes import EpisodeOutcome, EpisodeRunner, Note
from houseexpo.pseudoslam.benchmark.run import check_task, make_policy_record, playable_plans
from houseexpo.pseudoslam.benchmark.supervise import run_cases
from houseexpo.pseudoslam.benchmark.tracks import TRACKS, Houses, Track, find_track
from houseexpo.pseudoslam.tasks import ROOM

_NAME: Final = re.compile(r"[-_\w]+-v\d+")
"""The name of a Minari data set without a namespace."""
_FORMAT: Final = "parquet"
"""Minari's format of files: pyarrow writes it, which the base installation has, and it is compressed."""


@dataclass(frozen=True)
class CollectSettings:
    """The settings of a collection.

    Parameters
    ----------
    episodes
        Number of episodes.
    split
        The list from which plans are taken; "" for all plans.
    seed
        The seed of plans, starts, noise and policy (R1).
    workers
        Number of processes.
    decision_limit_s
        Time limit of an action of the policy, seconds.
    """

    episodes: int = 100
    split: str = ""
    seed: int = 0
    workers: int = 1
    decision_limit_s: float = 60.0

    def __post_init__(self) -> None:
        check_whole_number(self.episodes, "episodes", at_least=1)


@dataclass(frozen=True)
class CollectedEpisode(EpisodeOutcome):
    """An episode with everything that the environment returned.

    Parameters
    ----------
    observations
        What the n + 1 observations contain, each array with a first axis of n + 1; by name if they are dictionaries.
    infos
        The values of the n + 1 infos that are no texts, by name.
    rewards, terminations, truncations
        Those of the n steps (n,).
    """

    observations: Any = None
    infos: dict[str, list[Any]] | None = None
    rewards: npt.NDArray[np.float64] | None = None
    terminations: npt.NDArray[np.bool_] | None = None
    truncations: npt.NDArray[np.bool_] | None = None


class Collected(NamedTuple):
    """What a data set holds: episodes, steps, the mean of the episodes' rewards, and the share that succeeded.

    ``left_out`` is the number of plans that were passed over, because the robot fits nowhere or has no goal there.
    """

    episodes: int
    steps: int
    reward: float
    success: float
    left_out: int


class _CollectingRunner(EpisodeRunner):
    """A runner that keeps what the environment returns (R2)."""

    _seen: list[tuple[Any, ...]]

    def run(self, case: Case, note: Note = lambda _: None) -> CollectedEpisode:
        """Run one episode; raise PolicyError as ``EpisodeRunner.run``, and if the policy takes no action."""
        self._seen = []
        outcome = super().run(case, note)
        observations, infos, rewards, terminations, truncations = zip(*self._seen, strict=True)
        if not outcome.actions:
            raise PolicyError(f"{self._where(case, 0)}: expected an action, found none; there is nothing to learn from")
        ends = np.array(truncations[1:], bool)
        ends[-1] |= not terminations[-1]  # R3
        return CollectedEpisode(
            **vars(outcome),
            observations=_stack(observations),
            infos={key: [info[key] for info in infos] for key, value in infos[0].items() if not isinstance(value, str)},
            rewards=np.array(rewards[1:], np.float64),
            terminations=np.array(terminations[1:], bool),
            truncations=ends,
        )

    def _reset(self, case: Case) -> Any:
        observation, info = super()._reset(case)
        self._seen.append((observation, info, 0.0, False, False))
        return observation, info

    def _step(self, case: Case, step: int, action: Any) -> Any:
        observation, reward, terminated, truncated, info = super()._step(case, step, action)
        self._seen.append((observation, info, reward, terminated, truncated))
        return observation, reward, terminated, truncated, info


def _stack(parts: Iterable[Any]) -> Any:
    """Return arrays or dictionaries of arrays with a new first axis."""
    parts = list(parts)
    if isinstance(parts[0], dict):
        return {key: np.array([part[key] for part in parts]) for key in parts[0]}
    return np.array(parts)


def collect_episodes(
    track: Track, policy_name: str, plans: Dataset | None, out: Path, settings: CollectSettings
) -> Collected:
    """Write episodes of a policy as a Minari data set, in the format Parquet, and return what it holds.

    ``minari.load_dataset(out.name)`` reads it with MINARI_DATASETS_PATH set to the folder that ``out`` is in. A script
    that calls this needs ``if __name__ == "__main__"``.

    Parameters
    ----------
    policy_name
        A name for ``load_policy``.
    plans
        A data set with the list; None if the track has its own room.
    out
        The folder to write, named as Minari names data sets: NAME-v0.

    Raises
    ------
    MissingDependencyError
        Minari is not installed.
    ConfigError, DatasetError
        There is no such policy or list, ``out`` is no name for a data set, or there is something already.
    PolicyError
        The policy failed in an episode, or took no action.
    """
    try:
        from minari.data_collector.episode_buffer import EpisodeBuffer
        from minari.dataset.minari_storage import MinariStorage
    except ImportError:
        raise MissingDependencyError(f"collect needs Minari: {install_command('minari')}") from None
    check_collection_folder(out)
    if track not in TRACKS:
        raise ConfigError(f"track {track.id}: expected a track on plans, found one on maps; choose another --track")
    policy = load_policy(policy_name)
    check_task(policy, track)
    record = msgspec.to_builtins(make_policy_record(policy, settings.seed))
    houses, cases, left_out = _cases(track, plans, settings)
    env = track.environment(houses, policy.interface)
    done = run_cases(
        partial(_make_runner, track.id, policy_name, houses, settings.seed),
        cases, settings.workers, settings.decision_limit_s, policy_name,
    )  # fmt: skip
    episodes = _in_order(show_progress(done, f"{policy_name}, {track.id}", len(cases)))
    said: list[dict[str, Any]] = []
    rewards: list[float] = []
    won: list[bool] = []

    def buffers() -> Iterator[Any]:
        for episode in episodes:
            assert episode.rewards is not None and episode.infos is not None  # noqa: S101, PT018  # the runner set them
            said.append(episode.values)
            rewards.append(float(episode.rewards.sum()))
            won.append(bool(episode.infos["is_success"][-1]))
            yield EpisodeBuffer(
                None, episode.case.seed, episode.case.options, episode.observations,
                np.array(episode.actions, env.action_space.dtype),
                episode.rewards, episode.terminations, episode.truncations, episode.infos,
            )  # fmt: skip

    out.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=f".{out.name}-", dir=out.parent.absolute()) as place:
        (whole := Path(place, out.name)).mkdir()
        storage = MinariStorage.new(
            whole / "data", env.observation_space, env.action_space, data_format=_FORMAT, jpeg_encoding=False
        )
        storage.update_metadata(
            {
                "dataset_id": out.name,
                "minari_version": version("minari"),
                "algorithm_name": policy_name,
                "description": f"{policy_name} on {track.id} of houseexpo: {track.about}",
                "requirements": [f"houseexpo=={__version__}"],
                "policy": record,
                "track": track.record(),
                "split": settings.split,
            }
        )
        storage.update_episodes(buffers())
        storage.update_episode_metadata(said)
        steps = int(storage.total_steps)
        whole.rename(out)  # R4
    return Collected(len(won), steps, float(np.mean(rewards)), float(np.mean(won)), left_out)


def check_collection_folder(out: Path) -> None:
    """Raise ConfigError if a folder is no name for a data set, or is there already."""
    if not _NAME.fullmatch(out.name):
        raise ConfigError(
            f"--out: expected a folder named as Minari names data sets, such as {out.parent / 'frontier-v0'}, "
            f"found {out.name!r}"
        )
    if out.exists():
        raise ConfigError(f"--out: {out} is there already; choose another name, such as the next version, or remove it")


def _cases(track: Track, plans: Dataset | None, settings: CollectSettings) -> tuple[Houses, list[Case], int]:
    """Return the houses, the episodes (R1), and the number of plans that were passed over."""
    if track.needs_plans and plans is None:
        raise ConfigError(f"track {track.id}: expected a data set, found none; name one")
    chosen: Houses = [ROOM]
    ids = [ROOM.id]
    if track.needs_plans and plans is not None:
        chosen = plans.split(settings.split) if settings.split else plans
        ids = sorted(chosen.ids)
    order = [ids[place] for place in np.random.default_rng(settings.seed).permutation(len(ids)).tolist()]
    left_out = 0
    if isinstance(chosen, Dataset):
        playable = playable_plans(track, chosen, order, settings.episodes)
        looked_at = order.index(playable[-1]) + 1 if len(playable) == settings.episodes else len(order)
        order, left_out = playable, looked_at - len(playable)
    names = [order[number % len(order)] for number in range(settings.episodes)]
    cases = [
        Case(name, seed_from_words(track.id, name, str(settings.seed), str(number)))
        for number, name in enumerate(names)
    ]
    return chosen, cases, left_out


def _make_runner(track_id: str, policy_name: str, plans: Houses, seed: int) -> EpisodeRunner:
    return _CollectingRunner(find_track(track_id), load_policy(policy_name), plans, seed)


def _in_order(done: Iterable[tuple[int, Any]]) -> Iterator[CollectedEpisode]:
    """Yield episodes in the order of their numbers (R4)."""
    waiting: dict[int, CollectedEpisode] = {}
    number = 0
    for found, episode in done:
        waiting[found] = episode
        while number in waiting:
            yield waiting.pop(number)
            number += 1
