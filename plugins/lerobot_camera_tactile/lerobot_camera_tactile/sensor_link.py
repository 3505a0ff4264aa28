"""LeRobot's end of the sensor's process: starts it, and keeps its newest observation."""

from __future__ import annotations

import json
import logging
import subprocess
import threading
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from lerobot_camera_tactile import sensor_process
from lerobot_camera_tactile.sensor_process import SharedFrames

_LOG = logging.getLogger(__name__)
_MEMORY = Path("/dev/shm")  # Files that are in memory on Linux; elsewhere the temporary folder


@dataclass(frozen=True, eq=False)
class Observation:
    """What the sensor measured from one frame.

    Attributes
    ----------
    number : int
        Counts the observations since the sensor was opened, from 1.
    sequence : int
        That of the camera, the recording or the script.
    taken_s : float
        ``time.monotonic()`` at mid-exposure; of a virtual sensor, when it was shown.
    rgb : (H, W, 3) uint8
    height_mm : (H, W) float32 or None
        Height above the undeformed gel, positive where it is indented.
    numbers : dict of str to float
        Force (N, N·mm), slip and contact (mm²), as far as measured.
    """

    number: int
    sequence: int
    taken_s: float
    rgb: NDArray[np.uint8]
    height_mm: NDArray[np.float32] | None
    numbers: dict[str, float]


class SensorLink:
    """A running process of the sensor.

    Parameters
    ----------
    python : str
        Its interpreter.
    options : dict
        Keyword arguments of ``open_sensor``, and ``fps``: the highest rate, or None.
    height_px, width_px : int
        Size of the images.
    """

    def __init__(self, python: str, options: dict[str, Any], height_px: int, width_px: int) -> None:
        self._folder = TemporaryDirectory(
            prefix="tactile-", dir=_MEMORY if _MEMORY.is_dir() else None
        )
        path = Path(self._folder.name) / "frames"
        self._errors = (Path(self._folder.name) / "errors").open("w+b")
        self._shared = SharedFrames(path, height_px, width_px, create=True)
        self._changed = threading.Condition()
        self._newest: Observation | None = None
        self._failure, self._open = "", False
        self._stopping = False
        try:
            self._process = _start(python, ["measure", options | {"path": str(path)}], self._errors)
        except OSError:
            self._clean()
            raise
        self._thread = threading.Thread(target=self._listen, name="tactile sensor", daemon=True)
        self._thread.start()

    @property
    def failure(self) -> str:
        """A sentence that says why the process has ended; empty while it runs."""
        return self._failure

    @property
    def newest(self) -> Observation | None:
        """The newest observation; None before the first."""
        return self._newest

    def wait_until_open(self, timeout_s: float) -> None:
        """Wait until the sensor is open.

        Raises
        ------
        ConnectionError
            It cannot be opened, or not within the time.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._open or self._failure, timeout_s)
            if not self._open:
                raise ConnectionError(
                    self._failure
                    or f"the sensor did not open within {timeout_s:g} s; give a larger opening_s"
                )

    def wait_newer(self, number: int, timeout_s: float) -> Observation | None:
        """Return an observation that is newer than that of a number; None if none arrives."""

        def arrived() -> bool:
            return bool(self._failure) or (
                self._newest is not None and self._newest.number > number
            )

        with self._changed:
            self._changed.wait_for(arrived, timeout_s)
            newest = self._newest
        return newest if newest is not None and newest.number > number else None

    def stop(self) -> None:
        """End the process."""
        self._stopping = True
        with suppress(OSError):
            assert self._process.stdin is not None
            self._process.stdin.close()
        try:
            self._process.wait(5.0)  # [s] an exposure, and closing the camera
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._thread.join()
        self._clean()

    def _clean(self) -> None:
        self._errors.close()
        self._folder.cleanup()

    def _listen(self) -> None:
        assert self._process.stdout is not None
        error = ""
        with self._process.stdout as lines:
            for line in lines:
                if not line.endswith("\n"):
                    break  # the process was killed while it wrote
                said = json.loads(line)
                error = said.get("error", error)
                if "number" in said:
                    self._take(said)
                elif "notes" in said:
                    for note in said["notes"]:
                        _LOG.info(note)
                    with self._changed:
                        self._open = True
                        self._changed.notify_all()
        code = self._process.wait()
        with self._changed:
            if not self._stopping:
                self._failure = error or (
                    f"{_death(code, self._errors)}; disconnect the camera and connect it again"
                )
            self._changed.notify_all()

    def _take(self, said: dict[str, Any]) -> None:
        has_height = said.pop("has_height")
        found = self._shared.read(said["number"])
        if found is None:
            return  # a newer one has replaced it, whose line follows
        rgb, height_mm = found
        with self._changed:
            self._newest = Observation(rgb=rgb, height_mm=height_mm if has_height else None, **said)
            self._changed.notify_all()


def ask(python: str, *words: Any, timeout_s: float) -> dict[str, Any]:
    """Return the answer of a process that answers once: ``describe`` or ``find``.

    Raises
    ------
    ValueError
        The question cannot be answered; the sentence says why.
    """
    with TemporaryDirectory() as folder, (Path(folder) / "errors").open("w+b") as errors:
        try:
            process = _start(python, [*words], errors)
        except OSError as error:
            raise ValueError(str(error)) from error
        try:
            said, _ = process.communicate(timeout=timeout_s)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()
            raise ValueError(
                f"{python} did not answer within {timeout_s:g} s; give a larger opening_s"
            ) from None
        answer = json.loads(said or "{}")
        if process.returncode or not answer:
            raise ValueError(
                answer.get("error")
                or f"{_death(process.returncode, errors)}; is tactile-core installed for {python}?"
            )
    return dict(answer)


def _start(python: str, words: list[Any], errors: IO[bytes]) -> subprocess.Popen[str]:
    given = [word if isinstance(word, str) else json.dumps(word) for word in words]
    # -P: the modules beside the file are none of the sensor's
    command = [python, "-P", str(sensor_process.__file__), *given]
    try:
        return subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=errors,
            encoding="utf-8",
        )
    except OSError as error:
        raise OSError(
            f"the interpreter {python} cannot be started ({error.strerror}); give as python that "
            f"of an environment that has tactile-core"
        ) from error


def _death(code: int, errors: IO[bytes]) -> str:
    """Return how a process ended that gave no reason."""
    errors.seek(0)
    lines = errors.read().decode(errors="replace").strip().splitlines()
    how = f"was ended by signal {-code}" if code < 0 else f"ended with code {code}"
    why = f" ({lines[-1].strip()})" if lines else ""
    return f"the sensor's process {how}{why}"


def age_s(observation: Observation) -> float:
    """Return the time since an observation was taken, s."""
    return time.monotonic() - observation.taken_s
