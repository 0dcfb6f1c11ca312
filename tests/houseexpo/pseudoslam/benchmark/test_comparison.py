"""Results side by side: order, shares of the oracle's way, and pages."""

from __future__ import annotations

import re
from pathlib import Path

import msgspec
import numpy as np
import pytest

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.benchmark.cases import Case
from houseexpo.pseudoslam.benchmark.comparison import read_results
from houseexpo.pseudoslam.benchmark.episodes import EpisodeOutcome, curve_sample_points
from houseexpo.pseudoslam.benchmark.measures import Metric
from houseexpo.pseudoslam.benchmark.page import (
    assign_colours,
    check_file_name,
    collect_map_curves,
    write_comparison,
)
from houseexpo.pseudoslam.benchmark.prediction import prediction_metrics
from houseexpo.pseudoslam.benchmark.result import PlansRecord, PolicyRecord, Result, RunTimes, write_result
from houseexpo.pseudoslam.benchmark.run import make_result
from houseexpo.pseudoslam.benchmark.statistics import Estimate
from houseexpo.pseudoslam.benchmark.tables import format_cell, format_markdown
from houseexpo.pseudoslam.benchmark.tracks import find_track

QUALITY, BUDGET = find_track("quality"), find_track("budget")
PLANS = PlansRecord("test", 3, "a" * 64, "b" * 64)
TIMES = RunTimes({"number": 3.0, "median": 0.5}, 1.0, 1, {"cores": 2})


def quality_result(
    name: str, metres: list[float | None], *, sees_truth: bool = False, family: str = "", training: int | None = None
) -> Result:
    """Three plans, with the metres to each share."""
    outcomes = []
    for number, way in enumerate(metres):
        values: dict[str, float | None] = {"collisions": 0.0}
        for share in (90, 95, 99):
            values |= {f"reached_{share}": float(way is not None), f"metres_to_{share}": way}
            values[f"steps_to_{share}"] = None if way is None else 10 * way
        outcomes.append(EpisodeOutcome(Case(f"plan_{number}", number), values))
    policy = PolicyRecord(name, f"somewhere:{name}", "", 0, sees_truth, "discrete", "map", family, training)
    return make_result(QUALITY, policy, PLANS, outcomes, TIMES)


def budget_result(name: str, coverage: float) -> Result:
    keys = [metric.key for metric in BUDGET.metrics]
    curves = {over: [min(coverage, 0.01 * i) for i in range(81)] for over, _ in BUDGET.curves}
    outcomes = [EpisodeOutcome(Case(f"plan_{i}", i), dict.fromkeys(keys, coverage), curves) for i in range(3)]
    policy = PolicyRecord(name, f"somewhere:{name}", "", 0, False, "discrete", "map")
    return make_result(BUDGET, policy, PLANS, outcomes, TIMES)


def written(folder: Path, *results: Result) -> list[Path]:
    files = [folder / f"{result.track_id}-{result.policy.name}.json" for result in results]
    for result, file in zip(results, files, strict=True):
        write_result(result, file)
    return files


def test_the_share_of_the_oracles_way_is_nothing_where_it_was_not_reached(tmp_path: Path) -> None:
    files = written(
        tmp_path,
        quality_result("oracle", [10.0, 20.0, None], sees_truth=True),
        quality_result("mine", [20.0, None, 5.0]),
        quality_result("lucky", [5.0, 20.0, 5.0]),  # shorter than the oracle's: 1
    )
    (compared,) = read_results(files)
    metric = next(metric for metric in compared.tables()[0] if metric.key == "share_of_oracle_metres_to_90")
    shares = {entry.name: compared.value(entry, metric) for entry in compared.entries}
    assert (shares["mine"].mean, shares["mine"].number) == (0.25, 2)  # 10/20 and 0
    assert shares["oracle"].mean == shares["lucky"].mean == 1.0


