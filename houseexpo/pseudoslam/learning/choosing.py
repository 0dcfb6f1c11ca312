"""Learning to choose frontiers: rounds of trying choices out and of telling their worth, each by the chooser before it.

R1  The first round goes by information gain (``agents.information``), the others by what the last one learned.
R2  Plans are those of the train list, by their ids' SHA-256: the first ones for the first round, others in an order
    that the seed decides for the next. The last ``tested`` are learned from by nobody: there the mixture of area and
    metres is chosen for each round, and the round that is kept.
R3  The n-th plan's start and what is tried there are decided by the round and n, and from the second round on by the
    seed. So a run that was killed and goes on from its last file of choices ends with the same weights; and the first
    round's file, which no seed has a part in, serves all seeds: copy ``round-0.npz`` to another folder, and resume.
R4  What is kept is the round and mixture with the highest sum of two shares: how much more area than information gain
    has, and how much less metres than nearest frontier needs.
"""

from __future__ import annotations

import hashlib
import io
import platform
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

import houseexpo
from houseexpo.dataset import Dataset
from houseexpo.dataset.splits import list_bytes
from houseexpo.errors import ConfigError, TrainingError
from houseexpo.files import as_json, make_folder, write_whole
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.config.checks import above_zero, whole
from houseexpo.pseudoslam.kernels.planning.outlook import OUTLOOKS
from houseexpo.pseudoslam.kernels.planning.scoring import Scorer
from houseexpo.pseudoslam.learning.choice_net import fit
from houseexpo.pseudoslam.learning.choices import Choices, choices_in, no_choices
from houseexpo.pseudoslam.learning.commits import commit
from houseexpo.pseudoslam.learning.explorations import Explorations, mean_worth
from houseexpo.pseudoslam.learning.weights import rounded, write_weights

WEIGHTS: Final = "weights.json"
MIXTURES: Final = (0.0, 0.25, 0.5, 0.75, 1.0)
Say = Callable[[str], None]
_KEPT_EVERY = 16
_FIT = 2**31


@dataclass(frozen=True)
class ChoosingConfig:
    """A run.

    Parameters
    ----------
    seed
        Of all that is drawn.
    rounds, plans, more_plans
        How many rounds, of how many plans the first one, and each of the others.
    tested
        Plans on which rounds and mixtures are compared.
    pixels_per_metre
        Of the maps that are learned from; what frontiers are described by is in metres.
    steps
        The budget of an exploration.
    """

    seed: int = 0
    rounds: int = 2
    plans: int = 160
    more_plans: int = 40
    tested: int = 60
    pixels_per_metre: float = 12.5
    steps: int = 600

    def __post_init__(self) -> None:
        whole(self.seed, "seed", at_least=0)
        for name in ("rounds", "plans", "more_plans", "tested", "steps"):
            whole(getattr(self, name), name, at_least=1)
        above_zero(self, "choosing", "pixels_per_metre")


def line_scorer(**weights: float) -> Scorer:
    """Return a scorer that is a line of some of the numbers; ``_`` stands for a blank."""
    line = np.zeros(len(OUTLOOKS))
    for name, weight in weights.items():
        line[OUTLOOKS.index(name.replace("_", " "))] = weight
    return Scorer(line, np.zeros((1, len(line))), np.zeros(1), np.zeros((1, 1)), np.zeros(1), np.zeros(1))


INFORMATION: Final = line_scorer(log_sight_from_the_goal=1.0, way=-2.0, large=10.0)
NEAREST: Final = line_scorer(rank=-1.0)


def train_chooser(
    plans: Dataset, ids: Sequence[str], config: ChoosingConfig, folder: Path, *, resume: bool, say: Say
) -> dict[str, Any]:
    """Learn to the end, write ``weights.json``, and return what it says of itself.

    Parameters
    ----------
    ids
        Of the train list.

    Raises
    ------
    TrainingError
        The folder holds another run, or one and it is not to be resumed.
    ConfigError
        There are too few plans.
    """
    run = {**asdict(config), "train": hashlib.sha256(list_bytes(sorted(ids))).hexdigest()}
    commit()  # what the code is now, not what it will be when all is done
    at_work = _Run(plans, ids, config, folder, say)
    _begin(folder, run, resume=resume)
    return at_work.go(run)


