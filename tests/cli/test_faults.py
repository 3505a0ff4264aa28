"""A fault in a plugin gives one message with the plugin and the step, whatever it raises."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support.own_plugins import Install
from support.unruly_sensor import FAKES, profile
from support.virtual_lab import BALL_MM, VirtualLab

from tactile_core.cli import main
from tactile_core.formats.images import write_png


@pytest.fixture(autouse=True)
def _unruly(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(FAKES)


def ended(capsys: pytest.CaptureFixture[str], *words: object) -> tuple[int, str, str]:
    """Run a command; return its exit code, stdout and stderr."""
    with pytest.raises(SystemExit) as end:
        main([str(word) for word in words])
    code = end.value.code
    assert isinstance(code, int)
    return code, *capsys.readouterr()


def failed(tmp_path: Path, capsys: pytest.CaptureFixture[str], **parts: str) -> str:
    """Run the faulty sensor, which must fail, and return its only message."""
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
def test_an_exception_of_a_step_is_reported_with_step_plugin_and_cause(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], deed: str, cause: str
) -> None:
    message = failed(tmp_path, capsys, step=deed)
    assert message.startswith(
        f"step 'height' (unruly.step, from tactile-unruly 0.1) failed: {cause}"
    )
    assert message.endswith("; this is a fault of that plugin")


def test_a_keyboard_interrupt_raised_by_a_plugin_is_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    message = failed(tmp_path, capsys, step="interrupt")
    assert "raised by step 'height' (unruly.step, from tactile-unruly 0.1)" in message
    assert "without an interrupt from the user" in message


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
def test_a_result_other_than_the_declared_quantity_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], deed: str, wrong: str
) -> None:
    message = failed(tmp_path, capsys, step=deed)
    assert message.startswith("step 'height' (unruly.step, from tactile-unruly 0.1) returned ")
    assert wrong in message


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
def test_a_fault_of_any_sensor_part_names_the_part(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], part: str, deed: str, named: str
) -> None:
    message = failed(tmp_path, capsys, **{part: deed})
    assert named in message
    assert "tactile-unruly 0.1" in message


def test_lights_without_exposures_are_named_when_a_recording_is_opened(
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
def test_a_fault_of_a_plugin_quantity_names_the_quantity(
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
def test_a_fault_of_a_calibration_names_the_calibration(
    tmp_path: Path, lab: VirtualLab, capsys: pytest.CaptureFixture[str], when: str
) -> None:
    path = tmp_path / "lab.yaml"
    faulty = f"calibration: {{use: unruly.calibration, does: end of file, when: {when}}}"
    path.write_text(
        lab.profile_path.read_text().replace("calibration: {use: core.automatic}", faulty)
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


def test_a_failing_options_validator_is_named_with_file_and_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = profile(tmp_path, step="bad validator")
    code, out, err = ended(capsys, "validate", path)
    assert (code, out) == (2, "")
    assert "unruly.yaml:5" in err
    assert "the options of unruly.step (unruly.step, from tactile-unruly 0.1) failed" in err


@pytest.mark.parametrize(("deed", "code"), [("refusal", 2), ("disk", 1)])
def test_a_tactile_error_or_os_error_of_a_plugin_is_printed_unchanged(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], deed: str, code: int
) -> None:
    path = profile(tmp_path, step=deed)
    found, out, err = ended(capsys, "run", path, "--frames", 1)
    assert (found, out) == (code, "")
    messages = {
        "refusal": "tactile: the gel is upside down",
        "disk": "tactile: No space left on device (weights.npz)",
    }
    assert err.splitlines()[-1] == messages[deed]


def test_debug_shows_the_source_of_the_exception(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = profile(tmp_path, step="value")
    code, _, err = ended(capsys, "run", path, "--frames", 1, "--debug")
    assert code == 1
    assert "deeds.py" in err
    assert err.rstrip().endswith("this is a fault of that plugin")


def test_prints_of_a_plugin_do_not_reach_stdout(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = profile(tmp_path, step="chatter")
    code, out, err = ended(capsys, "run", path, "--frames", 2, "--json")
    assert code == 0
    assert [json.loads(line)["sequence"] for line in out.splitlines()] == [0, 1]
    assert "a word from the plugin" in err
    assert "a word from its library" not in err


def test_stdout_is_restored(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = sys.stdout
    ended(capsys, "run", profile(tmp_path), "--frames", 1)
    assert sys.stdout is before


THREAD = """\
import threading
import time

from tactile_core.interfaces.estimator import Estimator
from tactile_core.quantities import Frame, NetworkOutput


class Endless(Estimator):
    def open(self) -> None:
        threading.Thread(target=time.sleep, args=(600,), name="endless").start()

    def estimate(self, frame: Frame) -> NetworkOutput:
        return NetworkOutput(frame.pixels[0, :2, 0].astype("float32"), ("a", "b"), "")
"""


def test_a_thread_of_a_plugin_does_not_keep_a_finished_command(
    tmp_path: Path, install: Install
) -> None:
    package = install(
        "endless", {"step.py": THREAD}, tactile_estimators={"step": "own_endless.step:Endless"}
    )
    write_png(tmp_path / "a.png", np.full((6, 8, 3), 90, np.uint8))
    (tmp_path / "p.yaml").write_text(
        "schema: 1\nname: p\nimage: {width_px: 8, height_px: 6, mm_per_px: 0.1}\n"
        "estimators: {values: {use: endless.step}}\n"
    )
    words = ["run", str(tmp_path / "p.yaml"), "--input", str(tmp_path / "a.png")]
    done = subprocess.run(
        [sys.executable, "-m", "tactile_core.cli", *words, "--reference", "first"],
        env={**os.environ, "PYTHONPATH": str(package.parent)},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert (done.returncode, done.stdout.partition(":")[0]) == (0, "a")
    assert "the thread 'endless' of a plugin or library still runs" in done.stderr
