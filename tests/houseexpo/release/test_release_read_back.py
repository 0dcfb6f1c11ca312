"""The tables of a release, read with the tools that people have."""

from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
import shapely
from PIL import Image

from houseexpo.analysis.audit import audit_plan
from houseexpo.dataset import open_dataset
from houseexpo.dataset.validation import validate_dataset
from houseexpo.release.tables import PLANS, TableWriter
from pipeline.sources.sound_homes.programme import KINDS
from tests.builders.needs import need

PARTS = ("train", "val", "test")


def _files(released: Path, table: str) -> list[Path]:
    found = [released / table / f"{part}.parquet" for part in PARTS]
    return [file for file in found if file.exists()]


def test_our_own_library_opens_the_folder(made: Path, released: Path) -> None:
    before, after = open_dataset(made), open_dataset(released)
    assert after.ids == before.ids
    assert [after.raw(name) for name in after.ids] == [before.raw(name) for name in before.ids]
    assert sorted(name for ids in after.splits.values() for name in ids) == before.ids
    assert len(after.split("train")) == len(pq.read_table(released / "plans" / "train.parquet"))
    assert after.path == released
    assert not validate_dataset(released).findings


def test_rows_say_what_the_plans_say(made: Path, released: Path) -> None:
    plans = open_dataset(made)
    rows = {row["id"]: row for file in _files(released, "plans") for row in pq.read_table(file).to_pylist()}
    assert sorted(rows) == plans.ids
    audits = {}
    for plan in plans:
        row = rows[plan.id]
        assert (row["rooms"], row["source_rooms"]) == (len(plan.rooms), plan.room_num)
        assert (row["doors"], row["area"]) == (len(plan.doors), round(plan.area, 2))
        assert row["reached_20cm"] == plan.navigability["0.20"].largest_share
        assert row["narrowest"] == plan.navigability["0.20"].narrowest
        assert shapely.from_wkb(row["geometry"]).equals(plan.free_space)
        assert row["source"] == "procedural"
        assert row["kind"] in KINDS
        assert row["stairs"] == [
            *(room.source_labels for room in plan.rooms),
            *((o.label,) for o in plan.objects),
        ].count(("stairs",))
        audit = audit_plan(plan)
        assert audit is not None
        assert set(row["broken_rules"]) == audit.broken_rules()
        audits[plan.id] = {room.id: room for room in audit.rooms}
    rooms = [row for file in _files(released, "rooms") for row in pq.read_table(file).to_pylist()]
    doors = [row for file in _files(released, "doors") for row in pq.read_table(file).to_pylist()]
    assert sum(row["stairs"] for row in rows.values()) > 0
    assert len(rooms) == sum(len(plan.rooms) for plan in plans)
    for row in rooms:
        found = audits[row["plan_id"]][row["room"]]
        assert (row["clear_width"], row["aspect"]) == (found.width_m, found.aspect)
        assert row["broken_rules"] == sorted(found.broken_rules())
    windows = [row for file in _files(released, "windows") for row in pq.read_table(file).to_pylist()]
    assert len(windows) == sum(row["windows"] for row in rows.values()) == sum(len(plan.windows) for plan in plans) > 0
    for room in rooms:
        here = [each for each in windows if each["plan_id"] == room["plan_id"]]
        own = [each for each in here if room["room"] in {each["room_a"], each["room_b"]}]
        assert room["windows"] == len(own)
        assert room["window_area"] == pytest.approx(sum(w["width"] * (w["head"] - w["sill"]) for w in own), abs=0.006)
    assert len(doors) == sum(len(plan.doors) for plan in plans)
    outside = [row for row in doors if row["kind"] == "entrance"]
    assert outside
    assert all(row["room_b"] is None for row in outside)
    lengths = [shapely.from_wkb(row["segment"]).length for row in doors]
    assert np.allclose(lengths, [row["width"] for row in doors], atol=0.021)


