"""An object store on this machine: moto's S3 server, on the loopback interface."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import forkserver
from pathlib import Path

from pipeline.batch.store import file_system_of

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

    file_system_of.cache_clear()
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
