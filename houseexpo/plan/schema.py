"""Generate the JSON Schema of a plan's file from the types that read it; the package contains a copy.

``python -m houseexpo.plan.schema`` updates the copy; a test compares the two.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import msgspec

from houseexpo.files import encode_json
from houseexpo.plan.json_codec import FORMAT, RECORDS

SHIPPED: Final = Path(__file__).with_name("houseexpo-2.schema.json")


def make_schema() -> dict[str, Any]:
    """Return the schema (draft 2020-12): a file with ``format`` is checked as ours, others as published ones.

    ``houseexpo.dataset.validation`` checks what a schema cannot express, such as whether doors name existing rooms.
    """
    (published, ours), parts = msgspec.json.schema_components(RECORDS, ref_template="#/$defs/{name}")
    parts["Plan"]["properties"]["format"] = {"const": FORMAT}
    parts["Quality"]["properties"]["score"] = {"type": "number", "minimum": 0, "maximum": 1}
    for name in ("Room", "Door"):
        parts[name]["properties"]["confidence"] = {"type": "number", "minimum": 0, "maximum": 1}
    for name in ("sill", "head"):
        parts["Window"]["properties"][name] = {"type": "number", "minimum": 0}
    parts["Object"]["properties"]["height"] = {"type": "number", "minimum": 0}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "A HouseExpo floor plan",
        "type": "object",
        "if": {"required": ["format"]},
        "then": ours,
        "else": published,
        "$defs": parts,
    }


def schema_bytes() -> bytes:
    """Return the bytes of the copy in the package."""
    return encode_json(make_schema())


if __name__ == "__main__":
    SHIPPED.write_bytes(schema_bytes())
