"""Return the statistics of a data set as an HTML page; ``houseexpo serve`` finds ``report_of`` by its entry point."""

from __future__ import annotations

from houseexpo.dataset import Dataset
from stats.html_report import report_html
from stats.measure import measure_and_add_up
from stats.report import Report


def report_of(data: Dataset) -> str:
    """Return the statistics of a data set or a selection as an HTML page; plans are measured in this process."""
    return report_html(Report(measure_and_add_up(data, workers=1)))
