"""Ground truth of a recording: one ``.npz`` per frame, under the frame's name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.errors import InputError
from tactile_core.formats.npz import read_npz

Arrays = Mapping[str, NDArray[Any]]

_SCALE_TOLERANCE = 0.01  # Largest relative difference of scale, as a ratio. Chosen by hand.
# Arrays that are not measured quantities, so they have no ground truth.
_WITHOUT_TRUTH = frozenset({"valid", "mm_per_px"})


@dataclass(frozen=True)
class Truth:
    """A folder of ``NAME.npz`` with ground truth under the names that ``tactile run`` writes."""

    folder: Path

    def check(self, names: list[str]) -> None:
        """Check that the folder has the truth of every frame.

        Raises
        ------
        InputError
            A file is missing; the message names it and the file with the most similar name.
        """
        if not self.folder.is_dir():
            raise InputError(f"{self.folder}: there is no such folder; correct --truth")
        there = sorted(path.stem for path in self.folder.glob("*.npz"))
        for name in names:
            if name not in there:
                near = get_close_matches(name, there, 1)
                nearest = f"the nearest is {near[0]}.npz" if near else f"it has {len(there)} .npz"
                raise InputError(
                    f"{self.folder} has no {name}.npz with the truth of that frame ({nearest}); "
                    f"give the truth of this recording"
                )

    def read_arrays(self, name: str) -> Arrays:
        """Read the true arrays of a frame; raises as :meth:`check` if they are missing."""
        path = self.path(name)
        if not path.is_file():
            self.check([name])
        return read_npz(path)

    def path(self, name: str) -> Path:
        """Path of a frame's ground truth."""
        return self.folder / f"{name}.npz"


def common_names(measured: Arrays, truth: Arrays, path: Path) -> list[str]:
    """Return the names of numeric arrays that both have.

    Lists of markers are left out, because their correspondence is unknown.

    Raises
    ------
    InputError
        The shapes of an array differ, the scales differ by more than 1 %, or the true scale is
        not one number.
    """
    if "mm_per_px" in measured and "mm_per_px" in truth:
        true, scale = _scale(truth["mm_per_px"], path), float(measured["mm_per_px"])
        if abs(true / scale - 1) > _SCALE_TOLERANCE:
            raise InputError(
                f"{path} has {true:g} mm per pixel and the recording {scale:g}; give the truth of "
                f"this recording"
            )
    names = []
    for name in measured:
        if name not in truth or name in _WITHOUT_TRUTH or name.startswith("marker"):
            continue
        if not (_is_number(measured[name]) and _is_number(truth[name])):
            continue
        _check_size(truth[name].shape, measured[name].shape, f"{path}: {name}")
        if measured[name].ndim > 1 and "contact" in truth:
            # the true contact masks the other arrays, even if no contact was measured
            _check_size(truth["contact"].shape, measured[name].shape[:2], f"{path}: contact")
        if not np.isfinite(truth[name]).all():
            raise InputError(f"{path}: {name} is not finite everywhere; write the truth again")
        names.append(name)
    return names


def _scale(array: NDArray[Any], path: Path) -> float:
    if array.size != 1 or not _is_number(array):
        raise InputError(f"{path}: mm_per_px is not one number; write the truth again")
    return float(array.item())


def _is_number(array: NDArray[Any]) -> bool:
    return array.dtype.kind in "biuf"


def _check_size(true: tuple[int, ...], measured: tuple[int, ...], what: str) -> None:
    if true != measured:
        raise InputError(
            f"{what} is {_format_shape(true)} but {_format_shape(measured)} was measured; give the "
            f"truth of this recording"
        )


def _format_shape(shape: tuple[int, ...]) -> str:
    return " × ".join(str(side) for side in shape) or "one number"