def test_a_share_that_is_seen_from_the_start_is_the_whole_of_no_way(tmp_path: Path) -> None:
    files = written(tmp_path, quality_result("oracle", [0.0, 4.0, 0.0]), quality_result("mine", [0.0, 8.0, 1.0]))
    (compared,) = read_results(files)
    metric = next(metric for metric in compared.tables()[0] if metric.key == "share_of_oracle_metres_to_90")
    assert {entry.name: compared.value(entry, metric).mean for entry in compared.entries} == {
        "oracle": 1.0,
        "mine": 0.5,
    }


def test_each_row_says_how_far_it_is_from_the_bound_which_is_compared_with_nothing(tmp_path: Path) -> None:
    files = written(
        tmp_path,
        quality_result("frontier", [20.0, 40.0, 50.0]),
        quality_result("mine", [10.0, None, 25.0]),
        quality_result("other", [30.0, 50.0, 60.0]),
    )
    without = read_results(files)[0]
    (compared,) = read_results(
        [*files, *written(tmp_path, quality_result("bound", [5.0, 10.0, 10.0], sees_truth=True))]
    )
    by_key = {metric.key: metric for metric in compared.tables()[0]}
    metric = by_key["share_of_bound_metres_to_90"]
    assert metric.title == "bound as a share of the way, 90%"
    shares = {entry.name: compared.value(entry, metric).mean for entry in compared.entries}
    expected = {"frontier": 0.7 / 3, "mine": 0.9 / 3, "other": (1 / 3 + 0.2) / 3, "bound": 1.0}
    assert shares == pytest.approx(expected, abs=1e-6)
    less, p = by_key["less_metres_to_90"], by_key["p_metres_to_90"]
    of_bound = next(entry for entry in compared.entries if entry.name == "bound")
    assert compared.value(of_bound, less).mean is compared.value(of_bound, p).mean is None
    for entry, plain in zip([e for e in compared.entries if e is not of_bound], without.entries, strict=True):
        assert compared.value(entry, p) == without.value(plain, p)  # not corrected for one row more


def test_the_best_possible_lies_between_the_bound_and_the_best_of_all_rows(tmp_path: Path) -> None:
    rows = [quality_result("frontier", [20.0, 40.0, None]), quality_result("mine", [10.0, None, None])]
    assert not read_results(written(tmp_path, *rows))[0].intervals()
    (compared,) = read_results(written(tmp_path, *rows, quality_result("bound", [5.0, 11.0, 9.0], sees_truth=True)))
    found = {interval.metric.key: interval for interval in compared.intervals()}
    way = found["metres_to_90"]
    assert (way.bound, way.known, way.plans) == (8.0, 25.0, 2)
    assert "| metres to 90% | 8.0 | 25.0 | 2 |" in format_markdown([compared])


def test_without_an_oracle_there_are_no_shares(tmp_path: Path) -> None:
    (compared,) = read_results(written(tmp_path, quality_result("mine", [1.0, 2.0, 3.0])))
    assert not [metric for metric in compared.tables()[0] if metric.key.startswith("share")]


def test_the_best_comes_first(tmp_path: Path) -> None:
    written(tmp_path, budget_result("weak", 0.3), budget_result("strong", 0.8), quality_result("mine", [1.0] * 3))
    found = read_results([tmp_path])
    assert [each.track.id for each in found] == ["exploration-budget-v1", "exploration-quality-v1"]
    assert [entry.name for entry in found[0].entries] == ["strong", "weak"]


def test_trainings_of_one_family_are_one_row(tmp_path: Path) -> None:
    files = written(
        tmp_path,
        quality_result("one", [10.0, 20.0, None], family="learned", training=0),
        quality_result("two", [12.0, 22.0, 33.0], family="learned", training=1),
        quality_result("other", [1.0, 2.0, 3.0], family="others", training=0),
        quality_result("again", [12.0, 22.0, 33.0], family="learned", training=1),
    )
    (compared,) = read_results(files)
    entries = {entry.name: entry for entry in compared.entries}
    assert set(entries) == {"learned (2 trainings)", "other", "again"}
    metres = next(metric for metric in compared.tables()[0] if metric.key == "metres_to_90")
    found = compared.value(entries["learned (2 trainings)"], metres)
    assert found.mean == pytest.approx((10 + 20 + 12 + 22 + 33) / 5)
    assert found.number == 3
    assert found.low is not None
    assert found.high is not None
    assert found.low < found.mean < found.high
    assert "| learned (2 trainings) |" in format_markdown([compared])


