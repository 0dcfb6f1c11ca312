"""Write and submit Slurm scripts for a build in shards: an array with a task for each shard, and a job that assembles.

Rules:

1. Only shards of which something is not done, and which are not in the queue already, are submitted.
2. An array holds as many tasks as the cluster takes; more are split. Task ``i`` of an array that begins at ``OFFSET``
   does shard ``OFFSET + i``.
3. The job that assembles waits until every task has ended, however it ended: it says what is not done.
4. A task gets an interrupt a minute before its time is over, and keeps what it has done.
"""

from __future__ import annotations

import hashlib
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from pathlib import Path

from houseexpo.errors import ConfigError, HouseExpoError
from houseexpo.files import make_folder, write_atomically

ARRAY_LIMIT = 1000
"""Tasks of an array where the cluster cannot be asked; its own default is 1001."""

_TASK = """#!/bin/sh
{head}
exec {command} --shard "$((OFFSET + SLURM_ARRAY_TASK_ID))/{shards}"
"""

_ASSEMBLE = """#!/bin/sh
{head}
exec {command}
"""


@dataclass(frozen=True)
class TaskResources:
    """The resources of a task, in Slurm's terms; None leaves the choice to the cluster.

    Raises
    ------
    ConfigError
        One of them is not of the form that Slurm takes.
    """

    partition: str | None = None
    time: str | None = None
    memory: str | None = None
    cores: int = 1

    def __post_init__(self) -> None:
        for option, found, form, expected in (
            ("--partition", self.partition, r"\S+", "a name without spaces"),
            ("--time", self.time, r"(\d+-)?\d+(:\d+){0,2}", "minutes, 04:00:00 or 2-12:00:00"),
            ("--memory", self.memory, r"\d+[KMGT]?", "megabytes, or a number with K, M, G or T, such as 8G"),
        ):
            if found is not None and not re.fullmatch(form, found):
                raise ConfigError(f"{option}: expected {expected}, found {found!r}")

    def head(self, logs: Path, name: str) -> str:
        """Return the head of a batch script."""
        asked = {
            "job-name": name,
            "partition": self.partition,
            "time": self.time,
            "mem": self.memory,
            "cpus-per-task": str(self.cores),
            "output": f'"{logs}"' if " " in str(logs) else str(logs),
            "signal": "B:INT@60",  # R4
        }
        return "\n".join(f"#SBATCH --{key}={value}" for key, value in asked.items() if value is not None)


@dataclass(frozen=True)
class QueuedShards:
    """What a cluster has in its queue of a build: its shards, and the jobs they belong to."""

    shards: frozenset[int] = frozenset()
    jobs: tuple[str, ...] = ()


