"""Journey 4: made homes -> gallery -> review -> a door, a region, a drop -> built again -> each had its effect.

The first command is that of docs/guide-review.md. What the page sends is sent over HTTP.
"""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest
from shapely import LineString
from typer.testing import CliRunner

from houseexpo import open_dataset
from houseexpo.commands.app import make_app
from tests.builders.drawn import walls_without_door
from tests.journeys.pages import commands
from tests.journeys.reviews import reviewing

PAGE = "docs/guide-review.md"


@pytest.mark.slow
def test_what_a_person_says_of_made_homes_has_its_effect(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    build, serve = commands(PAGE, "serve plans/homes")
    assert serve == "houseexpo serve plans/homes --review"
    done = CliRunner().invoke(make_app(), [*shlex.split(build)[1:], "--workers", "2"])
    assert done.exit_code == 0, done.output
    before = {name: open_dataset("plans/homes")[name] for name in open_dataset("plans/homes").ids}
    drawn = {name: next(walls_without_door(plan), None) for name, plan in before.items()}
    doors = {name: found[0] for name, found in drawn.items() if found is not None}
    assert len(doors) >= 15
    regions = [name for name, plan in before.items() if len(plan.rooms) > 3 and name not in list(doors)[:15]]
    region = regions[0] if regions else next(name for name in before if name in list(doors)[15:])
    dropped = next(name for name in before if name not in {region, *list(doors)[:15]})
    place = before[region].rooms[-1].polygon.representative_point().coords[0]

    with reviewing(Path("plans/homes")) as ann:
        for name, line in list(doors.items())[:15]:
            said = ann.say(name, "door", points=line)
            assert said["effect"]["outcome"] == "done", said
            assert "joins" in said["effect"]["said"]
            assert ann.look(name)["doors"] == len(before[name].doors) + 1  # shown at once as it will be
        assert ann.say(region, "no_room", points=[place])["effect"]["outcome"] == "done"
        x1, y1, x2, _ = before[region].bbox
        nowhere = ann.say(region, "door", points=[[(x1 + x2) / 2, y1 - 1.9], [(x1 + x2) / 2, y1 - 1.2]])
        assert "no effect" in nowhere["error"]
        assert "m from the nearest room" in nowhere["error"] or "no room looks at it" in nowhere["error"]
        ann.say(dropped, "drop", text="too large")
        told = ann.build()
        outcomes = {each["plan"]: each for each in told["outcomes"]}
        assert {name: each["became"] for name, each in outcomes.items()} == {
            **dict.fromkeys([*list(doors)[:15], region], "changed"),
            dropped: "gone",
        }
        assert all(each["effects"] and not each["idle"] for name, each in outcomes.items() if name != dropped)
        assert "too large" in outcomes[dropped]["why"]
        assert [each["built"] for each in ann.look(region)["effects"]] == [True]

    after = open_dataset("plans/homes")
    assert dropped not in after.ids
    for name, line in list(doors.items())[:15]:
        new = [door for door in after[name].doors if door.polygon.distance(LineString(line).centroid) < 0.02]
        assert [door.kind for door in new] == ["door"]
    assert len(after[region].rooms) == len(before[region].rooms) - 1
    untouched = set(before) - {*list(doors)[:15], region, dropped}
    assert all(after.raw(name).strip() for name in untouched)
    assert {name: after[name] for name in untouched} == {name: before[name] for name in untouched}
