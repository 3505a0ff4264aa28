"""Measured quantities. The type of a quantity fixes its unit, its coordinate frame and its sign.

May import algorithms and errors.

Sensor frame: origin at the image centre, x right, y down, z away from the camera towards the
object (right-handed), millimetres. Arrays are read-only; every value is frozen.
"""

from tactile_core.algorithms.arrays.types import Bool, Float32
from tactile_core.quantities.fields import Field, FieldSpec, MmPerPx, TimestampS
from tactile_core.quantities.markers import DisplacementField, MarkerDetections, MarkerField
from tactile_core.quantities.observation import Frame, Image, Pixels, Reference, ShownGel
from tactile_core.quantities.quantity import Quantity
from tactile_core.quantities.slip import (
    ContactLoss,
    ContactShear,
    ContactSource,
    ContactStress,
    Friction,
    ImprintMotion,
    SlipContact,
    SlipState,
)
from tactile_core.quantities.surface import (
    ContactMask,
    Gradients,
    HeightMap,
    ReferenceGradients,
)
from tactile_core.quantities.wrench import NetworkOutput, RelativeLoad, Wrench

__all__ = [
    "Bool",
    "ContactLoss",
    "ContactMask",
    "ContactShear",
    "ContactSource",
    "ContactStress",
    "DisplacementField",
    "Field",
    "FieldSpec",
    "Float32",
    "Frame",
    "Friction",
    "Gradients",
    "HeightMap",
    "Image",
    "ImprintMotion",
    "MarkerDetections",
    "MarkerField",
    "MmPerPx",
    "NetworkOutput",
    "Pixels",
    "Quantity",
    "Reference",
    "ReferenceGradients",
    "RelativeLoad",
    "ShownGel",
    "SlipContact",
    "SlipState",
    "TimestampS",
    "Wrench",
]
