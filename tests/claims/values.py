"""Quick values of claims: each function compares pages with the project, and returns what is wrong in them."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import msgspec

from houseexpo.exports import FORMATS
from houseexpo.pseudoslam.benchmark.cases import read_test_ids
from houseexpo.pseudoslam.benchmark.run import DEFAULT_PLANS
from houseexpo.pseudoslam.benchmark.verification import is_verified
from houseexpo.release.splits import SHARES
from houseexpo.service.drive import robots
from pipeline import cli_demo
from tests.claims.figures import NUMBER, Block, read_blocks
from tests.claims.places import ROOT

RESULTS: Final = ROOT / "docs" / "leaderboard"


def formats_of_export() -> list[str]:
    """README: how many formats ``houseexpo export`` writes."""
    said = re.findall(r"# (\d+) formats", (ROOT / "README.md").read_text())
    return [f"README: {number} formats, found {len(FORMATS)}" for number in said if int(number) != len(FORMATS)]


def houses_of_the_demo() -> list[str]:
    """300 houses of ``make dataset``, and 30 of ``houseexpo demo``."""
    (source,) = tomllib.loads((ROOT / "data_manifests" / "demo.toml").read_text())["build"]["sources"]
    found = (source, cli_demo.PLANS)
    return [] if found == ("procedural:300?style=sound", 30) else [f"expected 300 houses and 30, found {found}"]


def figures_of_the_readme() -> list[str]:
    """README: each figure stands on the page that says how it was measured."""
    pages = {
        "| rooms of 11 real robots' maps": ("docs/benchmarks.md", "Robots' maps"),
        "| the same, Bormann's": ("docs/benchmarks.md", "Robots' maps"),
        "| KTH's floors": ("docs/benchmark-exploration.md", "Maps of other people"),
        "| 301 public houses": ("docs/contributing/corpus.md", "Where it stands"),
        "| 101 wrong ones": ("docs/contributing/corpus.md", "Finished in the review"),
        "| 208 unmet": ("docs/contributing/corpus.md", "Files that nobody had met"),
        "| 136 robots' maps": ("docs/contributing/corpus.md", "Robots' maps"),
        "| 65 drawings": ("docs/contributing/corpus.md", "Vector plans and scenes"),
        "Of 100 houses": ("docs/benchmarks.md", "Made houses of each kind"),
        "| exploration, each reset": ("docs/benchmarks.md", "The whole data set"),
        "| 200 made houses": ("docs/benchmarks.md", "Made houses in SUNCG's layout"),
        "| one such house": ("docs/benchmarks.md", "Speed of the pipeline"),
        "| 2,000 such houses": ("docs/benchmarks.md", "Batches"),
        "| a mesh of 3.7 million": ("docs/benchmarks.md", "Speed of the pipeline"),
        "| 1,000 drawn plans": ("docs/benchmarks.md", "Batches"),
        "| PseudoSLAM's maps": ("docs/pseudoslam/slam.md", "The same path, two maps"),
    }
    wrong = []
    for block in _section("README.md", "Figures"):
        for line in block.text.splitlines() if block.text.startswith("|") else [block.text]:
            page = next((page for begins, page in pages.items() if line.startswith(begins)), None)
            figures = _numbers(" ".join(line.strip("|").split("|")[1:]) if line.startswith("|") else line)
            if page is None or not figures:
                if figures and not line.startswith(("|---", "| what")):
                    wrong.append(f"README: no page is known for {line!r}")
                continue
            there = [float(number) for each in _section(*page) for number in _all_numbers(each.text)]
            wrong += [
                f"README: {each} of {line[:40]!r} is not in {page}" for each in figures if not _is_in(each, there)
            ]
    return wrong


def maps_of_others() -> list[str]:
    """docs/benchmark-exploration.md: the tables of other people's maps are those of the results beside it."""
    known = list(_recorded("kth-", "dare-", "ariadne-", "pipe-"))
    blocks = [*_section("docs/benchmark-exploration.md", "Maps of other people")]
    blocks += _section("docs/benchmark-exploration.md", "Predicted maps")
    blocks += _section("docs/benchmark-exploration.md", "PIPE's table")
    tables = [block for block in blocks if block.text.startswith(("| policy", "| prediction"))]
    return _not_among(tables, known)


