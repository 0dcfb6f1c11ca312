"""The corpus: its list is sound, and a run says what came of files that lie in a folder of checkouts."""

from __future__ import annotations

import re
import subprocess
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
import pytest
import trimesh
from PIL import Image

from houseexpo.errors import ConfigError
from houseexpo.files import sha256_of
from tests.builders.batch import one_room
from tests.builders.shared import DATA, needs_shared
from tests.corpus.__main__ import main
from tests.corpus.manifest import File, Verdict, dump, fetch, load
from tests.corpus.runs import Outcome, Plan, changes, load_results, same, verdict_of

ROOM = Plan("", 2, 1, 0, 20.0, 0.9, "aaaaaaaaaa")


def file(name: str, path: Path | None = None, *, interior: bool = True, **values: object) -> File:
    sha256 = sha256_of(path) if path else "0" * 64
    return File(name, f"{name}/houses", path.name if path else "house.glb", sha256, "artist", interior, **values)


@dataclass
class Corpus:
    """A folder of checkouts with four files: a room, a table, notes, and one that is not there."""

    folder: Path

    @property
    def files(self) -> list[File]:
        room = one_room(self.folder / "room+houses" / "house.ply", 5.0)
        table = self.folder / "table+houses" / "table.ply"
        table.parent.mkdir(exist_ok=True)
        trimesh.creation.box((1.2, 0.8, 0.7)).export(table)
        notes = self.folder / "notes+houses" / "notes.unknown"
        notes.parent.mkdir(exist_ok=True)
        notes.write_text("no house\n")
        return [file("room", room), file("table", table, interior=False), file("notes", notes), file("gone")]

    def run(self, files: list[File], *options: str) -> int:
        manifest, results = self.folder / "manifest.toml", self.folder / "results.json"
        dump(files, manifest)
        return main([str(self.folder), "--workers=1", f"--manifest={manifest}", f"--results={results}", *options])

    def outcomes(self) -> dict[str, Outcome]:
        return load_results(self.folder / "results.json")


@pytest.fixture(scope="module")
def corpus(tmp_path_factory: pytest.TempPathFactory) -> Corpus:
    return Corpus(tmp_path_factory.mktemp("corpus"))


def test_a_run_says_what_came_of_each_file(corpus: Corpus, capsys: pytest.CaptureFixture[str]) -> None:
    files = corpus.files
    assert corpus.run(files, "--record", "first", "--both-halves") == 0
    said = capsys.readouterr().out
    assert "3 of 4 files" in said
    assert "missing: gone+houses/house.glb" in said
    room, table, notes = (corpus.outcomes()[each.key] for each in files[:3])
    assert [plan.rooms for plan in room.plans] == [1]
    assert room.plans[0].area_m2 == pytest.approx(20, abs=0.1)
    assert not table.plans
    assert table.rejected
    assert notes.fault.startswith("refused: ")
    assert f"room (to be judged): {room.plans[0].line}" in said


