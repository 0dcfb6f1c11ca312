"""Drive as a person does it: with keys, by touch, beside an explorer; the path and the map are saved."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("starlette")

from houseexpo import save_plan
from houseexpo.service.service import ServerLimits
from tests.builders.browsing import browser, look, two_rooms, visited
from tests.builders.services import running, service_of

pytestmark = [pytest.mark.slow, pytest.mark.browser]
MADE_MS = 120_000  # kernels may have to be compiled first


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    folder: Path = tmp_path_factory.mktemp("homes") / "houses"
    folder.mkdir()
    save_plan(two_rooms(), folder / "two_rooms.json")
    with running(service_of(folder)) as found:
        yield found


def wait_for(page: Any, what: str, number: int = 1) -> None:
    page.wait_for_function(
        f"(n) => [...document.querySelectorAll('.panel')].filter((panel) => {what}).length >= n",
        arg=number, timeout=MADE_MS,
    )  # fmt: skip


def frames(page: Any, panel: int = 0) -> int:
    return int(page.locator(".panel").nth(panel).get_attribute("data-frame") or 0)


def mapped_m2(page: Any) -> float:
    return float(page.locator(".area").first.inner_text().removesuffix(" m²"))


def test_keys_drive_and_the_map_grows(address: str, tmp_path: Path) -> None:
    with visited(address, "/houses/drive?plan=two_rooms", accept_downloads=True) as page:
        wait_for(page, "panel.dataset.state === 'driving' && panel.dataset.frame")
        before = mapped_m2(page)
        page.keyboard.down("ArrowLeft")
        wait_for(page, "panel.dataset.frame > 40")
        page.keyboard.up("ArrowLeft")
        assert mapped_m2(page) > before
        page.keyboard.down("w")
        wait_for(page, "panel.dataset.frame > 70")
        page.keyboard.up("w")
        page.wait_for_timeout(400)
        still = frames(page)
        page.wait_for_timeout(400)
        assert frames(page) == still  # at rest nothing is sent
        look(page, "drive")
        with page.expect_download() as download:
            page.keyboard.press("f")
        download.value.save_as(tmp_path / "saved.zip")
        assert "trajectory.csv" in zipfile.ZipFile(tmp_path / "saved.zip").namelist()
        page.keyboard.press("r")
        wait_for(page, "panel.dataset.state === 'driving' && panel.dataset.frame < 5")


def test_one_who_waits_is_told_why_and_how_far_it_is(address: str) -> None:
    def compiling(socket: Any) -> None:
        told = {"preparing": {"compiling": True, "functions": 23, "seconds": 14.2}}
        socket.on_message(lambda _: socket.send(json.dumps(told)))

    with visited(address, "/houses/drive?plan=two_rooms") as page:
        page.route_web_socket("**/*", compiling)
        page.reload()
        page.wait_for_selector(".waiting-words:has-text('compiling the simulator')")
        assert "23 functions, 14 s so far" in page.inner_text(".waiting-details")
        assert 0.2 < page.locator(".waiting progress").evaluate("(bar) => bar.value") < 0.6
        look(page, "drive_compiling")


def test_a_drive_ends_with_its_figures(address: str) -> None:
    with visited(address, "/houses/drive?plan=two_rooms&seed=6&people=2") as page:
        wait_for(page, "panel.dataset.state === 'driving' && panel.dataset.frame")
        page.keyboard.down("w")
        wait_for(page, "panel.dataset.steps > 45")
        page.keyboard.up("w")
        page.keyboard.press("e")
        wait_for(page, "panel.dataset.state === 'ended'")
        assert page.inner_text(".result-words") == "Finished"
        assert "driven" in page.inner_text(".figures")
        look(page, "drive-finished")


def test_the_keys_are_listed(address: str) -> None:
    with visited(address, "/houses/drive?plan=two_rooms") as page:
        wait_for(page, "panel.dataset.state === 'driving' && panel.dataset.frame")
        page.keyboard.press("?")
        page.wait_for_selector("dialog#keys[open]")
        look(page, "drive-keys")
        page.keyboard.press("Escape")
        page.wait_for_selector("dialog#keys", state="hidden")
        page.keyboard.press("Tab")  # where the focus was before is where it goes on


def test_two_explorers_side_by_side(address: str) -> None:
    with visited(address, "/houses/drive?plan=two_rooms&driver=frontier&other=information") as page:
        wait_for(page, "panel.dataset.frame > 10", 2)
        page.keyboard.press("p")
        page.wait_for_timeout(500)
        held = frames(page, 0), frames(page, 1)
        page.wait_for_timeout(500)
        assert (frames(page, 0), frames(page, 1)) == held
        look(page, "drive-two")
        assert page.locator(".hold").all_inner_texts() == ["Continue", "Continue"]
        page.keyboard.press("r")
        wait_for(page, "panel.dataset.state === 'driving' && panel.dataset.frame > 3", 2)
        assert page.locator(".hold").all_inner_texts() == ["Pause", "Pause"]  # set down anew, nothing is held
        wait_for(page, "panel.dataset.state === 'ended'", 2)
        assert page.locator(".result-words").all_inner_texts() == ["The whole house is seen", "The whole house is seen"]
        look(page, "drive-two-ended")


def test_touch_drives_on_a_phone_in_the_dark(address: str) -> None:
    context: dict[str, Any] = {"viewport": {"width": 390, "height": 800}, "color_scheme": "dark", "has_touch": True}
    with visited(address, "/houses/drive?plan=two_rooms", **context) as page:
        wait_for(page, "panel.dataset.state === 'driving' && panel.dataset.frame")
        button = page.locator("[data-move=left]")
        button.dispatch_event("pointerdown", {"pointerId": 1, "pointerType": "touch"})
        wait_for(page, "panel.dataset.frame > 20")
        button.dispatch_event("pointerup", {"pointerId": 1, "pointerType": "touch"})
        assert page.evaluate("() => document.documentElement.scrollWidth <= window.innerWidth")
        look(page, "drive-phone")


def test_people_and_obstacles_are_set_down_by_the_form(address: str) -> None:
    with visited(address, "/houses/drive?plan=two_rooms") as page:
        wait_for(page, "panel.dataset.state === 'driving' && panel.dataset.frame")
        page.fill("[name=people]", "2")
        page.fill("[name=obstacles]", "2")
        page.select_option("[name=sensor]", "10 360")
        page.click("#options button[type=submit]")
        wait_for(page, "panel.dataset.state === 'driving' && panel.dataset.frame > 30")  # people walk by themselves
        look(page, "drive-people")


def test_the_address_sets_the_same_robot_down_again(address: str) -> None:
    with visited(address, "/houses/drive?plan=two_rooms&noise=deafening&seed=-3&sensor=10+360") as page:
        wait_for(page, "panel.dataset.state === 'driving' && panel.dataset.frame")
        values = [page.input_value(f"[name={name}]") for name in ("sensor", "noise", "seed", "people")]
        assert values == ["10 360", "none", "0", "0"]  # what cannot be chosen counts as not said
        page.select_option("[name=noise]", "some")
        page.fill("[name=people]", "2")
        page.fill("[name=seed]", "7")
        page.click("#options button[type=submit]")
        wait_for(page, "panel.dataset.state === 'driving' && panel.dataset.frame")
        assert page.url.partition("?")[2] == "plan=two_rooms&driver=you&sensor=10+360&people=2&noise=some&seed=7"
        page.reload()
        wait_for(page, "panel.dataset.state === 'driving' && panel.dataset.frame")
        values = [page.input_value(f"[name={name}]") for name in ("sensor", "noise", "seed", "people")]
        assert values == ["10 360", "some", "7", "2"]


def test_keys_drive_once_a_driver_is_chosen(address: str) -> None:
    with visited(address, "/houses/drive?plan=two_rooms&driver=frontier") as page:
        wait_for(page, "panel.dataset.state === 'driving' && panel.dataset.frame")
        page.locator(".driver").dispatch_event("pointerdown")
        page.locator(".driver").focus()
        page.select_option(".driver", "you")
        wait_for(page, "panel.dataset.state === 'driving' && panel.dataset.frame")
        page.keyboard.down("ArrowLeft")
        wait_for(page, "panel.dataset.frame > 20")
        page.keyboard.up("ArrowLeft")
        assert page.input_value(".driver") == "you"


def test_a_server_without_room_says_what_to_do(tmp_path: Path) -> None:
    save_plan(two_rooms(), tmp_path / "two_rooms.json")
    full = service_of(tmp_path, limits=ServerLimits(sockets_per_client=0))
    with running(full) as there, browser() as opened:
        page = opened.new_page()  # the console has a line about the socket that is refused
        page.goto(f"{there}/{tmp_path.name}/drive")
        page.wait_for_selector(".waiting-words:has-text('there are too many robots')")
        assert page.is_visible(".retry")