def mapex_table() -> list[str]:
    """docs/benchmark-exploration.md: our rows are those of the results, with multiples of both nearest frontiers."""
    keys = ("coverage_75_metres", "coverage_150_metres", "coverage_300_metres", "area_300_metres")
    found = {}
    for name in ("prospector", "chooser", "information", "finisher", "frontier", "frontier-mapex"):
        summary = _summary(RESULTS / f"kth-v1-{name}.json")
        found[name] = [summary[key]["mean"] for key in keys]
    text = "\n".join(block.text for block in _section("docs/benchmark-exploration.md", "MapEx's table"))
    wrong = []
    for name, (*shares, mean) in found.items():
        nearest = (found["frontier"], found["frontier-mapex"])
        multiples = " | ".join(f"{mean / each[-1]:.2f}, {shares[-1] / each[-2]:.2f}" for each in nearest)
        row = f"| {name} | {', '.join(f'{100 * share:.1f}' for share in shares)} | {100 * mean:.1f} | {multiples} |"
        wrong += [] if row in text else [f"docs/benchmark-exploration.md: {row!r} is missing"]
    return wrong


def looking_round() -> list[str]:
    """docs/pseudoslam/experiments.md: the rows are those of the results on the track `quality`."""
    text = "\n".join(block.text for block in _section("docs/pseudoslam/experiments.md", "Looking round"))
    wrong = []
    for name in ("look-around", "straight", "finisher", "frontier"):
        summary = _summary(RESULTS / f"exploration-quality-v1-{name}.json")
        metres = (summary[f"metres_to_{share}"] for share in (90, 95, 99))
        cells = [f"{each['mean']:.1f} [{each['low']:.1f}, {each['high']:.1f}]" for each in metres]
        steps, number = summary["steps_to_99"]["mean"], summary["metres_to_99"]["number"]
        row = f"| `{name}` | {' | '.join(cells)} | {steps:.0f} | {number:.0f} |"
        wrong += [] if row in text else [f"docs/pseudoslam/experiments.md: {row!r} is missing"]
    return wrong


def turning_while_going() -> list[str]:
    """docs/pseudoslam/experiments.md: the rows are those of the results on the tracks `budget` and `quality`."""
    text = "\n".join(block.text for block in _section("docs/pseudoslam/experiments.md", "Turning while going"))
    wrong = []
    for name in ("swift", "chooser", "frontier"):
        budget, quality = (_summary(RESULTS / f"exploration-{track}-v1-{name}.json") for track in ("budget", "quality"))
        spans = ((budget["area_800_steps"], 100), (budget["area_200_metres"], 100), (quality["metres_to_90"], 1))
        area, way, metres = (
            f"{times * each['mean']:.1f} [{times * each['low']:.1f}, {times * each['high']:.1f}]"
            for each, times in spans
        )
        steps = f"{quality['steps_to_90']['mean']:.0f} | {quality['steps_to_99']['mean']:.0f}"
        row = f"| `{name}` | {area} | {way} | {steps} | {metres} |"
        wrong += [] if row in text else [f"docs/pseudoslam/experiments.md: {row!r} is missing"]
    return wrong


def goals_of_a_kind() -> list[str]:
    """docs/pseudoslam/experiments.md: the rows are those of the results on the tracks of goals of a kind."""
    names = ("seek", "seek-likely", "seek-likely-1", "seek-likely-2", "shortest")
    columns = (("spl", 100, ".1f"), ("success", 100, ".1f"), ("metres", 1, ".1f"), ("steps", 1, ".0f"))
    return _missing_rows("Goals of a kind", ("roomgoal", "objectgoal"), names, columns)


def giving_way() -> list[str]:
    """docs/pseudoslam/experiments.md: the rows are those of the results on the tracks among people."""
    names = ("give-way", "give-way-1", "give-way-2", "wait", "keep-away", "shortest")
    columns = (
        ("spl", 100, ".1f"), ("success", 100, ".1f"), ("seconds_to_goal", 1, ".1f"), ("personal_s", 1, ".1f"),
        ("intimate_s", 1, ".1f"), ("person_collisions", 1, ".2f"),
    )  # fmt: skip
    return _missing_rows("Giving way", ("social", "social-orca"), names, columns)


def _missing_rows(
    section: str, tracks: tuple[str, ...], names: tuple[str, ...], columns: tuple[tuple[str, int, str], ...]
) -> list[str]:
    """What is missing of the rows of results in a section of docs/pseudoslam/experiments.md."""
    text = "\n".join(block.text for block in _section("docs/pseudoslam/experiments.md", section))
    wrong = []
    for track in tracks:
        for name in names:
            summary = _summary(RESULTS / f"{track}-v1-{name}.json")
            cells = [
                f"{times * summary[key]['mean']:{form}} "
                f"[{times * summary[key]['low']:{form}}, {times * summary[key]['high']:{form}}]"
                for key, times, form in columns
            ]
            row = f"| `{name}` | {' | '.join(cells)} |"
            wrong += [] if row in text else [f"docs/pseudoslam/experiments.md: {row!r} is missing"]
    return wrong


