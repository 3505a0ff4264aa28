"""What a result must be to be true of a virtual press: form, unit, sign.

A quantity that the core does not know is judged by its form alone.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import is_dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.quantities import ContactMask, Gradients, HeightMap, Quantity
from tactile_core.quantities.array_form import form_fault as array_fault
from tactile_core.testing.differences import arrays_in
from tactile_core.testing.virtual_presses import VirtualPress

_FACTOR = 3.0
"""A measurement of a ball this much too high or too low has another unit, or another model."""

_ALIKE = 0.5
_UNITS = ((1e-3, "metres"), (1e3, "micrometres"), (0.1, "centimetres"))


def quantity_fault(result: Quantity, scene: VirtualPress) -> str:
    """Say what is wrong with dtype, shape, scale or time; empty where nothing is."""
    name = type(result).__name__
    if not (is_dataclass(result) and type(result).__dataclass_params__.frozen):  # type: ignore[attr-defined]
        return f"{name} is no frozen dataclass, so that a result can be changed by whoever reads it"
    wrong = array_fault(result, scene.height_mm.shape)
    if wrong:
        return wrong
    writable = [field for field, array in arrays_in(result) if array.flags.writeable]
    if writable:
        return f"{name}.{writable[0]} is writable"
    for field, true in (
        ("mm_per_px", scene.frame.mm_per_px),
        ("timestamp_s", scene.frame.timestamp_s),
    ):
        if getattr(result, field, true) != true:
            found = getattr(result, field)
            return f"{name}.{field} is {found} where that of its input is {true}"
    return ""


def truth_fault(result: Quantity, scene: VirtualPress) -> str:
    """Say how a result of sound form contradicts the press; empty where it does not."""
    judge = _JUDGES.get(type(result))
    return (
        "" if judge is None or array_fault(result, scene.height_mm.shape) else judge(result, scene)
    )


def _height(result: Any, scene: VirtualPress) -> str:
    rest = np.median(result.mm[scene.height_mm < 0.01 * scene.height_mm.max()])
    top = np.unravel_index(np.argmax(scene.height_mm), scene.height_mm.shape)
    ratio = float((result.mm[top] - rest) / scene.height_mm[top])
    if ratio < -1 / _FACTOR:
        return "the height is negative where a ball presses the skin towards the camera"
    if 1 / _FACTOR < ratio < _FACTOR:
        return ""
    unit = f"; {guess}" if (guess := _unit(ratio, scene.frame.mm_per_px)) else ""
    return f"a ball that presses {scene.height_mm[top]:.3g} mm is measured {ratio:.3g} times{unit}"


def _unit(ratio: float, mm_per_px: float) -> str:
    units = ((1 / mm_per_px, "pixels"), *_UNITS)
    near = [name for factor, name in units if 0.5 < ratio / factor < 2]
    return f"it looks like {near[0]} in place of millimetres" if near else ""


def _slopes(result: Any, scene: VirtualPress) -> str:
    at = scene.contact
    true_x, true_y = scene.gradients[at].T
    x, y = result.x[at], result.y[at]
    across = min(_likeness(x, true_y), _likeness(y, true_x))
    for name, found, true in (("x", x, true_x), ("y", y, true_y)):
        if _likeness(found, true) < -_ALIKE:
            return f"∂z/∂{name} has the opposite sign: it must rise towards the top of a ball"
        if _likeness(found, true) < _ALIKE:
            swapped = "; ∂z/∂x and ∂z/∂y are exchanged" if across > _ALIKE else ""
            return f"∂z/∂{name} in the contact does not follow the ball{swapped}"
        factor = float(found @ true / (true @ true))
        if not 1 / _FACTOR < factor < _FACTOR:
            return f"∂z/∂{name} is {factor:.3g} times the ball's; slopes are mm per mm"
    return ""


def _contact(result: Any, scene: VirtualPress) -> str:
    top = np.unravel_index(np.argmax(scene.height_mm), scene.height_mm.shape)
    if not result.mask[top]:
        return "the mask is False where a ball touches"
    share = np.count_nonzero(result.mask) / np.count_nonzero(scene.contact)
    if not 1 / _FACTOR**2 < share < _FACTOR**2:
        return f"the mask has {share:.3g} times the area of the contact"
    return ""


def _likeness(a: NDArray[Any], b: NDArray[Any]) -> float:
    """Cosine of the angle between two lists of values; 0 where one of them is 0 everywhere."""
    size = float(np.linalg.norm(a) * np.linalg.norm(b))
    return float(a @ b) / size if size else 0.0


_JUDGES: Mapping[type[Quantity], Callable[[Any, VirtualPress], str]] = {
    HeightMap: _height,
    Gradients: _slopes,
    ContactMask: _contact,
}
