"""Options of components, calibrators, and what they return, checked."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from pydantic import BaseModel, ValidationError

from tactile_core.errors import CalibrationError, ProfileError
from tactile_core.interfaces.calibration import Calibration, Calibrator, Press
from tactile_core.interfaces.component import Component
from tactile_core.interfaces.illumination import Light
from tactile_core.plugins.blame import blame, fault
from tactile_core.plugins.registry import resolve
from tactile_core.quantities import Frame, Gradients, HeightMap, Reference, ReferenceGradients
from tactile_core.quantities.array_form import form_fault
from tactile_core.quantities.quantity import grid_of, on_demand


def options_of(cls: Any, component: Component) -> BaseModel:
    """Return the options of a component's class.

    Raises
    ------
    ProfileError
        The profile's options do not match the class's declaration.
    PluginFault
        The class's own validators fail.
    """
    with blame(f"the options of {component.use}", cls):
        try:
            options: BaseModel = cls.Options.model_validate(component.options)
        except ValidationError as error:
            first = error.errors()[0]
            where = ".".join(str(part) for part in first["loc"])
            raise ProfileError(f"{component.use}: {where}: {first['msg']}") from error
    return options


_PART = "the calibration"


def calibrator_of(component: Component, instead: str | None = None) -> Calibrator:
    """Make the calibrator that a profile names, or another one with default options.

    Parameters
    ----------
    component : Component
        From the profile.
    instead : str, optional
        ``plugin.name`` of another calibrator.

    Raises
    ------
    PluginError, ProfileError
        The calibrator does not exist or rejects the options.
    """
    cls = resolve("calibrator", component.use if instead is None else instead)
    options = options_of(cls, component if instead is None else Component(use=instead))
    with blame(_PART, cls):
        return cls(options)


def fittable_calibrator(component: Component, instead: str | None = None) -> Calibrator:
    """Make the calibrator of a sensor that is to be calibrated; see :func:`calibrator_of`.

    Raises
    ------
    CalibrationError
        The light of this sensor measures no slopes.
    """
    calibrator = calibrator_of(component, instead)
    if calibrator.refusal:
        raise CalibrationError(calibrator.refusal)
    return calibrator


def fitted_by(
    calibrator: Calibrator, presses: Sequence[Press], reference: Reference
) -> Calibration:
    """Fit a calibration and check its type."""
    with blame(_PART, calibrator):
        fitted = calibrator.fit(presses, reference)
    if not isinstance(fitted, Calibration):
        raise fault(_PART, calibrator, f"fitted {type(fitted).__name__}, not a Calibration")
    if fitted.compensation != calibrator.compensation:
        raise fault(
            _PART,
            calibrator,
            f"is fitted with compensation {calibrator.compensation!r}, but its model "
            f"{type(fitted).__name__} measures with {fitted.compensation!r}",
        )
    return fitted


def uncalibrated_by(calibrator: Calibrator, lights: Sequence[Light]) -> Calibration | None:
    """Return the model that needs no bundle, if any, and check its type."""
    with blame(_PART, calibrator):
        given = calibrator.from_lights(lights)
    if not isinstance(given, Calibration | None):
        raise fault(
            _PART, calibrator, f"made {type(given).__name__} from lights, not a Calibration"
        )
    return given


def smoothing_px_of(calibrator: Calibrator, mm_per_px: float) -> float:
    """Return the smoothing of the calibrator's models, px, and check that it is a number."""
    with blame(_PART, calibrator):
        smoothing_px = float(calibrator.smoothing_px(mm_per_px))
    if not (math.isfinite(smoothing_px) and smoothing_px >= 0):
        raise fault(_PART, calibrator, f"smooths images by {smoothing_px} px")
    return smoothing_px


def measured_by(
    calibration: Calibration, frame: Frame, reference: Reference
) -> Gradients | HeightMap:
    """Measure a frame with a calibration and check the type and form of the result."""
    with blame("the calibration", calibration):
        measured = calibration.measure(frame, reference)
    if not isinstance(measured, Gradients | HeightMap):
        wrong = f"{type(measured).__name__} instead of Gradients or a HeightMap"
    else:
        wrong = form_fault(measured, frame.pixels.shape[:2])
        wrong = wrong and f"a quantity of the wrong form: {wrong}"
    if wrong:
        raise fault("the calibration", calibration, f"returned {wrong}")
    return measured


def reference_gradients(
    calibration: Calibration, frame: Frame, reference: Reference
) -> ReferenceGradients | None:
    """Measure the frame of the reference itself; None if the calibration gives a height map."""
    measured = measured_by(calibration, frame, reference)
    if not isinstance(measured, Gradients):
        return None
    return ReferenceGradients(
        on_demand(lambda: measured.x, grid_of(measured, "x")),
        on_demand(lambda: measured.y, grid_of(measured, "y")),
    )
