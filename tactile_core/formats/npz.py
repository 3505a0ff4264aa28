"""Arrays in NPY and NPZ files: quantities, and references."""

from __future__ import annotations

import io
import json
import math
import zipfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactile_core.errors import InputError
from tactile_core.formats.files import read_bytes, write_atomically
from tactile_core.formats.text import printable
from tactile_core.quantities import Quantity, Reference
from tactile_core.quantities.fields import fields_of
from tactile_core.quantities.quantity import Guard, pass_errors


def write_npz(path: Path, arrays: Mapping[str, ArrayLike]) -> None:
    """Write named arrays atomically.

    Raises
    ------
    ValueError
        An array contains Python objects, which would need a pickle.
    OSError
        The disk is full or not writable.
    """
    write_atomically(path, npz_bytes(arrays, str(path)))


def npz_bytes(arrays: Mapping[str, ArrayLike], where: str) -> memoryview:
    """Return the content of an ``.npz`` file with named arrays.

    Parameters
    ----------
    arrays : mapping of str to array
    where : str
        Where it will be, in messages.

    Raises
    ------
    ValueError
        An array contains Python objects, which would need a pickle.
    """
    plain = {name: np.asarray(array) for name, array in arrays.items()}
    for name, array in plain.items():
        if array.dtype.hasobject:
            raise ValueError(f"{name!r} contains Python objects and cannot be saved in {where}")
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as archive:
        for name, array in plain.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as entry:
                np.lib.format.write_array(entry, array, allow_pickle=False)
    return buffer.getbuffer()


def read_npz(path: Path) -> dict[str, NDArray[Any]]:
    """Read every array of an ``.npz`` file.

    Raises
    ------
    InputError
        The file is missing, corrupt, or contains Python objects instead of arrays.
    """
    path = Path(path)
    return npz_arrays(read_bytes(path), str(path))


def read_npy(path: Path, kind: str) -> NDArray[Any]:
    """Read the array of a ``.npy`` file, without pickles.

    Parameters
    ----------
    path : Path
    kind : {"f", "i"}
        Floating or whole numbers.

    Raises
    ------
    InputError
        The file is missing, damaged, or holds other values than finite numbers of this kind.
    """
    try:
        array = np.load(io.BytesIO(read_bytes(path)), allow_pickle=False)
        numbers = isinstance(array, np.ndarray) and array.dtype.kind == kind
    except (ValueError, EOFError, MemoryError) as error:
        raise InputError(f"{path} is no .npy file of an array; restore it from a copy") from error
    if not numbers or not array.size or not np.isfinite(array).all():
        words = {"f": "finite", "i": "whole"}[kind]
        raise InputError(f"{path} holds other values than {words} numbers; restore it from a copy")
    return np.asarray(array)


def npz_arrays(data: bytes, where: str) -> dict[str, NDArray[Any]]:
    """Return every array in the content of an ``.npz`` file.

    Parameters
    ----------
    data : bytes
    where : str
        Where it comes from, in messages.

    Raises
    ------
    InputError
        It is corrupt, or contains Python objects instead of arrays.
    """
    if not data.startswith(b"PK"):
        raise InputError(f"{where} is not an .npz file; write it again or restore it from a copy")
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            for entry in archive.infolist():
                _check(archive, entry)
        with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
            return {name: arrays[name] for name in arrays.files}
    except Exception as error:  # numpy and zipfile raise almost anything on damaged bytes
        raise InputError(
            f"{where} is corrupt or contains other values than arrays ({_first_line(error)}); "
            f"write it again or restore it from a copy"
        ) from error


