"""One message to the browser: a header of JSON, then arrays and pictures as they are."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

_ALIGNED = 8  # Arrays begin at a multiple of this, as a browser's typed arrays need it


class Parts:
    """Collects what follows the header of a message."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []
        self._size = 0

    def picture(self, encoded: bytes) -> dict[str, int]:
        """Add an encoded picture; return where it is."""
        at = self._size
        padding = -len(encoded) % _ALIGNED
        self._parts += [encoded, b"\0" * padding]
        self._size += len(encoded) + padding
        return {"at": at, "bytes": len(encoded)}

    def array(self, values: NDArray[Any]) -> dict[str, Any]:
        """Add an array of uint8, uint16, int16 or float32; return where and what it is."""
        values = np.ascontiguousarray(values)
        little = values.astype(values.dtype.newbyteorder("<"), copy=False)
        place = self.picture(little.tobytes())
        return {**place, "type": values.dtype.name, "shape": list(values.shape)}

    def message(self, header: dict[str, Any]) -> bytes:
        """Return the whole message: length of the header, header, and the parts."""
        words = json.dumps(header, allow_nan=False, separators=(",", ":")).encode()
        words += b" " * (-(4 + len(words)) % _ALIGNED)
        return b"".join([struct.pack("<I", len(words)), words, *self._parts])
