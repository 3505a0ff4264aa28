"""Models that turn colours into slopes, around a reference."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, Generic, Protocol, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.light.drift import LEVELS
from tactile_core.algorithms.light.photometric import bare_mask
from tactile_core.algorithms.slopes.colour_table import ColourTable
from tactile_core.algorithms.slopes.sampling import two_within
from tactile_core.algorithms.slopes.slope_field import SlopeField
from tactile_core.algorithms.slopes.slope_grid import PressLight, SlopeCells
from tactile_core.interfaces.calibration import Calibration
from tactile_core.interfaces.for_reference import ForReference
from tactile_core.interfaces.slope_models.model_file import (
    Arrays,
    arrays_of,
    blur_from,
    part_from,
    stored_model,
    table_arrays,
    table_from,
    write_model,
)
from tactile_core.interfaces.slope_models.samples import (
    ImageShape,
    check_fitting,
    slope_field,
    takes_table,
    without_grain,
)
from tactile_core.quantities import Bool, Float32, Frame, Gradients, Reference
from tactile_core.quantities.quantity import Grid, on_demand


class SlopeFunction(Protocol):
    """A fitted function that can be stored as arrays."""

    def __call__(self, features: Float32) -> Float32:
        """Map (N, K + 2) relative changes and positions to (N, 2) components of the normal."""
        ...

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the fitted arrays by name."""
        ...

    @classmethod
    def from_arrays(cls, arrays: Arrays) -> Self:
        """Rebuild the function; LookupError, TypeError or ValueError if the arrays are wrong."""
        ...


F = TypeVar("F", bound=SlopeFunction)


@dataclass(frozen=True, eq=False)
class SlopeModel(Generic[F]):
    """A fitted function with all that is needed to measure frames. It pickles.

    Attributes
    ----------
    function : SlopeFunction
    shape : (H, W, K)
        Shape of the images that it was fitted to.
    blur_px : float
        Standard deviation of the smoothing of the images.
    table : ColourTable or None
        A faster approximation for large images; see
        :mod:`tactile_core.interfaces.slope_models.samples`.
    light_blur_px : float
        Standard deviation of the additional smoothing of the reference, against its grain.
    press_light : PressLight or None
        Tilt that a press seems to give to level gel.

    References
    ----------
    .. [1] W. Yuan, S. Dong and E. H. Adelson, "GelSight: High-Resolution Robot Tactile Sensors for
       Estimating Geometry and Force", Sensors 17(12), 2017, section 3.3: the inverse of the
       reflectance function, equation 1.
    """

    function: F
    shape: ImageShape
    blur_px: float
    table: ColourTable | None = None
    light_blur_px: float = 0.0
    press_light: PressLight | None = None
    _field: ForReference[Reference, SlopeField] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_field", ForReference(self.field))

    def measure(self, frame: Frame, reference: Reference) -> Gradients:
        """Return the slopes of one frame.

        A slope is valid where no marker hides the gel surface and at least two channels are
        neither saturated nor dark: two components need two measurements.

        Raises
        ------
        CalibrationError
            Size or number of channels of the frame or the reference differ from the training
            images, or the full scales of frame and reference differ.
        """
        check_fitting(frame, reference, self.shape)
        prepared, seen = self._field(reference), (frame.pixels, frame.marker_mask)
        cells = prepared.for_heights(*seen)
        if not cells.averaged:
            return slopes_of(frame, cells)
        return slopes_of(frame, cells, finer=lambda: prepared.measure(*seen))

    def field(self, reference: Reference) -> SlopeField:
        """Prepare the function for one reference."""
        table = self.table if takes_table(self.shape) else None
        light = without_grain(reference, self.light_blur_px)
        return slope_field(self.function, table, light, self.blur_px, self.press_light)

    def save(self, directory: Path) -> None:
        """Write ``model.npz``."""
        arrays = {"blur_px": np.array(self.blur_px), **self.function.arrays()}
        if self.light_blur_px:
            arrays["light_blur_px"] = np.array(self.light_blur_px)
        if self.table is not None:
            arrays |= table_arrays(self.table)
        if self.press_light is not None:
            arrays |= arrays_of(self.press_light)
        write_model(directory, self.shape, arrays)

    @classmethod
    def load(cls, directory: Path, function: type[F]) -> Self:
        """Read ``model.npz`` and rebuild a function of the given class.

        Raises
        ------
        CalibrationError
            The file is missing, damaged or of another model.
        """
        with stored_model(directory) as (shape, arrays):
            blur_px = blur_from(arrays, shape)
            grainy = "light_blur_px" not in arrays
            light_blur_px = 0.0 if grainy else blur_from(arrays, shape, "light_blur_px")
            press_light = part_from(PressLight, arrays) if "tilt" in arrays else None
            table = table_from(arrays) if "table" in arrays else None
            made = function.from_arrays(arrays)
            probe = made(np.zeros((2, shape[2] + 2), np.float32))
            if probe.shape != (2, 2) or not np.isfinite(probe).all():
                raise ValueError("the model does not return two finite numbers per pixel")
        return cls(made, shape, blur_px, table, light_blur_px, press_light)


