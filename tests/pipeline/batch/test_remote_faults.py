"""What goes wrong with an object store: passing faults, and what a person has to set."""

from __future__ import annotations

import errno

import pytest

from houseexpo.errors import ConfigError, find_transient_fault
from pipeline.batch.result_store import translate_store_errors


class NoCredentialsError(Exception):
    """As botocore calls it."""


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (NoCredentialsError("Unable to locate credentials"), "no credentials for this store were found; set them"),
        (PermissionError(errno.EACCES, "Access Denied"), "the store refuses it .*; check the credentials"),
    ],
)
def test_who_may_not_is_told_what_to_set(error: Exception, said: str) -> None:
    with pytest.raises(ConfigError, match=said) as raised, translate_store_errors("s3://bucket/plans"):
        raise error
    assert find_transient_fault(raised.value) is None


def test_a_dropped_connection_passes() -> None:
    with (
        pytest.raises(OSError, match="s3://bucket/plans: RuntimeError: dropped") as raised,
        translate_store_errors("s3://bucket/plans"),
    ):
        raise RuntimeError("dropped")
    assert find_transient_fault(raised.value) is not None
