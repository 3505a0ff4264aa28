"""Results of a plugin's calibration, checked."""

from __future__ import annotations

from tactile_core.interfaces.calibration import Calibration
from tactile_core.plugins.blame import blame, fault
from tactile_core.quantities import Frame, Gradients, HeightMap, Reference, ReferenceGradients
from tactile_core.quantities.array_form import form_fault
from tactile_core.quantities.quantity import grid_of, on_demand


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
