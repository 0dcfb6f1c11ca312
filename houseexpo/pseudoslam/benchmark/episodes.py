"""Run episodes of a policy on a track one after the other, and return metrics, curves and decision times of each."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError, PolicyError
from houseexpo.pseudoslam.agents.loading import NamedPolicy, describe_exception, describe_no_policy
from houseexpo.pseudoslam.agents.protocol import Policy, make_knowledge, make_robot
from houseexpo.pseudoslam.benchmark.cases import Case, policy_seed_at_start
from houseexpo.pseudoslam.benchmark.measures import MEAN_DIGITS, Trace
from houseexpo.pseudoslam.benchmark.prediction import (
    OF_POLICY,
    PREDICTORS,
    Grid,
    PredictionScorer,
    check_predictor_name,
    find_predictor,
)
from houseexpo.pseudoslam.benchmark.tracks import Houses, Track
from houseexpo.pseudoslam.envs.single import PseudoSlamEnv
from houseexpo.pseudoslam.kernels.collision import STATIC, placed_people

Answer = TypeVar("Answer")
Note = Callable[[int], None]
CURVE_POINTS = 80


@dataclass(frozen=True)
class EpisodeOutcome:
    """The result of an episode.

    Parameters
    ----------
    values
        The value of each metric, and ``steps``, ``metres`` and ``coverage`` at the end; None for no value.
    curves
        Coverage at ``curve_sample_points`` for each of the track's curves.
    decisions_ms
        Time of each new decision of the policy, milliseconds, as the runner measures it.
    actions
        What the policy did, an action for each call until it was done; numbers, and lists of numbers.
    """

    case: Case
    values: dict[str, float | None]
    curves: dict[str, list[float]] = field(default_factory=dict)
    decisions_ms: npt.NDArray[np.float32] = field(default_factory=lambda: np.empty(0, np.float32), compare=False)
    actions: list[Any] = field(default_factory=list)


class EpisodeRunner:
    """Runs episodes of a track with a policy, in one environment with changing houses.

    Parameters
    ----------
    policy_seed
        The seed of the policies; each episode's is made of it and of the robot's first map (``policy_seed_at_start``).
    prediction
        The predicted map that is scored (``prediction``): "policy", or one of ``PREDICTORS``; "" for none.
    """

    def __init__(
        self,
        track: Track,
        policy: NamedPolicy,
        plans: Houses,
        policy_seed: int = 0,
        *,
        prediction: str = "",
    ) -> None:
        self.track, self.policy, self.policy_seed = track, policy, policy_seed
        self.prediction = prediction
        if prediction:
            check_predictor_name(prediction)
        self.env: PseudoSlamEnv = track.environment(plans, policy.interface)

    def run(self, case: Case, note: Note = lambda _: None) -> EpisodeOutcome:
        """Run one episode.

        Parameters
        ----------
        note
            A function that is called with the step before each call of the policy.

        Raises
        ------
        PolicyError
            The policy raised an exception or returned an invalid action.
        """
        took: list[float] = []
        actions: list[Any] = []
        scoring = self._scoring() if self.prediction else None
        trace = self.trace(case, note, took, actions, scoring)
        values = {**self.track.measure(trace), "steps": trace.steps[-1], "metres": trace.metres[-1]}
        if scoring is not None:
            values |= self._ask(case, int(trace.steps[-1]), scoring.values)
        if self.track.task == "exploration":
            values["coverage"] = trace.coverage[-1]
        curves = {over: trace.coverage_at(over, curve_sample_points(most)).tolist() for over, most in self.track.curves}
        rounded = {key: None if value is None else round(value, MEAN_DIGITS) for key, value in values.items()}
        return EpisodeOutcome(case, rounded, curves, np.array(took, np.float32), actions)

    def trace(
        self,
        case: Case,
        note: Note,
        took: list[float],
        actions: list[Any],
        scoring: PredictionScorer | None = None,
    ) -> Trace:
        """Run one episode, score predicted maps, and append each action and the time of each decision, milliseconds."""
        env, trace = self.env, Trace()
        observation, info = self._reset(case)
        self._add(trace, case, info, 0.0)
        note(0)
        policy = self._ask(case, 0, lambda: start_policy(self.policy, env, self.policy_seed))
        if not callable(policy):
            raise PolicyError(f"{self._where(case, 0)}: {describe_no_policy(self.policy, policy)}")
        if scoring is not None:
            scoring.occupied = (env.state.occupied & STATIC).astype(np.uint8)
            if self.prediction == OF_POLICY:
                scoring.predict = self._predict_of(policy)
            scoring.add(0.0, make_knowledge(env.simulator, env.state))
        for step in range(env.config.max_steps):  # a limit also for actions that take no step
            note(step)
            knowledge = make_knowledge(env.simulator, env.state)
            start = time.perf_counter()
            action = self._ask(case, step, lambda: policy(observation, knowledge))  # noqa: B023  # called at once
            ms = 1000 * (time.perf_counter() - start)
            if getattr(policy, "decided", True):
                took.append(ms)
            if action is None:
                return trace
            actions.append(np.asarray(action).tolist())
            observation, reward, terminated, truncated, info = self._step(case, step, action)
            self._add(trace, case, info, reward)
            if scoring is not None:
                self._ask(case, step, lambda: scoring.add(trace.metres[-1], make_knowledge(env.simulator, env.state)))
            if terminated or truncated:
                break
        return trace

    def _scoring(self) -> PredictionScorer:
        """Return the scoring of the predictions of one episode, which gets its truth when the episode begins."""
        if not self.track.budgets_m:
            raise ConfigError(
                f"--prediction: track {self.track.id} has no budget of metres, after which a prediction is scored; "
                "choose budget, large, noisy, people, kth or a pipe track"
            )
        name = PREDICTORS[0] if self.prediction == OF_POLICY else self.prediction
        of_map = find_predictor(name, self.env.config.pixels_per_metre)
        return PredictionScorer(lambda info: of_map(info["map"]), np.zeros((1, 1), np.uint8), self.track.budgets_m)

    def _predict_of(self, policy: Any) -> Callable[[Any], Grid]:
        found: Callable[[Any], Grid] | None = getattr(policy, "predicted_map", None)
        if found is None:
            raise ConfigError(
                f"--prediction {OF_POLICY}: expected policy {self.policy.name!r} to have a method predicted_map(info), "
                f"found none; choose one of {', '.join(PREDICTORS)}"
            )
        return found

    def _add(self, trace: Trace, case: Case, info: dict[str, Any], reward: float) -> None:
        state = self.env.state
        metres = float(state.episode.readings[0].path_length) / self.env.config.pixels_per_metre
        try:
            trace.add(int(state.counts.steps), metres, info, reward, gap_to_people(self.env))
        except ValueError as error:
            raise PolicyError(f"{self._where(case, int(state.counts.steps))}: {error}") from None

    def _ask(self, case: Case, step: int, question: Callable[[], Answer]) -> Answer:
        try:
            return question()
        except (Exception, SystemExit) as error:
            raise PolicyError(f"{self._where(case, step)}: it raised {describe_exception(error, __file__)}") from error

    def _reset(self, case: Case) -> Any:
        return self.env.reset(seed=case.seed, options=case.options)

    def _step(self, case: Case, step: int, action: Any) -> Any:
        try:
            return self.env.step(action)
        except ConfigError as error:
            raise PolicyError(f"{self._where(case, step)}: {error}") from None

    def _where(self, case: Case, step: int) -> str:
        return f"policy {self.policy.name!r}: plan {case.plan_id!r}, step {step}"


def start_policy(policy: NamedPolicy, env: PseudoSlamEnv, run_seed: int = 0) -> Policy:
    """Return the policy of an episode that has just begun in an environment, with the seed that the benchmark gives it.

    Wherever a policy drives in the same house from the same start, it is this one.
    """
    seed = policy_seed_at_start(run_seed, make_knowledge(env.simulator, env.state)["map"])
    return policy.factory(make_robot(env, policy.interface), seed)


def gap_to_people(env: PseudoSlamEnv) -> float:
    """Return the gap between the circles of the robot and of the nearest person, metres; infinite without people."""
    people, params = placed_people(env.state.episode.bodies.people), env.simulator.params
    if not len(people):
        return math.inf
    x, y, _ = env.state.pose_px.tolist()
    away_px = float(np.hypot(people["x"] - x, people["y"] - y).min())
    return (away_px - params.walk.radius_px - params.robot.radius_px) / env.config.pixels_per_metre


def curve_sample_points(most: int) -> npt.NDArray[np.float64]:
    """Return the places at which curves are sampled: 0 and 80 places up to ``most``."""
    return np.linspace(0, most, CURVE_POINTS + 1)