def test_two_runs_of_policies_of_one_name_are_two_rows(tmp_path: Path) -> None:
    for name, coverage in (("before", 0.5), ("after", 0.75)):
        (tmp_path / name).mkdir()
        written(tmp_path / name, budget_result("mine.py", coverage))
    (compared,) = read_results([tmp_path / "before", tmp_path / "after"])
    assert [entry.columns(BUDGET.metrics[0].key)[0][0] for entry in compared.plain] == [0.75, 0.5]


def test_what_differs_from_the_baseline_is_told_plan_by_plan(tmp_path: Path) -> None:
    """Ways of 10 to 1000 m, each 1 m shorter than the baseline's: the interval has no width."""
    files = written(
        tmp_path, quality_result("frontier", [11.0, 101.0, 1001.0]), quality_result("mine", [10.0, 100.0, 1000.0])
    )
    (compared,) = read_results(files)
    metric = next(metric for metric in compared.tables()[0] if metric.key == "less_metres_to_90")
    entries = {entry.name: entry for entry in compared.entries}
    assert compared.value(entries["mine"], metric) == Estimate(-1.0, -1.0, -1.0, 3)
    assert compared.value(entries["frontier"], metric).mean is None
    assert "-1.00 [-1.00, -1.00]" in format_markdown([compared])
    (alone,) = read_results(files[1:])
    assert not [metric for metric in alone.tables()[0] if metric.key.startswith("less")]


def test_results_of_other_plans_starts_or_tracks_are_refused(tmp_path: Path) -> None:
    mine = quality_result("mine", [1.0, 2.0, 3.0])
    for change, what in (
        ({"plans": PlansRecord("test", 3, "c" * 64, "b" * 64)}, "plans"),
        ({"episodes": {**mine.episodes, "seed": [7, 8, 9]}}, "starts"),
    ):
        other = msgspec.structs.replace(quality_result("other", [1.0, 2.0, 3.0]), **change)
        with pytest.raises(ConfigError, match=f"expected the {what} of .*mine.json, found others"):
            read_results(written(tmp_path, mine, other))
    later = msgspec.structs.replace(mine, track={**mine.track, "id": "exploration-quality-v9"})
    with pytest.raises(ConfigError, match="a result of track 'exploration-quality-v9'; this version knows"):
        read_results(written(tmp_path, later))
    with pytest.raises(ConfigError, match="found none"):
        read_results([tmp_path / "none"]) if (tmp_path / "none").mkdir() is None else None


def test_cells_have_the_digits_that_count() -> None:
    share, way = Metric("a", "a", "%", "high"), Metric("b", "b", "m", "low")
    assert format_cell(share, Estimate(0.91234, 0.9, 0.925, 5)) == "91.2 [90.0, 92.5]"
    assert format_cell(way, Estimate(123.4, 120.0, 130.6, 5)) == "123 [120, 131]"
    assert format_cell(way, Estimate(1.234, 1.0, 2.0, 5)) == "1.23 [1.00, 2.00]"
    assert format_cell(way, Estimate(None, None, None, 0)) == "-"


def test_pages_say_the_same_as_the_results(tmp_path: Path) -> None:
    found = read_results(written(tmp_path, budget_result("weak", 0.3), budget_result("strong", 0.8)))
    text = format_markdown(found)
    assert text.index("| strong | 80.0 [80.0, 80.0]") < text.index("| weak | 30.0 [30.0, 30.0]")
    write_comparison(found, tmp_path / "page.md", "Mine")
    lines = [line for line in (tmp_path / "page.md").read_text().splitlines() if line and not line.startswith("![")]
    assert lines == [line for line in text.replace("# Policies compared", "# Mine", 1).splitlines() if line]
    for over, _ in BUDGET.curves:
        assert f"![Coverage over {over}](page/{BUDGET.id}-{over}.svg)" in (tmp_path / "page.md").read_text()
        picture = (tmp_path / "page" / f"{BUDGET.id}-{over}.svg").read_text()
        assert "strong" in picture
        assert "var(" not in picture
        assert "#0101" not in picture
    with pytest.raises(ConfigError, match=r"--out: expected a file that ends in .md, found 'page.pdf'"):
        check_file_name(tmp_path / "page.pdf")


