"""Stdout holds only data; a closed stdout, signals and unusual names are handled cleanly."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from support import command_line
from support.unruly_sensor import FAKES, profile

from tactile_core.cli.output import printable_lines
from tactile_core.interfaces.sink import Reading
from tactile_core.pipeline.one_thread import ONE_THREAD
from tactile_core.quantities import ContactMask, Frame, HeightMap

COMMAND = [sys.executable, "-m", "tactile_core.cli"]


def environment(**more: str) -> dict[str, str]:
    """Return an environment in which the faulty plugin is installed."""
    return os.environ | {"PYTHONPATH": str(FAKES)} | more


def tactile(*words: object, **more: str) -> subprocess.CompletedProcess[str]:
    """Run the command in a separate process."""
    command = [*COMMAND, *map(str, words)]
    return subprocess.run(
        command, capture_output=True, text=True, check=False, env=environment(**more)
    )


@pytest.mark.parametrize(("given", "threads"), [(None, 1), ("2", 2)])
def test_opencv_has_one_thread_unless_the_user_says_otherwise(
    given: str | None, threads: int
) -> None:
    code = """
from tactile_core.cli import main
try:
    main(["profiles"])
except SystemExit:
    import cv2
    print(cv2.getNumThreads())
"""
    own = {name: value for name, value in os.environ.items() if name not in ONE_THREAD}
    own |= {"OPENCV_FOR_THREADS_NUM": given} if given else {}
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=own)
    assert int(done.stdout.splitlines()[-1]) == threads


def skip_if_ignored(name: str) -> None:
    """Skip a test of a signal that this process ignores, as under ``nohup``."""
    if signal.getsignal(signal.Signals[name]) is signal.SIG_IGN:
        pytest.skip(f"this process ignores {name}, and so do its children")


def with_closed_stdout(*words: object) -> tuple[int, str]:
    """Run a command with a closed stdout; return its exit code and stderr."""
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run(
        [*COMMAND, *map(str, words)],
        stdout=writing,
        stderr=subprocess.PIPE,
        text=True,
        check=False,
        env=environment(),
    )
    os.close(writing)
    return done.returncode, done.stderr


@pytest.mark.parametrize("words", [("profiles",), ("schema",), ("--help",), ("--version",)])
def test_a_closed_stdout_ends_the_command_quietly(words: tuple[str, ...]) -> None:
    assert with_closed_stdout(*words) == (0, "")


def test_a_closed_stdout_ends_a_stream_and_closes_the_sensor(tmp_path: Path) -> None:
    code, message = with_closed_stdout(
        "run", profile(tmp_path, camera="chatter at close"), "--json"
    )
    assert code == 0
    assert set(message.splitlines()[-2:]) == {"a word from the plugin", "a word from its driver"}


def test_prints_of_a_driver_do_not_reach_stdout(tmp_path: Path) -> None:
    done = tactile("run", profile(tmp_path, step="chatter"), "--frames", 1, "--json")
    assert done.returncode == 0
    assert json.loads(done.stdout)["sequence"] == 0
    assert "a word from its driver" in done.stderr


@pytest.mark.parametrize(("name", "code"), [("SIGINT", 130), ("SIGTERM", 143), ("SIGHUP", 129)])
def test_a_signal_closes_the_sensor_and_ends_with_its_code(
    tmp_path: Path, name: str, code: int
) -> None:
    skip_if_ignored(name)
    path = profile(tmp_path, camera=f"{name} at read", box="chatter at close")
    done = tactile("run", path, "--json")
    assert (done.returncode, done.stdout) == (code, "")
    assert "a word from the plugin" in done.stderr
    assert "Traceback" not in done.stderr
    assert "fault" not in done.stderr


INTERRUPTED_IMPORT = """\
import os, signal, sys

class Interrupter:
    def find_spec(self, name, *_):
        if name == sys.argv[1]:
            os.kill(os.getpid(), getattr(signal, sys.argv[2]))

sys.meta_path.insert(0, Interrupter())
from tactile_core.cli import main
main(["profiles"])
"""


@pytest.mark.parametrize("module", ["typer", "tactile_core.cli.app", "ruamel.yaml"])
@pytest.mark.parametrize(("name", "code"), [("SIGINT", 130), ("SIGTERM", 143)])
def test_a_signal_during_startup_ends_the_command_quietly(
    module: str, name: str, code: int
) -> None:
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED_IMPORT, module, name],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout, done.stderr) == (code, "", "")


INTERRUPTED_READING = """\
import os, signal, sys
from typer.core import TyperGroup

make = TyperGroup.make_context

def interrupted(*arguments, **options):
    os.kill(os.getpid(), getattr(signal, sys.argv[1]))
    return make(*arguments, **options)

