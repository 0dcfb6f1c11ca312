"""``houseexpo serve``: what it refuses before it starts, and the address that it says."""

from __future__ import annotations

import socket
from pathlib import Path
from typing import Any

import pytest
import typer
import uvicorn
from typer.testing import CliRunner

from houseexpo.commands import serve as command
from houseexpo.errors import ConfigError, DatasetError
from houseexpo.service.collection import Collection
from houseexpo.service.collection import open_collections as collections
from houseexpo.service.guard import LimitedProtocol
from houseexpo.service.service import Service
from tests.builders.services import built, published, some_plans


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path / "cache"))
    return built(tmp_path / "homes", some_plans())


@pytest.fixture
def started(monkeypatch: pytest.MonkeyPatch) -> list[Service]:
    """The services that would run."""
    found: list[Service] = []
    monkeypatch.setattr(command, "run_service", lambda service, _: found.append(service))
    return found


def said(*words: object) -> str:
    app = typer.Typer()
    app.command()(command.serve)
    result = CliRunner().invoke(app, [*map(str, words)], catch_exceptions=False)
    assert result.exit_code == 0
    return result.output


def test_it_says_what_is_shown_and_where(folder: Path, tmp_path: Path, started: list[Service]) -> None:
    text = said(folder, published(tmp_path / "houses.jsonl", 3), "--port", 0)
    assert "homes: 4 plans" in text
    assert "houses: 3 plans" in text
    settings = started[0].settings
    assert f"http://127.0.0.1:{settings.port}/ " in text
    assert (settings.token, settings.read_only, settings.review) == ("", False, False)
    assert settings.port > 0


def test_a_data_set_of_another_service_is_not_judged_here() -> None:
    with pytest.raises(DatasetError, match="serve --review needs the files"):
        said("http://127.0.0.1:9/homes", "--review", "--port", 0)


def test_another_address_than_loopback_has_a_token(folder: Path, started: list[Service]) -> None:
    text = said(folder, "--host", "0.0.0.0", "--port", 0)  # noqa: S104
    token = started[0].settings.token
    assert len(token) >= 20
    assert f"?token={token}" in text
    assert f"http://{socket.gethostname()}:" in text


def test_a_port_is_taken_before_data_sets_are_opened(
    folder: Path, started: list[Service], monkeypatch: pytest.MonkeyPatch
) -> None:
    def opened(paths: list[Path]) -> dict[str, Collection]:
        """Open them, and start a second server meanwhile."""
        (port,) = ports
        with pytest.raises(ConfigError, match="cannot listen"):
            command._listening_socket("127.0.0.1", port)
        return collections(paths)

    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        ports = [free.getsockname()[1]]
    monkeypatch.setattr("houseexpo.service.collection.open_collections", opened)
    said(folder, "--port", ports[0])
    assert started


@pytest.mark.parametrize(
    ("words", "error", "text"),
    [
        (("nowhere",), DatasetError, "found nothing there"),
        (("--review", "--read-only"), ConfigError, "leave one out"),
        (("--host", "no.such.host.invalid"), ConfigError, "cannot listen"),
        (("--host", "a" * 64 + ".example"), ConfigError, "cannot listen"),
    ],
)
def test_what_cannot_be_served_is_said(folder: Path, words: tuple[str, ...], error: Any, text: str) -> None:
    where = () if words == ("nowhere",) else (folder,)
    with pytest.raises(error, match=text):
        said(*where, *words, "--port", 0)


def test_connections_that_are_held_for_nothing_are_closed(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found: list[uvicorn.Config] = []
    monkeypatch.setattr("uvicorn.Server.run", lambda server, **_: found.append(server.config))
    said(folder, "--port", 0)
    assert found[0].http is LimitedProtocol