def test_p_values_are_corrected_for_the_number_of_rows(tmp_path: Path) -> None:
    """Of 8 changes of signs, 2 are as extreme as three equal signs: 1/4, twice that with two rows, and 1 at most."""
    files = written(
        tmp_path,
        quality_result("frontier", [10.0, 20.0, 30.0]),
        quality_result("longer", [12.0, 23.0, 35.0]),
        quality_result("mixed", [12.0, 17.0, 31.0]),
    )
    (compared,) = read_results(files)
    (metric,) = (metric for metric in compared.tables()[0] if metric.key == "p_metres_to_90")
    found = {entry.name: compared.value(entry, metric) for entry in compared.entries}
    assert found["frontier"].mean is None
    assert found["longer"].mean == pytest.approx(0.5, abs=0.03)
    assert found["mixed"].mean == 1.0
    assert format_cell(metric, found["longer"]) == f"{found['longer'].mean:.3f}"
    assert format_cell(metric, Estimate(0.0004, 0.0004, 0.0004, 3)) == "< 0.001"
    (alone,) = read_results(files[:1])
    assert not any(metric.key.startswith("p_") for metric in alone.tables()[0])


KTH = find_track("kth")


def map_result(name: str, speeds: dict[str, list[float]]) -> Result:
    """The coverage grows by a share a metre until all is seen, on each map from each start."""
    keys, outcomes = [metric.key for metric in KTH.metrics], []
    at = curve_sample_points(300)
    for map_name, starts in speeds.items():
        for number, speed in enumerate(starts):
            curve = {"metres": np.minimum(speed * at, 1.0).tolist()}
            outcomes.append(EpisodeOutcome(Case(map_name, number), dict.fromkeys(keys, 0.5), curve))
    policy = PolicyRecord(name, f"somewhere:{name}", "", 0, False, "discrete", "map")
    return make_result(KTH, policy, PlansRecord("maps", len(outcomes), "a" * 64, "b" * 64), outcomes, TIMES)


def test_results_on_maps_keep_the_curve_of_each_start(tmp_path: Path) -> None:
    files = written(tmp_path, map_result("mine", {"b": [0.01, 0.02], "a": [0.005]}))
    (compared,) = read_results(files)
    curves = collect_map_curves(compared.entries[0])
    assert curves is not None
    assert list(curves.maps) == ["a", "b"]
    (compared,) = read_results(written(tmp_path, map_result("mine", {"10": [0.01], "9": [0.01], "img_2": [0.01]})))
    named = collect_map_curves(compared.entries[0])
    assert named is not None
    assert list(named.maps) == ["9", "10", "img_2"]
    assert curves.at[20] == 75.0
    assert curves.maps["b"][:, 20].tolist() == [0.75, 1.0]
    assert curves.maps["a"][:, 20].tolist() == [0.375]
    assert "map_curves" not in (written(tmp_path, budget_result("mine", 0.5))[0]).read_text()


def test_each_map_has_a_panel_and_each_policy_a_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("houseexpo.pseudoslam.benchmark.page.PANELS", 4)
    names = {f"floor_{number:02d}": [0.01] for number in range(7)}
    found = read_results(written(tmp_path, map_result("mine", names), map_result("other", names)))
    write_comparison(found, tmp_path / "page.md", each_map=True)
    pictures = sorted((tmp_path / "page").glob("kth-v1-maps-*.svg"))
    assert [picture.name for picture in pictures] == ["kth-v1-maps-1.svg", "kth-v1-maps-2.svg"]
    first, second = (picture.read_text() for picture in pictures)
    assert "floor_03" in first
    assert "floor_04" not in first
    assert "floor_06" in second
    assert first.count(">mine<") == first.count(">other<") == 1
    text = (tmp_path / "page.md").read_text()
    assert "Maps 5 to 7 of 7: coverage over metres." in text
    assert "(page/kth-v1-maps-2.svg)" in text
    write_comparison(found, tmp_path / "plain.md")
    assert "maps-1" not in (tmp_path / "plain.md").read_text()


