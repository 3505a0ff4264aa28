"""The command ``tactile view``."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
from pathlib import Path

from support.command_line import refused
from support.virtual_lab import VirtualLab
from support.watching import watching


def test_it_prints_its_address_serves_and_ends_with_ctrl_c(lab: VirtualLab, tmp_path: Path) -> None:
    words = [sys.executable, "-m", "tactile_core.cli", "view", lab.profile_path]
    words += ["--input", lab.presses, "--bundle", lab.bundle, "--port", "0", "--no-browser"]
    home = {**os.environ, "XDG_DATA_HOME": str(tmp_path)}
    with subprocess.Popen(
        list(map(str, words)),
        cwd=tmp_path,
        env=home,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        address = process.stdout.readline().strip()
        with watching(address) as watcher:
            assert watcher.hello["kind"] == "recording"
            assert watcher.next().header["maps"]
        process.send_signal(signal.SIGINT)
        rest, errors = process.communicate(timeout=30)
    assert process.returncode == 0, errors
    assert rest == ""
    assert address.startswith("http://127.0.0.1:")


def test_a_port_in_use_is_one_sentence(lab: VirtualLab, tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        said = refused(
            *("view", lab.profile_path, "--input", lab.presses, "--bundle", lab.bundle),
            *("--no-browser", "--port", port, "--out", tmp_path / "out"),
        )
    assert f"port {port} is in use" in said
    assert "--port" in said


def test_sensors_that_do_not_add_up_are_refused(lab: VirtualLab) -> None:
    said = refused("view", lab.profile_path, lab.profile_path, *["--serial", "a"] * 3)
    assert "2 profiles for 3 sensors" in said


def test_a_recording_and_the_virtual_sensor_exclude_each_other(lab: VirtualLab) -> None:
    assert "exclude each other" in refused(
        "view", lab.profile_path, "--sim", "--input", lab.presses, "--no-browser"
    )
