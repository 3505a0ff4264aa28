"""A plugin's fault is one message that names plugin and step, whatever its code raises."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from support.unruly_sensor import FAKES, profile
from support.virtual_lab import BALL_MM, VirtualLab

from tactile_core.cli import main
from tactile_core.formats.images import write_png


@pytest.fixture(autouse=True)
def _unruly(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(FAKES)


def ended(capsys: pytest.CaptureFixture[str], *words: object) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of a command."""
    with pytest.raises(SystemExit) as ended:
        main([str(word) for word in words])
    code = ended.value.code
    assert isinstance(code, int)
    return code, *capsys.readouterr()


def failed(tmp_path: Path, capsys: pytest.CaptureFixture[str], **parts: str) -> str:
    """Run an unruly sensor, which must fail, and return its one message."""
    code, out, err = ended(capsys, "run", profile(tmp_path, **parts), "--frames", 1, "--json")
    assert (code, out) == (1, ""), err
    (message,) = [line for line in err.splitlines() if not line.startswith("note: ")]
    return message.removeprefix("tactile: ")


@pytest.mark.parametrize(
    ("deed", "cause"),
    [
        ("value", "ValueError: the weights do not fit"),
        ("end of file", "EOFError: no reason given"),
        ("broken pipe", "BrokenPipeError: [Errno 32] Broken pipe"),
        ("exit", "SystemExit: 0"),
        ("recursion", "RecursionError: maximum recursion depth exceeded"),
        ("memory", "MemoryError: no reason given"),
        ("stop", "StopIteration: no reason given"),
    ],
)
def test_what_a_step_raises_names_step_plugin_and_cause(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], deed: str, cause: str
) -> None:
    said = failed(tmp_path, capsys, step=deed)
    assert said.startswith(f"step 'height' (unruly.step, from tactile-unruly 0.1) failed: {cause}")
    assert said.endswith("; this is a fault of that plugin")


def test_an_interrupt_that_nobody_pressed_is_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    said = failed(tmp_path, capsys, step="interrupt")
    assert "raised by step 'height' (unruly.step, from tactile-unruly 0.1)" in said
    assert "nobody interrupted it" in said


@pytest.mark.parametrize(
    ("deed", "wrong"),
    [
        ("nothing", "NoneType instead of the HeightMap that it declares"),
        ("slopes", "Gradients instead of the HeightMap that it declares"),
        ("array", "ndarray instead of the HeightMap that it declares"),
        ("integers", "HeightMap.mm is int32 where it must be float32"),
        ("half", "HeightMap.mm has the shape (3, 8) where the image has (6, 8)"),
        ("nan", "HeightMap.mm holds values that are not finite"),
        ("infinity", "HeightMap.mm holds values that are not finite"),
    ],
)
def test_what_a_step_returns_is_refused_unless_it_is_what_it_declares(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], deed: str, wrong: str
) -> None:
    said = failed(tmp_path, capsys, step=deed)
    assert said.startswith("step 'height' (unruly.step, from tactile-unruly 0.1) returned ")
    assert wrong in said


@pytest.mark.parametrize(
    ("part", "deed", "named"),
    [
        ("camera", "value at open", "the camera (unruly.camera, from tactile-unruly 0.1) failed"),
        ("camera", "exit at read", "the camera (unruly.camera, from tactile-unruly 0.1) failed"),
        ("camera", "end of file at read", "the camera (unruly.camera, from"),
        ("camera", "floats at read", "returned pixels of type float64"),
        ("camera", "a list at read", "returned list instead of an Image"),
        ("lights", "key at made", "the lights (unruly.lights, from tactile-unruly 0.1) failed"),
        ("camera", "nothing at arm", "returned NoneType from arm() instead of a Trigger"),
        ("camera", "another exposure at read", "an image whose exposure_index is 3; one obs"),
        ("box", "key at made", "the light driver (unruly.box, from tactile-unruly 0.1) failed"),
        ("box", "exit at attach", "the light driver (unruly.box, from tactile-unruly 0.1) failed"),
        ("box", "broken pipe at open", "the light driver (unruly.box, from"),
        ("box", "value at set", "the light driver (unruly.box, from tactile-unruly 0.1) failed"),
        ("lights", "exit at lights", "the lights (unruly.lights, from tactile-unruly 0.1) failed"),
        ("lights", "words at lights", "('above', 'below'), which is not a tuple of Light"),
        ("lights", "no exposure at never", "have 3 channels and exposures for 0"),
        ("calibration", "exit at from_lights", "the calibration (unruly.calibration, from"),
        ("calibration", "key at measure", "the calibration (unruly.calibration, from"),
        ("calibration", "a list at measure", "returned list instead of Gradients or a HeightMap"),
        ("calibration", "nan at measure", "Gradients.x holds values that are not finite"),
        ("step", "value at made", "step 'height' (unruly.step, from tactile-unruly 0.1) failed"),
    ],
)
def test_every_part_of_a_sensor_is_named_by_its_fault(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], part: str, deed: str, named: str
) -> None:
    said = failed(tmp_path, capsys, **{part: deed})
    assert named in said
    assert "tactile-unruly 0.1" in said


