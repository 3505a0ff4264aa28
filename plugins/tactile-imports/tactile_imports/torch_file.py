"""Files of PyTorch, read without PyTorch and without running anything that they name.

``torch.save`` writes a zip archive [1]_: ``data.pkl`` is a pickle of the object, in which a tensor
is a call of ``torch._utils._rebuild_tensor_v2`` with a persistent id, and ``data/KEY`` has the
numbers of the storage with this key, as raw bytes. A pickle can name any function. This reader
knows a handful of names and refuses every other.

References
----------
.. [1] PyTorch documentation, "Serialization semantics", section "Serialized file format".
"""

from __future__ import annotations

import io
import pickle
import pickletools
import zipfile
from collections import OrderedDict
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray

from tactile_core.errors import InputError
from tactile_core.formats.files import read_bytes

# [bytes] Of all tensors together; a known network has 18 MB
_LARGEST = 1 << 26

_STORAGES: Mapping[str, str] = {"FloatStorage": "f4", "DoubleStorage": "f8", "LongStorage": "i8"}


def read_torch_file(path: Path) -> Any:
    """Return the object in a file of ``torch.save``.

    Parameters
    ----------
    path : Path

    Returns
    -------
    object
        Of dictionaries, lists, numbers and text; each tensor is an array of float32, float64 or
        int64.

    Raises
    ------
    InputError
        The file is none of PyTorch, is damaged, or names anything else than tensors.
    """
    data = read_bytes(path)
    if not data.startswith(b"PK"):
        raise InputError(
            f"{path} is no zip archive of torch.save; save the network again with PyTorch 1.6 or "
            "later"
        )
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            return _Archive(archive, path).read()
    except InputError:
        raise
    except Exception as error:  # pickle and zipfile raise almost anything on damaged bytes
        raise InputError(
            f"{path} holds no tensors that can be read ({type(error).__name__}); save the network "
            "again with torch.save"
        ) from error


class _Archive:
    """The entries of one file, below the folder that all of them share."""

    def __init__(self, archive: zipfile.ZipFile, path: Path) -> None:
        self._archive, self._path = archive, path
        (pickled,) = (name for name in archive.namelist() if name.rpartition("/")[2] == "data.pkl")
        self._folder = pickled.removesuffix("data.pkl")
        self._bytes = 0  # until now
        self._storages: dict[tuple[str, str, int], NDArray[Any]] = {}

    def read(self) -> Any:
        pickled = self._entry("data.pkl")
        for opcode, argument, _ in pickletools.genops(pickled):
            # the unpickler reserves memory up to the largest number of its memo
            if "PUT" in opcode.name and argument is not None and argument >= len(pickled):
                raise ValueError("the memo is larger than the pickle")
        return _Unpickler(pickled, self._storage, self._path).load()

    def _entry(self, name: str) -> bytes:
        entry = self._archive.getinfo(self._folder + name)
        self._bytes += entry.file_size
        if self._bytes > _LARGEST:
            raise InputError(
                f"{self._path} has {entry.file_size / 1e6:.0f} MB in {name}, too much for a "
                "network that measures slopes; give the file of such a network"
            )
        return self._archive.read(entry)

    def _storage(self, dtype: str, key: str, count: int) -> NDArray[Any]:
        """Return the numbers of a storage, which several tensors may show."""
        named = dtype, key, count
        if named not in self._storages:
            self._storages[named] = self._read_storage(*named)
        return self._storages[named]

    def _read_storage(self, dtype: str, key: str, count: int) -> NDArray[Any]:
        order = self._entry("byteorder") if self._has("byteorder") else b"little"
        kind = np.dtype(dtype).newbyteorder(">" if order == b"big" else "<")
        numbers = np.frombuffer(self._entry(f"data/{key}"), kind)
        if len(numbers) != count:
            raise ValueError("a storage has another size than the pickle says")
        return numbers.astype(kind.newbyteorder("="))

    def _has(self, name: str) -> bool:
        return self._folder + name in self._archive.namelist()


class _Unpickler(pickle.Unpickler):
    """Builds dictionaries and tensors, and looks up nothing by its name."""

    def __init__(
        self, pickled: bytes, storage: Callable[[str, str, int], NDArray[Any]], path: Path
    ) -> None:
        super().__init__(io.BytesIO(pickled))
        self._storage, self._path = storage, path

    def find_class(self, module: str, name: str) -> Any:
        """Return what an admitted name stands for."""
        if (module, name) == ("collections", "OrderedDict"):
            return OrderedDict
        if (module, name) == ("torch._utils", "_rebuild_tensor_v2"):
            return _tensor
        if module == "torch" and name in _STORAGES:
            return _STORAGES[name]
        raise InputError(
            f"{self._path} names {module}.{name}, which is no tensor and is not run; save only the "
            "network's numbers, torch.save(network.state_dict(), FILE)"
        )

    def persistent_load(self, pid: Any) -> NDArray[Any]:
        """Return the numbers of a storage."""
        what, dtype, key, _, count = pid  # where it was in memory does not matter
        if what != "storage" or dtype not in _STORAGES.values():
            raise ValueError("a persistent id is of no storage")
        return self._storage(dtype, str(key), int(count))


def _tensor(
    numbers: NDArray[Any], offset: int, size: tuple[int, ...], stride: tuple[int, ...], *_: Any
) -> NDArray[Any]:
    """Return the part of a storage that a tensor shows; further arguments are of training."""
    if not isinstance(numbers, np.ndarray) or min((offset, *size, *stride), default=0) < 0:
        raise ValueError("a tensor is not of a storage")
    last = offset + sum((n - 1) * step for n, step in zip(size, stride, strict=True))
    if np.prod(size, dtype=float) > len(numbers) or last >= len(numbers):
        raise ValueError("a tensor reaches beyond its storage")
    steps = tuple(step * numbers.itemsize for step in stride)
    return as_strided(numbers[offset:], size, steps).copy()
