"""Open a data set of a service (``houseexpo serve``): fetch its index at once, and each plan when it is accessed.

R1  The index is cached with its tag, and fetched again only if it has changed.
R2  Plans are cached under the SHA-1 of their bytes, which the index states. Received plans are verified with it. A plan
    that two services share is fetched once.
R3  Nothing else is requested, and no other server is contacted: redirections are refused.
"""

from __future__ import annotations

import hashlib
import re
import threading
from collections import Counter
from functools import cached_property
from pathlib import Path
from typing import Any, Final, NamedTuple
from urllib.parse import parse_qsl, quote, unquote, urlsplit

import msgspec
import pyarrow as pa
import pyarrow.parquet as pq

from houseexpo.dataset.index import SCHEMA, with_current_columns
from houseexpo.dataset.store.catalogue import Catalogue, parse_id_list
from houseexpo.dataset.store.stored_plans import MAX_PLAN_BYTES, BrokenPlan
from houseexpo.errors import DatasetError
from houseexpo.files import cache_folder, write_atomically
from houseexpo.plan import checks

_COLUMNS: Final = pa.schema([*SCHEMA, ("digest", pa.string())])
_INDEX_BYTES: Final = 1 << 30
_TIMEOUT_S: Final = 60.0
"""The longest time between two bytes, seconds."""
_PART_BYTES: Final = 1 << 16
_DIGEST: Final = re.compile("[0-9a-f]{40}")


class _Answer(NamedTuple):
    status: int
    data: bytes
    tag: str


class _About(msgspec.Struct):
    splits: dict[str, int] = {}


def open_remote(address: str) -> RemoteCatalogue:
    """Open a data set of a service: ``http://host:8000/demo``, with ``?token=`` if the service needs one.

    Raises
    ------
    DatasetError
        The server does not answer, has no such data set, or sends an invalid index.
    """
    server = _Server(address)
    folder = cache_folder("remote", hashlib.sha256(server.plain.encode()).hexdigest()[:16], server.name)
    index, tag = folder / "index.parquet", folder / "index.tag"
    known = tag.read_text(errors="replace") if index.exists() and tag.exists() else ""
    found = server.get("/index.parquet", _INDEX_BYTES, known)
    if found.status != 304:  # R1
        write_atomically(index, found.data)
        write_atomically(tag, found.tag.encode())
    try:
        table = with_current_columns(pq.read_table(index)).select(_COLUMNS.names).cast(_COLUMNS)
        for name, digest in zip(table.column("id").to_pylist(), table.column("digest").to_pylist(), strict=True):
            checks.check_plan_id(name)
            if not _DIGEST.fullmatch(digest or ""):
                raise DatasetError(f"{server.plain}: {name}: expected the SHA-1 of the plan, found {digest!r}")
        names = table.column("id").to_pylist()
        if len(set(names)) < len(names):
            twice = next(name for name, count in Counter(names).items() if count > 1)
            tag.unlink(missing_ok=True)
            raise DatasetError(f"{server.plain}: expected ids that differ, found {twice!r} more than once")
    except (pa.ArrowException, OSError, KeyError) as error:
        tag.unlink(missing_ok=True)
        raise DatasetError(f"{server.plain}: expected the index of a data set, found {error}") from None
    return RemoteCatalogue(address, server, folder, table)