def test_lights_that_give_no_exposures_are_named_while_a_recording_is_opened(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = profile(tmp_path, lights="words for exposures at never")
    image = tmp_path / "image.png"
    write_png(image, np.zeros((6, 8, 3), np.uint8))
    code, out, err = ended(capsys, "run", path, "--input", image, "--json")
    assert (code, out) == (1, "")
    assert "the lights (unruly.lights, from tactile-unruly 0.1) failed" in err


@pytest.mark.parametrize(
    ("does", "cause"),
    [
        ("summary", "TypeError: JSON cannot represent a float32"),
        ("arrays", "ZeroDivisionError: division by zero"),
        ("warnings", "ZeroDivisionError: division by zero"),
    ],
)
def test_a_quantity_of_a_plugin_is_named_by_its_fault(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], does: str, cause: str
) -> None:
    path = profile(tmp_path)
    steps = f"estimators: {{mine: {{use: unruly.measure, does: {does}}}}}\n"
    path.write_text(path.read_text().replace("estimators", "# estimators") + steps)
    code, out, err = ended(capsys, "run", path, "--frames", 1, "--json", "--out", tmp_path / "out")
    assert (code, out) == (1, "")
    assert (
        "the quantity UnrulyQuantity (fake_unruly.parts.UnrulyQuantity, from tactile-unruly 0.1) "
        f"failed: {cause}" in err
    )


@pytest.mark.parametrize("when", ["fit", "measure", "save"])
def test_a_calibration_is_named_by_its_fault(
    tmp_path: Path, lab: VirtualLab, capsys: pytest.CaptureFixture[str], when: str
) -> None:
    path = tmp_path / "lab.yaml"
    said = f"calibration: {{use: unruly.calibration, does: end of file, when: {when}}}"
    path.write_text(
        lab.profile_path.read_text().replace("calibration: {use: core.automatic}", said)
    )
    code, out, err = ended(
        capsys,
        *("calibrate", path, "--presses", lab.presses, "--reference", lab.reference),
        *("--ball-diameter-mm", BALL_MM, "--out", tmp_path / "bundle"),
    )
    assert (code, out) == (1, "")
    named = "the calibration (unruly.calibration, from tactile-unruly 0.1) failed: EOFError"
    assert named in err
    assert not (tmp_path / "bundle").exists()


def test_a_camera_that_fails_to_close_is_named_after_its_readings(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = profile(tmp_path, camera="value at close")
    code, out, err = ended(capsys, "run", path, "--frames", 1, "--json")
    assert code == 1
    assert json.loads(out)["max_height_mm"] == 1
    assert "the camera (unruly.camera, from tactile-unruly 0.1) failed: ValueError" in err


def test_a_validator_of_options_that_fails_is_named_at_its_place(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = profile(tmp_path, step="bad validator")
    code, out, err = ended(capsys, "validate", path)
    assert (code, out) == (2, "")
    assert "unruly.yaml:5" in err
    assert "the options of unruly.step (unruly.step, from tactile-unruly 0.1) failed" in err


@pytest.mark.parametrize(("deed", "code"), [("refusal", 2), ("disk", 1)])
def test_what_a_plugin_says_on_purpose_is_said_as_it_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], deed: str, code: int
) -> None:
    path = profile(tmp_path, step=deed)
    found, out, err = ended(capsys, "run", path, "--frames", 1)
    assert (found, out) == (code, "")
    said = {
        "refusal": "tactile: the gel is upside down",
        "disk": "tactile: No space left on device (weights.npz)",
    }
    assert err.splitlines()[-1] == said[deed]


def test_debug_shows_where_it_was_raised(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = profile(tmp_path, step="value")
    code, _, err = ended(capsys, "run", path, "--frames", 1, "--debug")
    assert code == 1
    assert "deeds.py" in err
    assert err.rstrip().endswith("this is a fault of that plugin")


def test_what_a_plugin_prints_is_no_data(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = profile(tmp_path, step="chatter")
    code, out, err = ended(capsys, "run", path, "--frames", 2, "--json")
    assert code == 0
    assert [json.loads(line)["sequence"] for line in out.splitlines()] == [0, 1]
    assert "a word from the plugin" in err
    assert "a word from its library" not in err


def test_stdout_is_given_back(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = sys.stdout
    ended(capsys, "run", profile(tmp_path), "--frames", 1)
    assert sys.stdout is before
