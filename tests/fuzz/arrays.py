"""Mutations of ``.npz`` archives: other shapes and types, NaN, pickles and false headers."""

from __future__ import annotations

import io
import zipfile
from random import Random
from typing import Any

import numpy as np
from numpy.typing import NDArray


def corrupted_npz(data: bytes, rng: Random) -> bytes:
    """Return the archive with one array changed, removed, added or with a false header."""
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
    except Exception:  # already corrupted
        return data[: rng.randrange(len(data) + 1)]
    if not arrays:
        return b""
    name = rng.choice(sorted(arrays))
    kind = rng.randrange(8)
    if kind == 0:
        del arrays[name]
    elif kind == 1:
        arrays[rng.choice(("", "../up", "x", "é"))] = arrays[name]
    elif kind == 2:
        return _with_header(arrays, name, rng)
    else:
        arrays[name] = changed_array(arrays[name], rng)
    buffer = io.BytesIO()
    save = np.savez_compressed if rng.random() < 0.2 else np.savez
    save(buffer, **arrays)
    return buffer.getvalue()


def changed_array(array: NDArray[Any], rng: Random) -> NDArray[Any]:
    """Return the array with another shape, type or content."""
    kind = rng.randrange(11)
    plain = array.astype(np.float64) if array.dtype.kind in "fiub" else np.zeros(3)
    if kind == 0:
        return array[..., None]
    if kind == 1:
        return array.reshape(-1)
    if kind == 2:
        return array[:0] if array.ndim else array
    if kind == 3:
        return np.array(rng.choice((0, -1, np.nan, np.inf, 1e300, 3)))
    if kind == 4:
        return plain * rng.choice((np.nan, np.inf, 0.0, -1.0, 1e30, 1e-30))
    if kind == 5:
        spotted = plain.copy()
        spotted.flat[: max(1, spotted.size // 7)] = rng.choice((np.nan, np.inf, -1e9))
        return spotted.astype(np.float32)
    if kind == 6:
        return plain.astype(rng.choice((np.float16, np.complex64, np.int8, np.bool_)), copy=True)
    if kind == 7:
        return np.array(["a", "é", ""])
    if kind == 8:
        return np.array([None, {"a": 1}], dtype=object)
    if kind == 9:
        return np.ascontiguousarray(array.T)
    return array[1:] if array.ndim and len(array) > 1 else array


def _with_header(arrays: dict[str, NDArray[Any]], target: str, rng: Random) -> bytes:
    """Return an archive with a header for one array that does not match its data."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, array in arrays.items():
            entry = io.BytesIO()
            np.lib.format.write_array(entry, array, allow_pickle=False)
            content = entry.getvalue()
            if name == target:
                shape = rng.choice(
                    (b"(-1,)", b"(10**9,10**9)", b"(99999999999,)", b"(None,)", b"x")
                )
                header = b"{'descr': '<f8', 'fortran_order': False, 'shape': " + shape + b", }"
                wrong = rng.choice((b"", content[:40], header, b"\x93NUMPY\x09\x00v\x00" + header))
                head = b"\x93NUMPY\x01\x00" + len(header + b"\n").to_bytes(2, "little")
                content = head + header + b"\n" if wrong == header else wrong
            archive.writestr(f"{name}.npy", content)
    return buffer.getvalue()
