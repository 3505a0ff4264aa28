"""Timings of one unit: of a stream, and of one frame."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import cycle
from time import perf_counter
from typing import ClassVar

import numpy as np

from tactile_core.acquisition.acquisition import Acquisition
from tactile_core.acquisition.devices import make_lights
from tactile_core.calibration.virtual_unit import VirtualUnit
from tactile_core.conditioning.conditioning import is_sequential
from tactile_core.interfaces.camera import Camera, Trigger
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.illumination import Exposure
from tactile_core.interfaces.image import ImageSection
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.plugins.options import measured_by
from tactile_core.quantities import (
    Frame,
    Gradients,
    Image,
    Pixels,
    Quantity,
    Reference,
    ReferenceGradients,
    ShownGel,
)


class StillCamera(Camera):
    """Delivers the same exposures repeatedly and without delay."""

    live: ClassVar[bool] = False

    def __init__(self, exposures: Sequence[Pixels]) -> None:
        super().__init__(Options())
        self._exposures = cycle(exposures)

    def _open(self) -> None:
        """Nothing to open."""

    def _close(self) -> None:
        """Nothing to release."""

    def _arm(self, exposures: tuple[Exposure, ...]) -> Trigger:
        return Trigger.CAMERA

    def _read(self, timeout_s: float) -> Image:
        return Image(next(self._exposures))


ACQUIRE, LIGHTS, MARKERS, SLOPES = "acquire", "lights verified", "markers masked", "slopes"
CHECK = "gel checked"
WHOLE = "whole frame"


class Stream:
    """Processes a virtual unit's frames like a live sensor.

    Acquisition takes the same time for any image content, so it is timed with a uniform image; the
    later stages process the rendered frame. The frames show one contact that is sheared back and
    forth, as on a live sensor: with a new contact in every frame, marker tracking and slip
    detection would start again each time.

    Parameters
    ----------
    unit : VirtualUnit
    """

    def __init__(self, unit: VirtualUnit) -> None:
        self._pipeline = Pipeline(unit.profile, unit.bundle)
        self._bundle = unit.bundle
        self._frames = cycle(unit.stroke)
        self._condition = self._pipeline.conditioning
        image = unit.profile.image
        camera = StillCamera([_camera_image(image)])
        self._acquisition = Acquisition(camera.open(), make_lights(unit.profile), image)

    def whole(self) -> dict[str, float]:
        """Acquire and process one frame; return its time in ms under :data:`WHOLE`."""
        frame, times = next(self._frames), dict[str, float]()
        with _time_stage(times, WHOLE):
            self._acquisition.observe()
            self._pipeline.process(frame)
        return times

    def time_stages(self) -> dict[str, float]:
        """Acquire one frame and process it stage by stage; return the times in ms."""
        frame, times = next(self._frames), dict[str, float]()
        with _time_stage(times, ACQUIRE):
            self._acquisition.observe()
        self.process_stages(frame, times)
        return times

    def process_stages(
        self, frame: Frame, times: dict[str, float]
    ) -> Mapping[type[Quantity], Quantity]:
        """Process a frame stage by stage like the pipeline, and record the times in ms.

        Returns
        -------
        mapping of type to Quantity
            The pipeline's quantities, and also the frame and the reference.
        """
        reference = self._pipeline.reference
        assert reference is not None
        if is_sequential(frame):
            with _time_stage(times, LIGHTS):
                self._condition.verify(frame)
        if self._condition.finder is not None:
            with _time_stage(times, MARKERS):
                frame = self._condition.mask_markers(frame)
        calibration, check = self._bundle.calibration, self._pipeline.gel_check
        assert calibration is not None
        assert check is not None
        with _time_stage(times, SLOPES):
            frame = self._condition.compensate_drift(frame)
            measured = measured_by(calibration, frame, reference)
            if self._bundle.errors is not None and isinstance(measured, Gradients):
                measured = self._bundle.errors.added_to(measured)
        with _time_stage(times, CHECK):
            shown = check(frame)
        by_type: dict[type[Quantity], Quantity] = {
            Frame: frame,
            Reference: reference,
            ShownGel: shown,
            type(measured): measured,
        }
        if self._pipeline.reference_gradients is not None:
            by_type[ReferenceGradients] = self._pipeline.reference_gradients
        for step in self._pipeline.steps:
            if step.missing(by_type) is not None:
                continue
            with _time_stage(times, step.name), step.blame_step():
                found = step.estimate(by_type)
            by_type.update(zip(step.gives, found, strict=True))
        return by_type


def _camera_image(image: ImageSection) -> Pixels:
    """Return mid-grey pixels of the size, depth and colour that the profile's camera sends."""
    width, height = image.width_px, image.height_px
    if image.rotate_deg % 180:
        width, height = height, width
    if image.crop is not None:
        x, y, width, height = image.crop
        width, height = x + width, y + height
    shape = (height, width, 3) if image.color == "rgb" else (height, width)
    dtype = np.uint8 if image.bit_depth == 8 else np.uint16
    return np.full(shape, int(image.full_scale) // 2, dtype)


@contextmanager
def _time_stage(times: dict[str, float], name: str) -> Iterator[None]:
    start = perf_counter()
    yield
    times[name] = 1e3 * (perf_counter() - start)