TyperGroup.make_context = interrupted
from tactile_core.cli import main
main(["profiles"])
"""


@pytest.mark.parametrize(("name", "code"), [("SIGINT", 130), ("SIGTERM", 143), ("SIGHUP", 129)])
def test_a_signal_during_argument_parsing_ends_with_its_code(name: str, code: int) -> None:
    skip_if_ignored(name)
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED_READING, name],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout, done.stderr) == (code, "", "")


def test_ignored_signals_stay_ignored(tmp_path: Path) -> None:
    path = profile(tmp_path, step="SIGHUP at estimate")
    code = (
        "import signal, sys; signal.signal(signal.SIGHUP, signal.SIG_IGN);"
        "import time; time.sleep = lambda s: None;"
        "from tactile_core.cli import main; main(sys.argv[1:])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, "run", str(path), "--frames", "1"],
        capture_output=True,
        text=True,
        check=False,
        env=environment(),
    )
    assert done.returncode == 0, done.stderr


def test_messages_contain_no_control_characters() -> None:
    done = command_line.tactile("validate", "gone\x1b[31m\x07\u202e.yaml")
    assert done.returncode == 2
    assert "gone\\x1b[31m\\x07\\u202e.yaml" in done.stderr
    assert not any(character in done.stderr for character in "\x1b\x07\u202e")
    assert "\x1b" not in command_line.tactile("frob\x1b[31m").stderr


def test_messages_keep_their_line_breaks(tmp_path: Path) -> None:
    path = tmp_path / "two.yaml"
    path.write_text("schema: 1\nname: two\nimage: {width_px: -1, height_px: -1, mm_per_px: 0.1}\n")
    assert len(command_line.tactile("validate", path).stderr.splitlines()) >= 3


def test_every_locale_can_print_every_name(tmp_path: Path) -> None:
    done = tactile("validate", "Maße→.yaml", PYTHONIOENCODING="ascii", PYTHONUTF8="0")
    assert (done.returncode, done.stdout) == (2, "")
    assert "Ma\\xdfe\\u2192.yaml" in done.stderr
    path = tmp_path / "Maße→.yaml"
    path.write_text(profile(tmp_path).read_text())
    done = tactile("validate", path, PYTHONIOENCODING="ascii", PYTHONUTF8="0")
    assert done.returncode == 0, done.stderr
    assert "Ma\\xdfe\\u2192.yaml: valid" in done.stdout


def test_a_name_that_is_not_utf8_is_printed(tmp_path: Path) -> None:
    path = os.fsencode(tmp_path) + b"/\xff.yaml"
    Path(os.fsdecode(path)).write_text(profile(tmp_path).read_text())
    done = tactile("validate", os.fsdecode(path))
    assert done.returncode == 0, done.stderr
    assert "\\udcff.yaml: valid" in done.stdout


def test_a_full_disk_behind_stdout_is_reported() -> None:
    if not Path("/dev/full").exists():
        pytest.skip("this system has no /dev/full")
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [*COMMAND, "profiles"], stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert (done.returncode, done.stderr) == (1, "tactile: No space left on device\n")


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("run", "hex_fingertip", "--sim", "--frames", 10**22), "--frames"),
        (("run", "hex_fingertip", "--sim", "--frames", 0), "--frames"),
        (("calibrate", "hex_fingertip", "--model", "core."), "plugin.name"),
        (("calibrate", "hex_fingertip", "--model", "core.polynomial", "--ball"), "--ball-diameter"),
        (("bench", "hex_fingertip", "--calibration", "core."), "plugin.name"),
    ],
)
def test_a_number_or_name_that_makes_no_sense_is_refused(
    tmp_path: Path, words: tuple[object, ...], named: str
) -> None:
    if words[0] == "calibrate":
        import cv2
        import numpy as np

        for name in ("press", "rest"):
            (tmp_path / name).mkdir()
            cv2.imwrite(str(tmp_path / name / "0.png"), np.full((480, 640, 3), 90, np.uint8))
        ball = "inf" if words[-1] == "--ball" else "4"
        words = (*(word for word in words if word != "--ball"), "--ball-diameter-mm", ball)
        words += ("--presses", tmp_path / "press", "--reference", tmp_path / "rest")
        words += ("--out", tmp_path / "bundle")
    done = command_line.tactile(*words)
    assert (done.returncode, done.stdout) == (2, ""), done.stderr
    assert named in done.stderr
    assert "bug" not in done.stderr


def test_infinity_and_nan_are_null_in_json() -> None:
    import numpy as np

    nowhere = np.zeros((2, 3), np.float32)
    frame = Frame(np.zeros((2, 3, 3), np.uint8), ("r", "g", "b"), 0.1, timestamp_s=float("nan"))
    height = HeightMap(nowhere * np.nan, nowhere == 0, 0.1)
    contact = ContactMask(nowhere == 0, float("inf"))
    reading = Reading(frame, {HeightMap: height, ContactMask: contact}, {}, latency_ms=float("inf"))
    line = json.loads(json.dumps(reading.summary(), allow_nan=False))
    wanted = ("max_height_mm", "contact_area_mm2", "timestamp_s", "latency_ms")
    assert [line[name] for name in wanted] == [None] * 4


def test_only_control_and_invisible_characters_are_escaped() -> None:
    assert printable_lines("Höhe 0.3 µm → 5°\nβ") == "Höhe 0.3 µm → 5°\nβ"
    assert printable_lines("a\tb\rc\x9bd\u2028e\udcfff") == "a\\tb\\rc\\x9bd\\u2028e\\udcfff"
