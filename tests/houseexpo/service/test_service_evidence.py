"""Why a plan is as it is: what its file says in words, and the picture of its stages where the build kept one."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from starlette.testclient import TestClient

from houseexpo import open_dataset
from houseexpo.errors import UnknownPlanError
from houseexpo.plan import Quality
from houseexpo.service.plan_page import plan_evidence
from houseexpo.service.service import Service
from pipeline.png import encode_png
from tests.builders.services import running, two_rooms

PNG = encode_png(np.full((60, 200, 3), 200, np.uint8))
WHERE = "/api/homes/plans/a1/stages.png"


def pictured(folder: Path, name: str = "a1") -> Path:
    """Write a picture of a plan's stages, as a build does that keeps them."""
    (folder / "stages").mkdir(exist_ok=True)
    (folder / "stages" / f"{name}.png").write_bytes(PNG)
    return folder / "stages" / f"{name}.png"


def test_evidence_is_said_in_words() -> None:
    plan = two_rooms("a1", 4.0, 0.74)
    told = {
        "notes": {"cuts": 1, "boundary": "floor_edge", "new_rule": 2},
        "cuts": [{"door": 0, "why": "a lintel"}],
    }
    cut = replace(plan.doors[0], kind="cut", confidence=0.4)
    quality = Quality(0.74, {"cut_share": 0.5, "guesses": 0.75, "left_out": 0.0, "new_ground": 0.1})
    found = plan_evidence(replace(plan, doors=(cut,), provenance=told, quality=quality))
    assert found.quality == "Quality 0.74: doubtful, since it is below 0.8. 3 of 4 possible faults were found."
    assert found.grounds == [
        ("levels, units, scale, axis or edges of rooms guessed", 0.75),
        ("doors that are cuts, not evidence", 0.5),
        ("new ground", 0.1),
    ]
    assert found.notes == ["cut a wall (1)", "closed an open front by its floor", "new rule (2)"]
    assert found.doors == [
        (0, "cut", "Kitchen and Bedroom", "40%", "a robot could not pass otherwise; cut here: a lintel"),
    ]


def test_the_page_shows_evidence_and_the_stages_that_were_kept(client: TestClient, folder: Path) -> None:
    before = client.get("/homes/plan/a1").text
    assert "a passage under a lintel" in before
    assert "Stages of the build" not in before
    assert client.get(WHERE).status_code == 404
    assert "--keep-stages" in client.get(WHERE).json()["error"]
    pictured(folder)
    after = client.get("/homes/plan/a1").text
    assert f'<img src="{WHERE}" alt="The stages of the build of a1' in after
    assert 'loading="lazy"' in after
    pictured(folder, "d 4&é")
    assert "/api/homes/plans/d%204%26%C3%A9/stages.png" in client.get("/homes/plan/d%204%26%C3%A9").text


def test_the_api_gives_the_picture_and_nothing_that_a_link_leads_to(client: TestClient, folder: Path) -> None:
    file = pictured(folder)
    found = client.get(WHERE)
    assert (found.content, found.headers["content-type"]) == (PNG, "image/png")
    assert client.get(WHERE, headers={"if-none-match": found.headers["etag"]}).status_code == 304
    assert client.get("/api/homes/plans/nobody/stages.png").status_code == 404
    assert client.get("/api/homes/plans/..%2fa1/stages.png").status_code == 404
    file.rename(folder / "elsewhere.png")
    file.symlink_to(folder / "elsewhere.png")
    assert client.get(WHERE).status_code == 404
    assert client.get("/homes/plan/a1").status_code == 200


def test_a_program_gets_it_here_and_from_afar(service: Service, folder: Path) -> None:
    pictured(folder)
    local = open_dataset(folder)
    assert local.stages("a1") == PNG
    assert local.stages("b2") is None
    with pytest.raises(UnknownPlanError, match="no 'nobody'"):
        local.stages("nobody")
    with running(service) as address:
        remote = open_dataset(f"{address}/homes")
        assert Image.open(io.BytesIO(remote.stages("a1") or b"")).size == (200, 60)
        assert remote.stages("b2") is None
        assert open_dataset(f"{address}/published").stages(f"{1:032x}") is None
