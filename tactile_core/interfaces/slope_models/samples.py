"""Samples of colour and slope, and what a model may use of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Self

import cv2
import numpy as np
from pydantic import Field, model_validator

from tactile_core.algorithms.light.photometric import to_normal_xy
from tactile_core.algorithms.slopes.colour_table import Axis, ColourTable, bake
from tactile_core.algorithms.slopes.sampling import Sampling
from tactile_core.algorithms.slopes.slope_field import Sampler, SlopeField
from tactile_core.algorithms.slopes.slope_grid import Model, PressLight, steep_share
from tactile_core.errors import CalibrationError
from tactile_core.interfaces import device
from tactile_core.interfaces.calibration import Press
from tactile_core.quantities import Float32, Frame, Reference


class SlopeOptions(device.Options):
    """Options of every calibrator whose model maps intensities to slopes."""

    blur_px: float = Field(
        default=2.0,
        ge=0,
        le=20,
        description="Gaussian smoothing against the grain of the coating: standard deviation, px.",
    )
    blur_mm: float | None = Field(
        default=None,
        ge=0,
        description="The same in mm on the gel, independent of the camera's scale; replaces "
        "blur_px.",
    )

    @model_validator(mode="after")
    def _one_blur(self) -> Self:
        if {"blur_px", "blur_mm"} <= self.model_fields_set and self.blur_mm is not None:
            raise ValueError("give blur_px or blur_mm, not both")
        return self

    def smoothing_px(self, mm_per_px: float) -> float:
        """Return the standard deviation in px for an image of this scale, at most 20."""
        return self.blur_px if self.blur_mm is None else min(20.0, self.blur_mm / mm_per_px)


def slope_field(
    function: Model,
    table: ColourTable | None,
    reference: Reference,
    blur_px: float,
    press_light: PressLight | None = None,
) -> SlopeField:
    """Prepare a fitted function for whole images."""
    return SlopeField(
        function,
        table,
        reference.pixels,
        reference.marker_mask,
        full_scale=reference.full_scale,
        blur_px=blur_px,
        press_light=press_light,
    )


def without_grain(reference: Reference, blur_px: float) -> Reference:
    """Return the illumination of a reference, without the grain of its coating.

    The grain moves with the gel surface, so that the grain of the reference differs from that under
    a press and would add to it.
    """
    if not blur_px:
        return reference
    filled = Sampling.at_every_pixel(reference.pixels.shape, reference.marker_mask, 0.0)
    pixels = filled.smooth_image(reference.pixels, reference.marker_mask)
    # Reflection with the sign reversed continues a slope beyond the border, and smoothing twice
    # keeps a curvature.
    margin = min(round(3 * blur_px), *(side - 1 for side in pixels.shape[:2]))
    planes = []
    for plane in pixels.transpose(2, 0, 1):
        wide = np.pad(plane, margin, mode="reflect", reflect_type="odd")
        once = cv2.GaussianBlur(wide, (0, 0), blur_px)
        twice = 2 * once - cv2.GaussianBlur(once, (0, 0), blur_px)
        planes.append(twice[margin : -margin or None, margin : -margin or None])
    return replace(reference, pixels=np.stack(planes, axis=2))


def is_grid(presses: Sequence[Press]) -> bool:
    """Whether the presses leave no level gel between them, as a grid of balls does.

    Only then does the change of the light by a press show. A dozen single balls would be
    extrapolated, and tilt the level gel around them.
    """
    sloped = [press.gradients.any(axis=1).mean() for press in presses if press.gradients.any()]
    # single presses have 0.8, by their share of undeformed pixels; grids 1 but for tops of balls
    return min(sloped, default=0.0) > 0.95


def press_light_of(tilt: Float32, presses: Sequence[Press]) -> PressLight:
    """Return a fitted tilt with the mean share of a frame that the presses slope."""
    frames = {id(press.frame): press.frame.pixels[..., 0].size for press in presses}
    sloped = [steep_share(to_normal_xy(p.gradients).T) * len(p.gradients) for p in presses]
    return PressLight(tilt, sum(sloped) / sum(frames.values()))


def sampler_of(reference: Reference, blur_px: float) -> Sampler:
    """Prepare the features of single pixels (relative change and position) for one reference."""
    return Sampler(
        reference.pixels, reference.marker_mask, full_scale=reference.full_scale, blur_px=blur_px
    )


ImageShape = tuple[int, int, int]  # Height and width in px, and number of channels


def shape_of(reference: Reference) -> ImageShape:
    """Return (H, W, K) of a reference's pixels."""
    height, width, channels = reference.pixels.shape
    return height, width, channels


