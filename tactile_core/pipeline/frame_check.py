"""What is checked in every frame, and in a stream of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from tactile_core.acquisition.acquisition import Acquisition
from tactile_core.bundles.bundle import Bundle
from tactile_core.errors import CalibrationError, InputError, SequenceError
from tactile_core.interfaces.sink import Reading
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Frame, Pixels, Reference

_INTENSITIES = tuple(map(np.dtype, (np.uint8, np.uint16, np.float32, np.float64)))


def check_pixels(pixels: Pixels, what: str, profile: Profile, bundle: Bundle | None) -> None:
    """Refuse pixels that are not (H, W, K) intensities of the profile's size and the bundle's K.

    Parameters
    ----------
    pixels : array
    what : str
        Their name in messages, such as "frame".
    profile : Profile
    bundle : Bundle, optional

    Raises
    ------
    InputError
    """
    image, shape = profile.image, pixels.shape
    if len(shape) != 3 or pixels.dtype not in _INTENSITIES:
        raise InputError(
            f"the {what} has dtype {pixels.dtype} and shape {shape}; it should be (H, W, K) "
            f"with K channels of uint8, uint16 or float32"
        )
    if shape[1:] == (image.height_px, image.width_px):
        raise InputError(
            f"the {what} has its channels first, shape {shape}; it should be (H, W, K), as by "
            f"pixels.transpose(1, 2, 0)"
        )
    if shape[:2] != (image.height_px, image.width_px):
        raise InputError(
            f"the {what} is {shape[1]} × {shape[0]}, but the profile {profile.name!r} "
            f"specifies {image.width_px} × {image.height_px}; correct 'image' in the profile"
        )
    if pixels.dtype.kind == "f" and 0 < pixels.max() <= 1 < image.full_scale:
        raise InputError(
            f"the {what} has intensities up to {pixels.max():g} where the profile's end at "
            f"{image.full_scale:g}; multiply them by {image.full_scale:g}"
        )
    channels = pixels.shape[2] if bundle is None else len(bundle.manifest.channels)
    if pixels.shape[2] != channels:
        raise InputError(
            f"the {what} has {pixels.shape[2]} channels, but the bundle was made for "
            f"{channels}; calibrate with the same lights"
        )


def check_order(frame: Frame, bundle: Bundle) -> None:
    """Refuse a frame whose lights fire in another order than in the bundle.

    Raises
    ------
    CalibrationError
    """
    if frame.channels != bundle.manifest.channels:
        raise CalibrationError(
            f"the lights fire in the order {', '.join(frame.channels)}, but the bundle was "
            f"made with {', '.join(bundle.manifest.channels)}; use the bundle's profile "
            f"or calibrate again"
        )


def check_reference(given: object) -> None:
    """Refuse a reference that is none, such as an array or a path.

    Raises
    ------
    InputError
    """
    if not isinstance(given, Reference | None):
        raise InputError(
            f"the reference is of type {type(given).__name__}; give a Reference, as of "
            f"frame = pipeline.frame(image): Reference(np.float32(frame.pixels), frame.channels, "
            f"frame.full_scale)"
        )


# [count] Observations dropped in succession that are an error: chance or a moving gel spoils one or
# two; five have a cause that remains
_IN_SUCCESSION = 5


class LiveCheck:
    """Acquires the observations of a live camera whose exposures show their own lights.

    Parameters
    ----------
    acquisition : Acquisition
        Waits longer after each change of light once an observation was dropped.
    """

    def __init__(self, acquisition: Acquisition) -> None:
        self._acquisition = acquisition
        self._dropped: list[str] = []

    def observe(self, verify: Callable[[Frame], None], timeout_s: float) -> Frame | None:
        """Return the next good observation; None if there are no more.

        Raises
        ------
        SequenceError
            Several observations in succession show the wrong light.
        DeviceError
            The camera or the lights failed.
        """
        for _ in range(_IN_SUCCESSION):
            frame = self._acquisition.observe(timeout_s)
            if frame is None:
                return None
            try:
                verify(frame)
            except SequenceError as error:
                last = error
                self._dropped.append(f"{error}; it was dropped")
                self._acquisition.widen_margin()
            else:
                return frame
        raise SequenceError(
            f"{last}; {_IN_SUCCESSION} observations in succession were dropped: check "
            f"the lights, and that 'lights' of the light driver names its outputs as they are wired"
        ) from last

    def add_warnings(self, reading: Reading) -> Reading:
        """Add a warning to a reading for each observation that was dropped since the last one."""
        dropped, self._dropped = tuple(self._dropped), []
        return replace(reading, warnings=(*reading.warnings, *dropped)) if dropped else reading
