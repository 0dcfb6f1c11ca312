"""Verify results: play the actions that a result stores again, and compare every value; mark the file if all are equal.

A result is a text that anybody can write. Its actions cannot be invented: played again in the same plans from the same
starts, they give the values of the result or they do not. ``verify_result`` plays them; ``mark_verified`` writes the
outcome beside the result, in ``RESULT.verified``, with the hash of the result's bytes; ``is_verified`` reads it. A mark
says that the owner of the folder has played the actions again. Who does not trust that owner plays them again.

Not compared are the times of decisions, and predicted maps that came from the policy, which is not run.
"""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

import msgspec

from houseexpo import __version__
from houseexpo.dataset import Dataset
from houseexpo.errors import ConfigError, DatasetError
from houseexpo.files import read_json, write_atomically
from houseexpo.progress import show_progress
from houseexpo.pseudoslam.agents.loading import NamedPolicy
from houseexpo.pseudoslam.agents.protocol import Interface, Knowledge, Robot
from houseexpo.pseudoslam.benchmark import result as results
from houseexpo.pseudoslam.benchmark.cases import Case
from houseexpo.pseudoslam.benchmark.episodes import EpisodeOutcome, EpisodeRunner, Note
from houseexpo.pseudoslam.benchmark.prediction import OF_POLICY, prediction_metrics
from houseexpo.pseudoslam.benchmark.run import find_cases
from houseexpo.pseudoslam.benchmark.supervise import run_cases
from houseexpo.pseudoslam.benchmark.tracks import MAP_TRACKS, Houses, Track, find_track
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.worlds.maps import MapHouse

SUFFIX: Final = ".verified"
_REPLAY_LIMIT_S: Final = 600.0  # for a step: nobody decides, so only a machine at its limit is slower


class _Mark(msgspec.Struct, frozen=True):
    """The content of a mark: the hash of the result's bytes, the version that played it, the number of episodes."""

    result_sha256: str
    houseexpo: str
    episodes: int


@dataclass(frozen=True)
class Replay:
    """The factory of a policy that takes the recorded actions of one episode, and is then done."""

    interface: Interface
    actions: Sequence[Any] = ()

    def __call__(self, robot: Robot, seed: int) -> Callable[[Any, Knowledge], Any]:
        """Return the policy; neither the robot nor the seed matters."""
        del robot, seed
        left = iter(self.actions)
        return lambda _observation, _info: next(left, None)


class ReplayRunner(EpisodeRunner):
    """Runs episodes of a track with recorded actions, which ``actions`` has for each case's seed."""

    def __init__(self, track: Track, plans: Houses, record: results.PolicyRecord, actions: Mapping[int, str]) -> None:
        self._actions = actions
        self._interface = Interface(actions=record.actions)  # type: ignore[arg-type]  # checked when it is made
        policy = NamedPolicy(record.name, Replay(self._interface), record.source, record.sha256)
        prediction = record.prediction or ""
        super().__init__(track, policy, plans, prediction="" if prediction == OF_POLICY else prediction)

    def run(self, case: Case, note: Note = lambda _: None) -> EpisodeOutcome:
        """Run one episode with its recorded actions; raise PolicyError if one of them is invalid."""
        replay = Replay(self._interface, results.decode_actions(self._actions[case.seed]))
        self.policy = dataclasses.replace(self.policy, factory=replay)
        return super().run(case, note)


def verify_result(
    result: results.Result, plans: Dataset | list[MapHouse] | None, workers: int, name: str = "result"
) -> None:
    """Play the actions of a result again, and compare its values.

    Parameters
    ----------
    plans
        The data set or the maps of the result; None if its track has its own room.
    workers
        Number of processes.
    name
        The name of the result in errors: its file.

    Raises
    ------
    ConfigError
        The result has no actions, is for other plans than the given ones, or a value differs from the replay.
    PolicyError
        An action is not one of the track.
    """
    track = find_track(result.track_id)
    _check_config(track, result, name)
    if result.actions is msgspec.UNSET:
        raise ConfigError(f"{name}: has no actions, so that it cannot be played again; run the benchmark again")
    houses, cases = _cases_of(track, result, plans, name)
    actions = dict(zip((case.seed for case in cases), result.actions, strict=True))
    new_runner = partial(_make_runner, track.id, houses, result.policy, actions)
    done = run_cases(new_runner, cases, workers, _REPLAY_LIMIT_S, result.policy.name)
    try:
        outcomes = dict(show_progress(done, f"{result.policy.name}, {track.id}, played again", len(cases)))
    except ConfigError as error:
        raise ConfigError(f"{name}: {error}") from None
    fault = next(_differences(track, result, [outcomes[number] for number in range(len(cases))]), "")
    if fault:
        raise ConfigError(f"{name}: {fault}; its actions do not give its values, so it is refused")


