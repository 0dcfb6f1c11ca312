"""Convert ROS messages to CycloneDDS's types and to CDR, the bytes that DDS carries, and back.

A request and an answer of a service are messages too: ``std_srvs/srv/Empty_Request``, ``std_srvs/srv/Empty_Response``.
"""

from __future__ import annotations

import re
import types
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, Final

import numpy as np

from houseexpo.pseudoslam.io.ros_messages import FIELDS, Fields, Message

_NUMBERS: Final = ("int8", "uint8", "uint16", "int32", "uint32", "int64", "uint64", "float32", "float64")
_PLAIN: Final = {"bool": bool, "string": str}


def encode_message(message: Message) -> bytes:
    """Return a message in CDR, version 1, with its header of 4 bytes."""
    found: bytes = dds_struct(message.type, message.fields).serialize(use_version_2=False)
    return found


def decode_message(kind: str, data: bytes) -> Fields:
    """Return the fields of a message in CDR.

    Raises
    ------
    ValueError
        The bytes are no such message.
    """
    try:
        return message_fields(kind, dds_type(kind).deserialize(data))
    except Exception as error:  # CycloneDDS raises what its parts raise
        raise ValueError(f"no {kind}: {error}") from error


@cache
def dds_type(kind: str) -> Any:
    """Return CycloneDDS's type of a ROS type: a final struct with the mapped name, which keeps ``msg`` or ``srv``."""
    from cyclonedds.idl import IdlStruct
    from cyclonedds.idl.annotations import final

    package, part, name = kind.split("/")
    fields = {field: _field_type(of) for field, of in FIELDS[kind].items()}

    def fill(namespace: dict[str, Any]) -> None:
        namespace["__annotations__"] = fields
        namespace["__module__"] = __name__

    made = types.new_class(name, (IdlStruct,), {"typename": f"{package}::{part}::dds_::{name}_"}, fill)
    return final(dataclass(made))


def _field_type(kind: str) -> Any:
    from cyclonedds.idl import types as idl

    if found := re.fullmatch(r"(.+)\[(\d*)\]", kind):
        inner, size = _field_type(found[1]), found[2]
        return idl.array[inner, int(size)] if size else idl.sequence[inner]
    return getattr(idl, kind) if kind in _NUMBERS else _PLAIN.get(kind) or dds_type(kind)


def dds_struct(kind: str, fields: Mapping[str, Any]) -> Any:
    """Return a message as CycloneDDS's type."""
    return dds_type(kind)(**{name: _value(FIELDS[kind][name], value) for name, value in fields.items()})


def _value(kind: str, value: Any) -> Any:
    if isinstance(value, Mapping):
        return dds_struct(kind, value)
    if isinstance(value, np.ndarray):
        return value.tolist()
    return [_value(kind.removesuffix("[]"), one) for one in value] if isinstance(value, list) else value


def message_fields(kind: str, sample: Any) -> Fields:
    """Return the fields of a message of CycloneDDS; lists stay lists."""
    return {name: _plain(of, getattr(sample, name)) for name, of in FIELDS[kind].items()}


def _plain(kind: str, value: Any) -> Any:
    if kind in FIELDS:
        return message_fields(kind, value)
    return [_plain(kind.removesuffix("[]"), one) for one in value] if kind.removesuffix("[]") in FIELDS else value
