"""Return the statistics of a data set as an HTML page; ``houseexpo serve`` finds ``report_of`` by its entry point."""

from __future__ import annotations

from houseexpo.dataset import Dataset
from stats.html_report import report_html
from stats.measure import summarise_data_set
from stats.report import Report


def report_of(data: Dataset) -> str:
    """Return the statistics of a data set or a selection as an HTML page; plans are measured in this process."""
    return report_html(Report(summarise_data_set(data, workers=1)))
