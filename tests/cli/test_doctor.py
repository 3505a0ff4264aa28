"""``tactile doctor``: what is wrong with a sensor, and what to do."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from itertools import count
from pathlib import Path

import cv2
import numpy as np
import pytest
from support.command_line import refused, tactile
from support.light_box import LightBox, light_box
from support.live_sensor import NAMES, PERIOD_S, profile, send, stream
from support.live_sensor import box as serial_box
from support.mjpeg_server import Exchange, MjpegServer
from support.sysfs import Sysfs
from support.virtual_lab import VirtualLab

from tactile_core.builtin.cameras.uvc_camera import UvcCamera
from tactile_core.builtin.leds import serial_link
from tactile_core.pipeline import examination

on_linux = pytest.mark.skipif(sys.platform != "linux", reason="needs Linux")


READS_S = examination._READS_S


@pytest.fixture(autouse=True)
def _short_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(serial_link, "_HELLO_S", 0.5)
    monkeypatch.setattr(examination, "_READS_S", 0.3)


@pytest.fixture
def url() -> Iterator[str]:
    with MjpegServer(send) as server:
        yield server.url


def examined(*words: object) -> tuple[int, dict[str, tuple[str, str]]]:
    """Exit code of the doctor, and verdict and message of each part."""
    done = tactile("doctor", *words, "--json")
    assert done.stderr == ""
    found = json.loads(done.stdout)
    assert found["verdict"] == ("problem" if done.returncode else "ok")
    checks = {check["part"]: (check["verdict"], check["message"]) for check in found["checks"]}
    return done.returncode, checks


def verdicts(checks: dict[str, tuple[str, str]], part: str) -> dict[str, str]:
    return {name: one for name, (one, _) in checks.items() if name.startswith(part)}


def test_a_stream_that_works_is_read_and_judged(
    tmp_path: Path, url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(examination, "_READS_S", READS_S)
    code, checks = examined(profile(tmp_path, stream(url)))
    assert code == 0
    assert set(verdicts(checks, "camera ").values()) == {"ok"}
    assert checks["camera found"] == ("ok", url)
    assert checks["lights"] == ("unknown", "the profile names no driver, so nothing sets them")
    assert checks["observation"] == ("ok", "64 × 48, 3 channels")
    assert checks["rate"][0] == "ok"
    assert checks["rate"][1].endswith("Hz")
    assert checks["reference"][0] == "unknown"


def test_the_text_says_the_same_line_by_line(tmp_path: Path, url: str) -> None:
    done = tactile("doctor", profile(tmp_path, stream(url)))
    lines = done.stdout.splitlines()
    assert done.returncode == 0
    assert "ok       plugin core" in lines
    assert f"ok       camera found: {url}" in lines
    assert lines[lines.index("unknown  lights") + 1].strip() == (
        "the profile names no driver, so nothing sets them"
    )


@on_linux
def test_without_a_device_each_part_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(UvcCamera, "sysfs", Sysfs(tmp_path / "sys").root)
    camera, lights = "{use: core.uvc, serial: C310A001}", serial_box("/dev/tty_absent")
    code, checks = examined(profile(tmp_path, camera, lights))
    assert code == 1
    assert verdicts(checks, "camera") == {
        "camera library": "ok",
        "camera found": "problem",
        "camera permission": "unknown",
        "camera not busy": "unknown",
        "camera bandwidth": "unknown",
    }
    assert "no USB camera is connected (wanted: serial C310A001)" in checks["camera found"][1]
    assert checks["lights found"][0] == "problem"
    assert "there is no serial port /dev/tty_absent; plug the" in checks["lights found"][1]
    assert checks["observation"] == ("unknown", "it is not open, because of the problem above")


@on_linux
def test_two_of_a_kind_are_listed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sysfs = Sysfs(tmp_path / "sys")
    sysfs.plug("1-1", serial="A")
    sysfs.plug("1-2", serial="B")
    monkeypatch.setattr(UvcCamera, "sysfs", sysfs.root)
    code, checks = examined(profile(tmp_path, '{use: core.uvc, usb_id: "046d:081b"}'))
    assert code == 1
    assert "2 cameras match usb_id 046d:081b" in checks["camera found"][1]
    assert "write 'serial' in 'camera'" in checks["camera found"][1]


def test_a_library_that_is_missing_is_named_with_its_command(
    tmp_path: Path, url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "serial", None)
    driver = "{use: core.serial_leds, lights: [red, green, blue]}"
    code, checks = examined(profile(tmp_path, stream(url), driver))
    assert code == 1
    assert checks["lights library"][0] == "problem"
    assert "pip install 'tactile-core[serial]'" in checks["lights library"][1]
    assert set(verdicts(checks, "camera ").values()) == {"ok"}


@pytest.fixture
def box() -> Iterator[LightBox]:
    pytest.importorskip("serial", reason="needs pyserial")
    with light_box(lights=3) as one:
        yield one


def with_box(folder: Path, url: str, box: LightBox, more: str = "") -> Path:
    names = (*NAMES, more) if more else NAMES
    return profile(folder, stream(url), serial_box(box.port, names))


@pytest.fixture
def lit_url(box: LightBox) -> Iterator[str]:
    """A camera that sees the lights of the box."""

    def send_lit(exchange: Exchange) -> None:
        exchange.begin()
        for number in count():
            if exchange.stopped.wait(PERIOD_S):
                return
            picture = np.full((48, 64, 3), 20, np.uint8)
            picture += np.uint8(100 if box.levels and any(box.levels[-1]) else 0)
            picture[0, 0, 0] = number % 256
            exchange.send_image(bytes(cv2.imencode(".png", picture)[1]))

    with MjpegServer(send_lit) as server:
        yield server.url


@on_linux
def test_a_light_that_no_image_shows_is_a_problem(tmp_path: Path, url: str, box: LightBox) -> None:
    code, checks = examined(with_box(tmp_path, url, box))
    assert code == 1
    assert verdicts(checks, "lights shine") == {"lights shine": "problem"}
    assert "has 100 counts without the lights and 100 with them" in checks["lights shine"][1]
    assert box.levels[-1] == [0, 0, 0]


@on_linux
def test_a_light_box_that_answers_is_examined_and_left_dark(
    tmp_path: Path, lit_url: str, box: LightBox
) -> None:
    code, checks = examined(with_box(tmp_path, lit_url, box))
    assert code == 0, checks
    assert set(verdicts(checks, "lights").values()) == {"ok"}
    assert checks["lights watchdog"][1] == "the lights go out 0.4 s after the program is killed"
    assert box.levels[-1] == [0, 0, 0]


@on_linux
def test_a_box_with_another_number_of_lights_is_a_problem(
    tmp_path: Path, url: str, box: LightBox
) -> None:
    code, checks = examined(with_box(tmp_path, url, box, "white"))
    assert code == 1
    assert checks["lights opens"][0] == "problem"
    assert "has 3 lights, but 'lights' of the light driver names 4" in checks["lights opens"][1]


@on_linux
def test_a_busy_port_names_who_holds_it(tmp_path: Path, url: str, box: LightBox) -> None:
    holder = subprocess.Popen(
        [sys.executable, "-c", HOLDER, box.port], stdout=subprocess.PIPE, text=True
    )
    assert holder.stdout is not None
    with holder, holder.stdout:
        holder.stdout.readline()
        try:
            code, checks = examined(with_box(tmp_path, url, box))
        finally:
            holder.kill()
    assert code == 1
    assert verdicts(checks, "lights") == {
        "lights library": "ok",
        "lights found": "ok",
        "lights permission": "ok",
        "lights not busy": "problem",
    }
    assert f"(process {holder.pid})" in checks["lights not busy"][1]


HOLDER = """
import sys, time, serial
port = serial.Serial(sys.argv[1], exclusive=True)
print("open", flush=True)
time.sleep(60)
"""


@on_linux
def test_a_silent_box_is_a_problem(tmp_path: Path, url: str, box: LightBox) -> None:
    box.answer = lambda words: b""
    code, checks = examined(with_box(tmp_path, url, box))
    assert code == 1
    assert "does not answer and is no box with the light protocol" in checks["lights opens"][1]


def test_a_recording_is_examined_without_a_device(lab: VirtualLab) -> None:
    code, checks = examined(lab.profile_path, "--bundle", lab.bundle, "--input", lab.presses)
    assert code == 0
    assert checks["observation"] == ("ok", "160 × 120, 3 channels")
    assert checks["light red"][0] == "ok"
    assert not verdicts(checks, "camera")


def test_what_is_wrong_with_the_light_is_a_problem(lab: VirtualLab, tmp_path: Path) -> None:
    for number in range(2):
        dim = (0.6 * lab.image(None, number)).astype(np.uint8)
        cv2.imwrite(str(tmp_path / f"{number}.png"), dim[..., ::-1])
    code, checks = examined(lab.profile_path, "--bundle", lab.bundle, "--input", tmp_path)
    assert code == 1
    assert checks["light red"][0] == "problem"
    assert "40% dimmer than in the reference" in checks["light red"][1]


def test_a_profile_that_opens_no_device_says_how_to_go_on(lab: VirtualLab) -> None:
    code, checks = examined(lab.profile_path)
    assert code == 0
    assert checks["camera"][0] == "unknown"
    assert "give a recording with --input, or --sim" in checks["camera"][1]


def test_options_about_a_sensor_need_its_profile(tmp_path: Path) -> None:
    assert "name its profile" in refused("doctor", "--watch")
    assert "exclude each other" in refused("doctor", "x", "--sim", "--input", tmp_path)


@pytest.mark.parametrize("as_json", [True, False])
def test_a_recording_is_watched_to_its_end(lab: VirtualLab, as_json: bool) -> None:
    words = ["doctor", lab.profile_path, "--bundle", lab.bundle, "--input", lab.presses, "--watch"]
    done = tactile(*words, *(["--json"] if as_json else []))
    assert done.returncode == 0, done.stderr
    last = done.stdout.splitlines()[-1]
    if as_json:
        line = json.loads(last)
        assert line["source"] == "press_9"
        assert line["light red"]["verdict"] == "ok"
        assert line["torn"]["verdict"] == "unknown"
    else:
        assert last.startswith("press_9: light red 1 of 1, light green ")


@pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX signals")
def test_watching_ends_well_with_an_interrupt(tmp_path: Path, url: str) -> None:
    path = profile(tmp_path, stream(url))
    words = [sys.executable, "-m", "tactile_core.cli", "doctor", str(path), "--watch", "--json"]
    running = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert running.stdout is not None
    first = json.loads(running.stdout.readline())
    os.kill(running.pid, signal.SIGINT)
    out, err = running.communicate(timeout=60)
    assert running.returncode == 0, err
    assert err == ""
    assert first["rate"]["unit"] == "Hz"
    for line in out.splitlines():
        assert json.loads(line)["sequence"] > first["sequence"]


def test_the_light_is_compared_with_that_of_the_calibration(
    lab: VirtualLab, tmp_path: Path
) -> None:
    place = lab.profile_path, "--bundle", lab.bundle, "--input", lab.reference
    _, checks = examined(*place)
    verdict, words = checks["light since calibration"]
    assert verdict == "ok"
    assert words.startswith("brightness 100 to 100 % of the calibration's")
    image = np.asarray(cv2.imread(str(lab.reference)))
    ramp = 1 + 0.15 * np.linspace(0, 1, image.shape[1])[:, None]
    today = tmp_path / "today.png"
    cv2.imwrite(str(today), np.clip(np.rint(image * ramp), 0, 255).astype(np.uint8))
    code, checks = examined(*place, "--reference", today)
    verdict, words = checks["light since calibration"]
    assert verdict == "problem"
    assert "unevenness" in words
    assert code == 1