def check_fitting(frame: Frame, reference: Reference, shape: ImageShape) -> None:
    """Check that a frame and a reference have the (H, W, K) shape that a model was fitted to.

    Raises
    ------
    CalibrationError
        The size or number of channels differs, or the full scales of frame and reference differ.
    """
    for what, pixels in (("frame", frame.pixels), ("reference", reference.pixels)):
        if pixels.shape != shape:
            raise CalibrationError(
                f"the calibration was fitted on images of {in_words(shape)} and this {what} "
                f"is {in_words(pixels.shape)}; calibrate at the size of the input"
            )
    if frame.full_scale != reference.full_scale:
        raise CalibrationError(
            f"the frame's full scale is {frame.full_scale:g} and the reference's "
            f"{reference.full_scale:g}; record both with the same bit depth"
        )


def in_words(shape: tuple[int, ...]) -> str:
    """Format an (H, W, K) shape for a message."""
    return f"{shape[1]} × {shape[0]} with {shape[2]} channels"


class SAMPLES:
    """Parameters of sampling training pixels. Nothing sets them from outside."""

    # [count] Training pixels of all presses together, at most. Neighbouring pixels of a press are
    # redundant, so that more cost time without improving the fit.
    most = 12_000
    fewest = 50  # [count] A fit needs at least this many pixels


def scale_of(presses: Sequence[Press]) -> float:
    """Return the scale of the presses in mm per px.

    Raises
    ------
    CalibrationError
        There are no presses.
    """
    if not presses:
        raise too_few(presses)
    return presses[0].frame.mm_per_px


def samples_of(
    presses: Sequence[Press],
    reference: Reference,
    *,
    blur_px: float,
    most: int = SAMPLES.most,
) -> tuple[Float32, Float32]:
    """Return features (N, K + 2) and normal_xy (N, 2) of the presses' pixels, thinned randomly.

    Saturated pixels are kept. The model then learns slopes of clipped channels from examples,
    which on real balls is more accurate than extrapolation.

    Raises
    ------
    CalibrationError
        Too few pixels to fit on, only undeformed pixels, or a press of another size than the
        reference.
    """
    for press in presses:
        if press.frame.pixels.shape != reference.pixels.shape:
            raise CalibrationError(
                f"press {press.name!r} is {in_words(press.frame.pixels.shape)} and the reference "
                f"{in_words(reference.pixels.shape)}; record both at the same size"
            )
    if not presses:
        raise too_few(presses)
    features, normal_xy = draw_samples(presses, sampler_of(reference, blur_px).features, most=most)
    if len(normal_xy) < SAMPLES.fewest or not normal_xy.any():
        raise too_few(presses)
    return features, normal_xy


def draw_samples(
    presses: Sequence[Press], features_of: Callable[..., Float32], *, most: int
) -> tuple[Float32, Float32]:
    """Return features (N, F) and normal_xy (N, 2) of randomly drawn pixels of each press.

    Parameters
    ----------
    presses : sequence of Press
        At least one.
    features_of : callable
        Called with pixels (H, W, K), marker mask, and N rows and columns, like
        :meth:`Sampler.features`.
    most : int
        Pixels of all presses together, at most.
    """
    features, normal_xy = [], []
    rng = np.random.default_rng(0)
    share = max(1, most // len(presses))
    for press in presses:
        pick = rng.permutation(len(press.rows))[:share]
        at = press.rows[pick], press.columns[pick]
        features.append(features_of(press.frame.pixels, press.frame.marker_mask, *at))
        normal_xy.append(to_normal_xy(press.gradients[pick]))
    return np.concatenate(features), np.concatenate(normal_xy)


def too_few(presses: Sequence[Press]) -> CalibrationError:
    """Return the error for presses with too few usable pixels."""
    return CalibrationError(
        f"{len(presses)} presses hold too few pixels to fit on; record more presses, or larger ones"
    )


def takes_table(shape: ImageShape) -> bool:
    """Whether images (H, W, K) are large and have three channels, so that a table saves time.

    On 160 × 120 pixels a network is as fast, and exact.
    """
    return shape[2] == 3 and shape[0] * shape[1] > 20_000


def baked(
    model: Model,
    features: Float32,
    presses: Sequence[Press],
    reference: Reference,
    blur_px: float,
) -> ColourTable | None:
    """Return a table of a model over the colours of the training pixels.

    None where it saves no time, or where the light varies so fast over the gel that the table
    does not follow the model.
    """
    shape = shape_of(reference)
    if not takes_table(shape):
        return None
    table = bake(model, Axis.spanning(features[:, :3]), aspect=shape[0] / shape[1])
    fields = [slope_field(model, each, reference, blur_px) for each in (table, None)]
    apart = []
    for press in presses[:: max(1, len(presses) // 4)]:
        frame, normals = press.frame, list[Float32]()
        for field in fields:
            gx, gy = field.measure(frame.pixels, frame.marker_mask).image(shape[:2])
            at = press.rows, press.columns
            normals.append(to_normal_xy(np.stack([gx[at], gy[at]], axis=1)))
        apart.append(np.linalg.norm(normals[0] - normals[1], axis=1))
    return table if np.concatenate(apart).mean() < _LARGEST_ERROR else None


# [sine of the angle] Mean distance of table and model: the sine of 1°, half the error of the best
# models (docs/reference/accuracy.md)
_LARGEST_ERROR = 0.0175
