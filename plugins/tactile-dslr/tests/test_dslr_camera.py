"""A DSLR over the real PTP protocol, against gphoto2's virtual camera."""

from __future__ import annotations

import sys

import pytest

from tactile_core.errors import DeviceBusy, DeviceError
from tactile_core.testing.imports import Footprint
from tactile_dslr.camera import DslrCamera, DslrOptions, nearest

PATIENCE_S = 20.0


@pytest.mark.usefixtures("card")
def test_each_read_takes_a_photo() -> None:
    with DslrCamera(DslrOptions(model="D750", exposure_time_s=0.1, aperture=3.5)) as camera:
        images = [camera.read(PATIENCE_S) for _ in range(3)]
        assert "Nikon" in camera.device_id
    for number, image in enumerate(images):
        assert image is not None
        assert image.sequence == number
        assert image.pixels.shape == (40, 60, 3)
        assert abs(int(image.pixels.mean()) - 90) <= 1
        assert image.exposure_time_s == 0.1
        assert image.encoded is not None


@pytest.mark.usefixtures("card")
def test_a_reopened_camera_takes_photos_again_and_leaves_nothing() -> None:
    camera = DslrCamera(DslrOptions())
    with camera:
        camera.read(PATIENCE_S)
    before = Footprint.take_snapshot()
    with camera:
        assert camera.read(PATIENCE_S) is not None
        with pytest.raises(DeviceBusy):
            DslrCamera(DslrOptions()).open()
    assert before.find_leaks() == ""


@pytest.mark.usefixtures("card")
@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"model": "Canon"}, r"no camera of the model Canon is connected; found Nikon"),
        ({"exposure_time_s": 0.3}, r"has no exposure_time_s of 0.3, only .*0\.1000s.*wheel to M"),
        ({"iso": 100}, r"has no setting for iso; remove 'camera\.iso'"),
    ],
)
def test_what_the_camera_refuses_is_one_sentence(options: dict[str, object], message: str) -> None:
    with pytest.raises(DeviceError, match=message):
        DslrCamera(DslrOptions.model_validate(options)).open()


@pytest.mark.parametrize(
    ("choices", "wanted", "chosen"),
    [
        (["1/60", "1/125", "1/250"], 0.008, "1/125"),
        (["0.0100s", "1.0000s"], 0.01, "0.0100s"),
        (["30", "Bulb", "1/8000"], 30, "30"),
        (["f/2.8", "f/4"], 4, "f/4"),
        (["100", "200"], 150, None),
        (["Auto", "1/0"], 1, None),
    ],
)
def test_settings_are_compared_as_numbers(
    choices: list[str], wanted: float, chosen: str | None
) -> None:
    assert nearest(choices, wanted) == chosen


def test_without_the_library_the_error_says_how_to_install_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "gphoto2", None)
    with pytest.raises(DeviceError, match="pip install gphoto2"):
        DslrCamera(DslrOptions()).open()


@pytest.mark.usefixtures("card")
def test_a_connected_camera_is_listed_by_its_model() -> None:
    (found,) = DslrCamera.connected()
    assert "Nikon" in found.product
    assert found.fits({"model": "nikon"}, DslrCamera.selectors)
    assert not found.fits({"model": "Canon"}, DslrCamera.selectors)