@dataclass(frozen=True)
class SlurmScripts:
    """The scripts of a build: ``out`` is its data set, ``command`` runs a shard, without ``--shard``."""

    folder: Path
    out: str
    command: Sequence[str]
    shards: int
    request: TaskResources = field(default_factory=TaskResources)

    @property
    def name(self) -> str:
        """The name of its jobs in the queue."""
        return f"houseexpo-{hashlib.sha256(self.out.encode()).hexdigest()[:8]}"

    def write(self, shards: Iterable[int], limit: int, queue: QueuedShards) -> int:
        """Write ``submit.sh`` and the scripts of these shards, except those in the queue; return their number."""
        make_folder(self.folder)
        self._check()
        wanted = sorted(set(shards) - queue.shards)  # R1
        logs = {name: self.folder / f"{name}.txt" for name in ("task-%A_%a", "assemble-%j")}
        task = self.request.head(logs["task-%A_%a"], self.name)
        last = self.request.head(logs["assemble-%j"], f"{self.name}-assemble")
        assemble = shlex.join([*program_command(), "assemble", self.out])
        scripts = {
            "task.sbatch": _TASK.format(head=task, command=shlex.join(self.command), shards=self.shards),
            "assemble.sbatch": _ASSEMBLE.format(head=last, command=assemble),
            "submit.sh": "\n".join(self._submission(wanted, limit, queue)) + "\n",
        }
        for name, text in scripts.items():
            write_atomically(self.folder / name, text.encode(), durable=True)
        return len(wanted)

    def _check(self) -> None:
        """Raise ConfigError if a file with a script's name exists that this command did not write."""
        for name in ("task.sbatch", "assemble.sbatch", "submit.sh"):
            file = self.folder / name
            if file.exists() and b"houseexpo" not in file.read_bytes():
                raise ConfigError(f"{file}: a file is there already that houseexpo did not write; name another folder")

    def _submission(self, shards: Sequence[int], limit: int, queue: QueuedShards) -> Iterator[str]:
        folder = shlex.quote(str(self.folder))
        yield "#!/bin/sh"
        yield "set -e"
        yield f"scancel --me --state=PENDING --name={self.name}-assemble"
        yield f"jobs={':'.join(queue.jobs)}"
        for start, tasks in groupby(shards, lambda shard: shard // limit * limit):  # R2
            spec = format_ranges([shard - start for shard in tasks])
            options = f"--array={spec} --job-name={self.name}-{start} --export=ALL,OFFSET={start}"
            yield f"jobs=$jobs:$(sbatch --parsable {options} {folder}/task.sbatch)"
        yield 'test -z "$jobs" || after=--dependency=afterany:${jobs#:}'  # R3
        yield f"sbatch $after {folder}/assemble.sbatch"

    def queue(self) -> QueuedShards:
        """Return what the cluster has in its queue of the build, or nothing if there is no cluster."""
        if shutil.which("squeue") is None:
            return QueuedShards()
        lines = [
            line.split(maxsplit=2) for line in _output_of("squeue", "--me", "-h", "-r", "-o", "%K %F %j").splitlines()
        ]
        own = [(name.rpartition("-"), task, job) for task, job, name in lines if name.startswith(f"{self.name}-")]
        tasks = [(int(start) + int(task), job) for (_, _, start), task, job in own if start.isdecimal()]
        return QueuedShards(frozenset(shard for shard, _ in tasks), tuple(sorted({job for _, job in tasks})))

    def submit(self) -> str:
        """Submit the scripts; return Slurm's output. Raise HouseExpoError on a machine without Slurm."""
        script = self.folder / "submit.sh"
        if shutil.which("sbatch") is None:
            raise HouseExpoError(
                "--submit: this machine has no Slurm (no command sbatch); the scripts are written: on a login node, "
                f"run sh {script}"
            )
        return _output_of("sh", str(script))


def largest_array() -> int:
    """Return how many tasks an array of the cluster may have."""
    if shutil.which("scontrol") is None:
        return ARRAY_LIMIT
    found = [
        line.split()[-1] for line in _output_of("scontrol", "show", "config").splitlines() if "MaxArraySize" in line
    ]
    return int(found[0]) - 1 if found else ARRAY_LIMIT


def format_ranges(numbers: Sequence[int]) -> str:
    """Write ascending numbers as Slurm does: ``0-2,5``."""
    runs = [[pair[1] for pair in run] for _, run in groupby(enumerate(numbers), lambda pair: pair[1] - pair[0])]
    return ",".join(str(run[0]) if len(run) == 1 else f"{run[0]}-{run[-1]}" for run in runs)


def program_command() -> list[str]:
    """Return how this program is called on a node that shares its folders."""
    return [sys.executable, "-P", "-m", "houseexpo"]


def _output_of(*command: str) -> str:
    """Return the output of a Slurm command; raise HouseExpoError if it fails."""
    done = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603 - our words
    if done.returncode:
        reason = next((line.strip() for line in done.stderr.splitlines() if line.strip()), "no reason given")
        raise HouseExpoError(f"Slurm: {command[0]} ended with {done.returncode}: {reason}")
    return done.stdout.strip()