def slopes_of(
    frame: Frame,
    cells: SlopeCells,
    reliable: Callable[[], Bool] | None = None,
    *,
    finer: Callable[[], SlopeCells] | None = None,
) -> Gradients:
    """Return the slopes of a frame, valid where they are measurable and reliable.

    Parameters
    ----------
    frame : Frame
    cells : SlopeCells
        The slopes, on a grid.
    reliable : callable, optional
        Returns (H, W) bool: the model's own estimate of where its slopes are reliable. Called when
        somebody reads the validity. Default: everywhere.
    finer : callable, optional
        Returns the slopes on a finer grid. Called when somebody reads those of every pixel.
    """
    shape = frame.pixels.shape[:2]
    pixels = _Pixels(cells, shape, finer)
    gx = Grid(cells.gx, cells.step_px, shape, cells.averaged)
    gy = Grid(cells.gy, cells.step_px, shape, cells.averaged)
    return Gradients(
        on_demand(lambda: pixels.slopes[0], gx),
        on_demand(lambda: pixels.slopes[1], gy),
        on_demand(lambda: _measurable(frame, reliable)),
        frame.mm_per_px,
        frame.timestamp_s,
    )


@dataclass(frozen=True, eq=False)
class _Pixels:
    """The slopes of every pixel, computed when they are read."""

    cells: SlopeCells
    shape: tuple[int, int]
    finer: Callable[[], SlopeCells] | None

    @cached_property
    def slopes(self) -> tuple[Float32, Float32]:
        return (self.finer() if self.finer else self.cells).image(self.shape)


def _measurable(frame: Frame, reliable: Callable[[], Bool] | None) -> Bool:
    valid = two_within(
        frame.pixels,
        LEVELS.dark_share * frame.full_scale,
        LEVELS.saturation_share * frame.full_scale,
    )
    if frame.marker_mask is not None:
        valid &= bare_mask(frame.marker_mask)
    measurable: Bool = valid.view(np.bool_)
    if reliable is not None:
        measurable &= reliable()
    return measurable


class SlopeCalibration(Calibration):
    """Measures with a slope model; a subclass names the class of the fitted function.

    Attributes
    ----------
    function : type of SlopeFunction
        Class of the function that :meth:`load` rebuilds.
    slopes : SlopeModel
    """

    function: ClassVar[type[SlopeFunction]]

    def __init__(self, slopes: SlopeModel[Any]) -> None:
        self.slopes = slopes

    def measure(self, frame: Frame, reference: Reference) -> Gradients:
        """Return the slopes of one frame; see :meth:`SlopeModel.measure`."""
        return self.slopes.measure(frame, reference)

    def save(self, directory: Path) -> None:
        """Write ``model.npz``."""
        self.slopes.save(directory)

    @classmethod
    def load(cls, directory: Path) -> Self:
        """Read ``model.npz``; see :meth:`SlopeModel.load`."""
        return cls(SlopeModel.load(directory, cls.function))
