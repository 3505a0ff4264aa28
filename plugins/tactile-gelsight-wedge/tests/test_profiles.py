import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from support.command_line import tactile
from support.mjpeg_server import Exchange, MjpegServer

from tactile_core.acquisition.acquisition import Acquisition
from tactile_core.acquisition.devices import make_devices
from tactile_core.profiles.loader import load_profile

EXAMPLE = Path(__file__).parents[3] / "examples/wedge/wedge.yaml"
WEDGE = load_profile("gelsight_wedge")
PORTRAIT = load_profile("gelsight_wedge_portrait")


def test_the_pad_in_the_images_of_a_raspberry_pi_fills_the_rectified_image(tmp_path: Path) -> None:
    assert WEDGE.image.warp is not None
    top_left, top_right, bottom_left, bottom_right = WEDGE.image.warp.source
    pad = np.array([top_left, top_right, bottom_right, bottom_left], np.int32)
    sent = cv2.fillConvexPoly(np.zeros((480, 640, 3), np.uint8), pad, (200, 200, 200))
    picture = bytes(cv2.imencode(".jpg", sent)[1])

    def mjpg_streamer(client: Exchange) -> None:
        assert client.path == "/?action=stream"
        client.begin()
        while not client.stopped.wait(0.01):
            client.send_image(picture)

    with MjpegServer(mjpg_streamer) as server:
        own = tmp_path / "my_wedge.yaml"
        url = str(WEDGE.camera.options["url"])
        url = url.replace("raspberrypi.local:8080", f"127.0.0.1:{server.port}")
        own.write_text(f'extends: gelsight_wedge\nname: my_wedge\ncamera: {{url: "{url}"}}\n')
        profile = load_profile(own)
        made = make_devices(profile)
        with made.camera:
            frame = Acquisition(made.camera, made.illumination, profile.image).observe(5.0)
    assert frame is not None
    assert frame.pixels.shape == (300, 400, 3)
    assert frame.pixels[3:-3, 3:-3].min() > 180


def test_the_shear_modulus_is_that_of_the_published_youngs_modulus() -> None:
    gel = WEDGE.gel
    assert gel.poisson_ratio == 0.485
    assert gel.shear_modulus_mpa == pytest.approx(0.150 / (2 * (1 + 0.485)), rel=0.001)


def test_the_gel_without_markers_differs_in_its_markers_only() -> None:
    unmarked = load_profile("gelsight_wedge_unmarked")
    assert unmarked.gel == WEDGE.gel.model_copy(update={"markers": None})
    assert (unmarked.image, unmarked.camera, unmarked.illumination) == (
        WEDGE.image,
        WEDGE.camera,
        WEDGE.illumination,
    )
    assert set(unmarked.estimators) == {"height", "contact"}


def test_the_recording_is_rectified_as_in_the_example() -> None:
    example = load_profile(EXAMPLE)
    assert PORTRAIT.image == example.image
    assert PORTRAIT.gel.markers == example.gel.markers
    assert PORTRAIT.camera.use == "core.replay"


@pytest.mark.parametrize(
    "name", ["gelsight_wedge", "gelsight_wedge_unmarked", "gelsight_wedge_portrait"]
)
def test_the_virtual_wedge_needs_no_device(name: str) -> None:
    done = tactile("run", name, "--sim", "--reference", "first", "--frames", 3, "--json")
    assert done.returncode == 0, done.stderr
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    assert [line["sequence"] for line in lines] == [0, 1, 2]
    markers = [line["markers"] for line in lines]
    if name == "gelsight_wedge_unmarked":
        assert markers == [None, None, None]
    else:
        assert all(found["seen"] == found["expected"] for found in markers)
