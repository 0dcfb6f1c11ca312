"""What a release says of itself: Croissant, data card, citation, deposit, licence."""

from __future__ import annotations

import io
import json
import re
from pathlib import Path

import pytest
import typer
import yaml
from PIL import Image
from typer.testing import CliRunner

from houseexpo.commands.release import release as command
from houseexpo.dataset import open_dataset
from houseexpo.release import PublisherTexts, release
from houseexpo.release.tables import DOORS, PLANS, ROOMS, WINDOWS
from pipeline.algorithm import plan_level
from tests.builders.batch import run_build
from tests.builders.needs import need


def _read(folder: Path, name: str) -> dict[str, object]:
    found: dict[str, object] = json.loads((folder / name).read_text())
    return found


@pytest.mark.slow
def test_croissant_is_valid_and_its_records_can_be_read(made: Path, released: Path) -> None:
    need(modules=["mlcroissant"], how="make readers")
    import mlcroissant

    found = mlcroissant.Dataset(jsonld=str(released / "croissant.json"))
    assert not found.metadata.ctx.issues.errors
    assert not found.metadata.ctx.issues.warnings
    ids = {record["plans/id"].decode() for record in found.records("plans")}
    assert ids == set(open_dataset(made).ids)
    room = next(iter(found.records("rooms")))
    assert set(room) == {f"rooms/{column.name}" for column in ROOMS.columns}
    plan = next(iter(found.records("plans")))
    assert plan["plans/image"].size[0] > 100


def test_croissant_describes_every_column_and_file(released: Path) -> None:
    said = json.loads((released / "croissant.json").read_text())
    assert "http://mlcommons.org/croissant/1.0" in said["conformsTo"]
    fields = {record["name"]: [field["name"] for field in record["field"]] for record in said["recordSet"]}
    assert fields == {table.name: [column.name for column in table.columns] for table in (PLANS, ROOMS, DOORS, WINDOWS)}
    named = {entry["contentUrl"] for entry in said["distribution"] if entry["@type"] == "cr:FileObject"}
    tables = {file.relative_to(released).as_posix() for file in released.rglob("*.parquet")}
    assert named == {*tables, "json.tar.gz"}
    for term in ("dataCollection", "dataBiases", "dataLimitations", "dataUseCases", "personalSensitiveInformation"):
        assert said[f"rai:{term}"]


def test_the_card_has_a_header_and_pictures_that_are_there(made: Path, released: Path) -> None:
    text = (released / "README.md").read_text()
    _, header, body = text.split("---\n", 2)
    said = yaml.safe_load(header)
    assert said["license"] == "cc-by-4.0"
    assert said["size_categories"] == ["n<1K"]
    for config in said["configs"]:
        assert all((released / part["path"]).is_file() for part in config["data_files"])
    pictures = re.findall(r"!\[[^\]]+\]\(([^)]+)\)", body)
    assert len(pictures) == 2
    for name in pictures:
        with Image.open(io.BytesIO((released / name).read_bytes())) as picture:
            assert picture.format == "PNG"
            assert picture.size[0] > 800
    plans = open_dataset(made)
    assert f"{len(plans)} floor plans of houses" in body
    assert f"with {sum(len(plan.rooms) for plan in plans)} rooms" in body  # as many as the tables have rows
    assert not re.search(r"\{%|\{\{ |\bNone\b|\n\n\n", body)


@pytest.mark.slow
def test_the_card_counts_the_furniture_too(tmp_path: Path) -> None:
    run_build([Path("procedural:2")], tmp_path / "two", seed=3, plan=plan_level, furnished=1.0)
    card = (release(tmp_path / "two", tmp_path / "out").folder / "README.md").read_text()
    counts = dict(re.findall(r"^\| (train|val|test) \|.* (\d+) \|$", card, re.MULTILINE))
    assert "| part | plans | rooms | doors | windows | objects |\n|---|---:|---:|---:|---:|---:|\n" in card
    assert sum(map(int, counts.values())) == sum(len(plan.objects) for plan in open_dataset(tmp_path / "two")) > 0


def test_citation_and_licence_agree(released: Path) -> None:
    citation = yaml.safe_load((released / "CITATION.cff").read_text())
    assert citation["title"] == "Eight houses"
    assert [author["name"] for author in citation["authors"]] == ["A. Author", "B. Builder"]
    assert (citation["doi"], citation["license"]) == ("10.5281/zenodo.1234567", "CC-BY-4.0")
    assert "SPDX-License-Identifier: CC-BY-4.0" in (released / "LICENSE").read_text()


def test_without_a_date_nothing_makes_one_up(rooms: Path, tmp_path: Path) -> None:
    out = release(rooms, tmp_path / "three-rooms").folder
    assert "date-released" not in (out / "CITATION.cff").read_text()
    assert "datePublished" not in _read(out, "croissant.json")
    assert _read(out, "croissant.json")["name"] == "three-rooms"
    assert _read(out, "provenance.json")["sources"] == ["houses"]


def test_words_of_others_are_neither_html_nor_markdown(rooms: Path, tmp_path: Path) -> None:
    said = json.loads((rooms / "manifest.json").read_text())
    said["credit"] = "By <b>C.</b> *free* [here](x), https://example.org/a_b"
    (rooms / "manifest.json").write_text(json.dumps(said))
    out = release(rooms, tmp_path / "out", PublisherTexts(title="<i>Rooms</i>")).folder
    card = (out / "README.md").read_text()
    as_it_is = r"By \<b\>C.\</b\> \*free\* \[here\](x), https://example.org/a_b"
    assert card.count(as_it_is) == 2  # in the description, and under the licence
    assert r"# \<i\>Rooms\</i\>" in card
    assert "<b>" not in card
    assert said["credit"] in (out / "LICENSE").read_text()  # which is plain text


def test_examples_in_the_card_name_a_part_that_there_is(rooms: Path, tmp_path: Path) -> None:
    (rooms / "splits").mkdir(exist_ok=True)
    for name, text in (("val", "a\nb\n"), ("held_out", "c\n")):
        (rooms / "splits" / f"{name}.txt").write_text(text)
    out = release(rooms, tmp_path / "out").folder
    card = (out / "README.md").read_text()
    assert "train" not in card.split("## Contents")[0]
    assert '.split("val")' in card
    assert 'split="validation")' in card  # so the header calls it
    assert (out / "rooms" / "val.parquet").is_file()
    assert "/rooms/val.parquet" in card


def test_the_command_releases_and_says_what(rooms: Path, tmp_path: Path) -> None:
    app = typer.Typer()
    app.command()(command)
    run = CliRunner().invoke(app, [str(rooms), "--out", str(tmp_path / "out"), "--title", "Rooms", "--workers", "1"])
    assert run.exit_code == 0, run.output
    assert "Open Database License 1.0 (ODbL-1.0)" in " ".join(run.output.split())
    assert (tmp_path / "out" / "README.md").read_text().count("# Rooms\n") == 1
