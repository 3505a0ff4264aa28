"""Timings of one unit: of a stream, and of one frame."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from itertools import cycle
from time import perf_counter
from typing import ClassVar

import numpy as np

from tactile_core.acquisition.acquisition import Acquisition, average
from tactile_core.algorithms.circles import Circle
from tactile_core.bundles.bundle import Bundle, names_of
from tactile_core.bundles.manifest import LIGHT, Manifest
from tactile_core.calibration.light_range import light_range
from tactile_core.calibration.presses import FoundPress
from tactile_core.conditioning.conditioning import Conditioning, is_sequential
from tactile_core.interfaces.camera import Camera, Trigger
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.illumination import Exposure
from tactile_core.interfaces.image import ImageSection
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.pipeline.playback import make_lights
from tactile_core.plugins.options import calibrator_of, fitted_by
from tactile_core.plugins.returned import measured_by
from tactile_core.profiles.loader import profile_hash
from tactile_core.profiles.model import Profile
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
from tactile_core.sim.analytic_ball import BallPress
from tactile_core.sim.optics.rig import RigOptics


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


@dataclass(frozen=True, eq=False)
class VirtualUnit:
    """A profile, its calibration, and rendered frames.

    Attributes
    ----------
    profile : Profile
    bundle : Bundle
    frames : tuple of Frame
        Ball presses at several positions, without marker masks.
    stroke : tuple of Frame
        A ball that shears the gel surface back and forth and is pressed more and less deep; it can
        be repeated.
    """

    profile: Profile
    bundle: Bundle
    frames: tuple[Frame, ...]
    stroke: tuple[Frame, ...]


def virtual_unit(
    profile: Profile,
    *,
    size_px: tuple[int, int] | None = None,
    model: str | None = None,
    stroke_frames: int = 4,  # as many as the buffers of a camera
) -> VirtualUnit:
    """Render presses of a ball and fit the profile's calibration on them.

    Parameters
    ----------
    profile : Profile
    size_px : (width, height), optional
        Image size instead of the profile's; the width of the field of view in mm is the same.
    model : str, optional
        Calibrator to fit, ``plugin.name``. Default: the profile's.
    stroke_frames : int
        Number of frames of a ball that moves.

    Raises
    ------
    PluginError, InputError
        The profile's illumination cannot be made.
    CalibrationError
        The presses do not determine the model.
    """
    profile = profile if size_px is None else _resize_profile(profile, size_px)
    calibrator = calibrator_of(profile.calibration, model)
    image = profile.image
    take = partial(_take_frame, RigOptics(profile))
    undeformed = take(None, 0)
    condition = Conditioning.for_build(profile, average([undeformed]), compensates=False)
    reference = condition.undeformed
    ball_mm = 0.22 * image.width_px * image.mm_per_px
    rng = np.random.default_rng(0)
    presses = []
    for seed in range(1, 9):
        x, y = rng.uniform(0.15, 0.85, 2) * (image.width_px, image.height_px)
        ball = BallPress((float(x), float(y)), ball_mm, 0.2 * ball_mm)
        circle = Circle(ball.centre_px, ball.contact_radius_mm / image.mm_per_px)
        frame = condition.mask_markers(take(ball, seed))
        radius_px = ball_mm / 2 / image.mm_per_px
        presses.append(FoundPress("", frame, circle, radius_px))
    fitted = fitted_by(calibrator, [press.training() for press in presses], reference)
    artefacts = {LIGHT: fitted}
    manifest = Manifest(
        profile=profile.name,
        artefacts=names_of(artefacts),
        image_size_px=(image.width_px, image.height_px),
        channels=reference.channels,
        mm_per_px=image.mm_per_px,
        bit_depth=image.bit_depth,
        ball_diameters_mm=(ball_mm,),
        presses_used=len(presses),
        light_range=light_range(presses, reference),
        profile_hash=profile_hash(profile),
    )
    frames = tuple(replace(press.frame, marker_mask=None) for press in presses[:4])
    middle_px = ((image.width_px - 1) / 2, (image.height_px - 1) / 2)
    stroke = []
    for seed, phase in enumerate(np.linspace(0, 2 * np.pi, stroke_frames, endpoint=False)):
        depth_balls = 0.2 * (1 + 0.1 * np.sin(phase))
        moved_px = np.interp(-np.cos(phase), (-1, 1), (1.0, 3.0))
        held = BallPress(middle_px, ball_mm, depth_balls * ball_mm)
        stroke.append(take(held, seed, float(moved_px)))
    return VirtualUnit(profile, Bundle(manifest, artefacts, reference), frames, tuple(stroke))


def _resize_profile(profile: Profile, size_px: tuple[int, int]) -> Profile:
    width, height = size_px
    scale = profile.image.mm_per_px * profile.image.width_px / width
    changed = {"width_px": width, "height_px": height, "mm_per_px": scale}
    image = ImageSection.model_validate(profile.image.model_dump() | changed)
    return profile.model_copy(update={"image": image})


def _take_frame(
    optics: RigOptics, ball: BallPress | None, number: int, sheared_px: float = 0.0
) -> Frame:
    image = optics.profile.image
    shape = (image.height_px, image.width_px)
    if ball is None:
        return optics.take_frame(np.zeros(shape), number=number)
    x, y = ball.centre_px
    ball = replace(ball, centre_px=(x + sheared_px, y))
    displacement_mm = None
    if sheared_px:
        displacement_mm = image.mm_per_px * sheared_px * _shear(ball, shape, image.mm_per_px)
    height_mm = ball.height_mm(shape, image.mm_per_px)
    return optics.take_frame(height_mm, displacement_mm, number=number)


def _shear(ball: BallPress, shape: tuple[int, int], mm_per_px: float) -> Pixels:
    """(H, W, 2) displacement for a unit shear along x: 1 inside the contact, decaying outside."""
    x, y = (np.arange(n) - at for n, at in zip(shape[::-1], ball.centre_px, strict=True))
    beyond = np.hypot(x, y[:, None]) * mm_per_px / ball.contact_radius_mm - 1
    along = np.clip(1 - beyond / 2.5, 0, 1)  # zero from 2.5 contact radii outside on
    return np.stack([along, np.zeros(shape)], axis=-1)


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
