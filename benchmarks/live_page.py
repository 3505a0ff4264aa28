"""Pictures a second and time from frame to screen of the live page, in headless Chromium.

A camera on the network (MJPEG) sends virtual images at a fixed rate; the whole chain measures them
in one process, which serves the page; Chromium shows it. Run with
``python benchmarks/live_page.py --seconds 60``; the load of the machine is printed beside.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from tempfile import TemporaryDirectory

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import cv2
import numpy as np

from tactile_core import Bundle, load_profile, open_sensor
from tactile_core.calibration.virtual_unit import calibrate_virtual_unit
from tactile_live.desk import Desk
from tactile_live.live_sensor import LiveSensor
from tactile_live.server import LivePage
from tactile_sim import VirtualStage

PROFILE = "hex_fingertip"
FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]


def render(folder: Path, frames: int) -> None:
    """Write images of a ball that presses, shears the gel and leaves."""
    stage = VirtualStage(PROFILE)
    stage.indenter("sphere", diameter_mm=5)
    for number in range(frames):
        if number == frames // 6:
            stage.press(depth_mm=0.3)
        elif frames // 6 < number < frames - 2:
            stage.shear(dx_mm=0.02, dy_mm=0.01)
        elif number == frames - 2:
            stage.release()
        (pixels,) = stage.exposures()
        cv2.imwrite(str(folder / f"{number:04d}.jpg"), pixels[..., ::-1], [1, 95])


def serve_images(folder: Path, rate_hz: float) -> None:
    """Send the images in a loop as MJPEG; prints the port."""
    images = [path.read_bytes() for path in sorted(folder.glob("*.jpg"))]

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "multipart/x-mixed-replace; boundary=frame")
            self.end_headers()
            due_s, number = time.monotonic(), 0
            while True:
                data = images[number % len(images)]
                head = f"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: {len(data)}\r\n\r\n"
                self.wfile.write(head.encode() + data + b"\r\n")
                number, due_s = number + 1, due_s + 1 / rate_hz
                time.sleep(max(0.0, due_s - time.monotonic()))

        def log_message(self, *args: object) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    print(server.server_address[1], flush=True)
    server.serve_forever()


@contextmanager
def camera(folder: Path, rate_hz: float) -> Iterator[str]:
    """Yield the address of a camera in another process."""
    words = [sys.executable, __file__, "--serve", str(folder), "--rate-hz", str(rate_hz)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            yield f"http://127.0.0.1:{process.stdout.readline().strip()}/"
        finally:
            process.kill()


def chromium_cpu_s() -> float:
    """Return the processor time of all processes of Chromium."""
    ticks = 0
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            head, _, fields = stat.read_text().rpartition(")")
        except OSError:
            continue  # it has ended meanwhile
        if "chrom" in head:
            ticks += sum(map(int, fields.split()[11:13]))
    return ticks / os.sysconf("SC_CLK_TCK")


def resident_mib() -> float:
    """Return the memory of this process."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def measured(desk: Desk, page: object, seconds: float) -> dict[str, float]:
    """Watch for some seconds: rates, times, memory and load."""
    desk.shown_ms.clear()
    state = desk.live.newest.value
    assert state is not None
    times: list[float] = []
    latencies: list[float] = []
    stop = threading.Event()

    def collect() -> None:
        seen = 0
        while not stop.wait(0.005):
            newest = desk.live.newest.value
            if newest is not None and newest.number > seen:
                seen = newest.number
                latencies.append(newest.reading.latency_ms)

    thread = threading.Thread(target=collect)
    thread.start()
    before, cpu_s, began_s = state.number, time.process_time(), time.monotonic()
    browser_s = chromium_cpu_s()
    shown = int(page.locator(".card").get_attribute("data-pictures") or 0)  # type: ignore[attr-defined]
    first_mib = resident_mib()
    while time.monotonic() < began_s + seconds:
        page.wait_for_timeout(500)  # type: ignore[attr-defined]
        times += desk.shown_ms
        desk.shown_ms.clear()
    took_s = time.monotonic() - began_s
    pictures = int(page.locator(".card").get_attribute("data-pictures") or 0) - shown  # type: ignore[attr-defined]
    stop.set()
    thread.join()
    after = desk.live.newest.value
    assert after is not None
    health = desk.live.sensor.health()
    return {
        "sensor_hz": (after.number - before) / took_s,
        "pictures_per_s": pictures / took_s,
        "frame_to_screen_ms_median": float(np.median(times)) if times else float("nan"),
        "frame_to_screen_ms_p95": float(np.percentile(times, 95)) if times else float("nan"),
        "measuring_ms_median": float(np.median(latencies)),
        "dropped_by_camera": float(health.dropped.value or 0),
        "cpu_ms_per_reading": 1e3 * (time.process_time() - cpu_s) / (after.number - before),
        "chromium_cpu_ms_per_picture": 1e3 * (chromium_cpu_s() - browser_s) / pictures,
        "memory_mib_first": first_mib,
        "memory_mib_last": resident_mib(),
        "load_average": os.getloadavg()[0],
    }


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--rate-hz", type=float, default=30.0)
    parser.add_argument("--bundle", type=Path)
    parser.add_argument("--serve", type=Path)
    given = parser.parse_args()
    if given.serve:
        serve_images(given.serve, given.rate_hz)
        return
    from playwright.sync_api import sync_playwright

    virtual = load_profile(PROFILE, sim=True)
    bundle = Bundle.load(given.bundle) if given.bundle else calibrate_virtual_unit(virtual)
    with TemporaryDirectory() as name, sync_playwright() as playwright:
        folder = Path(name)
        render(folder, 48)
        with camera(folder, given.rate_hz) as url:
            profile = load_profile(
                PROFILE,
                sim=True,
                overrides={"camera": {"use": "core.stream", "url": url}},
            )
            desk = Desk(LiveSensor(open_sensor(profile, bundle=bundle), folder))
            browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=FLAGS)
            with LivePage([desk], "benchmark") as page:
                desk.live.start()
                time.sleep(3)
                tab = browser.new_page(viewport={"width": 1280, "height": 900})
                tab.goto(page.address)
                tab.wait_for_timeout(3000)
                for words, every in (("a browser", 30.0), ("one picture a second", 1.0)):
                    tab.evaluate(f"globalThis.tactile?.limit({every})")
                    print(words, json.dumps(measured(desk, tab, given.seconds)), flush=True)
            browser.close()
            desk.close()


if __name__ == "__main__":
    main()
