"""A Ray cluster that goes away in the middle of a build is said, and how to go on."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from houseexpo.errors import HouseExpoError
from pipeline.executors import ray
from pipeline.executors.local import Limits


class RayError(Exception):
    """In place of Ray's own, which need not be installed."""


class RayTaskError(RayError):
    """The same, of a task."""


@pytest.mark.parametrize("error", [ConnectionError("the head is down"), RayError("the last node died")])
def test_a_cluster_whose_last_node_dies_is_said(monkeypatch: pytest.MonkeyPatch, error: Exception) -> None:
    def fail(*_: object, **__: object) -> None:
        raise error

    cluster = SimpleNamespace(
        exceptions=SimpleNamespace(RayError=RayError, RayTaskError=RayTaskError),
        put=lambda work: work,
        remote=lambda **_: lambda task: task,
        cluster_resources=fail,
        shutdown=lambda: None,
    )
    monkeypatch.setattr(ray, "_connect", lambda _: cluster)
    with pytest.raises(HouseExpoError, match=r"Ray cluster head:1 is gone .* what is done is kept: run this command"):
        list(ray.run(len, ["a"], address="head:1", limits=Limits(1.0, 2**31)))
