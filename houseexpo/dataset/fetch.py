"""Download the published data set, verify it, and unpack it for ``open_dataset``."""

from __future__ import annotations

import hashlib
import logging
import shutil
import tarfile
from collections.abc import Callable, Container, Iterable, Iterator
from pathlib import Path, PurePosixPath
from typing import Any, Final, Literal, get_args

from houseexpo.dataset.manifest import DownloadFile, DownloadManifest, load_manifest
from houseexpo.dataset.store.stored_plans import damage_as_dataset_error
from houseexpo.errors import ConfigError, DatasetError
from houseexpo.files import atomic_folder, cache_folder

Subset = Literal["10", "100", "1000", "all"]
Progress = Callable[[str, int, int], None]
"""A function of the name of the download, the bytes received so far and the total bytes (0 if unknown)."""

_SUBSETS: Final = get_args(Subset)
_RETRIES: Final = 3
_PART_BYTES: Final = 1 << 16
_SILENCE_S: Final = 30.0
_MAX_BYTES: Final = 2 * 2**30


def fetch(
    subset: Subset | int = "all", *, manifest: DownloadManifest | None = None, progress: Progress | None = None
) -> Path:
    """Download the published data set into the user's cache folder, once, and return the folder to open.

    1. An interrupted download is kept and resumed, up to three times in this call and again in the next one.
    2. The download is deleted unless it has the git blob id that the manifest states.
    3. ``subset`` "10" is the authors' own demonstration. "100" and "1000" contain these ten and the plans whose ids
       have the smallest SHA-256. Each subset is therefore part of every larger one, and is the same on all machines.
    4. The folder appears only when it is complete.

    Parameters
    ----------
    subset
        The number of plans: "10", "100", "1000" or "all"; the number may be an int.
    manifest
        The files to download, their addresses and their hashes; by default, those of the published data set.
    progress
        Called during the download with the file's name, the bytes received so far and the total bytes (0 if unknown).

    Returns
    -------
    The folder, for ``open_dataset``.

    Raises
    ------
    ConfigError
        ``subset`` has another value.
    DatasetError
        The server cannot be reached or sends other data; the message says what to do.

    Examples
    --------
    >>> import houseexpo
    >>> plans = houseexpo.open_dataset(houseexpo.fetch("10"))  # doctest: +SKIP
    """
    published = load_manifest() if manifest is None else manifest
    size = str(subset)
    if size not in _SUBSETS:
        raise ConfigError(f"fetch: subset: expected one of {', '.join(_SUBSETS)}; found {size[:40]!r}")
    target = subset_folder(size, published)
    if target.is_dir():
        return target
    downloads = cache_folder("downloads")
    archive = download(published.archive, downloads, progress)
    lists = [download(source, downloads, progress) for source in published.lists]
    ids = None if size == "all" else _ids(archive, int(size), published.subsets.get("demo", ()))
    if not target.is_dir():  # another process may have created it meanwhile
        _unpack(archive, target, ids, lists)
    return target


def subset_folder(subset: str, manifest: DownloadManifest | None = None) -> Path:
    """Return the cache folder of a subset; it need not have been fetched."""
    published = load_manifest() if manifest is None else manifest
    return cache_folder("data", f"{published.name.lower()}-{published.archive.git_blob[:12]}") / subset


def download(source: DownloadFile, folder: Path, progress: Progress | None = None) -> Path:
    """Download a file into ``folder`` unless it is there, verify it and return its path (R1, R2 of ``fetch``)."""
    import pooch
    import requests

    file = folder / source.file
    if file.exists() and git_blob_id(file) != source.git_blob:
        file.unlink()
    store = pooch.create(
        path=folder, base_url="", registry={source.file: None}, urls={source.file: source.url}, retry_if_failed=_RETRIES
    )
    logger = pooch.get_logger()
    level = logger.level
    logger.setLevel(logging.ERROR)  # it reports retries on standard error
    try:
        store.fetch(source.file, downloader=_Resuming(source, folder, progress))
    except (requests.RequestException, ValueError) as error:
        raise DatasetError(
            f"{source.url}: expected {source.file} with git blob id {source.git_blob}; {_describe_error(error)}. "
            "Check the connection and run the same command again: what is here already is kept"
        ) from None
    finally:
        logger.setLevel(level)
    return file