class RemoteCatalogue(Catalogue):
    """The contents of a service's data set without its plans; ``path`` is the folder of the cached copies."""

    def __init__(self, address: str, server: _Server, folder: Path, table: Any) -> None:
        super().__init__(folder, table, None)
        self._address, self._server = address, server
        self._digests: list[str] = table.column("digest").to_pylist()

    @property
    def display_name(self) -> str:
        """The address without the token."""
        return self._server.plain

    @property
    def address(self) -> str:
        """The address that opens the same data set again."""
        return self._address

    def read(self, row: int) -> bytes:
        """Return the bytes of a plan's JSON; fetch them if they are not cached."""
        digest, name = self._digests[row], self.ids[row]
        kept = cache_folder("remote", "plans", digest[:2]) / digest
        if kept.exists() and _sha1(data := kept.read_bytes()) == digest:
            return data
        data = self._server.get(f"/plans/{quote(name, safe='')}", MAX_PLAN_BYTES).data
        if _sha1(data) != digest:  # R2
            raise DatasetError(f"{self._server.plain}: {name}: was changed on the server; open the data set again")
        write_atomically(kept, data)
        return data

    def stages(self, row: int) -> bytes | None:
        """Return the picture of the pipeline's stages for a plan, fetched each time; None if it does not exist."""
        place = f"/plans/{quote(self.ids[row], safe='')}/stages.png"
        found = self._server.get(place, MAX_PLAN_BYTES, fine=(200, 404))
        return found.data if found.status == 200 else None

    @property
    def left_out(self) -> tuple[BrokenPlan, ...]:
        """The plans that cannot be read: the server has left them out."""
        return ()

    @cached_property
    def lists(self) -> dict[str, tuple[str, ...]]:
        """The lists of ids that come with the data set."""
        try:
            about = msgspec.json.decode(self._server.get("", _INDEX_BYTES).data, type=_About)
        except msgspec.DecodeError as error:
            raise DatasetError(f"{self._server.plain}: expected the description of a data set, found {error}") from None
        return {
            name: parse_id_list(
                self._server.get(f"/splits/{quote(name, safe='')}", _INDEX_BYTES).data, f"list {name!r}"
            )
            for name in about.splits
        }


class _Server:
    """The part of a service that offers one data set; each thread has its own connection."""

    def __init__(self, address: str) -> None:
        try:
            parts = urlsplit(address)
            host, _ = parts.hostname or "", parts.port  # reading the port checks it
        except ValueError as error:
            raise DatasetError(f"{address}: expected an address such as http://host:8000/demo ({error})") from None
        names = [part for part in parts.path.split("/") if part]
        if not host or len(names) != 1:
            raise DatasetError(
                f"{address}: expected an address such as http://host:8000/demo, with the data set's name"
            )
        self.name = checks.check_plan_id(unquote(names[0]))
        self.plain = f"{parts.scheme}://{parts.netloc.rpartition('@')[2]}/{names[0]}"
        query = dict(parse_qsl(parts.query))
        self._token = query.pop("token", "")
        if query:
            raise DatasetError(
                f"{self.plain}: expected the address of a data set, found a filter behind it ({next(iter(query))}); "
                "open it without, and choose plans with select"
            )
        self._root = f"{parts.scheme}://{parts.netloc.rpartition('@')[2]}/api/{quote(self.name, safe='')}"
        self._own = threading.local()

    def get(self, path: str, most_bytes: int, tag: str = "", fine: tuple[int, ...] = (200, 304)) -> _Answer:
        """Request ``/api/NAME`` and a path below it; raise DatasetError unless the status is one of ``fine``."""
        import requests

        headers = {"if-none-match": tag} if tag else {}
        headers |= {"authorization": f"Bearer {self._token}"} if self._token else {}
        size, parts = 0, list[bytes]()
        try:
            with self._session.get(
                f"{self._root}{path}", headers=headers, timeout=_TIMEOUT_S, allow_redirects=False, stream=True
            ) as answer:
                for part in answer.iter_content(_PART_BYTES):
                    parts.append(part)
                    size += len(part)
                    if size > most_bytes:
                        raise DatasetError(f"{self.plain}{path}: expected at most {most_bytes:,} bytes, found more")
        except requests.RequestException as error:
            what = type(error).__name__
            raise DatasetError(f"{self.plain}: no answer ({what}); is houseexpo serve running there?") from None
        found = _Answer(answer.status_code, b"".join(parts), answer.headers.get("etag", ""))
        if found.status not in fine:
            raise DatasetError(f"{self.plain}{path}: {_reason(found)}")
        return found

    @property
    def _session(self) -> Any:
        """The connection of this thread, without proxies and other settings of the environment (R3)."""
        import requests

        if not hasattr(self._own, "session"):
            self._own.session = requests.Session()
            self._own.session.trust_env = False
            self._own.session.headers = {"accept": "application/json", "accept-encoding": "identity"}
        return self._own.session


def _reason(found: _Answer) -> str:
    try:
        said = msgspec.json.decode(found.data, type=dict[str, str]).get("error", "")
    except msgspec.DecodeError:
        said = ""
    return said or f"the server answered with status {found.status}"


def _sha1(data: bytes) -> str:
    return hashlib.sha1(data, usedforsecurity=False).hexdigest()
