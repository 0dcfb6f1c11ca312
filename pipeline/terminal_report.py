"""Print the outcome of a build in the terminal, as tables and lines; ``pipeline.html_report`` writes the HTML report.

R1  First the counts, then the plans by id, then what gave no plan and what to do about it, then where all is, and the
    commands that people run next.
R2  A list longer than a screen bears is cut, and the last line says where the rest is.
R3  What took how long, and how often a rule had something to do, is said with ``-v`` only.
"""

from __future__ import annotations

import contextlib
import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from operator import itemgetter
from pathlib import Path
from typing import Any, Final

from rich.console import Console
from rich.table import Table
from rich.text import Text

from houseexpo.commands.printing import new_table
from houseexpo.corrections import Override
from houseexpo.corrections.vocabulary import author_key
from houseexpo.errors import HouseExpoError
from houseexpo.floorplan import load_plan
from houseexpo.plan import explanations
from houseexpo.plan.ids import is_of_input, parts_of
from houseexpo.plan.parts import SURE
from houseexpo.words import count_noun
from pipeline.batch.assemble import BuildResult, make_unique_ids
from pipeline.batch.entry import Entry, StoredRejection
from pipeline.display import LISTED
from pipeline.overrides import outcomes_of_corrections
from pipeline.quality import main_grounds_in_words
from pipeline.sources import is_path
from pipeline.sources.files import describe_links
from pipeline.sources.reader_choice import how_to_export


def outcomes_by_id(data_set: BuildResult) -> Iterator[tuple[str, str, str]]:
    """Yield what became of each correction by hand: the id it stands under, done, already or none, and a sentence."""
    of_level: dict[str, list[str]] = {}
    for name in data_set.ids:
        of_level.setdefault(parts_of(name).of_level, []).append(name)
    refused = {parts_of(each.id).of_level: each for each in reversed(data_set.refused)}
    for name, override in data_set.overrides.items():
        level = parts_of(name).of_level
        ids = of_level.get(level, [])
        if override.of_file:
            ids = [each for each in data_set.ids if is_of_input(each, name)] or ids
        if replace(override, keep=False, drop=False, why="") != Override():
            plans = (load_plan(data_set.root / "json" / f"{each}.json") for each in ids)
            for outcome, sentence in outcomes_of_corrections(override, plans):
                yield name, outcome, sentence
        if override.keep and author_key("keep", value=True) not in {key for key, *_ in override.authors}:
            own = ids or [each for each in data_set.ids if is_of_input(each, name)]
            if own and data_set.idle_keeps.issuperset(own):
                # a reviewer keeps what is right, so only a file that was written by hand is told
                yield name, "none", "keep: nothing would have left the plan out; it is not needed"
        if not ids and level in refused and not override.drop:
            for word in [*(["keep"] if override.keep else []), *map(str, override.corrections)]:
                yield name, "none", f"{word}: there is no plan: {refused[level].reason.replace('_', ' ')}"


def read_index_rows(root: Path) -> list[dict[str, Any]]:
    """Return what the index of a data set says of each plan: id, rooms, doors, area (m²), quality.

    Where so few are doubtful that each is named (R2), ``against`` of these is what speaks most against them, in words.
    """
    import pyarrow.parquet as pq

    from houseexpo.dataset.index import with_current_columns

    columns = ["id", "rooms", "doors", "area", "quality"]
    rows: list[dict[str, Any]] = with_current_columns(pq.read_table(root / "index.parquet")).select(columns).to_pylist()
    doubtful = [row for row in rows if row["quality"] is not None and row["quality"] < SURE]
    for row in doubtful if len(doubtful) <= LISTED else ():
        with contextlib.suppress(HouseExpoError, OSError):
            quality = load_plan(root / "json" / f"{row['id']}.json").quality
            grounds = main_grounds_in_words(quality) if quality is not None else []
            row["against"] = "; ".join(ground.rpartition(": ")[0] for ground in grounds)
    return rows


