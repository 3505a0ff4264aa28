"""Height, width and channels of images, and the check that frames match the model."""

from __future__ import annotations

from tactile_core.errors import CalibrationError
from tactile_core.quantities import Frame, Reference

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
