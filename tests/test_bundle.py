import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from virtual_lab import VirtualLab

from tactile_core.bundle import FORMAT, Bundle, check_serial
from tactile_core.errors import CalibrationError, InputError


@pytest.fixture
def copy(lab: VirtualLab, tmp_path: Path) -> Path:
    return Path(shutil.copytree(lab.bundle, tmp_path / "bundle"))


def edit(bundle: Path, **changes: object) -> None:
    path = bundle / "manifest.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | changes))


def test_a_bundle_comes_back_as_it_was_saved(lab: VirtualLab, tmp_path: Path) -> None:
    first = Bundle.load(lab.bundle)
    first.save(tmp_path / "again")
    again = Bundle.load(tmp_path / "again")
    assert again.manifest == first.manifest
    np.testing.assert_array_equal(again.reference.pixels, first.reference.pixels)


def test_a_manifest_says_where_it_comes_from(lab: VirtualLab) -> None:
    manifest = Bundle.load(lab.bundle).manifest
    assert (manifest.profile, manifest.serial) == ("virtual_lab", "0007")
    assert manifest.ball_diameter_mm == 4.0
    assert manifest.held_out is not None


def test_learned_lights_come_from_where_the_lamps_are(lab: VirtualLab) -> None:
    learned = Bundle.load(lab.bundle).manifest.channel_azimuth_deg
    off = (np.array(learned) - [90, 210, 330] + 180) % 360 - 180
    assert np.abs(off).max() < 5


def test_another_units_bundle_is_refused(lab: VirtualLab) -> None:
    with pytest.raises(CalibrationError, match="serial 0007, not 0008"):
        Bundle.load(lab.bundle).check(lab.profile, "0008")


def test_another_sensors_bundle_is_refused(lab: VirtualLab) -> None:
    other = lab.profile.model_copy(update={"name": "other"})
    with pytest.raises(CalibrationError, match="sensor virtual_lab, not other"):
        Bundle.load(lab.bundle).check(other)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"width_px": 161}, "image size"),
        ({"bit_depth": 16}, "bit depth"),
        ({"mm_per_px": 0.127}, "mm per pixel"),
    ],
)
def test_another_image_is_refused(lab: VirtualLab, change: dict[str, object], words: str) -> None:
    image = lab.profile.image.model_copy(update=change)
    with pytest.raises(CalibrationError, match=words):
        Bundle.load(lab.bundle).check(lab.profile.model_copy(update={"image": image}))


def test_a_scale_within_one_per_cent_is_the_same_scale(lab: VirtualLab) -> None:
    image = lab.profile.image.model_copy(update={"mm_per_px": 0.1245 * 1.005})
    Bundle.load(lab.bundle).check(lab.profile.model_copy(update={"image": image}))


def test_a_changed_light_is_a_warning(lab: VirtualLab) -> None:
    light = lab.profile.illumination.model_copy(update={"use": "other.light"})
    notes = Bundle.load(lab.bundle).check(lab.profile.model_copy(update={"illumination": light}))
    assert "has changed since" in notes[0]


def test_a_newer_bundle_is_refused(copy: Path) -> None:
    edit(copy, format=FORMAT + 1)
    with pytest.raises(CalibrationError, match="newer than this version"):
        Bundle.load(copy)


def test_a_damaged_array_is_refused(copy: Path) -> None:
    path = next(copy.glob("*.npz"))
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(CalibrationError, match="damaged"):
        Bundle.load(copy)


@pytest.mark.parametrize("text", ["", "[]", '{"format": 1}', "\x00"])
def test_a_damaged_manifest_is_refused(copy: Path, text: str) -> None:
    (copy / "manifest.json").write_text(text)
    with pytest.raises(CalibrationError, match="damaged"):
        Bundle.load(copy)


def test_a_folder_without_a_manifest_is_no_bundle(tmp_path: Path) -> None:
    with pytest.raises(CalibrationError, match=r"no manifest\.json"):
        Bundle.load(tmp_path)


def test_a_new_bundle_replaces_the_old_one_whole(lab: VirtualLab, copy: Path) -> None:
    (copy / "leftover.txt").write_text("old")
    Bundle.load(lab.bundle).save(copy)
    assert not (copy / "leftover.txt").exists()
    assert [p.name for p in copy.parent.iterdir()] == ["bundle"]


def test_a_folder_of_something_else_is_left_alone(lab: VirtualLab, tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(InputError, match="not a calibration bundle"):
        Bundle.load(lab.bundle).save(tmp_path)
    assert (tmp_path / "thesis.tex").exists()


def test_when_writing_fails_the_previous_bundle_survives(lab: VirtualLab, copy: Path) -> None:
    def full_disk(folder: Path) -> None:
        raise OSError(28, "No space left on device")

    with pytest.raises(OSError, match="No space"):
        Bundle.load(lab.bundle).save(copy, report=full_disk)
    assert Bundle.load(copy).manifest == Bundle.load(lab.bundle).manifest
    assert [p.name for p in copy.parent.iterdir()] == ["bundle"]


@pytest.mark.parametrize("serial", ["0007", "GS-2.b_1"])
def test_plain_serials_pass(serial: str) -> None:
    assert check_serial(serial) == serial


@pytest.mark.parametrize("serial", ["", "..", "a/b", "a b", "ü", "a\n"])
def test_serials_that_could_leave_their_folder_are_refused(serial: str) -> None:
    with pytest.raises(InputError, match="letters, digits"):
        check_serial(serial)
