import hashlib
import os
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.bundles_on_disk import edit
from support.virtual_lab import VirtualLab

from tactile_core.bundles.bundle import Bundle
from tactile_core.bundles.manifest import (
    FORMAT,
    Manifest,
    Starting,
    is_measured,
    read_manifest,
    write_manifest,
)
from tactile_core.bundles.places import check_serial, default_place
from tactile_core.errors import CalibrationError, InputError
from tactile_core.formats.npz import read_npz, write_npz


@pytest.fixture
def copy(lab: VirtualLab, tmp_path: Path) -> Path:
    return Path(shutil.copytree(lab.bundle, tmp_path / "bundle"))


def sealed(bundle: Path, **changes: object) -> None:
    """Edit a manifest and update its hashes, as an attacker would."""
    path = bundle / "manifest.json"
    manifest = Manifest.model_validate_json(path.read_text())
    write_manifest(bundle, manifest.model_copy(update=changes))


def test_a_loaded_bundle_equals_the_saved_one(lab: VirtualLab, tmp_path: Path) -> None:
    first = Bundle.load(lab.bundle)
    first.save(tmp_path / "again")
    again = Bundle.load(tmp_path / "again")
    of_the_folder: dict[str, Any] = {"files": {}, "content_hash": ""}
    assert again.manifest.model_copy(update=of_the_folder) == first.manifest.model_copy(
        update=of_the_folder
    )
    np.testing.assert_array_equal(again.reference.pixels, first.reference.pixels)


def test_a_manifest_holds_profile_serial_and_score(lab: VirtualLab) -> None:
    manifest = Bundle.load(lab.bundle).manifest
    assert (manifest.profile, manifest.serial) == ("virtual_lab", "0007")
    assert manifest.ball_diameters_mm == (4.0,)
    assert manifest.held_out is not None


def test_learned_light_directions_are_those_of_the_lights(lab: VirtualLab) -> None:
    learned = Bundle.load(lab.bundle).manifest.channel_azimuth_deg
    off = (np.array(learned) - [90, 210, 330] + 180) % 360 - 180
    assert np.abs(off).max() < 5


def test_another_units_bundle_is_refused(lab: VirtualLab) -> None:
    with pytest.raises(CalibrationError, match="serial 0007, not 0008"):
        Bundle.load(lab.bundle).check(lab.profile, "0008")


def test_a_starting_bundle_is_of_every_unit_and_says_so(lab: VirtualLab) -> None:
    bundle = Bundle.load(lab.bundle)
    manifest = bundle.manifest.model_copy(update={"starting": Starting(of="15 virtual units")})
    starting = replace(bundle, manifest=manifest)
    scale = lab.profile.image.model_copy(update={"mm_per_px": 0.2})
    other = lab.profile.model_copy(update={"name": "mine", "image": scale})
    (note,) = starting.check(other, "0008")
    assert "not calibrated" in note
    assert "15 virtual units" in note
    starting.check_gel("G2")
    assert "tactile calibrate mine" in note
    smaller = scale.model_copy(update={"width_px": 80})
    with pytest.raises(CalibrationError, match="image size"):
        starting.check(lab.profile.model_copy(update={"image": smaller}))


@pytest.mark.parametrize(
    "change",
    [{"drift": ()}, {"response": ((0.1, 0.0),) * 4}, {"ramp": float("nan")}, {"field": -1.0}],
)
def test_a_light_range_that_cannot_be_is_refused(
    lab: VirtualLab, change: dict[str, object]
) -> None:
    manifest = Bundle.load(lab.bundle).manifest.model_dump()
    Manifest.model_validate(manifest)
    with pytest.raises(ValueError, match="light_range"):
        Manifest.model_validate(manifest | {"light_range": manifest["light_range"] | change})


def test_the_bundle_of_another_gel_is_refused(lab: VirtualLab) -> None:
    bundle = Bundle.load(lab.bundle)
    with pytest.raises(
        CalibrationError, match=r"a gel without a name, not with gel G2; .*--gel G2"
    ):
        bundle.check_gel("G2")
    named = replace(bundle, manifest=bundle.manifest.model_copy(update={"gel_id": "G1"}))
    named.check_gel("G1")
    with pytest.raises(CalibrationError, match="made with gel G1, not with gel G2"):
        named.check_gel("G2")


def test_a_unit_has_a_place_for_the_bundle_of_each_gel(lab: VirtualLab) -> None:
    places = {default_place(lab.profile, "0007", gel) for gel in (None, "G1", "G2")}
    assert {place.name for place in places} == {"0007", "0007+G1", "0007+G2"}
    assert default_place(lab.profile, None).name == "default"