def test_a_map_is_told_by_its_picture(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shades = np.full((80, 100), 205, np.uint8)
    shades[8:72, 8:92] = 0
    shades[10:70, 10:90] = 254
    folder = tmp_path / "room+maps" / "maps"
    folder.mkdir(parents=True)
    Image.fromarray(shades).save(folder / "room.pgm")
    (folder / "room.yaml").write_text("image: room.pgm\nresolution: 0.05\norigin: [-1.0, -2.0, 0.3]\n")
    picture = sha256_of(folder / "room.pgm")
    room = File("room", "room/maps", "maps/room.yaml", picture, "map", True, needs=["maps/room.pgm"])
    assert Corpus(tmp_path).run([room], "--record", "first", "--both-halves") == 0
    (plan,) = Corpus(tmp_path).outcomes()[room.key].plans
    assert plan.area_m2 == pytest.approx(12.0, abs=0.3)
    (folder / "room.pgm").write_bytes(b"P5 1 1 255 0")
    assert Corpus(tmp_path).run([room]) == 2
    assert "0 of 1 files" in capsys.readouterr().out


def test_names_of_the_second_half_are_not_shown(corpus: Corpus, capsys: pytest.CaptureFixture[str]) -> None:
    files = corpus.files
    assert {each.half for each in files} == {1, 2}
    assert corpus.run(files) == 0
    said = capsys.readouterr().out
    for each in files[:3]:
        assert each.half == 1 or each.repository not in said
    whole = (corpus.folder / "results.json").read_text()
    assert not any(each.path in whole for each in files if each.half == 2)


def test_another_file_of_the_same_name_is_left_out(corpus: Corpus, capsys: pytest.CaptureFixture[str]) -> None:
    files = corpus.files[:1]
    one_room(files[0].place(corpus.folder), 6.0)
    assert corpus.run(files) == 2
    assert "0 of 1 files" in capsys.readouterr().out


def test_a_folder_has_to_be_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("HOUSEEXPO_CORPUS", raising=False)
    assert main([]) == 2


def test_files_are_fetched_from_where_they_were_published(tmp_path: Path) -> None:
    published = tmp_path / "host" / "some" / "houses"
    (published / "parts").mkdir(parents=True)
    for name, words in (("house.obj", "v 0 0 0"), ("parts/house.mtl", "newmtl a"), ("other.obj", "v 1 1 1")):
        (published / name).write_text(words)
    git = ("git", "-C", published, "-c", "user.name=a", "-c", "user.email=a@b.c")
    for words in (("init", "-q"), ("add", "."), ("commit", "-qm", "a"), ("config", "uploadpack.allowFilter", "true")):
        subprocess.run((*git, *words), check=True)
    sha256 = sha256_of(published / "house.obj")
    house = File("house", "some/houses", "house.obj", sha256, "artist", True, needs=["parts"])
    changed, gone = File("b", "some/houses", "other.obj", "0" * 64, "artist", True), file("gone")
    failed = fetch([house, changed, gone], tmp_path / "checkouts", f"file://{tmp_path}/host/")
    assert house.is_in(tmp_path / "checkouts")
    assert (tmp_path / "checkouts" / "some+houses" / "parts" / "house.mtl").is_file()
    assert [line.split(":")[0] for line in failed] == ["some/houses other.obj", "gone/houses house.glb"]
    assert fetch([house], tmp_path / "checkouts", "file:///nowhere/") == []


@pytest.mark.parametrize(
    ("plan", "verdict", "stands"),
    [
        (ROOM, Verdict.PARTLY, True),
        (msgspec.structs.replace(ROOM, area_m2=20.3, digest="bbbbbbbbbb", quality=0.5), Verdict.PARTLY, True),
        (msgspec.structs.replace(ROOM, area_m2=21.0), Verdict.OPEN, False),
        (msgspec.structs.replace(ROOM, doors=2), Verdict.OPEN, False),
    ],
)
def test_a_verdict_holds_for_what_was_seen(plan: Plan, verdict: Verdict, stands: bool) -> None:
    seen = file("a", verdict=Verdict.PARTLY, seen=[ROOM.line])
    assert verdict_of(seen, Outcome([plan], [])) == (verdict, stands)


def test_where_nobody_looked_a_rejection_speaks_for_itself() -> None:
    plan, rejection = Outcome([ROOM], []), Outcome([], ["source: no_level"])
    house, none = file("a"), file("b", interior=False)
    assert verdict_of(house, rejection)[0] == Verdict.REJECTED_WRONGLY
    assert verdict_of(none, rejection)[0] == Verdict.REJECTED_RIGHTLY
    assert verdict_of(none, plan)[0] == Verdict.PLAN_OF_NO_HOUSE


def test_changes_are_told_line_by_line() -> None:
    before = Outcome([ROOM], ["source: no_level"])
    assert changes(file("a"), before, before) == []
    assert changes(file("a"), None, before) == ["not built before"]
    surer = Outcome([msgspec.structs.replace(ROOM, quality=0.95)], before.rejected)
    assert changes(file("a"), before, surer) == ["quality: 0.90 -> 0.95"]
    more = Outcome([msgspec.structs.replace(ROOM, rooms=3)], before.rejected)
    assert [line[:9] for line in changes(file("a"), before, more)] == [
        "- 2 rooms",
        "- source:",
        "+ 3 rooms",
        "+ source:",
    ]
    assert not same(before.lines, more.lines)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[[file]]\nname = 1", "file 1"),
        ('[[file]]\nname = "a"\nkind = "boat"\ninterior = true', "boat"),
        ('[[file]]\nname = "a"\nkind = "ifc"\ninterior = false\nverdict = "right"', "expected one of rejected rightly"),
        ('[[file]]\nname = "a"\nkind = "ifc"\ninterior = false\ncolour = "red"', "colour"),
    ],
)
def test_a_faulty_list_is_refused(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "manifest.toml"
    path.write_text(f'{text}\nrepository = "a/b"\npath = "c"\nsha256 = ""\n')
    with pytest.raises(ConfigError, match=said):
        load(path)


def test_the_list_is_as_it_is_written(tmp_path: Path) -> None:
    files = load()
    dump(files, tmp_path / "again.toml")
    assert load(tmp_path / "again.toml") == files
    assert len({each.sha256 for each in files}) == len(files)
    assert all(re.fullmatch("[0-9a-f]{64}", each.sha256) for each in files)


@needs_shared
def test_no_file_is_of_a_repository_that_judges() -> None:
    text = (DATA / "JUDGED.md").read_text().lower()
    judged = set(re.findall(r"[\w.-]+/[\w.-]+", text))
    assert len(judged) > 40
    assert not judged & {each.repository.lower() for each in load()}
