"""Errors of the JSON decoder in the project's wording."""

from __future__ import annotations

import re

import msgspec

from houseexpo.errors import PlanError

_AT = re.compile(r"^(?P<problem>.*?)(?: - at `\$\.?(?P<key>.*?)`)?$", re.DOTALL)
_ID = re.compile(r'"id"\s*:\s*"([^"\\]{1,200})"')


def explained(error: Exception, data: bytes | str) -> PlanError:
    """Return the error as a PlanError with the key, and with the plan's id if it can be read."""
    text = data if isinstance(data, str) else data.decode(errors="replace")
    name = _ID.search(text)
    plan = name.group(1) if name else ""
    if isinstance(error, msgspec.ValidationError):
        match = _AT.match(str(error))
        problem, key = (match["problem"], match["key"] or "") if match else (str(error), "")
        missing = re.search(r"missing required field `(\w+)`", problem)
        if missing:
            key = f"{key}.{missing[1]}".lstrip(".")
            problem = "expected this key, found none; the file is not a whole plan"
        return PlanError(problem[:1].lower() + problem[1:], key, plan)
    if isinstance(error, RecursionError):
        return PlanError("expected a plan, found lists nested too deeply", "", plan)
    return PlanError(
        f"expected one JSON object in UTF-8, found {len(text)} characters that are none: {error}", "", plan
    )