def test_another_sensors_bundle_is_refused(lab: VirtualLab) -> None:
    light = lab.profile.illumination.model_copy(update={"use": "other.light"})
    other = lab.profile.model_copy(update={"name": "other", "illumination": light})
    with pytest.raises(CalibrationError, match="sensor virtual_lab, not other"):
        Bundle.load(lab.bundle).check(other)


def test_another_name_and_camera_leave_a_bundle_usable(lab: VirtualLab) -> None:
    camera = lab.profile.camera.model_copy(update={"use": "core.uvc"})
    renamed = lab.profile.model_copy(update={"name": "second_camera", "camera": camera})
    assert Bundle.load(lab.bundle).check(renamed) == []


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
    edit(copy, format=FORMAT + 1, of_the_future=True)
    with pytest.raises(CalibrationError, match=r"newer than this version.*upgrade tactile-core"):
        Bundle.load(copy)


def test_an_older_bundle_is_refused(copy: Path) -> None:
    edit(copy, format=FORMAT - 1)
    with pytest.raises(CalibrationError, match=r"older than this version.*calibrate again"):
        Bundle.load(copy)


def test_a_damaged_array_is_refused(copy: Path) -> None:
    path = next(copy.glob("*.npz"))
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(CalibrationError, match="damaged"):
        Bundle.load(copy)


DAMAGED = {
    "empty": b"",
    "list": b"[]",
    "incomplete": b'{"format": %d}' % FORMAT,
    "NUL": b"\0",
    "not UTF-8": b'{"format": "\xff"}',
    "deep": b'{"format": ' + b"[" * 100_000,
    "huge": b'{"format": 1, "x": "' + b"x" * 10_000_000 + b'"}',
    "half of a pair": b'{"format": 2, "profile": "\\ud800"}',
    "format in words": b'{"format": "99"}',
    "format true": b'{"format": true}',
    "format 2.5": b'{"format": 2.5}',
    "long number": b'{"format": ' + b"9" * 10_000 + b"}",
}


@pytest.mark.parametrize("text", DAMAGED.values(), ids=DAMAGED)
def test_a_damaged_manifest_is_refused(copy: Path, text: bytes) -> None:
    (copy / "manifest.json").write_bytes(text)
    with pytest.raises(CalibrationError, match="damaged"):
        Bundle.load(copy)


@pytest.mark.parametrize(
    "change",
    [
        {"mm_per_px": float("nan")},
        {"mm_per_px": float("inf")},
        {"mm_per_px": 0},
        {"mm_per_px": -0.1},
        {"mm_per_px": "0.1245"},
        {"image_size_px": [0, 120]},
        {"bit_depth": True},
        {"channels": "rgb"},
        {"of_ours": "not"},
    ],
    ids=str,
)
def test_a_manifest_with_invalid_fields_is_refused(copy: Path, change: dict[str, object]) -> None:
    edit(copy, **change)
    with pytest.raises(CalibrationError, match="damaged"):
        Bundle.load(copy)


@pytest.mark.parametrize("change", [{"serial": "0008"}, {"held_out": None}, {"created": "today"}])
def test_an_edited_manifest_is_refused(copy: Path, change: dict[str, object]) -> None:
    edit(copy, **change)
    with pytest.raises(CalibrationError, match="edited"):
        Bundle.load(copy)


def test_a_manifest_names_every_other_file_with_its_hash(lab: VirtualLab) -> None:
    names = Bundle.load(lab.bundle).manifest.files
    assert set(names) == {
        "errors/errors.npz",
        "light/model.npz",
        "reference.npz",
        "report.html",
    }
    assert all(len(digest) == 64 for digest in names.values())


@pytest.mark.parametrize("name", ["light/model.npz", "reference.npz", "report.html"])
@pytest.mark.parametrize("gone", [True, False])
def test_a_named_file_that_is_gone_or_changed_is_refused(copy: Path, name: str, gone: bool) -> None:
    if gone:
        (copy / name).unlink()
    else:
        (copy / name).write_bytes((copy / name).read_bytes() + b" ")
    with pytest.raises(CalibrationError, match=f"{name} is not the file that was written"):
        Bundle.load(copy)


@pytest.mark.parametrize("name", ["../outside", "light/../../outside", "{absolute}"])
def test_a_file_outside_of_the_folder_is_none_of_the_bundle(copy: Path, name: str) -> None:
    outside = copy.parent / "outside"
    outside.write_bytes(b"whatever it holds")
    manifest = read_manifest(copy)
    files = manifest.files | {
        name.format(absolute=outside): hashlib.sha256(b"whatever it holds").hexdigest()
    }
    listed = manifest.model_copy(update={"files": files, "content_hash": ""})
    edit(copy, files=files, content_hash=listed.fingerprint())
    with pytest.raises(CalibrationError, match="outside is not the file that was written"):
        Bundle.load(copy)


def test_an_additional_file_does_not_damage_a_bundle(copy: Path) -> None:
    (copy / "ball.npz").write_bytes(b"other results")
    Bundle.load(copy)


