"""Compares results with the ground truth of a virtual press: form, unit, sign.

For quantities that the core does not define, only the form is checked.
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

_FACTOR = 3.0  # Largest ratio between a measurement of a ball and its ground truth

_SIMILAR = 0.5  # Smallest cosine similarity between measured and true slopes along the same axis

# Ratios of a height in a wrong unit to the height in mm, with the name of the unit.
_UNITS = ((1e-3, "metres"), (1e3, "micrometres"), (0.1, "centimetres"))


def quantity_fault(result: Quantity, scene: VirtualPress) -> str:
    """Return a fault in dtype, shape, scale or time, or ""."""
    name = type(result).__name__
    if not (is_dataclass(result) and type(result).__dataclass_params__.frozen):  # type: ignore[attr-defined]
        return f"{name} is not a frozen dataclass, so any reader could change a result"
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
            return f"{name}.{field} is {found}, but that of its input is {true}"
    return ""


def truth_fault(result: Quantity, scene: VirtualPress) -> str:
    """Return how a result of valid form contradicts the ground truth of the press, or ""."""
    compare = _COMPARISONS.get(type(result))
    if compare is None or array_fault(result, scene.height_mm.shape):
        return ""
    return compare(result, scene)


def _height(result: Any, scene: VirtualPress) -> str:
    rest = np.median(result.mm[scene.height_mm < 0.01 * scene.height_mm.max()])
    top = np.unravel_index(np.argmax(scene.height_mm), scene.height_mm.shape)
    ratio = float((result.mm[top] - rest) / scene.height_mm[top])
    if ratio < -1 / _FACTOR:
        return "the height is negative where a ball presses the surface towards the camera"
    if 1 / _FACTOR < ratio < _FACTOR:
        return ""
    unit = f"; {guess}" if (guess := _unit(ratio, scene.frame.mm_per_px)) else ""
    true_mm = scene.height_mm[top]
    return f"an indentation of {true_mm:.3g} mm is measured {ratio:.3g} times as large{unit}"


def _unit(ratio: float, mm_per_px: float) -> str:
    units = ((1 / mm_per_px, "pixels"), *_UNITS)
    near = [name for factor, name in units if 0.5 < ratio / factor < 2]
    return f"the unit seems to be {near[0]} instead of millimetres" if near else ""


def _slopes(result: Any, scene: VirtualPress) -> str:
    at = scene.contact
    true_x, true_y = scene.gradients[at].T
    x, y = result.x[at], result.y[at]
    across = min(_similarity(x, true_y), _similarity(y, true_x))
    for name, found, true in (("x", x, true_x), ("y", y, true_y)):
        if _similarity(found, true) < -_SIMILAR:
            return f"∂z/∂{name} has the opposite sign: heights rise towards the top of a ball"
        if _similarity(found, true) < _SIMILAR:
            swapped = "; ∂z/∂x and ∂z/∂y are swapped" if across > _SIMILAR else ""
            return f"∂z/∂{name} in the contact area does not match the ball{swapped}"
        factor = float(found @ true / (true @ true))
        if not 1 / _FACTOR < factor < _FACTOR:
            return f"∂z/∂{name} is {factor:.3g} times the ball's; slopes are mm per mm"
    return ""


def _contact(result: Any, scene: VirtualPress) -> str:
    top = np.unravel_index(np.argmax(scene.height_mm), scene.height_mm.shape)
    if not result.mask[top]:
        return "the mask is False in the contact area of a ball"
    share = np.count_nonzero(result.mask) / np.count_nonzero(scene.contact)
    if not 1 / _FACTOR**2 < share < _FACTOR**2:
        return f"the area of the mask is {share:.3g} times the contact area"
    return ""


def _similarity(a: NDArray[Any], b: NDArray[Any]) -> float:
    """Return the cosine similarity of two vectors; 0 if one of them is zero."""
    size = float(np.linalg.norm(a) * np.linalg.norm(b))
    return float(a @ b) / size if size else 0.0


_COMPARISONS: Mapping[type[Quantity], Callable[[Any, VirtualPress], str]] = {
    HeightMap: _height,
    Gradients: _slopes,
    ContactMask: _contact,
}