class _Run:
    """A run at work."""

    def __init__(self, plans: Dataset, ids: Sequence[str], config: ChoosingConfig, folder: Path, say: Say) -> None:
        self._plans, self._config, self._folder, self._say = plans, config, folder, say
        self._learned, tested = _parted(ids, config)
        robot = SimulatorConfig(config.pixels_per_metre, max_steps=config.steps)
        self._explorations = Explorations(robot, config.steps)
        self._tests = [plans[name] for name in tested]
        self._scores: list[dict[str, Any]] = []

    def go(self, run: dict[str, Any]) -> dict[str, Any]:
        """Make all rounds; write the best weights, and return what is said of them."""
        base = {name: self._tested(each, {"base": name}) for name, each in _BASES.items()}
        scorer, best, found = INFORMATION, _Best(-np.inf, 0.0, INFORMATION), no_choices()
        for number in range(self._config.rounds):
            found = found.and_then(self._choices(number, scorer))
            net = fit(found, np.random.default_rng([self._config.seed, number, _FIT]))
            tried = []
            for share in MIXTURES:
                mixed = rounded(net.mixed(share))
                area, metres = self._tested(mixed, {"round": number, "choices": len(found), "share": share})
                tried.append(_Best(area / base["information"][0] - metres / base["nearest"][1], share, mixed))  # R4
            top = max(tried, key=lambda one: one.gain)
            scorer, best = top.scorer, max(best, top, key=lambda one: one.gain)
        made_by = {"houseexpo": houseexpo.__version__, "python": platform.python_version(), "numpy": np.__version__}
        about = {**run, "share": best.share, "commit": commit(), "versions": made_by, "tests": self._scores}
        write_weights(self._folder / WEIGHTS, best.scorer, about)
        return about

    def _tested(self, scorer: Scorer, what: dict[str, Any]) -> tuple[float, float]:
        """Return the area and the metres over the plans that are not learned from, and note them."""
        area, metres = mean_worth(self._explorations, self._tests, scorer)
        self._scores.append({**what, "area": round(area, 5), "metres": round(metres, 3)})
        said = ", ".join(f"{name} {value}" for name, value in what.items())
        self._say(f"{said}: area {area:.4f}, {metres:.2f} m to 90%")
        return area, metres

    def _choices(self, number: int, scorer: Scorer) -> Choices:
        """Return the choices of a round; those of its file first (R2, R3)."""
        config, file = self._config, self._folder / f"round-{number}.npz"
        found, done = _read(file)
        before = config.plans + (number - 1) * config.more_plans if number else 0
        most = config.more_plans if number else config.plans
        for n in range(done, most):
            plan = self._plans[self._learned[before + n]]
            rng = np.random.default_rng([number, n, config.seed] if number else [number, n])
            found = found.and_then(choices_in(self._explorations, plan, scorer, rng))
            if (n + 1) % _KEPT_EVERY == 0 or n + 1 == most:
                _write(file, found, n + 1)
                self._say(f"round {number}: {n + 1} of {most} plans, {len(found)} choices")
        return found


@dataclass(frozen=True, eq=False)
class _Best:
    """A mixture and what it gains, by R4."""

    gain: float
    share: float
    scorer: Scorer


_BASES: Final = {"information": INFORMATION, "nearest": NEAREST}


def _parted(ids: Sequence[str], config: ChoosingConfig) -> tuple[list[str], list[str]]:
    """Return the plans to learn from, in order, and those to be tested on (R2)."""
    wanted = config.tested + config.plans + (config.rounds - 1) * config.more_plans
    if len(ids) < wanted:
        raise ConfigError(f"expected {wanted} plans to learn from and to be tested on, found {len(ids)}; ask for fewer")
    listed = sorted(ids, key=lambda name: hashlib.sha256(name.encode()).digest())
    first, others = listed[: config.plans], listed[config.plans : len(listed) - config.tested]
    order = np.random.default_rng(config.seed).permutation(len(others))
    return [*first, *(others[i] for i in order.tolist())], listed[-config.tested :]


def _begin(folder: Path, run: dict[str, Any], *, resume: bool) -> None:
    """Write which run a folder holds; TrainingError where it holds another, or one that is not to be gone on with."""
    record = folder / "run.json"
    if record.exists() and not resume:
        raise TrainingError(f"{folder}: holds a run; go on with it by --resume, or name another folder")
    if record.exists() and record.read_bytes() != as_json(run):
        raise TrainingError(f"{folder}: holds another run than was asked for, see {record}; name another folder")
    make_folder(folder)
    write_whole(record, as_json(run))


def _write(file: Path, found: Choices, done: int) -> None:
    packed = io.BytesIO()
    np.savez_compressed(packed, outlooks=found.outlooks, tried=found.tried, worth=found.worth, done=done)
    write_whole(file, packed.getvalue(), durable=True)


def _read(file: Path) -> tuple[Choices, int]:
    if not file.exists():
        return no_choices(), 0
    try:
        with np.load(file) as arrays:
            return Choices(arrays["outlooks"], arrays["tried"], arrays["worth"]), int(arrays["done"])
    except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
        raise TrainingError(f"{file}: expected choices of a run, found it damaged ({error}); delete it") from None