def print_outcome(
    data_set: BuildResult, rows: Sequence[Mapping[str, Any]], out: str, printed: Console, *, verbose: bool
) -> None:
    """Print the outcome of a build.

    Parameters
    ----------
    rows
        The data set's ``read_index_rows``.
    out
        The data set as the person named it.
    verbose
        Show tables of rules and times too (R3).
    """
    if data_set.unchanged:
        printed.print("nothing to do: the data set is up to date", highlight=False)
    printed.print(headline(data_set.stats), style="bold", highlight=False)
    if (means := means_line(rows)) is not None:
        printed.print(means, highlight=False)
    if rows:
        printed.print()
        printed.print(plans_table(data_set, rows, out))
    for lines in (doubt_lines(rows), duplicate_lines(data_set), rejection_lines(data_set, out)):
        for number, line in enumerate(lines):
            printed.print(line if number else Text("\n").append_text(line), soft_wrap=True)
    notes = [(note, "none") for note in notes_lines(data_set)] + [(odd, "yellow") for odd in oddity_lines(rows)]
    if notes:
        printed.print()
    for note, style in notes:
        printed.print(note, style=style, highlight=False, soft_wrap=True)
    if verbose:
        printed.print(outcome_table(data_set.stats))
        if len(data_set.entries) > 1 and not data_set.unchanged:
            printed.print(slowest_inputs_table(data_set))
    if data_set.not_done:
        again = f"not done yet: {data_set.not_done}; run the build again when the cause is gone"
        printed.print(again, style="yellow", highlight=False, soft_wrap=True)
    printed.print()
    for what, where in result_lines(data_set, out):
        printed.print(f"{what:10}", style="bold", end="")
        printed.print(where, soft_wrap=True)


def headline(stats: Mapping[str, Any]) -> str:
    """Return one line with the outcomes of the inputs."""
    outcomes = stats["outcomes"]
    plans = count_noun(outcomes["plans"], "plan") if outcomes["plans"] else "no plan"
    beside = {
        "doubtful": outcomes["doubtful"],
        count_noun(outcomes["duplicates"], "duplicate").partition(" ")[2]: outcomes["duplicates"],
        "rejected": outcomes["rejected"],
        "not done": outcomes["not_done"],
    }
    said = ", ".join(f"{count:,} {what}" for what, count in beside.items() if count)
    return f"{plans} from {count_noun(outcomes['inputs'], 'house')}" + (f" ({said})" if said else "")


def means_line(rows: Sequence[Mapping[str, Any]]) -> str | None:
    """Return one line with means over the plans, or None for fewer than two. ``houseexpo stats`` says more."""
    if len(rows) < 2:
        return None
    rooms, doors, area = (sum(row[name] or 0 for row in rows) / len(rows) for name in ("rooms", "doors", "area"))
    return f"on average {rooms:.1f} rooms, {doors:.1f} doors and {area:.0f} m² per plan"


def plans_table(data_set: BuildResult, rows: Sequence[Mapping[str, Any]], out: str) -> Table:
    """List the plans by id (R2), those of this build first, each with the file that it was read from, if any."""
    files = _files(data_set)
    own = sorted(rows, key=lambda row: (row["id"] not in files, row["id"]))
    shown = own[:LISTED]
    named = any(files.get(row["id"]) for row in shown)
    table = new_table()
    table.add_column("plan", overflow="fold")
    if named:
        table.add_column("file", overflow="fold", style="dim")
    for head in ("rooms", "doors", "area", "quality"):
        table.add_column(head, justify="right", no_wrap=True)
    for row in shown:
        quality = row["quality"]
        sure = Text("" if quality is None else f"{quality:.2f}", "" if quality is None or quality >= SURE else "yellow")
        counts = (str(row["rooms"] or ""), str(row["doors"] or 0), f"{row['area']:.0f} m²")
        table.add_row(Text(row["id"]), *([Text(files.get(row["id"], ""))] if named else []), *counts, sure)
    if len(shown) < len(own):
        table.add_row(Text(f"and {len(own) - len(shown):,} more in {out}/json", "dim"))
    return table


def _files(data_set: BuildResult) -> dict[str, str]:
    """Return the file by the plan's id, of the inputs that this build listed; "" for a house that was made."""
    made = [(entry, kept) for entry in data_set.entries for kept in entry.plans]
    ids = make_unique_ids([kept.id for _, kept in made], [kept.content for _, kept in made])
    return {
        name: entry.file if is_path(entry.source) else ""
        for name, (entry, _) in zip(ids, made, strict=True)
        if not data_set.sources or entry.source in data_set.sources
    }


