"""Array types by dtype, whose shapes the docstrings state, and the smallest denominator."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
Bool = NDArray[np.bool_]
Complex64 = NDArray[np.complex64]
Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]
Intp = NDArray[np.intp]
UInt8 = NDArray[np.uint8]

TINY = 1e-12  # Added to denominators against division by zero
