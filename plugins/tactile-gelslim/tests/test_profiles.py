import json

import pytest
from support.command_line import tactile

from tactile_core.profiles.loader import load_profile

GELSLIM = load_profile("gelslim4")


def test_the_image_is_twelve_millimetres_high() -> None:
    image = GELSLIM.image
    assert (image.width_px, image.height_px) == (427, 320)
    assert image.height_px * image.mm_per_px == pytest.approx(12)


def test_what_is_not_published_is_left_out() -> None:
    assert GELSLIM.gel.thickness_mm is None
    assert GELSLIM.gel.shear_modulus_mpa is None
    assert GELSLIM.camera.use == "core.replay"


def test_the_virtual_gelslim_needs_no_device() -> None:
    done = tactile("run", "gelslim4", "--sim", "--frames", 3, "--json")
    assert done.returncode == 0, done.stderr
    assert [json.loads(line)["sequence"] for line in done.stdout.splitlines()] == [0, 1, 2]