def _describe_error(error: Exception) -> str:
    """Return a short description of a network error, without the libraries' own wording."""
    import requests

    if isinstance(error, requests.exceptions.ProxyError):
        return "the proxy cannot be reached"
    if isinstance(error, requests.exceptions.SSLError):
        return "the connection is not safe: the server's certificate is not accepted"
    if isinstance(error, requests.Timeout):
        return f"the server said nothing for {_SILENCE_S:.0f} s"
    if isinstance(error, requests.ConnectionError):
        return "the server cannot be reached, or the connection broke"
    return str(error)


def git_blob_id(file: Path) -> str:
    """Return a file's git blob id: the hexadecimal SHA-1 of ``blob <size>``, a zero byte and its bytes."""
    digest = hashlib.sha1(b"blob %d\0" % file.stat().st_size, usedforsecurity=False)
    with file.open("rb") as stream:
        while data := stream.read(_PART_BYTES):
            digest.update(data)
    return digest.hexdigest()


class _Resuming:
    """A downloader for pooch that keeps an interrupted download beside the file and requests only the rest."""

    def __init__(self, source: DownloadFile, folder: Path, progress: Progress | None) -> None:
        self._source, self._progress = source, progress
        self._partial = folder / f"{source.git_blob}.partial"

    def __call__(self, url: str, output_file: str, pooch: Any, *, check_only: bool = False) -> None:  # noqa: ARG002
        self._receive(url)
        if (found := git_blob_id(self._partial)) != self._source.git_blob:
            self._partial.unlink()
            raise ValueError(f"found one with {found}, which was thrown away")
        Path(output_file).write_bytes(b"")
        self._partial.replace(output_file)

    def _receive(self, url: str) -> None:
        import requests

        have = self._partial.stat().st_size if self._partial.exists() else 0
        headers = {"Accept-Encoding": "identity"} | ({"Range": f"bytes={have}-"} if have else {})
        with requests.get(url, headers=headers, stream=True, timeout=_SILENCE_S) as answer:
            if answer.status_code == requests.codes.requested_range_not_satisfiable:
                return  # the download is complete; the blob id verifies it
            answer.raise_for_status()
            resumed = answer.headers.get("Content-Range", "").startswith(f"bytes {have}-")
            if not (have and answer.status_code == requests.codes.partial_content and resumed):
                have = 0
            start, length = have, int(answer.headers.get("Content-Length") or 0)
            with self._partial.open("ab" if have else "wb") as stream:
                for data in answer.iter_content(_PART_BYTES):
                    stream.write(data)
                    have += len(data)
                    if self._progress is not None:
                        self._progress(self._source.file, have, start + length if length else 0)
                    if have > _MAX_BYTES:
                        raise ValueError(f"found more than {_MAX_BYTES} bytes")


def _unpack(archive: Path, target: Path, ids: Container[str] | None, beside: Iterable[Path]) -> None:
    """Write the plans of an archive with these ids (None: all), and copies of files beside it, to a new folder (R4).

    The manifest vouches for what is in the archive, since the download has its blob id. Of names, only the last part
    counts.
    """
    with atomic_folder(target) as folder:
        plans = folder / "json"
        plans.mkdir()
        with damage_as_dataset_error(archive), tarfile.open(archive) as tar:
            for member in _plan_members(tar):
                content, name = tar.extractfile(member), PurePosixPath(member.name)
                if content is not None and (ids is None or name.stem in ids):
                    (plans / name.name).write_bytes(content.read())
        for file in beside:
            shutil.copyfile(file, folder / file.name)


def _ids(archive: Path, count: int, first: Iterable[str]) -> frozenset[str]:
    """Return the ids of a subset (R3)."""
    with damage_as_dataset_error(archive), tarfile.open(archive) as tar:
        known = {PurePosixPath(member.name).stem for member in _plan_members(tar)}
    chosen = [name for name in first if name in known]
    rest = sorted(known.difference(chosen), key=lambda name: hashlib.sha256(name.encode()).digest())
    return frozenset([*chosen, *rest][:count])


def _plan_members(tar: tarfile.TarFile) -> Iterator[tarfile.TarInfo]:
    return (member for member in tar if member.isfile() and member.name.endswith(".json"))