def test_a_text_that_is_not_utf8_is_kept_readable(lab: VirtualLab, tmp_path: Path) -> None:
    first = Bundle.load(lab.bundle)
    values = first.manifest.model_dump() | {"revision": os.fsdecode(b"ball\xff")}
    replace(first, manifest=Manifest.model_validate(values)).save(tmp_path / "b")
    assert Bundle.load(tmp_path / "b").manifest.revision == r"ball\udcff"


def broken(**changes: object) -> Callable[[Path], None]:
    def damage(bundle: Path) -> None:
        arrays: dict[str, Any] = dict(read_npz(bundle / "reference.npz"))
        for name, value in changes.items():
            if value is None:
                del arrays[name]
            else:
                arrays[name] = value(arrays[name]) if callable(value) else np.asarray(value)
        write_npz(bundle / "reference.npz", arrays)

    return damage


def overwritten(data: bytes) -> Callable[[Path], None]:
    return lambda bundle: (bundle / "reference.npz").write_bytes(data) and None


REFERENCES = {
    "empty": overwritten(b""),
    "no archive": overwritten(b"PK\x03\x04" + bytes(100)),
    "no pixels": broken(pixels=None),
    "scalar pixels": broken(pixels=1.0),
    "other size": broken(pixels=lambda a: a[:-1]),
    "NaN": broken(pixels=lambda a: a * np.float32(np.nan)),
    "integers": broken(pixels=lambda a: a.astype(np.int32)),
    "words": broken(pixels="pixels"),
    "fewer channels": broken(channels=["r", "g"]),
    "channels as a number": broken(channels=3),
    "full scale 0": broken(full_scale=0.0),
    "full scale in words": broken(full_scale="high"),
    "endless frames": broken(frames=np.inf),
    "two noises": broken(noise=[1.0, 2.0]),
    "markers of another size": broken(marker_mask=np.zeros((3, 3), bool)),
}


@pytest.mark.parametrize("damage", REFERENCES.values(), ids=REFERENCES)
def test_a_damaged_reference_is_refused_in_one_sentence(
    copy: Path, damage: Callable[[Path], None]
) -> None:
    damage(copy)
    sealed(copy)
    with pytest.raises(CalibrationError, match="the reference is damaged; calibrate again"):
        Bundle.load(copy)


@pytest.mark.parametrize("error", [TypeError("'NoneType'"), MemoryError(), RecursionError("deep")])
def test_an_error_of_a_model_names_the_bundle_and_the_model(
    copy: Path, monkeypatch: pytest.MonkeyPatch, error: Exception
) -> None:
    def load(directory: Path) -> None:
        raise error

    manifest = Bundle.load(copy).manifest
    monkeypatch.setattr("tactile_core.builtin.mlp.Mlp.load", load)
    assert manifest.model == "core.mlp"
    with pytest.raises(
        CalibrationError, match=rf"bundle {copy}: core\.mlp .*{type(error).__name__}"
    ):
        Bundle.load(copy)


def test_a_damaged_model_names_the_bundle(copy: Path) -> None:
    write_npz(copy / "light" / "model.npz", {"shape": np.array([1, 2])})
    sealed(copy)
    with pytest.raises(
        CalibrationError, match=rf"bundle {copy}: core\.mlp: .*does not hold such a model"
    ):
        Bundle.load(copy)


@pytest.mark.parametrize("name", ["std", "weight_0_0", "bias_0_0"])
def test_a_model_with_a_misshapen_array_is_damaged(copy: Path, name: str) -> None:
    path = copy / "light" / "model.npz"
    arrays = read_npz(path)
    write_npz(path, arrays | {name: arrays[name][..., None]})
    sealed(copy)
    with pytest.raises(CalibrationError, match="does not hold such a model"):
        Bundle.load(copy)


def test_a_folder_without_a_manifest_is_no_bundle(tmp_path: Path) -> None:
    with pytest.raises(CalibrationError, match=r"no manifest\.json"):
        Bundle.load(tmp_path)


@pytest.mark.parametrize("serial", ["0007", "GS-2.b_1"])
def test_plain_serials_pass(serial: str) -> None:
    assert check_serial(serial) == serial


@pytest.mark.parametrize("serial", ["", "..", "a/b", "a b", "ü", "a\n"])
def test_serials_that_could_leave_their_folder_are_refused(serial: str) -> None:
    with pytest.raises(InputError, match="letters, digits"):
        check_serial(serial)


def test_a_folder_with_a_calibration_from_presses_is_known(lab: VirtualLab, tmp_path: Path) -> None:
    assert is_measured(lab.bundle)
    assert not is_measured(tmp_path)
    (tmp_path / "manifest.json").write_text('{"format": 4}')
    assert is_measured(tmp_path)
