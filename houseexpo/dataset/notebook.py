"""Show a data set as HTML in a notebook: counts, pictures of its first six plans, and a table of its first five."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import Any, Final

from houseexpo.words import count_noun

PICTURES: Final = 6
ROWS: Final = 5
_COLUMNS: Final = {
    "id": "id",
    "rooms": "rooms",
    "source_rooms": "rooms in the source",
    "area": "area, m²",
    "doors": "doors",
    "quality": "quality",
    "source": "source",
}


def dataset_html(plans: Any) -> str:
    """Return the HTML of a ``Dataset``; this reads six plans for their pictures."""
    from houseexpo.drawing import svg

    parts = [f"<p><b>{escape(plans.path.name)}</b>: {escape(_counts(plans))}</p>"]
    pictures = (
        f'<div style="margin: 4px">{svg(plan, size=160)}<div style="font-size: 80%; text-align: center">'
        f"{count_noun(len(plan.rooms), 'room')}, {plan.area:.0f} m²</div></div>"
        for plan in (each.divided for each in plans[:PICTURES])
    )
    parts.append(f'<div style="display: flex; flex-wrap: wrap">{"".join(pictures)}</div>')
    if len(plans):
        parts.append(_table(plans))
    return "\n".join(parts)


def _counts(plans: Any) -> str:
    """Return a line with the number of plans, their sizes, and the lists that come with them."""
    if not len(plans):
        return "no plans"
    areas, known = sorted(plans.column("area")), plans.column("rooms", compute=False)
    rooms = sorted(plans.column("source_rooms") if None in known else known)
    where = " in the source" if None in known else ""
    said = [
        count_noun(len(plans), "plan"),
        f"{_range(rooms, '{:.0f}')} rooms{where}, {_middle(rooms):.0f} in the median",
        f"{_range(areas, '{:.0f}')} m², {_middle(areas):.0f} in the median",
    ]
    if plans.splits:
        said.append("lists: " + ", ".join(f"{name} {len(ids):,}" for name, ids in sorted(plans.splits.items())))
    return "; ".join(said)


def _table(plans: Any) -> str:
    some = plans[:ROWS]
    columns = {name: some.column(name, compute=False) for name in _COLUMNS}
    shown = [name for name, values in columns.items() if any(value is not None for value in values)]
    head = "".join(f"<th>{escape(_COLUMNS[name])}</th>" for name in shown)
    rows = "".join(
        "<tr>" + "".join(f"<td>{escape(_cell(columns[name][row]))}</td>" for name in shown) + "</tr>"
        for row in range(len(some))
    )
    more = f"<p>{len(plans) - len(some):,} more</p>" if len(plans) > len(some) else ""
    return f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>{more}"


def _cell(value: Any) -> str:
    if value is None:
        return ""
    return f"{value:.2f}" if isinstance(value, float) else str(value)


def _range(values: Sequence[float], form: str) -> str:
    low, high = form.format(values[0]), form.format(values[-1])
    return low if low == high else f"{low} to {high}"


def _middle(values: Sequence[float]) -> float:
    return (values[(len(values) - 1) // 2] + values[len(values) // 2]) / 2
