"""A build on a Slurm cluster: real daemons on this machine run the scripts that are written."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from houseexpo.commands.app import make_app
from houseexpo.errors import ConfigError
from pipeline.batch.slurm import QueuedShards, SlurmScripts, TaskResources, format_ranges
from tests.builders.batch import contents
from tests.builders.clusters import MAX_TASKS, call, cluster, need_slurm, wait_for

HOUSES, SHARDS = 12, 5


def houseexpo(*words: str | Path) -> str:
    return call(sys.executable, "-m", "houseexpo", *map(str, words))


def queued(name: str = "") -> list[str]:
    """Tasks and jobs that have not ended."""
    return [line for line in call("squeue", "-h", "-r", "-o", "%j_%K %T").splitlines() if name in line]


@pytest.mark.slow
def test_the_scripts_run_and_what_was_cancelled_is_submitted_again(tmp_path: Path) -> None:
    need_slurm()
    manifest, out = tmp_path / "houses.toml", tmp_path / "my plans"
    manifest.write_text(f'[build]\nsources = ["procedural:{HOUSES}"]\nseed = 3\n')
    houseexpo("build", "--config", manifest, "--out", tmp_path / "serial")
    asked = ("slurm", manifest, "--shards", str(SHARDS), "--out", out, "--memory", "900M", "--time", "10", "--submit")
    (tmp_path / "slurm").mkdir()
    with cluster(tmp_path / "slurm"):
        call("scontrol", "update", "NodeName=n2", "State=DRAIN", "Reason=test")  # one task at a time
        assert f"{SHARDS} of {SHARDS} shards" in houseexpo(*asked)
        tasks = {line.split()[0] for line in queued()}
        assert len(tasks) == SHARDS + 1  # the last one assembles
        assert len({task.rpartition("_")[0] for task in tasks}) == -(-SHARDS // MAX_TASKS) + 1
        victim = call("squeue", "-h", "-r", "-t", "PENDING", "-o", "%i %j").splitlines()
        [cancelled] = [line.split()[0] for line in victim if line.split()[0].endswith("_1") and line.endswith("-0")]
        call("scancel", cancelled)
        call("scontrol", "update", "NodeName=n2", "State=RESUME")
        wait_for(lambda: not queued(), "the build", 300.0)
        [said] = (out / ".build" / "slurm").glob("assemble-*.txt")
        assert "shard 1/5: " in said.read_text()
        assert not (out / "manifest.json").exists()
        assert f"1 of {SHARDS} shards" in houseexpo(*asked)
        wait_for(lambda: not queued(), "the second submission", 300.0)
        assert contents(out) == contents(tmp_path / "serial")
        assert f"0 of {SHARDS} shards" in houseexpo(*asked[:-1])


def scripts(folder: Path, **asked: str) -> SlurmScripts:
    return SlurmScripts(
        folder, "/shared/my plans", ["houseexpo", "build", "--out", "/shared/my plans"], 2500, TaskResources(**asked)
    )


def test_more_than_the_cluster_takes_is_split_and_what_is_queued_is_left_out(tmp_path: Path) -> None:
    written = scripts(tmp_path / "with a space", partition="long", time="04:00:00", memory="8G")
    count = written.write([0, 1, 2, 5, 999, 1000, 2400], 1000, QueuedShards(frozenset({1, 2400}), ("77",)))
    assert count == 5
    text = (written.folder / "submit.sh").read_text()
    assert "--array=0,2,5,999 " in text
    assert f"--array=0 --job-name={written.name}-1000 --export=ALL,OFFSET=1000" in text
    assert "OFFSET=2000" not in text
    assert "jobs=77\n" in text
    task = (written.folder / "task.sbatch").read_text()
    for line in ("--partition=long", "--time=04:00:00", "--mem=8G", "--cpus-per-task=1"):
        assert f"#SBATCH {line}\n" in task
    assert task.endswith("""--out '/shared/my plans' --shard "$((OFFSET + SLURM_ARRAY_TASK_ID))/2500"\n""")
    for name in ("submit.sh", "task.sbatch", "assemble.sbatch"):
        subprocess.run(["sh", "-n", str(written.folder / name)], check=True)


def test_scripts_are_written_where_no_cluster_answers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, street: Path
) -> None:
    squeue = tmp_path / "bin" / "squeue"
    squeue.parent.mkdir()
    squeue.write_text("#!/bin/sh\necho no configuration >&2\nexit 1\n")
    squeue.chmod(0o755)
    monkeypatch.setenv("PATH", f"{squeue.parent}:{os.environ['PATH']}")
    manifest = tmp_path / "houses.toml"
    manifest.write_text(f'[build]\nsources = ["{street}"]\n')
    words = ["slurm", str(manifest), "--shards", "2", "--out", str(tmp_path / "out")]
    done = CliRunner().invoke(make_app(), words)
    assert done.exit_code == 0, done.output
    assert "no configuration; the scripts are for all shards that are not done" in done.output
    assert (tmp_path / "out" / ".build" / "slurm" / "submit.sh").exists()
    assert CliRunner().invoke(make_app(), [*words, "--submit"]).exit_code == 2


def test_a_machine_without_slurm_writes_the_scripts_and_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, street: Path
) -> None:
    monkeypatch.setenv("PATH", "/nowhere")
    manifest = tmp_path / "houses.toml"
    manifest.write_text(f'[build]\nsources = ["{street}"]\n')
    words = ["slurm", str(manifest), "--shards", "2", "--out", str(tmp_path / "out"), "--submit"]
    done = CliRunner().invoke(make_app(), words)
    assert done.exit_code == 2
    assert "this machine has no Slurm" in done.output
    assert "squeue" not in done.output
    assert (tmp_path / "out" / ".build" / "slurm" / "submit.sh").exists()


@pytest.mark.parametrize(
    ("option", "found"),
    [("--time", "abc"), ("--time", "4h"), ("--memory", "8 G"), ("--memory", "-1"), ("--partition", "long; short")],
)
def test_what_slurm_does_not_take_is_refused_before_anything_is_written(
    tmp_path: Path, street: Path, option: str, found: str
) -> None:
    manifest = tmp_path / "houses.toml"
    manifest.write_text(f'[build]\nsources = ["{street}"]\n')
    words = ["slurm", str(manifest), "--shards", "2", "--out", str(tmp_path / "out"), f"{option}={found}"]
    done = CliRunner().invoke(make_app(), words)
    assert isinstance(done.exception, ConfigError) or done.exit_code == 2
    assert f"{option}: expected " in done.output + str(done.exception)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("time", ["90", "4:00", "04:00:00", "2-12", "2-12:30", "2-12:30:00"])
def test_all_forms_of_slurm_s_times_are_taken(time: str) -> None:
    assert f"--time={time}\n" in TaskResources(time=time).head(Path("log"), "name")


@pytest.mark.parametrize(("numbers", "text"), [([], ""), ([4], "4"), ([0, 1, 2, 5, 7, 8], "0-2,5,7-8")])
def test_numbers_as_slurm_writes_them(numbers: list[int], text: str) -> None:
    assert format_ranges(numbers) == text
