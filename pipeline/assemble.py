"""Put a data set together from outcomes: which plans stay, and the files beside them (FORMAT.md section 3)."""

from __future__ import annotations

import hashlib
import platform
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import msgspec

from houseexpo.index import index_table, row
from houseexpo.plan import FloorPlan
from houseexpo.plan_json import FORMAT, decode, encode
from houseexpo.similarity import Duplicate, comparison_mask
from houseexpo.summaries import new_summaries
from pipeline.config_file import BuildConfig
from pipeline.ids import settle
from pipeline.job import Refused
from pipeline.lists import list_files, valid_parts
from pipeline.overrides import Override
from pipeline.sources import is_path
from pipeline.stages.dedupe import dedupe
from pipeline.store import MANIFEST, Kept, Store, write

LIBRARIES = ("numpy", "scipy", "shapely", "opencv-python-headless", "manifold3d", "trimesh", "networkx", "numba")
"""Libraries whose versions may show in a plan; the manifest names them."""


@dataclass(frozen=True)
class DataSet:
    """What a finished build came to: its statistics, the ids of its plans, and what a person should know of it."""

    root: Path
    stats: Mapping[str, Any]
    ids: tuple[str, ...]
    refused: tuple[Refused, ...]


def assemble(store: Store, config: BuildConfig, overrides: Mapping[str, Override]) -> DataSet:
    """Write everything but the pictures; the manifest is last."""
    entries = list(store.current())
    plans = _settled(store, [kept for entry in entries for kept in entry.plans])
    refused = sorted((r for entry in entries for r in entry.refused), key=lambda r: (r.id, r.stage, r.reason, r.detail))
    scale = config.stages.dedupe.pixels_per_metre
    masks = {name: comparison_mask(_load(store, kept), scale) for name, kept in plans.items()}
    keep = {name for name, kept in plans.items() if _override(name, kept, overrides).keep}
    dropped = dedupe(masks, config.stages.dedupe, keep)
    for duplicate in dropped:
        del plans[duplicate.id]
    stats = _write_plans(store, plans, _outcomes(len(entries), len(plans), dropped, refused))
    write(store.root / "rejected.jsonl", _lines(r.line() for r in refused))
    write(store.root / "duplicates.jsonl", _lines(_duplicate(d) for d in dropped))
    write(store.root / "stats.json", pretty(stats))
    write(store.root / MANIFEST, pretty(_manifest(store, plans, stats, config, overrides)))
    return DataSet(store.root, stats, tuple(plans), tuple(refused))


def pretty(values: Any) -> bytes:
    """Return JSON that people can read and diff, keys as they come."""
    return msgspec.json.format(msgspec.json.encode(values), indent=2) + b"\n"


def _settled(store: Store, found: list[Kept]) -> dict[str, Kept]:
    """Return the plans by final id, sorted; a plan whose id had to change is written anew."""
    names = settle([kept.id for kept in found], [kept.content for kept in found])
    plans = {}
    for name, kept in sorted(zip(names, found, strict=True), key=lambda pair: pair[0]):
        plans[name] = kept
        if name != kept.id:
            data = encode(replace(_load(store, kept), id=name)) + b"\n"
            plans[name] = replace(kept, plan=hashlib.sha256(data).hexdigest())
            write(store.plans / plans[name].plan, data)
    return plans


def _load(store: Store, kept: Kept) -> FloorPlan:
    return decode(store.plan(kept))


def _override(name: str, kept: Kept, overrides: Mapping[str, Override]) -> Override:
    return overrides.get(name) or overrides.get(kept.id) or Override()


def _write_plans(store: Store, plans: Mapping[str, Kept], outcomes: dict[str, Any]) -> dict[str, Any]:
    """Write json/ and the index in one pass; return the statistics."""
    summaries, parts = new_summaries(), valid_parts(store.root, plans)
    rules: Counter[str] = Counter()
    rows, doubtful = [], 0
    for name, kept in plans.items():
        plan = _load(store, kept)
        rows.append({**row(plan), "split": parts.get(name)})
        rules.update(_rules(plan))
        doubtful += plan.quality is not None and plan.quality.is_doubtful
        for summary in summaries.values():
            summary.add(plan)
        store.publish(name, kept)
    for file in (store.root / "json").iterdir():
        if file.stem not in plans or file.suffix != ".json":
            file.unlink()
    write(store.root / "index.parquet", index_table(rows))
    outcomes = {**outcomes, "doubtful": doubtful, "rules": dict(sorted(rules.items()))}
    return {"outcomes": outcomes, **{name: summary.report() for name, summary in summaries.items()}}


def _outcomes(inputs: int, plans: int, dropped: list[Duplicate], refused: list[Refused]) -> dict[str, Any]:
    reasons = Counter(r.reason for r in refused)
    return {
        "inputs": inputs,
        "plans": plans,
        "duplicates": len(dropped),
        "rejected": len(refused),
        "reasons": dict(sorted(reasons.items(), key=lambda pair: (-pair[1], pair[0]))),
    }


def _rules(plan: FloorPlan) -> list[str]:
    """Name the rules that had something to do in a plan: those that stand for what the paper left to people."""
    notes = (plan.provenance or {}).get("notes", {})
    return [f"{name}:{value}" if isinstance(value, str) else name for name, value in notes.items()]


def _duplicate(duplicate: Duplicate) -> dict[str, Any]:
    return {
        "id": duplicate.id,
        "kept_id": duplicate.kept_id,
        "difference": duplicate.difference,
        "symmetry": duplicate.symmetry,
    }


def _lines(values: Iterable[dict[str, Any]]) -> bytes:
    return b"".join(msgspec.json.encode(value) + b"\n" for value in values)


def _manifest(
    store: Store,
    plans: Mapping[str, Kept],
    stats: Mapping[str, Any],
    config: BuildConfig,
    overrides: Mapping[str, Override],
) -> dict[str, Any]:
    root = store.root
    beside = ("duplicates.jsonl", "index.parquet", "rejected.jsonl", "stats.json")
    lists = sorted(path.relative_to(root).as_posix() for path in list_files(root))
    files = {name: hashlib.sha256((root / name).read_bytes()).hexdigest() for name in (*beside, *lists)}
    return {
        "format": FORMAT,
        "generator": {"name": "houseexpo", "version": version("houseexpo")},
        "sources": sorted(_public(source) for source in store.sources),
        "parameters": config.parameters(),
        "parameters_sha256": config.digest(),
        "overrides": {name: asdict(override) for name, override in overrides.items()},
        "versions": {"python": ".".join(platform.python_version_tuple()[:2]), **_versions()},
        "counts": stats["outcomes"],
        "files": dict(sorted((files | {f"json/{name}.json": kept.plan for name, kept in plans.items()}).items())),
    }


def _public(source: str) -> str:
    """Return a source's own name: where it lies on this machine is nobody else's business."""
    return Path(source).name if is_path(source) else source


def _versions() -> dict[str, str]:
    found = {}
    for name in (*LIBRARIES, "ifcopenshell"):
        try:
            found[name] = version(name)
        except PackageNotFoundError:  # an extra that is not installed made no plan
            continue
    return found
