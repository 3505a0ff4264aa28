"""A calibrated virtual unit of any profile: rendered presses, its bundle and a stroke."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from tactile_core.acquisition.acquisition import average
from tactile_core.algorithms.circles.circle import Circle
from tactile_core.algorithms.heights.sphere import BallPress
from tactile_core.bundles.bundle import Bundle, manifest_for
from tactile_core.bundles.manifest import LIGHT
from tactile_core.calibration.fitting import calibrate
from tactile_core.calibration.light_range import light_range
from tactile_core.calibration.presses import FoundPress
from tactile_core.conditioning.conditioning import Conditioning
from tactile_core.interfaces.component import SIMULATOR
from tactile_core.interfaces.image import ImageSection
from tactile_core.interfaces.simulator import Renderer
from tactile_core.plugins.options import fittable_calibrator, fitted_by
from tactile_core.plugins.registry import resolve
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Frame, Pixels


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
        The profile's illumination cannot be made, or no simulator is installed.
    CalibrationError
        The presses do not determine the model.
    """
    profile = profile if size_px is None else _resize_profile(profile, size_px)
    calibrator = fittable_calibrator(profile.calibration, model)
    image = profile.image
    renderer = resolve("simulator", SIMULATOR)().renderer(profile)
    take = partial(_take_frame, renderer, image)
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
    manifest = manifest_for(
        profile,
        reference.channels,
        artefacts,
        ball_diameters_mm=(ball_mm,),
        presses_used=len(presses),
        light_range=light_range(presses, reference),
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


def calibrate_virtual_unit(profile: Profile) -> Bundle:
    """Calibrate a virtual sensor as users do a real one: with pictures of a ball that is pressed.

    Raises
    ------
    PluginError
        No simulator is installed.
    CalibrationError
        Its presses cannot be fitted.
    """
    with TemporaryDirectory(prefix="tactile-presses-") as name:
        folder = Path(name)
        ball_mm = resolve("simulator", SIMULATOR)().write_presses(profile, folder, count=12)
        fitted = calibrate(
            profile,
            folder / "presses",
            folder / "reference",
            ball_diameter_mm=ball_mm,
            scored=False,  # nobody reads the report
        )
    return fitted.bundle


def _resize_profile(profile: Profile, size_px: tuple[int, int]) -> Profile:
    width, height = size_px
    scale = profile.image.mm_per_px * profile.image.width_px / width
    changed = {"width_px": width, "height_px": height, "mm_per_px": scale}
    image = ImageSection.model_validate(profile.image.model_dump() | changed)
    return profile.model_copy(update={"image": image})


def _take_frame(
    renderer: Renderer,
    image: ImageSection,
    ball: BallPress | None,
    number: int,
    sheared_px: float = 0.0,
) -> Frame:
    shape = (image.height_px, image.width_px)
    if ball is None:
        return renderer.take_frame(np.zeros(shape), number=number)
    x, y = ball.centre_px
    ball = replace(ball, centre_px=(x + sheared_px, y))
    displacement_mm = None
    if sheared_px:
        displacement_mm = image.mm_per_px * sheared_px * _shear(ball, shape, image.mm_per_px)
    height_mm = ball.height_mm(shape, image.mm_per_px)
    return renderer.take_frame(height_mm, displacement_mm, number=number)


def _shear(ball: BallPress, shape: tuple[int, int], mm_per_px: float) -> Pixels:
    """(H, W, 2) displacement for a unit shear along x: 1 inside the contact, decaying outside."""
    x, y = (np.arange(n) - at for n, at in zip(shape[::-1], ball.centre_px, strict=True))
    beyond = np.hypot(x, y[:, None]) * mm_per_px / ball.contact_radius_mm - 1
    along = np.clip(1 - beyond / 2.5, 0, 1)  # zero from 2.5 contact radii outside on
    return np.stack([along, np.zeros(shape)], axis=-1)
