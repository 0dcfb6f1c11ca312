"""Format compared results as text: the heads and cells of tables, and pages in Markdown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from houseexpo.pseudoslam.benchmark.comparison import ComparisonRow, TrackComparison
from houseexpo.pseudoslam.benchmark.measures import Metric
from houseexpo.pseudoslam.benchmark.statistics import Estimate

HEADING: Final = "Policies compared"
ABOUT: Final = (
    "Means over plans, with 95% intervals by bootstrap over plans; shares are per cent. Ways and steps to a share are "
    "means over the plans in which it was reached. Trainings of one policy with several seeds are one row: means over "
    "seeds and plans, and intervals by bootstrap over both. A difference is taken plan by plan. "
    "Its p-value is that of a randomisation test by change of signs, corrected for the number of rows (Holm). A star: "
    "the policy sees the truth. The time is the median of what the policy took where it decided anew, on the machine "
    "and under the load that the result names. Verified: the actions in the result were played again, and gave its "
    "values."
)


def table_heads(metrics: Sequence[Metric]) -> list[str]:
    """Return the heads of a table's columns, including the policy and its time."""
    return ["policy", *(f"{metric.title}{_unit(metric)}" for metric in metrics), "ms a decision", "verified"]


def table_row(compared: TrackComparison, entry: ComparisonRow, metrics: Sequence[Metric]) -> list[str]:
    """Return the cells of a row."""
    median = entry.decision_ms
    values = [format_cell(metric, compared.value(entry, metric)) for metric in metrics]
    verified = "yes" if entry.verified else "no" if entry.results[0].policy.sha256 else "-"
    return [row_title(entry), *values, "-" if median is None else f"{median:.2g}", verified]


def row_title(entry: ComparisonRow) -> str:
    """Return the title of a row, with a star for policies that see the truth."""
    return f"{entry.name}{' *' if entry.sees_truth else ''}"


def format_cell(metric: Metric, value: Estimate) -> str:
    """Return a mean with its interval, or "-" if no plan has a value."""
    if value.mean is None or value.low is None or value.high is None:
        return "-"
    if metric.unit == "p":
        return "< 0.001" if value.mean < 0.001 else f"{value.mean:.3f}"
    scale = 100 if metric.unit == "%" else 1
    mean, low, high = (scale * each for each in (value.mean, value.low, value.high))
    digits = 0 if abs(mean) >= 100 and metric.unit != "%" else 1 if abs(mean) >= 10 or metric.unit == "%" else 2
    sign = "+" if metric.title.startswith("less ") else ""
    return f"{mean:{sign}.{digits}f} [{low:{sign}.{digits}f}, {high:{sign}.{digits}f}]"


INTERVAL_HEADS: Final = ["best possible", "bound", "best of all rows, plan by plan", "plans"]
"""The heads of the table of ``TrackComparison.intervals``."""


def format_interval_rows(compared: TrackComparison) -> list[list[str]]:
    """Return the rows of a table of the intervals of the best possible values; none without a result of bounds."""
    found = []
    for interval in compared.intervals():
        metric, scale = interval.metric, 100 if interval.metric.unit == "%" else 1
        digits = 1 if scale * max(interval.bound, interval.known) >= 10 else 2
        values = [f"{scale * value:.{digits}f}" for value in (interval.bound, interval.known)]
        found.append([f"{metric.title}{_unit(metric)}", *values, f"{interval.plans}"])
    return found


def format_markdown(
    all_compared: Sequence[TrackComparison],
    heading: str = HEADING,
    pictures: Mapping[tuple[str, str], str] | None = None,
    of_maps: Mapping[str, Sequence[tuple[str, str]]] | None = None,
) -> str:
    """Return tables for each track under headings.

    Parameters
    ----------
    pictures
        Links to curves, by track and horizontal axis.
    of_maps
        Texts on and links to the curves on each map, by track.
    """
    lines = [f"# {heading}", ABOUT, ""]
    for compared in all_compared:
        lines += _section(compared, pictures or {})
        for about, link in (of_maps or {}).get(compared.track.id, ()):
            lines += [f"{about}", "", f"![Coverage over metres, map by map]({link})", ""]
    return "\n".join(lines).rstrip() + "\n"


def describe_plans(compared: TrackComparison) -> str:
    """Return a line on the plans of the results."""
    plans = compared.entries[0].results[0].plans
    where = f"{plans.number} plans of list {plans.split}" if plans.content_sha256 else f"{plans.number} episodes"
    return f"{where}; ids {plans.ids_sha256[:12]}, content {plans.content_sha256[:12] or 'the room'}"


def _section(compared: TrackComparison, pictures: Mapping[tuple[str, str], str]) -> list[str]:
    lines = [f"## {compared.track.id}", f"{compared.track.about} {describe_plans(compared)}.", ""]
    for over, _ in compared.track.curves:
        if (compared.track.id, over) in pictures:
            lines += [f"![Coverage over {over}]({pictures[compared.track.id, over]})", ""]
    for metrics in compared.tables():
        rows = [table_row(compared, entry, metrics) for entry in compared.rows(metrics)]
        lines += [*markdown_table(table_heads(metrics), rows), ""]
    if rows := format_interval_rows(compared):
        lines += [*markdown_table(INTERVAL_HEADS, rows), ""]
    return lines


def markdown_table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Return the lines of a table in Markdown, whose columns but the first are aligned to the right."""
    return [f"| {' | '.join(cells)} |" for cells in (heads, ["---", *["---:"] * (len(heads) - 1)], *rows)]


def _unit(metric: Metric) -> str:
    return f", {metric.unit}" if metric.unit == "m" and "metres" not in metric.title else ""
