"""Where the decisions on a data set belong: the ``overrides.toml`` that its build reads."""

from __future__ import annotations

from pathlib import Path

from houseexpo.dataset.build_record import recorded_build
from houseexpo.plan.overrides import NAME


def overrides_file(dataset: Path) -> Path:
    """Return the file for the decisions on a data set, which need not be there yet.

    It is the one that its build was told or found beside its manifest; without a manifest it lies in the data set's
    folder, beside ``manifest.json``; of an archive, beside the archive under its name.
    """
    record = recorded_build(dataset)
    if record is not None and record.overrides:
        return Path(record.overrides)
    return dataset / NAME if dataset.is_dir() else dataset.with_name(f"{dataset.name}.{NAME}")