def doubt_lines(rows: Sequence[Mapping[str, Any]]) -> Iterator[Text]:
    """Say of the doubtful plans what speaks against each; of many (R2) the report does."""
    for row in sorted((row for row in rows if row.get("against")), key=itemgetter("id")):
        yield Text.assemble(("doubtful ", "yellow"), (row["id"], "bold"), f": {row['against']}")


def duplicate_lines(data_set: BuildResult) -> Iterator[Text]:
    """Say which plans were left out as duplicates, and how to keep them; of many (R2) their file does."""
    dropped = data_set.duplicates
    if not dropped or len(dropped) > LISTED:
        return
    for each in dropped:
        yield Text.assemble(("duplicate ", "yellow"), (each.id, "bold"), f": its plan repeats {each.kept_id}")
    yield Text(
        "          left out; --keep-copies keeps them, `keep = true` under an id in overrides.toml one of them", "dim"
    )


def rejection_lines(data_set: BuildResult, out: str) -> Iterator[Text]:
    """Say why each input was rejected and what to do; of many (R2) say how many for which reason, and where more is."""
    if len(data_set.refused) > LISTED:
        reasons = data_set.stats["outcomes"]["reasons"]
        said = ", ".join(f"{reason} {count:,}" for reason, count in reasons.items())
        yield Text.assemble((f"rejected: {said}", "red"), f"; why, and what to do: {out}/rejected.jsonl")
        return
    rejections = list(sorted_rejections(data_set))
    for number, (file, refused) in enumerate(rejections):
        named = refused.id if file in {"", refused.id} else f"{file} ({refused.id})"
        said = refused.detail.removeprefix(f"{Path(file).name}: ")  # the file stands before it
        yield Text.assemble(("rejected ", "red"), (named, "bold"), f": {said}")
        following = rejections[number + 1][1].advice if number + 1 < len(rejections) else ""
        if refused.advice and refused.advice != following:  # the same advice stands once, below all that it is for
            yield Text(f"         {refused.advice}", "dim")


def result_lines(data_set: BuildResult, out: str) -> Iterator[tuple[str, Text]]:
    """Yield where the results are, and what to run next."""
    yield "data set", Text(out)
    yield "pictures", Text(f"{out}/.build/pictures")
    doubtful = f"  (doubtful plans first: quality below {SURE:g})" if data_set.stats["outcomes"]["doubtful"] else ""
    yield "report", Text.assemble(f"{out}/.build/report.html", (doubtful, "yellow"))
    for number, command in enumerate(next_commands(data_set, out)):
        yield "" if number else "next", Text(command, "cyan")


def next_commands(data_set: BuildResult, out: str) -> list[str]:
    """Return the commands that people run next on a folder of plans."""
    if "://" in out or not data_set.ids:
        return []
    place, some = shlex.quote(out), " --sample 12" if len(data_set.ids) > LISTED else ""
    return [f"houseexpo serve {place}", f"houseexpo show {place}{some} --out {shlex.quote(f'{Path(out).name}.png')}"]


def outcome_table(stats: Mapping[str, Any]) -> Table:
    """Show what became of the inputs, rejections by reason, and in how many plans a rule had something to do."""
    outcomes = stats["outcomes"]
    table = new_table("Outcomes", header=False)
    table.add_column(style="bold")
    table.add_column(justify="right")
    table.add_row("inputs", str(outcomes["inputs"]), end_section=True)
    table.add_row(Text("plans", "green"), str(outcomes["plans"]))
    if outcomes["doubtful"]:
        table.add_row(f"  doubtful: quality below {SURE:g}", str(outcomes["doubtful"]), style="yellow")
    table.add_row(Text("duplicates", "yellow"), str(outcomes["duplicates"]))
    table.add_row(Text("rejected", "red"), str(outcomes["rejected"]))
    for reason, count in outcomes["reasons"].items():
        table.add_row(f"  {reason}", str(count), style="dim")
    if outcomes["rules"]:
        table.add_section()
        table.add_row("plans in which a rule", "")
        for rule, count in outcomes["rules"].items():
            table.add_row(f"  {explanations.NOTES.get(rule, rule)}", str(count), style="dim")
    return table


