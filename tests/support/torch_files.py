"""Files in the layout of ``torch.save``, written without PyTorch."""

from __future__ import annotations

import struct
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

_STORAGES = {"f4": "FloatStorage", "f8": "DoubleStorage", "i8": "LongStorage", "f2": "HalfStorage"}
_ORDERED_DICT = b"ccollections\nOrderedDict\n)R"


def write_torch_file(
    path: Path,
    saved: Mapping[str, Any],
    *,
    pickled: bytes | None = None,
    drop: str = "",
) -> Path:
    """Write nested dictionaries of arrays, numbers and text.

    Parameters
    ----------
    path : Path
    saved : mapping
    pickled : bytes, optional
        What to write in place of the pickle of ``saved``.
    drop : str
        An entry to leave out.
    """
    storages: list[bytes] = []
    pickle = b"\x80\x02" + _value(saved, storages) + b"."
    entries = {"data.pkl": pickled or pickle, "byteorder": b"little", "version": b"3\n"}
    entries |= {f"data/{number}": data for number, data in enumerate(storages)}
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in entries.items():
            if name != drop:
                archive.writestr(f"{path.stem}/{name}", data)
    return path


def _value(value: Any, storages: list[bytes]) -> bytes:
    if isinstance(value, Mapping):
        items = b"".join(_value(part, storages) for item in value.items() for part in item)
        return _ORDERED_DICT + b"(" + items + b"u"
    if isinstance(value, np.ndarray):
        return _tensor(value, storages)
    if isinstance(value, str):
        return b"X" + struct.pack("<I", len(value.encode())) + value.encode()
    if isinstance(value, tuple):
        return b"(" + b"".join(_value(part, storages) for part in value) + b"t"
    return b"J" + struct.pack("<i", value)


def _tensor(array: np.ndarray[Any, Any], storages: list[bytes]) -> bytes:
    storage = _STORAGES[array.dtype.str[1:]].encode()
    key = str(len(storages))
    storages.append(array.tobytes())  # in the order of C, whatever the strides of the array
    strides = tuple(int(np.prod(array.shape[axis + 1 :])) for axis in range(array.ndim))
    persistent = (
        b"("
        + _value("storage", storages)
        + b"ctorch\n"
        + storage
        + b"\n"
        + _value(key, storages)
        + _value("cpu", storages)
        + _value(array.size, storages)
        + b"tQ"
    )
    arguments = persistent + _value(0, storages) + _value(array.shape, storages)
    arguments += _value(strides, storages) + b"\x89" + _ORDERED_DICT
    return b"ctorch._utils\n_rebuild_tensor_v2\n(" + arguments + b"tR"
