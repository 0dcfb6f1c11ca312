"""Write a report as one self-contained HTML page (plots as vectors, numbers as tables, light and dark) or as JSON."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from houseexpo.analysis.audit import RULES
from houseexpo.analysis.measures import Measure
from houseexpo.errors import ConfigError
from houseexpo.files import encode_json, write_atomically
from houseexpo.tolerances import ROBOT_M
from stats import figures
from stats.audit import AuditSummary
from stats.public_sets import CITED, PUBLIC, SIZES
from stats.record import BY_KEY
from stats.report import Report, audited_data_sets, count_leaks
from stats.terminal_tables import format_mean, format_number

_CARD = (4.3, 2.7)
_WIDE = (5.0, 2.7)
_ROBOT = f"{ROBOT_M:.2f}"


@dataclass(frozen=True)
class MeasurePlot:
    """The plot of a measure with its texts; ``rows`` are the numbers below it."""

    title: str
    about: str
    svg: str
    rows: Sequence[tuple[str, str]] = ()


def report_html(report: Report) -> str:
    """Return the page."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("stats"), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters.update(number=format_number, mean=format_mean)
    return environment.get_template("report.html.j2").render(
        report=report,
        one=report.one,
        other=report.other,
        whole=report.one.whole,
        counted=report.one.whole.room_measure,
        rings=report.one.whole.rings.report(),
        rooms=_histogram(report, report.one.whole.room_measure.key, _WIDE),
        area=_histogram(report, "area_m2", _WIDE),
        labels=_labels(report),
        groups=[(title, plots) for title, names in _GROUPS if (plots := list(_plots(report, names)))],
        reach=list(_reach(report)),
        audit=report.one.whole.audit,
        rules=RULES,
        audited=audited_data_sets(report),
        public=PUBLIC,
        cited=CITED,
        sizes=list(_sizes(report.one.whole.audit)),
        leaks=count_leaks(report.one),
        distances=report.distances,
    )


_GROUPS = (
    ("Size", ("source_rooms", "long_side_m", "short_side_m", "vertices", "holes", "label_boxes")),
    (
        "Rooms and doors",
        ("room_area_m2", "doors", "door_width_m", "doors_per_room", "degree", "loops", "depth"),
    ),
)


def _histogram(report: Report, name: str, size: tuple[float, float] = _CARD) -> MeasurePlot:
    measure, tally = BY_KEY[name], report.one.whole.tallies[name]
    other = None if report.other is None else report.other.whole.tallies[name]
    found = tally.report()
    keys = {"mean": "mean", "median": "median", "5%": "p05", "95%": "p95", "min": "min", "max": "max"}
    rows = [(title, format_number(found[key], measure.unit)) for title, key in keys.items()]
    return MeasurePlot(measure.title, measure.about, figures.draw_histogram(measure, tally, other, size=size), rows)


def _plots(report: Report, names: Sequence[str]) -> Iterator[MeasurePlot]:
    """Yield a plot for each measure that the plans have and that is not equal for all of them."""
    for name in names:
        tally = report.one.whole.tallies[name]
        if len(tally.values()[0]) > 1:
            yield _histogram(report, name)


def _labels(report: Report) -> MeasurePlot | None:
    counts = report.one.whole.labels
    other = None if report.other is None else report.other.whole.labels
    if not counts and not other:
        return None
    about = "Rooms by label; where a plan has no rooms as geometry, its label boxes."
    return MeasurePlot("Labels", about, figures.draw_shares(counts, other, width=_WIDE[0]))


def _reach(report: Report) -> Iterator[MeasurePlot]:
    one, other = report.one.whole, None if report.other is None else report.other.whole
    rows = [(f"{radius} m", f"{reach.connected:,}") for radius, reach in sorted(one.reach.items())]
    about = "Share of the plans in which a round robot gets to every place that it fits into."
    drawing = figures.draw_reach(one.reach, None if other is None else other.reach, size=_CARD)
    yield MeasurePlot("Navigable plans", about, drawing, rows)
    here, there = (None if s is None else s.reach[_ROBOT].narrowest for s in (one, other))
    if here is not None and here.count:
        measure = Measure("narrowest", "Narrowest passage", lambda _: None, "m", here.step, here.bin_width)
        found = here.report()
        rows = [(key, format_number(found[key], "m")) for key in ("mean", "median", "min", "max")]
        about = f"That a robot of {_ROBOT} m radius has to take to get about; the width of a house of one space."
        yield MeasurePlot(measure.title, about, figures.draw_histogram(measure, here, there, size=_CARD), rows)


def _sizes(found: AuditSummary) -> Iterator[tuple[str, int, list[str], list[str]]]:
    """Yield, for each type of room, how many there are, its areas and median width, and those of public data sets."""
    for kind, tally in sorted(found.areas.items(), key=lambda each: -each[1].count):
        ends = "/".join(f" {tally.quantile(share):.1f} " for share in (0.05, 0.5, 0.95)).strip()
        here = [ends, f"{found.widths[kind].quantile(0.5):.1f}"]
        known = (sizes.get(kind) for sizes in SIZES.values())
        there = ["" if each is None else " / ".join(f"{value:.1f}" for value in each[:3]) for each in known]
        yield kind, tally.count, here, there


def check_report_paths(files: Iterable[Path]) -> None:
    """Raise ConfigError if a report cannot be written under a file name."""
    for path in files:
        if path.suffix not in _WRITERS:
            raise ConfigError(f"--out: expected a file that ends in {' or '.join(_WRITERS)}, found {path.name!r}")


def write_report(report: Report, path: Path) -> None:
    """Write the page or the numbers, depending on the file's extension."""
    write_atomically(path, _WRITERS[path.suffix](report))


_WRITERS: Final[dict[str, Callable[[Report], bytes]]] = {
    ".html": lambda report: report_html(report).encode(),
    ".json": lambda report: encode_json(report.values()),
}
