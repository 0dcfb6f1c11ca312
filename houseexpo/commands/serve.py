"""``houseexpo serve``: show data sets in the browser, and offer them to programs."""

from __future__ import annotations

import secrets
import socket
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from houseexpo.words import count_noun

if TYPE_CHECKING:
    from houseexpo.service.service import Service, ServiceSettings

_TOKEN_BYTES: Final = 18
_QUEUE: Final = 256


def serve(
    dataset: Annotated[
        list[Path] | None,
        typer.Argument(help="Data sets: folders, archives, JSON lines.", show_default="the fetched one"),
    ] = None,
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port; 0 for any free one.")] = 8000,
    host: Annotated[
        str,
        typer.Option(help="Address to listen on. A token is needed for all but this machine's own.", metavar="ADDRESS"),
    ] = "127.0.0.1",
    review: Annotated[bool, typer.Option("--review", help="Add pages for reviewing plans.")] = False,
    policy: Annotated[
        list[str] | None,
        typer.Option(
            help="A policy to choose as driver: a Python file, trained weights, or module:name; repeat it for several.",
            show_default="the benchmark's explorers",
        ),
    ] = None,
    read_only: Annotated[bool, typer.Option("--read-only", help="Do not write any files.")] = False,
    measure: Annotated[
        bool,
        typer.Option(
            "--measure", help="First compute doors and navigability that plans do not record; takes minutes, once."
        ),
    ] = False,
    with_token: Annotated[
        bool, typer.Option("--token", help="Require the token in the address on this machine too.")
    ] = False,
) -> None:
    """Show data sets in the browser, with a gallery, statistics and a robot to drive, and serve them to programs."""
    from houseexpo.dataset.store import files_at
    from houseexpo.errors import ConfigError

    if review and read_only:
        raise ConfigError("serve: --review writes decisions, --read-only forbids it; leave one out")
    for place in dataset or () if review else ():
        files_at(place, "serve --review")  # decisions are stored beside the data set
    policies = _check_policies(policy or ())
    choices = {"read_only": read_only, "review": review, "policies": policies}
    with listening_service(host, port, with_token=with_token, **choices) as (settings, listening):
        from houseexpo.service.collection import open_collections
        from houseexpo.service.service import Service

        service = Service(open_collections(dataset or [_published_data_set()]), settings)
        for shown in service.collections.values():
            for name in ("rooms", "navigability") if measure else ():
                shown.dataset.column(name)
        announce(service)
        typer.echo(f"open {browser_address(settings)} in a browser; Ctrl-C ends it")
        run_service(service, listening)


def require_service(command: str) -> None:
    """Raise MissingDependencyError, which names the command, if a package of the extra ``serve`` is missing."""
    try:
        import starlette  # noqa: F401
        import uvicorn  # noqa: F401
    except ImportError as error:
        from houseexpo.errors import MissingDependencyError, install_command

        raise MissingDependencyError(f"{command} needs {error.name}: {install_command('serve')}") from None


@contextmanager
def listening_service(
    host: str, port: int, *, with_token: bool, **choices: Any
) -> Iterator[tuple[ServiceSettings, socket.socket]]:
    """Yield the settings of a service and its listening socket; other ``choices`` are those of ``ServiceSettings``.

    Raises
    ------
    MissingDependencyError
        A package of the extra ``serve`` is missing.
    ConfigError
        The address cannot be used.
    """
    require_service("serve")
    from houseexpo.service.service import ServiceSettings, is_any_address, is_loopback

    token = "" if is_loopback(host) and not with_token else secrets.token_urlsafe(_TOKEN_BYTES)
    with _listening_socket(host, port) as listening:
        names = (socket.gethostname(),) if is_any_address(host) else ()
        yield ServiceSettings(host, listening.getsockname()[1], names, token=token, **choices), listening


def announce(service: Service) -> None:
    """Say what a service shows, and where the decisions of a review go."""
    for shown in service.collections.values():
        typer.echo(f"{shown.name}: {count_noun(len(shown.now.views.table), 'plan')}")
        if service.settings.review:
            typer.echo(f"decisions go to {_check_decisions(shown.path)}")


def _check_policies(names: Sequence[str]) -> dict[str, str]:
    """Return policies by the names of drivers, their last folder and file, so that the page shows no paths."""
    from houseexpo.errors import ConfigError
    from houseexpo.pseudoslam.agents.loading import load_policy
    from houseexpo.pseudoslam.ros.policy_driver import check_interface

    found: dict[str, str] = {}
    for name in names:
        check_interface(load_policy(name))
        shown = "/".join(Path(name).parts[-2:])
        if shown in found:
            raise ConfigError(f"--policy: {found[shown]} and {name} would both be called {shown}; rename a folder")
        found[shown] = name
    return found


def browser_address(settings: ServiceSettings, path: str = "") -> str:
    """Return the address to open in a browser, with the token if there is one; ``path`` is that of a page."""
    host = f"[{settings.host}]" if ":" in settings.host else settings.host
    host = settings.names[0] if settings.names else host
    return f"http://{host}:{settings.port}/{path}" + (f"?token={settings.token}" if settings.token else "")


def _check_decisions(dataset: Path) -> Path:
    """Return the file for decisions on a data set; raise ConfigError if it is not writable."""
    from houseexpo.dataset.store.folders import overrides_path
    from houseexpo.service.review.decisions import DecisionStore

    decisions = DecisionStore(overrides_path(dataset))
    decisions.check()
    return decisions.file


def _published_data_set() -> Path:
    from houseexpo.commands.arguments import open_data_set

    return open_data_set(None).path


def _listening_socket(host: str, port: int) -> socket.socket:
    """Return a listening socket before data sets are opened, so that a port in use is reported and browsers wait."""
    from houseexpo.errors import ConfigError

    with ExitStack() as undone:
        try:
            family, _, _, _, where = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0]
            found = undone.enter_context(socket.socket(family, socket.SOCK_STREAM))
            found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            found.bind(where)
            found.listen(_QUEUE)  # with SO_REUSEADDR two sockets may be bound, but only one can listen
        except (OSError, UnicodeError) as error:  # UnicodeError: an invalid host name
            what = getattr(error, "strerror", None) or str(error)
            refusal = f"serve: cannot listen on {host}:{port} ({what}); choose another --port or --host"
            raise ConfigError(refusal) from None
        undone.pop_all()
    return found


def run_service(service: Service, listening: socket.socket) -> None:
    """Run a service on a listening socket until it is interrupted."""
    import uvicorn

    from houseexpo.service.app import make_app
    from houseexpo.service.guard import LimitedProtocol

    limits = service.settings.limits
    config = uvicorn.Config(
        make_app(service),
        http=LimitedProtocol,
        log_level="warning",
        access_log=False,
        backlog=_QUEUE,
        server_header=False,
        ws="websockets-sansio",
        ws_max_size=limits.message_bytes,
        ws_max_queue=8,
        timeout_graceful_shutdown=2,
        proxy_headers=False,
    )
    uvicorn.Server(config).run(sockets=[listening])