def test_pictures_are_png_in_the_struct_that_viewers_know(released: Path) -> None:
    table = pq.read_table(released / "plans" / "train.parquet")
    first = table.column("image")[0].as_py()
    with Image.open(io.BytesIO(first["bytes"])) as picture:
        assert picture.format == "PNG"
        assert 200 < max(picture.size) < 400
        assert len(picture.convert("RGB").getcolors(10**6)) > 4
    assert json.loads(table.schema.metadata[b"huggingface"])["info"]["features"] == {"image": {"_type": "Image"}}


def test_the_metadata_is_that_of_geoparquet(released: Path) -> None:
    for name in ("plans", "rooms", "doors"):
        for file in _files(released, name):
            geo = json.loads(pq.read_schema(file).metadata[b"geo"])
            assert geo["version"] == "1.1.0"
            assert geo["primary_column"] == "geometry"
            table = pq.read_table(file)
            for column, about in geo["columns"].items():
                assert (about["encoding"], about["crs"]) == ("WKB", None)
                shapes = shapely.from_wkb(table.column(column).to_pylist())
                assert {shape.geom_type for shape in shapes} <= set(about["geometry_types"])
                if about.get("orientation"):
                    assert all(ring.is_ccw for shape in shapes for ring in [shapely.get_exterior_ring(shape)])


def test_row_groups_are_small(tmp_path: Path) -> None:
    noise = np.random.default_rng(0).bytes(2**20)
    row = {"id": "a", "image": {"bytes": noise, "path": "a.png"}, "geometry": b""}
    with TableWriter(tmp_path / "t.parquet", PLANS) as writer:
        for _ in range(70):
            writer.add([row])
    found = pq.ParquetFile(tmp_path / "t.parquet").metadata
    sizes = [found.row_group(number).total_byte_size for number in range(found.num_row_groups)]
    assert found.num_rows == writer.rows == 70
    assert len(sizes) == 3
    assert max(sizes) < 100e6


def test_geopandas_reads_metres_without_a_reference_system(made: Path, released: Path) -> None:
    need(modules=["geopandas"], how="make readers")
    import geopandas

    rooms = geopandas.read_parquet(released / "rooms" / "train.parquet")
    assert rooms.crs is None
    assert np.allclose(rooms.area, rooms["area"], atol=0.01)
    doors = geopandas.read_parquet(released / "doors" / "train.parquet")
    assert doors.geometry.name == "geometry"
    assert set(doors["segment"].geom_type) == {"LineString"}
    plan = open_dataset(made)[rooms.plan_id[0]]
    assert rooms.geometry[0].equals(plan.rooms[0].polygon)


def test_duckdb_reads_and_counts(made: Path, released: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    need(modules=["duckdb"], how="make readers")
    import duckdb

    monkeypatch.chdir(released)
    with duckdb.connect() as database:
        found = dict(database.execute("SELECT label, count(*) FROM 'rooms/*.parquet' GROUP BY label").fetchall())
        query = "SELECT count(*) FROM 'rooms/*.parquet' r JOIN 'plans/*.parquet' p ON r.plan_id = p.id"
        joined = database.execute(query).fetchone()
    labels = [room.label for plan in open_dataset(made) for room in plan.rooms]
    assert found == {label: labels.count(label) for label in labels}
    assert joined == (len(labels),)


def test_hugging_face_reads_it_offline(
    made: Path, released: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("HF_HUB_OFFLINE", "HF_DATASETS_OFFLINE"):
        monkeypatch.setenv(name, "1")
    monkeypatch.setenv("HF_HOME", str(tmp_path / "home"))
    need(modules=["datasets"], how="make readers")
    import datasets

    plans = datasets.load_dataset(str(released), "plans", cache_dir=str(tmp_path / "cache"))
    assert sorted(plans) == sorted(
        {"val": "validation"}.get(file.stem, file.stem) for file in _files(released, "plans")
    )
    first = plans["train"][0]
    assert first["image"].size[0] > 100
    assert open_dataset(made)[first["id"]].room_num == first["source_rooms"]
    rooms = datasets.load_dataset(str(released), "rooms", split="train", cache_dir=str(tmp_path / "cache"))
    assert set(rooms["split"]) == {"train"}