def slam_in_the_loop() -> list[str]:
    """docs/pseudoslam/slam.md: the ranges are those of the track's results, whose actions were played again."""
    files = sorted(RESULTS.glob("exploration-slam-*.json"))
    means = [{key: one["mean"] for key, one in _summary(file).items()} for file in files]
    path, odometry = (_span(means, key, ".2f") for key in ("ate_m", "odometry_ate_m"))
    free, walls = (_span(means, key, ".0%") for key in ("iou_seen_free", "iou_seen_walls"))
    text = " ".join(" ".join(block.text for block in _section("docs/pseudoslam/slam.md", "A SLAM in the loop")).split())
    said = [f"errs by {path} m where", f"alone errs by {odometry} m", f"cells is {free}", f"walls {walls}"]
    wrong = [f"docs/pseudoslam/slam.md: {each!r} is missing" for each in said if each not in text]
    return wrong + [f"{file.name} is not verified" for file in files if not is_verified(file)]


def plans_of_a_benchmark() -> list[str]:
    """docs/benchmark-exploration.md: a run takes 500 plans of a list of 1,000."""
    found = (DEFAULT_PLANS, len(read_test_ids()))
    return [] if found == (500, 1000) else [f"expected 500 of 1,000 plans, found {found}"]


def limits_in_the_code() -> list[str]:
    """Numbers that somebody chose, where pages name them as shares, sizes or times."""
    wrong = []
    if SHARES != {"train": 0.7, "val": 0.1, "test": 0.2}:
        wrong.append(f"docs/guide-release.md: the parts are {SHARES}")
    if robots._ALL_SEEN != 0.99:
        wrong.append(f"docs/guide-drive.md: a drive ends at {robots._ALL_SEEN}")
    return wrong


def search_for_the_chooser() -> list[str]:
    """docs/pseudoslam/training.md: the search is that of experiments/chooser.toml."""
    said = tomllib.loads((ROOT / "experiments" / "chooser.toml").read_text())
    runs = said["generations"] * said["candidates"] * said["plans"]
    wanted = [said["candidates"], said["plans"], said["generations"], runs, said["generations"] * said["plans"]]
    text = " ".join(block.text for block in _section("docs/pseudoslam/training.md", "A chooser of frontiers"))
    return [f"docs/pseudoslam/training.md: {number:,} is missing" for number in wanted if f"{number:,}" not in text]


def _section(page: str, heading: str) -> list[Block]:
    return [block for block in read_blocks(ROOT / page, page) if block.heading == heading]


def _numbers(text: str) -> list[str]:
    return [each.rstrip(",").replace(",", "") for each in re.findall(NUMBER, text)]


def _all_numbers(text: str) -> list[str]:
    return [each.replace(",", "") for each in re.findall(r"\d[\d,]*(?:\.\d+)?", text) if each.strip(",")]


def _summary(file: Path) -> dict[str, dict[str, float]]:
    return dict(msgspec.json.decode(file.read_bytes())["summary"])


def _span(rows: list[dict[str, float]], key: str, form: str) -> str:
    """Return the lowest and the highest mean in words: one number if they print alike."""
    low, high = (format(f(row[key] for row in rows), form) for f in (min, max))
    return low if low == high else f"{low.rstrip('%')} to {high}"


def _recorded(*prefixes: str) -> Iterator[float]:
    """All figures of results, as they are and in per cent."""
    for file in sorted(file for prefix in prefixes for file in RESULTS.glob(f"{prefix}*.json")):
        for each in _summary(file).values():
            yield from (scaled for value in each.values() for scaled in (value, 100 * value))


def _not_among(blocks: list[Block], known: list[float]) -> list[str]:
    if not blocks:
        return ["the table is not where it was"]
    return [
        f"{b.page}:{b.line}: {each} is in no result" for b in blocks for each in b.figures if not _is_in(each, known)
    ]


def _is_in(figure: str, known: list[float]) -> bool:
    """Whether a figure is one of those known, rounded as it is."""
    text = figure.rstrip(",").replace(",", "")
    digits = len(text.partition(".")[2])
    return any(abs(round(each, digits) - float(text)) < 1e-9 for each in known)
