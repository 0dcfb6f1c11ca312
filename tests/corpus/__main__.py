"""``python -m tests.corpus FOLDER``: build the corpus and say what came of it.

``--record NAME`` keeps the outcomes and the figures in ``results.json``, under a name such as the commit's.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from rich.console import Console
from rich.table import Table

from houseexpo.errors import ConfigError
from tests.corpus import runs, truths
from tests.corpus.figures import Rows, figures_of, quality_rows, verdict_rows
from tests.corpus.manifest import KINDS, MANIFEST, File, checkout, fetch, load


def main(arguments: list[str] | None = None) -> int:
    """Run; 0 where all went well, 2 where there is nothing to do."""
    asked = _parser().parse_args(arguments)
    console = Console(highlight=False, width=max(Console().width, 130))
    if asked.folder is None:
        console.print("no FOLDER and no HOUSEEXPO_CORPUS: name the folder that holds the checkouts")
        return 2
    folder = Path(asked.folder).absolute()
    try:
        files = _files(asked, folder, console)
    except ConfigError as error:
        console.print(str(error))
        return 2
    if not files:
        return 2
    out = Path(asked.out).absolute() if asked.out else folder / ".built"
    progress = _said if sys.stderr.isatty() else _unsaid
    os.environ.setdefault("PXR_USDC_EMIT_DEPRECATION_WARNINGS", "0")  # of other people's USDZ files
    built = list(runs.run(files, folder, out, workers=asked.workers, progress=progress))
    before = runs.load_results(asked.results)
    notes = {each.file.name: runs.changes(each.file, before.get(each.file.key), each.outcome) for each in built}
    shown = [each for each in built if asked.both_halves or each.file.half == 1]
    for each in shown:
        told = notes[each.file.name] if before else []
        if told or not each.verdict:  # whoever judges writes these lines into the list
            verdict = each.verdict or "to be judged"
            console.print(f"{each.file.name} ({verdict}): " + "; ".join(told or each.outcome.lines), markup=False)
    tables = [verdict_rows(built), quality_rows(built)]
    drawn = _truth_rows(built, folder, console)
    if drawn[2]:
        tables.append(drawn)
    for title, columns, rows in tables:
        printed = Table(*columns, title=title)
        for row in rows:
            printed.add_row(*row)
        console.print(printed)
    if asked.record:
        runs.record(built, figures_of(built), asked.record, asked.results)
    return 0


def _truth_rows(built: list[runs.Built], folder: Path, console: Console) -> Rows:
    """What plans have of the truths that persons have drawn, by half."""
    rows = []
    for half in (1, 2):
        found, whole, count = truths.Found(), 0, 0
        for each in built:
            truth = truths.load(each.file.name) if each.file.half == half else None
            if truth is None:
                continue
            models = os.pathsep.join(str(checkout(folder, each.file.repository) / model) for model in each.file.models)
            of_it = truths.compare(truth, truths.levels_of(str(each.file.place(folder)), models), each.plans)
            found, whole, count = found + of_it, whole + of_it.is_whole, count + 1
            if not of_it.is_whole and half == 1:
                names = zip(truths.COLUMNS, of_it.row, strict=True)
                console.print(f"{each.file.name}, truth: {', '.join(' '.join(pair) for pair in names)}")
        if count:
            rows.append([f"half {half}", str(count), str(whole), *found.row])
    return "Truths drawn by hand", ("", "files", "all found", *truths.COLUMNS), rows


def _files(asked: argparse.Namespace, folder: Path, console: Console) -> list[File]:
    """The files that are asked for and lie in the folder; says which do not."""
    listed = [file for file in load(asked.manifest) if not asked.kind or file.kind in asked.kind]
    if asked.half:
        listed = [file for file in listed if file.half == asked.half]
    if asked.only:
        listed = [file for file in listed if file.name in asked.only]
    for line in fetch(listed, folder) if asked.fetch else ():
        console.print(f"not fetched: {line}")
    files = [file for file in listed if file.is_in(folder)]
    console.print(f"{len(files)} of {len(listed)} files lie in {folder}")
    for file in listed:
        if file not in files and (asked.both_halves or file.half == 1):
            console.print(f"  missing: {file.place(folder).relative_to(folder)}")
    return files


def _said(what: str, done: int, of: int) -> None:
    sys.stderr.write(f"\r{what}: {done} of {of}  ")


def _unsaid(what: str, done: int, of: int) -> None:
    """Say nothing: a log needs no progress."""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m tests.corpus", description="Build the corpus of real houses.")
    parser.add_argument(
        "folder",
        nargs="?",
        metavar="FOLDER",
        default=os.environ.get("HOUSEEXPO_CORPUS"),
        help="checkouts, each in a folder named owner+name (default: HOUSEEXPO_CORPUS)",
    )
    parser.add_argument("--fetch", action="store_true", help="get what is missing from where it was published, by git")
    parser.add_argument("--out", help="where data sets are kept (default: FOLDER/.built)")
    parser.add_argument("--workers", type=int, default=2, help="processes (default: 2)")
    parser.add_argument("--kind", action="append", choices=KINDS, help="files of this kind only; may be repeated")
    parser.add_argument("--only", action="append", metavar="NAME", help="this file only; may be repeated")
    parser.add_argument("--half", type=int, choices=(1, 2), help="files of this half only")
    parser.add_argument("--record", metavar="RUN", help="keep the outcomes in results.json under this name")
    parser.add_argument(
        "--both-halves",
        action="store_true",
        help="show the second half too: for the person who judges by eye, not for those who work on the pipeline",
    )
    parser.add_argument("--manifest", type=Path, default=MANIFEST, help=argparse.SUPPRESS)
    parser.add_argument("--results", type=Path, default=runs.RESULTS, help=argparse.SUPPRESS)
    return parser


if __name__ == "__main__":
    sys.exit(main())
