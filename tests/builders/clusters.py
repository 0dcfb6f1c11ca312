"""What builds run on elsewhere: a Slurm cluster, an object store, and disks of a size, all on this machine."""

from __future__ import annotations

import os
import re
import secrets
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from multiprocessing import forkserver
from pathlib import Path

import pytest

from pipeline.batch.result_store import open_file_system
from tests.builders.needs import need

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "scancel", "squeue", "scontrol")
MAX_TASKS = 3
"""The cluster takes arrays of so many tasks: a build has to split what is more."""

_PATH = f"{os.environ.get('PATH', '')}:/usr/sbin:/sbin"

_CONF = """
ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={ports[0]}
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CredType=cred/munge
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool-%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd-%n.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd-%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=sched_interval=1,batch_sched_delay=0
MinJobAge=3600
ReturnToService=2
MaxArraySize={arrays}
NodeName=n1 NodeHostname={host} NodeAddr=127.0.0.1 Port={ports[1]} CPUs=1 RealMemory=2000
NodeName=n2 NodeHostname={host} NodeAddr=127.0.0.1 Port={ports[2]} CPUs=1 RealMemory=2000
PartitionName=main Nodes=n1,n2 Default=YES State=UP
"""


def need_slurm() -> None:
    """Skip where Slurm is not installed."""
    how = "as root: apt-get install slurmctld slurmd slurm-client munge"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PATH", _PATH)
        need(programs=PROGRAMS, root=True, how=how)


@contextmanager
def cluster(folder: Path) -> Iterator[None]:
    """Run the cluster; the environment leads Slurm's commands to it meanwhile."""
    _write(folder)
    with ExitStack() as stack, pytest.MonkeyPatch.context() as patch:
        patch.setenv("SLURM_CONF", str(folder / "slurm.conf"))
        patch.setenv("PATH", _PATH)
        munge = {name: f"{folder}/munge.{name}" for name in ("socket", "key", "pid", "seed", "log")}
        options = ("--socket", "--key-file", "--pid-file", "--seed-file", "--log-file")
        own = [f"{option}={file}" for option, file in zip(options, munge.values(), strict=True)]
        _run(stack, folder, ["munged", "-F", "-f", *own])
        wait_for(lambda: Path(munge["socket"]).exists(), "munged")
        _run(stack, folder, ["slurmctld", "-D", "-c"])
        for node in ("n1", "n2"):
            _run(stack, folder, ["slurmd", "-D", "-N", node])
        wait_for(lambda: call("sinfo", "-h", "-o", "%t %D") == "idle 2", "slurmctld and slurmd")
        yield
        call("scancel", "--user", "root", check=False)


def call(*command: str, check: bool = True) -> str:
    """Return what a command says."""
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0 or not check, (command, done.stdout, done.stderr)
    return done.stdout.strip()


def wait_for(happens: Callable[[], bool], what: str, seconds: float = 60.0) -> None:
    """Wait until something is true, for so long at most."""
    end = time.monotonic() + seconds
    while not happens():
        if time.monotonic() > end:
            raise RuntimeError(f"{what}: not within {seconds:g} s")
        time.sleep(0.2)


def _write(folder: Path) -> None:
    sockets = [socket.create_server(("127.0.0.1", 0)) for _ in range(3)]
    ports = [each.getsockname()[1] for each in sockets]
    for each in sockets:
        each.close()
    (folder / "state").mkdir()
    key = folder / "munge.key"
    key.touch(mode=0o600)
    key.write_bytes(secrets.token_bytes(1024))
    host = socket.gethostname().partition(".")[0]
    conf = _CONF.format(host=host, folder=folder, ports=ports, arrays=MAX_TASKS + 1)
    (folder / "slurm.conf").write_text(conf)


def _run(stack: ExitStack, folder: Path, command: Sequence[str]) -> None:
    """Run a daemon until the stack ends."""
    log = stack.enter_context((folder / f"{command[0]}-{command[-1]}.out".replace("/", "_")).open("wb"))
    daemon = subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT)

    def end() -> None:
        daemon.terminate()
        try:
            daemon.wait(timeout=10)
        except subprocess.TimeoutExpired:
            daemon.kill()
            daemon.wait()

    stack.callback(end)


# An object store on this machine: moto's S3 server, on the loopback interface.


BUCKET = "houses"


@contextmanager
def s3_server(folder: Path) -> Iterator[str]:
    """Run a server with one bucket; yields its address. The environment leads to it meanwhile."""
    log = folder / "server.log"
    command = [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", "0"]
    with log.open("wb") as stream:
        server = subprocess.Popen(command, stdout=stream, stderr=subprocess.STDOUT)
    try:
        address = _address(log, server)
        before = dict(os.environ)
        os.environ.update(
            AWS_ENDPOINT_URL=address,
            AWS_ACCESS_KEY_ID="testing",
            AWS_SECRET_ACCESS_KEY="testing",  # noqa: S106 - moto takes any
            AWS_DEFAULT_REGION="us-east-1",
        )
        try:
            import boto3

            boto3.client("s3").create_bucket(Bucket=BUCKET)
            forkserver._forkserver._stop()  # workers come from one that knows the address
            forget()
            yield address
        finally:
            os.environ.clear()
            os.environ.update(before)
            forkserver._forkserver._stop()
    finally:
        server.terminate()
        server.wait(timeout=10)


def forget() -> None:
    """Forget what was learned of another server."""
    import s3fs

    open_file_system.cache_clear()
    s3fs.S3FileSystem.clear_instance_cache()


def puts(folder: Path) -> list[str]:
    """Return the keys that were written by PUT, as often as they were; a copy within the store is one, too."""
    text = (folder / "server.log").read_text(errors="replace")
    return re.findall(rf'"PUT /{BUCKET}/(\S+) HTTP', text)


def _address(log: Path, server: subprocess.Popen[bytes]) -> str:
    while server.poll() is None:
        if found := re.search(r"Running on (http://127\.0\.0\.1:\d+)", log.read_text(errors="replace")):
            return found[1]
        time.sleep(0.1)
    raise RuntimeError(f"moto's server did not start: {log.read_text(errors='replace')}")


# Disks of a size, to fill up.


Disk = Callable[[str, str], Path]


def mount(options: str, place: Path) -> None:
    command = ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(place)]
    try:
        subprocess.run(command, check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("no tmpfs can be mounted here: that takes root")


@contextmanager
def disks() -> Iterator[Disk]:
    """Yield what mounts a disk of a size, under a name; mounting it again gives it another size.

    Its path is short: sockets of worker processes lie in the temporary folder, and their names have a limit.
    """
    home = Path(tempfile.mkdtemp(prefix="disk-"))
    mounted: list[Path] = []

    def sized(name: str, size: str) -> Path:
        place = home / name
        again = place in mounted
        place.mkdir(exist_ok=True)
        mount(f"{'remount,' if again else ''}size={size}", place)
        mounted.extend([] if again else [place])
        return place

    yield sized
    for place in mounted:
        subprocess.run(["umount", "-l", str(place)], check=False)
    shutil.rmtree(home, ignore_errors=True)
