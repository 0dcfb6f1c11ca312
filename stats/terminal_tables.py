"""Turn a report into tables for the terminal, with the same numbers as the HTML page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from rich.table import Table

from houseexpo.analysis.audit import RULES
from houseexpo.commands.printing import new_table
from houseexpo.words import count_noun
from stats.audit import CITED, PUBLIC, AuditSummary
from stats.measure import DataSetSummary
from stats.record import MEASURES
from stats.report import DIFFERENCE, Distance, Report, audited_data_sets, count_leaks
from stats.summary import PlanSummary

_BAR = 24


def report_tables(report: Report) -> Iterator[Table]:
    """Yield the tables of a report, the most important first."""
    yield numbers_table(report.one)
    if report.one.whole.labels:
        yield bars_table("Labels", report.one.whole.labels)
    if report.one.whole.door_kinds:
        yield bars_table("Doors", report.one.whole.door_kinds)
    yield navigability_table(report.one.whole)
    yield ring_faults_table(report.one.whole)
    if report.one.whole.audit.plans:
        yield home_rules_table(report.one.whole.audit)
        yield public_sets_table(report)
    if report.one.splits:
        yield splits_table(report.one)
    if report.other is not None:
        yield comparison_table(report)


def format_quantity(value: float, unit: str = "") -> str:
    """Format a number with thousands separators and at most two decimals, without trailing zeros."""
    text = f"{value:,.2f}".rstrip("0").rstrip(".") if value != int(value) else f"{int(value):,}"
    return f"{text} {unit}".rstrip()


def format_mean(value: float | None, distance: Distance) -> str:
    """Format a mean or a share of a distance, "" for neither."""
    if value is None:
        return ""
    return f"{value:.2%}" if distance.kind == DIFFERENCE else format_quantity(value)


def numbers_table(gathered: DataSetSummary) -> Table:
    """Show mean, median and extremes of each measure that the plans have."""
    columns = ("total", "mean", "median", "5%", "95%", "min", "max")
    table = _table(f"{gathered.name}: {count_noun(gathered.whole.plans, 'plan')}", "", *columns)
    for measure in MEASURES:
        found = gathered.whole.tallies[measure.key].report()
        if found["count"]:
            keys = ("mean", "median", "p05", "p95", "min", "max")
            name = f"{measure.title}, {measure.unit}" if measure.unit else measure.title
            table.add_row(name, format_quantity(found["sum"]), *(format_quantity(found[key]) for key in keys))
    return table


def bars_table(title: str, counts: Mapping[str, int]) -> Table:
    """Show counts as bars, the largest first."""
    table = new_table(title, header=False)
    table.add_column(justify="right")
    table.add_column(justify="right")
    table.add_column(style="cyan")
    most = max(counts.values(), default=1)
    for label, count in sorted(counts.items(), key=lambda pair: (-pair[1], pair[0])):
        table.add_row(label, f"{count:,}", "█" * round(_BAR * count / most) or "▏")
    return table


def navigability_table(summary: PlanSummary) -> Table:
    """Show the navigability for several radii."""
    table = _table("What a robot reaches", "radius, m", "connected", "share", "narrowest, median")
    for radius, reach in sorted(summary.reach.items()):
        narrowest = format_quantity(reach.narrowest.quantile(0.5), "m") if reach.narrowest.count else "-"
        table.add_row(radius, f"{reach.connected:,}", f"{reach.connected_share:.2%}", narrowest)
    return table


def ring_faults_table(summary: PlanSummary) -> Table:
    """Show the faults of rings, and the number of repeated plans."""
    found = summary.rings.report()
    table = _table("Rings", "", "plans")
    table.add_row(
        "invalid", f"{found['invalid']:,} ({found['touching']:,} touch, {found['crossing']:,} cross themselves)"
    )
    table.add_row("exact repeats", f"{found['repeats']:,} (largest group {found['largest_group']:,})")
    table.add_row("repeats, turned or mirrored ones too", f"{found['repeats_turned_or_mirrored']:,}")
    return table


def home_rules_table(found: AuditSummary) -> Table:
    """Show how many plans break each rule of real homes."""
    table = _table(f"Rules of real homes, {count_noun(found.plans, 'plan')} with rooms", "", "plans", "share")
    for rule, title in RULES.items():
        table.add_row(title, f"{found.broken[rule]:,}", f"{found.broken[rule] / found.plans:.2%}")
    table.add_row("Any of the first six", f"{found.any:,}", f"{found.any_share:.2%}")
    return table


def public_sets_table(report: Report) -> Table:
    """Show the data set beside the public ones."""
    columns = ("plans", "rooms", "< area", "< width", "> aspect", "break a rule")
    table = _table("Beside public data sets (rooms below or above a limit: mean share in a plan)", "", *columns)
    for row in (*audited_data_sets(report), *PUBLIC):
        shares = ("-" if share is None else f"{share:.1%}" for share in (row.area, row.width, row.aspect, row.any))
        table.add_row(row.name, f"{row.plans:,}", f"{row.rooms:.1f}", *shares)
    table.caption = f"Source of the public figures: {CITED}"
    return table


def splits_table(gathered: DataSetSummary) -> Table:
    """Show the splits side by side."""
    counted = gathered.whole.room_measure
    columns = (
        "ids",
        "plans",
        f"{counted.title.lower()}, mean",
        "area, median",
        "connected at 0.20 m",
        "also elsewhere",
    )
    table = _table("Splits", "", *columns)
    repeated = count_leaks(gathered)
    for name, summary in sorted(gathered.splits.items()):
        area, reach = summary.tallies["area_m2"], summary.reach["0.20"]
        also = ", ".join(f"{n} in {other}" for other, n in repeated.get(name, {}).items() if n) or "-"
        table.add_row(
            name, f"{gathered.listed.get(name, summary.plans):,}", f"{summary.plans:,}",
            format_quantity(summary.tallies[counted.key].moments()[0]), format_quantity(area.quantile(0.5), "m²"),
            f"{reach.connected_share:.2%}", also,
        )  # fmt: skip
    return table


def comparison_table(report: Report) -> Table:
    """Show two data sets side by side."""
    other = report.other.name if report.other is not None else ""
    table = _table("Compared", "", report.one.name, other, "distance", "", "deviations")
    for d in report.distances:
        means = (format_mean(value, d) for value in (d.one, d.other))
        relative = "" if d.deviations is None else format_quantity(d.deviations)
        table.add_row(d.title, *means, format_quantity(round(d.value, 3), d.unit), d.kind, relative)
    return table


def _table(title: str, *headings: str) -> Table:
    table = new_table(title)
    for i, heading in enumerate(headings):
        table.add_column(heading, justify="right" if i else "left", style="" if i else "bold")
    return table