def _check_config(track: Track, result: results.Result, name: str) -> None:
    """Raise ConfigError if a result states other settings than its track; missing settings are the defaults."""
    try:
        said = SimulatorConfig.from_mapping(result.track["config"])
    except (KeyError, TypeError, ConfigError) as error:
        raise ConfigError(f"{name}: expected the settings of track {track.id}, found {error}; it is refused") from None
    if dataclasses.replace(said, observation=track.config.observation) != track.config:
        raise ConfigError(f"{name}: its settings are not those of track {track.id}, so it is refused")


def _make_runner(
    track_id: str, houses: Houses, record: results.PolicyRecord, actions: Mapping[int, str]
) -> EpisodeRunner:
    return ReplayRunner(find_track(track_id), houses, record, actions)


def _cases_of(
    track: Track, result: results.Result, plans: Dataset | list[MapHouse] | None, name: str
) -> tuple[Houses, list[Case]]:
    """Return the houses and cases of a result; raise ConfigError if its statements about them are wrong."""
    listed, split = [str(plan) for plan in result.episodes["plan"]], result.plans.split
    if plans is None and track.needs_plans:
        which = "--maps" if track in MAP_TRACKS or split == "maps" else "--dataset"
        raise ConfigError(f"{name}: expected the plans of the result; name them with {which}")
    try:
        houses, cases, record = find_cases(track, plans, listed, split)
    except DatasetError as error:
        raise ConfigError(f"{name}: {error}; name the data set of the result with --dataset") from None
    if isinstance(plans, Dataset) and track.needs_plans and not set(listed) <= set(plans.splits.get(split, listed)):
        raise ConfigError(f"{name}: its plans are not those of the list {split!r}, so it is refused")
    if [case.plan_id for case in cases] != listed or [case.seed for case in cases] != result.episodes["seed"]:
        raise ConfigError(f"{name}: its starts are not those of track {track.id} in these plans, so it is refused")
    if (record.ids_sha256, record.content_sha256) != (result.plans.ids_sha256, result.plans.content_sha256):
        raise ConfigError(f"{name}: is for other plans than these: their hashes differ; name those of the result")
    return houses, cases


def _differences(track: Track, result: results.Result, outcomes: list[EpisodeOutcome]) -> Iterator[str]:
    """Yield the differences between the replay and the result."""
    is_own = result.policy.prediction == OF_POLICY
    scores = {metric.key for metric in prediction_metrics(track.budgets_m)}
    own = scores if is_own else scores - result.episodes.keys()  # a score may be newer than the result
    columns = results.make_episode_columns(outcomes)
    for key in sorted((columns.keys() | result.episodes.keys()) - own):
        if key not in columns or key not in result.episodes:
            yield f"column {key!r}: the replay {'has it' if key in columns else 'does not have it'}"
            continue
        for plan, said, found in zip(result.episodes["plan"], result.episodes[key], columns[key], strict=True):
            if said != found:
                yield f"plan {plan!r}: {key}: the result says {said}, the replay gives {found}"
    summary = results.compute_summary(track, outcomes)
    for key, said in result.summary.items():
        if key not in own and said != summary.get(key):
            yield f"summary of {key}: the result says {said}, the replay gives {summary.get(key)}"
    if results.compute_mean_curves(track, outcomes) != result.curves:
        yield "the curves of coverage are not those of the replay"
    if result.map_curves is not msgspec.UNSET and results.round_episode_curves(track, outcomes) != result.map_curves:
        yield "the curves of single maps are not those of the replay"


def mark_verified(file: Path, result: results.Result) -> Path:
    """Write the mark of a result that was verified beside it, and return the mark's path."""
    mark = _Mark(hashlib.sha256(file.read_bytes()).hexdigest(), __version__, len(result.episodes["plan"]))
    write_atomically(_mark_path(file), msgspec.json.encode(mark) + b"\n")
    return _mark_path(file)


def is_verified(file: Path) -> bool:
    """Return whether a result has a mark, and has not changed since."""
    try:
        mark = read_json(_mark_path(file), _Mark)
    except (OSError, msgspec.DecodeError):
        return False
    return mark.result_sha256 == hashlib.sha256(file.read_bytes()).hexdigest()


def _mark_path(file: Path) -> Path:
    return file.with_suffix(SUFFIX)