def _check(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> None:
    """Reject an array whose header claims more memory than the entry stores."""
    # [bytes] Three float32 for each pixel of the largest image are fewer
    if entry.file_size > (1 << 30):
        raise ValueError(f"{printable(entry.filename)} has {entry.file_size / 1e9:.3g} GB")
    with archive.open(entry) as file:
        version = np.lib.format.read_magic(file)
        read = np.lib.format.read_array_header_1_0
        shape, _, dtype = (read if version == (1, 0) else np.lib.format.read_array_header_2_0)(file)
        stored = entry.file_size - file.tell()
    if not dtype.hasobject and math.prod(shape) * dtype.itemsize != stored:
        raise ValueError(f"the size of {printable(entry.filename)} contradicts its header")


def _first_line(error: Exception) -> str:
    return printable(str(error).splitlines()[0] if str(error) else type(error).__name__)


DESCRIPTION = "quantities"  # Name of the array that describes the others: JSON as UTF-8 bytes

Arrays = Mapping[str, NDArray[Any]]  # Arrays by name


def arrays_of(
    quantities: Iterable[Quantity], *, mm_per_px: float, guard: Guard = pass_errors
) -> dict[str, NDArray[Any]]:
    """Return the arrays of several quantities, finite everywhere, and their description.

    Arrays of two quantities that have the same name are stored once if they are equal. If they
    differ, the second is named after its quantity's type: ``Type.name``. ``mm_per_px`` is always
    included, and ``valid`` if a quantity distinguishes measured from filled-in values.

    Parameters
    ----------
    quantities : iterable of Quantity
    mm_per_px : float
        Scale of the image.
    guard : callable, optional
        Returns a context in which a quantity's own code runs, to attribute its errors.
    """
    merged: dict[str, NDArray[Any]] = {}
    described: dict[str, Any] = {}
    validity: NDArray[Any] | None = None
    for quantity in quantities:
        with guard(quantity):
            clean = quantity.finite()
            own = {str(name): _finite(np.asarray(a)) for name, a in clean.arrays().items()}
            fields = fields_of(type(quantity))
        stored = {name: _place(merged, name, array, quantity) for name, array in own.items()}
        merged.update((stored[name], array) for name, array in own.items())
        kind = type(quantity)
        title = kind.__name__ if kind.__name__ not in described else _full_name(kind)
        described[title] = {
            "arrays": stored,
            "none": [f.spec.saved_as for f in fields if getattr(quantity, f.name) is None],
            "fields": {field.name: field.describe_field() for field in fields},
        }
        for field in fields:
            if field.spec.validity and validity is None:
                validity = own.get(field.spec.saved_as)
    if validity is not None:
        merged.setdefault("valid", validity)
    merged.setdefault("mm_per_px", np.asarray(mm_per_px))
    text = json.dumps(described).encode()
    merged[DESCRIPTION] = np.frombuffer(text, np.uint8)
    return merged


def quantities_in(arrays: Arrays, *kinds: type[Quantity]) -> dict[type[Quantity], Quantity]:
    """Restore quantities of the given types; types that the arrays lack are left out.

    Raises
    ------
    InputError
        The description is missing or invalid, or a quantity's array is missing or has the wrong
        shape.
    """
    try:
        described: Mapping[str, Any] = json.loads(np.asarray(arrays[DESCRIPTION]).tobytes())
        found: dict[type[Quantity], Quantity] = {}
        for kind in kinds:
            entry = described.get(_full_name(kind), described.get(kind.__name__))
            if entry is not None:
                missing = set(entry["none"])
                own = {
                    name: arrays[place]
                    for name, place in entry["arrays"].items()
                    if name not in missing
                }
                found[kind] = kind.from_arrays(own)
    except (LookupError, ValueError, TypeError, AttributeError) as error:
        raise InputError(
            f"these are not the arrays of a reading ({error}); run the measurement again"
        ) from error
    return found


def read_quantities(path: Path, *kinds: type[Quantity]) -> dict[type[Quantity], Quantity]:
    """Read quantities of the given types from an ``.npz`` that a run wrote.

    Raises
    ------
    InputError
        The file is missing, corrupt or not written by a run.
    """
    arrays = read_npz(path)
    try:
        return quantities_in(arrays, *kinds)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def reference_arrays(reference: Reference) -> dict[str, Any]:
    """Return the arrays of a reference; its detected markers are left out."""
    arrays: dict[str, Any] = {
        "pixels": reference.pixels,
        "channels": np.array(reference.channels),
        "full_scale": reference.full_scale,
        "noise": reference.noise,
        "frames": reference.frames,
    }
    if reference.marker_mask is not None:
        arrays["marker_mask"] = reference.marker_mask
    if reference.relative:
        arrays["relative"] = True
    return arrays


def reference_of(arrays: Mapping[str, NDArray[Any]]) -> Reference:
    """Return the reference of some arrays.

    Raises
    ------
    ValueError, LookupError, TypeError, OverflowError
        An array is missing or has the wrong form.
    """
    reference = Reference(
        pixels=arrays["pixels"],
        channels=tuple(str(name) for name in arrays["channels"]),
        full_scale=float(arrays["full_scale"]),
        noise=float(arrays["noise"]),
        frames=int(arrays["frames"]),
        marker_mask=arrays.get("marker_mask"),
        relative=bool(arrays.get("relative", False)),
    )
    pixels, marker_mask = reference.pixels, reference.marker_mask
    if not (
        pixels.ndim == 3
        and pixels.shape[2] == len(reference.channels)
        and pixels.dtype == np.float32
        and np.isfinite(pixels).all()
        and (
            marker_mask is None
            or (marker_mask.shape == pixels.shape[:2] and marker_mask.dtype == bool)
        )
        and np.isfinite([reference.full_scale, reference.noise]).all()
        and reference.full_scale > 0
        and reference.noise >= 0
        and reference.frames >= 1
    ):
        raise ValueError("these are not the arrays of a reference")
    return reference


def _place(merged: Arrays, name: str, array: NDArray[Any], quantity: Quantity) -> str:
    stored = merged.get(name)
    if stored is None or (stored.dtype == array.dtype and np.array_equal(stored, array)):
        return name
    return f"{type(quantity).__name__}.{name}"


def _full_name(kind: type[Quantity]) -> str:
    return f"{kind.__module__}.{kind.__qualname__}"


def _finite(array: NDArray[Any]) -> NDArray[Any]:
    if array.dtype.kind != "f" or np.isfinite(array).all():
        return array
    return np.where(np.isfinite(array), array, array.dtype.type(0))
