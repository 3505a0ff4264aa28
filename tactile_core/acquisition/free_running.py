"""Lights in step with a camera that runs freely, timed by one clock."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from tactile_core.algorithms.arrays.types import Array
from tactile_core.errors import CameraLost, CameraTimeout, DeviceError
from tactile_core.interfaces.illumination import Exposure
from tactile_core.quantities import Image


class Clock(NamedTuple):
    """A clock that never goes back.

    Attributes
    ----------
    now : callable
        Returns the time, s.
    sleep : callable
        Waits for a time, s.
    """

    now: Callable[[], float]
    sleep: Callable[[float], None]


HOST = Clock(time.monotonic, time.sleep)  # The clock of every camera's timestamps

# [count] Times that a light is switched on, at as many phases of the frame period: the delay is
# then overestimated by a sixth of a period at most, which leaves a quarter of a period for transfer
# and lights where an image can be used every other period
_BLINKS = 6
# [count] Parts of the image, in the direction of the rows, that are lit separately by a rolling
# shutter: a compromise between noise and delay, whose effect is allowed for
_BANDS = 8
# [ratio] Share of its brightness from which a band counts as fully lit: above the flicker and noise
# of the mean of a band
_LIT_SHARE = 0.97
# [s] Longest wait for an image while the timing is measured: a camera starts within this time
_FIRST_TIMEOUT_S = 3.0


class FreeRunning:
    """Selects images by their timestamps.

    An image counts for a light if its exposure began after the light had settled: if its
    timestamp is later than that by the stamp delay, the longest time from the beginning of an
    exposure to its timestamp. Where the delay is unknown, it is an exposure time, a period in which
    the image is read out, and one in which it is transferred. Images that waited in a buffer are
    recognised in the same way.

    Parameters
    ----------
    read : callable
        Returns the camera's next image within a time, s.
    clock : Clock
    stamp_delay_s : float or None
        As far as the camera knows it.

    Attributes
    ----------
    period_s, jitter_s : float
        Time between images, and by how much it varies, once it is measured.
    """

    def __init__(
        self,
        read: Callable[[float], Image | None],
        clock: Clock,
        stamp_delay_s: float | None = None,
    ) -> None:
        self.stamp_delay_s = stamp_delay_s
        self.period_s = 0.0
        self.jitter_s = 0.0
        self._read = read
        self._clock = clock

    def first_after(self, settled_s: float, exposure: Exposure, timeout_s: float) -> Image | None:
        """Return the first image whose exposure began after a time; None if there are no more.

        Raises
        ------
        CameraTimeout
            There is none within ``timeout_s``.
        DeviceError
            The camera failed, or its timestamps are of another clock.
        """
        until = self._clock.now() + timeout_s
        while True:
            image = self._read(max(until - self._clock.now(), 0.0))
            if image is None:
                return None
            began_s = image.timestamp_s - self._delay_s(image)
            if began_s >= settled_s and _has_settings(image, exposure):
                return image
            if self._clock.now() >= until:
                raise self._late(image, timeout_s)

    def measure_period(self) -> None:
        """Measure the frame period and its jitter from the timestamps of some images.

        Raises
        ------
        DeviceError
            The timestamps do not increase.
        """
        # [images] The median is that of a period although a few images are lost
        times = np.array([self._next().timestamp_s for _ in range(9)])
        steps = np.diff(times)
        if not (steps > 0).all():
            raise DeviceError(
                "the timestamps of the camera's images do not increase, so that its images cannot "
                "be assigned to the lights; the camera's plugin must give each its own"
            )
        self.period_s = float(np.median(steps))
        late_s = times - times[0] - np.rint((times - times[0]) / self.period_s) * self.period_s
        self.jitter_s = float(np.ptp(late_s))

    def measure_delay(
        self, switch: Callable[[Mapping[str, float]], None], levels: Mapping[str, float]
    ) -> None:
        """Measure the stamp delay by switching a light on, at several phases of the period.

        An image that is lit in all its rows began after the light was switched on, and its
        timestamp is later than that by the delay at least. The earliest such timestamp of all
        phases bounds the delay. If the light changes the image too little, the delay
        remains unknown.

        Parameters
        ----------
        switch : callable
            Sets the levels of the lights and returns when they have settled.
        levels : mapping of light to level
        """
        delays = []
        for phase in np.arange(_BLINKS) / _BLINKS:
            switch({})
            dark = self._until_after(self._clock.now())[-1]
            self._clock.sleep(phase * self.period_s)
            began_s = self._clock.now()
            switch(levels)
            images = self._until_after(self._clock.now())
            delay_s = _delay_of(images, dark, began_s)
            if delay_s is None:
                return
            delays.append(delay_s)
        exposure_s = dark.exposure_time_s or self.period_s
        # light that the first band may lack although it counts as fully lit
        band_s = self.period_s / _BANDS
        unseen_s = float(np.sqrt(2 * band_s * exposure_s * (1 - _LIT_SHARE)))
        self.stamp_delay_s = min(delays) + unseen_s + self.jitter_s

    def _until_after(self, settled_s: float) -> list[Image]:
        """Return images until one has certainly begun after a time."""
        images = [self._next()]
        until = self._clock.now() + _FIRST_TIMEOUT_S
        while images[-1].timestamp_s - self._unknown_s(images[-1]) < settled_s:
            if self._clock.now() >= until:
                raise self._late(images[-1], _FIRST_TIMEOUT_S)
            images.append(self._next())
        return images

    def _next(self) -> Image:
        image = self._read(_FIRST_TIMEOUT_S)
        if image is None:
            raise CameraLost("the camera has no more images")
        return image

    def _delay_s(self, image: Image) -> float:
        return self._unknown_s(image) if self.stamp_delay_s is None else self.stamp_delay_s

    def _unknown_s(self, image: Image) -> float:
        """Longest delay that is possible: exposure, readout and transfer."""
        exposure_s = image.exposure_time_s or self.period_s
        return exposure_s + 2 * self.period_s

    def _late(self, image: Image, timeout_s: float) -> DeviceError:
        age_s = self._clock.now() - image.timestamp_s
        if abs(age_s) > 10.0:  # [s] longer than any camera buffers
            return DeviceError(
                f"the timestamp of a new image is {age_s:g} s ago, so that it is not of the host's "
                f"monotonic clock; the camera's plugin must convert it"
            )
        return CameraTimeout(
            f"no image began after the lights had settled within {timeout_s:g} s; allow more time, "
            f"or check that the camera keeps its frame rate"
        )


def _has_settings(image: Image, exposure: Exposure) -> bool:
    """Whether an image has the exposure's own settings, as far as the camera reports them."""
    pairs = ((image.exposure_time_s, exposure.exposure_time_s), (image.gain, exposure.gain))
    return all(
        None in (got, wanted) or np.isclose(float(got), float(wanted), rtol=0.05)  # type: ignore[arg-type]
        for got, wanted in pairs
    )


def _delay_of(images: list[Image], dark: Image, began_s: float) -> float | None:
    """Return how much later than a time the first image is stamped that a light is on for."""
    full_scale = np.iinfo(dark.pixels.dtype).max if dark.pixels.dtype.kind == "u" else 1.0
    below = _bands(dark)
    step = _bands(images[-1]) - below
    if step.min() < 0.02 * full_scale:  # five grey levels of eight bits
        return None
    lit = (image for image in images if (_bands(image) - below >= _LIT_SHARE * step).all())
    return next(lit).timestamp_s - began_s


def _bands(image: Image) -> Array:
    """Mean intensity of each band of rows."""
    return np.array([part.mean() for part in np.array_split(image.pixels, _BANDS)])
