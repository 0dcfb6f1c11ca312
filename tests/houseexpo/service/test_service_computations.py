"""What takes long: two at once, some wait, more are sent away, and what nobody waits for is left out."""

from __future__ import annotations

import threading
from types import SimpleNamespace
from typing import Any

import anyio
import pytest
from starlette.exceptions import HTTPException
from starlette.testclient import TestClient

from houseexpo.service import computations


@pytest.fixture(autouse=True)
def _own_turns(monkeypatch: pytest.MonkeyPatch) -> None:
    turns = computations._Turns()
    monkeypatch.setattr(computations, "_turns", lambda: turns)


def client_that(*, left: bool) -> Any:
    async def is_disconnected() -> bool:
        return left

    return SimpleNamespace(is_disconnected=is_disconnected)


def test_many_wait_and_more_are_sent_away() -> None:  # R1, R2
    done, go = [], threading.Event()

    async def one(number: int) -> None:
        try:
            await computations.compute_in_turn(client_that(left=False), lambda: go.wait(30) and done.append("made"))
        except HTTPException as error:
            done.append(error.status_code)
        if number == 39:
            go.set()

    async def all_at_once() -> None:
        async with anyio.create_task_group() as group:
            for number in range(40):
                group.start_soon(one, number)

    anyio.run(all_at_once)
    assert done == [503] * 6 + ["made"] * 34


def test_what_nobody_waits_for_is_not_computed() -> None:  # R3
    done: list[int] = []
    with pytest.raises(HTTPException):
        anyio.run(computations.compute_in_turn, client_that(left=True), done.append, 1)
    assert done == []
    anyio.run(computations.compute_in_turn, client_that(left=False), done.append, 2)
    assert done == [2]


def test_the_answer_says_when_to_ask_again(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(computations, "MAX_WAITING", -2)
    found = client.get("/api/homes/plans/a1/shape")
    assert (found.status_code, found.headers["retry-after"]) == (503, "5")
    assert client.get("/api/homes/plans/nobody/shape").status_code == 404  # it waits for no turn
