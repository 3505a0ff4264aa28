"""The process that opens and measures the sensor, and the memory that it shares with LeRobot's.

The sensor's interpreter runs this file by its path, so that this distribution need not be installed
there, and LeRobot's process imports it: hence nothing but numpy is imported at the top, and
tactile-core only in the sensor's process.

The sensor's process writes arrays to shared memory, and then a line of JSON to its standard output,
which says that they are there. It ends when its standard input is closed.
"""

from __future__ import annotations

import json
import mmap
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

NOMINAL_HZ = 30.0  # Rate of a profile whose camera names none
# [count] Observations that are kept: a reader may be this late, less the one that is being written
_SLOTS = 4
_LINE_BYTES = 64  # Arrays begin at a multiple of this


class SharedFrames:
    """The newest observations, in a file that two processes map into memory.

    Parameters
    ----------
    path : Path
        The file, which one of the two creates.
    height_px, width_px : int
        Size of the images.
    create : bool
        Make the file.
    """

    def __init__(self, path: Path, height_px: int, width_px: int, *, create: bool = False) -> None:
        pixels = height_px * width_px
        slot_bytes = -(-(_LINE_BYTES + 7 * pixels) // _LINE_BYTES) * _LINE_BYTES
        if create:
            with path.open("xb") as file:
                file.truncate(_SLOTS * slot_bytes)
        with path.open("r+b") as file:
            self._memory = mmap.mmap(file.fileno(), _SLOTS * slot_bytes)
        starts = range(0, _SLOTS * slot_bytes, slot_bytes)
        self._slots = [self._arrays(start, height_px, width_px) for start in starts]

    def _arrays(self, start: int, height_px: int, width_px: int) -> tuple[NDArray[Any], ...]:
        """Return number, heights and pixels of a slot."""
        kinds = (
            (np.int64, (1,), start),
            (np.float32, (height_px, width_px), start + _LINE_BYTES),
            (np.uint8, (height_px, width_px, 3), start + _LINE_BYTES + 4 * height_px * width_px),
        )
        return tuple(np.ndarray(shape, kind, self._memory, offset) for kind, shape, offset in kinds)

    def write(self, number: int, rgb: NDArray[np.uint8], height_mm: NDArray[np.float32]) -> None:
        """Write an observation; numbers are 1, 2 and so on."""
        slot_number, heights, pixels = self._slots[number % _SLOTS]
        slot_number[0] = 0  # a reader sees that the arrays are no longer those of one observation
        heights[:], pixels[:] = height_mm, rgb
        slot_number[0] = number

    def read(self, number: int) -> tuple[NDArray[np.uint8], NDArray[np.float32]] | None:
        """Return copies of pixels and heights (mm); None if newer ones have replaced them."""
        slot_number, heights, pixels = self._slots[number % _SLOTS]
        if slot_number[0] != number:
            return None
        found = pixels.copy(), heights.copy()
        return found if slot_number[0] == number else None


def describe(options: dict[str, Any]) -> dict[str, Any]:
    """Return what the sensor will give, without opening its devices.

    Parameters
    ----------
    options : dict
        Keyword arguments of ``open_sensor``.
    """
    from tactile_core import Bundle, HeightMap, Pipeline, load_profile
    from tactile_core.bundles.places import find_place
    from tactile_core.pipeline.made_up_frames import made_up_reference
    from tactile_core.plugins.options import calibrator_of

    profile = load_profile(options["profile"], sim=options["sim"])
    place = options["bundle"] or find_place(profile, options["serial"])
    bundle = None if place is None else Bundle.load(Path(place))
    reference = None
    # what the first frame or a file gives later; any will do until then
    if options["reference"] or (bundle is not None and bundle.manifest.starting):
        reference = made_up_reference(profile.image, Pipeline(profile).channels)
    gives = Pipeline(profile, bundle, reference, serial=options["serial"]).gives
    no_depth = ""
    if HeightMap not in gives and calibrator_of(profile.calibration).refusal:
        no_depth = (
            f"the profile {profile.name} has no step that measures height; leave use_depth out, or "
            f"give another profile"
        )
    elif HeightMap not in gives:
        missing = "a bundle" if bundle is None else "a reference"
        no_depth = (
            f"the profile {profile.name} needs {missing} to measure height; give it, or leave "
            f"use_depth out"
        )
    return {
        "name": profile.name,
        "height_px": profile.image.height_px,
        "width_px": profile.image.width_px,
        "fps": profile.camera.options.get("fps") or NOMINAL_HZ,
        "no_depth": no_depth,
        "numbers": _names_of(gives),
    }


def _names_of(kinds: tuple[type, ...]) -> list[str]:
    """Return the names of the numbers that quantities of these types give."""
    from tactile_core import ContactMask, SlipState, Wrench

    names = {
        Wrench: ("fx_n", "fy_n", "fz_n", "tz_nmm"),
        SlipState: ("slip_degree", "slip_known"),
        ContactMask: ("contact_area_mm2",),
    }
    return [name for kind, group in names.items() if kind in kinds for name in group]


def numbers_of(reading: Any) -> dict[str, float]:
    """Return force, slip and contact of a ``Reading``, as far as it has them."""
    from tactile_core import ContactMask, SlipState, Wrench

    found: dict[str, float] = {}
    wrench, slip, contact = reading.get(Wrench), reading.get(SlipState), reading.get(ContactMask)
    if wrench is not None:
        found |= zip(("fx_n", "fy_n", "fz_n", "tz_nmm"), wrench.values.tolist(), strict=True)
    if slip is not None:
        found |= {"slip_degree": slip.degree, "slip_known": float(slip.state != "unknown")}
    if contact is not None:
        found["contact_area_mm2"] = contact.area_mm2
    return found


def rgb_of(pixels: NDArray[Any], full_scale: float) -> NDArray[np.uint8]:
    """Return the image of a frame: three channels as they are, others as their grey mean.

    Parameters
    ----------
    pixels : (H, W, K) uint8, uint16 or float32
    full_scale : float
        Level of white.

    Returns
    -------
    (H, W, 3) uint8
        R, G, B.
    """
    if pixels.shape[2] != 3:
        pixels = pixels.mean(axis=2, keepdims=True)
    if pixels.dtype != np.uint8:
        pixels = np.rint(np.clip(pixels * (255 / full_scale), 0, 255)).astype(np.uint8)
    return np.broadcast_to(pixels, (*pixels.shape[:2], 3))


def measure(options: dict[str, Any], send: IO[str]) -> None:
    """Measure until standard input is closed.

    The script of a virtual sensor is played in real time, again and again.
    """
    from tactile_core import HeightMap, open_sensor

    path, fps = Path(options.pop("path")), options.pop("fps")
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Control-C is for LeRobot, which then disconnects
    stopped = threading.Event()
    threading.Thread(target=_wait_for_end, args=(stopped,), daemon=True).start()
    with open_sensor(options.pop("profile"), **options) as sensor:
        image = sensor.profile.image
        shared = SharedFrames(path, image.height_px, image.width_px)
        none = np.zeros((image.height_px, image.width_px), np.float32)
        _say(send, notes=sensor.notes)
        period_s = 1 / (fps or NOMINAL_HZ) if fps or not sensor.is_live else 0.0
        turns = _turns(stopped, period_s)
        for number, _ in enumerate(turns, 1):
            frame = sensor.acquire()
            if frame is None:
                sensor.rewind()
                frame = sensor.acquire()
            if frame is None:
                raise ValueError(f"{sensor.name} shows nothing; give a script that has frames")
            taken_s = frame.timestamp_s if sensor.is_live else time.monotonic()
            reading = sensor.measure(frame)
            height = reading.get(HeightMap)
            rgb = rgb_of(frame.pixels, frame.full_scale)
            shared.write(number, rgb, none if height is None else height.mm)
            _say(
                send,
                number=number,
                sequence=frame.sequence,
                taken_s=taken_s,
                has_height=height is not None,
                numbers=numbers_of(reading),
            )


def _wait_for_end(stopped: threading.Event) -> None:
    """Set the event when LeRobot's process has closed its end of standard input, or has died."""
    while os.read(0, 1):  # not sys.stdin, whose lock would abort the interpreter at its end
        pass
    stopped.set()


def _turns(stopped: threading.Event, period_s: float) -> Iterator[None]:
    """Yield once in each period; a period that took too long is not made up for."""
    due_s = time.monotonic()
    while not stopped.wait(max(0.0, due_s - time.monotonic())):
        yield
        due_s = max(due_s + period_s, time.monotonic())


def find_cameras() -> list[dict[str, Any]]:
    """Return the connected cameras that a profile fits."""
    from tactile_core import list_devices

    return [
        {
            "name": str(one.device),
            "type": "tactile",
            "id": one.unit or one.device.serial or one.device.place,
            "profiles": list(one.profiles),
        }
        for one in list_devices().devices
        if one.kind == "camera" and one.profiles
    ]


def _say(send: IO[str], **words: Any) -> None:
    send.write(json.dumps(words) + "\n")
    send.flush()


def main() -> int:
    """Do what the first argument says; an error is one sentence in JSON."""
    # whatever else prints, prints to standard error
    with os.fdopen(os.dup(1), "w", encoding="utf-8") as send:
        os.dup2(2, 1)
        try:
            import tactile_core
        except ModuleNotFoundError:
            _say(
                send,
                error=f"{sys.executable} has no tactile-core; install it there, or give as python "
                f"the interpreter of the environment that has it",
            )
            return 2
        try:
            work, *rest = sys.argv[1:]
            if work == "find":
                _say(send, cameras=find_cameras())
            elif work == "describe":
                _say(send, **describe(json.loads(rest[0])))
            else:
                measure(json.loads(rest[0]), send)
        except BrokenPipeError:
            return 0  # LeRobot's process has ended
        except (tactile_core.TactileError, OSError, ValueError) as error:
            _say(send, error=str(error))
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
