"""Build a data set: track the inputs, store the results, report the outcomes."""

from __future__ import annotations

from typing import Final

WORKER_MODULES: Final = ("pipeline.algorithm", "pipeline.batch.planning")
"""The modules that workers share, by name: a build can have them loaded before it loads anything itself."""
