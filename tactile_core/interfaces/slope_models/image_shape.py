"""Height, width and channels of the images that a model was fitted on, and of those it is given."""

from __future__ import annotations

from tactile_core.errors import CalibrationError
from tactile_core.quantities import Frame, Reference

ImageShape = tuple[int, int, int]
"""Height and width in px, and number of channels."""


def shape_of(reference: Reference) -> ImageShape:
    """(H, W, K) of the images that are measured."""
    height, width, channels = reference.pixels.shape
    return height, width, channels


def check_fitting(frame: Frame, reference: Reference, shape: ImageShape) -> None:
    """Refuse a frame or a reference that a model of (H, W, K) images was not fitted for.

    Raises
    ------
    CalibrationError
        One has another size or number of channels, or they have another full scale than each other.
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
    """An (H, W, K) shape, for a message."""
    return f"{shape[1]} × {shape[0]} with {shape[2]} channels"
