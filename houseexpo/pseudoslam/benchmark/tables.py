"""Compared results as text: cells, and pages in Markdown."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from houseexpo.pseudoslam.benchmark.comparison import Compared
from houseexpo.pseudoslam.benchmark.measures import Metric
from houseexpo.pseudoslam.benchmark.result import Result
from houseexpo.pseudoslam.benchmark.statistics import Estimate

HEADING: Final = "Policies compared"
ABOUT: Final = (
    "Means over plans, with 95% intervals by bootstrap over plans; shares are per cent. Ways and steps to a share are "
    "means over the plans in which it was reached. A star: the policy sees the truth. The time is the median of what "
    "the policy took where it decided anew, on the machine and under the load that the result names."
)


def heads(metrics: Sequence[Metric]) -> list[str]:
    """Return the heads of a table's columns, the policy and its time included."""
    return ["policy", *(f"{metric.title}{_unit(metric)}" for metric in metrics), "ms a decision"]


def row(compared: Compared, result: Result, metrics: Sequence[Metric]) -> list[str]:
    """Return the cells of a result."""
    median = result.times.decision_ms.get("median")
    values = [cell(metric, compared.value(result, metric)) for metric in metrics]
    return [title(result), *values, "-" if median is None else f"{median:.2g}"]


def title(result: Result) -> str:
    """Return what a result is called; a star is for policies that see the truth."""
    policy = result.policy
    seed = f", seed {policy.seed}" if policy.seed else ""
    return f"{policy.name}{seed}{' *' if policy.sees_truth else ''}"


def cell(metric: Metric, value: Estimate) -> str:
    """Return a mean with its interval; "-" where no plan has a value."""
    if value.mean is None or value.low is None or value.high is None:
        return "-"
    scale = 100 if metric.unit == "%" else 1
    mean, low, high = (scale * each for each in (value.mean, value.low, value.high))
    digits = 0 if abs(mean) >= 100 and metric.unit != "%" else 1 if abs(mean) >= 10 or metric.unit == "%" else 2
    return f"{mean:.{digits}f} [{low:.{digits}f}, {high:.{digits}f}]"


def markdown(all_compared: Sequence[Compared], heading: str = HEADING) -> str:
    """Return tables for each track, under headings."""
    lines = [f"# {heading}", ABOUT, ""]
    return "\n".join([*lines, *(line for compared in all_compared for line in _section(compared))]).rstrip() + "\n"


def facts(compared: Compared) -> str:
    """Return which plans results are of, in a line."""
    plans = compared.results[0].plans
    where = f"{plans.number} plans of list {plans.split}" if plans.content_sha256 else f"{plans.number} episodes"
    return f"{where}; ids {plans.ids_sha256[:12]}, content {plans.content_sha256[:12] or 'the room'}"


def _section(compared: Compared) -> list[str]:
    lines = [f"## {compared.track.id}", f"{compared.track.about} {facts(compared)}.", ""]
    for metrics in compared.tables():
        names = heads(metrics)
        lines += [_line(names), _line(["---", *["---:"] * (len(names) - 1)])]
        lines += [_line(row(compared, result, metrics)) for result in compared.results]
        lines.append("")
    return lines


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _unit(metric: Metric) -> str:
    return f", {metric.unit}" if metric.unit == "m" and "metres" not in metric.title else ""