def test_a_policy_has_one_colour_in_all_pictures(tmp_path: Path) -> None:
    """They went by the rank of a policy in its table, so that its colour differed from picture to picture."""
    names = ("frontier", "chooser", "mine", "other")
    budgets = [budget_result(name, 0.9 - 0.1 * rank) for rank, name in enumerate(names)]
    maps = [map_result(name, {"a": [0.01 * (1 + rank)]}) for rank, name in enumerate(names)]  # the order turns round
    found = read_results(written(tmp_path, *budgets, *maps))
    assert [entry.name for entry in found[0].entries] != [entry.name for entry in found[1].entries]
    write_comparison(found, tmp_path / "page.md", each_map=True)
    drawn = [_colours_in((tmp_path / "page" / f"{file}.svg").read_text()) for file in
             (f"{BUDGET.id}-steps", f"{BUDGET.id}-metres", "kth-v1-metres", "kth-v1-maps-1")]  # fmt: skip
    assert all(set(each) == set(names) for each in drawn)
    assert all(each == drawn[0] for each in drawn)
    assert len(set(drawn[0].values())) == len(names)
    alone = assign_colours(
        read_results(written(tmp_path, budget_result("frontier", 0.1), budget_result("chooser", 0.2)))
    )
    assert [alone["frontier", 0], alone["chooser", 0]] == [0, 1]


def _colours_in(svg: str) -> dict[str, str]:
    """The colour of each line of the legend, which stands before its text."""
    found = {}
    for text in re.finditer(r">(frontier|chooser|mine|other)</text>", svg):
        found[text[1]] = re.findall(r"stroke: (#[0-9a-f]{6})", svg[: text.start()])[-1]
    return found


def test_results_without_curves_of_maps_are_left_out(tmp_path: Path) -> None:
    old = msgspec.structs.replace(map_result("old", {"a": [0.01]}), map_curves=msgspec.UNSET, curves={})
    found = read_results(written(tmp_path, old, map_result("mine", {"a": [0.02]})))
    write_comparison(found, tmp_path / "page.md", each_map=True)
    (picture,) = (tmp_path / "page").glob("kth-v1-maps-*.svg")
    assert ">mine<" in picture.read_text()
    assert ">old<" not in picture.read_text()


def test_a_policy_with_several_predictions_is_one_row_but_in_their_table(tmp_path: Path) -> None:
    plain = budget_result("frontier", 0.5)
    for name in ("free", "solid"):
        policy = msgspec.structs.replace(plain.policy, prediction=name)
        keys = [metric.key for metric in prediction_metrics(BUDGET.budgets_m)]
        summary = {**plain.summary, **dict.fromkeys(keys, Estimate(0.25, 0.25, 0.25, 3))}
        episodes = {**plain.episodes, **dict.fromkeys(keys, [0.25] * 3)}
        result = msgspec.structs.replace(plain, policy=policy, summary=summary, episodes=episodes)
        write_result(result, tmp_path / f"{name}.json")
    (compared,) = read_results([*written(tmp_path, budget_result("other", 0.4)), tmp_path / "free.json"])
    assert [entry.name for entry in compared.plain] == ["frontier, prediction free", "other"]
    (compared,) = read_results([*written(tmp_path, plain), *(tmp_path / f"{name}.json" for name in ("free", "solid"))])
    assert [entry.name for entry in compared.plain] == ["frontier"]
    text = format_markdown([compared])
    assert text.count("| frontier |") == 2
    assert text.count("| frontier, prediction solid | 25.0 [25.0, 25.0] |") == 1
