"""The page in a real browser: every button, two sensors, every width, keyboard only."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from support.browser import Tab, why_not
from support.virtual_lab import VirtualLab
from support.watching import TOKEN, until

from tactile_core.bundles.bundle import Bundle
from tactile_core.calibration.fitted_bundle import GuidedSession
from tactile_live.desk import Desk
from tactile_live.live_sensor import LiveSensor
from tactile_live.opening import WantedSensor, open_live
from tactile_live.server import LivePage

pytestmark = [
    pytest.mark.pages,
    pytest.mark.skipif(bool(why_not()), reason=why_not()),
]


@pytest.fixture
def virtual(lab: VirtualLab, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Desk]:
    monkeypatch.chdir(tmp_path)
    wanted = WantedSensor(str(lab.profile_path), bundle=lab.bundle)
    # a relative path, because the page shows it in a picture
    desk = Desk(LiveSensor(open_live(wanted, sim=True), Path("tactile-view")))
    desk.live.start()
    yield desk
    desk.close()


def test_every_button_of_a_recording_works(
    page: LivePage, desk: Desk, new_tab: Callable[..., Tab]
) -> None:
    tab = new_tab().open(page)
    tab.press("Tare")
    tab.said("Tared")
    tab.press("Take reference")
    tab.said("Reference taken")
    tab.press("Snapshot")
    tab.said("Saved in")
    assert list(desk.live.out.glob("*/*.npz"))

    tab.press("Record")
    tab.said("Recording to")
    tab.wait(lambda: "Stop" in tab.text('[data-do="record"]'))
    tab.press("Stop")
    tab.said("Recorded")
    assert list(desk.live.out.glob("*.mcap"))

    tab.press("Pause")
    tab.wait(lambda: tab.tab.get_by_role("button", name="Play", exact=True).count())
    assert desk.live.playback is not None
    tab.wait(lambda: desk.live.playback and desk.live.playback.state.paused)
    number = tab.tab.locator(".card").get_attribute("data-number")
    tab.press("Step")
    tab.wait(lambda: tab.tab.locator(".card").get_attribute("data-number") != number)
    tab.press("Play")
    tab.live()
    tab.tab.locator(".speed").select_option("4")
    tab.wait(lambda: desk.live.playback and desk.live.playback.state.speed == 4)
    tab.tab.locator(".loop").uncheck()
    tab.wait(lambda: desk.live.playback and desk.live.playback.state.ended)
    tab.press("Play")
    tab.live()
    assert tab.errors == []


def test_every_map_light_and_number_can_be_chosen(
    page: LivePage, new_tab: Callable[..., Tab]
) -> None:
    tab = new_tab().open(page)
    tab.wait(lambda: tab.tab.locator(".map option").count() == 3)
    for title in ("Gradients x", "height"):
        tab.tab.locator(".map").select_option(label=title)
        tab.live()
        label = f"Map of {title}"
        tab.wait(
            lambda label=label: label in tab.tab.locator(".relief").get_attribute("aria-label")
        )
    for light in ("red", "all"):
        tab.tab.locator(".channel").select_option(label=light)
        tab.live()
    tab.tab.get_by_text("All numbers").click()
    plots = tab.tab.locator(".plot").count()
    tab.tab.get_by_label("Plot max height").uncheck()
    tab.wait(lambda: tab.tab.locator(".plot").count() == plots - 1)
    tab.tab.get_by_text("Health", exact=True).click()
    tab.wait(lambda: "saturated" in tab.text(".findings"))
    tab.tab.locator(".relief").hover()
    tab.wait(lambda: "mm at" in tab.text(".probe"))
    assert tab.errors == []


def test_the_mouse_moves_an_object_on_a_virtual_sensor(
    virtual: Desk, new_tab: Callable[..., Tab]
) -> None:
    with LivePage([virtual], TOKEN) as page:
        tab = new_tab().open(page)
        box = tab.tab.locator(".camera").bounding_box()
        middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        tab.tab.mouse.move(*middle)
        tab.tab.mouse.down()
        tab.wait(lambda: "in contact" in tab.text(".slip"))
        tab.tab.mouse.move(middle[0] + 20, middle[1], steps=3)
        tab.tab.mouse.wheel(0, 100)
        surface = virtual.live.sensor.camera
        tab.wait(lambda: surface.truth and surface.truth.pose.angle_deg > 1)  # type: ignore[attr-defined]
        assert surface.truth.pose.x_mm > 0.2  # type: ignore[attr-defined]
        tab.tab.mouse.up()
        tab.wait(lambda: "no contact" in tab.text(".slip"))
        tab.tab.locator(".object").select_option("cylinder")
        tab.said("cylinder of")
        assert tab.errors == []


def test_an_undeformed_gel_looks_flat(virtual: Desk, new_tab: Callable[..., Tab]) -> None:
    with LivePage([virtual], TOKEN) as page:
        tab = new_tab().open(page)
        tab.wait(lambda: "heights" in tab.text(".solid-note"))
        assert float(tab.text(".solid-note").removeprefix("heights × ")) <= 10


def test_a_page_that_is_loaded_again_shows_and_ends_the_calibration(
    virtual: Desk, new_tab: Callable[..., Tab]
) -> None:
    with LivePage([virtual], TOKEN) as page:
        tab = new_tab().open(page)
        tab.press("Calibrate")
        assert tab.tab.locator(".ball").input_value() == ""
        tab.press("Begin")
        tab.said("give the diameter of the ball")
        tab.tab.locator(".ball").fill("6")
        tab.press("Begin")
        tab.wait(lambda: virtual.guiding.state)
        tab.tab.reload()
        tab.wait(lambda: tab.tab.get_by_role("button", name="End without saving").is_enabled())
        tab.press("End without saving")
        tab.said("The calibration has ended")
        assert virtual.under_way == ""
        assert tab.errors == []


def test_two_sensors_are_on_one_page(
    virtual: Desk, desk: Desk, new_tab: Callable[..., Tab]
) -> None:
    with LivePage([virtual, desk], TOKEN) as page:
        tab = new_tab(viewport={"width": 1800, "height": 900}).open(page)
        tab.live(cards=2)
        one, two = (tab.tab.locator(".card").nth(index).bounding_box() for index in (0, 1))
        assert one["y"] == two["y"]
        assert one["x"] + one["width"] <= two["x"]
        tab.tab.locator(".card").nth(1).get_by_role("button", name="Tare").click()
        tab.wait(lambda: "Tared" in tab.text(".said", 1))
        assert "Tared" not in tab.text(".said", 0)
        assert tab.errors == []


def test_the_page_finds_the_server_again(desk: Desk, new_tab: Callable[..., Tab]) -> None:
    with LivePage([desk], TOKEN) as first:
        tab = new_tab().open(first)
    tab.wait(lambda: "does not answer" in tab.text("#connection"))
    tab.press("Tare")
    tab.said("does not answer")
    with LivePage([desk], TOKEN, port=first.port):
        tab.wait(lambda: tab.text("#connection") == "Connected")
        tab.live()
        tab.press("Tare")
        tab.said("Tared")


@pytest.mark.parametrize("width", [320, 768, 2560])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_fits_every_screen(
    virtual: Desk, new_tab: Callable[..., Tab], width: int, scheme: str
) -> None:
    with LivePage([virtual], TOKEN) as page:
        tab = new_tab(viewport={"width": width, "height": 900}, color_scheme=scheme).open(page)
        tab.tab.get_by_text("All numbers").click()
        tab.live()
        wide = tab.tab.evaluate("document.documentElement.scrollWidth")
        assert wide <= width
        dark = tab.tab.evaluate(
            "getComputedStyle(document.body).backgroundColor.match(/\\d+/g)[0] < 100"
        )
        assert dark == (scheme == "dark")
        for canvas in (".camera", ".relief", ".solid"):
            assert tab.tab.locator(canvas).bounding_box()["width"] <= width
        assert tab.errors == []


def test_the_keyboard_alone_is_enough(virtual: Desk, new_tab: Callable[..., Tab]) -> None:
    with LivePage([virtual], TOKEN) as page:
        tab = new_tab().open(page)
        key = tab.tab.keyboard.press
        reached = set()
        for _ in range(40):
            key("Tab")
            name = tab.tab.evaluate(
                "document.activeElement.dataset.do || document.activeElement.className"
                " || document.activeElement.tagName"
            )
            reached.add(name)
            if name == "tare":
                key("Enter")
                tab.said("Tared")
            if name == "camera held":
                key("ArrowRight")
                key(" ")
                tab.wait(lambda: "in contact" in tab.text(".slip"))
                key("e")
                key("+")
                key(" ")
                tab.wait(lambda: "no contact" in tab.text(".slip"))
            if name == "solid":
                before = tab.tab.evaluate("document.querySelector('.solid').toDataURL()")
                key("ArrowLeft")
                assert before != tab.tab.evaluate("document.querySelector('.solid').toDataURL()")
        assert reached >= {
            "skip", "reference", "tare", "record", "snapshot", "object", "size",
            "depth", "camera held", "channel", "map", "upright", "solid", "SUMMARY",
        }  # fmt: skip


def test_everything_that_can_be_used_has_a_name(virtual: Desk, new_tab: Callable[..., Tab]) -> None:
    with LivePage([virtual], TOKEN) as page:
        tab = new_tab().open(page)
        nameless = tab.tab.evaluate(
            """() => [...document.querySelectorAll('button, select, input, canvas, section')]
            .filter((one) => !one.closest('[hidden]') && !one.getAttribute('aria-hidden'))
            .filter((one) => !(one.getAttribute('aria-label') || one.getAttribute('aria-labelledby')
                || one.labels?.length || one.innerText?.trim()))
            .map((one) => one.outerHTML.slice(0, 80))"""
        )
        assert nameless == []
        assert tab.tab.locator("[role=status]").count() == 2


def test_nothing_is_loaded_from_elsewhere(page: LivePage, new_tab: Callable[..., Tab]) -> None:
    tab = new_tab().open(page)
    assert all(url.startswith((page.address, "blob:")) for url in tab.requests)


def test_a_page_of_another_site_can_neither_frame_nor_command_it(
    page: LivePage, desk: Desk, browser: Any, new_tab: Callable[..., Tab]
) -> None:
    from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

    socket_ = page.address.replace("http", "ws") + "live/0"
    site = f"""<!doctype html><iframe src="{page.address}"></iframe><script>
        window.found = [];
        fetch("{page.address}sensors.json").then((answer) => answer.text())
            .then((text) => found.push(text), () => found.push("refused"));
        const socket = new WebSocket("{socket_}");
        socket.onmessage = () => found.push("heard");
        socket.onclose = () => found.push("closed");
        </script>"""

    class Site(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(site.encode())

        def log_message(self, *args: object) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Site) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        tab = new_tab()
        tab.tab.goto(f"http://127.0.0.1:{server.server_port}/")
        tab.wait(lambda: tab.tab.evaluate("found.length") >= 2)
        assert sorted(tab.tab.evaluate("found")) == ["closed", "refused"]
        assert tab.tab.frames[1].locator(".card").count() == 0
        server.shutdown()


def test_a_slow_browser_does_not_delay_the_sensor(
    page: LivePage, desk: Desk, new_tab: Callable[..., Tab]
) -> None:
    tab = new_tab().open(page)
    tab.tab.evaluate("tactile.limit(1)")
    tab.tab.wait_for_timeout(1500)
    before, shown = desk.live.newest.count, tab.pictures()
    tab.tab.wait_for_timeout(3000)
    assert tab.pictures() - shown <= 5
    assert desk.live.newest.count - before > 15


def test_several_pages_show_the_same(page: LivePage, new_tab: Callable[..., Tab]) -> None:
    with ExitStack():
        tabs = [new_tab().open(page) for _ in range(3)]
        for tab in tabs:
            tab.live()
    until(lambda: all(tab.errors == [] for tab in tabs))


def pressed_where_asked(tab: Tab, desk: Desk) -> None:
    """Press the ball at the ring, as deep as the ring is large, until it says to lift it."""
    live = desk.live
    guidance = tab.wait(lambda: live.guidance and live.guidance.state == "press" and live.guidance)
    (x, y), image = guidance.target_px, live.sensor.profile.image
    radius_mm = guidance.target_radius_px * image.mm_per_px
    depth_mm = 3.0 - (9.0 - min(radius_mm, 2.9) ** 2) ** 0.5
    tab.tab.locator(".depth").fill(f"{depth_mm:.2f}")
    tab.tab.locator(".camera").scroll_into_view_if_needed()
    box = tab.tab.locator(".camera").bounding_box()
    place = (
        box["x"] + (x + 0.5) / image.width_px * box["width"],
        box["y"] + (y + 0.5) / image.height_px * box["height"],
    )
    tab.tab.mouse.move(*place)
    tab.tab.mouse.down()
    tab.wait(lambda: live.guidance and live.guidance.state == "lift")
    tab.tab.mouse.up()
    tab.wait(lambda: live.guidance and live.guidance.state == "press")
    tab.wait(lambda: live.guidance and not live.guidance.examining)


def test_a_calibration_is_led_saved_and_used(
    virtual: Desk, new_tab: Callable[..., Tab], tmp_path: Path
) -> None:
    folder = Path(os.environ.get("TACTILE_SCREENSHOTS", tmp_path))
    with LivePage([virtual], TOKEN) as page:
        tab = new_tab(viewport={"width": 1360, "height": 1100}).open(page)
        tab.tab.locator(".size").fill("6")
        tab.tab.locator(".size").press("Enter")
        tab.said("sphere of 6 mm")
        tab.press("Calibrate")
        tab.tab.locator(".ball").fill("6")
        tab.tab.locator(".measured-with").fill("ring gauge")
        tab.press("Begin")
        tab.said("Reference taken")
        while virtual.live.guidance is None or virtual.live.guidance.kept < 3:
            pressed_where_asked(tab, virtual)
        tab.wait(lambda: tab.text(".kept").startswith("3"))
        assert "Press the ball at the ring" in tab.text(".say")
        picture(tab, folder / "live_page_calibration.webp")
        tab.press("Finish and save")
        tab.said("the sensor measures with it")
        tab.live()
        report = tab.tab.get_by_role("link", name="Report").get_attribute("href")
        tab.tab.goto(page.address + report)
        assert "virtual_lab" in tab.tab.inner_text("body")
        assert tab.errors == []
    (bundle,) = virtual.live.out.glob("*_bundle")
    manifest = Bundle.load(bundle).manifest
    assert (manifest.profile, manifest.measured_with) == ("virtual_lab", "ring gauge")
    (session,) = virtual.live.out.glob("*_calibration.mcap")
    presses = GuidedSession.from_recording(session)
    assert presses is not None
    assert len(presses.stamps_s) >= 3


def picture(tab: Tab, path: Path) -> None:
    """Save a picture of the whole page."""
    taken = tab.tab.screenshot(full_page=True)
    pixels = cv2.imdecode(np.frombuffer(taken, np.uint8), cv2.IMREAD_COLOR)
    encoded = cv2.imencode(".webp", pixels, [cv2.IMWRITE_WEBP_QUALITY, 82])[1]
    assert len(encoded) < 300_000
    path.write_bytes(encoded.tobytes())


def sheared(tab: Tab, camera: Any) -> None:
    """Press a ball onto a virtual sensor and shear the gel, with the mouse."""
    tab.tab.locator(".size").fill("9")
    tab.tab.locator(".size").press("Enter")
    tab.said("sphere of 9 mm")
    deep_mm = 0.9 * float(tab.tab.locator(".depth").input_value())
    box = tab.tab.locator(".camera").bounding_box()
    x, y = (box["x"] + 0.45 * box["width"], box["y"] + 0.5 * box["height"])
    tab.tab.mouse.move(x, y)
    tab.tab.mouse.down()
    tab.wait(lambda: camera.truth and camera.truth.depth_mm > deep_mm)
    tab.tab.mouse.move(x + 0.06 * box["width"], y + 0.02 * box["height"], steps=4)
    tab.wait(lambda: camera.truth.displacement_mm.max() > 0.25)
    tab.live()
    tab.tab.wait_for_timeout(500)


@pytest.mark.timeout(280)
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_pictures_of_the_documentation(
    fingertip: Desk, new_tab: Callable[..., Tab], tmp_path: Path, scheme: str
) -> None:
    folder = Path(os.environ.get("TACTILE_SCREENSHOTS", tmp_path))
    with LivePage([fingertip], TOKEN) as page:
        tab = new_tab(viewport={"width": 1360, "height": 800}, color_scheme=scheme).open(page)
        sheared(tab, fingertip.live.sensor.camera)
        picture(tab, folder / f"live_page_{scheme}.webp")
        tab.tab.mouse.up()
        assert tab.errors == []
