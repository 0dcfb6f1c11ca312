"""Object stores by their URLs (``s3://bucket/plans``, ``gs://``, whatever fsspec knows), and their faults.

Who may do what is the business of the store's own settings: environment, configuration files, the machine's role.
"""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any, Final

from houseexpo.errors import ConfigError, MissingDependencyError, installing

_WITHOUT_CREDENTIALS: Final = frozenset(
    {"NoCredentialsError", "PartialCredentialsError", "DefaultCredentialsError", "TokenRetrievalError"}
)
"""Errors of libraries that need not be installed, by their names."""


def is_url(text: str) -> bool:
    """Tell a URL from a path."""
    return "://" in text


@cache
def opened(url: str) -> tuple[Any, str]:
    """Return the file system of a URL and the path in it, without a slash at its end.

    Raises
    ------
    ConfigError
        Where no file system is known by that name.
    MissingDependencyError
        Where its library is not installed.
    """
    try:
        from fsspec.core import url_to_fs
    except ImportError:
        raise MissingDependencyError(f"{url}: object stores need more: {installing('cloud')}") from None
    try:
        system, path = url_to_fs(url, use_listings_cache=False)
    except ImportError as error:
        raise MissingDependencyError(f"{url}: {error}: {installing('cloud')}") from None
    except ValueError as error:
        raise ConfigError(f"{url}: expected s3://..., gs://... or another URL that fsspec knows ({error})") from None
    return system, str(path).rstrip("/")


@contextmanager
def faults(url: str) -> Iterator[None]:
    """Turn errors of the store's library into transient faults.

    Who asks without credentials, or without the right to, is no transient fault: ConfigError says what to set.
    """
    try:
        yield
    except FileNotFoundError:
        raise
    except PermissionError as error:
        raise ConfigError(f"{url}: the store refuses it ({error}); check the credentials and their rights") from error
    except Exception as error:  # each library has errors of its own
        if type(error).__name__ in _WITHOUT_CREDENTIALS:
            advice = "set them as the store's own tools take them, such as AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY"
            raise ConfigError(f"{url}: no credentials for this store were found; {advice}") from error
        raise OSError(errno.EIO, f"{url}: {type(error).__name__}: {error}") from error
