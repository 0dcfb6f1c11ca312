"""COCO, read by pycocotools."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from PIL import Image

from houseexpo.exports import export
from houseexpo.plan.room_labels import LABELS

coco = pytest.importorskip("pycocotools.coco")
pytestmark = pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")  # pycocotools' own


@pytest.fixture
def read(plans, tmp_path):
    files = export(plans, "coco", tmp_path)
    assert files[-1].name == "annotations.json"
    return coco.COCO(str(files[-1]))


def test_rooms_and_doors_are_instances(read, flat, mirrored, tmp_path):
    for number, plan in enumerate([flat, mirrored], start=1):
        info = read.imgs[number]
        pixels = np.asarray(Image.open(tmp_path / "images" / info["file_name"]))
        assert pixels.shape == (info["height"], info["width"])
        found = read.loadAnns(read.getAnnIds(imgIds=number))
        rooms = [a for a in found if "room" in a]
        names = [read.cats[a["category_id"]]["name"] for a in found]
        assert names == ["Living_Room", "Bedroom", "Unlabelled", "door", "opening", "entrance"]
        union = np.any([read.annToMask(a) for a in found if names[found.index(a)] != "entrance"], axis=0)
        free = pixels == 255
        assert union.sum() * info["resolution"] ** 2 == pytest.approx(plan.area, rel=0.01)
        assert (union != free).mean() < 0.02  # row for row: the picture and the polygons lie on each other
        for a, room in zip(rooms, plan.rooms, strict=True):
            assert a["area"] * info["resolution"] ** 2 == pytest.approx(room.area, rel=1e-3)
            x, y, wide, high = a["bbox"]
            rows, cols = np.nonzero(read.annToMask(a))
            assert (x, y, x + wide, y + high) == pytest.approx(
                (cols.min(), rows.min(), cols.max() + 1, rows.max() + 1), abs=1.1
            )


def test_published_plans_give_their_boxes(read, published):
    for number, plan in enumerate(published, start=3):
        found = read.loadAnns(read.getAnnIds(imgIds=number))
        assert {a["source"] for a in found} <= {"box"}
        boxes = [(label, shapely.box(*b)) for label, found_boxes in plan.room_category.items() for b in found_boxes]
        labels = {label for label, b in boxes if label in LABELS and b.intersection(plan.free_space).area > 0}
        assert {read.cats[a["category_id"]]["name"] for a in found} == labels
