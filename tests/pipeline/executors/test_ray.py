"""A build on a Ray cluster of several nodes, all on this machine."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from houseexpo.errors import HouseExpoError
from pipeline.executors import ray
from pipeline.executors.local import Failure, Limits
from tests.builders.batch import contents, one_room, run_build, slowly
from tests.builders.needs import need
from tests.pipeline.executors.test_local import behave

pytestmark = [pytest.mark.slow, pytest.mark.ray]
ADDRESS = {"node_ip_address": "127.0.0.1"}


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    """A head of one core and two nodes of one core each."""
    need(modules=["ray"], how="make cluster")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER", "0")  # Ray's word for: speak over the loopback interface only
        from ray.cluster_utils import Cluster

        found = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, **ADDRESS})
        for _ in range(2):
            found.add_node(num_cpus=1, **ADDRESS)
        yield found
        found.shutdown()


def test_an_item_that_fails_takes_no_other_with_it(cluster: Any) -> None:
    words = ["a", "sleep", "b", "segfault", "c", "raise", *map(str, range(12))]
    found = dict(ray.run(behave, words, address=cluster.address, limits=Limits(2.0, 2**31)))
    kinds = {word: result.kind for word, result in found.items() if isinstance(result, Failure)}
    assert kinds == {"sleep": "timeout", "segfault": "died", "raise": "raised"}
    assert all(found[word] == word.upper() for word in words if word not in kinds)


def test_a_node_that_is_killed_in_the_middle_costs_nothing(cluster: Any, tmp_path: Path) -> None:
    for number in range(32):
        one_room(tmp_path / "street" / f"house_{number}.ply", 4.0 + number / 4)
    run_build([tmp_path / "street"], tmp_path / "serial")
    before, killed = len(cluster.worker_nodes), []

    def kill(what: str, done: int, total: int) -> None:
        if what == "planning" and not killed and done < total:
            killed.append(done)
            cluster.remove_node(next(iter(cluster.worker_nodes)), allow_graceful=False)

    execute = partial(ray.run, address=cluster.address)
    run_build([tmp_path / "street"], tmp_path / "out", plan=slowly, execute=execute, progress=kill)
    assert len(cluster.worker_nodes) == before - 1
    assert killed[0] < 32
    assert contents(tmp_path / "out") == contents(tmp_path / "serial")


def test_a_cluster_that_is_not_there_is_said() -> None:
    need(modules=["ray"], how="make cluster")
    with pytest.raises(HouseExpoError, match=r"Ray cluster 127\.0\.0\.1:9: cannot be reached"):
        next(ray.run(behave, ["a"], address="127.0.0.1:9", limits=Limits(1.0, 2**31)))