def sorted_rejections(data_set: BuildResult) -> list[tuple[str, StoredRejection]]:
    """Return the rejections, sorted by id, each with the file of its input."""
    found = [(entry.file, refused) for entry in data_set.entries for refused in entry.refused]
    return sorted(found, key=lambda pair: pair[1])


def _suffixes(data_set: BuildResult) -> set[str]:
    return {Path(source).suffix for source in data_set.passed_over}


def notes_lines(data_set: BuildResult) -> list[str]:
    """Return notes on what may surprise: ignored files, and inputs that gave several outcomes."""
    lines = []
    if data_set.passed_over:
        names = ", ".join(data_set.passed_over[:8]) + (", ..." if len(data_set.passed_over) > 8 else "")
        lines.append(f"passed over, no house that a reader knows: {names}{how_to_export(_suffixes(data_set))}")
    if data_set.ignored:
        counts = sorted(data_set.ignored.items(), key=lambda pair: (-pair[1], pair[0]))
        kinds = ", ".join(f"{count} {suffix}" for suffix, count in counts[:8]) + (", ..." if len(counts) > 8 else "")
        lines.append(f"ignored, no houses by themselves: {kinds}{how_to_export(data_set.ignored)}")
    if data_set.links:
        lines.append(describe_links(data_set.links))
    several = [entry for entry in data_set.entries if len(list(entry.outcomes)) > 1]
    if several:
        verb = "has" if len(several) == 1 else "have"
        lines.append(f"{count_noun(len(several), 'house')} {verb} several levels or buildings: a plan for each")
    if len(data_set.licences) > 1:
        named = ", ".join(name or "none" for name in data_set.licences)
        lines.append(f"no licence holds for the whole data set: its sources state {named}")
    return lines


def slowest_inputs(data_set: BuildResult) -> list[tuple[str, str, float]]:
    """Return the inputs that took longest: the id of the first outcome, the file, and the seconds."""
    found = sorted((-entry.seconds, entry.file, _id(entry)) for entry in data_set.entries if entry.seconds)
    return [(name, file, -seconds) for seconds, file, name in found[:LISTED]]


def _id(entry: Entry) -> str:
    """Return the id that people meet in the data set: that of the input's first outcome."""
    return next((outcome.id for outcome in entry.outcomes), "")


def slowest_inputs_table(data_set: BuildResult) -> Table:
    """Show the inputs that took longest."""
    table = new_table("Longest", header=False)
    table.add_column(overflow="fold")
    table.add_column(overflow="fold", style="dim")
    table.add_column(justify="right")
    for name, file, seconds in slowest_inputs(data_set):
        table.add_row(Text(name), Text(file if file != name else ""), f"{seconds:.2f} s")
    return table


def stage_seconds(data_set: BuildResult) -> dict[str, float]:
    """Return the seconds of all inputs by stage, in the order of the stages; reading a house is ``source``."""
    total: dict[str, float] = {}
    for entry in data_set.entries:
        for stage, seconds in entry.stages.items():
            total[stage] = total.get(stage, 0.0) + seconds
    return total


# Plans that are implausible for a house, because a unit or a scale was wrong.
#
# R1  A room of more than ``MAX_ROOM_M2`` on average is a field: the units are too large.
# R2  A room of less than ``MIN_ROOM_M2`` on average is a cupboard: the units are too small.


MAX_ROOM_M2: Final = 500.0
MIN_ROOM_M2: Final = 2.5
ADVICE: Final = "check --units, --scale and --storey-height"


def describe_oddity(rooms: int, area_m2: float) -> str:
    """Say what is odd about a plan with this number of rooms and this free area, or return an empty text."""
    each = area_m2 / max(rooms, 1)
    if MIN_ROOM_M2 <= each <= MAX_ROOM_M2:
        return ""
    what = "1 room" if rooms <= 1 else f"{rooms} rooms"
    return f"{what} of {each:,.{0 if each > 10 else 1}f} m²" + (" on average" if rooms > 1 else "")


def oddity_lines(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Yield a line for each plan that is no house, by the rows of the index, and one that counts those left out."""
    found = [(row["id"], odd) for row in rows if (odd := describe_oddity(row["rooms"] or 1, row["area"]))]
    for name, odd in found[:LISTED]:
        yield f"implausible: {name}: {odd}; {ADVICE}"
    if len(found) > LISTED:
        yield f"implausible: {len(found) - LISTED} more"
